"""Commands whose help is wrapped to the width of the terminal, and shows a flag without a type."""

from typing import Any

from typer.core import TyperCommand, TyperGroup

__all__ = ["Command", "Group"]


def without_type(parameters: list[Any]) -> list[Any]:
    """Return parameters whose flags have no type in the help."""
    for one in parameters:
        if getattr(one, "is_flag", False) and one.metavar is None:
            one.metavar = ""
    return parameters


def unwrapped(text: str | None) -> str | None:
    """Return a text whose paragraphs are single lines, so that only the terminal wraps them.

    Examples
    --------
    >>> unwrapped("First\\nline.\\n\\nSecond.")
    'First line.\\n\\nSecond.'
    """
    return text and "\n\n".join(" ".join(part.split()) for part in text.split("\n\n"))


class Command(TyperCommand):
    """A command."""

    def __init__(self, *args: Any, **options: Any) -> None:
        """Create a command; `help` may be the text of a docstring."""
        super().__init__(*args, **options)
        self.help = unwrapped(self.help)

    def get_params(self, ctx: Any) -> list[Any]:
        """Return the parameters, --help included."""
        return without_type(super().get_params(ctx))


class Group(TyperGroup):
    """A group of commands."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Return the parameters, --help included."""
        return without_type(super().get_params(ctx))

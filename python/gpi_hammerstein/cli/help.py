"""Commands whose help shows a flag by its name alone, without the type of a value that it does not take."""

from typing import Any

from typer.core import TyperCommand, TyperGroup

__all__ = ["Command", "Group"]


def without_type(parameters: list[Any]) -> list[Any]:
    """Return parameters whose flags have no type in the help."""
    for one in parameters:
        if getattr(one, "is_flag", False) and one.metavar is None:
            one.metavar = ""
    return parameters


class Command(TyperCommand):
    """A command."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Return the parameters, --help included."""
        return without_type(super().get_params(ctx))


class Group(TyperGroup):
    """A group of commands."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Return the parameters, --help included."""
        return without_type(super().get_params(ctx))

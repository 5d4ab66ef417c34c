"""Cells and sentences that the comparisons of models and of fleets share."""

from collections.abc import Sequence

from gpi_hammerstein.difference.significance import LEVEL

SHARE = f"{100 * LEVEL:g} %"


def shown(value: float | None, width: int, digits: int) -> str:
    """Return a number in a column; a dash if it is not known."""
    return f"{'-' if value is None else format(value, f'.{digits}g'):>{width}}"


def verdict(differs: bool | None) -> str:
    """Return the decision on a row in words."""
    return {True: "differs", False: "", None: "not tested"}[differs]


def conclusion(differing: Sequence[str], tests: int, what: str) -> str:
    """Return the result of all tests as a sentence."""
    if not tests:
        return f"None of the {what} could be tested."
    if not differing:
        return f"None of the {tests} tested {what} differs beyond its uncertainty."
    verb = "differs" if len(differing) == 1 else "differ"
    return (
        f"{len(differing)} of the {tests} tested {what} {verb} beyond the uncertainty: "
        f"{', '.join(differing)}. "
        f"If all were equal, any would be named with a probability of at most {SHARE} (procedure of Holm)."
    )

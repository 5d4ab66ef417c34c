"""How uncertain numbers and decisions are printed: on the terminal, in sentences and in the report."""

from collections.abc import Mapping
from typing import Any

# Standard deviations on each side of a value between which 95 % of a normal distribution lie.
BAND = 1.96

NOT_DETERMINED = "not determined"

# Below a table of residual tests in which a p-value is missing.
OF_SIZE = (
    "A test without a p-value has a threshold of practical size: a deviation below it may be significant, "
    "but is too small to matter."
)

__all__ = ["BAND", "NOT_DETERMINED", "OF_SIZE", "p_value_in_words", "spread"]


def p_value_in_words(test: Mapping[str, Any]) -> str:
    """Return the p-value of a residual test as text; a dash where the threshold is one of practical size.

    Parameters
    ----------
    test
        A row of ``residual_tests``.

    Returns
    -------
    str
        The p-value, or a dash.

    Examples
    --------
    >>> p_value_in_words({"p_value": 0.25}), p_value_in_words({"p_value": None})
    ('0.25', '-')
    """
    return "-" if test["p_value"] is None else f"{test['p_value']:.2g}"


def spread(row: Mapping[str, Any]) -> str:
    """Return half the width of the 95 % interval of a parameter as text.

    Parameters
    ----------
    row
        A parameter: ``value``, ``std``, and whether it is ``determined``.

    Returns
    -------
    str
        ``± 0.2``, or nothing where no standard deviation was estimated.

    Examples
    --------
    >>> spread({"value": 3.0, "std": 0.1}), spread({"value": 3.0, "std": 0.0})
    ('± 0.2', '')
    """
    return f"± {BAND * row['std']:.2g}" if row["std"] else ""

"""The rule by which errors on another record are counted, in words.

`Model.on_another_record` documents the rule itself. Commands, their JSON and the report state it beside the
number.
"""

from collections.abc import Sequence

from gpi_hammerstein._native import Explanation

__all__ = ["rule_in_words", "rule_of"]


def rule_in_words(
    *, fit_start: bool = True, remove_mean: bool = False, left_out: Sequence[str] = (), split: bool = False
) -> str:
    """Return how an error on data that took no part in the fit was counted.

    Parameters
    ----------
    fit_start
        Whether unknown initial states were estimated from the data.
    remove_mean
        Whether the mean of each experiment's residual was removed.
    left_out
        Names of the effects that were left out.
    split
        Whether the data are a part of the training record, simulated as a continuation of it.

    Returns
    -------
    str
        The initial state, the offset, the samples and the effects.

    Examples
    --------
    >>> rule_in_words(fit_start=False, left_out=["drift"])
    'from the steady state at the first input, offset of the model kept, warm-up not scored, without drift'
    """
    if split:
        start = "initial state as fitted to the training data"
    elif fit_start:
        start = "initial state fitted unless the record begins at rest"
    else:
        start = "from the steady state at the first input"
    offset = "mean of the residual removed" if remove_mean else "offset of the model kept"
    without = f", without {', '.join(left_out)}" if left_out else ""
    return f"{start}, {offset}, warm-up not scored{without}"


def rule_of(found: Explanation) -> str:
    """Return how the held-out errors of an explanation were counted.

    Parameters
    ----------
    found
        The result of `explain`.

    Returns
    -------
    str
        As `rule_in_words`.

    Examples
    --------
    >>> rule_of(found)  # doctest: +SKIP
    'initial state as fitted to the training data, offset of the model kept, warm-up not scored'
    """
    if not found.on_another_record:
        return rule_in_words(split=True)
    return rule_in_words(left_out=found.model.functions_of_time)

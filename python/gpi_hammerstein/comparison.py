"""The comparison of a model with simple rivals, in words."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

__all__ = ["compared_in_words", "rival_rows"]


def compared_in_words(
    rivals: Sequence[Mapping[str, Any]], own: float | None, unit: str = ""
) -> Iterator[str]:
    """Yield one sentence that compares a model with the best of its simple rivals.

    Parameters
    ----------
    rivals
        The rows of `rivals`.
    own
        The rms error of the model on the same held-out data, in the outputs' unit; None if it is not known.
    unit
        The unit of the outputs.

    Yields
    ------
    str
        The sentence; nothing if no error on held-out data is known.

    Examples
    --------
    >>> rows = [{"name": "fir", "detail": "12 lags", "holdout_rms": 0.3}]
    >>> list(compared_in_words(rows, 0.1, "um"))
    ['On held-out data, the best simple model is fir (12 lags): 0.3 um rms, and this model 0.1 um.']
    """
    scored = [row for row in rivals if row["holdout_rms"] is not None]
    if own is None or not scored:
        return
    space = f" {unit}" if unit else ""
    best = min(scored, key=lambda row: row["holdout_rms"])
    yield (
        f"On held-out data, the best simple model is {best['name']} ({best['detail']}): "
        f"{best['holdout_rms']:.4g}{space} rms, and this model {own:.4g}{space}."
        + (" The simple model is better." if best["holdout_rms"] < own else "")
    )


def rival_rows(rivals: Sequence[Mapping[str, Any]]) -> list[list[str]]:
    """Return the cells of a table: name, what was chosen, and both rms errors.

    Parameters
    ----------
    rivals
        The rows of `rivals`.

    Returns
    -------
    list of list of str
        One list a rival.

    Examples
    --------
    >>> rival_rows([{"name": "fir", "detail": "12 lags", "train_rms": 0.25, "holdout_rms": 0.3}])
    [['fir', '12 lags', '0.25', '0.3']]
    """

    def shown(rms: float | None) -> str:
        return "-" if rms is None else f"{rms:.4g}"

    return [
        [row["name"], row["detail"], shown(row["train_rms"]), shown(row["holdout_rms"])] for row in rivals
    ]

"""Samples as base64 text of small numbers, for typed arrays in the browser.

A signal ``x`` is stored as 16 bit integers ``q`` with ``x = offset + step q`` if the rounding error, which is
at most half a step, is small enough. It is stored as 32 bit floating point numbers ``x - offset`` otherwise.
Both are little-endian.
"""

import base64
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Largest integer of a sample. Its negative is the smallest one.
LARGEST = 32_767
# Largest absolute value of a signal with 4 bytes; the differences of two such values do not overflow.
MOST = 1e38


def bytes_of(values: Array, largest_step: float) -> int:
    """Return the number of bytes of one packed sample.

    Parameters
    ----------
    values
        The signal, shape (samples,).
    largest_step
        The largest step of integers that is fine enough, in the signal's unit.

    Returns
    -------
    int
        2 or 4.

    Examples
    --------
    >>> bytes_of(np.array([0.0, 1.0]), 0.01), bytes_of(np.array([0.0, 1.0]), 1e-9)
    (2, 4)
    """
    if len(values) == 0 or np.abs(values).max() > MOST:
        return 2
    return 2 if np.ptp(values) <= 2 * LARGEST * largest_step else 4


def packed(values: Array, size: int) -> dict[str, Any]:
    """Return a signal as text.

    Parameters
    ----------
    values
        The signal, shape (samples,).
    size
        Bytes of one sample, 2 or 4.

    Returns
    -------
    dict
        ``kind`` (``i2`` or ``f4``), ``offset``, ``step`` (1 for ``f4``) and ``data``, base64 text.

    Examples
    --------
    >>> packed(np.array([1.0, 1.0]), 2)
    {'kind': 'i2', 'offset': 1.0, 'step': 1.0, 'data': 'AAAAAA=='}
    """
    low, high = (float(values.min()), float(values.max())) if len(values) else (0.0, 0.0)
    # halves first: the sum of the largest numbers overflows
    offset = 0.5 * low + 0.5 * high
    if size == 2:
        step = (0.5 * high - 0.5 * low) / LARGEST or 1.0
        small: NDArray[Any] = np.rint((values - offset) / step).astype("<i2")
    else:
        step = 1.0
        small = (values - offset).astype("<f4")
    text = base64.b64encode(small.tobytes()).decode("ascii")
    return {"kind": f"{'i' if size == 2 else 'f'}{size}", "offset": offset, "step": step, "data": text}

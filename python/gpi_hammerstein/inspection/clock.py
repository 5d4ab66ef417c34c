"""The clock of a table: rate, jitter, gaps."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gpi_hammerstein.io.clock import GAP_STEPS

Array = NDArray[np.float64]


def facts_of_clock(stamps: Array) -> dict[str, Any]:
    """Return the properties of time stamps.

    Parameters
    ----------
    stamps
        Time of every sample in s.

    Returns
    -------
    dict
        ``median_step_s``, ``smallest_step_s``, ``largest_step_s``, ``gaps`` (steps of more than ten median
        steps), ``backward`` (steps back in time), ``repeated`` (rows with the stamp of the row above),
        ``duration_s``.

    Examples
    --------
    >>> facts_of_clock(np.array([0.0, 0.1, 0.2, 5.0, 5.1]))["gaps"]
    1
    """
    steps = np.diff(stamps[np.isfinite(stamps)])
    forward = steps[steps > 0]
    if not forward.size:
        return {"gaps": 0, "backward": int(np.count_nonzero(steps < 0)), "repeated": int(np.sum(steps == 0))}
    usual = float(np.median(forward))
    return {
        "median_step_s": usual,
        "smallest_step_s": float(steps.min()),
        "largest_step_s": float(steps.max()),
        "gaps": int(np.count_nonzero(steps > GAP_STEPS * usual)),
        "backward": int(np.count_nonzero(steps < 0)),
        "repeated": int(np.count_nonzero(steps == 0)),
        "duration_s": float(forward.sum()),
    }

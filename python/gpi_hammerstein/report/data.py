"""All numbers that the script of the page draws, as one JSON object."""

import json
from typing import Any

import numpy as np

from gpi_hammerstein._native import Explanation
from gpi_hammerstein.report.curves import curves
from gpi_hammerstein.report.series import Errors, parts

# The vertical axis of the residual: this quantile of the error before, times a factor.
USUAL, MARGIN = 0.98, 2.5


def page_data(found: Explanation, errors: Errors) -> str:
    """Return the data of the page as the text of a script element.

    Parameters
    ----------
    found
        The result of `explain`.
    errors
        The errors of both models.

    Returns
    -------
    str
        JSON in ASCII. It contains no ``<``, so that no text in it can end the element or begin another one.

    Examples
    --------
    >>> page_data(found, Errors(found))[:8]  # doctest: +SKIP
    '{"rate":'
    """
    record = errors.record
    outputs = range(len(record.output_names))
    noise = np.ravel(found.noise_floor["rms"]).tolist()
    data: dict[str, Any] = {
        "rate": record.rate,
        "inputs": channels(record.input_names, record.input_units),
        "covariates": channels(record.covariate_names, record.covariate_units),
        "outputs": [
            {**channel, "half_band": errors.half_band(index), "noise": noise[index]}
            for index, channel in enumerate(channels(record.output_names, record.output_units))
        ],
        "experiments": [
            {
                "samples": len(errors.after[k]),
                "warmup": errors.warmups[k],
                "held_out": errors.held_out[k] if errors.held_out else [],
                "largest": [errors.largest(k, output) for output in outputs],
                "limits": [usual(errors, k, output) for output in outputs],
                "spans": [span(errors, k, output) for output in outputs],
                "parts": own,
            }
            for k, own in enumerate(parts(errors))
        ],
        "curves": curves(errors),
    }
    return json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")


def channels(names: list[str], units: list[str]) -> list[dict[str, str]]:
    """Return the names and units of channels."""
    return [{"name": name, "unit": unit} for name, unit in zip(names, units, strict=True)]


def usual(errors: Errors, experiment: int, output: int) -> float:
    """Return the limit of the residual's axis, which few samples do not determine."""
    mask = errors.scored(experiment, output)
    sizes = np.abs(errors.before[experiment][mask, output])
    return MARGIN * float(np.quantile(sizes, USUAL)) + 1e-300 if len(sizes) else 1.0


def span(errors: Errors, experiment: int, output: int) -> list[float]:
    """Return the limits of the output's axis: simulated samples that are not scored do not determine them."""
    y = errors.record.y[experiment][:, output]
    mask = errors.scored(experiment, output)
    before, after = (y - left[experiment][:, output] for left in (errors.before, errors.after))
    shown = np.concatenate([y, before[mask], after[mask]])
    return [float(shown.min()), float(shown.max())]

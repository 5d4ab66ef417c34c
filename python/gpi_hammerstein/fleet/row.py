"""One row of the table of a batch: what is known of one record."""

from collections.abc import Mapping
from typing import Any

import polars as pl

from gpi_hammerstein._native import Explanation, __version__
from gpi_hammerstein.explanation import to_dict
from gpi_hammerstein.fleet.jobs import Job
from gpi_hammerstein.json_values import plain

VERSION = "gpi-fleet/1"
SIZE = pl.Struct(
    {
        "effect": pl.String,
        "name": pl.String,
        "value": pl.Float64,
        "std": pl.Float64,
        "unit": pl.String,
        "determined": pl.Boolean,
    }
)
COLUMNS: dict[str, Any] = {
    "file": pl.String,
    "name": pl.String,
    "device": pl.String,
    "date": pl.String,
    "verdict": pl.String,
    "verdict_reason": pl.String,
    "effects": pl.List(pl.String),
    "sizes": pl.List(SIZE),
    "rms_before": pl.Float64,
    "rms_after": pl.Float64,
    "noise_floor": pl.Float64,
    "unit": pl.String,
    "rival": pl.String,
    "rival_rms": pl.Float64,
    "resonance_hz": pl.Float64,
    "damping": pl.Float64,
    "sensitivity": pl.Float64,
    "hysteresis_width": pl.Float64,
    "samples": pl.Int64,
    "rate_hz": pl.Float64,
    "experiments": pl.Int64,
    "seconds": pl.Float64,
    "version": pl.String,
    "key": pl.String,
    "error": pl.String,
}
"""Names and types of the columns of `gpi-fleet/1`."""


def of_failure(job: Job, name: str, key: str | None, error: str, seconds: float) -> dict[str, Any]:
    """Return the row of a record that has no result.

    Parameters
    ----------
    job, name, key
        The record, its folder, and the address of its result; None if the file cannot be read.
    error
        Why there is no result.
    seconds
        The time that was spent.

    Returns
    -------
    dict
        All columns; most are None.
    """
    known = {"error": error, "seconds": seconds, "key": key}
    return dict.fromkeys(COLUMNS) | _common(job, name) | known


def of_explanation(job: Job, name: str, key: str, found: Explanation, seconds: float) -> dict[str, Any]:
    """Return the row of an explained record.

    Parameters
    ----------
    job, name, key
        The record, its folder, and the address of its result.
    found
        The explanation.
    seconds
        The time of reading and explaining.

    Returns
    -------
    dict
        All columns. Errors are rms errors over all outputs on held-out data, in `unit`; `rival` is the best
        simple model on the same data. `sensitivity` and `hysteresis_width` are those of the first input and
        output.
    """
    result = plain(to_dict(found))
    record, stage = found.record, result["stage"]
    units = set(record.output_units)
    rivals = [rival for rival in result["rivals"] if rival["holdout_rms"] is not None]
    best: Mapping[str, Any] = min(rivals, key=lambda rival: rival["holdout_rms"], default={})
    loop: Mapping[str, Any] = next(iter(stage["loops"]), {})
    resonance = stage["first_resonance"] or {}
    return (
        dict.fromkeys(COLUMNS)
        | _common(job, name)
        | {
            "verdict": result["verdict"],
            "verdict_reason": result["verdict_reason"],
            "effects": result["effects"],
            "sizes": [
                {"effect": step["effect"], "name": label}
                | {key: parameter[key] for key in ("value", "std", "unit", "determined")}
                for step in result["steps"]
                if step["effect"] is not None
                for label, parameter in step["parameters"].items()
            ],
            "rms_before": result["error"]["before"]["holdout"]["rms"],
            "rms_after": result["error"]["after"]["holdout"]["rms"],
            "noise_floor": result["noise_floor"]["rms"],
            "unit": units.pop() if len(units) == 1 else "",
            "rival": best.get("name"),
            "rival_rms": best.get("holdout_rms"),
            "resonance_hz": resonance.get("frequency_hz"),
            "damping": resonance.get("damping"),
            "sensitivity": loop.get("sensitivity"),
            "hysteresis_width": loop.get("width"),
            "samples": record.samples,
            "rate_hz": record.rate,
            "experiments": len(record.u),
            "seconds": seconds,
            "key": key,
        }
    )


def table(rows: list[dict[str, Any]]) -> pl.DataFrame:
    """Return rows as a table.

    Parameters
    ----------
    rows
        Rows of :func:`of_explanation` and :func:`of_failure`.

    Returns
    -------
    polars.DataFrame
        The columns of `gpi-fleet/1`.
    """
    return pl.DataFrame(rows, schema=COLUMNS, orient="row")


def _common(job: Job, name: str) -> dict[str, Any]:
    return {
        "file": str(job.file),
        "name": name,
        "device": job.device,
        "date": job.date,
        "version": __version__,
    }

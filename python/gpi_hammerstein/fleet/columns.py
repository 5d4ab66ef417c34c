"""The columns of a table that the judgement of a fleet needs."""

import polars as pl

from gpi_hammerstein.fleet.row import COLUMNS

USED = (
    *("file", "name", "device", "date", "verdict", "verdict_reason", "effects", "sizes", "unit", "error"),
    *("rms_before", "rms_after", "noise_floor", "resonance_hz", "damping", "sensitivity", "hysteresis_width"),
)
"""The columns of `gpi-fleet/1` that are used here."""


def wrong_columns(table: pl.DataFrame) -> str:
    """Return what is wrong with the columns of a table; nothing if they are those of `gpi-fleet/1`."""
    for name in USED:
        if name not in table.columns:
            return f"column `{name}` is missing"
        if table.schema[name] != COLUMNS[name]:
            return f"column `{name}` has the type {table.schema[name]}, not {COLUMNS[name]}"
    return ""

"""Dates and times of day as seconds."""

import re

import numpy as np
import polars as pl

DAY = 86400.0
# The first cell of a column of text that is tried as a time: hours and minutes, with or without a date.
PATTERN = re.compile(r"\s*(\d{1,4}[-./]\d{1,2}[-./]\d{1,4}[ T])?\d{1,2}:\d{2}(:\d{2}([.,]\d+)?)?Z?\s*")
DATES = ("%Y-%m-%d", "%Y/%m/%d", "%d.%m.%Y", "%d/%m/%Y", "%m/%d/%Y", "%d-%m-%Y")
"""Orders of year, month and day; only differences are used."""


def clocks_as_seconds(frame: pl.DataFrame) -> tuple[pl.DataFrame, list[str]]:
    """Convert columns of dates, times of day and time spans to seconds since the first row.

    A time of day that jumps back by more than half a day has passed midnight.

    Parameters
    ----------
    frame
        The columns. Text is converted if every cell is a date with a time of day, or a time of day.

    Returns
    -------
    polars.DataFrame
        The frame with numbers in these columns.
    list of str
        The names of these columns.

    Examples
    --------
    >>> frame, names = clocks_as_seconds(pl.DataFrame({"t": ["10:00:00.0", "10:00:00.5"]}))
    >>> frame["t"].to_list(), names
    ([0.0, 0.5], ['t'])
    """
    changed: dict[str, pl.Series] = {}
    for series in frame:
        parsed = _parsed(series) if series.dtype == pl.String else series
        if parsed is None or not parsed.dtype.is_temporal():
            continue
        stamps = parsed.cast(pl.Int64).to_numpy().astype(np.float64)
        seconds = (stamps - stamps[0]) * _unit(parsed.dtype)
        if parsed.dtype == pl.Time:
            steps = np.diff(seconds, prepend=seconds[:1])
            seconds = seconds + DAY * np.cumsum(steps < -0.5 * DAY)
        changed[series.name] = pl.Series(series.name, seconds)
    return frame.with_columns(**changed), list(changed)


def _unit(kind: pl.DataType) -> float:
    """Return the seconds of one count of a type."""
    if isinstance(kind, pl.Date):
        return DAY
    unit = "ns" if isinstance(kind, pl.Time) else getattr(kind, "time_unit", "us")
    return {"ns": 1e-9, "us": 1e-6, "ms": 1e-3}[str(unit)]


def _parsed(series: pl.Series) -> pl.Series | None:
    """Return the times of a column of text; None if it contains something else."""
    first = series[0] if len(series) else None
    if first is None or not PATTERN.fullmatch(first):
        return None
    text = series.str.strip_chars().str.strip_suffix("Z").str.replace("T", " ", literal=True)
    text = text.str.replace(",", ".", literal=True)
    clock = "%H:%M:%S%.f" if first.count(":") > 1 else "%H:%M"
    tries = [(date, f"{date} {clock}") for date in DATES] if " " in text[0] else [(None, clock)]
    for date, layout in tries:
        found = text.str.to_datetime(layout, strict=False) if date else text.str.to_time(layout, strict=False)
        if found.null_count() == 0:
            return found
    return None

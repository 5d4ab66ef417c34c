"""The dates of records, as days."""

import datetime
from collections.abc import Iterable

import numpy as np

from gpi_hammerstein.fleet.robust import Array

EPOCH = datetime.datetime(1970, 1, 1, tzinfo=datetime.UTC)
DAY = datetime.timedelta(days=1)


def days_of(dates: Iterable[str | None]) -> tuple[Array, list[str]]:
    """Return ISO 8601 dates as days since 1970.

    A date without a time of day is its midnight, and a time without a zone is in UTC.

    Parameters
    ----------
    dates
        Dates such as ``2026-03-02`` or date-times such as ``2026-03-02T14:30+01:00``; None is unknown.

    Returns
    -------
    ndarray
        Shape (dates,); NaN where a date is unknown or is not ISO 8601.
    list of str
        The texts that are not ISO 8601.

    Examples
    --------
    >>> days, refused = days_of(["1970-01-02", "1970-01-01T12:00", "2/3/2026", None])
    >>> days.tolist(), refused
    ([1.0, 0.5, nan, nan], ['2/3/2026'])
    """
    found, refused = [], []
    for text in dates:
        day = np.nan
        if text is not None and text.strip():
            try:
                moment = datetime.datetime.fromisoformat(text.strip())
                day = (moment.replace(tzinfo=moment.tzinfo or datetime.UTC) - EPOCH) / DAY
            except (ValueError, OverflowError):
                refused.append(text)
        found.append(day)
    return np.array(found, dtype=np.float64), refused


def as_date(day: float) -> str:
    """Return days since 1970 as an ISO 8601 date.

    Parameters
    ----------
    day
        Days since 1970.

    Examples
    --------
    >>> as_date(1.5)
    '1970-01-02'
    """
    return (EPOCH + day * DAY).date().isoformat()

"""Conversion of Polars and pandas data frames and xarray datasets to tables."""

from typing import Any, TypeGuard

import numpy as np
import polars as pl

from gpi_hammerstein._native import DataError
from gpi_hammerstein.io.tables import Table, from_frame

Frame = Any
"""A Polars or pandas data frame, or an xarray dataset; pandas and xarray are not dependencies."""


def is_frame(source: object) -> TypeGuard[Frame]:
    """Return whether an object is a data frame or dataset.

    Parameters
    ----------
    source
        A path, a list of paths, or a frame.

    Examples
    --------
    >>> is_frame(pl.DataFrame({"u": [1.0]})), is_frame("record.csv")
    (True, False)
    """
    return isinstance(source, pl.DataFrame) or hasattr(source, "data_vars") or hasattr(source, "iloc")


def read_frame(source: Frame) -> Table:
    """Convert a frame to a table.

    Parameters
    ----------
    source
        A frame with columns that are named as in a CSV file. An index that is not only a row number is also a
        column, and so is the coordinate of an xarray dataset. Dates and time spans are converted to seconds
        since the first one. Units in ``attrs["units"]`` of xarray are used.

    Returns
    -------
    Table
        The columns, with numbers as float64.

    Raises
    ------
    DataError
        There are no rows, or a variable has more than one dimension.

    Examples
    --------
    >>> [column.name for column in read_frame(pl.DataFrame({"t_s": [0.0], "u_V": [1.0]})).headers()]
    ['t', 'u']
    """
    if isinstance(source, pl.DataFrame):
        return from_frame(source, "the data frame")
    columns = dataset_columns(source) if hasattr(source, "data_vars") else pandas_columns(source)
    return from_frame(pl.DataFrame(columns), "the data frame")


def pandas_columns(frame: Frame) -> dict[str, Any]:
    """Return the columns of a pandas frame, including its index."""
    index, columns = frame.index, {}
    values = index.to_numpy()
    if values.dtype.kind in "Mm":
        columns["t_s"] = in_seconds(values)
    elif index.name is not None:
        columns[str(index.name)] = plain(values)
    return columns | {str(name): plain(frame[name].to_numpy()) for name in frame.columns}


def dataset_columns(dataset: Frame) -> dict[str, Any]:
    """Return the variables of an xarray dataset, including its coordinate."""
    columns = {}
    for name, variable in {**dataset.coords, **dataset.data_vars}.items():
        if variable.ndim != 1:
            raise DataError(
                f"the data frame: `{name}` has {variable.ndim} dimensions; select one experiment, so that "
                "every variable has one"
            )
        values, unit = variable.values, variable.attrs.get("units", "")
        if values.dtype.kind in "Mm":
            values, unit = in_seconds(values), "s"
        columns[f"{name} [{unit}]" if unit else str(name)] = plain(values)
    return columns


def in_seconds(values: Any) -> Any:
    """Return times in seconds since the first one."""
    return (values - values[0]) / np.timedelta64(1, "s")


def plain(values: Any) -> Any:
    """Return numbers as an array, and other objects as a list of text."""
    return values if values.dtype.kind in "fiub" else [None if v is None else str(v) for v in values]

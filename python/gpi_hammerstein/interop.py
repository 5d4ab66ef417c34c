"""Conversions to and from other packages: python-control, SciPy, Polars, pandas, xarray.

Only SciPy and Polars are dependencies of this package. The others are imported when they are needed.
"""

from typing import Any

import numpy as np
import polars as pl

from gpi_hammerstein._native import ParameterError, Record, StateSpace

__all__ = ["from_control", "from_dlti", "to_control", "to_dlti", "to_pandas", "to_polars", "to_xarray"]


def to_control(system: StateSpace, rate: float) -> Any:
    """Convert a linear system to a ``control.StateSpace``.

    Parameters
    ----------
    system
        The linear system, for example ``model.linear``.
    rate
        Sampling rate in Hz.

    Returns
    -------
    control.StateSpace
        The same system, with the sampling time ``1 / rate``.

    Examples
    --------
    >>> gpi.interop.to_control(gpi.StateSpace([[0.5]], [[1.0]], [[0.5]], [[0.0]]), 1e3).dt
    0.001
    """
    import control

    return control.ss(system.A, system.B, system.C, system.D, 1 / rate)


def from_control(system: Any) -> StateSpace:
    """Convert a linear system of python-control to a `StateSpace`.

    Parameters
    ----------
    system
        A discrete-time ``control.StateSpace`` or ``control.TransferFunction``.

    Returns
    -------
    StateSpace
        The same system; its sampling time is ``system.dt``.

    Raises
    ------
    ParameterError
        The system is in continuous time.

    Examples
    --------
    >>> import control
    >>> gpi.interop.from_control(control.tf([0.5], [1.0, -0.5], 1e-3)).dc_gain.round(9).item()
    1.0
    """
    import control

    if system.dt == 0:
        raise ParameterError("`system` is in continuous time; sample it first (control.sample_system)")
    own = control.ss(system)
    return StateSpace(own.A, own.B, own.C, own.D)


def to_dlti(system: StateSpace, rate: float) -> Any:
    """Convert a linear system to a ``scipy.signal.dlti``.

    Parameters
    ----------
    system
        The linear system, for example ``model.linear``.
    rate
        Sampling rate in Hz.

    Returns
    -------
    scipy.signal.dlti
        The same system in state-space form, with the sampling time ``1 / rate``.

    Examples
    --------
    >>> gpi.interop.to_dlti(gpi.StateSpace([[0.5]], [[1.0]], [[0.5]], [[0.0]]), 1e3).dt
    0.001
    """
    import scipy.signal

    return scipy.signal.dlti(system.A, system.B, system.C, system.D, dt=1 / rate)


def from_dlti(system: Any) -> StateSpace:
    """Convert a discrete-time linear system of SciPy to a `StateSpace`.

    Parameters
    ----------
    system
        A ``scipy.signal.dlti`` in any form.

    Returns
    -------
    StateSpace
        The same system; its sampling time is ``system.dt``.

    Raises
    ------
    ParameterError
        The system is in continuous time.

    Examples
    --------
    >>> import scipy.signal
    >>> gpi.interop.from_dlti(scipy.signal.dlti([0.5], [1.0, -0.5], dt=1e-3)).dc_gain.item()
    1.0
    """
    if system.dt is None:
        raise ParameterError("`system` is in continuous time; make it discrete first (system.to_discrete)")
    own = system.to_ss()
    return StateSpace(own.A, own.B, own.C, own.D)


def columns(record: Record, experiment: int) -> dict[str, tuple[str, Any]]:
    """Return the unit and the samples of every channel by its name; the time comes first."""
    u, y = record.u[experiment], record.y[experiment]
    found: dict[str, tuple[str, Any]] = {"t": ("s", np.arange(len(u)) / record.rate)}
    groups = [
        (record.input_names, record.input_units, u),
        (record.output_names, record.output_units, y),
    ]
    if record.covariate_names:
        covariates = record.covariates[experiment]
        groups.append((record.covariate_names, record.covariate_units, covariates))
    for names, units, signals in groups:
        found |= {name: (unit, signal) for name, unit, signal in zip(names, units, signals.T, strict=True)}
    return found


def headed(record: Record, experiment: int) -> dict[str, Any]:
    """Return the samples of every channel by its header."""
    found = columns(record, experiment)
    return {f"{name} [{unit}]" if unit else name: signal for name, (unit, signal) in found.items()}


def to_polars(record: Record, experiment: int = 0) -> pl.DataFrame:
    """Convert an experiment to a Polars data frame.

    Parameters
    ----------
    record
        The record.
    experiment
        The number of the experiment, counted from 0.

    Returns
    -------
    polars.DataFrame
        ``t [s]`` and the channels, with their units in brackets, as `read_record` reads them.

    Examples
    --------
    >>> record = gpi.Record([0.0, 1.0], [0.0, 2.0], 10.0, input_units=["V"])
    >>> gpi.interop.to_polars(record).columns
    ['t [s]', 'u [V]', 'y']
    """
    return pl.DataFrame(headed(record, experiment))


def to_pandas(record: Record, experiment: int = 0) -> Any:
    """Convert an experiment to a pandas data frame.

    Parameters
    ----------
    record
        The record.
    experiment
        The number of the experiment, counted from 0.

    Returns
    -------
    pandas.DataFrame
        ``t [s]`` and the channels, with their units in brackets.

    Examples
    --------
    >>> record = gpi.Record([0.0, 1.0], [0.0, 2.0], 10.0, input_units=["V"])
    >>> gpi.interop.to_pandas(record)["u [V]"].tolist()
    [0.0, 1.0]
    """
    import pandas as pd

    return pd.DataFrame(headed(record, experiment))


def to_xarray(record: Record, experiment: int = 0) -> Any:
    """Convert an experiment to an xarray dataset over ``t``.

    Parameters
    ----------
    record
        The record.
    experiment
        The number of the experiment, counted from 0.

    Returns
    -------
    xarray.Dataset
        One variable for each channel, with its unit in ``attrs["units"]``.

    Examples
    --------
    >>> record = gpi.Record([0.0, 1.0], [0.0, 2.0], 10.0, output_units=["um"])
    >>> gpi.interop.to_xarray(record)["y"].attrs
    {'units': 'um'}
    """
    import xarray as xr

    found = columns(record, experiment)
    unit, t = found.pop("t")
    variables = {name: ("t", signal, {"units": unit}) for name, (unit, signal) in found.items()}
    return xr.Dataset(variables, coords={"t": ("t", t, {"units": unit})})

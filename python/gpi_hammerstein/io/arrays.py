"""Reading of NumPy and MATLAB files."""

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gpi_hammerstein._native import DataError
from gpi_hammerstein.io.columns import Column, parse_header
from gpi_hammerstein.io.tables import Array, Table

RATES = ("rate", "fs", "fs_hz", "rate_hz", "sampling_rate")
PERIODS = ("ts", "dt", "ts_s", "dt_s")


def read_npz(path: Path) -> list[Table]:
    """Read an NPZ archive.

    Parameters
    ----------
    path
        The archive, with arrays such as ``u``, ``y``, ``t``, ``rate``; see :func:`from_arrays` for their
        shapes.

    Returns
    -------
    list of Table
        One table for each experiment.

    Raises
    ------
    DataError
        The file is not an NPZ archive, has no arrays of numbers, or has arrays of different lengths.

    Examples
    --------
    >>> read_npz(Path("record.npz"))  # doctest: +SKIP
    """
    try:
        with np.load(path, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
    except (OSError, ValueError, EOFError) as error:
        raise DataError(f"{path}: cannot be read as NPZ: {_reason(error)}") from error
    return from_arrays(arrays, str(path))


def read_npy_pair(input_path: Path, output_path: Path | None) -> list[Table]:
    """Read the input from one NPY file and the output from another.

    Parameters
    ----------
    input_path
        File of the array u; see :func:`from_arrays` for its shape.
    output_path
        File of the array y, which has the same length as u; None for a record without output.

    Returns
    -------
    list of Table
        One table for each experiment, with columns u and y, or u1, u2, .. and y1, y2, ...

    Raises
    ------
    DataError
        A file is missing or is not an array, or the arrays have different lengths.

    Examples
    --------
    >>> read_npy_pair(Path("u.npy"), Path("y.npy"))  # doctest: +SKIP
    """
    arrays = {}
    for name, path in (("u", input_path), ("y", output_path)):
        if path is None:
            continue
        try:
            arrays[name] = np.load(path, allow_pickle=False)
        except (OSError, ValueError, EOFError) as error:
            raise DataError(f"{path}: cannot be read as NPY: {_reason(error)}") from error
    return from_arrays(arrays, str(input_path))


def read_mat(path: Path) -> list[Table]:
    """Read a MAT file, v5 or v7.3.

    Parameters
    ----------
    path
        The file, with variables such as ``u``, ``y``, ``t``, ``fs``; see :func:`from_arrays` for their
        shapes.

    Returns
    -------
    list of Table
        One table for each experiment.

    Raises
    ------
    DataError
        The file is not a MAT file, has no arrays of numbers, or has arrays of different lengths.

    Examples
    --------
    >>> read_mat(Path("record.mat"))  # doctest: +SKIP
    """
    try:
        with path.open("rb") as file:
            hdf5 = b"MATLAB 7.3" in file.read(128)
    except OSError as error:
        raise DataError(f"{path}: cannot be read ({error.strerror})") from error
    try:
        arrays = _read_hdf5(path) if hdf5 else _read_mat5(path)
    except (OSError, ValueError, NotImplementedError, TypeError) as error:
        raise DataError(f"{path}: cannot be read as MAT: {_reason(error)}") from error
    return from_arrays(arrays, str(path))


def _read_mat5(path: Path) -> dict[str, Any]:
    import scipy.io

    contents = scipy.io.loadmat(os.fspath(path))
    return {name: value for name, value in contents.items() if not name.startswith("__")}


def _read_hdf5(path: Path) -> dict[str, Any]:
    import h5py

    with h5py.File(path, "r") as file:
        # MATLAB stores arrays in column-major order.
        return {
            name: np.asarray(item).T
            for name, item in file.items()
            if isinstance(item, h5py.Dataset) and item.attrs.get("MATLAB_class", b"") != b"char"
        }


def from_arrays(arrays: Mapping[str, Any], source: str) -> list[Table]:
    """Divide named arrays into columns.

    Parameters
    ----------
    arrays
        Names and arrays of the shapes (samples,), (samples, channels), (samples, channels,
        realisations) or (samples, channels, realisations, periods). A scalar ``rate`` or ``fs`` is the
        sampling rate in Hz; a scalar ``dt`` or ``Ts`` is the sampling period in s. Arrays that do not contain
        numbers are text columns.
    source
        Name of the file, for messages.

    Returns
    -------
    list of Table
        One table for each realisation. Its periods are joined in time. All periods except the last one are
        warm-up, so that only the steady state is scored.

    Raises
    ------
    DataError
        There is no array of samples, the arrays have different lengths, or an array has more channels than
        samples.

    Examples
    --------
    >>> [table] = from_arrays({"u": np.zeros((5, 2)), "rate": 100.0}, "demo")
    >>> [column.name for column in table.headers()], table.rate
    (['u1', 'u2'], 100.0)
    """
    rate: float | None = None
    signals: dict[str, Array] = {}
    text: dict[Column, tuple[int, str]] = {}
    for name, value in arrays.items():
        array = np.asarray(value)
        if array.dtype.kind not in "fiub":
            if array.dtype.kind in "US" and array.size > 1:
                text[parse_header(name)] = (0, str(array.flat[0]))
            continue
        if array.size == 1:
            if name.lower() in RATES:
                rate = float(array.item())
            elif name.lower() in PERIODS and array.item() > 0:
                rate = 1.0 / float(array.item())
            continue
        signals[name] = _samples_first(array.astype(np.float64), name, source)
    if not signals:
        raise DataError(f"{source}: no array of samples; a record needs arrays such as `u` and `y`")
    first, *others = signals
    for name in others:
        if len(signals[name]) != len(signals[first]):
            raise DataError(
                f"{source}: `{first}` has {len(signals[first])} samples, but `{name}` has "
                f"{len(signals[name])}; the lengths must be equal"
            )
    return [
        Table(f"{source} (realisation {index})" if count > 1 else source, columns, text, rate, warmup)
        for index, (columns, warmup, count) in enumerate(_realisations(signals, source))
    ]


def _samples_first(array: Array, name: str, source: str) -> Array:
    """Reshape an array to (samples, channels, realisations, periods)."""
    if array.ndim == 2 and array.shape[0] == 1:
        array = array.T
    if not 1 <= array.ndim <= 4 or array.size == 0:
        raise DataError(
            f"{source}: array `{name}` has the shape {array.shape}; it must be (samples, channels, "
            "realisations, periods) or the first one, two or three of these, and must not be empty"
        )
    array = array.reshape(*array.shape, *(1 for _ in range(4 - array.ndim)))
    samples, channels = array.shape[:2]
    if channels > samples:
        raise DataError(
            f"{source}: array `{name}` has {samples} samples of {channels} channels; "
            "the first axis must be that of the samples: transpose the array"
        )
    return array


def _realisations(
    signals: Mapping[str, Array], source: str
) -> Sequence[tuple[dict[Column, Array], int, int]]:
    """Return the columns, the warm-up and the number of realisations, for each realisation."""
    samples = len(next(iter(signals.values())))
    count, periods = max(array.shape[2:] for array in signals.values())
    for name, array in signals.items():
        if array.shape[2:] != (count, periods):
            raise DataError(
                f"{source}: `{name}` has {array.shape[2]} realisations of {array.shape[3]} periods, but "
                f"another array has {count} of {periods}; they must be equal"
            )
    result = []
    for index in range(count):
        columns: dict[Column, Array] = {}
        for name, array in signals.items():
            array_column = parse_header(name)
            channels = array.shape[1]
            for channel in range(channels):
                joined = np.ascontiguousarray(array[:, channel, index, :].T.reshape(-1))
                if channels == 1:
                    columns[array_column] = joined
                    continue
                numbered = f"{array_column.name}{channel + 1}"
                columns[Column(numbered, numbered, array_column.unit, array_column.name)] = joined
        result.append((columns, (periods - 1) * samples, count))
    return result


def _reason(error: Exception) -> str:
    strerror = getattr(error, "strerror", None)
    return strerror or (str(error).splitlines() or [type(error).__name__])[0]

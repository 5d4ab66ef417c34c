"""Reading of HDF5 files: MAT files of version 7.3, and files of other programs.

The library of HDF5 can open other files that a file names: by external links, by external storage of a
dataset, and by virtual datasets. All of them are refused, and so are soft links, because a record needs none:
only what the file itself contains is read.
"""

import io
from collections import Counter
from typing import Any

import numpy as np

from gpi_hammerstein.io.arrays import PERIODS, RATES, LeftOut, from_arrays
from gpi_hammerstein.io.boundary import File
from gpi_hammerstein.io.tables import Table


def read_hdf5(file: File) -> dict[str, Any]:
    """Read the variables of a MAT file of version 7.3.

    Parameters
    ----------
    file
        The file.

    Returns
    -------
    dict
        Arrays by their names; a :class:`~gpi_hammerstein.io.arrays.LeftOut` for each variable that is no
        array of real numbers. MATLAB stores arrays column by column, so that the axes are
        reversed.

    Raises
    ------
    DataError
        The data is larger than allowed.
    ValueError, OSError, RuntimeError, KeyError
        The file is corrupt, or refers to other files.

    Examples
    --------
    >>> with opened(Path("record.mat"), "MAT") as file:  # doctest: +SKIP
    ...     read_hdf5(file)["u"].shape
    (1000, 1)
    """
    import h5py

    variables: dict[str, Any] = {}
    with h5py.File(io.BytesIO(file.data), "r") as root:
        file.allowance.check_columns(len(root))
        for name in root:
            if not isinstance(root.get(name, getlink=True), h5py.HardLink):
                raise ValueError(f"`{name}` is a link to another object or file, which is not followed")
            if name.startswith("#"):  # MATLAB's data for objects and cell arrays
                continue
            item = root[name]
            if isinstance(item, h5py.Dataset):
                variables[name] = _array(item, name, file)
            else:
                variables[name] = LeftOut("a structure")
    return variables


def read_plain_hdf5(file: File) -> list[Table]:
    """Read an HDF5 file of any program.

    Parameters
    ----------
    file
        The file, with datasets of the shapes of :func:`~gpi_hammerstein.io.arrays.from_arrays` in any groups.
        A dataset is called by its own name, or by its path if several have this name. A table (a dataset with
        fields) gives one column for each field. The attributes ``units`` or ``unit`` of a dataset, and
        ``rate``, ``fs`` or ``dt`` of a dataset or group, are used.

    Returns
    -------
    list of Table
        One table for each experiment.

    Raises
    ------
    DataError
        The data is larger than allowed, or there is no array of samples.
    ValueError, OSError, RuntimeError, KeyError
        The file is corrupt, or refers to other files.

    Examples
    --------
    >>> with opened(Path("record.h5"), "HDF5") as file:  # doctest: +SKIP
    ...     read_plain_hdf5(file)[0].headers()
    """
    import h5py

    found: dict[str, Any] = {}
    scalars: dict[str, Any] = {}
    pending: list[tuple[str, Any]] = []
    with h5py.File(io.BytesIO(file.data), "r") as root:
        pending.append(("", root))
        seen: set[Any] = set()
        while pending:
            path, item = pending.pop(0)
            if item.id in seen:  # hard links can form a circle
                continue
            seen.add(item.id)
            file.allowance.check_columns(len(seen))
            scalars |= _rates(item)
            if isinstance(item, h5py.Group):
                for name in item:
                    if not isinstance(item.get(name, getlink=True), h5py.HardLink):
                        raise ValueError(
                            f"`{name}` is a link to another object or file, which is not followed"
                        )
                    pending.append((f"{path}/{name}" if path else name, item[name]))
            elif isinstance(item, h5py.Dataset):
                if (
                    item.dtype.names
                    and item.ndim == 1
                    and all(item.dtype[n].kind in "fiub" for n in item.dtype.names)
                ):
                    _require_inside(item, path)
                    file.allowance.spend(item.size * item.dtype.itemsize)
                    values = item[()]
                    found |= {f"{path}/{field}": values[field] for field in item.dtype.names}
                else:
                    unit = _text(item.attrs.get("units", item.attrs.get("unit", "")))
                    found[f"{path} [{unit}]" if unit else path] = _array(item, path, file, axes=1)
    return from_arrays(
        _short(found) | {name: value for name, value in scalars.items() if name not in found}, file
    )


def _rates(item: Any) -> dict[str, float]:
    """Return the attributes that state the rate."""
    found = {}
    for name in item.attrs:
        if name.lower() in (*RATES, *PERIODS):
            value = np.asarray(item.attrs[name])
            if value.size == 1 and value.dtype.kind in "fiu":
                found[name] = float(value.item())
    return found


def _short(found: dict[str, Any]) -> dict[str, Any]:
    """Call arrays by the last part of their path where it is unique."""
    last = Counter(_last(name) for name in found)
    return {_last(name) if last[_last(name)] == 1 else name: value for name, value in found.items()}


def _last(name: str) -> str:
    path, bracket, unit = name.partition(" [")
    return path.rsplit("/", 1)[-1] + bracket + unit


def _text(value: Any) -> str:
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace")
    return value if isinstance(value, str) else ""


def _require_inside(dataset: Any, name: str) -> None:
    """Refuse a dataset whose numbers are in another file."""
    if dataset.external or dataset.is_virtual:
        raise ValueError(f"the numbers of `{name}` are in another file, which is not read")


def _array(dataset: Any, name: str, file: File, axes: int = -1) -> Any:
    """Return the array of a dataset; MATLAB's axes are reversed (`axes` = -1)."""
    _require_inside(dataset, name)
    if dataset.dtype.kind not in "fiub":
        return LeftOut("complex numbers" if dataset.dtype.names else "no numbers")
    if dataset.attrs.get("MATLAB_class", b"") == b"char":
        return LeftOut("text")
    if "MATLAB_empty" in dataset.attrs:  # the dataset contains the dimensions instead
        return np.empty((0, 0))
    if dataset.shape is None:
        return np.empty(0)
    file.allowance.spend(dataset.size * dataset.dtype.itemsize)
    if dataset.size and not dataset.id.get_storage_size():
        raise ValueError(f"the numbers of `{name}` were never written")
    values = np.asarray(dataset[()])
    return values.T if axes < 0 else values

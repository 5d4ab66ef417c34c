"""Reading of MAT files of version 7.3, which are HDF5 files.

The library of HDF5 can open other files that a file names: by external links, by external storage of a
dataset, and by virtual datasets. All of them are refused, and so are soft links, because a record needs none:
only what the file itself contains is read.
"""

import io
from typing import Any

import numpy as np

from gpi_hammerstein.io.arrays import LeftOut
from gpi_hammerstein.io.boundary import File


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


def _array(dataset: Any, name: str, file: File) -> Any:
    """Return the array of a dataset."""
    if dataset.external or dataset.is_virtual:
        raise ValueError(f"the numbers of `{name}` are in another file, which is not read")
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
    return np.asarray(dataset[()]).T

"""Reading of MATLAB files."""

from gpi_hammerstein.io.arrays import from_arrays
from gpi_hammerstein.io.boundary import File
from gpi_hammerstein.io.hdf5 import read_hdf5
from gpi_hammerstein.io.mat4 import is_mat4, read_mat4
from gpi_hammerstein.io.mat5 import read_mat5
from gpi_hammerstein.io.tables import Table

HDF5 = b"\x89HDF\r\n\x1a\n"
# MATLAB writes its own header of 512 bytes above the HDF5 file.
PLACES = (0, 512)


def read_mat(file: File) -> list[Table]:
    """Read a MAT file of version 4, 5 or 7.3.

    Parameters
    ----------
    file
        The file, with variables such as ``u``, ``y``, ``t``, ``fs``; see
        :func:`~gpi_hammerstein.io.arrays.from_arrays` for their shapes.

    Returns
    -------
    list of Table
        One table for each experiment.

    Raises
    ------
    DataError
        The file has no arrays of numbers, or has arrays of different lengths.

    Examples
    --------
    >>> with opened(Path("record.mat"), "MAT") as file:  # doctest: +SKIP
    ...     read_mat(file)
    """
    if is_hdf5(file.data):
        variables = read_hdf5(file)
    elif is_mat4(file.data):
        variables = read_mat4(file)
    else:
        variables = read_mat5(file)
    return from_arrays(variables, file)


def is_hdf5(data: bytes) -> bool:
    """Return whether the content of a file is that of an HDF5 file, as of MAT 7.3.

    Parameters
    ----------
    data
        The content.

    Examples
    --------
    >>> is_hdf5(b"MATLAB 5.0 MAT-file")
    False
    """
    return any(data.startswith(HDF5, place) for place in PLACES)

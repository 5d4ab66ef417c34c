"""Reading of NumPy files."""

import io
import math
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from gpi_hammerstein.io.arrays import from_arrays
from gpi_hammerstein.io.boundary import File, opened
from gpi_hammerstein.io.tables import Table

# The versions differ in the width of the header's length and in its encoding.
HEADERS = {
    (1, 0): np.lib.format.read_array_header_1_0,
    (2, 0): np.lib.format.read_array_header_2_0,
}


def read_npz(file: File) -> list[Table]:
    """Read an NPZ archive.

    Parameters
    ----------
    file
        The archive, with arrays such as ``u``, ``y``, ``t``, ``rate``; see
        :func:`~gpi_hammerstein.io.arrays.from_arrays` for their shapes.

    Returns
    -------
    list of Table
        One table for each experiment.

    Raises
    ------
    DataError
        The archive has no arrays of numbers, or has arrays of different lengths.

    Examples
    --------
    >>> with opened(Path("record.npz"), "NPZ") as file:  # doctest: +SKIP
    ...     read_npz(file)
    """
    arrays: dict[str, Any] = {}
    with zipfile.ZipFile(io.BytesIO(file.data)) as archive:
        members = archive.infolist()
        file.allowance.check_columns(len(members))
        for member in members:
            # Only these two methods can be decompressed in pieces of limited size.
            if member.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
                raise ValueError(f"`{member.filename}` is compressed by a method that NumPy does not use")
            name = member.filename.removesuffix(".npy")
            if name in arrays:
                raise ValueError(f"it contains two arrays `{name}`")
            file.allowance.spend(member.file_size)
            content = archive.read(member)
            if name != member.filename or content.startswith(np.lib.format.MAGIC_PREFIX):
                arrays[name] = parse_npy(content)
    return from_arrays(arrays, file)


def read_npy_pair(input_path: Path, output_path: Path | None) -> list[Table]:
    """Read the input from one NPY file and the output from another.

    Parameters
    ----------
    input_path
        File of the array u; see :func:`~gpi_hammerstein.io.arrays.from_arrays` for its shape.
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
    with opened(input_path, "NPY") as file:
        arrays = {"u": parse_npy(file.data)}
        if output_path is not None:
            with opened(output_path, "NPY") as second:
                arrays["y"] = parse_npy(second.data)
        return from_arrays(arrays, file)


def parse_npy(data: bytes) -> Any:
    """Return the array of an NPY file, as a view of its bytes.

    The size that the header states is compared with the size of the data before any memory is allocated.

    Parameters
    ----------
    data
        The content of the file.

    Returns
    -------
    numpy.ndarray
        The array; it cannot be written.

    Raises
    ------
    ValueError
        The header is wrong, the array contains Python objects, or the data has another size.

    Examples
    --------
    >>> stream = io.BytesIO()
    >>> np.save(stream, np.arange(3.0))
    >>> parse_npy(stream.getvalue())
    array([0., 1., 2.])
    """
    stream = io.BytesIO(data)
    version = np.lib.format.read_magic(stream)
    if version not in HEADERS:
        raise ValueError(f"version {version} of the NPY format is not known")
    shape, columns_first, dtype = HEADERS[version](stream)
    if dtype.hasobject:
        raise ValueError("the array contains Python objects, which are not read")
    if any(length < 0 for length in shape):
        raise ValueError(f"the shape {shape} is negative")
    count, there = math.prod(shape), len(data) - stream.tell()
    if count and not dtype.itemsize:
        raise ValueError("the elements of the array have no size")
    if count * dtype.itemsize != there:
        raise ValueError(f"the shape {shape} needs {count * dtype.itemsize} bytes, but there are {there}")
    flat = np.frombuffer(data, dtype, offset=stream.tell()) if there else np.empty(count, dtype)
    return flat.reshape(shape, order="F" if columns_first else "C")

"""Reading of MAT files of version 5 (MATLAB 5 to 7.2, ``save -v6`` and ``save -v7``).

The file is a header of 128 bytes and a sequence of elements. An element is a tag, which states the type and
the size of its data, and the data, which is padded to a multiple of 8 bytes::

    type u32, size u32, data[size]             or, if the data has at most 4 bytes,
    type u16, size u16, data[4]

A variable is an element ``matrix``, or a compressed element that contains it. Its data is again a sequence of
elements: the class and the flags, the dimensions, the name, the real part, the imaginary part. Numbers are
stored column by column, in the smallest type that represents them.

Every size is compared with the bytes that are there before it is used, so that a wrong file is an exception.
Only real, full arrays of numbers are read. The source is the description of the format by its publisher:
MAT-File Format, The MathWorks.
"""

import math
import struct
from collections.abc import Iterator
from itertools import islice
from typing import Any

import numpy as np

from gpi_hammerstein.io.arrays import LeftOut
from gpi_hammerstein.io.boundary import File
from gpi_hammerstein.io.compressed import ZLIB, inflate

HEADER = 128
# Types of the data of an element.
INT8, INT32, UINT32, MATRIX, COMPRESSED = 1, 5, 6, 14, 15
NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
# Texts are stored as bytes or, by some writers, as UTF-8.
TEXTS = (INT8, 2, 16)
# Classes of variables: 6 is double, 7 single, 8 to 15 integers; logical variables are of class uint8.
NUMERIC = range(6, 16)
OTHERS = {1: "a cell array", 2: "a structure", 3: "an object", 4: "text", 5: "a sparse matrix"}
OTHERS |= {16: "a function", 17: "an object"}
COMPLEX = 0x0800


def read_mat5(file: File) -> dict[str, Any]:
    """Read the variables of a MAT file of version 5.

    Parameters
    ----------
    file
        The file.

    Returns
    -------
    dict
        Arrays by their names; a :class:`~gpi_hammerstein.io.arrays.LeftOut` for each variable that is no
        array of real numbers.

    Raises
    ------
    DataError
        The decompressed data is larger than allowed.
    ValueError, EOFError, zlib.error
        The file is corrupt.

    Examples
    --------
    >>> with opened(Path("record.mat"), "MAT") as file:  # doctest: +SKIP
    ...     read_mat5(file)["u"].shape
    (1000, 1)
    """
    order = {b"IM": "<", b"MI": ">"}.get(file.data[126:128])
    if order is None:
        raise ValueError("it has no header of a MAT file of version 5 or 7.3 (save it with -v7)")
    (version,) = struct.unpack_from(f"{order}H", file.data, 124)
    if version >> 8 != 1:
        raise ValueError(f"its header states the unknown version {version >> 8}")
    variables: dict[str, Any] = {}
    for kind, data in _elements(memoryview(file.data)[HEADER:], order):
        content = data
        if kind == COMPRESSED:
            inner = memoryview(inflate(bytes(data), file.allowance, ZLIB))
            (kind, content), *more = islice(_elements(inner, order), 2)
            if more:
                raise ValueError("a compressed element contains more than one variable")
        if kind != MATRIX:
            raise ValueError(f"there is an element of type {kind} where a variable must be")
        file.allowance.check_columns(len(variables) + 1)
        name, value = _variable(content, order)
        if name in variables:
            raise ValueError(f"it contains two variables `{name}`")
        if name:  # MATLAB's data for objects is a variable without name
            variables[name] = value
    return variables


def _elements(data: memoryview, order: str) -> Iterator[tuple[int, memoryview]]:
    """Yield the type and the data of each element."""
    place = 0
    while place < len(data):
        if place + 8 > len(data):
            raise EOFError("the file ends within the tag of an element")
        kind, size = struct.unpack_from(f"{order}II", data, place)
        begin = place + 8
        if kind >> 16:  # the short form: the size is in the upper half
            kind, size, begin = kind & 0xFFFF, kind >> 16, place + 4
            if size > 4:
                raise ValueError(f"a short element states a size of {size} bytes, more than 4")
            place += 8
        else:
            place = begin + size
            if kind != COMPRESSED:
                place += -size % 8
        # Writers may leave out the padding at the end.
        if begin + size > len(data):
            raise EOFError(f"an element of {size} bytes is longer than the rest of the file")
        yield kind, data[begin : begin + size]


def _variable(content: memoryview, order: str) -> tuple[str, Any]:
    """Return the name and the value of a variable."""
    elements = _elements(content, order)
    (flags_kind, flags_data) = next(elements, (0, content))
    if flags_kind != UINT32 or len(flags_data) != 8:
        raise ValueError("a variable has no flags")
    (flags,) = struct.unpack_from(f"{order}I", flags_data)
    variable_class = flags & 0xFF
    if variable_class in OTHERS:
        return _name(content, order), LeftOut(OTHERS[variable_class])
    if variable_class not in NUMERIC:
        raise ValueError(f"a variable is of the unknown class {variable_class}")
    parts = [*islice(elements, 5)]
    if len(parts) not in (3, 4):
        raise ValueError("a variable does not consist of its dimensions, its name and its numbers")
    (dimensions_kind, dimensions_data), (name_kind, name_data), (kind, numbers), *imaginary = parts
    if dimensions_kind != INT32 or len(dimensions_data) % 4 or name_kind not in TEXTS:
        raise ValueError("the dimensions or the name of a variable have another type")
    name = bytes(name_data).decode("utf-8")
    if imaginary or flags & COMPLEX:
        return name, LeftOut("complex numbers")
    shape = [int(length) for length in np.frombuffer(dimensions_data, f"{order}i4")]
    if kind not in NUMBERS:
        raise ValueError(f"the numbers of `{name}` have the unknown type {kind}")
    dtype = np.dtype(f"{order}{NUMBERS[kind]}")
    if len(shape) < 2 or min(shape) < 0 or math.prod(shape) * dtype.itemsize != len(numbers):
        raise ValueError(f"`{name}` has the dimensions {shape}, but {len(numbers)} bytes of numbers")
    flat = np.frombuffer(numbers, dtype) if len(numbers) else np.empty(0)
    return name, flat.reshape(shape, order="F")


def _name(content: memoryview, order: str) -> str:
    """Return the name of a variable that is not read; objects have it in another place."""
    for _, (kind, data) in zip(range(3), _elements(content, order), strict=False):
        if kind in TEXTS and len(data):
            return bytes(data).decode("utf-8")
    return ""

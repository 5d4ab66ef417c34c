"""Reading of MAT files of version 4 (``save -v4``).

A variable is a header of five integers (type, rows, columns, imaginary, length of the name), the name, which
ends with a zero byte, and the numbers, column by column. The decimal digits of the type are M O P T: the
order of the bytes (0 little, 1 big), 0, the type of the numbers, and the kind of the matrix (0 full, 1 text,
2 sparse).
"""

import struct
from typing import Any

import numpy as np

from gpi_hammerstein.io.arrays import LeftOut
from gpi_hammerstein.io.boundary import File

HEADER = 20
NUMBERS = ("f8", "f4", "i4", "i2", "u2", "u1")
KINDS = ("full", "text", "a sparse matrix")


def is_mat4(data: bytes) -> bool:
    """Return whether the content of a file starts with a variable of version 4.

    Parameters
    ----------
    data
        The content.

    Examples
    --------
    >>> is_mat4(b"MATLAB 5.0 MAT-file, Platform: GLNXA64")
    False
    """
    return len(data) >= HEADER and _order(data, 0) is not None


def read_mat4(file: File) -> dict[str, Any]:
    """Read the variables of a MAT file of version 4.

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
    ValueError, EOFError
        The file is corrupt.

    Examples
    --------
    >>> with opened(Path("record.mat"), "MAT") as file:  # doctest: +SKIP
    ...     read_mat4(file)["u"].shape
    (1000, 1)
    """
    variables: dict[str, Any] = {}
    data, place = memoryview(file.data), 0
    while place < len(data):
        if place + HEADER > len(data):
            raise EOFError("the file ends within the header of a variable")
        order = _order(data, place)
        if order is None:
            raise ValueError(f"there is no variable at byte {place}")
        kind, rows, columns, imaginary, length = struct.unpack_from(f"{order}5i", data, place)
        begin = place + HEADER + length
        dtype = np.dtype(order + NUMBERS[kind // 10 % 10])
        place = begin + rows * columns * dtype.itemsize * (2 if imaginary else 1)
        if min(rows, columns) < 0 or place > len(data):
            raise EOFError(f"a variable of {rows} rows and {columns} columns is longer than the file")
        name = bytes(data[begin - length : begin]).split(b"\0")[0].decode("latin-1")
        file.allowance.check_columns(len(variables) + 1)
        if name in variables:
            raise ValueError(f"it contains two variables `{name}`")
        if kind % 10 or imaginary:
            variables[name] = LeftOut("complex numbers" if imaginary else KINDS[kind % 10])
            continue
        numbers = data[begin:place]
        flat = np.frombuffer(numbers, dtype) if len(numbers) else np.empty(0)
        variables[name] = flat.reshape((rows, columns), order="F")
    return variables


def _order(data: bytes | memoryview, place: int) -> str | None:
    """Return the order of the bytes if there is a header of a variable, else None."""
    for order, thousands in (("<", 0), (">", 1)):
        kind, _, _, imaginary, length = struct.unpack_from(f"{order}5i", data, place)
        digits = f"{kind:04d}"
        if (
            0 <= kind < 2000
            and kind // 1000 == thousands
            and digits[1] == "0"
            and int(digits[2]) < len(NUMBERS)
            and int(digits[3]) < len(KINDS)
            and imaginary in (0, 1)
            and length > 0
        ):
            return order
    return None

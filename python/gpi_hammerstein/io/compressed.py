"""Decompression of gzip and zlib data with a limit on the result."""

import zlib

from gpi_hammerstein.io.limits import Allowance

GZIP, ZLIB = 31, 15
"""Values of `window` for the two formats of the compressed data."""

# Compressed bytes that are given to zlib at once, and bytes that it returns at once.
PIECE, CHUNK = 16 << 10, 1 << 20


def inflate(data: bytes, allowance: Allowance, window: int) -> bytes:
    """Decompress the members of a gzip file, or one zlib stream.

    The checksum at the end of every member is checked.

    Parameters
    ----------
    data
        The compressed bytes.
    allowance
        What may still be taken from the file; the decompressed size is counted.
    window
        :data:`GZIP` or :data:`ZLIB`.

    Returns
    -------
    bytes
        The decompressed data.

    Raises
    ------
    DataError
        The decompressed data is larger than allowed. Decompression stops there.
    EOFError, zlib.error
        The data is incomplete or corrupt.

    Examples
    --------
    >>> from pathlib import Path
    >>> inflate(zlib.compress(b"0,1"), Allowance(Path("demo"), 11), ZLIB)
    b'0,1'
    """
    view, place, result = memoryview(data), 0, bytearray()
    while place < len(view):
        machine = zlib.decompressobj(window)
        while not machine.eof:
            if place >= len(view):
                raise EOFError("the compressed data is incomplete")
            piece = view[place : place + PIECE]
            part = machine.decompress(piece, CHUNK)
            place += len(piece) - len(machine.unconsumed_tail) - len(machine.unused_data)
            allowance.spend(len(part))
            allowance.check_ratio(len(result) + len(part), place)
            result += part
            if not part and machine.unconsumed_tail:
                raise EOFError("the compressed data is corrupt")
        if window != GZIP:
            break
        while place < len(view) and view[place] == 0:  # gzip files may be padded with zeros
            place += 1
    if place < len(view):
        raise ValueError("there is other data behind the compressed data")
    return bytes(result)

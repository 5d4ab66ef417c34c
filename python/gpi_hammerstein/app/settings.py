"""Limits on what the page may send to the server.

==========================  ==========  ================================================================
environment variable        default     meaning
==========================  ==========  ================================================================
``GPI_MAX_UPLOAD_BYTES``    268435456   largest size of one file that is dropped on the page, in bytes
==========================  ==========  ================================================================

The limits of :mod:`gpi_hammerstein.io.limits` hold for the content of the files.
"""

from gpi_hammerstein.io.limits import positive_integer

UPLOAD = "GPI_MAX_UPLOAD_BYTES"
# 256 MiB: ten million samples of three columns as text, which is more than an identification can use.
DEFAULT_UPLOAD = 256 << 20
# Files that one run of the app keeps. A record has rarely more than ten files.
MOST_FILES = 100
# Largest size of a request that is no file, in bytes: the names of 1000 columns fit several times.
MOST_REQUEST = 1 << 20


def largest_upload() -> int:
    """Return the largest size of one file, in bytes.

    Raises
    ------
    ParameterError
        The environment variable is not a positive integer.

    Examples
    --------
    >>> largest_upload()
    268435456
    """
    return positive_integer(UPLOAD, DEFAULT_UPLOAD)

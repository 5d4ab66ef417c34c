"""Limits on what a record file may contain, which protect against files that exhaust memory.

A compressed file of a few megabytes can describe many gigabytes. Every reader therefore counts what it takes
from a file: bytes after decompression, and columns. A count above a limit is a :class:`DataError` that names
the setting. The settings are environment variables, because then they hold for the command line, for Python
and for programs that use the package:

========================  ==========  ==================================================================
variable                  default     meaning
========================  ==========  ==================================================================
``GPI_MAX_READ_BYTES``    1073741824  largest size of the data of one file in bytes, after decompression
``GPI_MAX_READ_RATIO``    100         largest ratio of the decompressed size to the size of the file
``GPI_MAX_READ_COLUMNS``  1000        largest number of columns or variables of one file
``GPI_MAX_READ_SECONDS``  120         longest time in s for a file that another process reads
========================  ==========  ==================================================================
"""

import os
from dataclasses import dataclass, field
from pathlib import Path

from gpi_hammerstein._native import DataError, ParameterError

BYTES, RATIO, COLUMNS = "GPI_MAX_READ_BYTES", "GPI_MAX_READ_RATIO", "GPI_MAX_READ_COLUMNS"
SECONDS = "GPI_MAX_READ_SECONDS"
VARIABLES = (BYTES, RATIO, COLUMNS, SECONDS)

DEFAULTS = {
    # 40 million samples of three columns of float64, which is more than an identification can use.
    BYTES: 1 << 30,
    # Records of real sensors are compressed by less than 20; zeros are compressed by gzip by 1032.
    RATIO: 100,
    # Far above the channels of a stage; identification needs memory that grows with their square.
    COLUMNS: 1000,
    # A file of the largest size takes some seconds.
    SECONDS: 120,
}
# Data up to this size cannot exhaust memory: a short record may be compressed by any ratio.
HARMLESS = 16 << 20


def limit(variable: str) -> int:
    """Return a limit, from the environment or else its default.

    Parameters
    ----------
    variable
        The name of the environment variable.

    Returns
    -------
    int
        The limit.

    Raises
    ------
    ParameterError
        The environment variable is not a positive integer.

    Examples
    --------
    >>> limit("GPI_MAX_READ_COLUMNS")
    1000
    """
    return positive_integer(variable, DEFAULTS[variable])


def positive_integer(variable: str, default: int) -> int:
    """Return the value of an environment variable, or the default if it is not set.

    Parameters
    ----------
    variable
        The name of the environment variable.
    default
        The default.

    Returns
    -------
    int
        The value.

    Raises
    ------
    ParameterError
        The environment variable is not a positive integer.

    Examples
    --------
    >>> positive_integer("GPI_NOT_SET", 3)
    3
    """
    text = os.environ.get(variable, "")
    if not text:
        return default
    if not text.isdecimal() or len(text) > 18 or int(text) == 0:
        raise ParameterError(f"`{variable}` = {text}: this environment variable must be a positive integer")
    return int(text)


@dataclass
class Allowance:
    """The part of the limits that one file has not used yet."""

    path: Path
    stored: int
    """Size of the file in bytes."""
    largest: int = field(default_factory=lambda: limit(BYTES))
    ratio: int = field(default_factory=lambda: limit(RATIO))
    columns: int = field(default_factory=lambda: limit(COLUMNS))
    used: int = 0
    """Bytes that were taken from the file, after decompression."""

    def left(self) -> int:
        """Return the number of bytes that may still be taken."""
        return max(0, min(self.largest, max(HARMLESS, self.ratio * self.stored)) - self.used)

    def spend(self, size: int) -> None:
        """Count `size` bytes of decompressed data.

        Raises
        ------
        DataError
            The file contains more than it may.
        """
        if size > self.left():
            if self.used + size > self.largest:
                raise self._exceeded(f"more than {self.largest} bytes of data", BYTES)
            raise self._ratio_exceeded()
        self.used += size

    def check_ratio(self, produced: int, consumed: int) -> None:
        """Check how much `consumed` compressed bytes have become, so that a bomb is found at its start.

        Raises
        ------
        DataError
            The data is much larger than its compressed form.
        """
        if produced > max(HARMLESS, self.ratio * consumed):
            raise self._ratio_exceeded()

    def check_columns(self, count: int) -> None:
        """Check a number of columns or variables.

        Raises
        ------
        DataError
            There are more than the limit.
        """
        if count > self.columns:
            raise DataError(
                f"{self.path}: has {count} columns, more than {self.columns}; remove the columns that are no "
                f"part of the record, or raise the limit with the environment variable {COLUMNS}"
            )

    def _ratio_exceeded(self) -> DataError:
        return self._exceeded(f"data that is more than {self.ratio} times as large as the file", RATIO)

    def _exceeded(self, what: str, variable: str) -> DataError:
        return DataError(
            f"{self.path}: contains {what}; if you trust the file, raise the limit with the environment "
            f"variable {variable}"
        )

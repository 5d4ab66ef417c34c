"""The format of a record file, which follows from its name."""

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from gpi_hammerstein._native import DataError, ParameterError
from gpi_hammerstein.io.apart import is_possible, read_apart
from gpi_hammerstein.io.boundary import File, opened
from gpi_hammerstein.io.hdf5 import read_plain_hdf5
from gpi_hammerstein.io.labview import read_lvm, read_tdms
from gpi_hammerstein.io.mat import is_hdf5, read_mat
from gpi_hammerstein.io.mdf import read_mdf
from gpi_hammerstein.io.npy import read_npz
from gpi_hammerstein.io.tables import Table
from gpi_hammerstein.io.text import read_csv, read_parquet
from gpi_hammerstein.io.xlsx import read_xlsx


@dataclass(frozen=True)
class Format:
    """A format of record files."""

    name: str
    read: Callable[[File], list[Table]]
    risky: Callable[[bytes], bool] = lambda data: False
    """Whether the library for this content can end the process; see :mod:`gpi_hammerstein.io.apart`."""


def always(data: bytes) -> bool:
    """Return True: the library for this format is always used in another process."""
    return True


CSV = Format("CSV", read_csv)
FORMATS = {
    ".parquet": Format("Parquet", read_parquet, always),
    ".npz": Format("NPZ", read_npz),
    ".mat": Format("MAT", read_mat, is_hdf5),
    ".lvm": Format("LVM", read_lvm),
    ".tdms": Format("TDMS", read_tdms, always),
    **dict.fromkeys((".csv", ".tsv", ".txt", ".dat", ".asc", ".prn", ".gz"), CSV),
    **dict.fromkeys((".xlsx", ".xlsm"), Format("XLSX", read_xlsx, always)),
    **dict.fromkeys((".h5", ".hdf5", ".hdf"), Format("HDF5", read_plain_hdf5, always)),
    **dict.fromkeys((".mf4", ".mdf"), Format("MDF", read_mdf, always)),
}
# The starts of files that have the name of a text and are something else.
DISGUISED = {
    b"PK\x03\x04": ".xlsx",
    b"\x89HDF": ".h5",
    b"TDSm": ".tdms",
    b"MDF  ": ".mf4",
    b"PAR1": ".parquet",
}
OLD_EXCEL = b"\xd0\xcf\x11\xe0"
NAMES = (
    "names of record files end in .csv, .csv.gz, .txt, .xlsx, .parquet, .npz, .npy, .mat, .h5, .lvm, "
    ".tdms or .mf4"
)


def read_tables(path: Path, *, apart: bool = True) -> list[Table]:
    """Read a file of any format except NPY.

    Parameters
    ----------
    path
        The file.
    apart
        Whether files of risky formats are read in another process.

    Returns
    -------
    list of Table
        One table for each experiment.

    Raises
    ------
    DataError
        The file does not exist, has no known format, or cannot be read.

    Examples
    --------
    >>> read_tables(Path("record.csv"))  # doctest: +SKIP
    """
    suffix = path.suffix.lower()
    if suffix in FORMATS:
        chosen = FORMATS[suffix]
        with opened(path, chosen.name) as file:
            _require_format(file, chosen)
            if apart and chosen.risky(file.data) and is_possible():
                return read_apart(path)
            return chosen.read(file)
    if not os.path.exists(path):
        raise DataError(f"{path}: no such file; give a record file")
    if suffix == ".xls":
        raise DataError(f"{path}: the old format of Excel is not read; save the sheet as .xlsx or .csv")
    raise DataError(f"{path}: no known format; {NAMES}")


def _require_format(file: File, chosen: Format) -> None:
    """Refuse a file that is named as a text and has the content of another format."""
    if chosen is not CSV:
        return
    if file.data.startswith(OLD_EXCEL):
        raise DataError(f"{file.path}: is a workbook of Excel, not a text; save the sheet as .xlsx or .csv")
    for start, suffix in DISGUISED.items():
        if file.data.startswith(start):
            raise DataError(
                f"{file.path}: is no text file, but looks like {suffix}; rename it so that it ends in "
                f"{suffix}"
            )


def output_files(paths: Sequence[Path], outputs: list[str] | None) -> dict[Path, Path | None]:
    """Return the NPY file of the output for each NPY file of an input.

    Parameters
    ----------
    paths
        The files of a record.
    outputs
        The names that the user gives for the outputs.

    Returns
    -------
    dict
        The file of the output for each file of the input, None for a record without outputs; empty if the
        files are of other formats.

    Raises
    ------
    DataError
        A file of an output does not exist.
    ParameterError
        Only some of the files are NPY files, or the number of outputs is another one.

    Examples
    --------
    >>> output_files([Path("record.csv")], None)
    {}
    """
    if not any(path.suffix == ".npy" for path in paths):
        return {}
    other = next((path for path in paths if path.suffix != ".npy"), None)
    if other is not None:
        raise ParameterError(
            f"`path`: {other} together with .npy files; read .npy files separately, because each "
            "of them contains only one signal"
        )
    if outputs is None:
        return dict.fromkeys(paths)
    if len(outputs) != len(paths):
        raise ParameterError(
            f"`output` names {len(outputs)} files, but {len(paths)} .npy files of inputs are given; "
            "give one .npy file of the output for each of them, in the same order"
        )
    files: dict[Path, Path | None] = {}
    for path, name in zip(paths, outputs, strict=True):
        file = Path(name)
        # A file name without folder is also searched in the folder of the input.
        if not os.path.exists(file) and os.path.exists(path.parent / file):
            file = path.parent / file
        if not os.path.exists(file):
            raise DataError(
                f"{file}: no such file; for a .npy record, `output` is the .npy file of the output"
            )
        files[path] = file
    return files

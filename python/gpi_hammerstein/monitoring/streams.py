"""Samples of a machine from files, from a folder that is followed, and from lines of text."""

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, TextIO

import numpy as np
import polars as pl

from gpi_hammerstein._native import DataError, Model, ParameterError
from gpi_hammerstein.driven import require_match
from gpi_hammerstein.io.for_model import read_for_model
from gpi_hammerstein.io.formats import FORMATS
from gpi_hammerstein.io.header import find_header
from gpi_hammerstein.io.read import read_recording
from gpi_hammerstein.io.recording import Recording, Run

# Seconds between two looks at a folder. A file is read when its size has not changed between two of them.
PERIOD = 1.0
# Lines of text of which the header is found.
HEAD = 20


def of_files(model: Model, files: Iterable[Path], **options: Any) -> Iterator[Run]:
    """Yield the experiments of record files.

    Parameters
    ----------
    model
        The model, whose channels, units and rate the files must have.
    files
        The files.
    options
        As in :func:`~gpi_hammerstein.io.read.read_recording`.

    Yields
    ------
    Run
        One experiment after the other.

    Raises
    ------
    DataError, ParameterError
        As in :func:`~gpi_hammerstein.io.read.read_record`; the file does not match the model.

    Examples
    --------
    >>> for run in of_files(model, [Path("today.csv")]):  # doctest: +SKIP
    ...     monitor.push(run.u, run.y)
    """
    for file in files:
        recording = read_for_model(model, [file], **options)
        require_monitored(model, recording)
        yield from recording.runs


def require_monitored(model: Model, recording: Recording) -> None:
    """Reject a record that does not match the model, or lacks a measured column that it needs."""
    require_match(model, recording)
    record = recording.record()
    model.simulate(record[: min(2, len(recording.runs[0].u))])


def record_files(places: Sequence[Path]) -> list[Path]:
    """Return files, and the record files of folders, the oldest first.

    Parameters
    ----------
    places
        Files and folders.

    Returns
    -------
    list of Path
        The files.

    Raises
    ------
    ParameterError
        A folder contains no record.

    Examples
    --------
    >>> record_files([Path("run.csv")])
    [PosixPath('run.csv')]
    """
    found: list[Path] = []
    for place in places:
        if not place.is_dir():
            found.append(place)
            continue
        inside = _records_of(place)
        if not inside:
            raise ParameterError(
                f"`records` = {place}: no record file is there; known endings: {', '.join(FORMATS)}. "
                "--follow waits for files"
            )
        found += inside
    return found


def followed(folder: Path, refused: Callable[[str], None]) -> Iterator[Path]:
    """Yield the record files of a folder, and wait for new ones without end.

    Parameters
    ----------
    folder
        The folder. A file whose size still changes is not complete.
    refused
        Called with a message if the folder cannot be read at the moment.

    Yields
    ------
    Path
        Each file once, the oldest first.

    Examples
    --------
    >>> for file in followed(Path("runs"), print):  # doctest: +SKIP
    ...     print(file)
    """
    seen: set[Path] = set()
    sizes: dict[Path, int] = {}
    while True:
        try:
            present = {file: file.stat().st_size for file in _records_of(folder) if file not in seen}
        except OSError as error:
            refused(f"{folder}: {error.strerror}")
            present = {}
        for file, size in present.items():
            if sizes.get(file) == size:
                seen.add(file)
                yield file
        sizes = present
        time.sleep(PERIOD)


def _records_of(folder: Path) -> list[Path]:
    """Return the record files of a folder, the oldest first."""
    inside = [
        file for file in folder.iterdir() if file.is_file() and file.name.lower().endswith(tuple(FORMATS))
    ]
    return sorted(inside, key=lambda file: (file.stat().st_mtime, file.name))


def of_lines(
    model: Model,
    lines: TextIO,
    *,
    samples: int,
    input: list[str] | None = None,
    output: list[str] | None = None,
    covariate: list[str] | None = None,
) -> Iterator[Run]:
    r"""Yield samples that come as lines of text, with a header line, at the sampling rate of the model.

    Parameters
    ----------
    model
        The model. A time column is not used: the lines are taken for one sample each.
    lines
        For example ``sys.stdin``.
    samples
        Number of samples of each part.
    input, output, covariate
        Names of columns, as in :func:`~gpi_hammerstein.io.read.read_record`.

    Yields
    ------
    Run
        The next samples; the last part may be shorter.

    Raises
    ------
    DataError
        There is no header, a line has another number of cells, or a cell is not a number.

    Examples
    --------
    >>> import io
    >>> text = io.StringIO("u,y\n" + "0.5,1.0\n" * 3)
    >>> [len(run.u) for run in of_lines(model, text, samples=2)]  # doctest: +SKIP
    [2, 1]
    """
    numbered = enumerate(lines, 1)
    head = [line for _, line in zip(range(HEAD), (text for _, text in numbered), strict=False)]
    header = find_header("".join(head))
    if header is None or not header.is_named:
        raise DataError("standard input: the first line must be a header with the names of the columns")
    skipped = len(head) - len(header.rows.splitlines())
    first = enumerate(header.rows.splitlines(), skipped + 1)
    names = header.names
    rows: list[list[float]] = []

    def part() -> Run:
        frame = pl.DataFrame(np.array(rows), schema=names, orient="row")
        rows.clear()
        return _matching(model, frame, input, output, covariate)

    for source in (first, numbered):
        for number, line in source:
            if line.strip():
                rows.append(_numbers(line, number, names, header.separator))
            if len(rows) == samples:
                yield part()
    if rows:
        yield part()


def _numbers(line: str, number: int, names: Sequence[str], separator: str) -> list[float]:
    cells = line.split() if separator == " " else line.split(separator)
    if len(cells) != len(names):
        raise DataError(
            f"standard input, line {number}: {len(cells)} cells, but the header has {len(names)} columns"
        )
    row = []
    for name, cell in zip(names, cells, strict=True):
        try:
            row.append(float(cell) if cell.strip() else np.nan)
        except ValueError:
            raise DataError(
                f"standard input, line {number}, column `{name}`: `{cell.strip()}` is not a number"
            ) from None
    return row


def _matching(
    model: Model,
    frame: pl.DataFrame,
    input: list[str] | None,
    output: list[str] | None,
    covariate: list[str] | None,
) -> Run:
    own = [*model.input_names, *model.output_names]
    if input is None and output is None and set(own) <= set(frame.columns):
        input, output = model.input_names, model.output_names
    recording = read_recording(frame, input=input, output=output, covariate=covariate, rate=model.rate)
    require_monitored(model, recording)
    return recording.runs[0]

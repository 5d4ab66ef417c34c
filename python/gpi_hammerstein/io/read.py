"""Reading of records from files."""

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from gpi_hammerstein._native import DataError, ParameterError, Record
from gpi_hammerstein.io.clock import resample as put_on_grid
from gpi_hammerstein.io.clock import uniform_rate
from gpi_hammerstein.io.columns import TIME_UNITS, Column
from gpi_hammerstein.io.formats import output_files, read_tables
from gpi_hammerstein.io.frames import Frame, is_frame, read_frame
from gpi_hammerstein.io.npy import read_npy_pair
from gpi_hammerstein.io.recording import Recording, Run
from gpi_hammerstein.io.roles import Roles, assign_roles
from gpi_hammerstein.io.swapped import swapped_note
from gpi_hammerstein.io.tables import Table

# The seconds since 1970 have this value in the year 5138; larger stamps are in another unit.
LATEST_SECOND = 1e11
# Rates are the same if they differ by less than this part, which rounded stamps can cause.
SAME_RATE = 0.01

PathLike = str | os.PathLike[str]
Names = str | Sequence[str]


def read_record(
    path: PathLike | Frame | Sequence[PathLike | Frame],
    *,
    input: Names | None = None,
    output: Names | None = None,
    time: str | None = None,
    rate: float | None = None,
    covariate: Names | None = None,
    warmup: int | None = None,
    resample: bool | float | str | None = None,
    experiment: str | int | Sequence[int] | None = None,
) -> Record:
    """Read a record of one or several experiments.

    Parameters
    ----------
    path
        A file, or a list of files with the same columns, whose experiments are put in one record. Formats are
        CSV (``.csv``, ``.csv.gz``, also separated by semicolons, tabs or spaces), Excel (``.xlsx``), Parquet
        (``.parquet``), NumPy (``.npz``, ``.npy``), MATLAB v4, v5 or v7.3 (``.mat``), HDF5 (``.h5``), LabVIEW
        (``.lvm``, ``.tdms``) and MDF (``.mf4``). Excel, TDMS and MDF need the extras ``xlsx``, ``tdms`` and
        ``mdf``. Arrays in NumPy, MATLAB and HDF5 files have the shape (samples,), (samples, channels), (samples, channels, realisations) or (samples, channels,
        realisations, periods). Every realisation is an experiment; all of its periods except the last one are
        warm-up. A Polars or pandas data frame or an xarray dataset, with columns named as in a CSV file, is
        also accepted.
    input, output, covariate
        Names of the columns with or without their unit: ``"u_V"`` or ``"u"``. If they are not given, columns
        are recognised by words in their names and by their units, and a note says why. Inputs: ``u``, ``u1``,
        ``input``, else words such as ``voltage``, ``drive``, ``command``. Outputs: ``y``, ``y1``, ``output``, else
        words such as ``position``, ``sensor``. Every other
        column with only numbers is a covariate (``covariate=[]`` ignores them). A ``.npy`` file contains only the input;
        `output` is then the path of the file with the output. For several ``.npy`` files, give one output
        file for each of them.
    time
        Name of the time column; ``t``, ``time`` and similar names are recognised. The unit is part of the name
        (``t_ms``, ``Time (ms)``); without a unit, it is s. Dates and times of day are converted to seconds.
    rate
        Sampling rate in Hz; it replaces the time column.
    warmup
        Number of samples at the start of every experiment that drive the model but are not scored. None takes
        0, or the number that follows from the periods of an array.
    resample
        A rate in Hz, or True (or ``"auto"``) for the rate of the median step. Makes non-uniform sampling
        uniform by linear interpolation, and cuts the record into several experiments at gaps and where the
        clock jumps back. Rows in which a used column has no number are left out.
    experiment
        Experiments to keep, numbered from 0: ``3``, ``[0, 2]``, ``"0-4,7"``.

    Returns
    -------
    Record
        u, y, covariates, rate, names and units.

    Raises
    ------
    ParameterError
        An option contradicts the file or is out of range.
    DataError
        The file is missing, is not a regular file, is corrupt, is empty, or contains text, NaN or infinite
        samples; columns are missing or have different lengths; time stamps have gaps, run backwards or are
        not uniform. The message states the column and the rows, which are counted from 0. The file contains
        more than a limit allows.

    Notes
    -----
    Four limits protect against files that exhaust memory or time. They are environment variables:
    ``GPI_MAX_READ_BYTES`` (1073741824), the size of the data of one file after decompression;
    ``GPI_MAX_READ_RATIO`` (100), the ratio of this size to the size of the file, if the data has more than
    16 MiB; ``GPI_MAX_READ_COLUMNS`` (1000), the number of columns or variables of one file;
    ``GPI_MAX_READ_SECONDS`` (120), the time for a Parquet, HDF5, Excel, TDMS or MDF file. These formats are read
    in another process, because their libraries can end a process or block it if a file is corrupt. An HDF5 file that refers to other
    files is refused.

    Examples
    --------
    >>> record = gpi.read_record("run.csv", input="u_V", output="y_um")  # doctest: +SKIP
    >>> record.rate, record.output_units  # doctest: +SKIP
    (200.0, ['um'])
    """
    recording = read_recording(
        path,
        input=input,
        output=output,
        time=time,
        rate=rate,
        covariate=covariate,
        warmup=warmup,
        resample=resample,
        experiment=experiment,
    )
    return recording.record()


def read_recording(
    path: PathLike | Frame | Sequence[PathLike | Frame],
    *,
    input: Names | None = None,
    output: Names | None = None,
    time: str | None = None,
    rate: float | None = None,
    covariate: Names | None = None,
    warmup: int | None = None,
    resample: bool | float | str | None = None,
    experiment: str | int | Sequence[int] | None = None,
) -> Recording:
    """Read like :func:`read_record`, but do not require an output column.

    Parameters
    ----------
    path, input, output, time, rate, covariate, warmup, resample, experiment
        As in :func:`read_record`.

    Returns
    -------
    Recording
        The experiments, and notes on changes of the samples.

    Raises
    ------
    ParameterError, DataError
        As in :func:`read_record`.

    Examples
    --------
    >>> read_recording("input_only.csv").runs[0].u.shape  # doctest: +SKIP
    (1000, 1)
    """
    if rate is not None and not rate > 0:
        raise ParameterError(f"`rate` = {rate}: the sampling rate in Hz must be positive")
    if rate is not None and resample:
        raise ParameterError(
            "`rate` and `resample` exclude each other, because resampling needs the time stamps"
        )
    if warmup is not None and warmup < 0:
        raise ParameterError(f"`warmup` = {warmup}: must be a number of samples, zero or larger")
    given: list[Any] = [path] if is_frame(path) or isinstance(path, str | os.PathLike) else [*path]
    sources = [one if is_frame(one) else Path(one) for one in given]
    if not sources:
        raise ParameterError("`path`: no file is given; give at least one record")
    files = output_files([one for one in sources if isinstance(one, Path)], _names(output))
    parts = []
    for one in sources:
        outputs = _names(output)
        if is_frame(one):
            tables = [read_frame(one)]
        elif files:
            tables, outputs = read_npy_pair(one, files.get(one)), None
        else:
            tables = read_tables(one)
        for table in tables:
            roles = assign_roles(
                table.headers(),
                source=table.source,
                time=time,
                inputs=_names(input),
                outputs=outputs,
                covariates=_names(covariate),
                need_time=rate is None and table.rate is None,
                left_out=table.left_out,
                unusable=table.unusable(),
            )
            if covariate is None:
                table, roles = _without_unusable(table, roles)
            parts.append(_read_part(table, roles, rate, resample, warmup))
    names = [str(one) if isinstance(one, Path) else "the data frame" for one in sources]
    return _join(parts, names).select(experiment)


def _names(names: Names | None) -> list[str] | None:
    return None if names is None else [names] if isinstance(names, str) else list(names)


def _without_unusable(table: Table, roles: Roles) -> tuple[Table, Roles]:
    """Leave out columns that nobody has named and that contain no numbers: they are not judged."""
    unusable = table.unusable()
    left_out = {column.header: unusable[column] for column in roles.covariates if column in unusable}
    kept = [column for column in roles.covariates if column.header not in left_out]
    return replace(table, left_out=table.left_out | left_out), replace(roles, covariates=kept)


def _read_part(
    table: Table, roles: Roles, rate: float | None, resample: bool | float | str | None, warmup: int | None
) -> Recording:
    """Divide one table into experiments."""
    signals = [*roles.inputs, *roles.outputs, *roles.covariates]
    used = signals if roles.time is None or rate is not None else [roles.time, *signals]
    notes = [*table.notes, *roles.notes()]
    notes += [f"`{name}` is left out: it contains {what}" for name, what in table.left_out.items()]
    if resample and roles.time is not None:
        whole = table.complete_rows(used)
        if whole.any() and not whole.all():
            notes.append(f"{np.count_nonzero(~whole)} rows are left out, in which a used column has no number")
            table = replace(table, columns={column: x[whole] for column, x in table.columns.items()})
    table.require_numbers(used, has_clock=roles.time is not None and rate is None)
    samples = table.stack(signals)
    pieces, starts = [samples], [0.0]
    given = rate or table.rate
    if roles.time is not None and rate is None:
        stamps = table.columns[roles.time] * TIME_UNITS.get(roles.time.unit, 1.0)
        if resample:
            if isinstance(resample, str) and resample != "auto":
                raise ParameterError(
                    f"`resample` = {resample}: must be a rate in Hz, or `auto` for that of the median step"
                )
            asked = None if isinstance(resample, bool | str) else float(resample)
            found = put_on_grid(stamps, samples, asked, table.source)
            pieces, given = found.pieces, found.rate
            notes.append(found.note)
            starts = [0.0] * len(pieces)
        else:
            if not roles.time.unit and abs(stamps[0]) > LATEST_SECOND:
                raise DataError(
                    f"{table.source}: `{roles.time.header}` starts at {stamps[0]:.15g}, which is no time in "
                    f"seconds; add its unit to the name, as in `{roles.time.header}_ms`"
                )
            given, starts = uniform_rate(stamps, table.source), [float(stamps[0])]
            if not roles.time.unit and (stamps == np.rint(stamps)).all():
                notes.append(
                    f"`{roles.time.header}` contains only integers and has no unit: taken as seconds, "
                    f"{given:g} Hz; if it counts samples, give the rate in Hz (--rate)"
                )
    elif resample:
        raise ParameterError(
            f"`resample`: {table.source} has no time stamps, which resampling needs; give the rate (--rate)"
        )
    elif rate is not None:
        notes += _other_rate(table, roles, rate)
    assert given is not None  # assign_roles requires a time column otherwise
    if not (np.isfinite(given) and given > 0):
        raise DataError(
            f"{table.source}: the file states a sampling rate of {given:g} Hz, which must be positive and "
            "finite; give the rate in Hz with rate= (--rate)"
        )
    inputs, outputs = len(roles.inputs), len(roles.outputs)
    start_of_covariates = inputs + outputs
    runs = [
        Run(
            piece[:, :inputs],
            piece[:, inputs:start_of_covariates],
            piece[:, start_of_covariates:],
            table.warmup if warmup is None else warmup,
            start,
        )
        for piece, start in zip(pieces, starts, strict=True)
    ]
    notes += swapped_note(runs, roles)
    return Recording(
        runs, given, roles.inputs, roles.outputs, roles.covariates, notes, roles.undecided, roles.why
    )


def _other_rate(table: Table, roles: Roles, rate: float) -> list[str]:
    """Return a note if the file itself has another rate than the one that is given."""
    stated = table.rate
    if roles.time is not None and roles.time in table.columns:
        stamps = table.columns[roles.time] * TIME_UNITS.get(roles.time.unit, 1.0)
        steps = np.diff(stamps[np.isfinite(stamps)])
        whole = not roles.time.unit and (stamps == np.rint(stamps)).all()  # a counter states no rate
        usual = float(np.median(steps)) if steps.size and not whole else 0.0
        stated = 1.0 / usual if usual > 0 else None
    if stated is None or abs(stated - rate) <= SAME_RATE * rate:
        return []
    where = "the file" if roles.time is None else f"`{roles.time.header}`"
    return [f"{where} says {stated:.6g} Hz, but --rate {rate:g} is used; omit it to use the rate of {where}"]


def _join(parts: Sequence[Recording], sources: Sequence[str]) -> Recording:
    """Put all experiments in one recording."""
    first, *others = parts
    runs, notes = list(first.runs), list(first.notes)
    where = f"{sources[0]} and {sources[-1]}" if len(sources) > 1 else sources[0]
    for part in others:
        if abs(part.rate - first.rate) > 1e-3 * first.rate:
            raise DataError(
                f"{where}: sampled at {first.rate:g} and {part.rate:g} Hz; resample to one rate (--resample)"
            )
        for what, ours, theirs in (
            ("inputs", first.inputs, part.inputs),
            ("outputs", first.outputs, part.outputs),
            ("covariates", first.covariates, part.covariates),
        ):
            if _labels(ours) != _labels(theirs):
                raise DataError(
                    f"{where}: {what} differ: {', '.join(_labels(ours)) or 'none'} and "
                    f"{', '.join(_labels(theirs)) or 'none'}; name columns that both files have"
                )
        runs += part.runs
        notes += part.notes
    return replace(first, runs=runs, notes=notes)


def _labels(columns: Sequence[Column]) -> list[str]:
    return [column.header for column in columns]

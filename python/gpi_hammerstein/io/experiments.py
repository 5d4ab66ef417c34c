"""Division of tables into experiments, by the roles of their columns and the clock."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gpi_hammerstein._native import DataError, ParameterError
from gpi_hammerstein.io.clock import resample as put_on_grid
from gpi_hammerstein.io.clock import uniform_rate
from gpi_hammerstein.io.columns import TIME_UNITS, Column
from gpi_hammerstein.io.recording import Recording, Run
from gpi_hammerstein.io.roles import Roles, assign_roles
from gpi_hammerstein.io.sources import Names, Source, name_list
from gpi_hammerstein.io.swapped import swapped_note
from gpi_hammerstein.io.tables import Table

# The seconds since 1970 have this value in the year 5138; larger stamps are in another unit.
LATEST_SECOND = 1e11
# Rates are the same if they differ by less than this part, which rounded stamps can cause.
SAME_RATE = 0.01


def recording_of(
    sources: Sequence[Source],
    *,
    input: Names | None,
    time: str | None,
    rate: float | None,
    covariate: Names | None,
    warmup: int | None = None,
    resample: bool | float | str | None,
) -> Recording:
    """Divide the columns of sources by their roles, and join the experiments.

    Parameters
    ----------
    sources
        What :func:`~gpi_hammerstein.io.sources.read_sources` returns.
    input, time, rate, covariate, warmup, resample
        As in :func:`~gpi_hammerstein.io.read.read_record`.

    Returns
    -------
    Recording
        All experiments.

    Raises
    ------
    ParameterError, DataError
        As in :func:`~gpi_hammerstein.io.read.read_record`.

    Examples
    --------
    >>> recording_of(read_sources("run.csv", None), rate=100.0)  # doctest: +SKIP
    """
    parts = []
    for source in sources:
        for table in source.tables:
            roles = assign_roles(
                table.headers(),
                source=table.source,
                time=time,
                inputs=name_list(input),
                outputs=source.outputs,
                covariates=name_list(covariate),
                need_time=rate is None and table.rate is None,
                left_out=table.left_out,
                unusable=table.unusable(),
            )
            if covariate is None:
                table, roles = _without_unusable(table, roles)
            parts.append(_read_part(table, roles, rate, resample, warmup))
    return _join(parts, [source.name for source in sources])


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
            notes.append(
                f"{np.count_nonzero(~whole)} rows are left out, in which a used column has no number"
            )
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
        runs,
        given,
        roles.inputs,
        roles.outputs,
        roles.covariates,
        notes,
        roles.undecided,
        roles.why,
        roles.time,
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

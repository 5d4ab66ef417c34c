"""Name, unit and role of a column, from its header."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from gpi_hammerstein._native import DataError

# Seconds in each unit of a time column.
TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0}

UNITS = frozenset(
    [*TIME_UNITS, *"V mV uV kV A mA uA kA C nC pC W mW m mm um nm pm cm km N mN uN kN Nm".split()]
    + "Pa kPa MPa bar mbar psi g kg deg rad mrad urad nrad arcsec K degC degF Hz kHz MHz T mT Oe".split()
    + "Ohm kOhm F nF pF percent rpm".split()
)

TIME = re.compile(r"t|time|timestamp", re.IGNORECASE)
INPUT = re.compile(r"(u|in|input)_?\d*", re.IGNORECASE)
OUTPUT = re.compile(r"(y|out|output)_?\d*", re.IGNORECASE)
# Names of the drive and of the motion, used if no column has one of the names above.
DRIVE = re.compile(r"(voltage|drive|command)_?\d*", re.IGNORECASE)
MOTION = re.compile(r"(position|displacement)_?\d*", re.IGNORECASE)


@dataclass(frozen=True)
class Column:
    """A header of a column, with the name and the unit that it contains."""

    header: str
    name: str
    unit: str
    array: str
    """Name of the array that contains the column; in a table, the header itself."""

    def matches(self, wanted: str) -> bool:
        """Return whether the name `wanted` that a user gives means this column."""
        return wanted in (self.header, self.name, self.array)


@dataclass(frozen=True)
class Roles:
    """The columns of a file, by their roles."""

    time: Column | None = None
    inputs: list[Column] = field(default_factory=list)
    outputs: list[Column] = field(default_factory=list)
    covariates: list[Column] = field(default_factory=list)

    def used(self) -> list[Column]:
        """Return all columns that have a role."""
        time = [self.time] if self.time else []
        return [*time, *self.inputs, *self.outputs, *self.covariates]


def parse_header(header: str, array: str | None = None) -> Column:
    """Split a header into name and unit.

    Parameters
    ----------
    header
        The header, for example ``y_um``, ``y [um]`` or ``y``. The text after the last underscore is the unit
        only if it is the symbol of a known unit.
    array
        Name of the array that contains the column.

    Returns
    -------
    Column
        The name and the unit. The unit is empty if the header has none.

    Examples
    --------
    >>> parse_header("y_um").unit, parse_header("x_left").name
    ('um', 'x_left')
    """
    header = header.strip()
    name, unit = header, ""
    if found := re.fullmatch(r"(.*?)\s*[\[(](.*)[\])]", header):
        name, unit = found[1], found[2].strip()
    else:
        *rest, last = header.split("_")
        if last in UNITS and any(rest):
            name, unit = "_".join(rest), last
            *rest, before = rest
            if last in TIME_UNITS and before in UNITS and any(rest):
                name, unit = "_".join(rest), f"{before}/{last}"
    return Column(header, name, unit, array or header)


def assign_roles(
    columns: Sequence[Column],
    *,
    source: str,
    time: str | None = None,
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
    covariates: Sequence[str] | None = None,
    need_time: bool = True,
    left_out: Mapping[str, str] | None = None,
) -> Roles:
    """Determine which columns are time, inputs, outputs and covariates.

    Parameters
    ----------
    columns
        The columns of a file.
    source
        Name of the file, for messages.
    time, inputs, outputs, covariates
        Names that the user gives, with or without unit. If a role is None, columns are recognised by the
        usual names. Time: ``t`` or ``time``. Inputs: ``u``, ``u1``, ``input``, else ``voltage``, ``drive``,
        ``command``. Outputs: ``y``, ``y1``, ``output``, else ``position``, ``displacement``. Every other
        column is a covariate.
    need_time
        False if the rate is known. A time column is then recognised but not required.
    left_out
        Names of arrays of the file that are no columns, and what they contain, for messages.

    Returns
    -------
    Roles
        The columns by role. A record without outputs is allowed, because it can be simulated.

    Raises
    ------
    DataError
        A named column does not exist, no input is found, or one column has two roles.

    Examples
    --------
    >>> roles = assign_roles([parse_header(h) for h in ("t_s", "u_V", "y_um")], source="demo")
    >>> roles.outputs[0].name
    'y'
    """
    there = ", ".join(column.header for column in columns)
    there += "".join(f"; `{name}` is left out: it contains {what}" for name, what in (left_out or {}).items())

    def named(option: str, names: Sequence[str]) -> list[Column]:
        found: list[Column] = []
        for name in names:
            matching = [column for column in columns if column.matches(name)]
            if not matching:
                raise DataError(f"{source}: no column `{name}` (given as {option}); the columns are: {there}")
            found += matching
        return found

    def usual(pattern: re.Pattern[str], taken: Sequence[Column]) -> list[Column]:
        return [c for c in columns if pattern.fullmatch(c.name) and c not in taken]

    time_given = named("time", [time]) if time is not None else []
    given = [*time_given]
    chosen_inputs = named("input", inputs) if inputs is not None else None
    chosen_outputs = named("output", outputs) if outputs is not None else None
    chosen_covariates = named("covariate", covariates) if covariates is not None else None
    for chosen in (chosen_inputs, chosen_outputs, chosen_covariates):
        given += chosen or []
    twice = sorted({column.header for column in given if given.count(column) > 1})
    if twice:
        raise DataError(f"{source}: column `{twice[0]}` is given two roles; name it only once")

    times = time_given or usual(TIME, given)[:1]
    if chosen_inputs is None:
        chosen_inputs = usual(INPUT, [*given, *times]) or usual(DRIVE, [*given, *times])
    if chosen_outputs is None:
        chosen_outputs = usual(OUTPUT, [*given, *times]) or usual(MOTION, [*given, *times])
    if not chosen_inputs:
        others = [
            what
            for what, missing in (
                ("the output with output= (--output)", not chosen_outputs),
                ("the time with time= (--time), or give the rate in Hz with rate= (--rate)", not times),
            )
            if missing
        ]
        more = "".join(f", {what}" for what in others)
        raise DataError(
            f"{source}: no input column; name one with input= (--input){more}. The columns are: {there}"
        )
    if not times and need_time:
        raise DataError(
            f"{source}: no time column; name one with time= (--time) or give the sampling rate in Hz "
            f"with rate= (--rate). The columns are: {there}"
        )
    taken = [*given, *times, *chosen_inputs, *chosen_outputs]
    if chosen_covariates is None:
        chosen_covariates = [column for column in columns if column not in taken]
    return Roles(times[0] if times else None, chosen_inputs, chosen_outputs, chosen_covariates)

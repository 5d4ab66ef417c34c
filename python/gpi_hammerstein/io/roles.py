"""The roles of the columns of a file: time, inputs, outputs and covariates."""

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

from gpi_hammerstein._native import DataError
from gpi_hammerstein.io.columns import Column
from gpi_hammerstein.io.vocabulary import EXACTLY, score

# A column for which only the unit speaks.
ONLY_UNIT = 1


@dataclass(frozen=True)
class Roles:
    """The columns of a file, by their roles."""

    time: Column | None = None
    inputs: list[Column] = field(default_factory=list)
    outputs: list[Column] = field(default_factory=list)
    covariates: list[Column] = field(default_factory=list)
    why: dict[str, str] = field(default_factory=dict)
    """Why each guessed column was taken for its role, by its header."""
    undecided: list[Column] = field(default_factory=list)
    """Columns of which each may be the output, so that none was taken."""

    def used(self) -> list[Column]:
        """Return all columns that have a role."""
        time = [self.time] if self.time else []
        return [*time, *self.inputs, *self.outputs, *self.covariates]

    def notes(self) -> list[str]:
        """Return a note on each role that was guessed from other words than the usual names."""
        found = []
        for role, columns in (
            ("time", [self.time] if self.time else []),
            ("input", self.inputs),
            ("output", self.outputs),
        ):
            for column in columns:
                why = self.why.get(column.header, "")
                if why and "it is named" not in why:
                    found.append(
                        f"`{column.header}` is taken as the {role}: {why}; --{role} names another column"
                    )
        return found


@dataclass(frozen=True)
class Guess:
    """The columns that are taken for a role, and why."""

    columns: list[Column]
    why: dict[str, str]
    rivals: list[Column] = field(default_factory=list)
    """Columns that speak equally for the role, so that none was taken."""


def guess(columns: Sequence[Column], role: str) -> Guess:
    """Find the columns of a role by their names and units.

    The columns with the largest score of :mod:`~gpi_hammerstein.io.vocabulary` are taken if their names are
    the usual ones or differ only in a number. If equal scores belong to different names, none is taken. A
    column for which only its unit speaks must be the only one.

    Parameters
    ----------
    columns
        The columns that have no role yet.
    role
        ``time``, ``input`` or ``output``.

    Returns
    -------
    Guess
        The columns and the reasons.

    Examples
    --------
    >>> from gpi_hammerstein.io.columns import parse_header
    >>> guess([parse_header("AO0"), parse_header("AI0")], "input").columns[0].name
    'AO0'
    """
    other = {"input": "output", "output": "input"}.get(role)
    scores = [(*score(column, role), column) for column in columns]
    if other is not None:  # a column that speaks at least as strongly for the other role is not this one
        scores = [found for found in scores if found[0] > score(found[2], other)[0]]
    best = max((points for points, _, _ in scores), default=0)
    if best == 0:
        return Guess([], {})
    found = [(column, why) for points, why, column in scores if points == best]
    stems = {re.sub(r"[\W_]*\d+", "", column.name).lower() for column, _ in found}
    if role == "time":
        found = found[:1]
    elif best < EXACTLY and (len(stems) > 1 or (best == ONLY_UNIT and len(found) > 1)):
        return Guess([], {}, [column for column, _ in found])
    return Guess([column for column, _ in found], {column.header: why for column, why in found})


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
    unusable: Collection[Column] = (),
) -> Roles:
    """Determine which columns are time, inputs, outputs and covariates.

    Parameters
    ----------
    columns
        The columns of a file.
    source
        Name of the file, for messages.
    time, inputs, outputs, covariates
        Names that the user gives, with or without unit. If a role is None, columns are recognised by their
        names and units, see :func:`guess`. Every other column is a covariate.
    need_time
        False if the rate is known. A time column is then recognised but not required.
    left_out
        Names of arrays of the file that are no columns, and what they contain, for messages.
    unusable
        Columns without numbers. They are taken only if a user names them or if their name is the usual one,
        so that an error tells what is wrong with them.

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
    >>> from gpi_hammerstein.io.columns import parse_header
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

    given = {
        role: named(role, names)
        for role, names in (
            ("time", None if time is None else [time]),
            ("input", inputs),
            ("output", outputs),
            ("covariate", covariates),
        )
        if names is not None
    }
    taken = [column for chosen in given.values() for column in chosen]
    twice = sorted({column.header for column in taken if taken.count(column) > 1})
    if twice:
        raise DataError(f"{source}: column `{twice[0]}` is given two roles; name it only once")

    why: dict[str, str] = {}
    rivals: dict[str, list[Column]] = {}
    for role in ("time", "input", "output"):
        if role in given:
            continue
        free = [c for c in columns if c not in taken and (c not in unusable or score(c, role)[0] == EXACTLY)]
        found = guess(free, role)
        if not found.columns and role == "time":
            found = guess([c for c in columns if c not in taken], role)
        given[role], rivals[role] = found.columns, found.rivals
        why |= found.why
        taken += found.columns
    if not given["input"]:
        free = [c for c in columns if c not in taken and score(c, "output")[0] > ONLY_UNIT]
        raise DataError(_no_input(source, there, given, rivals, free))
    if not given["time"] and need_time:
        raise DataError(
            f"{source}: no time column; name one with time= (--time) or give the sampling rate in Hz "
            f"with rate= (--rate). The columns are: {there}"
        )
    others = [column for column in columns if column not in taken]
    return Roles(
        next(iter(given["time"]), None),
        given["input"],
        given["output"],
        given.get("covariate", others),
        why,
        rivals.get("output", []),
    )


def _no_input(
    source: str,
    there: str,
    given: Mapping[str, list[Column]],
    rivals: Mapping[str, list[Column]],
    others_free: Sequence[Column],
) -> str:
    """Return what to do if no column was recognised as an input."""
    others = [
        what
        for what, missing in (
            ("the output with output= (--output)", not given["output"]),
            ("the time with time= (--time), or give the rate in Hz with rate= (--rate)", not given["time"]),
        )
        if missing
    ]
    more = "".join(f", {what}" for what in others)
    text = f"{source}: no input column; name one with input= (--input){more}. The columns are: {there}"
    if undecided := rivals.get("input"):
        names = ", ".join(column.header for column in undecided)
        text += f". Each of these may be the input: {names}"
    if len(given["output"]) == 1 and len(others_free) == 1:
        text += (
            f". If a motion is imposed and its effect is measured, use --input {given['output'][0].header} "
            f"--output {others_free[0].header}"
        )
    return text

"""The result of the comparison of two models."""

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any

from gpi_hammerstein.difference.row import Difference
from gpi_hammerstein.difference.significance import LEVEL
from gpi_hammerstein.difference.simulation import SimulatedDifference
from gpi_hammerstein.difference.words import conclusion, shown, verdict
from gpi_hammerstein.json_values import plain
from gpi_hammerstein.stage import Range

TITLES = {"figure": "Figures of the stage", "effect": "Effects", "parameter": "Parameters"}


@dataclass(frozen=True)
class ModelDifferences:
    """Which values of two models differ beyond their uncertainty; the result of `compare`.

    Parameters
    ----------
    names
        Names of the models: their files, or A and B.
    rows
        All compared values: figures of the stage, quantities of effects, and the parameters of models with
        the same structure.
    other_structure
        Why parameters were not compared; empty for models with the same structure.
    only_a, only_b
        Resonances and effects that only one of the models has.
    ranges
        For each input its name, and lowest and highest value of the range in which sensitivity and hysteresis
        are compared, in its unit; None if the models show no range.
    simulation
        The difference of the simulated outputs; None if they were not simulated.
    notes
        What a reader of the rows must know.

    Examples
    --------
    >>> bank = gpi.PlayBank([0.0, 1.0], [1.0, 0.5])
    >>> u = gpi.multisine(2000, 1000.0, (0.5, 400.0), (0.0, 10.0))
    >>> noise = 0.01 * np.random.default_rng(1).normal(size=(2, 2000))
    >>> records = [gpi.Record(u, bank(u) + own, 1000.0) for own in noise]
    >>> a, b = (gpi.identify(own, delay=0, half_widths=[0.0, 1.0], thresholds=0) for own in records)
    >>> found = gpi.compare(a, b)
    >>> found.differing, found.other_structure
    ([], ())
    """

    names: tuple[str, str]
    rows: tuple[Difference, ...]
    other_structure: tuple[str, ...]
    only_a: tuple[str, ...]
    only_b: tuple[str, ...]
    ranges: tuple[tuple[str, Range | None], ...]
    simulation: SimulatedDifference | None
    notes: tuple[str, ...]

    @property
    def differing(self) -> list[str]:
        """Names of the values that differ, in the order of the rows."""
        return [row.name for row in self.rows if row.differs]

    def __getitem__(self, name: str) -> Difference:
        """Return the row of a value."""
        for row in self.rows:
            if row.name == name:
                return row
        raise KeyError(name)

    def to_dict(self) -> dict[str, Any]:
        """Return the comparison as the JSON object `gpi-comparison/1`.

        Returns
        -------
        dict
            All parts, with numbers in the units of the rows.
        """
        found: dict[str, Any] = plain(
            {
                "schema": "gpi-comparison/1",
                "kind": "models",
                "a": self.names[0],
                "b": self.names[1],
                "level": LEVEL,
                "rows": [asdict(row) for row in self.rows],
                "differing": self.differing,
                "other_structure": self.other_structure,
                "only_a": self.only_a,
                "only_b": self.only_b,
                "ranges": [{"input": name, "range": own} for name, own in self.ranges],
                "simulation": None if self.simulation is None else asdict(self.simulation),
                "notes": self.notes,
            }
        )
        return found

    def __repr__(self) -> str:
        """Return a table of the rows, and what follows from them."""
        return "\n".join(models_in_words(self))


def models_in_words(found: ModelDifferences) -> Iterator[str]:
    """Yield the lines of the comparison of two models.

    Parameters
    ----------
    found
        The comparison.

    Yields
    ------
    str
        Tables, then sentences.
    """
    if found.names != ("A", "B"):
        yield from (f"{label}: {name}" for label, name in zip("AB", found.names, strict=True))
    width = max([24, *(len(_label(row)) for row in found.rows)])
    for group, title in TITLES.items():
        # what only one model has is listed below
        rows = [row for row in found.rows if row.group == group and None not in (row.a, row.b)]
        if rows:
            yield ""
            yield f"{title:<{width}}{'A':>12}{'B':>12}{'B - A':>12}{'std':>10}{'z':>8}{'p':>10}"
            yield "-" * (width + 78)
            yield from (_line(row, width) for row in rows)
    yield ""
    yield from _sentences(found)


def _label(row: Difference) -> str:
    return f"{row.name} [{row.unit}]" if row.unit else row.name


def _line(row: Difference, width: int) -> str:
    cells = [
        shown(row.a, 12, 5),
        shown(row.b, 12, 5),
        shown(row.difference, 12, 3),
        shown(row.std, 10, 2),
        shown(row.z, 8, 3),
        shown(row.p_value, 10, 2),
    ]
    return f"{_label(row):<{width}}{''.join(cells)}  {verdict(row.differs)}"


def _sentences(found: ModelDifferences) -> Iterator[str]:
    yield conclusion(found.differing, sum(row.differs is not None for row in found.rows), "values")
    for name, own in (("A", found.only_a), ("B", found.only_b)):
        if own:
            yield f"Only {name} has: {', '.join(own)}."
    if found.other_structure:
        reasons = "; ".join(found.other_structure)
        yield f"The parameters were not compared, because the structures differ: {reasons}."
    for name, own_range in found.ranges:
        if own_range is not None:
            low, high = own_range
            ends = f"{low:.4g} and {high:.4g}"
            yield f"Sensitivity and hysteresis are those of slow motion of {name} between {ends}."
    yield from _simulated(found)
    yield from found.notes


def _simulated(found: ModelDifferences) -> Iterator[str]:
    own = found.simulation
    if own is None:
        return
    space = f" {own.unit}" if own.unit else ""
    if own.error_a is not None and own.error_b is not None:
        yield (
            f"On the record, the error of A is {own.error_a['rms']:.4g}{space} rms, and that of B "
            f"{own.error_b['rms']:.4g}{space} rms ({own.rule})."
        )
    where = "on the record" if own.drive == "record" else "for a decaying triangle over this range"
    movement = 100 * own.rms / own.movement if own.movement else 0.0
    yield (
        f"The simulated outputs differ by {own.rms:.4g}{space} rms {where}, {movement:.2g} % of their "
        "movement. "
        + (
            "How much of it the uncertainty of the models explains is not known."
            if own.explained is None
            else f"The uncertainty of both models explains {own.expected_rms:.4g}{space} rms."
        )
    )

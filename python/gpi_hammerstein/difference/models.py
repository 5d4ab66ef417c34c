"""The result of the comparison of two models."""

from dataclasses import asdict, dataclass
from typing import Any

from gpi_hammerstein.difference.row import Difference
from gpi_hammerstein.difference.significance import LEVEL
from gpi_hammerstein.difference.simulation import SimulatedDifference
from gpi_hammerstein.json_values import plain
from gpi_hammerstein.stage import Range


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
        from gpi_hammerstein.difference.words import models_in_words

        return "\n".join(models_in_words(self))

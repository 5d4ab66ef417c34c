"""The result of an inspection."""

from collections.abc import Mapping
from typing import Any

from gpi_hammerstein.inspection.text import text_of

SCHEMA = "gpi-inspection/1"
EMPTY: dict[str, Any] = {
    "problem": None,
    "assumed": None,
    "columns": [],
    "clock": None,
    "record": None,
    "inputs": [],
    "outputs": [],
    "notes": [],
    "findings": [],
    "identifiable": [],
    "next": {},
    "next_experiment": None,
}


class Inspection:
    """What a record contains, and what a model of it can determine. Printing it shows a summary.

    Parameters
    ----------
    found : mapping
        The results by the names of the properties; those that are missing are empty.

    Examples
    --------
    >>> found = gpi.inspect(gpi.Record(np.arange(5.0), np.arange(5.0), rate=1.0))
    >>> found.record["samples"]
    5
    """

    def __init__(self, found: Mapping[str, Any]) -> None:
        self._found: dict[str, Any] = EMPTY | dict(found)

    @property
    def files(self) -> list[str]:
        """The names of the files."""
        return list(self._found["files"])

    @property
    def problem(self) -> str | None:
        """Why the record cannot be used as it is; None if it can."""
        found: str | None = self._found["problem"]
        return found

    @property
    def assumed(self) -> str | None:
        """The option with which the record was read in spite of a problem; None if there is none."""
        found: str | None = self._found["assumed"]
        return found

    @property
    def columns(self) -> list[dict[str, Any]]:
        """The columns of the first file.

        Each has ``header``, ``name``, ``unit``, ``role`` (time, input, output, covariate or unused), ``why``
        it has this role, ``low``, ``high`` and ``step`` (the resolution) in the unit of the column,
        ``missing`` samples, whether it is ``constant``, and ``text`` if it contains something else than
        numbers.
        """
        return list(self._found["columns"])

    @property
    def clock(self) -> dict[str, Any] | None:
        """The time stamps; None without a time column.

        The keys are ``median_step_s``, ``smallest_step_s``, ``largest_step_s`` and ``duration_s`` in s, and
        the numbers of ``gaps``, steps ``backward`` and ``repeated`` stamps.
        """
        found: dict[str, Any] | None = self._found["clock"]
        return found

    @property
    def record(self) -> dict[str, Any] | None:
        """The size of the record; None if it cannot be read.

        The keys are the numbers of ``samples`` and ``experiments``, ``rate_hz`` in Hz, ``duration_s`` in s,
        and ``excitation_order``, the order of persistent excitation (None if it grows with the number of
        taps).
        """
        found: dict[str, Any] | None = self._found["record"]
        return found

    @property
    def inputs(self) -> list[dict[str, Any]]:
        """The excitation by each input.

        The keys are ``name``, ``unit``, ``low``, ``high``, ``band_hz`` (between which 99 % of the power lies,
        in Hz), ``swings`` (large ones), ``largest_swing``, ``lengths`` (number of different lengths of
        swings), ``speeds`` (ratio of the fast to the slow swings), ``longest_hold_s`` and ``period_s`` in s
        (None if the input does not repeat), and ``fed_back`` (whether past outputs predict the input).
        """
        return list(self._found["inputs"])

    @property
    def outputs(self) -> list[dict[str, Any]]:
        """Each output.

        The keys are ``name``, ``unit``, ``low``, ``high``, ``step`` (the resolution), ``clipped`` (the part
        of the samples at a limit while the input moves) and ``noise_at_most`` (rms of white noise), in the
        unit of the output.
        """
        return list(self._found["outputs"])

    @property
    def notes(self) -> list[str]:
        """What was changed or guessed while the record was read."""
        return list(self._found["notes"])

    @property
    def findings(self) -> list[str]:
        """What is wrong or remarkable, in sentences."""
        return list(self._found["findings"])

    @property
    def identifiable(self) -> list[dict[str, str]]:
        """What a model can determine: ``what``, ``possible`` (yes, partly, no) and ``why``."""
        return list(self._found["identifiable"])

    @property
    def next(self) -> dict[str, str]:
        """The ``command`` to run next, and ``why``."""
        return dict(self._found["next"])

    @property
    def next_experiment(self) -> dict[str, str] | None:
        """The ``command`` that writes the drive of another experiment, and ``why``; None if not needed."""
        found: dict[str, str] | None = self._found["next_experiment"]
        return found

    def to_dict(self) -> dict[str, Any]:
        """Return the inspection as values that JSON can represent, with the key ``schema``.

        Returns
        -------
        dict
            All properties: signals in their own units, times in s, rates in Hz.

        Examples
        --------
        >>> gpi.inspect(gpi.Record(np.arange(5.0), np.arange(5.0), rate=1.0)).to_dict()["schema"]
        'gpi-inspection/1'
        """
        return {"schema": SCHEMA, **self._found}

    def __str__(self) -> str:
        """Return a summary in words."""
        return text_of(self._found)

    def __repr__(self) -> str:
        """Return the names of the files."""
        return f"Inspection({', '.join(self.files)})"

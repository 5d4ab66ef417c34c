"""Signals over time, reduced to what a picture of a part of them can show."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gpi_hammerstein._native import ParameterError
from gpi_hammerstein.io.recording import Recording

Array = NDArray[np.float64]

# Groups of samples of one picture; each gives its smallest and its largest value. A screen has rarely more
# columns for a picture.
GROUPS = 1200
# Points of a picture of the output over the input, which must stay quick on a phone.
LOOP_POINTS = 4000
# Digits of a number that is sent: finer than a screen shows.
DIGITS = 7


@dataclass(frozen=True)
class Channel:
    """What a column of samples is."""

    name: str
    unit: str
    kind: str
    """Input, output, covariate, simulated or residual."""


@dataclass(frozen=True)
class Signals:
    """Signals of one or several experiments."""

    channels: list[Channel]
    values: list[Array]
    """For each experiment, (samples, channels)."""
    rate: float
    """Sampling rate in Hz."""

    def part(self, experiment: int, start: float = 0.0, end: float = math.inf) -> dict[str, Any]:
        """Return a part of an experiment for a picture.

        Parameters
        ----------
        experiment
            Its number, from 0.
        start, end
            The part in s after the first sample of the experiment.

        Returns
        -------
        dict
            ``experiments``, ``samples`` and ``rate`` of the whole, ``every`` (samples of a group), ``time``
            in s, and ``lines``. If ``every`` is more than 1, a line goes through the smallest and the largest
            value of each group, so that no extreme is lost. ``loops`` has the samples of each output over the
            first input, and is thinned out instead.

        Raises
        ------
        ParameterError
            There is no such experiment.

        Examples
        --------
        >>> ramp = Signals([Channel("u", "V", "input")], [np.arange(4.0)[:, None]], rate=2.0)
        >>> ramp.part(0, start=0.5)["lines"][0]["values"]
        [1.0, 2.0, 3.0]
        """
        if not 0 <= experiment < len(self.values):
            raise ParameterError(
                f"`experiment` = {experiment}: there are {len(self.values)}, numbered from 0"
            )
        values = self.values[experiment]
        samples = len(values)
        first = min(max(math.floor(start * self.rate), 0), max(samples - 2, 0))
        last = min(math.ceil(min(end, samples / self.rate) * self.rate) + 1, samples)
        last = max(last, min(first + 2, samples))
        own = values[first:last]
        every = max(1, math.ceil(len(own) / GROUPS))
        if every == 1:
            place, reduced = np.arange(first, last, dtype=np.float64), own
        else:
            begins = np.arange(0, len(own), every)
            low, high = np.minimum.reduceat(own, begins), np.maximum.reduceat(own, begins)
            reduced = np.stack([low, high], axis=1).reshape(-1, own.shape[1])
            place = first + np.stack([begins, begins + every / 2], axis=1).reshape(-1)
        return {
            "experiments": len(self.values),
            "samples": samples,
            "rate": self.rate,
            "every": every,
            "time": rounded(place / self.rate),
            "lines": [
                {"name": one.name, "unit": one.unit, "kind": one.kind, "values": rounded(reduced[:, index])}
                for index, one in enumerate(self.channels)
            ],
            "loops": self._loops(own),
        }

    def _loops(self, own: Array) -> list[dict[str, Any]]:
        kinds = [one.kind for one in self.channels]
        if "input" not in kinds or "output" not in kinds:
            return []
        thin = own[:: max(1, math.ceil(len(own) / LOOP_POINTS))]
        drive = kinds.index("input")
        return [
            {
                "input": drive,
                "output": index,
                "x": rounded(thin[:, drive]),
                "y": rounded(thin[:, index]),
            }
            for index, kind in enumerate(kinds)
            if kind == "output"
        ]


def rounded(values: Array) -> list[float | None]:
    """Return numbers with few digits, for JSON; None for those that are not finite.

    Parameters
    ----------
    values
        The numbers, (samples,).

    Examples
    --------
    >>> rounded(np.array([1 / 3, np.nan]))
    [0.3333333, None]
    """
    return [float(f"{value:.{DIGITS}g}") if math.isfinite(value) else None for value in values.tolist()]


def signals_of(recording: Recording) -> Signals:
    """Return the signals of a recording: inputs, outputs, covariates.

    Parameters
    ----------
    recording
        The recording.

    Examples
    --------
    >>> signals_of(read_recording("run.csv")).part(0)  # doctest: +SKIP
    """
    kinds = (("input", recording.inputs), ("output", recording.outputs), ("covariate", recording.covariates))
    channels = [Channel(column.name, column.unit, kind) for kind, columns in kinds for column in columns]
    values = [np.hstack([run.u, run.y, run.covariates]) for run in recording.runs]
    return Signals(channels, values, recording.rate)

"""The time series of the page: which samples it contains, and at which rate.

If all samples fit into `DATA_BYTES`, the page contains all of them. Otherwise it contains, for each
experiment, the smallest and the largest value of each group of ``every`` samples, so that no extreme is lost,
and all samples of a window around the place where the error is largest.

The error of an output is e = y - yhat. All samples are stored as y, e of the declared model and e of the
model with effects; the browser computes yhat = y - e. The extremes of yhat do not follow from those of y and
e. They are stored too.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gpi_hammerstein._native import Explanation, Record
from gpi_hammerstein.io import raise_warmup
from gpi_hammerstein.report.packing import Array, bytes_of, packed

# Bytes of all samples of the page, before they become text, which is 4/3 as long. With the library and the
# pictures, the page has less than 2 MB.
DATA_BYTES = 1_050_000
# Part of these bytes for windows at the full rate, if not all samples fit.
WINDOWS = 0.3
# Shortest window that is stored, in samples.
SHORTEST_WINDOW = 100
# Length of the picture of the largest error: a part of the experiment, and at least so many samples.
DETAIL, SHORTEST_DETAIL = 1 / 40, 300
# Largest step of integers over the rms residual. The rounding error, step / sqrt(12), is then 1/70 of it.
FINE = 0.05
# Probability of the prediction band.
PROBABILITY = 0.95

Range = tuple[int, int]


@dataclass(frozen=True)
class Signal:
    """A signal of every experiment, each of shape (samples,), and the bytes of a sample in the page."""

    values: list[Array]
    size: int


class Errors:
    """The errors of both models, and which of their samples are scored.

    Parameters
    ----------
    found
        The result of `explain`.

    Examples
    --------
    >>> Errors(found).half_band(0)  # doctest: +SKIP
    0.046
    """

    def __init__(self, found: Explanation) -> None:
        self.record: Record = raise_warmup(found.record, found.warmups)
        self.before: list[Array] = found.residuals_before
        self.after: list[Array] = found.residuals_after
        self.held_out: list[list[tuple[int, int]]] = found.held_out
        self.warmups: list[int] = self.record.warmup
        self.names: list[str] = self.record.output_names
        self._wrong: dict[tuple[int, int], list[int]] = {}
        for row in found.wrong_samples:
            place = row["experiment"], self.names.index(row["output"])
            self._wrong.setdefault(place, []).append(row["row"])

    def scored(self, experiment: int, output: int) -> NDArray[np.bool_]:
        """Return which samples are scored: not those of the warm-up, and not those found to be wrong."""
        mask = np.ones(len(self.after[experiment]), dtype=np.bool_)
        mask[: self.warmups[experiment]] = False
        mask[self._wrong.get((experiment, output), [])] = False
        return mask

    def collected(self, output: int) -> tuple[Array, bool]:
        """Return the scored errors after, and whether they are held out: of all experiments if none is."""
        every = range(len(self.after))
        masks = [self.scored(experiment, output) for experiment in every]
        parts = []
        for experiment in every:
            held_out = np.zeros(len(masks[experiment]), dtype=np.bool_)
            for first, last in self.held_out[experiment] if self.held_out else []:
                held_out[first:last] = True
            parts.append(self.after[experiment][masks[experiment] & held_out, output])
        unseen = np.concatenate(parts)
        if len(unseen):
            return unseen, True
        return np.concatenate([self.after[k][masks[k], output] for k in every]), False

    def half_band(self, output: int) -> float:
        r"""Return half the width of the prediction band, in the unit of the output.

        It is the smallest value that at least the part ``PROBABILITY (n + 1) / n`` of the n absolute errors
        does not exceed: a new sample lies within the band with this probability if its error has the
        distribution of these ones, whatever this distribution is (split conformal prediction, Lei et al.,
        2018, J. Am. Stat. Assoc. 113).
        """
        sizes = np.sort(np.abs(self.collected(output)[0]))
        if not len(sizes):
            return 0.0
        return float(sizes[min(math.ceil(PROBABILITY * (len(sizes) + 1)), len(sizes)) - 1])

    def largest(self, experiment: int, output: int) -> Range:
        """Return the range of samples in which the rms error after is largest."""
        mask = self.scored(experiment, output)
        samples = len(mask)
        length = min(samples, max(SHORTEST_DETAIL, round(DETAIL * samples)))
        squares = np.where(mask, self.after[experiment][:, output] ** 2, 0.0)
        sums = np.concatenate([[0.0], np.cumsum(squares)])
        first = int(np.argmax(sums[length:] - sums[:-length])) if samples else 0
        return first, first + length


def signals(errors: Errors) -> dict[str, Signal]:
    """Return the signals of the page by their names, such as ``measured0``."""
    record = errors.record
    u, y, covariates = record.u, record.y, record.covariates
    found: dict[str, Signal] = {}

    def add(name: str, values: list[Array], fine: float) -> None:
        found[name] = Signal(values, max(bytes_of(one, fine) for one in values))

    for index in range(len(record.input_names)):
        add(f"input{index}", [one[:, index] for one in u], math.inf)
    for index in range(len(record.covariate_names)):
        add(f"covariate{index}", [one[:, index] for one in covariates], math.inf)
    for index in range(len(record.output_names)):
        left = errors.collected(index)[0]
        fine = FINE * float(np.sqrt(np.mean(left**2))) if len(left) else math.inf
        add(f"measured{index}", [one[:, index] for one in y], fine)
        add(f"errorBefore{index}", [one[:, index] for one in errors.before], fine)
        add(f"errorAfter{index}", [one[:, index] for one in errors.after], fine)
    return found


def parts(errors: Errors, data_bytes: int = DATA_BYTES) -> list[list[dict[str, Any]]]:
    """Return the samples of each experiment.

    Parameters
    ----------
    errors
        The errors of both models.
    data_bytes
        Bytes for all samples.

    Returns
    -------
    list of list of dict
        For each experiment its parts: ``first``, ``last`` (after the last sample), ``every`` (samples of a
        group; 1 for all samples) and ``signals``. A signal of all samples is the result of `packed`; of
        groups, it is a pair, of the smallest and the largest values.
    """
    own = signals(errors)
    lengths = [len(one) for one in errors.after]
    outputs = range(len(errors.names))
    per_sample = sum(signal.size for signal in own.values())
    if per_sample * sum(lengths) <= data_bytes:
        return [[whole(own, k, (0, samples))] for k, samples in enumerate(lengths)]
    simulated = {
        f"{name}{index}": Signal(
            [
                y - e
                for y, e in zip(own[f"measured{index}"].values, own[f"{error}{index}"].values, strict=True)
            ],
            own[f"measured{index}"].size,
        )
        for index in outputs
        for name, error in (("before", "errorBefore"), ("after", "errorAfter"))
    }
    grouped = own | simulated
    per_group = 2 * sum(signal.size for signal in grouped.values())
    window = int(WINDOWS * data_bytes / (len(lengths) * len(outputs) * per_sample))
    result = []
    for k, samples in enumerate(lengths):
        share = (1 - WINDOWS) * data_bytes * samples / sum(lengths)
        every = max(2, math.ceil(samples * per_group / max(share, per_group)))
        ranges = sorted({around(errors.largest(k, output), window, samples) for output in outputs})
        stored = [extremes(grouped, k, samples, every)]
        result.append(stored + [whole(own, k, one) for one in ranges if window >= SHORTEST_WINDOW])
    return result


def around(inner: Range, length: int, samples: int) -> Range:
    """Return a range of `length` samples in the middle of which `inner` is, as far as the record permits."""
    length = min(length, samples)
    first = min(max((inner[0] + inner[1] - length) // 2, 0), samples - length)
    return first, first + length


def whole(own: Mapping[str, Signal], experiment: int, chosen: Range) -> dict[str, Any]:
    """Return all samples of a range."""
    first, last = chosen
    stored = {
        name: packed(signal.values[experiment][first:last], signal.size) for name, signal in own.items()
    }
    return {"first": first, "last": last, "every": 1, "signals": stored}


def extremes(own: Mapping[str, Signal], experiment: int, samples: int, every: int) -> dict[str, Any]:
    """Return the smallest and the largest value of each group of samples."""
    starts = np.arange(0, samples, every)
    stored: dict[str, Sequence[dict[str, Any]]] = {}
    for name, signal in own.items():
        values = signal.values[experiment]
        ends = (np.minimum.reduceat(values, starts), np.maximum.reduceat(values, starts))
        stored[name] = [packed(end, signal.size) for end in ends]
    return {"first": 0, "last": samples, "every": every, "signals": stored}

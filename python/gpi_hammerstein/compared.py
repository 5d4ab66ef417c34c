"""The simulated beside the measured output of a record, and how well they agree."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gpi_hammerstein._native import Model, Record
from gpi_hammerstein.held_out import rule_in_words

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["Comparison", "compare"]


@dataclass(frozen=True)
class Comparison:
    """The simulated beside the measured output of a record; the result of `Model.compare`.

    Parameters
    ----------
    model
        The model that was simulated, without effects that are functions of the time of another record.
    record
        The record, which contains the measured outputs.
    simulated
        The simulated outputs of each experiment, shape (samples, outputs), in the outputs' units.
    fit_percent
        ``100 (1 - |e| / |y - mean y|)`` of each output by its name, in percent, over all scored samples.
    error
        The error of all outputs together, as `Model.error` returns it: ``rms`` and ``max`` in the output's
        unit, ``nrmse``, ``fit_percent``.
    left_out
        Names of the effects that were left out.
    rule
        How the error was counted, in words.
    fit_start
        Whether unknown initial states were estimated from the record.

    Examples
    --------
    >>> u = gpi.multisine(3000, 1000.0, (0.5, 400.0), (0.0, 10.0))
    >>> y = gpi.PlayBank([0.0, 2.0], [1.0, 0.5])(u)
    >>> train, test = gpi.Record(u[:2000], y[:2000], 1000.0), gpi.Record(u[2000:], y[2000:], 1000.0)
    >>> model = gpi.identify(train, delay=0, half_widths=[0.0, 2.0], thresholds=0)
    >>> model.compare(test).left_out
    ()
    """

    model: Model
    record: Record
    simulated: list[NDArray[np.float64]]
    fit_percent: Mapping[str, float]
    error: Mapping[str, float]
    left_out: tuple[str, ...]
    rule: str
    fit_start: bool

    def __repr__(self) -> str:
        """Return the fit of each output, its error, and the rule."""
        units = dict(zip(self.record.output_names, self.record.output_units, strict=True))
        lines = [f"{name}: fit {fit:.2f} %" for name, fit in self.fit_percent.items()]
        if len(lines) == 1:
            unit = next(iter(units.values()))
            rms, largest = (f"{self.error[name]:.4g} {unit}".rstrip() for name in ("rms", "max"))
            lines[0] += f", error {rms} rms, at most {largest}"
        return "\n".join([*lines, f"({self.rule})"])

    def plot(self, ax: "Axes | None" = None) -> "Axes":
        """Draw the measured and the simulated output over time; see `gpi_hammerstein.plot.fit`.

        Parameters
        ----------
        ax
            Axes to draw on; those of a new figure if None.

        Returns
        -------
        Axes
            The axes.
        """
        from gpi_hammerstein.plot import fit

        return fit(self.model, self.record, ax, fit_start=self.fit_start)


def compare(model: Model, record: Record, *, fit_start: bool = True, remove_mean: bool = False) -> Comparison:
    """Compare a model with a record that took no part in the fit.

    Parameters
    ----------
    model
        A model.
    record
        Measured input and output.
    fit_start, remove_mean
        As in `Model.on_another_record`.

    Returns
    -------
    Comparison
        The result.
    """
    counted = model.on_another_record(record, fit_start=fit_start, remove_mean=remove_mean)
    own = counted["model"]
    simulated = []
    scored: list[tuple[NDArray[np.float64], NDArray[np.float64]]] = []
    for y, residual, warmup in zip(
        record.y, own.residual(record, fit_start=fit_start), record.warmup, strict=True
    ):
        error = residual - residual[warmup:].mean(axis=0) if remove_mean else residual
        simulated.append(y - error)
        scored.append((y[warmup:], error[warmup:]))
    measured, error = (np.concatenate(parts) for parts in zip(*scored, strict=True))
    spread = np.linalg.norm(measured - measured.mean(axis=0), axis=0)
    fit = 100 * (1 - np.linalg.norm(error, axis=0) / np.maximum(spread, np.finfo(np.float64).tiny))
    left_out = tuple(counted["left_out"])
    return Comparison(
        model=own,
        record=record,
        simulated=simulated,
        fit_percent=dict(zip(record.output_names, map(float, fit), strict=True)),
        error=counted["error"],
        left_out=left_out,
        rule=rule_in_words(fit_start=fit_start, remove_mean=remove_mean, left_out=left_out),
        fit_start=fit_start,
    )

"""Pictures of residuals over time, frequency and lag."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from gpi_hammerstein._native import Explanation, Model, Record
from gpi_hammerstein.escaping import in_plot
from gpi_hammerstein.io import raise_warmup
from gpi_hammerstein.plot.explanation import title
from gpi_hammerstein.plot.style import BLACK, BLUE, ORANGE, axes, label
from gpi_hammerstein.uncertain import BAND

Array = NDArray[np.float64]

# A single residual is blue. If there are two, the second one is blue.
COLOURS: dict[int, tuple[str, ...]] = {1: (BLUE,), 2: (ORANGE, BLUE)}


@dataclass(frozen=True)
class Residuals:
    """One or two residuals of a record, for the pictures.

    Parameters
    ----------
    record
        The record.
    series
        The residuals (measured minus simulated output) of each experiment by their name, shape
        (samples, outputs), in the outputs' units.
    held_out
        For each experiment, pairs of the first held-out sample and the first sample after the held-out block.
    noise_rms
        Noise rms of each output, shape (outputs,), in its unit; None if it is not known.
    title
        The title of the pictures.

    Examples
    --------
    >>> u = gpi.multisine(2000, 1000.0, (0.5, 400.0), (0.0, 10.0))
    >>> record = gpi.Record(u, gpi.PlayBank([0.0, 2.0], [1.0, 0.5])(u), 1000.0)
    >>> model = gpi.identify(record, delay=0, half_widths=[0.0, 2.0], thresholds=0)
    >>> ax = gpi.plot.residual_spectrum(gpi.plot.Residuals.of_model(model, record))
    """

    record: Record
    series: Mapping[str, list[Array]]
    held_out: list[list[tuple[int, int]]]
    noise_rms: Array | None
    title: str

    @classmethod
    def of_model(
        cls, model: Model, record: Record, *, fit_start: bool = False, remove_mean: bool = False
    ) -> "Residuals":
        """Return the residual of a model on a record, as in `Model.error`.

        Parameters
        ----------
        model
            The model.
        record
            A record with the sampling rate of the model.
        fit_start, remove_mean
            As in :meth:`gpi_hammerstein.Model.error`.

        Returns
        -------
        Residuals
            One residual, without held-out blocks.

        Raises
        ------
        ParameterError, DataError
            The model does not accept the input of the record.
        """
        left = model.residual(record, fit_start=fit_start)
        if remove_mean:
            left = [e - e[start:].mean(axis=0) for e, start in zip(left, record.warmup, strict=True)]
        return cls(record, {"residual": left}, [[] for _ in left], None, "Residual")

    @classmethod
    def of_explanation(cls, found: Explanation) -> "Residuals":
        """Return the residuals before and after an explanation.

        Parameters
        ----------
        found
            The result of `explain`.

        Returns
        -------
        Residuals
            The two residuals and the noise floor.
        """
        series = {"before": found.residuals_before, "after": found.residuals_after}
        noise = np.asarray(found.noise_floor["rms"], dtype=np.float64)
        record = raise_warmup(found.record, found.warmups)
        return cls(record, series, found.held_out, noise, title(found))

    def of(self, experiment: int, output: int) -> list[tuple[str, str, Array]]:
        """Return the name, the colour and the values of every residual of one output.

        Parameters
        ----------
        experiment, output
            The numbers of the experiment and the output, counted from 0.

        Returns
        -------
        list of tuple
            Name, colour, and values, shape (samples,), in the output's unit.
        """
        colours = COLOURS[len(self.series)]
        return [
            (name, color, values[experiment][:, output])
            for (name, values), color in zip(self.series.items(), colours, strict=True)
        ]

    def limit(self, experiment: int, output: int) -> float:
        """Return the limit of the residual axis. Wrong samples and the warm-up do not change it.

        Parameters
        ----------
        experiment, output
            The numbers of the experiment and the output, counted from 0.

        Returns
        -------
        float
            The largest value to each side of zero, in the output's unit.
        """
        scored = self.of(experiment, output)[0][2][self.record.warmup[experiment] :]
        return 2.5 * float(np.quantile(np.abs(scored), 0.98)) + 1e-300

    def label(self, output: int) -> str:
        """Return the label of the residual axis.

        Parameters
        ----------
        output
            The number of the output, counted from 0.

        Returns
        -------
        str
            The output's name, with its unit in brackets.
        """
        return label(f"residual of {self.record.output_names[output]}", self.record.output_units[output])


def rms(values: Array) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def taken(found: Explanation | Residuals) -> Residuals:
    """Return the residuals of an explanation, or the given residuals."""
    return found if isinstance(found, Residuals) else Residuals.of_explanation(found)


def residual_in_time(
    found: Explanation | Residuals, ax: Axes | None = None, *, experiment: int = 0, output: int = 0
) -> Axes:
    """Draw the residual over time. Held-out samples and samples that are not scored are shaded.

    Parameters
    ----------
    found
        The result of `explain`, or residuals.
    ax
        Axes to draw on.
    experiment, output
        The numbers of the experiment and the output to draw, counted from 0.

    Returns
    -------
    Axes
        The axes.

    Examples
    --------
    >>> u = gpi.multisine(2000, 1000.0, (0.5, 400.0), (0.0, 10.0))
    >>> record = gpi.Record(u, gpi.PlayBank([0.0, 2.0], [1.0, 0.5])(u), 1000.0)
    >>> found = gpi.explain(record, effects=[], delay=0, half_widths=[0.0, 2.0], thresholds=0)
    >>> ax = gpi.plot.residual_in_time(found)
    """
    ax = axes(ax, 9.0, 4.0)
    found = taken(found)
    warmup, rate = found.record.warmup[experiment], found.record.rate
    for name, color, values in found.of(experiment, output):
        t = np.arange(len(values)) / rate
        text = f"{name}: {rms(values[warmup:]):.3g} {in_plot(found.record.output_units[output])} rms"
        ax.plot(t, values, color=color, lw=0.6, label=text)
    for first, last in [(0, warmup)] * (warmup > 0) + found.held_out[experiment]:
        ax.axvspan(first / rate, (last - 1) / rate, color=BLACK, alpha=0.08, lw=0)
    limit = found.limit(experiment, output)
    ax.set_ylim(-limit, limit)
    several = f" in experiment {experiment}" if len(found.record.u) > 1 else ""
    ax.set_xlabel(f"time [s]{several}")
    ax.set_ylabel(found.label(output))
    ax.set_title(found.title + (" (grey: held out)" if found.held_out[experiment] else ""))
    ax.legend(loc="upper right")
    return ax


def residual_spectrum(
    found: Explanation | Residuals, ax: Axes | None = None, *, experiment: int = 0, output: int = 0
) -> Axes:
    """Draw the amplitude spectral density of the residual over frequency.

    Parameters
    ----------
    found
        The result of `explain`, or residuals.
    ax
        Axes to draw on.
    experiment, output
        The numbers of the experiment and the output to draw, counted from 0.

    Returns
    -------
    Axes
        The axes.

    Examples
    --------
    >>> u = gpi.multisine(2000, 1000.0, (0.5, 400.0), (0.0, 10.0))
    >>> record = gpi.Record(u, gpi.PlayBank([0.0, 2.0], [1.0, 0.5])(u), 1000.0)
    >>> found = gpi.explain(record, effects=[], delay=0, half_widths=[0.0, 2.0], thresholds=0)
    >>> ax = gpi.plot.residual_spectrum(found)
    """
    import scipy.signal

    ax = axes(ax)
    found = taken(found)
    record = found.record
    for name, color, values in found.of(experiment, output):
        scored = values[record.warmup[experiment] :]
        segment = min(len(scored), 8192)
        frequency, power = scipy.signal.welch(scored, record.rate, nperseg=segment)
        # the logarithm of a zero residual is not finite
        density = np.sqrt(np.maximum(power[1:], np.finfo(np.float64).tiny))
        ax.loglog(frequency[1:], density, color=color, lw=0.9, label=name)
    if found.noise_rms is not None:
        density = found.noise_rms[output] / np.sqrt(record.rate / 2)
        ax.axhline(density, color=BLACK, lw=0.8, ls=":", label="noise floor (white noise)")
    ax.set_xlabel("frequency [Hz]")
    unit = record.output_units[output]
    ax.set_ylabel(label("residual density", f"{unit}/√Hz" if unit else ""))
    ax.set_title(found.title)
    ax.grid(True, which="both", lw=0.3)
    ax.legend(loc="lower left")
    return ax


def residual_autocorrelation(
    found: Explanation | Residuals,
    ax: Axes | None = None,
    *,
    experiment: int = 0,
    output: int = 0,
    lags: int = 50,
) -> Axes:
    """Draw the autocorrelation of the residual, ``r(k) = sum e(t) e(t-k) / sum e(t)^2``, with 95 % bounds.

    The bounds ``1.96 / sqrt(samples)`` to each side are those of white noise.

    Parameters
    ----------
    found
        The result of `explain`, or residuals.
    ax
        Axes to draw on.
    experiment, output
        The numbers of the experiment and the output to draw, counted from 0.
    lags
        The largest lag, in samples.

    Returns
    -------
    Axes
        The axes.

    Examples
    --------
    >>> u = gpi.multisine(2000, 1000.0, (0.5, 400.0), (0.0, 10.0))
    >>> record = gpi.Record(u, gpi.PlayBank([0.0, 2.0], [1.0, 0.5])(u), 1000.0)
    >>> found = gpi.explain(record, effects=[], delay=0, half_widths=[0.0, 2.0], thresholds=0)
    >>> ax = gpi.plot.residual_autocorrelation(found)
    """
    ax = axes(ax)
    found = taken(found)
    samples = 1
    for name, color, values in found.of(experiment, output):
        scored = values[found.record.warmup[experiment] :]
        centred = scored - scored.mean()
        samples = len(centred)
        power = max(float(centred @ centred), np.finfo(np.float64).tiny)
        places = np.arange(1, min(lags, samples - 1) + 1)
        correlation = [float(centred[k:] @ centred[: samples - k]) / power for k in places]
        ax.plot(places, correlation, ".-", color=color, lw=0.7, ms=4, label=name)
    bound = BAND / np.sqrt(samples)
    ax.axhspan(-bound, bound, color=BLACK, alpha=0.12, lw=0, label="95 % of white noise")
    ax.axhline(0.0, color=BLACK, lw=0.5)
    ax.set_xlabel("lag [samples]")
    ax.set_ylabel(f"autocorrelation of the residual of {in_plot(found.record.output_names[output])} [-]")
    ax.set_title(found.title)
    ax.legend(loc="upper right")
    return ax

"""The quality of a record: rate, ranges, saturation, quantisation, excitation."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from gpi_hammerstein._native import Record

Array = NDArray[np.float64]

# Share of samples at exactly the largest or smallest value, above which a sensor may be saturated.
SATURATED = 0.005
# Share of the power of a signal above the frequency that is reported.
LEFT = 0.01


def facts(record: Record) -> Iterator[tuple[str, str]]:
    """Yield the properties of a record, as pairs of a name and a text.

    Parameters
    ----------
    record
        The record.

    Yields
    ------
    tuple of str
        The name and the text of a property.

    Examples
    --------
    >>> dict(facts(record))["sampling rate"]  # doctest: +SKIP
    '2000 Hz'
    """
    lengths = [len(u) for u in record.u]
    yield "experiments", str(len(lengths))
    yield "samples", f"{sum(lengths)} ({sum(lengths) / record.rate:.4g} s)"
    yield "sampling rate", f"{record.rate:g} Hz"
    if any(record.warmup):
        yield "not scored, at the start", f"{sum(record.warmup)} samples"
    for name, unit, signal in channels(record):
        yield name, signal_facts(np.concatenate(signal), unit)
    for index, name in enumerate(record.input_names):
        yield f"excitation by {name}", excitation([u[:, index] for u in record.u], record.rate)


def channels(record: Record) -> Iterator[tuple[str, str, list[Array]]]:
    """Yield the name, the unit and the experiments of each input and output."""
    inputs = zip(record.input_names, record.input_units, strict=True)
    for index, (name, unit) in enumerate(inputs):
        yield name, unit, [u[:, index] for u in record.u]
    outputs = zip(record.output_names, record.output_units, strict=True)
    for index, (name, unit) in enumerate(outputs):
        yield name, unit, [y[:, index] for y in record.y]


def signal_facts(signal: Array, unit: str) -> str:
    """Return the range, the quantisation and the saturation of a signal as text."""
    low, high = float(signal.min()), float(signal.max())
    words = [f"{low:.4g} to {high:.4g} {unit}".rstrip()]
    levels = np.unique(signal)
    if 1 < len(levels) < 0.2 * len(signal):
        # the usual distance between neighbouring values
        words.append(f"steps of {np.median(np.diff(levels)):.3g} {unit}".rstrip())
    for end, value in (("lowest", low), ("highest", high)):
        share = float(np.mean(signal == value))
        if share > SATURATED and low < high:
            words.append(f"{100 * share:.2g} % of the samples at the {end} value")
    return ", ".join(words)


def excitation(experiments: list[Array], rate: float) -> str:
    """Return the frequency below which nearly all of the power of a signal lies, without its mean."""
    samples = min(len(u) for u in experiments)
    spectra = [np.abs(np.fft.rfft((u - u.mean())[:samples])) ** 2 for u in experiments]
    power = np.sum(spectra, axis=0)
    frequency = np.fft.rfftfreq(samples, 1 / rate)
    total = power.sum()
    if not total > 0:
        return "none: the input is constant"
    place = int(np.searchsorted(np.cumsum(power), (1 - LEFT) * total))
    return f"{100 * (1 - LEFT):.0f} % of the power below {frequency[min(place, len(frequency) - 1)]:.4g} Hz"

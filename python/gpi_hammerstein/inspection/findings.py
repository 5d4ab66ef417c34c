"""What is wrong or remarkable in a record."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gpi_hammerstein._native import DataError, Record, signs
from gpi_hammerstein.inspection.columns import resolution
from gpi_hammerstein.io.columns import parse_header
from gpi_hammerstein.io.vocabulary import score

Array = NDArray[np.float64]

# Levels of an output below which its resolution limits a model. By hand: 0.1 % of the range.
FEW_LEVELS = 1000
# Part of the samples at a limit that is worth a sentence, as in the search for missing effects.
CLIPPED = 0.005
# Samples that a model of hysteresis and dynamics needs at least. By hand.
FEW_SAMPLES = 500
# Squared coherence below which an output seems not to belong to the input: unrelated signals have about 0.03
# in the average over this number of segments, which must have some samples.
UNRELATED, SEGMENTS, SHORTEST = 0.05, 32, 16


def shown(record: Record) -> dict[str, Any]:
    """Return what a record shows without a model; values are None where it is too short.

    Parameters
    ----------
    record
        The record.

    Returns
    -------
    dict
        ``fed_back``, ``clipped`` and ``excitation_order`` of the compiled module.

    Examples
    --------
    >>> shown(gpi.Record([0.0, 1.0], [0.0, 1.0], rate=1.0))["excitation_order"]  # doctest: +SKIP
    """
    try:
        return dict(signs(record))
    except DataError:
        return {
            "fed_back": [False] * len(record.input_names),
            "clipped": [0.0] * len(record.output_names),
            "excitation_order": 1,
        }


def findings(record: Record, found: dict[str, Any]) -> list[str]:
    """Return sentences on what is wrong or remarkable in a record.

    Parameters
    ----------
    record
        The record.
    found
        What :func:`shown` returns.

    Returns
    -------
    list of str
        Sentences; none if nothing is remarkable.

    Examples
    --------
    >>> u = np.sin(0.1 * np.arange(2000))
    >>> record = gpi.Record(u, np.minimum(u, 0.5), rate=100.0)  # doctest: +SKIP
    >>> findings(record, shown(record))[0][:20]  # doctest: +SKIP
    'The output y stands '
    """
    sentences = []
    if record.samples < FEW_SAMPLES:
        sentences.append(
            f"The record has only {record.samples} samples; a model of hysteresis and dynamics needs about "
            f"{FEW_SAMPLES}."
        )
    for index, name in enumerate(record.input_names):
        u = np.concatenate([run[:, index] for run in record.u])
        if np.ptp(u) == 0:
            sentences.append(f"The input {name} is constant, so that nothing can be identified from it.")
        if found["fed_back"][index]:
            sentences.append(
                f"The input {name} depends on past outputs, as under feedback: a model of it is biased. "
                "Record in open loop, or take the reference of the controller as the input."
            )
    for index, name in enumerate(record.output_names):
        y = np.concatenate([run[:, index] for run in record.y])
        sentences += _of_output(name, record.output_units[index], y, found["clipped"][index])
        if len(record.input_names) == 1 and np.ptp(y) > 0:
            u = np.concatenate([run[:, 0] for run in record.u])
            if np.ptp(u) > 0 and (explained := coherence(u, y)) < UNRELATED:
                sentences.append(
                    f"The output {name} hardly follows the input: no linear system explains more than about "
                    f"{100 * explained:.2g} % of its variance. Check that the columns belong together."
                )
    return sentences


def set_points(record: Record) -> list[str]:
    """Return a sentence on each other column whose name is that of a set point.

    Parameters
    ----------
    record
        The record.

    Returns
    -------
    list of str
        Sentences.

    Examples
    --------
    >>> set_points(record)  # doctest: +SKIP
    []
    """
    named = [name for name in record.covariate_names if score(parse_header(name), "input")[0]]
    return [
        f"The column {name} looks like a command or a set point. If a controller computes "
        f"{record.input_names[0]} from it, the input is fed back, and a model of it is biased. If it is "
        "no measured influence, ignore it with --covariate none."
        for name in named
    ]


def _of_output(name: str, unit: str, y: Array, clipped: float) -> Sequence[str]:
    sentences = []
    span = float(np.ptp(y))
    if span == 0:
        return [f"The output {name} is constant, so that nothing can be identified from it."]
    if clipped > CLIPPED:
        sentences.append(
            f"The output {name} is at its largest or smallest value for {100 * clipped:.2g} % of "
            "the samples while the input moves: the sensor saturates there. Reduce the amplitude "
            "or the gain of the sensor."
        )
    step = resolution(y)
    if step is not None and span / step < FEW_LEVELS:
        sentences.append(
            f"The output {name} is quantised in steps of {step:.3g} {unit}".rstrip()
            + f", {round(span / step)} over its range: no model can be more accurate than about "
            f"{step / np.sqrt(12):.2g} {unit}".rstrip()
            + " rms."
        )
    return sentences


def coherence(u: Array, y: Array) -> float:
    """Return the part of an output's power that a linear system of any kind can make of the input.

    It is the squared coherence ``|S_uy|^2 / (S_uu S_yy)`` of averaged spectra (Welch 1967), weighted with the
    power of the output. Unrelated signals have about one over the number of averaged segments.

    Parameters
    ----------
    u, y
        Samples of the input and the output, (samples,).

    Returns
    -------
    float
        A part between 0 and 1; 1 for a record that is too short for segments.

    Examples
    --------
    >>> u = np.random.default_rng(0).standard_normal(4000)
    >>> coherence(u, np.diff(u, prepend=0.0)) > 0.9
    True
    """
    # this import takes as long as the whole package, and only an inspection needs it
    from scipy import signal

    length = len(u) // SEGMENTS
    if length < SHORTEST:
        return 1.0
    own, cross = (signal.csd(x / np.ptp(x), y / np.ptp(y), nperseg=length)[1] for x in (u, y))
    power = np.abs(cross)  # the last one is that of y alone
    drive = signal.welch(u / np.ptp(u), nperseg=length)[1]
    with np.errstate(divide="ignore", invalid="ignore"):
        explained = np.where(drive * power > 0, np.abs(own) ** 2 / drive, 0.0)
    return float(explained.sum() / power.sum())

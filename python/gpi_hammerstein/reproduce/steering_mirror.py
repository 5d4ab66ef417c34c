"""A fast steering mirror: three piezos in, three displacements out, driven at three amplitudes.

Measured at KU Leuven, M. Floren, *fsm-benchmark-data* (CC BY 4.0): random-phase multisines of 8192 samples at
6.4 kHz, two periods, six realisations an amplitude. Its resonances fall with amplitude, which no hysteresis
at the input can do. The published errors are those of the repository's notebooks on its own test
realisations; here the last of the six realisations is held out.
"""

import json
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gpi_hammerstein._native import Explanation, Model, ParameterError, Record, explain
from gpi_hammerstein.reproduce.benchmark_data import fetch, local_folder

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

NAME = "piezo-fsm-cubespec"
ADDRESS = (
    "https://github.com/merijnfloren/fsm-benchmark-data/raw/539a12fef384b086a8562b500498b2fa3899ef70/data/"
)
CHECKSUMS = {
    "u_100mV_train.npy": "a53d6ee47ac1ea784c70e7634ce816467fb61effd8706eaf6b52f68142380a81",
    "y_100mV_train.npy": "06892ff7fc943712898d7ca741205e4d6574bec2a20e69a0052f986c27bd10ad",
    "u_200mV_train.npy": "59356f9b403b839231cf903acf6c99df33e0f4fbc820f4edd44dc169ac38dd3e",
    "y_200mV_train.npy": "b25b16b07fdbc7980bab4e98906ddaf2eaee41be0957c8911a469c3c426479d1",
    "u_300mV_train.npy": "0436437998307e8f8c86f824c1fee4e225f212861878bf58d42b2a5e2ecd0cb5",
    "y_300mV_train.npy": "38acb224027e728d7a3c44a0ce5538fcb74c836be585a1b318a6728c8a6820fb",
}
RATE = 6400.0
MICRO = 1e6
LEVELS = (100, 200, 300)
HELD_OUT = 5
# Samples of the first period before the second one: the modes forget in a tenth of it.
LEAD = 2048
# Modes up to 3 kHz, of three inputs and three outputs.
ORDER = 44
# One model for all amplitudes, relative errors in % at each of them.
PUBLISHED = {
    "published, linear, 28 states": (18.61, 6.61, 16.28),
    "published, neural network in the loop (2x64)": (6.37, 4.84, 4.19),
}


@dataclass(frozen=True)
class Level:
    """Steady state at one amplitude."""

    millivolts: int
    inputs: list[Array]
    """u of each realisation in V, (2 periods, 3)."""
    outputs: list[Array]
    """y in um, (2 periods, 3)."""

    @property
    def period(self) -> int:
        """Samples of one period."""
        return len(self.inputs[0]) // 2


@dataclass(frozen=True)
class Stage:
    """A model for all amplitudes."""

    name: str
    model: Model
    parameters: int
    errors: dict[int, float]
    """Relative error in % at each amplitude in mV, on the realisation that took no part."""


@dataclass(frozen=True)
class SteeringMirror:
    """What was found on the way from the linear model to the last one."""

    levels: list[Level]
    fitted: tuple[int, ...]
    """Amplitudes in mV that took part in the fit."""
    found: Explanation
    stages: list[Stage]
    seconds: float


def steering_mirror(
    folder: Path | None = None,
    *,
    fitted: Sequence[int] = LEVELS,
    order: int = ORDER,
    realisations: int = HELD_OUT,
    progress: Callable[[str, float], object] | None = None,
) -> SteeringMirror:
    """Explain the records of all amplitudes together, and test on a realisation that took no part.

    Parameters
    ----------
    folder
        Where the arrays are; found, or fetched from their public address, when None.
    fitted
        Amplitudes in mV that take part in the fit; all three are tested.
    order
        States of the linear part.
    realisations
        How many of the five take part in the fit.
    progress
        As for `explain`.

    Returns
    -------
    SteeringMirror
        The models before and after every effect, with their errors.

    Raises
    ------
    DataError
        The arrays are not there and cannot be fetched.
    ParameterError
        An amplitude that was not measured.

    Examples
    --------
    >>> steering_mirror().found.effects  # doctest: +SKIP
    ['stiffness']
    """
    unknown = [level for level in fitted if level not in LEVELS]
    if unknown or not fitted:
        raise ParameterError(f"`fitted` = {list(fitted)}: amplitudes in mV out of {list(LEVELS)}")
    if not 1 <= realisations <= HELD_OUT:
        raise ParameterError(f"`realisations` = {realisations}: between 1 and {HELD_OUT}")
    levels = read(folder or local_folder(NAME))
    own = [level for level in levels if level.millivolts in fitted]
    record = Record(
        [u[level.period - LEAD :] for level in own for u in level.inputs[:realisations]],
        [y[level.period - LEAD :] for level in own for y in level.outputs[:realisations]],
        rate=RATE,
        warmup=LEAD,
        input_units=["V"] * 3,
        output_units=["um"] * 3,
    )
    start = time.perf_counter()
    # no hysteresis at the input: what it would take is asked of the residual
    found = explain(record, order=order, half_widths=[0.0], thresholds=0, progress=progress)
    seconds = time.perf_counter() - start
    models = [*found.models[:-1], found.model]
    names = ["linear", *(f"+ {step['effect']}" for step in found.steps[1:])]
    stages = [
        Stage(
            name,
            model,
            parameters(model),
            {level.millivolts: relative_error(model, level) for level in levels},
        )
        for name, model in zip(names, models, strict=True)
    ]
    return SteeringMirror(levels, tuple(fitted), found, stages, seconds)


def read(folder: Path) -> list[Level]:
    """Read the arrays, fetching those that the folder lacks.

    Parameters
    ----------
    folder
        Where they are kept.

    Returns
    -------
    list[Level]
        Six realisations of two periods at each amplitude.

    Examples
    --------
    >>> [level.millivolts for level in read(local_folder(NAME))]  # doctest: +SKIP
    [100, 200, 300]
    """
    files = fetch(ADDRESS, CHECKSUMS, folder)
    levels = []
    for level, u_file, y_file in zip(LEVELS, files[::2], files[1::2], strict=True):
        u, y = np.load(u_file), MICRO * np.load(y_file)
        runs = [
            [np.concatenate([signal[:, :, run, period] for period in (0, 1)]) for run in range(u.shape[2])]
            for signal in (u, y)
        ]
        levels.append(Level(level, *runs))
    return levels


def parameters(model: Model) -> int:
    """Count what is estimated of a model: G in its smallest form, and what its loops see and drive.

    Parameters
    ----------
    model
        With loops around G or without.

    Returns
    -------
    int
        Of G ``n (inputs + outputs) + inputs outputs``, n its order: A has as many free numbers as the choice
        of coordinates takes. Of each loop its drives, what it sees, its half-widths and weights, without
        those that set its scales.

    Examples
    --------
    >>> parameters(model)  # doctest: +SKIP
    273
    """
    outputs, inputs = model.linear.D.shape
    count: int = model.linear.order * (inputs + outputs) + inputs * outputs
    for effect in json.loads(model.to_json()).get("effects", []):
        for around in effect.get("loops", []):
            count += len(around["drives"])
            mixture = around["sees"].get("mixture", {})
            count += len(mixture.get("states", [])) + len(mixture.get("inputs", []))
            stops = around["law"].get("stops")
            count += 2 * len(stops["half_widths"]) - 2 if stops else -1 if mixture else 0
    return count


def simulated(model: Model, u: Array) -> Array:
    """Return the last period of what a model makes of two periods, (samples, outputs)."""
    return np.asarray(model.simulate(u))[len(u) // 2 :]


def relative_error(model: Model, level: Level, run: int = HELD_OUT) -> float:
    """Return the error of a realisation as the benchmark counts it.

    Parameters
    ----------
    model
        Runs free from the inputs alone.
    level
        The amplitude.
    run
        The realisation.

    Returns
    -------
    float
        Root mean square errors over root mean squares, each the mean of three outputs, in %.

    Examples
    --------
    >>> relative_error(model, level)  # doctest: +SKIP
    4.7
    """
    measured = level.outputs[run][level.period :]
    error = measured - simulated(model, level.inputs[run])
    rms = [np.sqrt(np.mean(signal**2, axis=0)).mean() for signal in (error, measured)]
    return float(100 * rms[0] / rms[1])


def frequency_response(level: Level, model: Model | None = None) -> tuple[Array, ComplexArray]:
    """Estimate the response from three realisations, measured or of a model.

    Parameters
    ----------
    level
        The amplitude.
    model
        What is simulated; the measurement itself when None.

    Returns
    -------
    frequencies, response
        In Hz up to 3 kHz, and (lines, outputs, inputs) in um/V: ``Y U^-1`` of the first three realisations,
        whose phases make U orthogonal.

    Examples
    --------
    >>> frequencies, response = frequency_response(level)  # doctest: +SKIP
    """
    lines = slice(1, int(3000 / RATE * level.period))
    inputs, outputs = [], []
    for u, y in zip(level.inputs[:3], level.outputs[:3], strict=True):
        inputs.append(np.fft.rfft(u[level.period :], axis=0)[lines])
        answer = y[level.period :] if model is None else simulated(model, u)
        outputs.append(np.fft.rfft(answer, axis=0)[lines])
    # (lines, channels, realisations)
    drive, answer = np.stack(inputs, axis=-1), np.stack(outputs, axis=-1)
    frequencies = np.asarray(np.fft.rfftfreq(level.period, 1 / RATE)[lines], dtype=np.float64)
    return frequencies, np.asarray(answer @ np.linalg.inv(drive), dtype=np.complex128)

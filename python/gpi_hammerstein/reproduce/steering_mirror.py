"""A fast steering mirror with three piezos and three displacements, driven at three amplitudes.

Measured at KU Leuven, M. Floren, *fsm-benchmark-data* (CC BY 4.0): random-phase multisines of 8192 samples at
6.4 kHz, with two periods and six realisations for each amplitude. The resonance frequencies decrease with the
amplitude. Hysteresis at the input cannot have this effect. The published errors are those of the notebooks in
the repository, on its own test realisations. Here, the last of the six realisations is held out.
"""

import json
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gpi_hammerstein._native import Explanation, Model, ParameterError, Progress, Record, explain
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
# Samples of the first period that are used as warm-up. The transient of the modes takes a tenth of them.
LEAD = 2048
# Order for the modes up to 3 kHz of three inputs and three outputs.
ORDER = 44
# Relative errors in % at each amplitude, of one model for all amplitudes.
PUBLISHED = {
    "published, linear, 28 states": (18.61, 6.61, 16.28),
    "published, neural network in the loop (2x64)": (6.37, 4.84, 4.19),
}


@dataclass(frozen=True)
class Level:
    """The steady state at one amplitude."""

    millivolts: int
    inputs: list[Array]
    """u of each realisation in V, two periods, (samples, 3)."""
    outputs: list[Array]
    """y of each realisation in um, two periods, (samples, 3)."""

    @property
    def period(self) -> int:
        """Number of samples of one period."""
        return len(self.inputs[0]) // 2


@dataclass(frozen=True)
class Stage:
    """One of the models, with its errors at all amplitudes."""

    name: str
    model: Model
    parameters: int
    errors: dict[int, float]
    """Relative error in % at each amplitude in mV, on the held-out realisation."""


@dataclass(frozen=True)
class SteeringMirror:
    """The models, from the linear one to the last one."""

    levels: list[Level]
    fitted: tuple[int, ...]
    """Amplitudes in mV that were used for the fit."""
    found: Explanation
    stages: list[Stage]
    seconds: float


def steering_mirror(
    folder: Path | None = None,
    *,
    fitted: Sequence[int] = LEVELS,
    order: int = ORDER,
    realisations: int = HELD_OUT,
    progress: Callable[[Progress], object] | None = None,
) -> SteeringMirror:
    """Explain the records of all amplitudes together, and test on a held-out realisation.

    Parameters
    ----------
    folder
        The folder of the arrays. None takes the data folder, or downloads the arrays.
    fitted
        Amplitudes in mV that are used for the fit. All three amplitudes are tested.
    order
        Order (number of states) of the linear part.
    realisations
        Number of realisations, of the first five, that are used for the fit.
    progress
        As in `explain`.

    Returns
    -------
    SteeringMirror
        The models before and after each effect, with their errors.

    Raises
    ------
    DataError
        The arrays are not found and cannot be downloaded.
    ParameterError
        An amplitude was not measured.

    Examples
    --------
    >>> steering_mirror().found.effects  # doctest: +SKIP
    ['stiffness']
    """
    unknown = [level for level in fitted if level not in LEVELS]
    if unknown or not fitted:
        raise ParameterError(f"`fitted` = {list(fitted)}: must be amplitudes in mV out of {list(LEVELS)}")
    if not 1 <= realisations <= HELD_OUT:
        raise ParameterError(f"`realisations` = {realisations}: must be between 1 and {HELD_OUT}")
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
    # no hysteresis at the input: the search finds it if it is present
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
    """Read the arrays, and download those that are not in the folder.

    Parameters
    ----------
    folder
        The folder of the arrays.

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
    """Return the number of estimated parameters of a model: of G in minimal form, and of its loops.

    Parameters
    ----------
    model
        A model with or without loops around G.

    Returns
    -------
    int
        G of order n has ``n (inputs + outputs) + inputs outputs`` parameters, because the choice of the state
        coordinates removes as many parameters as A has. The parameters of each loop are its input and output
        vectors, its half-widths and its weights, without those that determine only a scale.

    Examples
    --------
    >>> parameters(model)  # doctest: +SKIP
    273
    """
    outputs, inputs = model.linear.D.shape
    count: int = model.linear.order * (inputs + outputs) + inputs * outputs
    for effect in json.loads(model.to_json()).get("effects", []):
        for around in effect.get("loops", []):
            drives = around["drives"]
            count += len(drives) if isinstance(drives, list) else 1
            mixture = around["sees"].get("mixture", {})
            count += len(mixture.get("states", [])) + len(mixture.get("inputs", []))
            stops = around["law"].get("stops")
            count += 2 * len(stops["half_widths"]) - 2 if stops else -1 if mixture else 0
    return count


def simulated(model: Model, u: Array) -> Array:
    """Return the last period of the simulated output for two periods of the input, (samples, outputs)."""
    return np.asarray(model.simulate(u))[len(u) // 2 :]


def relative_error(model: Model, level: Level, run: int = HELD_OUT) -> float:
    """Return the error of a realisation, as defined by the benchmark.

    Parameters
    ----------
    model
        The model, which is simulated from the inputs alone.
    level
        The amplitude.
    run
        The number of the realisation.

    Returns
    -------
    float
        The rms error over the rms output in %, where each rms is the mean over the three outputs.

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
    """Estimate the frequency response from three realisations, measured or simulated.

    Parameters
    ----------
    level
        The amplitude.
    model
        The model that is simulated; None takes the measured outputs.

    Returns
    -------
    frequencies, response
        Frequencies in Hz up to 3 kHz, and the response in um/V, (lines, outputs, inputs). It is ``Y U^-1`` of
        the first three realisations, whose phases make U orthogonal.

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

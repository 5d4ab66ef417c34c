"""Print the errors on the measured and blind records, next to the reference figures.

The data are searched in GPI_DATA_DIR (a folder with `measured` and `blind`), else in `../shared`.
Run it from the root of the project: `make figures`.
"""

import json
import sys
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "python" / "tests"))

import gpi_hammerstein as gpi  # noqa: E402
from data_folder import DATA  # noqa: E402

PIEZO_SPAN = 49.42  # um, of the full-scale record
RIDGE = 3e-2  # what `identify` uses


def piezo() -> None:
    """Fit on the full-scale sine, and test on the record of varying amplitude with the mean removed."""
    folder = DATA / "measured" / "piezo-p885-dbo"
    train = gpi.read_record(folder / "model_1hz_fullscale.csv")
    test = gpi.read_record(folder / "test_1hz_varying_amplitude.csv", warmup=200)
    print("piezo-p885-dbo, held out, rms in % of the 49.42 um span (target: 0.47)")
    for name, options in [
        ("defaults", {}),
        ("12 plays, 5 deadzones", {"half_widths": 12, "thresholds": 5}),
        ("12 plays, no deadzones", {"half_widths": 12, "thresholds": 0}),
    ]:
        model = gpi.identify(train, **options)
        error = model.error(test, remove_mean=True)["rms"]
        (chosen,) = [entry for entry in model.identification.candidates if entry["chosen"]]
        print(
            f"  {name:24s} {100 * error / PIEZO_SPAN:.3f} %   chosen: delay {chosen['delay']} samples, order "
            f"{chosen['order']}, {chosen['plays']} plays, {chosen['deadzones']} deadzones"
        )
    found = gpi.explain(train)
    error = found.model.error(test, remove_mean=True, fit_start=True)["rms"]
    print(f"  explained: {', '.join(found.effects)}: {100 * error / PIEZO_SPAN:.3f} % (aim: 0.30)")


def relative(error: NDArray[np.float64], measured: NDArray[np.float64]) -> float:
    """Return the relative error in % over the spectral lines up to 3 kHz of one period of 8192 samples."""
    lines = slice(1, 3840)
    power = [np.sum(np.abs(np.fft.rfft(x, axis=0)[lines]) ** 2) for x in (error, measured)]
    return float(100 * np.sqrt(power[0] / power[1]))


def steering_mirror() -> None:
    """Fit FIR, ERA and the refined linear model to realisations 0 to 4; test on the second period of 5."""
    folder = DATA / "measured" / "piezo-fsm-cubespec"
    print("piezo-fsm-cubespec, held-out realisation, relative error in % up to 3 kHz")
    print("  targets: FIR 5.2 / 4.4 / 4.1, ERA of order 40 stable and 9 / 8 / 8")
    print("  targets, refined: order 28 below 8.38 / 7.95 / 5.63, order chosen 5.2 / 4.4 / 4.1")
    for level in (100, 200, 300):
        u = np.load(folder / f"u_{level}mV_train.npy")
        y = np.load(folder / f"y_{level}mV_train.npy")
        inputs = [np.concatenate([u[:, :, i, 0], u[:, :, i, 1]]) for i in range(6)]
        outputs = [np.concatenate([y[:, :, i, 0], y[:, :, i, 1]]) for i in range(6)]

        def score(system: gpi.Fir | gpi.StateSpace, u: NDArray[np.float64], y: NDArray[np.float64]) -> float:
            return relative((y - system.simulate(u))[8192:], y[8192:])

        fir = gpi.fir(inputs[:5], outputs[:5], 400)
        line = f"  {level} mV: FIR 400 taps {score(fir, inputs[5], outputs[5]):.2f}"
        line += f" (condition {fir.condition:.2g}, rank {fir.rank} of 1200)"
        markov = gpi.fir(inputs[:5], outputs[:5], 400, ridge=RIDGE).markov
        for order in (28, 40, None):
            system = gpi.era(markov, order=order)
            chosen = "" if order else " (chosen)"
            line += f"; ERA order {system.order}{chosen} {score(system, inputs[5], outputs[5]):.2f}"
            line += f", largest pole {system.spectral_radius:.4f}"
        print(line)
        train = gpi.Record(inputs[:5], outputs[:5], rate=6400.0, warmup=8192)
        for order in (28, None):
            start = time.perf_counter()
            model = gpi.identify(train, half_widths=[0.0], thresholds=0, order=order)
            error = relative((outputs[5] - model.simulate(inputs[5]))[8192:], outputs[5][8192:])
            print(
                f"    refined, order {model.linear.order}{'' if order else ' (chosen)'}: {error:.2f}"
                f", {model.refinement.status}, {time.perf_counter() - start:.0f} s"
            )


def blind() -> None:
    """Print the held-out error of `identify` on records without effects, next to the noise."""
    folder = DATA / "blind" / "dev"
    labels = json.loads((folder / "labels.json").read_text())
    print("blind/dev without an undeclared effect, held out on another experiment")
    for name in ("record-00", "record-14", "record-17"):
        train = gpi.read_record(folder / f"{name}.csv.gz")
        test = gpi.read_record(folder / f"{name}.again.csv.gz")
        start = time.perf_counter()
        model = gpi.identify(train)
        seconds = time.perf_counter() - start
        # Some records have an unknown initial state: it is fitted to the record, the model is not.
        error = model.error(test, fit_start=True)
        noise = labels[name]["noise_std_um"]
        span = error["rms"] / error["nrmse"]
        print(
            f"  {name}: held-out nrmse {100 * error['nrmse']:.4f} %, noise floor {100 * noise / span:.4f} %,"
            f" ratio {error['rms'] / noise:.3f}, order {model.linear.order}, {seconds:.1f} s"
        )


if __name__ == "__main__":
    if not (DATA / "measured").is_dir():
        raise SystemExit(f"no measured data in {DATA}: set GPI_DATA_DIR")
    piezo()
    steering_mirror()
    blind()

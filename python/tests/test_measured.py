"""Real actuators: records that others measured and published."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import gpi_hammerstein as gpi
from data_folder import DEV, MEASURED, needs_measured
from gpi_hammerstein.cli import run

Array = NDArray[np.float64]

pytestmark = needs_measured


def call(capsys: pytest.CaptureFixture[str], *arguments: object) -> dict[str, Any]:
    capsys.readouterr()
    code = run([*map(str, arguments), "--json"])
    printed = capsys.readouterr()
    assert code == 0, printed.err
    result = json.loads(printed.out)
    assert isinstance(result, dict)
    return result


def show(capsys: pytest.CaptureFixture[str], text: str) -> None:
    with capsys.disabled():
        print(f"\n    {text}")


def test_piezo_stack_on_another_experiment(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = MEASURED / "piezo-p885-dbo"
    found = call(capsys, "identify", folder / "model_1hz_fullscale.csv", "-o", tmp_path / "p885")
    # One sine excites gain and delay, not 30 taps; the result has to say so.
    assert found["excited"] <= 4 and found["notes"]
    test = folder / "test_1hz_varying_amplitude.csv"
    model = tmp_path / "p885" / "model.json"
    error = call(capsys, "simulate", model, test, "--remove-mean", "--skip", "1")["error"]
    show(capsys, f"piezo-p885-dbo, held out: {100 * error['nrmse']:.3f} % of the span")
    assert error["nrmse"] < 0.008


@pytest.mark.slow
def test_a_friction_damper_gets_stops(capsys: pytest.CaptureFixture[str]) -> None:
    # the dynamics of the best plays are no start for stops on this record
    path = MEASURED / "friction-damper" / "0.5Hz_30lb.csv.gz"
    record = gpi.read_record(path, input="displacement_in", output="force_kip", covariate=[])
    training, last = record.split(0.7)
    model = gpi.identify(training)
    held_out = model.error(last, fit_start=True)["rms"]
    show(capsys, f"friction damper, last 30 %: {held_out:.3f} kip")
    assert min(model.hysteresis[0].plays.weights) < 0 and held_out < 0.3


@pytest.mark.slow
def test_a_short_record_of_slow_tanks_gets_a_simple_model(capsys: pytest.CaptureFixture[str]) -> None:
    record = MEASURED / "cascaded-tanks" / "estimation.csv.gz"
    found = call(capsys, "identify", record)
    held_out, rival = found["error"]["holdout"]["rms"], min(row["holdout_rms"] for row in found["rivals"])
    show(capsys, f"cascaded-tanks, held out: {held_out:.2f} V, best rival {rival:.2f} V")
    assert held_out < rival
    # the lags of the tanks are no creep
    found = call(capsys, "explain", record)
    assert not found["effects"] and "saturates" in found["verdict_reason"]
    assert found["error"]["after"]["holdout"]["rms"] < 0.5


def test_one_sine_does_not_excite_31_taps(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    record = MEASURED / "piezo-p885-dbo" / "model_1hz_fullscale.csv"
    assert run(["identify", str(record), "--taps", "31", "-o", str(tmp_path / "out")]) == 3
    assert "31 taps" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def relative_error(
    system: gpi.Fir | gpi.StateSpace, u: Array, y: Array, rate: float, highest: float
) -> float:
    """Error over the last half of a periodic record, lines up to `highest` Hz, in percent."""
    period = len(u) // 2
    simulated = np.asarray(system.simulate(u))[period:]
    lines = np.fft.rfftfreq(period, 1 / rate)
    kept = (lines > 0) & (lines <= highest)
    spectrum, error = (np.fft.rfft(signal, axis=0)[kept] for signal in (y[period:], y[period:] - simulated))
    return float(100 * np.linalg.norm(error) / np.linalg.norm(spectrum))


@pytest.mark.parametrize(
    ("level", "fir_limit", "era_limit"), [(100, 5.2, 9.0), (200, 4.4, 8.0), (300, 4.1, 8.0)]
)
def test_steering_mirror_on_another_realisation(
    level: int, fir_limit: float, era_limit: float, capsys: pytest.CaptureFixture[str]
) -> None:
    path = MEASURED / "piezo-fsm-cubespec" / f"u_{level}mV_train.npy"
    record = gpi.read_record(path, output=f"y_{level}mV_train.npy", rate=6400.0)
    assert len(record.u) == 6 and record.warmup == [8192] * 6
    fir = gpi.fir(record.u[:5], record.y[:5], 400, ridge=1e-3)
    errors = {"FIR of 400 taps": relative_error(fir, record.u[5], record.y[5], record.rate, 3000.0)}
    for order in (28, 40):
        system = gpi.era(fir.markov, order=order)
        assert system.spectral_radius < 1
        errors[f"order {order}"] = relative_error(system, record.u[5], record.y[5], record.rate, 3000.0)
    show(capsys, f"{level} mV: " + ", ".join(f"{name} {value:.2f} %" for name, value in errors.items()))
    assert errors["FIR of 400 taps"] < fir_limit
    assert errors["order 40"] < era_limit


@pytest.mark.parametrize(
    ("file", "words"),
    [
        ("cavatappi-muscle/creep_step_400g_300s.csv", ("not uniform", "row")),
        ("cavatappi-muscle/cycles_sample3_400g.csv", ("gap", "row")),
        ("cavatappi-muscle/lifetime_first_490_cycles.csv", ("do not increase", "row")),
        ("tendon-sheath-backlash/conf0_50.csv", ("not uniform", "row")),
        ("tendon-sheath-backlash/conf90_60.csv", ("not uniform", "row")),
    ],
)
def test_unusable_time_stamps_are_located_and_resampling_is_offered(
    file: str, words: tuple[str, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["identify", str(MEASURED / file), "-o", str(tmp_path / "out")]) == 3
    message = capsys.readouterr().err
    for word in (*words, "--resample"):
        assert word in message
    assert not (tmp_path / "out").exists()
    record = gpi.read_record(MEASURED / file, resample=True, covariate=[])
    assert record.rate in (10.0, 1000.0, 2000.0)
    table = np.genfromtxt(MEASURED / file, delimiter=",", skip_header=1)
    assert record.samples > 0.9 * len(table)


def test_throttle_is_read_the_same_from_both_files() -> None:
    folder = MEASURED / "throttle-valve"
    mat = gpi.read_record(folder / "Throttle1.mat", rate=100.0)
    csv = gpi.read_record(folder / "throttle1.csv")
    assert csv.rate == mat.rate == 100.0
    np.testing.assert_allclose(csv.u[0], mat.u[0], rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(csv.y[0], mat.y[0], rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize(
    "number", [0, *(pytest.param(number, marks=pytest.mark.slow) for number in (14, 17))]
)
def test_records_without_undeclared_effect_come_near_their_noise(
    number: int, capsys: pytest.CaptureFixture[str]
) -> None:
    name = f"record-{number:02d}"
    noise = json.loads((DEV / "labels.json").read_text())[name]["noise_std_um"]
    again = DEV / f"{name}.again.csv.gz"
    record = DEV / f"{name}.csv.gz"
    error = call(capsys, "identify", record, "--holdout-record", again, "--fit-start")["error"]["holdout"]
    floor = noise * error["nrmse"] / error["rms"]
    show(
        capsys,
        f"{name}, held out: nrmse {100 * error['nrmse']:.4f} %, noise floor {100 * floor:.4f} % "
        f"({error['rms'] / noise:.2f} times)",
    )
    assert error["rms"] < 1.05 * noise

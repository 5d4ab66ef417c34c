"""Public benchmarks: how their files are read and scored, and what is said of them."""

import gzip
import hashlib
import json
from pathlib import Path

import numpy as np
import pytest
import scipy.integrate
import scipy.io

import gpi_hammerstein as gpi
from data_folder import needs_measured
from gpi_hammerstein.cli import run
from gpi_hammerstein.reproduce import bouc_wen, catalogue
from gpi_hammerstein.reproduce.public import TRAINING


def test_the_equations_are_those_that_are_published() -> None:
    """Against an integrator with an adaptive step."""

    def u(times: np.ndarray) -> np.ndarray:
        return 40 * np.sin(2 * np.pi * 30 * times)

    def slopes(t: float, state: np.ndarray) -> list[float]:
        y, speed, z = state
        bent = 1e3 * (0.8 * abs(speed) * z - 1.1 * speed * abs(z))
        return [speed, (float(u(np.array(t))) - 10 * speed - 5e4 * y - z) / 2, 5e4 * speed - bent]

    times = np.arange(75) / 750
    expected = scipy.integrate.solve_ivp(
        slopes, (0, times[-1]), [0, 0, 0], t_eval=times, rtol=1e-10, atol=1e-12
    ).y[0]
    np.testing.assert_allclose(bouc_wen.motion(u, 75), expected, atol=1e-5 * np.abs(expected).max())


def test_the_tests_without_noise_have_the_published_drives() -> None:
    record = bouc_wen.multisine(3)
    u = np.ravel(record.u[0])
    assert (record.samples, record.warmup) == (2 * 8192, [8192])
    np.testing.assert_allclose(u[:8192], u[8192:], atol=1e-9)
    assert u.std() == pytest.approx(50, rel=1e-6)
    power = np.abs(np.fft.rfft(u[:8192])) ** 2
    frequencies = np.fft.rfftfreq(8192, 1 / 750)
    outside = (frequencies < 5) | (frequencies > 150)
    assert power[outside].sum() < 1e-12 * power.sum()
    # the second period repeats once the transient has decayed
    y = np.ravel(record.y[0])
    assert np.abs(y[:8192] - y[8192:])[4096:].max() < 1e-3 * y.std()


def test_the_public_file_is_split_as_published(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    samples = np.arange(131072.0)
    scipy.io.savemat(tmp_path / "SNLS80mV.mat", {"V1": samples[None], "V2": -samples[None]})
    digest = hashlib.sha256((tmp_path / "SNLS80mV.mat").read_bytes()).hexdigest()
    monkeypatch.setitem(catalogue.PUBLIC, "SNLS80mV.mat", ("https://example.org/", digest))
    parts = catalogue.silverbox(tmp_path)
    ends = {name: (one.u[0][0].item(), one.u[0][-1].item()) for name, one in parts.items()}
    assert list(parts)[0] == TRAINING
    assert ends == {
        TRAINING: (40550.0, 58049.0),
        "validation": (118700.0, 127399.0),
        "arrow": (0.0, 40574.0),
    }
    assert parts["arrow"].rate == pytest.approx(610.3515625)


def test_another_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "dataBenchmark.csv").write_text("uEst,yEst\n1,2\n")
    with pytest.raises(gpi.DataError, match=r"dataBenchmark.csv: not the published file"):
        catalogue.tanks(tmp_path)


def test_the_command_prints_and_writes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """On a made-up record with the columns of the tanks: a lag with a square root."""
    random = np.random.default_rng(1)
    u = np.repeat(random.uniform(1, 5, 40), 15)
    level, y = 2.0, []
    for drive in u:
        y.append(level + random.normal(0, 0.01))
        level += 0.1 * (drive - 2 * np.sqrt(level))
    folder, out = tmp_path / "data", tmp_path / "out"
    folder.mkdir()
    with gzip.open(folder / "estimation.csv.gz", "wt") as file:
        file.write("t_s,u_V,y_V\n")
        file.writelines(f"{4 * k},{a},{b}\n" for k, (a, b) in enumerate(zip(u, y, strict=True)))
    options = ["reproduce", "cascaded-tanks", "--data", str(folder)]
    assert run([*options, "-o", str(out), "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert (result["example"], result["unit"], list(result["errors"])) == ("cascaded-tanks", "V", [TRAINING])
    assert result["errors"][TRAINING]["after"] == result["explanation"]["error"]["after"]["holdout"]["rms"]
    assert result["files"] == ["cascaded-tanks.json", "errors.png", "model.json"]
    assert sorted(file.name for file in out.iterdir()) == result["files"]
    assert (out / "errors.png").stat().st_size > 5000
    assert run(options) == 0
    assert "polynomial NARX" in capsys.readouterr().out


@needs_measured
@pytest.mark.slow
def test_the_hysteretic_force_of_the_benchmark_beats_what_is_published(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert run(["reproduce", "bouc-wen", "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["explanation"]["effects"] == ["hysteretic-stiffness"]
    assert result["false_names"] == []
    published = min(errors["multisine"] for errors in result["published"].values())
    assert result["errors"]["multisine"]["after"] < 0.1 * published
    assert result["errors"]["sweep"]["after"] < 0.5
    *_, step = result["explanation"]["steps"]
    found = {name: own["value"] for name, own in step["parameters"].items()}
    assert found["beta[0]"] == pytest.approx(0.8, rel=0.01)
    assert found["gamma[0]"] == pytest.approx(-1.1, rel=0.01)
    assert found["hysteretic_over_linear[0]"] == pytest.approx(1.0, rel=0.01)


@pytest.mark.slow
@needs_measured
def test_the_spring_and_the_damping_of_the_benchmark_are_those_of_the_literature(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert run(["reproduce", "silverbox", "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    found = result["explanation"]
    assert set(found["effects"]) == {"stiffness"} and result["false_names"] == []
    assert result["errors"]["training"]["after"] < 0.24 and result["errors"]["validation"]["after"] < 0.25
    sizes = {name: own["value"] for step in found["steps"] for name, own in step["parameters"].items()}
    assert sizes["k3_over_k1"] == pytest.approx(4.0, rel=0.02)
    # 5 % less damping of slow motion
    assert -0.07 < sizes["nonlinear_over_linear_damping"] < -0.04
    assert any("in 2 steps from one sample to the next" in note for note in found["notes"])

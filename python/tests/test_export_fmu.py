"""Exported FMUs, driven by FMPy, against the library, sample by sample."""

import shutil
import subprocess
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.fmi3 import FMU3Slave
from fmpy.validation import validate_fmu
from lxml import etree

import gpi_hammerstein as gpi
from exported_models import CASES, Case, changed, with_effects
from gpi_hammerstein import cli
from gpi_hammerstein.export import compiled
from test_export_model import NEAR, farthest, read

pytestmark = pytest.mark.skipif(shutil.which("cc") is None, reason="NO C COMPILER: FMUs are not built")


class Stepped:
    """An instance of an FMU, one sample after the other."""

    def __init__(self, file: Path, folder: Path, start: list[float]) -> None:
        self.description = fmpy.read_model_description(str(file))
        fmpy.extract(str(file), str(folder))
        self.said: list[str] = []
        self.fmu = FMU3Slave(
            guid=self.description.guid,
            unzipDirectory=str(folder),
            modelIdentifier=self.description.coSimulation.modelIdentifier,
        )
        self.fmu.instantiate(loggingOn=True, logMessage=lambda *words: self.said.append(words[-1].decode()))
        variables = self.description.modelVariables
        self.inputs = [own.valueReference for own in variables if own.causality == "input"]
        self.outputs = [own.valueReference for own in variables if own.causality == "output"]
        self.step = float(self.description.coSimulation.fixedInternalStepSize)
        self.count = 0
        self.fmu.enterInitializationMode()
        self.fmu.setFloat64(self.inputs, start)
        self.first = self.fmu.getFloat64(self.outputs)
        self.fmu.exitInitializationMode()

    def __call__(self, values: list[float], samples: int = 1) -> list[float]:
        self.fmu.setFloat64(self.inputs, values)
        self.fmu.doStep(self.count * self.step, samples * self.step)
        self.count += samples
        return list(self.fmu.getFloat64(self.outputs))

    def close(self) -> None:
        self.fmu.terminate()
        self.fmu.freeInstance()


def rows(case: Case) -> list[list[float]]:
    reads = case.covariates is not None
    columns = [np.reshape(case.u, (len(case.u), -1)), *([read(case)] if reads else [])]
    return np.concatenate(columns, axis=1).tolist()


@pytest.mark.parametrize("name", CASES)
def test_the_model_is_the_library(tmp_path, name):
    case = CASES[name]()
    gpi.export_fmu(case.model, tmp_path / "model.fmu")
    assert validate_fmu(str(tmp_path / "model.fmu")) == []
    wanted = rows(case)
    own = Stepped(tmp_path / "model.fmu", tmp_path / "unpacked", wanted[0])
    y = np.array([own(row) for row in wanted])
    own.close()
    assert farthest(y, case.expected) < NEAR
    np.testing.assert_allclose(own.first, case.expected[0], rtol=1e-12)
    assert own.said == []


def test_the_compensator_is_the_library(tmp_path, capsys):
    model = with_effects("creep")
    model.save(tmp_path / "model.json")
    file = tmp_path / "compensator.fmu"
    asked = ["--what", "compensator", "--fmu", str(file), "--limits=-1.5,1.2"]
    assert cli.run(["export", str(tmp_path / "model.json"), *asked]) == 0
    assert "Compensated: hysteresis, creep." in capsys.readouterr().out
    assert validate_fmu(str(file)) == []
    reference = 0.7 + 4.0 * np.sin(0.05 * np.arange(1500)) * np.linspace(0, 1, 1500)
    own = Stepped(file, tmp_path / "unpacked", [reference[0]])
    drive = np.array([own([value]) for value in reference])[:, 0]
    own.close()
    compensator = model.compensator(limits=(-1.5, 1.2))
    expected, _ = compensator.run(reference, compensator.standing_at(reference[0]))
    assert np.max(np.abs(drive - expected)) < NEAR * np.max(np.abs(expected))
    assert np.max(drive) == 1.2
    assert [own.description.modelVariables[i].name for i in (1, 2)] == ["y_reference", "u"]


def test_a_simulator_of_others_runs_it(tmp_path):
    """FMPy's own loop, whose outputs come one step after their inputs."""
    case = CASES["every-effect"]()
    gpi.export_fmu(case.model, tmp_path / "model.fmu")
    t = np.arange(len(case.u)) / case.model.rate
    inputs = np.rec.fromarrays([t, *np.transpose(rows(case))], names=["time", "u", "temperature"])
    result = fmpy.simulate_fmu(
        str(tmp_path / "model.fmu"), stop_time=t[-1] + 1e-3, output_interval=1e-3, input=inputs, output=["y"]
    )
    assert farthest(result["y"][1:, None], case.expected) < NEAR


def test_a_state_is_saved_and_others_are_told_apart(tmp_path):
    case = CASES["every-effect"]()
    gpi.export_fmu(case.model, tmp_path / "model.fmu")
    wanted = rows(case)[:60]
    own = Stepped(tmp_path / "model.fmu", tmp_path / "unpacked", wanted[0])
    for row in wanted[:30]:
        own(row)
    saved = own.fmu.getFMUState()
    kept = own.fmu.serializeFMUState(saved)
    once = [own(row) for row in wanted[30:]]
    own.fmu.setFMUState(own.fmu.deserializeFMUState(kept))
    assert [own(row) for row in wanted[30:]] == once
    # several samples at once, with the same input
    own.fmu.setFMUState(saved)
    last = own(wanted[30], 3)
    own.fmu.setFMUState(saved)
    assert [own(wanted[30]) for _ in range(3)][-1] == last
    own.close()


def test_wrong_steps_and_inputs_are_told(tmp_path):
    model = with_effects("creep")
    gpi.export_fmu(model, tmp_path / "model.fmu")
    own = Stepped(tmp_path / "model.fmu", tmp_path / "unpacked", [0.0])
    with pytest.raises(FMICallException):
        own.fmu.doStep(0.0, 1.5e-3)
    assert "the step of 0.0015 s is not a multiple of the sampling interval of 0.001 s" in own.said[-1]
    before = own([1.0])
    own([np.nan])
    assert "an input was not finite" in own.said[-1]
    assert np.isfinite(own([1.0])).all() and np.isfinite(before).all()
    with pytest.raises(FMICallException):
        own.fmu.setFloat64(own.outputs, [1.0])
    assert "is no input" in own.said[-1]
    own.close()
    unstable = changed(
        model, linear={"a": [[1e9], 1, 1], "b": [[1.0], 1, 1], "c": [[1.0], 1, 1], "d": [[0.0], 1, 1]}
    )
    gpi.export_fmu(unstable, tmp_path / "unstable.fmu")
    own = Stepped(tmp_path / "unstable.fmu", tmp_path / "other", [0.0])
    with pytest.raises(FMICallException):
        for _ in range(60):
            own([1.0])
    assert "the model diverges" in own.said[-1]
    own.close()


def test_the_archive_has_sources_that_others_can_compile(tmp_path):
    file = tmp_path / "model.fmu"
    gpi.export_fmu(with_effects("creep", "backlash"), file)
    again = tmp_path / "again.fmu"
    gpi.export_fmu(with_effects("creep", "backlash"), again)
    with zipfile.ZipFile(file) as archive:
        archive.extractall(tmp_path / "unpacked")
        names = archive.namelist()
        same = [
            archive.read(name) for name in names if "binaries" not in name and name.endswith((".c", ".h"))
        ]
    with zipfile.ZipFile(again) as archive:
        assert [archive.read(name) for name in archive.namelist() if name.endswith((".c", ".h"))] == same
    tuple_, ending = compiled.platform_tuple()
    assert f"binaries/{tuple_}/gpi_model{ending}" in names
    build = etree.parse(tmp_path / "unpacked" / "sources" / "buildDescription.xml")
    schemas = Path(fmpy.__file__).parent / "schema" / "fmi3"
    etree.XMLSchema(etree.parse(schemas / "fmi3BuildDescription.xsd")).assertValid(build)
    sources = [tmp_path / "unpacked" / "sources" / own.get("name") for own in build.iter("SourceFile")]
    flags = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-shared", "-fPIC"]
    subprocess.run(["cc", *flags, "-o", tmp_path / "own.so", *sources], check=True)


def test_without_a_compiler_it_says_what_to_do(tmp_path, monkeypatch, capsys):
    with_effects("creep").save(tmp_path / "model.json")
    asked = ["export", str(tmp_path / "model.json"), "--fmu", str(tmp_path / "model.fmu")]
    monkeypatch.setenv("CC", "no-such-compiler -m64")
    assert cli.run(asked) == 2
    assert "the C compiler of the variable CC, no-such-compiler -m64, was not found" in said(capsys)
    monkeypatch.setenv("CC", "false")
    assert cli.run(asked) == 2
    assert "the C compiler `false` failed with 1" in said(capsys)
    monkeypatch.delenv("CC")
    monkeypatch.setattr(compiled.shutil, "which", lambda _: None)
    assert cli.run(asked) == 2
    assert "no C compiler was found (cc, gcc, clang). Install one" in said(capsys)
    assert [file.name for file in tmp_path.iterdir()] == ["model.json"]


def said(capsys) -> str:
    return " ".join(capsys.readouterr().err.split())


def test_names_that_are_equal_are_told_apart(tmp_path):
    model = changed(
        with_effects("covariate"),
        inputs=[{"name": "<time>&", "unit": "V"}],
        outputs=[{"name": "temperature", "unit": "µm"}],
    )
    gpi.export_fmu(model, tmp_path / "model.fmu")
    assert validate_fmu(str(tmp_path / "model.fmu")) == []
    found = fmpy.read_model_description(str(tmp_path / "model.fmu")).modelVariables
    assert [own.name for own in found] == ["time", "<time>&", "temperature", "temperature (output)"]
    assert [own.unit for own in found] == [None, "V", None, "µm"]

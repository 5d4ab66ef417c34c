"""Exported forward models, compiled and run, against `Model.simulate`, sample by sample."""

import ctypes
import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import gpi_hammerstein as gpi
from exported_models import CASES, EFFECTS, Array, Case, changed, random_case, with_effects
from gpi_hammerstein import cli
from gpi_hammerstein.export import effects
from test_effects import with_effect
from test_injection import HONEST

#: Of the largest output. The sums are added in another order than in the library.
NEAR = 1e-9
needs_c = pytest.mark.skipif(shutil.which("cc") is None, reason="NO C COMPILER: exported C is not compiled")
needs_rust = pytest.mark.skipif(
    shutil.which("rustc") is None, reason="NO RUSTC: exported Rust is not compiled"
)
RUN_C = """
#include "{name}.c"
#include <stdlib.h>
unsigned run(const real *u, const real *x, real *y, long samples)
{{
    {name}_state *state = malloc(sizeof *state);
    unsigned faults;
    long k;
    {name}_start(state, u);
    for (k = 0; k < samples; ++k)
        {name}_step(state, u + k * INPUTS, {covariates}y + k * OUTPUTS);
    faults = state->faults;
    free(state);
    (void)x;
    return faults;
}}
"""
RUN_RUST = """
mod model;
use model::{Model, Real};
use std::io::Read;

fn main() {
    let mut text = String::new();
    std::io::stdin().read_to_string(&mut text).unwrap();
    let values: Vec<Real> = text.split_whitespace().map(|word| word.parse().unwrap()).collect();
    let rows: Vec<&[Real]> = values.chunks_exact(model::INPUTS + COLUMNS).collect();
    let mut own = Model::standing_at(rows[0][..model::INPUTS].try_into().unwrap());
    for row in rows {
        let input = row[..model::INPUTS].try_into().unwrap();
        for value in own.step(inputCOVARIATES) {
            println!("{value:e}");
        }
    }
}
"""


def in_c(folder: Path, case: Case, precision: str = "double") -> tuple[Array, int]:
    gpi.export_model_c(case.model, folder, precision=precision, name="axis")
    reads = "AXIS_COVARIATES" in (folder / "axis.h").read_text()
    covariates = "x + k * AXIS_COVARIATES, " if reads else ""
    (folder / "all.c").write_text(RUN_C.format(name="axis", covariates=covariates))
    flags = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", "-pedantic"]
    subprocess.run(["cc", *flags, "-shared", "-fPIC", "-o", folder / "all.so", folder / "all.c"], check=True)
    number = np.float64 if precision == "double" else np.float32
    run = ctypes.CDLL(str(folder / "all.so")).run
    samples, outputs = len(case.u), len(case.model.output_names)
    y = np.zeros((samples, outputs), dtype=number)
    u, x = (np.ascontiguousarray(values, dtype=number) for values in (case.u, read(case)))
    pointers = [values.ctypes.data_as(ctypes.c_void_p) for values in (u, x, y)]
    faults = run(*pointers, ctypes.c_long(samples))
    return y.astype(np.float64), faults


def read(case: Case) -> Array:
    """The columns of the covariates that the model reads, in their order."""
    columns = sorted({effect["column"] for effect in effects_of(case.model) if "column" in effect})
    return case.covariates[:, columns] if columns and case.covariates is not None else np.zeros((1, 1))


def effects_of(model: gpi.Model) -> list[dict[str, object]]:
    return json.loads(model.to_json()).get("effects", [])


def in_rust(folder: Path, case: Case) -> Array:
    gpi.export_model_rust(case.model, folder / "model.rs", precision="double")
    reads = "COVARIATES" in (folder / "model.rs").read_text()
    text = RUN_RUST.replace("COLUMNS", "model::COVARIATES" if reads else "0")
    covariates = ", row[model::INPUTS..].try_into().unwrap()" if reads else ""
    (folder / "main.rs").write_text(text.replace("inputCOVARIATES", f"input{covariates}"))
    flags = ["--edition", "2024", "-D", "warnings", "-O"]
    subprocess.run(["rustc", *flags, "-o", folder / "main", folder / "main.rs"], check=True)
    columns = [np.reshape(case.u, (len(case.u), -1)), *([read(case)] if reads else [])]
    words = " ".join(repr(float(value)) for value in np.concatenate(columns, axis=1).ravel())
    run = subprocess.run([folder / "main"], input=words, capture_output=True, text=True, check=True)
    y = np.array([float(word) for word in run.stdout.split()])
    return y.reshape(len(case.u), -1)


def farthest(y: Array, expected: Array) -> float:
    return float(np.max(np.abs(y - expected)) / np.max(np.abs(expected)))


@needs_c
@pytest.mark.parametrize("name", CASES)
def test_c_is_the_library(tmp_path, name):
    case = CASES[name]()
    y, faults = in_c(tmp_path, case)
    assert farthest(y, case.expected) < NEAR
    assert faults == 0


@needs_c
@pytest.mark.slow
@pytest.mark.parametrize("seed", range(40))
def test_c_is_the_library_for_random_models(tmp_path, seed):
    case = random_case(seed)
    assert farthest(in_c(tmp_path, case)[0], case.expected) < NEAR


@needs_rust
@pytest.mark.parametrize("name", CASES)
def test_rust_is_the_library(tmp_path, name):
    case = CASES[name]()
    assert farthest(in_rust(tmp_path, case), case.expected) < NEAR


@needs_rust
@pytest.mark.slow
@pytest.mark.parametrize("seed", range(40, 60))
def test_rust_is_the_library_for_random_models(tmp_path, seed):
    case = random_case(seed)
    assert farthest(in_rust(tmp_path, case), case.expected) < NEAR


@needs_rust
def test_rust_builds_without_std_in_single_precision(tmp_path):
    gpi.export_model_rust(CASES["every-effect"]().model, tmp_path / "model.rs")
    (tmp_path / "lib.rs").write_text("#![no_std]\npub mod model;\n")
    build = ["rustc", "--edition", "2024", "-D", "warnings", "--crate-type", "lib", "--out-dir", tmp_path]
    subprocess.run([*build, tmp_path / "lib.rs"], check=True)


@needs_c
def test_single_precision_is_near(tmp_path):
    """Also for slow lags and a line after many periods, whose rounding errors would add up."""
    model = with_effects("creep", "periodic-disturbance", "covariate")
    u = np.tile(CASES["every-effect"]().u, 40)
    covariates = np.ones((len(u), 2))
    case = Case(model, u, covariates)
    y, _ = in_c(tmp_path, case, precision="single")
    assert 1e-8 < farthest(y, case.expected) < 1e-5


@needs_c
def test_a_value_that_is_missing_is_the_last_one(tmp_path):
    case = CASES["every-effect"]()
    held, bad = case.u.copy(), case.u.copy()
    held[700:703] = held[699]
    bad[700:703] = np.nan, np.inf, -np.inf
    y, faults = in_c(tmp_path, case._replace(u=bad))
    assert farthest(y, case._replace(u=held).expected) < NEAR
    assert faults == 1


def named(texts: list[str]) -> gpi.Model:
    """A model whose channels and covariates have these names."""
    model = with_effects("rate-dependence", "hysteresis-shape")
    for column, text in enumerate(texts):
        effect = EFFECTS["covariate"] | {"column": column, "label": text}
        model = with_effect(model, name="covariate", **effect)
    channel = [{"name": texts[0], "unit": texts[1]}]
    return changed(model, inputs=channel, outputs=channel)


@needs_c
@needs_rust
def test_no_name_ends_a_comment(tmp_path):
    honest = list(HONEST.values())
    seen = []
    for folder, texts in (("own", honest), ("plain", [f"x{i}" for i in range(len(honest))])):
        place = tmp_path / folder
        gpi.export_model_c(named(texts), place, name="axis")
        flags = ["-std=c99", "-trigraphs", "-Wall", "-Wextra", "-Werror"]
        subprocess.run(["cc", *flags, "-c", "-o", place / "axis.o", place / "axis.c"], check=True)
        code = subprocess.run(["cc", *flags, "-E", "-P", place / "axis.c"], capture_output=True, check=True)
        gpi.export_model_rust(named(texts), place / "axis.rs")
        build = ["rustc", "--edition", "2024", "-D", "warnings", "--crate-type", "lib", "--out-dir", place]
        subprocess.run([*build, place / "axis.rs"], check=True)
        lines = (place / "axis.rs").read_text(encoding="utf-8").splitlines()
        seen.append((code.stdout, [line for line in lines if not line.lstrip().startswith("//")]))
    assert seen[0] == seen[1]


def test_every_effect_of_the_catalogue_is_exported_and_another_one_is_named(monkeypatch, tmp_path):
    findings = {"outliers", "coloured-noise"}
    assert set(EFFECTS) | findings == set(gpi.effect_names()) == set(effects.EXPORTED)
    monkeypatch.delitem(effects.EXPORTED, "backlash")
    with pytest.raises(gpi.ParameterError, match="the effect `backlash` of the model cannot be exported"):
        gpi.export_model_c(with_effects("creep", "backlash"), tmp_path / "c")
    assert not (tmp_path / "c").exists()


def test_the_command_writes_the_model(tmp_path, capsys):
    file = tmp_path / "model.json"
    with_effects("creep", "backlash").save(file)
    asked = ["--what", "model", "--rust", str(tmp_path / "own.rs"), "--c", str(tmp_path / "c")]
    assert cli.run(["export", str(file), *asked]) == 0
    assert "own.rs" in capsys.readouterr().out
    for written in (tmp_path / "own.rs", tmp_path / "c" / "gpi_model.h"):
        text = written.read_text()
        assert "Effects: creep, backlash." in text and "1000 samples a second" in text
        assert "@" not in text and "$" not in text


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--what", "model", "--c", "c", "--limits=0,1"], "`limits`"),
        (["--what", "model", "--c", "c", "--name", "x-axis"], "`name` = x-axis"),
        (["--what", "model"], "nothing to write"),
        (["--what", "plant", "--c", "c"], "plant"),
    ],
)
def test_wrong_calls_write_nothing(tmp_path, monkeypatch, capsys, arguments, message):
    monkeypatch.chdir(tmp_path)
    with_effects("creep").save("model.json")
    assert cli.run(["export", "model.json", *arguments]) == 2
    assert message in capsys.readouterr().err
    assert [file.name for file in tmp_path.iterdir()] == ["model.json"]

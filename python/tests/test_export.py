"""Exported compensators, compiled and run, against the library's, sample by sample."""

import ctypes
import hashlib
import shutil
import subprocess

import numpy as np
import pytest

import gpi_hammerstein as gpi
from gpi_hammerstein import cli
from records import model_of
from test_compensator import creeping, path
from test_effects import plant

LIMITS = (-1.5, 1.2)
NEAR = {"single": 3e-6, "double": 0.0}
MODELS = {"creep": creeping, "none": lambda: model_of(plant())}
needs_c = pytest.mark.skipif(shutil.which("cc") is None, reason="NO C COMPILER: exported C is not compiled")
needs_rust = pytest.mark.skipif(
    shutil.which("rustc") is None, reason="NO RUSTC: exported Rust is not compiled"
)


def references():
    """Within reach and beyond, at rest, in decaying loops, with samples that are missing."""
    k = np.arange(4000)
    decay = 0.7 + 6.0 * np.cos(0.7 * k) * 0.998**k
    wanted = np.concatenate([path(), np.full(50, 1.1), 0.7 + 4.0 * (path(seed=7) - 0.7), decay])
    wanted[[1000, 5000]] = np.nan, np.inf
    return wanted


def expected(model, limits, wanted):
    found = model.compensator(limits=limits)
    return found.run(wanted, found.standing_at(wanted[0]))


def in_c(folder, name, number, wanted):
    """The drives of `NAME.c`, and the count of samples out of reach by a function added to it."""
    source = f'#include "{name}.c"\nunsigned long count({name}_state *s) {{ return s->out_of_reach; }}\n'
    source += f"unsigned long size(void) {{ return sizeof({name}_state); }}\n"
    (folder / "all.c").write_text(source)
    flags = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-O2", "-ffp-contract=off"]
    subprocess.run(["cc", *flags, "-shared", "-fPIC", "-o", folder / "all.so", folder / "all.c"], check=True)
    library = ctypes.CDLL(str(folder / "all.so"))
    library.size.restype = library.count.restype = ctypes.c_ulong
    start, step = library[f"{name}_start"], library[f"{name}_step"]
    start.argtypes = step.argtypes = [ctypes.c_void_p, number]
    start.restype, step.restype = None, number
    state = ctypes.create_string_buffer(library.size())
    start(state, wanted[0])
    return np.array([step(state, r) for r in wanted]), library.count(state)


@needs_c
@pytest.mark.parametrize("limits", [None, LIMITS])
@pytest.mark.parametrize("precision", ["single", "double"])
@pytest.mark.parametrize("effect", MODELS)
def test_c_is_the_library(tmp_path, effect, precision, limits):
    model, wanted = MODELS[effect](), references()
    gpi.export_c(model, tmp_path, limits=limits, precision=precision, name="x_axis")
    number = ctypes.c_float if precision == "single" else ctypes.c_double
    u, beyond = in_c(tmp_path, "x_axis", number, wanted)
    drive, state = expected(model, limits, wanted)
    size = np.max(np.abs(drive))
    assert np.max(np.abs(u - drive)) <= NEAR[precision] * size
    if precision == "double":
        assert beyond == state[1]
    assert (beyond > 1000) == (limits is not None)


MAIN = """
mod compensator;
use std::io::Read;

fn main() {
    let mut text = String::new();
    std::io::stdin().read_to_string(&mut text).unwrap();
    let wanted: Vec<compensator::Real> = text.split_whitespace().map(|word| word.parse().unwrap()).collect();
    let mut own = compensator::Compensator::standing_at(wanted[0]);
    for reference in wanted {
        println!("{:e}", own.step(reference));
    }
    println!("{}", own.out_of_reach());
}
"""


@needs_rust
@pytest.mark.parametrize("precision", ["single", "double"])
@pytest.mark.parametrize("effect", MODELS)
def test_rust_is_the_library(tmp_path, effect, precision):
    model, wanted = MODELS[effect](), references()
    gpi.export_rust(model, tmp_path / "compensator.rs", limits=LIMITS, precision=precision)
    (tmp_path / "main.rs").write_text(MAIN)
    build = [
        "rustc",
        "--edition",
        "2024",
        "-D",
        "warnings",
        "-O",
        "-o",
        tmp_path / "main",
        tmp_path / "main.rs",
    ]
    subprocess.run(build, check=True)
    text = "\n".join(repr(float(r)) for r in wanted)
    run = subprocess.run([tmp_path / "main"], input=text, capture_output=True, text=True, check=True)
    *drives, beyond = [float(word) for word in run.stdout.split()]
    drive, state = expected(model, LIMITS, wanted)
    assert np.max(np.abs(drives - drive)) <= NEAR[precision] * np.max(np.abs(drive))
    if precision == "double":
        assert beyond == state[1]


@needs_rust
def test_rust_builds_without_std(tmp_path):
    gpi.export_rust(creeping(), tmp_path / "compensator.rs")
    (tmp_path / "lib.rs").write_text("#![no_std]\npub mod compensator;\n")
    build = ["rustc", "--edition", "2024", "-D", "warnings", "--crate-type", "lib", "--out-dir", tmp_path]
    subprocess.run([*build, tmp_path / "lib.rs"], check=True)


def test_the_command_writes_both_with_facts(tmp_path, capsys):
    model = tmp_path / "model.json"
    creeping().save(model)
    files = ["--rust", str(tmp_path / "own.rs"), "--c", str(tmp_path / "c")]
    assert cli.run(["export", str(model), *files, "--limits=-1.5,1.2"]) == 0
    said = capsys.readouterr().out
    assert (
        "Compensated: hysteresis, creep." in said and "not compensated dynamics" in said and "own.rs" in said
    )
    digest = hashlib.sha256(model.read_bytes()).hexdigest()
    for file in (tmp_path / "own.rs", tmp_path / "c" / "gpi_compensator.h"):
        text = file.read_text()
        assert digest in text and "from -1.5 to 1.2" in text and "1000 samples a second" in text
        assert "@" not in text and "$" not in text
    assert not [line for line in (tmp_path / "own.rs").read_text().splitlines() if line != line.rstrip()]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "nothing to write"),
        (["--c", "c", "--name", "x-axis"], "`name` = x-axis"),
        (["--c", "c", "--limits=3,1"], "`limits` = 3, 1"),
        (["--rust", "missing/own.rs"], "cannot be written"),
    ],
)
def test_wrong_calls_write_nothing(tmp_path, monkeypatch, capsys, arguments, message):
    monkeypatch.chdir(tmp_path)
    creeping().save("model.json")
    assert cli.run(["export", "model.json", *arguments]) == 2
    assert message in capsys.readouterr().err
    assert [file.name for file in tmp_path.iterdir()] == ["model.json"]

"""Exported compensators under hostile references: finite, and back within the documented bound."""

import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import gpi_hammerstein as gpi
from test_export import MODELS, needs_c, needs_rust

HERE = Path(__file__).parent
WIDE = (-12.0, 15.0)
NUMBERS = {"single": np.finfo(np.float32), "double": np.finfo(np.float64)}
SANITIZED = ["-O1", "-g", "-fsanitize=address,undefined,float-divide-by-zero", "-fno-sanitize-recover=all"]
# numbers of hostile samples: of every run of the tests, and of `make test-slow`
FEW, MANY = 100_000, 10_000_000
CASES = [
    (effect, precision, limits)
    for effect in MODELS
    for precision in ("single", "double")
    for limits in (None, WIDE)
]


def numbers(compensator, precision):
    """The documented bound and the range of references in which it is tested, from the parameters alone."""
    inverse = compensator.hysteresis
    low, high = compensator.range
    rates, gains = compensator.creep_rates, compensator.creep_gains
    widest = max(inverse.plays.half_widths)
    safe = [max(inverse.safe[0], -2 * widest - 1), min(inverse.safe[1], 2 * widest + 1)]
    middle, half = np.mean(safe), 0.9 * np.ptp(safe) / 2
    assert half > widest, "the triangle must move every play"
    ends = compensator.offset + compensator.gain * np.array([middle - half, middle + half])
    lows, highs = inverse.limits
    huge, epsilon = float(NUMBERS[precision].max), float(NUMBERS[precision].eps)
    slope = float(np.max(np.abs(inverse.curve[2])) * np.sum(np.abs(inverse.plays.weights)))
    own = {
        "LOW": max(lows, -huge),
        "HIGH": min(highs, huge),
        "V_LOW": low,
        "V_HIGH": high,
        "LEAST": min(ends),
        "MOST": max(ends),
        "RECOVERY": (high - low) * float(np.sum(rates * np.abs(gains / compensator.gain))),
        "DECAY": 1 - min(rates, default=0.0),
        "SLOPE": slope,
        # a lag keeps the rounding errors of the bad sample, which are relative to the range
        "ROUNDING": 40 * epsilon * slope * (half + widest + (high - low) * float(np.sum(rates))),
    }
    return {name: float(value) for name, value in own.items()}


def built(tmp_path, effect, precision, limits):
    """Return the program of hostile.c, which takes the number of samples from its macro."""
    compensator = gpi.export_c(MODELS[effect](), tmp_path, limits=limits, precision=precision, name="own")
    macros = {name: f"{value!r}" for name, value in numbers(compensator, precision).items()}
    macros |= {
        "SOURCE": '"own.c"',
        "START": "own_start",
        "STEP": "own_step",
        "STATE": "own_state",
        "NOT_FINITE": "OWN_NOT_FINITE",
        "SATURATED": "OWN_SATURATED",
        "BITS": "uint32_t" if precision == "single" else "uint64_t",
    }
    return macros


def attacked(tmp_path, effect, precision, limits, samples, flags):
    macros = built(tmp_path, effect, precision, limits) | {"SAMPLES": f"{samples}ul"}
    shutil.copy(HERE / "hostile.c", tmp_path)
    defined = [f"-D{name}={value}" for name, value in macros.items()]
    warned = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-ffp-contract=off"]
    program = tmp_path / "hostile"
    subprocess.run(
        ["cc", *warned, *flags, *defined, "-I", tmp_path, "-o", program, tmp_path / "hostile.c"], check=True
    )
    run = subprocess.run([program], capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    done, compared, _ = map(int, run.stdout.split())
    assert done >= samples and compared > samples // 2


@needs_c
@pytest.mark.parametrize(("effect", "precision", "limits"), CASES)
def test_c_recovers_under_sanitizers(tmp_path, effect, precision, limits):
    attacked(tmp_path, effect, precision, limits, FEW, SANITIZED)


@pytest.mark.slow
@needs_c
@pytest.mark.parametrize(("effect", "precision", "limits"), CASES)
def test_c_recovers_from_many_under_sanitizers(tmp_path, effect, precision, limits):
    attacked(tmp_path, effect, precision, limits, MANY, SANITIZED)


RUST = (HERE / "hostile.rs").read_text(encoding="utf-8")


def attacked_rust(tmp_path, effect, precision, limits, samples):
    compensator = gpi.export_rust(
        MODELS[effect](), tmp_path / "compensator.rs", limits=limits, precision=precision
    )
    own = numbers(compensator, precision)
    constants = "".join(f"const {name}: f64 = {value!r}f64;\n" for name, value in own.items())
    bits = "u32" if precision == "single" else "u64"
    text = f"type Bits = {bits};\nconst SAMPLES: u64 = {samples};\n{constants}"
    (tmp_path / "main.rs").write_text(text + RUST)
    flags = [
        "--edition",
        "2024",
        "-D",
        "warnings",
        "-O",
        "-C",
        "debug-assertions=on",
        "-C",
        "overflow-checks=on",
    ]
    subprocess.run(["rustc", *flags, "-o", tmp_path / "main", tmp_path / "main.rs"], check=True)
    run = subprocess.run([tmp_path / "main"], capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    done, compared = map(int, run.stdout.split())
    assert done >= samples and compared > samples // 2


@needs_rust
@pytest.mark.parametrize(("effect", "precision", "limits"), CASES)
def test_rust_recovers(tmp_path, effect, precision, limits):
    attacked_rust(tmp_path, effect, precision, limits, FEW)


@pytest.mark.slow
@needs_rust
@pytest.mark.parametrize(("effect", "precision", "limits"), CASES)
def test_rust_recovers_from_many(tmp_path, effect, precision, limits):
    attacked_rust(tmp_path, effect, precision, limits, MANY)


def test_a_gain_that_single_precision_does_not_hold_is_refused(tmp_path):
    model = json.loads(MODELS["none"]().to_json())
    for matrix in "cd":
        model["linear"][matrix][0] = [value * 1e-45 for value in model["linear"][matrix][0]]
    tiny = gpi.Model.from_json(json.dumps(model))

    def written(precision):
        gpi.export_c(tiny, tmp_path / "c", precision=precision)
        gpi.export_rust(tiny, tmp_path / "own.rs", precision=precision)

    with pytest.raises(gpi.ParameterError, match="`precision` = single"):
        written("single")
    written("double")

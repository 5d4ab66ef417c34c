"""The example firmware: on the host, and on a Cortex-M4F in QEMU where there is one."""

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import gpi_hammerstein as gpi
import make_firmware_example

FIRMWARE = Path(__file__).resolve().parents[2] / "firmware"
TARGET = "thumbv7em-none-eabihf"
WRITTEN = ["model.json", "src/compensator.rs", "src/actuator.rs"]
WRITTEN += ["c/gpi_compensator.h", "c/gpi_compensator.c", "c/numbers.h"]

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(shutil.which("cargo") is None, reason="NO CARGO: the firmware is not built"),
]
needs_qemu = pytest.mark.skipif(
    shutil.which("qemu-system-arm") is None, reason="NO qemu-system-arm: the firmware does not run"
)


def run(*options):
    """The drives of both compensators and the output in single precision, and the costs."""
    command = ["cargo", "run", "--quiet", "--release", *options]
    done = subprocess.run(command, cwd=FIRMWARE, capture_output=True, text=True, check=True)
    head, *lines = done.stdout.splitlines()
    assert head == "exported streaming output"
    costs = {name: int(count) for word, name, count in map(str.split, lines[1000:]) if word == "cost"}
    bits = [[int(word, 16) for word in line.split()] for line in lines[:1000]]
    return np.array(bits, dtype=np.uint32), costs


def reference():
    """The triangle of `lib.rs`, from its description."""
    k = np.arange(1000)
    return 2 + 40 * np.interp(k % 200, [0, 50, 150, 200], [0, 1, -1, 0]) * (1 - k / 1000)


def test_the_example_is_what_the_tools_write(tmp_path):
    (tmp_path / "src").mkdir()
    (tmp_path / "c").mkdir()
    make_firmware_example.main(tmp_path)
    sources = [tmp_path / "src/actuator.rs", tmp_path / "src/compensator.rs"]
    style = ["rustfmt", "--edition", "2024", "--config-path", FIRMWARE.parent]
    subprocess.run([*style, *sources], check=True)
    for name in WRITTEN:
        assert (tmp_path / name).read_text() == (FIRMWARE / name).read_text(), name


def test_both_compensators_are_the_library():
    bits, costs = run()
    drives = bits.view(np.float32)
    found = gpi.load(FIRMWARE / "model.json").compensator(limits=make_firmware_example.LIMITS)
    expected, _ = found.run(reference(), found.standing_at(reference()[0]))
    size = np.max(np.abs(expected))
    assert 80 < size < 120
    assert np.max(np.abs(drives[:, 0] - expected)) < 3e-6 * size
    assert np.max(np.abs(drives[:, 1] - expected)) < 3e-6 * size
    output = gpi.load(FIRMWARE / "model.json").simulate(expected)
    np.testing.assert_allclose(drives[:, 2], output, rtol=0, atol=1e-4)
    assert set(costs) == {"none", "as-read", "exported", "streaming", "actuator"}


@needs_qemu
def test_a_cortex_m4f_computes_the_same_bits_without_a_panic():
    on_host, _ = run()
    on_target, costs = run("--target", TARGET)
    np.testing.assert_array_equal(on_target, on_host)
    program = (FIRMWARE / "target" / TARGET / "release/gpi-firmware").read_bytes()
    assert b"gpi_firmware" in program, "no symbols to look at"
    assert b"panic" not in program
    # instructions are counted, not timed
    assert costs["exported"] - costs["none"] < 0.75 * (costs["as-read"] - costs["none"])

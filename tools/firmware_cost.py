"""Measure the cost of one compensator sample on a Cortex-M4F and on the host.

The result is printed or written to docs/firmware.md.

Needs `qemu-system-arm`, `arm-none-eabi-gcc` and the Rust target. QEMU counts instructions, not cycles. On a
real processor, a branch that is taken needs additional cycles, and a load from flash may have to wait.
"""

import argparse
import subprocess
from pathlib import Path

from gpi_hammerstein.files import write_atomically

ROOT = Path(__file__).resolve().parent.parent
TARGET = "thumbv7em-none-eabihf"
SAMPLES = 1000
ROWS = {
    "as-read": "Rust, direct implementation of the formulas",
    "streaming": "Rust, `gpi_core::operators::Compensator`",
    "exported": "Rust, `gpi export --rust`",
    "by-hand-c": "C, direct implementation of the formulas",
    "exported-c": "C, `gpi export --c`",
}
TEXT = """# On a microcontroller

Made by `make firmware-cost` on {host}: Rust {rust}, {gcc} for the microcontroller. Both compilers optimise
for speed. The compensator computes the drive from one sample of the reference in `f32`. It has {size}. The
folder `firmware` contains the program.

| compensator | instructions, Cortex-M4F | ns, host |
|---|---|---|
{rows}

Instructions are counted by QEMU ({qemu}, `-icount shift=0`). A real processor needs some more cycles for
each branch that is taken. The direct implementations have no limits and do not compensate the rounding
errors of slow lags. The other ones are faster for two reasons. If v rises, no play moves down, so that each
play needs only one comparison. The deadzones are one piecewise linear curve, and a binary search finds the
segment.
"""


def run(*options: str) -> dict[str, int]:
    """Return the cost of 1000 samples of each compensator, by name."""
    command = ["cargo", "run", "--quiet", "--release", "--features", "c", *options]
    done = subprocess.run(command, cwd=ROOT / "firmware", capture_output=True, text=True, check=True)
    lines = [line.split() for line in done.stdout.splitlines() if line.startswith("cost ")]
    return {name: int(count) for _, name, count in lines}


def first_line(*command: str) -> str:
    """Return the first line that a command prints."""
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()[0]


def processor() -> str:
    """Return the name of the host's processor."""
    names = [row for row in Path("/proc/cpuinfo").read_text().splitlines() if row.startswith("model name")]
    return names[0].split(":")[1].strip()


def main() -> None:
    """Count instructions, measure times, and print or write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--markdown", type=Path, help="file to write the page to, for example docs/firmware.md"
    )
    markdown = parser.parse_args().markdown
    instructions, times = run("--target", TARGET), run()
    rows = []
    for name, text in ROWS.items():
        own = [(costs[name] - costs["none"]) / SAMPLES for costs in (instructions, times)]
        rows.append(f"| {text} | {own[0]:.0f} | {own[1]:.1f} |")
    page = TEXT.format(
        host=processor(),
        rust=first_line("rustc", "--version").split()[1],
        gcc=first_line("arm-none-eabi-gcc", "--version"),
        qemu=first_line("qemu-system-arm", "--version").split("(")[0].strip(),
        size="8 plays, 17 deadzones and two lags of creep",
        rows="\n".join(rows),
    )
    if markdown is None:
        print(page)
    else:
        write_atomically(markdown, page)


if __name__ == "__main__":
    main()

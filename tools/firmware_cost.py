"""Print what a sample of a compensator takes on a Cortex-M4F and on the host, or write docs/firmware.md.

Needs `qemu-system-arm`, `arm-none-eabi-gcc` and the Rust target. QEMU counts instructions, not cycles: a
branch that is taken costs a real one more, a load from flash may wait.
"""

import argparse
import subprocess
from pathlib import Path

from gpi_hammerstein.files import write_atomically

ROOT = Path(__file__).resolve().parent.parent
TARGET = "thumbv7em-none-eabihf"
SAMPLES = 1000
ROWS = {
    "as-read": "Rust, the formulas as they are read",
    "streaming": "Rust, `gpi_core::operators::Compensator`",
    "exported": "Rust, `gpi export --rust`",
    "by-hand-c": "C, the formulas as they are read",
    "exported-c": "C, `gpi export --c`",
}
TEXT = """# On a microcontroller

Made by `make firmware-cost` on {host}: Rust {rust}, {gcc} for the microcontroller, both with
optimisation for speed. From a sample of the reference to the drive in `f32`: {size}. `firmware`
holds the program.

| compensator | instructions, Cortex-M4F | ns, host |
|---|---|---|
{rows}

Instructions are counted by QEMU ({qemu}, `-icount shift=0`); a real one takes some cycles more
where a branch is taken. Those as they are read have no limits, and do not carry on what rounding
takes from slow lags. What the others win: where v rises no play falls, so that a play takes one
comparison, and the deadzones are one curve, of which a search finds the piece.
"""


def run(*options: str) -> dict[str, int]:
    """Return what 1000 samples take, by name."""
    command = ["cargo", "run", "--quiet", "--release", "--features", "c", *options]
    done = subprocess.run(command, cwd=ROOT / "firmware", capture_output=True, text=True, check=True)
    lines = [line.split() for line in done.stdout.splitlines() if line.startswith("cost ")]
    return {name: int(count) for _, name, count in lines}


def first_line(*command: str) -> str:
    """Return the first line that a command prints."""
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()[0]


def processor() -> str:
    """Name the host's processor."""
    names = [row for row in Path("/proc/cpuinfo").read_text().splitlines() if row.startswith("model name")]
    return names[0].split(":")[1].strip()


def main() -> None:
    """Count, time, and print or write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--markdown", type=Path, help="write the table there")
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
        size="8 plays, 17 deadzones, two lags of creep",
        rows="\n".join(rows),
    )
    if markdown is None:
        print(page)
    else:
        write_atomically(markdown, page)


if __name__ == "__main__":
    main()

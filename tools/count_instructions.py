"""Count the instructions and the time of one sample through 17 deadzones and 8 plays.

The operators of this package are compared with a direct implementation of the definitions. The script runs an
example of gpi-core under `valgrind --tool=callgrind`, which must be installed. It runs the example with two
numbers of samples; the difference of the two counts is the cost of the additional samples.
"""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
EXAMPLE = ROOT / "target/release/examples/one_sample"
FEW, MANY = 10_000, 30_000


def instructions(which: str, samples: int) -> int:
    """Return the instructions of a run, without those that generate the input."""
    command = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", "--toggle-collect=*step*"]
    run = subprocess.run([*command, EXAMPLE, which, str(samples)], capture_output=True, text=True, check=True)
    found = re.search(r"Collected : (\d+)", run.stderr)
    if not found:
        raise SystemExit(f"callgrind printed no count:\n{run.stderr}")
    return int(found[1])


def nanoseconds(which: str) -> float:
    """Return the shortest time of a sample over several runs."""
    command = [EXAMPLE, which, "1000000"]
    runs = [subprocess.run(command, capture_output=True, text=True, check=True) for _ in range(7)]
    return min(float(run.stdout) for run in runs)


def main() -> None:
    """Print both counts, both times, and their ratios."""
    build = ["cargo", "build", "--release", "--package", "gpi-core", "--example", "one_sample"]
    subprocess.run(build, cwd=ROOT, check=True)
    ways = ("naive", "gpi")
    counts = [(instructions(way, MANY) - instructions(way, FEW)) / (MANY - FEW) for way in ways]
    times = [nanoseconds(way) for way in ways]
    for way, count, time in zip(ways, counts, times, strict=True):
        print(f"{way}: {count:.0f} instructions and {time:.1f} ns a sample")
    print(f"ratios: {counts[0] / counts[1]:.2f} in instructions, {times[0] / times[1]:.2f} in time")


if __name__ == "__main__":
    sys.exit(main())

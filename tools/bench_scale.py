"""Print how long `identify` takes as records and the number of their experiments grow.

The record is that of a simulated stage (`python/tests/plants.py`). It is cut into experiments of equal
length, each of which begins in motion, so that each has an initial state of its own. `python
tools/bench_scale.py --help` lists the options.
"""

import argparse
import sys
import time
from pathlib import Path

import gpi_hammerstein as gpi

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "python" / "tests"))

import plants

RATE = 1000.0


def record_of(samples: int, experiments: int) -> gpi.Record:
    """A record of a stage with so many samples, cut into so many experiments."""
    whole = plants.draw(3, (), seconds=samples / RATE, rate=RATE).record(0)
    length = samples // experiments
    pieces = [slice(i * length, (i + 1) * length) for i in range(experiments)]
    return gpi.Record([whole.u[piece] for piece in pieces], [whole.y[piece] for piece in pieces], rate=RATE)


def seconds_of(record: gpi.Record) -> float:
    """The time of one identification in s."""
    start = time.perf_counter()
    gpi.identify(record)
    return time.perf_counter() - start


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, default=20_000, help="samples of the record that is cut")
    parser.add_argument("--experiments", type=int, nargs="*", default=[1, 10, 100, 1000])
    parser.add_argument(
        "--long", type=int, nargs="*", default=[100_000, 1_000_000], help="samples of uncut records"
    )
    arguments = parser.parse_args()
    cases = [(arguments.samples, count) for count in arguments.experiments]
    cases += [(samples, 1) for samples in arguments.long]
    first = None
    print(f"{'samples':>10} {'experiments':>12} {'seconds':>9} {'ratio':>7}")
    for samples, experiments in cases:
        taken = seconds_of(record_of(samples, experiments))
        first = first or taken
        print(f"{samples:>10} {experiments:>12} {taken:>9.1f} {taken / first:>7.2f}", flush=True)


if __name__ == "__main__":
    main()

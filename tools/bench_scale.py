"""Print how long `identify` and `explain` take.

`identify` is timed as records and the number of their experiments grow. Its record is that of a simulated
stage (`python/tests/plants.py`). It is cut into experiments of equal length, each of which begins in motion,
so that each has an initial state of its own. `explain` is timed on the demo record and on two records of
`blind/dev` of the data folder (`GPI_DATA_DIR`, else `../shared`), with one and with three effects, and on
records of such a stage with creep and backlash, as they grow. `python tools/bench_scale.py --help` lists the
options.
"""

import argparse
import sys
import time
from pathlib import Path

import gpi_hammerstein as gpi

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "python" / "tests"))

import plants
from data_folder import DATA

RATE = 1000.0


def record_of(samples: int, experiments: int, effects: tuple[str, ...] = ()) -> gpi.Record:
    """A record of a stage with so many samples, cut into so many experiments."""
    whole = plants.draw(3, effects, seconds=samples / RATE, rate=RATE).record(0)
    length = samples // experiments
    pieces = [slice(i * length, (i + 1) * length) for i in range(experiments)]
    return gpi.Record([whole.u[piece] for piece in pieces], [whole.y[piece] for piece in pieces], rate=RATE)


def seconds_of(record: gpi.Record) -> float:
    """The time of one identification in s."""
    start = time.perf_counter()
    gpi.identify(record)
    return time.perf_counter() - start


def explained(sizes: list[int]) -> None:
    """Print the time of `explain` on a few records, and on a stage with two effects in so many samples."""
    dev = DATA / "blind" / "dev"
    demo = Path(gpi.__file__).parent / "data" / "demo.csv.gz"
    paths = [demo, *(dev / f"record-{number}.csv.gz" for number in ("05", "20"))]
    print(f"{'record':>16} {'samples':>10} {'seconds':>9}  effects")
    for path in paths:
        if not path.is_file():
            print(f"{path.name:>16}: not found, set GPI_DATA_DIR")
            continue
        print_explained(path.name, gpi.read_record(path))
    for samples in sizes:
        print_explained("creep, backlash", record_of(samples, 1, ("creep", "backlash")))


def print_explained(name: str, record: gpi.Record) -> None:
    """Print the time of one explanation, and the effects that it names."""
    start = time.perf_counter()
    found = gpi.explain(record)
    taken = time.perf_counter() - start
    print(f"{name:>16} {record.samples:>10} {taken:>9.1f}  {', '.join(found.effects)}", flush=True)


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, default=20_000, help="samples of the record that is cut")
    parser.add_argument("--experiments", type=int, nargs="*", default=[1, 10, 100, 1000])
    parser.add_argument(
        "--long", type=int, nargs="*", default=[100_000, 1_000_000], help="samples of uncut records"
    )
    parser.add_argument("--no-explain", action="store_true", help="time `identify` only")
    arguments = parser.parse_args()
    if not arguments.no_explain:
        explained(arguments.long)
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

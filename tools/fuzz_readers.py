"""Read mutated record files and count what happens.

    python tools/fuzz_readers.py --number 20000 --seed 1

Every file must be read, or be refused with an error of the package that names it. The files are read in
worker processes, so that a process that dies (signal) or does not answer (hang) is counted, and the run goes
on. The files that fail are written to the folder of `--keep`, and the exit code is 1. The file `index` of the
run `seed` is always the same: `reader_corpus.mutation(corpus(), seed, index)`.
"""

import argparse
import os
import queue
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

from reader_corpus import corpus, mutation

# Reading one of these files takes milliseconds; the start of a process takes a second.
HANG_SECONDS, START_SECONDS = 20.0, 120.0
GOOD = ("read", "DataError", "ParameterError")
CLASSES = {
    "read": "read",
    "DataError": "refused by DataError",
    "ParameterError": "refused by ParameterError",
    "wrong": "read with a wrong content",
    "foreign": "foreign exception",
    "signal": "signal",
    "hang": "hang",
}


@dataclass
class Outcome:
    """What happened with some of the files."""

    counts: Counter[tuple[str, str]] = field(default_factory=Counter)
    """Number of files by format and class."""
    failed: list[tuple[int, str]] = field(default_factory=list)
    """Index and description of each file that was neither read nor refused."""
    slowest: float = 0.0
    """Longest time for one file in s."""
    memory: int = 0
    """Largest memory of a process in KiB, where the system states it."""


def read(path: Path) -> tuple[str, str]:
    """Read one file and return the class of what happened, and details."""
    import numpy as np

    import gpi_hammerstein as gpi
    from gpi_hammerstein.io import read_recording

    try:
        recording = read_recording(path, rate=100.0 if path.suffix == ".npy" else None)
    except gpi.GpiError as error:
        if path.name not in str(error):
            return "foreign", f"the message does not name the file: {error}"
        return type(error).__name__, ""
    except (KeyboardInterrupt, SystemExit):
        raise
    except BaseException as error:
        return "foreign", f"{type(error).__module__}.{type(error).__name__}: {error}"
    for run in recording.runs:
        samples = np.column_stack([run.u, run.y, run.covariates])
        if not (samples.size and np.isfinite(samples).all() and 0 < recording.rate < np.inf):
            return "wrong", f"samples {samples.shape}, rate {recording.rate}"
    return "read", ""


def serve(folder: Path, seed: int, indices: range) -> None:
    """Read files in this process and print one line for each."""
    try:
        from resource import RUSAGE_SELF, getrusage
    except ImportError:  # not on Windows
        getrusage = None
    seeds = corpus()
    print("ready", flush=True)
    for index in indices:
        suffix, content = mutation(seeds, seed, index)
        path = folder / f"r{index}{suffix}"
        path.write_bytes(content)
        kind, details = read(path)
        path.unlink()
        memory = getrusage(RUSAGE_SELF).ru_maxrss if getrusage else 0
        print(index, kind, memory, details.encode("unicode_escape").decode()[:300], flush=True)


def watch(folder: Path, seed: int, indices: range, formats: Sequence[str]) -> Outcome:
    """Let worker processes read files; start another one behind each file that ends or blocks a process."""
    outcome = Outcome()

    def count(index: int, kind: str, details: str) -> None:
        outcome.counts[formats[index % len(formats)], kind] += 1
        if kind not in GOOD:
            outcome.failed.append((index, f"{kind}: {details}"))

    while indices:
        rest = (indices.start, indices.stop, indices.step)
        words = [sys.executable, __file__, "--serve", str(folder), "--seed", str(seed)]
        with subprocess.Popen(
            [*words, "--indices", *map(str, rest)],
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        ) as process:
            lines = lines_of(process.stdout)
            try:
                if lines.get(timeout=START_SECONDS) != "ready\n":
                    raise SystemExit("a worker process does not start; is the package built?")
                while indices:
                    begin = time.monotonic()
                    line = lines.get(timeout=HANG_SECONDS)
                    outcome.slowest = max(outcome.slowest, time.monotonic() - begin)
                    if not line:
                        count(indices[0], "signal", f"exit code {process.wait()}")
                        indices = indices[1:]
                        break
                    index, kind, memory, *details = line.split(maxsplit=3)
                    assert int(index) == indices[0]
                    count(indices[0], kind, "".join(details).strip())
                    outcome.memory = max(outcome.memory, int(memory))
                    indices = indices[1:]
            except queue.Empty:
                count(indices[0], "hang", f"no answer in {HANG_SECONDS:g} s")
                indices = indices[1:]
            finally:
                process.kill()
    return outcome


def lines_of(stream: IO[str] | None) -> queue.Queue[str]:
    """Return a queue of the lines of a stream; an empty line is its end."""
    lines: queue.Queue[str] = queue.Queue()

    def forward() -> None:
        for line in stream or ():
            lines.put(line)
        lines.put("")

    threading.Thread(target=forward, daemon=True).start()
    return lines


def attack(number: int, seed: int, jobs: int) -> Outcome:
    """Read `number` mutated files in `jobs` processes at a time."""
    formats = [one.name for one in corpus()]
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(jobs) as pool:
        parts = [
            pool.submit(watch, Path(folder), seed, range(first, number, jobs), formats)
            for first in range(jobs)
        ]
        outcomes = [part.result() for part in parts]
    return Outcome(
        sum((one.counts for one in outcomes), Counter()),
        sorted(failure for one in outcomes for failure in one.failed),
        max(one.slowest for one in outcomes),
        max(one.memory for one in outcomes),
    )


def main() -> int:
    parser = argparse.ArgumentParser(description="Read mutated record files and count what happens.")
    parser.add_argument("--number", type=int, default=20_000, help="number of files")
    parser.add_argument("--seed", type=int, default=int(time.time()), help="seed; by default a new one")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="processes at a time")
    parser.add_argument("--keep", type=Path, help="folder for the files that fail")
    parser.add_argument("--serve", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--indices", type=int, nargs=3, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.serve:
        serve(options.serve, options.seed, range(*options.indices))
        return 0
    outcome = attack(options.number, options.seed, options.jobs)
    formats = list(dict.fromkeys(one.name for one in corpus()))
    print(f"{options.number} mutated files, seed {options.seed}\n")
    print(f"| {'result':27} | {' | '.join(formats)} | all |")
    print("|---" * (len(formats) + 2) + "|")
    for kind, title in CLASSES.items():
        counts = [outcome.counts[name, kind] for name in formats]
        cells = [f"{n:{len(name)}}" for n, name in zip(counts, formats, strict=True)]
        print(f"| {title:27} | {' | '.join(cells)} | {sum(counts)} |")
    print(f"\nslowest file {outcome.slowest:.2f} s, largest process {outcome.memory / 1024:.0f} MiB")
    seeds = corpus()
    for index, what in outcome.failed:
        suffix, content = mutation(seeds, options.seed, index)
        print(f"file {index} ({seeds[index % len(seeds)].name}): {what}")
        if options.keep:
            options.keep.mkdir(parents=True, exist_ok=True)
            (options.keep / f"s{options.seed}-r{index}{suffix}").write_bytes(content)
    return 1 if outcome.failed else 0


if __name__ == "__main__":
    sys.exit(main())

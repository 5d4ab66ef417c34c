"""Compare the run time of the same work in this package, NumPy, numba, python-control and a C loop.

Every round runs each tool once, one after the other, so that other load of the machine affects all of them.
The table contains the medians of the rounds. `make bench-peers` writes docs/benchmarks.md.
"""

import argparse
import ctypes
import os
import platform
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import control
import numba
import numpy as np
from numpy.typing import NDArray

import gpi_hammerstein as gpi
from gpi_hammerstein.files import write_atomically

Array = NDArray[np.float64]
Work = Callable[[], object]
OURS = "gpi"
PEERS = ("copy", "C loop", "numba", "NumPy", "python-control")

HEADER = """# Benchmarks

Made by `make bench-peers` on {machine}.

All functions are called from Python on NumPy arrays. All run on one thread, with two exceptions: rows that
name two threads, and NumPy's `lstsq` and decompositions, which use as many threads as they choose. The C
loop is compiled with `-O3`. The columns from `copy` on are the time of the other tool divided by the time
of this package: if the value is above 1, this package is faster. Each time is the median of several rounds,
in which each tool runs once. `copy` is NumPy's copy of the input into new memory, which is a lower bound
for every tool. In the rows of `FIR`, NumPy runs `lstsq`. In the rows of `ERA`, NumPy runs only the singular
value decomposition. Order 6 needs only the leading singular values, and order 13 needs all of them.

"""

C_LOOP = """
void plays(const double *z, double *v, long samples, const double *r, const double *p, double *f, long n) {
    for (long k = 0; k < samples; k++) {
        double sum = 0.0;
        for (long i = 0; i < n; i++) {
            double low = z[k] - r[i], high = z[k] + r[i];
            double place = f[i] < low ? low : f[i];
            place = place > high ? high : place;
            f[i] = place;
            sum += p[i] * place;
        }
        v[k] = sum;
    }
}
"""


@numba.njit
def numba_plays(z: Array, r: Array, p: Array) -> Array:
    """Return the sum of weighted plays, computed by two loops."""
    v = np.empty_like(z)
    places = np.zeros_like(r)
    for k in range(len(z)):
        total = 0.0
        for i in range(len(r)):
            place = max(z[k] - r[i], min(z[k] + r[i], places[i]))
            places[i] = place
            total += p[i] * place
        v[k] = total
    return v


class Loop:
    """The C loop, compiled for this machine's gcc."""

    def __init__(self, folder: Path) -> None:
        source, library = folder / "plays.c", folder / "plays.so"
        source.write_text(C_LOOP)
        compiler = os.environ.get("CC", "gcc")
        subprocess.run([compiler, "-O3", "-shared", "-fPIC", "-o", library, source], check=True)
        self.run = ctypes.CDLL(str(library)).plays
        pointer = np.ctypeslib.ndpointer(np.float64, flags="C_CONTIGUOUS")
        self.run.argtypes = [pointer, pointer, ctypes.c_long, pointer, pointer, pointer, ctypes.c_long]
        self.run.restype = None

    def __call__(self, z: Array, r: Array, p: Array) -> Array:
        """Return the sum of weighted plays."""
        v = np.empty_like(z)
        self.run(z, v, len(z), r, p, np.zeros_like(r), len(r))
        return v


@dataclass(frozen=True)
class Row:
    """One piece of work, and the time that each tool needs for it, in seconds."""

    name: str
    samples: int
    seconds: dict[str, float]


def timed(name: str, samples: int, works: dict[str, Work], rounds: int) -> Row:
    """Return the median times of several functions that are run in turn."""
    seconds: dict[str, list[float]] = {peer: [] for peer in works}
    for work in works.values():
        work()
    for _ in range(rounds):
        for peer, work in works.items():
            start = time.perf_counter()
            work()
            seconds[peer].append(time.perf_counter() - start)
    row = Row(name, samples, {peer: float(np.median(all_)) for peer, all_ in seconds.items()})
    print(line(row), flush=True)
    return row


def bank(plays: int) -> tuple[Array, Array]:
    """Return half-widths and weights."""
    return np.arange(plays) / plays, 1.0 / (1.0 + np.arange(plays))


def signals(samples: int) -> dict[str, Array]:
    """Return a sine, a multisine and white noise."""
    k = np.arange(samples)
    noise = np.random.default_rng(1).uniform(-1.0, 1.0, samples)
    tones = [np.sin(2 * np.pi * f * k + f * 1e5) for f in (1e-4, 2.3e-4, 7.1e-4, 1.7e-3)]
    return {"sine": np.sin(2 * np.pi * 1e-3 * k), "multisine": sum(tones) / 3.0, "noise": noise}


def plays(rounds: int, loop: Loop) -> list[Row]:
    """Time banks of plays."""
    rows = []
    for samples, counts in ((10_000_000, (8, 32)), (1_000_000, (8, 32, 128, 1024))):
        for name, z in signals(samples).items():
            for count in counts:
                r, p = bank(count)
                ours = gpi.PlayBank(r, p)
                if not np.allclose(ours(z), loop(z, r, p), rtol=0, atol=1e-13 * p.sum()):
                    raise SystemExit(f"plays, {name}, n = {count}: the results differ")
                works: dict[str, Work] = {
                    OURS: lambda ours=ours, z=z: ours(z),
                    "copy": lambda z=z: z.copy(),
                    "C loop": lambda z=z, r=r, p=p: loop(z, r, p),
                    "numba": lambda z=z, r=r, p=p: numba_plays(z, r, p),
                }
                few = 3 if count >= 1024 else rounds
                rows.append(timed(f"{count} plays, {name}, {samples:.0e} samples", samples, works, few))
                if samples == 10_000_000 and name == "noise":
                    works[OURS] = lambda ours=ours, z=z: ours(z, threads=2)
                    label = f"{count} plays, {name}, {samples:.0e} samples, two threads here"
                    rows.append(timed(label, samples, works, rounds))
    return rows


def deadzones(rounds: int) -> list[Row]:
    """Time envelopes of deadzones."""
    rows = []
    u = signals(1_000_000)["noise"]
    for count in (17, 128):
        eta, g = np.linspace(-0.9, 0.9, count), np.full(count, 0.1)
        ours = gpi.Deadzones(eta, g)

        def by_numpy(eta: Array = eta, g: Array = g) -> Array:
            z = np.zeros_like(u)
            for threshold, weight in zip(eta, g, strict=True):
                beyond = u - threshold
                side = np.maximum if threshold > 0 else np.minimum
                z += weight * (side(beyond, 0.0) if threshold else beyond)
            return z

        works: dict[str, Work] = {OURS: lambda ours=ours: ours(u), "copy": u.copy, "NumPy": by_numpy}
        rows.append(timed(f"{count} deadzones, noise, 1e+06 samples", len(u), works, rounds))
    return rows


def fir(rounds: int) -> list[Row]:
    """Time finite impulse responses by least squares."""
    rows = []
    for samples, counts in ((100_000, (31, 301)), (1_000_000, (31, 301))):
        u = signals(samples)["noise"]
        for taps in counts:
            truth = np.exp(-np.arange(taps) / 9.0)
            y = np.convolve(u, truth)[:samples]

            def by_numpy(taps: int = taps, y: Array = y, u: Array = u) -> Array:
                rows = np.lib.stride_tricks.sliding_window_view(u, taps)[:, ::-1]
                regressor = np.column_stack([rows, np.ones(len(rows))])
                found: Array = np.linalg.lstsq(regressor, y[taps - 1 :], rcond=None)[0]
                return found

            ours = np.max(np.abs(gpi.fir(u, y, taps).markov[0, 0] - truth))
            theirs = np.max(np.abs(by_numpy()[:taps] - truth))
            print(f"largest error of {taps} taps: {ours:.1e} here, {theirs:.1e} by lstsq")
            works: dict[str, Work] = {
                OURS: lambda taps=taps, y=y, u=u: gpi.fir(u, y, taps),
                "NumPy": by_numpy,
            }
            few = 1 if samples * taps > 100_000_000 else 3
            rows.append(timed(f"FIR, {taps} taps, {samples:.0e} samples", samples, works, few))
    return rows


def era(rounds: int) -> list[Row]:
    """Time realizations from Markov parameters."""
    rows = []
    noise = 1e-4 * np.random.default_rng(2).normal(size=1001)
    for size in (15, 50, 150, 300, 500):
        k = np.arange(2 * size + 1)
        modes = ((0.95, 0.3), (0.9, 1.1), (0.8, 2.0))
        markov = sum(radius**k * np.cos(angle * k) for radius, angle in modes) + noise[: len(k)]
        markov[0] = 0.0
        hankel = markov[1 + np.arange(size)[:, None] + np.arange(size)[None, :]]
        for order in (6, 13):
            works: dict[str, Work] = {
                OURS: lambda markov=markov, order=order, size=size: gpi.era(markov, order, size),
                "NumPy": lambda hankel=hankel: np.linalg.svd(hankel),
                "python-control": lambda markov=markov, size=size, order=order: control.eigensys_realization(
                    markov[None, None, :], order, m=size, n=size
                ),
            }
            rows.append(timed(f"ERA, Hankel {size} x {size}, order {order}", size, works, rounds))
    return rows


def line(row: Row) -> str:
    """Return a row of the table."""
    ours = row.seconds[OURS]
    cells = [f"{row.seconds[p] / ours:.3g}" if p in row.seconds else "" for p in PEERS]
    return f"| {row.name} | {1e3 * ours:.3g} | {' | '.join(cells)} |"


def machine() -> str:
    """Return a description of the machine, the compiler and the packages."""
    names = [row for row in Path("/proc/cpuinfo").read_text().splitlines() if row.startswith("model name")]
    compiler = shutil.which(os.environ.get("CC", "gcc")) or "gcc"
    built = subprocess.run([compiler, "--version"], capture_output=True, text=True, check=True).stdout
    packages = ", ".join(f"{name} {version(name)}" for name in ("numpy", "numba", "control"))
    return (
        f"{len(names)} x {names[0].split(':')[1].strip()}; {built.splitlines()[0]}; "
        f"Python {platform.python_version()}, {packages}, gpi-hammerstein {version('gpi-hammerstein')}"
    )


def main() -> None:
    """Print the table, and write it to a file if one is given."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--markdown", type=Path, help="file to write the table to, for example docs/benchmarks.md"
    )
    parser.add_argument(
        "--rounds", type=int, default=7, help="number of rounds; the medians are taken over them"
    )
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        loop = Loop(Path(folder))
        rounds = options.rounds
        rows = [*plays(rounds, loop), *deadzones(rounds), *fir(rounds), *era(rounds)]
    if options.markdown:
        peers = " | ".join(PEERS)
        head = [f"| work | here, ms | {peers} |", "|---" * (2 + len(PEERS)) + "|"]
        text = HEADER.format(machine=machine()) + "\n".join([*head, *map(line, rows)]) + "\n"
        write_atomically(options.markdown, text)


if __name__ == "__main__":
    sys.exit(main())

"""Print how many defects the fleet's page finds among simulated devices.

All devices have the same design with tolerances. One in twenty has a defect: a cracked stack (it moves
less, at a lower resonance), a loose screw (backlash), a bent sensor curve, or a gain that ages during
the record. A device is found if it stands out in the table of `gpi batch`, which runs on a Dask cluster
of which a worker is killed. `--keep` names the folder of the records and of the results; a run that was
stopped continues there.
"""

import argparse
import json
import os
import signal
import sys
import tempfile
import threading
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import polars as pl
from numpy.typing import NDArray

import gpi_hammerstein as gpi

RATE, SAMPLES = 1000.0, 4000
DEFECTS = ("cracked-stack", "backlash", "bent-sensor", "ageing-gain")
# A line tests the same few things of every device.
OPTIONS = {
    "order": 2,
    "half_widths": 5,
    "thresholds": 0,
    "effects": ["creep", "backlash", "output-nonlinearity", "gain-drift"],
}


def drive() -> NDArray[np.float64]:
    """Return the drive of the test stand: at rest, a decaying triangle, then noise around the resonance."""
    slow = gpi.decaying_triangle(SAMPLES // 2, RATE, 2.0, (0.0, 100.0))
    fast = gpi.multisine(SAMPLES - len(slow) - 100, RATE, (1.0, 300.0), (20.0, 80.0), seed=5)
    return np.r_[np.zeros(100), slow, fast]


def record_of(number: int, defect: str | None) -> pl.DataFrame:
    """Return the record of a device."""
    random = np.random.default_rng([17, number])
    gain, frequency = 0.1 * random.normal(1.0, 0.02), 120.0 * random.normal(1.0, 0.02)
    damping = 0.04 * random.normal(1.0, 0.1)
    half_widths = np.array([0.0, 4.0, 8.0, 12.0, 16.0]) * random.normal(1.0, 0.04)
    weights = np.array([1.0, 0.1, 0.06, 0.04, 0.03]) * random.normal(1.0, 0.01, 5)
    if defect == "cracked-stack":
        gain, frequency = 0.8 * gain, 0.88 * frequency
    u = drive()
    w = 2 * np.pi * frequency / RATE
    pole = np.exp(w * complex(-damping, np.sqrt(1 - damping**2)))
    a = [1.0, -2 * pole.real, abs(pole) ** 2]
    g = gpi.StateSpace.from_transfer_function([0.0, sum(a)], a)
    y = gain * g.simulate(gpi.PlayBank(half_widths, weights)(u)).ravel()
    travel = float(np.ptp(y))
    if defect == "backlash":
        y = np.asarray(gpi.PlayBank([0.015 * travel], [1.0])(y))
    elif defect == "bent-sensor":
        y = y - 0.04 * travel * (y / travel) * (1 - y / travel)
    elif defect == "ageing-gain":
        y = y * np.linspace(1.0, 0.97, len(y))
    y = y + 1e-3 * travel * random.normal(size=len(y))
    return pl.DataFrame({"t_s": np.arange(len(u)) / RATE, "u_V": u, "y_um": y})


def defect_of(number: int) -> str | None:
    """Return the defect of a device: one in twenty has one."""
    return DEFECTS[number // 20 % len(DEFECTS)] if number % 20 == 7 else None


def explained(
    records: list[Path], out: Path, workers: int, kill_after: float | None
) -> tuple[pl.DataFrame, float]:
    """Explain records on a Dask cluster, of which a worker may be killed; return table and seconds."""
    from dask.distributed import Client, LocalCluster

    with (
        LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None) as cluster,
        Client(cluster) as client,
    ):

        def kill() -> None:
            pid = next(iter(client.run(os.getpid).values()))
            os.kill(pid, signal.SIGKILL)
            print(f"a worker was killed after {kill_after:g} s", flush=True)

        timer = threading.Timer(kill_after or 0.0, kill)
        if kill_after is not None:
            timer.start()
        began = time.monotonic()
        table = gpi.batch(records, out=out, executor=client, **OPTIONS)
        timer.cancel()
        seconds = time.monotonic() - began
    print(
        f"{len(records)} records in {seconds:.0f} s on {workers} workers",
        flush=True,
    )
    return table, seconds


def timed(records: list[Path], folder: Path, workers: int) -> float:
    """Explain records in processes of one thread each; return the seconds that it took."""
    began = time.monotonic()
    gpi.batch(records, out=folder, workers=workers, **OPTIONS)
    seconds = time.monotonic() - began
    print(f"{len(records)} records in {seconds:.0f} s on {workers} workers", flush=True)
    return seconds


def speed(records: list[Path]) -> None:
    """Print how much faster two workers are than one, and two batches side by side of one worker each.

    The two batches share nothing but the machine: what they gain is all that the machine gives. All results
    are in a temporary folder, because a batch does not compute again what it finds.
    """
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        one, two = timed(records, folder / "one", 1), timed(records, folder / "two", 2)
        began = time.monotonic()
        with ThreadPoolExecutor(2) as pool:
            for half in (0, 1):
                pool.submit(timed, records[half::2], folder / f"half-{half}", 1)
        apart = time.monotonic() - began
    print(f"2 workers are {one / two:.2f} times faster than one,")
    print(f"and two batches of one worker each {one / apart:.2f} times")


def main() -> int:
    """Make the fleet, explain it, and print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--devices", type=int, default=1000)
    parser.add_argument("--kill-after", type=float, default=30.0, metavar="SECONDS")
    parser.add_argument("--keep", type=Path, metavar="DIR")
    parser.add_argument("--speed", action="store_true", help="only compare two workers with one")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = given.keep or Path(temporary)
        (folder / "records").mkdir(parents=True, exist_ok=True)
        records = [folder / "records" / f"device-{number:04}.csv" for number in range(given.devices)]
        for number, file in enumerate(records):
            if not file.exists():
                record_of(number, defect_of(number)).write_csv(file)
        if given.speed:
            speed(records)
            return 0
        table, _ = explained(records, folder / "fleet", 2, given.kill_after)
        names = table["name"].to_list()
        print(f"rows: {len(names)}, different records: {len(set(names))}, errors: {table['error'].count()}")
        seconds = table["seconds"].to_numpy()
        print(f"seconds of one record: median {np.median(seconds):.2f}, largest {seconds.max():.1f}")
        gpi.fleet_report(folder / "fleet" / "fleet.parquet", folder / "fleet.html")
        outstanding = gpi.unusual_devices(table)
        why = dict(zip(outstanding["name"], outstanding["why"].to_list(), strict=True))
        truth = {name: defect_of(int(name.rsplit("-", 1)[1])) for name in names}
        defective = [name for name in names if truth[name]]
        found = [name for name in defective if name in why]
        false = [name for name in why if not truth[name]]
        good = len(names) - len(defective)
        print(
            f"defects found: {len(found)} of {len(defective)} "
            f"({100 * len(found) / max(len(defective), 1):.1f} %)"
        )
        print(f"false ones: {len(false)} of {good} ({100 * len(false) / max(good, 1):.2f} %)")
        for defect, missed in Counter(truth[name] for name in defective if name not in why).items():
            print(f"  missed {missed} of {defect}")
        for name in false[:10]:
            print(f"  false: {name}: {json.dumps(why[name])}")
    return 0


if __name__ == "__main__":
    sys.exit(main())

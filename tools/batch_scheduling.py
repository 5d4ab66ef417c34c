"""Print what the scheduling of a large batch costs, and how many workers it can keep busy.

The records are so short that reading them ends with an error at once, and each has its own content.

1. A simulated executor returns the row of each task at once: what is measured is the work of the process that
   calls `gpi.batch`, with the planning (one hash for each file), the queue, and the table.
2. A Dask cluster of two processes on this machine does empty tasks: what is measured is the scheduler and the
   connection to it.
3. `gpi.batch` gives the records to the same cluster: a test that each record gets one row.

The figures for a large cluster, on paper, are those of the sum of the first two times.
"""

import argparse
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import Executor, Future
from pathlib import Path
from typing import Any

import gpi_hammerstein as gpi
from gpi_hammerstein.fleet import row
from gpi_hammerstein.fleet.work import Task

# Workers of the cluster on paper, and seconds that a record takes them: a short and a long one.
WORKERS = 1000
SECONDS = (2.0, 20.0)


class Simulated(Executor):
    """An executor with any number of workers that need no time."""

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **_: Any) -> Future[Any]:
        """Return the finished row of a task, without doing it."""
        task: Task = arguments[0]
        future: Future[Any] = Future()
        future.set_result(row.of_failure(task.job, task.folder.name, task.key, "simulated", 0.0))
        return future


def files(folder: Path, number: int) -> list[Path]:
    """Write records of two samples; return their names."""
    folder.mkdir()
    found = [folder / f"{place:06}.csv" for place in range(number)]
    for place, file in enumerate(found):
        file.write_text(f"t,u,y\n0,0,{place}\n1,0,0\n")
    return found


def nothing(place: int) -> int:
    """Return the place of an empty task."""
    return place


def told(label: str, number: int, seconds: float) -> float:
    """Print a time; return that of one task."""
    print(f"{label}: {number} tasks in {seconds:.1f} s, {1e3 * seconds / number:.2f} ms each", flush=True)
    return seconds / number


def main() -> int:
    """Run both parts, and print the figures for a large cluster."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tasks", type=int, default=100_000, help="of the simulated executor")
    parser.add_argument("--dask-tasks", type=int, default=10_000, help="of the Dask cluster")
    given = parser.parse_args()
    from dask.distributed import Client, LocalCluster

    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        records = files(folder / "records", max(given.tasks, given.dask_tasks))
        began = time.monotonic()
        table = gpi.batch(records[: given.tasks], out=folder / "simulated", executor=Simulated())
        own = told("simulated executor", len(table), time.monotonic() - began)
        with (
            LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster,
            Client(cluster) as client,
        ):
            began = time.monotonic()
            client.gather([client.submit(nothing, place) for place in range(given.dask_tasks)])
            other = told("Dask, empty tasks", given.dask_tasks, time.monotonic() - began)
            began = time.monotonic()
            table = gpi.batch(records[: given.dask_tasks], out=folder / "dask", executor=client)
            told("Dask, records that two workers refuse", len(table), time.monotonic() - began)
            if sorted(table["name"]) != sorted(file.stem for file in records[: given.dask_tasks]):
                print("error: not one row for each record", file=sys.stderr)
                return 1
    for seconds in SECONDS:
        asked = WORKERS / seconds
        print(
            f"{WORKERS} workers, records of {seconds:g} s: the scheduling of {asked:.0f} tasks takes "
            f"{asked * (own + other):.2f} s of each second; {given.tasks} records take "
            f"{given.tasks * max(1 / asked, own + other) / 60:.0f} min"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())

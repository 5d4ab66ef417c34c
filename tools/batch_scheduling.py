"""Print what the scheduling of a large batch costs, and how many workers it can keep busy.

The records are so short that reading them ends with an error at once, and each has its own content: what is
measured is the planning of `gpi.batch` (one hash for each file), the scheduling, the folder with the row of
each record, and the table. The executor of the first part is simulated: it returns the row of each task at
once, so that only the work of the process that calls `gpi.batch` is measured. The second part runs on a Dask
cluster of two processes on this machine. Its figure contains the time in which the two workers refuse the
records, so that the cost of the scheduler alone is smaller.
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


def told(label: str, number: int, seconds: float) -> float:
    """Print a time; return the tasks for each second."""
    print(f"{label}: {number} tasks in {seconds:.1f} s, {1e3 * seconds / number:.2f} ms each", flush=True)
    return number / seconds


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
        told("simulated executor", len(table), time.monotonic() - began)
        with (
            LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster,
            Client(cluster) as client,
        ):
            began = time.monotonic()
            table = gpi.batch(records[: given.dask_tasks], out=folder / "dask", executor=client)
            rate = told("Dask, two workers", len(table), time.monotonic() - began)
            if sorted(table["name"]) != sorted(file.stem for file in records[: given.dask_tasks]):
                print("error: not one row for each record", file=sys.stderr)
                return 1
    for seconds in SECONDS:
        asked = WORKERS / seconds
        print(
            f"{WORKERS} workers, records of {seconds:g} s: {asked:.0f} tasks a second, "
            f"{100 * asked / rate:.0f} % of what two workers refuse here; "
            f"{given.tasks} records take {given.tasks / min(asked, rate) / 60:.0f} min"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())

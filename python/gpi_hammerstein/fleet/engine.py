"""Work on many records by an executor of `concurrent.futures`.

Each record is one task, and the tasks do not depend on each other. A process that dies (memory, a crash of a
library) takes its pool with it. The records that were then in work are tried again one by one, each in a
process of its own, so that only the one that is to blame is given up.
"""

import multiprocessing
import os
import signal
from collections import deque
from collections.abc import Generator, Iterable
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor
from dataclasses import dataclass
from queue import SimpleQueue
from typing import Any

from gpi_hammerstein._native import ParameterError
from gpi_hammerstein.fleet import row
from gpi_hammerstein.fleet.work import Task, work

# Tasks that wait in the executor for each worker: none is idle, and a broken pool has few to try again.
AHEAD = 2
# How often a record is tried alone, until it is given up.
ATTEMPTS = 2
# Tasks in an executor that somebody else made, whose number of workers is not known: enough for thousands.
# What waits in a scheduler costs it memory, some kilobytes for each task.
WINDOW = 10_000
GIB = 1 << 30

Row = dict[str, Any]
Done = tuple[Task, Row]


@dataclass(frozen=True)
class Processes:
    """Worker processes on this machine.

    Attributes
    ----------
    workers
        Their number.
    threads
        Threads of each of them.
    memory
        The address space that each may take, in GiB; None for no limit. Not on Windows.
    """

    workers: int
    threads: int = 1
    memory: float | None = None

    def open(self, workers: int | None = None) -> ProcessPoolExecutor:
        """Return a new pool.

        Parameters
        ----------
        workers
            Another number of processes.

        Returns
        -------
        concurrent.futures.ProcessPoolExecutor
            A pool of fresh interpreters.
        """
        # a fork would inherit locks of threads that do not exist in the child
        context = multiprocessing.get_context("spawn")
        arguments = (self.threads, self.memory)
        return ProcessPoolExecutor(workers or self.workers, context, _prepare, arguments)


def _prepare(threads: int, memory: float | None) -> None:
    """Prepare a worker: its parent handles Ctrl-C, and stops it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.environ["RAYON_NUM_THREADS"] = str(threads)
    if memory is not None:
        try:
            import resource
        except ImportError:  # Windows
            return
        limit = round(memory * GIB)
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))


def in_processes(tasks: Iterable[Task], processes: Processes) -> Generator[Done, None, None]:
    """Yield each task with its row, as they are finished.

    Parameters
    ----------
    tasks
        What is to be done.
    processes
        The workers.

    Yields
    ------
    tuple of Task and dict
        In the order in which they are finished.

    Raises
    ------
    ParameterError
        No process can start.
    """
    waiting = deque(tasks)
    has_started = False
    while waiting:
        with _stopped(processes.open()) as pool:
            if not has_started:
                _require_start(pool)
                has_started = True
            suspects = yield from _until_broken(waiting, pool, AHEAD * processes.workers)
        for task in suspects:
            yield task, _alone(task, processes)


def with_executor(tasks: Iterable[Task], executor: Executor) -> Generator[Done, None, None]:
    """Yield each task with its row, from an executor that belongs to somebody else.

    Parameters
    ----------
    tasks
        What is to be done.
    executor
        Any executor with the interface of `concurrent.futures`. It has to repeat by itself what a lost
        worker did not finish.

    Yields
    ------
    tuple of Task and dict
        In the order in which they are finished.

    Raises
    ------
    concurrent.futures.BrokenExecutor
        The executor cannot work any more.
    """
    waiting = deque(tasks)
    if (yield from _until_broken(waiting, executor, WINDOW)):
        raise BrokenExecutor("the executor cannot work any more; start the batch again to continue it")


def _require_start(pool: Executor) -> None:
    """Refuse to work if not even an empty task can be done."""
    try:
        pool.submit(int).result()
    except BrokenExecutor:
        raise ParameterError(
            "`workers`: no process can start. A script that calls gpi.batch must do this below "
            '`if __name__ == "__main__":`, because every process imports the script; and `memory` must leave '
            "room for Python itself"
        ) from None


def _until_broken(waiting: deque[Task], pool: Executor, most: int) -> Generator[Done, None, list[Task]]:
    """Yield tasks and rows; return the tasks that were in work when the pool broke."""
    running: dict[Future[Row], Task] = {}
    finished: SimpleQueue[Future[Row]] = SimpleQueue()
    lost: list[Task] = []
    while (waiting and not lost) or running:
        try:
            while waiting and not lost and len(running) < most:
                future = pool.submit(work, waiting[0])
                running[future] = waiting.popleft()
                # a call of `wait` would look at every running task for each one that ends
                future.add_done_callback(finished.put)
        except BrokenExecutor:
            lost.extend(running.values())
            return lost or [waiting.popleft()]
        future = finished.get()
        task = running.pop(future)
        try:
            yield task, future.result()
        except BrokenExecutor:
            lost.append(task)
        except Exception as error:  # noqa: BLE001  one record must not end the batch
            yield task, _failed(task, f"{type(error).__name__}: {error}")
    return lost


def _alone(task: Task, processes: Processes) -> Row:
    """Work on a task in a process of its own."""
    for _ in range(ATTEMPTS):
        with _stopped(processes.open(workers=1)) as pool:
            try:
                return pool.submit(work, task).result()
            except BrokenExecutor:
                continue
            except Exception as error:  # noqa: BLE001  one record must not end the batch
                return _failed(task, f"{type(error).__name__}: {error}")
    return _failed(
        task,
        f"the process that worked on this record died {ATTEMPTS} times; it may need more memory than it may "
        "take (--memory), or a library crashed. `gpi explain` with this record alone shows more",
    )


def _failed(task: Task, error: str) -> Row:
    """Return the row of a failure of the machine, which is not kept: the next run tries again."""
    return row.of_failure(task.job, task.folder.name, task.key, error, 0.0)


class _stopped:  # noqa: N801  a context manager, used as a function
    """A pool whose processes end with the block, also if they are in the middle of their work."""

    def __init__(self, pool: ProcessPoolExecutor) -> None:
        self.before = set(multiprocessing.active_children())
        self.pool = pool

    def __enter__(self) -> ProcessPoolExecutor:
        return self.pool

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is not None:
            for process in set(multiprocessing.active_children()) - self.before:
                process.terminate()
        # waiting also ends the pool's own thread, which else may write to a closed pipe at exit
        self.pool.shutdown(cancel_futures=True)

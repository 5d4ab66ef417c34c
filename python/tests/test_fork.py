"""Work in a process that was forked after its parent had used the package's threads."""

import multiprocessing
import subprocess
import sys
from pathlib import Path

import pytest

PROGRAM = """
import multiprocessing
import numpy as np
import gpi_hammerstein as gpi
from records import RATE, actuator, drive

u = drive()
record = gpi.Record(u, actuator(u), RATE)
bank, long = gpi.PlayBank([0.1, 0.4], [1.0, 1.0]), np.sin(np.arange(300_000) * 0.01)
work = {{
    "explain": lambda: gpi.explain(record).verdict,
    "rivals": lambda: len(gpi.rivals(record)),
    "identify": lambda: gpi.identify(record).linear.order,
    "threads": lambda: float(bank(long, threads=2).sum()),
}}
before = {{name: own() for name, own in work.items()}}

def again(name):
    return work[name]() == before[name]

pool = multiprocessing.get_context("fork").Pool(2)
print(pool.map_async(again, list(work)).get(timeout={timeout}))
pool.terminate()
"""


@pytest.mark.skipif(
    "fork" not in multiprocessing.get_all_start_methods(), reason="this system cannot fork a process"
)
def test_forked_processes_have_threads_of_their_own() -> None:
    program = PROGRAM.format(timeout=100)
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=Path(__file__).parent,
        capture_output=True,
        text=True,
        timeout=150,
        check=False,
    )
    assert done.stdout.strip() == "[True, True, True, True]", done.stderr

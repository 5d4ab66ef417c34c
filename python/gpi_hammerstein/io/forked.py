"""Detection of a forked process in which Polars would wait for ever.

Polars works on threads that exist only in the process that has started them. After `fork`, the child has the
pool but not its threads, and waits for them.
"""

import os

from gpi_hammerstein._native import ParameterError

_state = {"used": False, "broken": False}


def require_threads() -> None:
    """Note that Polars is used in this process, and refuse it in a child that was forked after it was used.

    Raises
    ------
    ParameterError
        This process was forked after the parent had used Polars.
    """
    if _state["broken"]:
        raise ParameterError(
            "`start_method` = fork: this process was forked after its parent had read a record, and has no "
            'threads for Polars; use multiprocessing.get_context("spawn"), or read the record in the parent'
        )
    _state["used"] = True


def _after_fork() -> None:
    _state["broken"] = _state["used"]


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)

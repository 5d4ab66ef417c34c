"""Many records at once: one row a record in a Parquet file, and the results of each record in its folder.

The way of a record: :mod:`.jobs` finds it, :mod:`.run` looks whether its result exists, :mod:`.engine` gives
it to a worker, :mod:`.work` explains it there and writes its folder, and :mod:`.row` is what the table says
of it.

The way of a table: :mod:`.reading` reads it, :mod:`.devices` finds the devices, and :mod:`.figures` are the
numbers of each record. :mod:`.distances` compares them (with :mod:`.robust` and :mod:`.scatter`),
:mod:`.rare` compares effects and verdicts, :mod:`.unusual` says which devices stand out and why, and
:mod:`.trends` tests whether figures change with the date.
"""

from gpi_hammerstein.fleet.run import batch

__all__ = ["batch"]

"""Many records at once: one row a record in a Parquet file, and the results of each record in its folder.

The way of a record: :mod:`.jobs` finds it, :mod:`.run` looks whether its result exists, :mod:`.engine` gives
it to a worker, :mod:`.work` explains it there and writes its folder, and :mod:`.row` is what the table says
of it.
"""

from gpi_hammerstein.fleet.run import batch

__all__ = ["batch"]

"""Tables as bytes, which two processes exchange.

An answer is one line of JSON, and behind it the columns of all tables, as float64::

    {"error": "DataError", "message": ".."}  or  {"tables": [{"rows": 100, "columns": [..], ..}, ..]}
"""

import json
from dataclasses import asdict
from typing import IO, Any

import numpy as np

from gpi_hammerstein._native import DataError, GpiError, ParameterError
from gpi_hammerstein.io.columns import Column
from gpi_hammerstein.io.tables import Table

PLAIN = ("source", "rate", "warmup", "notes", "left_out")
"""The fields of a table that JSON can represent."""


def send(stream: IO[bytes], answer: list[Table] | GpiError) -> None:
    """Write tables, or an error.

    Parameters
    ----------
    stream
        The pipe to the other process.
    answer
        The tables, or the error that was raised instead.

    Examples
    --------
    >>> import io
    >>> stream = io.BytesIO()
    >>> send(stream, [Table("demo", {}, {}, 100.0)])
    >>> receive(io.BytesIO(stream.getvalue()))[0].rate
    100.0
    """
    if isinstance(answer, GpiError):
        kind = "ParameterError" if isinstance(answer, ParameterError) else "DataError"
        stream.write(json.dumps({"error": kind, "message": str(answer)}).encode() + b"\n")
        stream.flush()
        return
    tables = [
        {name: getattr(table, name) for name in PLAIN}
        | {
            "columns": [[asdict(column), len(samples)] for column, samples in table.columns.items()],
            "text": [[asdict(column), text] for column, text in table.text.items()],
        }
        for table in answer
    ]
    stream.write(json.dumps({"tables": tables}).encode() + b"\n")
    for table in answer:
        for samples in table.columns.values():
            stream.write(np.ascontiguousarray(samples).data)
    stream.flush()


def receive(stream: IO[bytes]) -> list[Table]:
    """Read what :func:`send` has written.

    Parameters
    ----------
    stream
        The pipe from the other process.

    Returns
    -------
    list of Table
        The tables.

    Raises
    ------
    DataError, ParameterError
        The error that was sent.
    EOFError
        The other process ended before the answer was complete.

    Examples
    --------
    >>> receive(process.stdout)  # doctest: +SKIP
    """
    line = stream.readline()
    if not line.endswith(b"\n"):
        raise EOFError("no answer")
    answer: dict[str, Any] = json.loads(line)
    if "error" in answer:
        raise {"DataError": DataError, "ParameterError": ParameterError}[answer["error"]](answer["message"])
    return [
        Table(
            columns={Column(**column): _samples(stream, rows) for column, rows in table.pop("columns")},
            text={Column(**column): text for column, text in table.pop("text")},
            **table,
        )
        for table in answer["tables"]
    ]


def _samples(stream: IO[bytes], rows: int) -> Any:
    samples = np.empty(rows)
    view, place = samples.view(np.uint8).data, 0
    while place < len(view):
        count = stream.readinto(view[place:])  # type: ignore[attr-defined]
        if not count:
            raise EOFError("the answer is incomplete")
        place += count
    return samples

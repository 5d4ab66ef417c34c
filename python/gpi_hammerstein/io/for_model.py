"""Reading of a record whose columns have the names of the channels of a model."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from gpi_hammerstein._native import DataError, Model
from gpi_hammerstein.io.read import read_recording
from gpi_hammerstein.io.recording import Recording

Names = list[str] | None


def read_for_model(
    model: Model | None, records: Sequence[Path], *, input: Names, output: Names, **options: Any
) -> Recording:
    """Read a record. Columns with the names of the channels of a model are taken as these channels.

    Parameters
    ----------
    model
        The model; None reads like :func:`~gpi_hammerstein.io.read.read_recording`.
    records
        The files.
    input, output
        Names of columns, which have precedence over those of the model.
    options
        As in :func:`~gpi_hammerstein.io.read.read_recording`.

    Returns
    -------
    Recording
        The experiments.

    Raises
    ------
    ParameterError, DataError
        As in :func:`~gpi_hammerstein.io.read.read_record`.

    Examples
    --------
    >>> read_for_model(model, [Path("other.csv")], input=None, output=None)  # doctest: +SKIP
    """
    for own_inputs, own_outputs in named_by(model, records, input, output):
        try:
            return read_recording(list(records), input=own_inputs, output=own_outputs, **options)
        except DataError as error:
            # the file has other names than the model: the usual ones are tried next
            is_last = (own_inputs, own_outputs) == (input, output)
            if is_last or "no column `" not in str(error):
                raise
    raise AssertionError("the last names are those of the options")


def named_by(
    model: Model | None, records: Sequence[Path], inputs: Names, outputs: Names
) -> Iterator[tuple[Names, Names]]:
    """Yield the names of inputs and outputs to look for: those of the model first."""
    # the outputs of a .npy file are other files
    if model is not None and not any(file.suffix == ".npy" for file in records):
        own_inputs = model.input_names if inputs is None else inputs
        own_outputs = model.output_names if outputs is None else outputs
        for pair in ((own_inputs, own_outputs), (own_inputs, outputs), (inputs, own_outputs)):
            if pair != (inputs, outputs):
                yield pair
    yield inputs, outputs

"""Export as a MAT file, with a script that simulates it."""

import io
import os
from importlib.resources import files as resources
from pathlib import Path
from typing import Any

import numpy as np
import scipy.io
from numpy.typing import NDArray

from gpi_hammerstein._native import Model, ParameterError, __version__
from gpi_hammerstein.export.chain import Chain, LoopStep, chain_of
from gpi_hammerstein.export.operations import Operation
from gpi_hammerstein.export.templates import digest
from gpi_hammerstein.files import require_file, write_atomically

#: The script that simulates the model. It is written to the folder of the MAT file.
SCRIPT = "simulate_gpi.m"


def export_mat(model: Model, file: str | os.PathLike[str]) -> None:
    """Write the parameters of a model for MATLAB and GNU Octave, and a script that simulates it.

    The file has the structure ``gpi`` with the fields ``rate`` (Hz), ``inputs``, ``input_units``,
    ``outputs``, ``output_units``, ``covariates`` (the columns that effects read), ``hysteresis`` (a cell for
    each input, with ``thresholds``, ``deadzone_weights``, ``reading``, ``half_widths`` and ``weights``), the
    matrices ``A``, ``B``, ``C``, ``D`` of the dynamics, ``steady`` (their states for a constant v of 1),
    ``offsets``, ``operations`` (a cell for each thing that an effect does to a sample) and ``steps`` (a cell
    for each loop in each step between two samples, where there are several). The script
    ``simulate_gpi.m`` is written next to it: ``y = simulate_gpi('model.mat', u)`` has the samples of
    :meth:`Model.simulate`.

    Parameters
    ----------
    model
        The model.
    file
        The file, for example ``model.mat``. A file ``simulate_gpi.m`` in its folder is replaced.

    Raises
    ------
    ParameterError
        The name does not end with ``.mat``, an effect cannot be exported, or a file cannot be written.

    Examples
    --------
    >>> gpi.export_mat(model, "model.mat")  # doctest: +SKIP
    """
    path = Path(file)
    if path.suffix != ".mat":
        raise ParameterError(f"`mat` = {path}: the name must end with .mat, as {path.stem or 'model'}.mat")
    content = written(model, chain_of(model))
    script = resources("gpi_hammerstein.export").joinpath("templates", SCRIPT).read_text(encoding="utf-8")
    require_file(path, "mat")
    write_atomically(path.parent / SCRIPT, script)
    write_atomically(path, content)


def written(model: Model, chain: Chain) -> bytes:
    """Return the MAT file."""
    states = chain.states
    system = chain.system
    structure: dict[str, Any] = {
        "model_sha256": digest(model),
        "rate": float(chain.rate),
        "inputs": cells([own.name for own in chain.inputs]),
        "input_units": cells([own.unit for own in chain.inputs]),
        "outputs": cells([own.name for own in chain.outputs]),
        "output_units": cells([own.unit for own in chain.outputs]),
        "covariates": cells([own.name for own in chain.covariates]),
        "hysteresis": cells(
            [
                {
                    "thresholds": own.thresholds,
                    "deadzone_weights": own.slopes,
                    "reading": "directional" if own.directional else "one-sided",
                    "half_widths": own.half_widths,
                    "weights": own.weights,
                }
                for own in chain.hysteresis
            ]
        ),
        "A": system[:states, :states],
        "B": system[:states, states:],
        "C": system[states:, :states],
        "D": system[states:, states:],
        "steady": chain.steady,
        "offsets": chain.offsets,
        "operations": cells([_fields(own) for own in chain.operations]),
        "steps": cells([_step(own) for own in chain.steps]),
    }
    stream = io.BytesIO()
    scipy.io.savemat(stream, {"gpi": structure}, long_field_names=True)
    # the text before the version contains the date; with another one, the same model gives the same file
    text = f"MATLAB 5.0 MAT-file, gpi-hammerstein {__version__}".encode().ljust(116)
    return text + stream.getvalue()[116:]


def _fields(operation: Operation) -> dict[str, Any]:
    """Return an operation as a structure; numbers of channels and columns begin with 1."""
    fields: dict[str, Any] = {
        "kind": operation.kind,
        "place": operation.place,
        "channel": float(operation.channel + 1),
        "late": float(operation.late),
        "memory": float(operation.memory),
    }
    fields |= {name: float(value) for name, value in operation.numbers.items() if name != "turns_rest"}
    fields |= operation.arrays
    optional = {"seen": operation.seen, "drives": operation.drives}
    fields |= {name: values for name, values in optional.items() if values is not None}
    if operation.column is not None:
        fields["column"] = float(operation.column + 1)
    return fields


def _step(step: LoopStep) -> dict[str, Any]:
    """Return one loop in one step as a structure; the number of the loop begins with 1."""
    return {
        "loop": float(step.loop + 1),
        "seen": step.seen,
        "ahead": step.ahead,
        "earlier": step.earlier,
        "drives": step.drives,
    }


def cells(values: list[Any]) -> NDArray[np.object_]:
    """Return a row of cells."""
    row = np.empty((1, len(values)), dtype=object)
    for place, value in enumerate(values):
        row[0, place] = value
    return row

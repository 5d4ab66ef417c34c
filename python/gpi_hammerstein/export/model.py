"""Export of the forward model, with its effects, as source code."""

import os

from gpi_hammerstein._native import Model
from gpi_hammerstein.export.language_c import model_in_c
from gpi_hammerstein.export.language_rust import model_in_rust
from gpi_hammerstein.export.numerals import Precision
from gpi_hammerstein.export.templates import require_identifier
from gpi_hammerstein.files import staged, write_atomically


def export_model_c(
    model: Model,
    folder: str | os.PathLike[str],
    *,
    precision: Precision = "single",
    name: str = "gpi_model",
) -> None:
    """Write the model with its effects in C99: ``NAME.h`` and ``NAME.c``.

    The functions simulate the model sample by sample, as :meth:`Model.simulate` does:
    :math:`y = H(G P[D[I(u)]] + d) + e + y_0` with the input stage I, the envelope D, the plays P, the linear
    dynamics G with what acts in parallel or in loops around them, the output stage H, the signals d and e
    that are added before and after it, and the offset :math:`y_0`. ``NAME_start`` sets the steady state at
    the first input. ``NAME_step`` computes one sample.

    Parameters
    ----------
    model
        A model with any number of inputs and outputs. Its units are those of the functions.
    folder
        The folder of the two files. It is created if it does not exist.
    precision
        ``"single"`` for `float`, ``"double"`` for `double`. In double precision, the output is that of
        :meth:`Model.simulate` up to rounding.
    name
        Prefix of the names of files, types and functions. It allows several models in one program.

    Raises
    ------
    ParameterError
        An effect cannot be exported, the precision is too low for a parameter, the name is not a valid C
        identifier, or the folder cannot be written.

    Examples
    --------
    >>> import os, tempfile
    >>> u = gpi.multisine(2000, 1000.0, (0.5, 400.0), (0.0, 10.0))
    >>> record = gpi.Record(u, gpi.PlayBank([0.0, 2.0], [1.0, 0.5])(u), 1000.0)
    >>> model = gpi.identify(record, delay=0, half_widths=[0.0, 2.0], thresholds=0)
    >>> folder = tempfile.mkdtemp()
    >>> gpi.export_model_c(model, folder, precision="double")
    >>> sorted(os.listdir(folder))
    ['gpi_model.c', 'gpi_model.h']
    """
    require_identifier(name)
    texts = model_in_c(model, precision, name)
    with staged(folder) as place:
        for file, text in texts.items():
            (place / file).write_text(text, encoding="utf-8")


def export_model_rust(model: Model, file: str | os.PathLike[str], *, precision: Precision = "single") -> None:
    """Write the model with its effects in Rust: one module without dependencies, with and without `std`.

    Its type ``Model`` computes what the functions of :func:`export_model_c` do.

    Parameters
    ----------
    model
        A model with any number of inputs and outputs.
    file
        The file, for example ``src/model.rs``.
    precision
        ``"single"`` for `f32`, ``"double"`` for `f64`.

    Raises
    ------
    ParameterError
        An effect cannot be exported, the precision is too low for a parameter, or the file cannot be written.

    Examples
    --------
    >>> gpi.export_model_rust(model, "src/model.rs", precision="double")  # doctest: +SKIP
    """
    write_atomically(file, model_in_rust(model, precision))

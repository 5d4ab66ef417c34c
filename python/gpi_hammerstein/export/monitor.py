"""Export of a monitor as source code for microcontrollers."""

import os

from gpi_hammerstein._native import DataError, Model, Monitor
from gpi_hammerstein.escaping import in_c
from gpi_hammerstein.export.calls import used_parts
from gpi_hammerstein.export.chain import chain_of
from gpi_hammerstein.export.described import channels_said, without_gaps
from gpi_hammerstein.export.language_c import model_in_c
from gpi_hammerstein.export.numerals import Precision, numerals_of_c
from gpi_hammerstein.export.templates import filled, in_unit, maker, origin, require_identifier
from gpi_hammerstein.files import staged

# Windows of 2^24 blocks: half a year in blocks of one second.
LEVELS = 24


def export_monitor_c(
    model: Model,
    folder: str | os.PathLike[str],
    *,
    precision: Precision = "single",
    name: str = "gpi_monitor",
    noise: list[float] | None = None,
    false_alarms_per_hour: float = 1e-4,
) -> None:
    """Write a monitor in C99: ``NAME.h`` and ``NAME.c``, and the model, which it simulates.

    ``NAME_step`` takes a sample of the input and of the measured output, and returns what has changed: the
    offset, the gain, or the noise. It makes the tests of :class:`Monitor` for these quantities with the same
    limits. The resonance and the width of the hysteresis are not tested, because they need simulations of
    their own; a change of them is noticed as far as it changes the gain or the noise.

    The machine must be in a steady state when the monitor starts. Otherwise, start the monitor when the drive
    has swept its range. The uncertainty of the parameters, and effects that are
    functions of time, do not count as known errors.

    Parameters
    ----------
    model
        A model with one output.
    folder
        The folder of the files. It is created if it does not exist.
    precision
        ``"single"`` for `float`, ``"double"`` for `double`.
    name
        Prefix of the names of files, types and functions. Those of the model begin with ``NAME_model``.
    noise
        Standard deviation of the noise, in the output's unit, as for :class:`Monitor`.
    false_alarms_per_hour
        The rate of false alarms: the count per hour of data.

    Raises
    ------
    ParameterError
        As for :class:`Monitor` and :func:`export_model_c`.
    DataError
        The model has several outputs.

    Examples
    --------
    >>> import os, tempfile
    >>> u = gpi.multisine(2000, 1000.0, (0.5, 400.0), (0.0, 10.0))
    >>> noise = 0.01 * np.random.default_rng(0).normal(size=2000)
    >>> record = gpi.Record(u, gpi.PlayBank([0.0, 2.0], [1.0, 0.5])(u) + noise, 1000.0)
    >>> model = gpi.identify(record, delay=0, half_widths=[0.0, 2.0], thresholds=0)
    >>> folder = tempfile.mkdtemp()
    >>> gpi.export_monitor_c(model, folder)
    >>> sorted(os.listdir(folder))
    ['gpi_monitor.c', 'gpi_monitor.h', 'gpi_monitor_model.c', 'gpi_monitor_model.h']
    """
    require_identifier(name)
    if len(model.output_names) != 1:
        raise DataError(f"the model has {len(model.output_names)} outputs, but a monitor in C has one")
    monitor = Monitor(model, noise=noise, false_alarms_per_hour=false_alarms_per_hour)
    limits, simulated, own = monitor.limits, monitor.model, f"{name}_model"
    texts = model_in_c(simulated, precision, own)
    numerals, chain = numerals_of_c(precision), chain_of(simulated)
    output, unit = in_c(model.output_names[0]), in_c(model.output_units[0])
    facts = [
        *origin(model),
        f"Output: {output}{in_unit(unit)}.",
        f"False alarms: at most {false_alarms_per_hour:g} an hour, for Gaussian white noise.",
        "Not tested: the resonance and the width of the hysteresis.",
        maker(),
    ]
    values = {
        "name": name,
        "NAME": name.upper(),
        "model": own,
        "levels": str(LEVELS),
        "block": str(limits["block"]),
        "noise": repr(limits["noise"][0]),
        "deviations": repr(limits["deviations"]),
        "least_noise": repr(limits["least_noise"]),
        "misfit": repr(limits["misfit"][0]),
        "hidden": repr(limits["hidden"][0]),
        "model_offset": numerals.written(float(model.offsets[0])),
        "largest": numerals.largest,
        "output_unit": in_unit(unit),
        "title": f"Monitor: whether the machine behind {output} has changed since its model was made",
        "facts": "\n".join(f" * {fact}".rstrip() for fact in facts),
    } | channels_said(chain, in_c)
    used = used_parts(chain)
    for ending in ("h", "c"):
        texts[f"{name}.{ending}"] = without_gaps(filled(f"monitor.{ending}", values, used))
    with staged(folder) as place:
        for file, text in texts.items():
            (place / file).write_text(text, encoding="utf-8")

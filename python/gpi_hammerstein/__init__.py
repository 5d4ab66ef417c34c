"""Identify piezo and other smart-material actuators from measured data.

The model, in the order the signal flows::

    u -> z = sum_j g_j Z_eta_j[u] -> v = sum_i p_i F_r_i[z] -> y = G(q) v + offset
         deadzones (envelope)        plays (hysteresis)       linear dynamics

u has the shape (samples, inputs) and y has the shape (samples, outputs). Only these two signals are measured.

>>> import gpi_hammerstein as gpi  # doctest: +SKIP
>>> record = gpi.read_record("run.csv")  # doctest: +SKIP
>>> model = gpi.identify(record)  # doctest: +SKIP
>>> print(model.summary())  # doctest: +SKIP
>>> y = model.simulate(record.u[0])  # doctest: +SKIP

`gpi_hammerstein.plot` draws records, models and results. It is loaded when it is first used.
"""

from typing import TYPE_CHECKING as _CHECKED
from typing import Any as _Any

from gpi_hammerstein._native import (
    Compensation,
    Compensator,
    DataError,
    Deadzones,
    Explanation,
    Fir,
    FirStatistic,
    Gpi,
    GpiError,
    HysteresisFit,
    Identification,
    IntermediateSignal,
    InverseGpi,
    Model,
    NoncausalFir,
    NumericalError,
    ParameterError,
    PlayBank,
    Progress,
    Record,
    Refinement,
    StateSpace,
    __version__,
    decaying_triangle,
    effect_names,
    era,
    explain,
    fir,
    fit_hysteresis,
    held_steps,
    identify,
    multisine,
    prbs,
    refine,
    residual_tests,
    rivals,
    sensitivities,
)
from gpi_hammerstein.compared import Comparison
from gpi_hammerstein.export import (
    export_c,
    export_fmu,
    export_mat,
    export_model_c,
    export_model_rust,
    export_rust,
)
from gpi_hammerstein.files import load_model as load
from gpi_hammerstein.files import save_model as save
from gpi_hammerstein.inspection import Inspection, inspect
from gpi_hammerstein.io import read_record
from gpi_hammerstein.pickling import register
from gpi_hammerstein.summary import Parameter, Summary

if _CHECKED:
    from gpi_hammerstein import datasets, interop, plot
    from gpi_hammerstein.fleet import batch

__all__ = [
    "Comparison",
    "Compensation",
    "Compensator",
    "DataError",
    "Deadzones",
    "Explanation",
    "Fir",
    "FirStatistic",
    "Gpi",
    "GpiError",
    "HysteresisFit",
    "Identification",
    "Inspection",
    "IntermediateSignal",
    "InverseGpi",
    "Model",
    "NoncausalFir",
    "NumericalError",
    "Parameter",
    "ParameterError",
    "PlayBank",
    "Progress",
    "Record",
    "Refinement",
    "StateSpace",
    "Summary",
    "__version__",
    "batch",
    "datasets",
    "decaying_triangle",
    "effect_names",
    "era",
    "explain",
    "export_c",
    "export_fmu",
    "export_mat",
    "export_model_c",
    "export_model_rust",
    "export_rust",
    "fir",
    "fit_hysteresis",
    "held_steps",
    "identify",
    "inspect",
    "interop",
    "load",
    "multisine",
    "plot",
    "prbs",
    "read_record",
    "refine",
    "residual_tests",
    "rivals",
    "save",
    "sensitivities",
]

register()


def __getattr__(name: str) -> _Any:
    """Load `plot` (and with it Matplotlib), `interop`, `datasets` and `batch` when they are first used."""
    import importlib

    if name in ("plot", "interop", "datasets"):
        return importlib.import_module(f"gpi_hammerstein.{name}")
    if name == "batch":
        return importlib.import_module("gpi_hammerstein.fleet").batch
    raise AttributeError(f"module `gpi_hammerstein` has no attribute `{name}`")


def __dir__() -> list[str]:
    """Return the public names; those that `__getattr__` loads are among them before they are loaded."""
    return sorted(__all__)

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
    Monitor,
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
    export_monitor_c,
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
    from gpi_hammerstein.difference import (
        Difference,
        EffectFrequency,
        FigureDifference,
        FleetDifferences,
        ModelDifferences,
        SimulatedDifference,
        compare,
        compare_fleets,
    )
    from gpi_hammerstein.fleet import batch
    from gpi_hammerstein.fleet.trends import fleet_trends
    from gpi_hammerstein.fleet.unusual import unusual_devices
    from gpi_hammerstein.report.fleet import fleet_report

__all__ = [
    "Comparison",
    "Compensation",
    "Compensator",
    "DataError",
    "Deadzones",
    "Difference",
    "EffectFrequency",
    "Explanation",
    "FigureDifference",
    "Fir",
    "FirStatistic",
    "FleetDifferences",
    "Gpi",
    "GpiError",
    "HysteresisFit",
    "Identification",
    "Inspection",
    "IntermediateSignal",
    "InverseGpi",
    "Model",
    "ModelDifferences",
    "Monitor",
    "NoncausalFir",
    "NumericalError",
    "Parameter",
    "ParameterError",
    "PlayBank",
    "Progress",
    "Record",
    "Refinement",
    "SimulatedDifference",
    "StateSpace",
    "Summary",
    "__version__",
    "batch",
    "compare",
    "compare_fleets",
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
    "export_monitor_c",
    "export_rust",
    "fir",
    "fit_hysteresis",
    "fleet_report",
    "fleet_trends",
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
    "unusual_devices",
]

register()

_OF_DIFFERENCE = (
    *("Difference", "EffectFrequency", "FigureDifference", "FleetDifferences"),
    *("ModelDifferences", "SimulatedDifference", "compare", "compare_fleets"),
)
_OF_FLEET = {
    "batch": "fleet",
    "fleet_report": "report.fleet",
    "fleet_trends": "fleet.trends",
    "unusual_devices": "fleet.unusual",
}


def __getattr__(name: str) -> _Any:
    """Load modules and functions of which few programs need all, such as `plot`, at their first use."""
    import importlib

    if name in ("plot", "interop", "datasets"):
        return importlib.import_module(f"gpi_hammerstein.{name}")
    if name in _OF_DIFFERENCE:
        return getattr(importlib.import_module("gpi_hammerstein.difference"), name)
    if name in _OF_FLEET:
        return getattr(importlib.import_module(f"gpi_hammerstein.{_OF_FLEET[name]}"), name)
    raise AttributeError(f"module `gpi_hammerstein` has no attribute `{name}`")


def __dir__() -> list[str]:
    """Return the public names; those that `__getattr__` loads are among them before they are loaded."""
    return sorted(__all__)

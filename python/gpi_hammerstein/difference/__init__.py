"""Whether two models, or two populations of stages, differ beyond their uncertainty.

Two models: :mod:`.two_models` leads, :mod:`.neighbours` gives what follows from a model its standard
deviation, :mod:`.figures`, :mod:`.effects` and :mod:`.structure` make the rows, :mod:`.simulation` compares
the outputs, and :mod:`.models` is the result. Two tables of `gpi batch`: :mod:`.tables` reads them,
:mod:`.two_fleets` compares them, and :mod:`.populations` is the result. :mod:`.significance` decides in both
cases.
"""

from gpi_hammerstein.difference.models import ModelDifferences
from gpi_hammerstein.difference.populations import EffectFrequency, FigureDifference, FleetDifferences
from gpi_hammerstein.difference.row import Difference
from gpi_hammerstein.difference.simulation import SimulatedDifference
from gpi_hammerstein.difference.two_fleets import compare_fleets
from gpi_hammerstein.difference.two_models import compare

__all__ = [
    "Difference",
    "EffectFrequency",
    "FigureDifference",
    "FleetDifferences",
    "ModelDifferences",
    "SimulatedDifference",
    "compare",
    "compare_fleets",
]

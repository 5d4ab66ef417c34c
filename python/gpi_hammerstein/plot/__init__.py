"""Pictures of records, models and results, on Matplotlib axes.

Every function draws on the given axes and returns them. Without axes, it creates a figure with
`matplotlib.pyplot.subplots`; the caller shows, saves or closes this figure. Bands extend 1.96 standard
deviations to each side; they are 95 % bands if the errors have a normal distribution.
"""

from gpi_hammerstein.plot.compensation import compensation
from gpi_hammerstein.plot.explanation import loops
from gpi_hammerstein.plot.linear import bode, markov, response, singular_values
from gpi_hammerstein.plot.recorded import record
from gpi_hammerstein.plot.residuals import (
    Residuals,
    residual_autocorrelation,
    residual_in_time,
    residual_spectrum,
)
from gpi_hammerstein.plot.residuals_over_input import residual_over_input, residual_over_speed
from gpi_hammerstein.plot.search import candidates, history
from gpi_hammerstein.plot.signals import fit, loop, residual

__all__ = [
    "Residuals",
    "bode",
    "candidates",
    "compensation",
    "fit",
    "history",
    "loop",
    "loops",
    "markov",
    "record",
    "residual",
    "residual_autocorrelation",
    "residual_in_time",
    "residual_over_input",
    "residual_over_speed",
    "residual_spectrum",
    "response",
    "singular_values",
]

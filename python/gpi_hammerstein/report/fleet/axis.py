"""The axis on which the distributions and the trends of a figure are drawn."""

from dataclasses import dataclass

import numpy as np

from gpi_hammerstein.fleet.figures import Scaled
from gpi_hammerstein.fleet.robust import Array

WIDTH, HEIGHT = 320.0, 150.0
"""Size of a picture in its own units."""
LEFT, RIGHT = 10.0, 310.0
BEYOND = 6.0
"""Values farther from the median than this many times the middle half of the values are drawn at the end of
the axis, so that a single value cannot hide all others."""


@dataclass(frozen=True)
class Axis:
    """The range of a figure on its scale of comparison.

    Attributes
    ----------
    low, high
        The ends, on the scale of comparison.
    clipped
        Whether there are values below the lower and above the upper end.
    """

    scaled: Scaled
    low: float
    high: float
    clipped: tuple[bool, bool]

    @classmethod
    def of(cls, own: Scaled) -> "Axis":
        """Return the axis of values of which at least one is known.

        Parameters
        ----------
        own
            The values, shape (devices,).

        Returns
        -------
        Axis
            The range of the values, as far as they are not `BEYOND`.
        """
        values = own.values[np.isfinite(own.values)]
        lower, middle, upper = (float(one) for one in np.quantile(values, [0.25, 0.5, 0.75]))
        least, most = float(values.min()), float(values.max())
        reach = BEYOND * (upper - lower) or np.inf
        low, high = max(least, middle - reach), min(most, middle + reach)
        if not high - low > 1e-12 * max(abs(low), abs(high)):
            room = 0.05 if own.logarithmic else 0.05 * abs(middle) or 1.0
            low, high = middle - room, middle + room
        return cls(own, low, high, (least < low, most > high))

    def part(self, values: Array) -> Array:
        """Return where values are between the ends, from 0 to 1."""
        return np.clip((values - self.low) / (self.high - self.low), 0.0, 1.0)

    def x(self, values: Array) -> Array:
        """Return horizontal places."""
        return LEFT + (RIGHT - LEFT) * self.part(values)

    def text(self, value: float) -> str:
        """Return a value of this scale as a number with the figure's unit left out."""
        own = self.scaled
        return f"{own.sign * np.exp(np.clip(value, -700, 700)) if own.logarithmic else value:.4g}"

    def ends(self) -> tuple[str, str]:
        """Return the ends as texts; values beyond an end are at this end."""
        low, high = self.text(self.low), self.text(self.high)
        return (f"≤ {low}" if self.clipped[0] else low), (f"≥ {high}" if self.clipped[1] else high)


def tick_labels(low: str, middle: str, high: str, y: float) -> str:
    """Return three texts below a picture; they contain only numbers."""
    places = ((LEFT, "start", low), (WIDTH / 2, "middle", middle), (RIGHT, "end", high))
    return "".join(
        f'<text x="{x:g}" y="{y:g}" text-anchor="{anchor}">{text}</text>' for x, anchor, text in places
    )

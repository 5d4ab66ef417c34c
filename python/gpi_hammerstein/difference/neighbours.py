"""Standard deviations of what follows from a model, from neighbours of the model.

A refined model contains axes d_k of the covariance ``C = sum_k d_k d_k'`` of its numbers x (`prediction` in
its file). Whatever follows from the numbers, f(x), has the variance

    var f = sum_k (df/dd_k)^2,   df/dd_k = (f(x + s d_k) - f(x - s d_k)) / (2 s),

with a small step s. The numbers are, for each input, the thresholds and weights of the deadzones and the
half-widths and weights of the plays; then A, B, C and D column by column; the offsets; and the values of the
effects that the input drives.
"""

import copy
import json
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gpi_hammerstein._native import GpiError, Model
from gpi_hammerstein.summary import START

Array = NDArray[np.float64]

# The longest step along an axis in standard deviations, and as a part of each number. Small numbers count as
# the part LEAST of the largest one. The values are those of the expected error of `compensate`.
STEP, PART, LEAST = 0.1, 1e-5, 1e-4
# What the names of the parameters of G begin with.
DYNAMICS = ("section[", "feedthrough[")


class Neighbours:
    """A model without effects that depend only on time, and its neighbours along the axes of its covariance.

    Attributes
    ----------
    model
        The model without effects that depend only on time.
    misfit, movement
        Of each output, the rms of what the structure of the model leaves of the training data, zero if it is
        not known, and the rms of its movement, in its unit.
    is_known
        Whether the model contains the covariance of its numbers.
    is_complete
        Whether the axes contain all that is uncertain: no value of an effect, because neighbours with other
        values of effects are not made, and no parameter that the data do not determine.
    is_biased
        Whether more than half of the squares of the residual on the training data is misfit.
    open_inputs, open_outputs, is_open
        Whether the data do not determine a parameter of the hysteresis of each input, the offset of each
        output, or a parameter of G. The axes do not contain such parameters.
    """

    model: Model
    misfit: Array
    movement: Array
    is_known: bool
    is_complete: bool
    is_biased: bool
    open_inputs: list[bool]
    open_outputs: list[bool]
    is_open: bool

    def __init__(self, model: Model, like: Model | None = None) -> None:
        """Take a model, with the names of the channels of another one."""
        layout: dict[str, Any] = json.loads(model.to_json())
        prediction = layout.pop("prediction", None)
        self._read_estimates(model, layout.pop("estimates", {}))
        of_time = model.functions_of_time
        layout["effects"] = [own for own in layout.get("effects", []) if own["name"] not in of_time]
        if like is not None:
            for ends, names in (("inputs", like.input_names), ("outputs", like.output_names)):
                for channel, name in zip(layout[ends], names, strict=True):
                    channel["name"] = name
        self._layout = layout
        self.model = Model.from_json(json.dumps(layout))
        self._numbers = np.concatenate([np.ravel(block) for block in _blocks(layout)])
        self._axes = np.zeros((0, len(self._numbers)))
        self.misfit, self.movement = np.zeros(len(layout["outputs"])), np.ones(len(layout["outputs"]))
        self.is_known = prediction is not None
        if prediction is not None:
            self._read_prediction(prediction)
        self.is_biased = bool(np.any(self.misfit**2 > 0.5 * self._residual**2))

    def _read_estimates(self, model: Model, estimates: Mapping[str, Any]) -> None:
        rows = [one for one in estimates.get("parameters", ()) if not one["name"].startswith(START)]
        names = [one["name"] for one in rows if one["std"] is None]
        offsets = [name for name in names if name.startswith("offset[")]
        self.open_inputs = [any(name.startswith(f"{own}.") for name in names) for own in model.input_names]
        self.open_outputs = [any(name.endswith(f".{own}") for name in offsets) for own in model.output_names]
        self.is_open = any(name.startswith(DYNAMICS) for name in names)
        self.is_complete = not names
        self._residual = np.array(estimates.get("residual_rms", np.inf))

    def _read_prediction(self, prediction: Mapping[str, Any]) -> None:
        places = np.array(prediction["numbers"], dtype=int)
        own = places < len(self._numbers)
        axes = np.array(prediction["axes"], dtype=float).reshape(-1, len(places))
        self._axes = np.zeros((len(axes), len(self._numbers)))
        self._axes[:, places[own]] = axes[:, own]
        self.is_complete = self.is_complete and bool(own.all())
        self.misfit = np.array(prediction["misfit"], dtype=float)
        self.movement = np.maximum(prediction["movement"], np.finfo(float).tiny)

    def deviation(self, follows: Callable[[Model], Array]) -> Array | None:
        """Return the standard deviations of what follows from the model.

        Parameters
        ----------
        follows
            A function of a model that returns an array, always of the same shape.

        Returns
        -------
        ndarray or None
            Shaped like the result of `follows`; None if the covariance is not known, or if neither neighbour
            along an axis is a valid model.
        """
        if not self.is_known:
            return None
        here = follows(self.model)
        variance = np.zeros_like(here)
        for axis in self._axes:
            if axis.any():
                slope = self._slope(axis, here, follows)
                if slope is None:
                    return None
                variance += slope**2
        deviation: Array = np.sqrt(variance)
        return deviation

    def _slope(self, axis: Array, here: Array, follows: Callable[[Model], Array]) -> Array | None:
        sizes = np.maximum(np.abs(self._numbers), LEAST * np.abs(self._numbers).max())
        moved = axis != 0
        step = min(STEP, PART * float(np.min(sizes[moved] / np.abs(axis[moved]))))
        ends = []
        for signed in (-step, step):
            try:
                ends.append((signed, follows(self._at(self._numbers + signed * axis))))
            except GpiError:  # a half-width below zero, for example
                continue
        if not ends:
            return None
        first, last = ends[0], ends[-1] if len(ends) > 1 else (0.0, here)
        return (last[1] - first[1]) / (last[0] - first[0])

    def _at(self, numbers: Array) -> Model:
        """Return the model with other numbers."""
        layout = copy.deepcopy(self._layout)
        used = 0
        for block in _blocks(layout):
            block[:] = numbers[used : used + len(block)].tolist()
            used += len(block)
        return Model.from_json(json.dumps(layout))


def _blocks(layout: dict[str, Any]) -> list[list[float]]:
    """Return the lists of numbers in the layout of a model file, without those of the effects."""
    of_inputs = [
        own[part][name]
        for own in layout["hysteresis"]
        for part, name in (
            ("envelope", "thresholds"),
            ("envelope", "weights"),
            ("plays", "half_widths"),
            ("plays", "weights"),
        )
    ]
    return [*of_inputs, *(layout["linear"][name][0] for name in "abcd"), layout["offsets"]]

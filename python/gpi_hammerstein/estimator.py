"""An estimator for scikit-learn, which is imported with this module and is no dependency."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.utils.validation import check_is_fitted, validate_data

from gpi_hammerstein._native import Record, identify

__all__ = ["GpiRegressor"]


class GpiRegressor(RegressorMixin, BaseEstimator):  # type: ignore[misc]
    """Hysteresis before linear dynamics as a regressor of scikit-learn.

    Rows are samples in the order of time at an even rate: what comes before a row matters, so that rows must
    not be shuffled. Split with `sklearn.model_selection.TimeSeriesSplit`, not at random.

    Parameters
    ----------
    rate
        Sampling rate in Hz.
    order, half_widths, thresholds, delay
        As in :func:`gpi_hammerstein.identify`; chosen from the data when left out.

    Attributes
    ----------
    model_
        The identified :class:`gpi_hammerstein.Model`.

    Examples
    --------
    >>> GpiRegressor(rate=1000.0).fit(u, y).predict(u)  # doctest: +SKIP
    """

    def __init__(
        self,
        rate: float = 1.0,
        *,
        order: int | None = None,
        half_widths: int | ArrayLike | None = None,
        thresholds: int | ArrayLike | None = None,
        delay: int | None = None,
    ) -> None:
        """Keep the choices."""
        self.rate = rate
        self.order = order
        self.half_widths = half_widths
        self.thresholds = thresholds
        self.delay = delay

    def fit(self, X: ArrayLike, y: ArrayLike) -> "GpiRegressor":
        """Identify a model.

        Parameters
        ----------
        X
            Inputs, (samples, inputs).
        y
            Outputs, (samples,) or (samples, outputs).

        Returns
        -------
        GpiRegressor
            Itself.

        Raises
        ------
        DataError, ParameterError
            As `identify`: too few samples, an input that does not move.
        """
        usual: dict[str, Any] = {"multi_output": True, "y_numeric": True, "ensure_min_samples": 2}
        X, y = validate_data(self, X, y, dtype=np.float64, **usual)
        self.model_ = identify(
            Record(X, np.asarray(y, dtype=np.float64), self.rate),
            order=self.order,
            half_widths=self.half_widths,
            thresholds=self.thresholds,
            delay=self.delay,
        )
        return self

    def predict(self, X: ArrayLike) -> NDArray[np.float64]:
        """Simulate the model from the first row on.

        Parameters
        ----------
        X
            Inputs, (samples, inputs).

        Returns
        -------
        ndarray
            Outputs, (samples,) or (samples, outputs).
        """
        check_is_fitted(self)
        u = validate_data(self, X, reset=False, dtype=np.float64)
        outputs = self.model_.simulate(u).reshape(len(u), -1)
        return outputs[:, 0] if outputs.shape[1] == 1 else outputs

    def __sklearn_tags__(self) -> Any:
        """Tell scikit-learn that rows are in the order of time."""
        tags = super().__sklearn_tags__()
        tags.regressor_tags.poor_score = True
        tags.target_tags.multi_output = True
        return tags

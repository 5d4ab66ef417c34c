"""An estimator for scikit-learn. scikit-learn is imported with this module and is not a dependency."""

from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.utils.validation import check_is_fitted, validate_data

from gpi_hammerstein._native import Model, Record, identify

if TYPE_CHECKING:
    # scikit-learn has no type hints: these are the parts of its base classes that a type checker needs.
    class BaseEstimator:
        """The methods of every estimator."""

        def get_params(self, deep: bool = True) -> dict[str, Any]:
            """Return the parameters by name."""

        def set_params(self, **params: Any) -> Self:
            """Set parameters by name."""

        def __sklearn_tags__(self) -> Any:
            """Return the properties of the estimator for scikit-learn."""

    class RegressorMixin:
        """The methods of every regressor."""

        def score(self, X: ArrayLike, y: ArrayLike, sample_weight: ArrayLike | None = None) -> float:
            """Return the coefficient of determination."""

else:
    from sklearn.base import BaseEstimator, RegressorMixin

__all__ = ["GpiRegressor"]


class GpiRegressor(RegressorMixin, BaseEstimator):
    """A scikit-learn regressor: hysteresis before linear dynamics.

    Rows are samples in the order of time at a constant rate. The output depends on earlier rows. Rows must
    therefore not be shuffled. To split data, use `sklearn.model_selection.TimeSeriesSplit`, not a random
    split.

    Parameters
    ----------
    rate
        Sampling rate in Hz.
    order, delay
        As in :func:`gpi_hammerstein.identify`; None chooses them from the data.
    half_widths, thresholds
        The numbers of plays and deadzones, or their half-widths and thresholds, shape (n,), in the unit of u,
        as in :func:`gpi_hammerstein.identify`; None chooses them from the data.

    Attributes
    ----------
    model_
        The identified :class:`gpi_hammerstein.Model`.

    Examples
    --------
    >>> from gpi_hammerstein.estimator import GpiRegressor
    >>> X = gpi.multisine(2000, 1000.0, (0.5, 400.0), (0.0, 10.0))[:, None]
    >>> y = gpi.PlayBank([0.0, 2.0], [1.0, 0.5])(X[:, 0])
    >>> fitted = GpiRegressor(rate=1000.0, half_widths=[0.0, 2.0], thresholds=0, delay=0).fit(X, y)
    >>> fitted.score(X, y) > 0.99
    True
    """

    model_: Model

    def __init__(
        self,
        rate: float = 1.0,
        *,
        order: int | None = None,
        half_widths: int | ArrayLike | None = None,
        thresholds: int | ArrayLike | None = None,
        delay: int | None = None,
    ) -> None:
        """Store the parameters."""
        self.rate = rate
        self.order = order
        self.half_widths = half_widths
        self.thresholds = thresholds
        self.delay = delay

    def fit(self, X: ArrayLike, y: ArrayLike) -> Self:
        """Identify a model.

        Parameters
        ----------
        X
            Inputs, shape (samples, inputs), each in its own unit.
        y
            Outputs, shape (samples,) or (samples, outputs), each in its own unit.

        Returns
        -------
        GpiRegressor
            The fitted regressor itself.

        Raises
        ------
        DataError, ParameterError
            As in `identify`, for example for too few samples or a constant input.
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
        """Simulate the model, starting at the first row.

        Parameters
        ----------
        X
            Inputs, shape (samples, inputs), each in its own unit.

        Returns
        -------
        ndarray
            Outputs, shape (samples,) or (samples, outputs), in the units of y.
        """
        check_is_fitted(self)
        u: NDArray[np.float64] = validate_data(self, X, reset=False, dtype=np.float64)
        outputs = self.model_.simulate(u).reshape(len(u), -1)
        return outputs[:, 0] if outputs.shape[1] == 1 else outputs

    def __sklearn_tags__(self) -> Any:
        """Return the tags, which state that rows are in the order of time."""
        tags = super().__sklearn_tags__()
        tags.regressor_tags.poor_score = True
        tags.target_tags.multi_output = True
        return tags

"""The estimator among those of scikit-learn."""

import numpy as np
import pytest

import gpi_hammerstein as gpi
from records import RATE, actuator, drive

sklearn = pytest.importorskip("sklearn")

from sklearn.base import clone  # noqa: E402
from sklearn.model_selection import GridSearchCV, TimeSeriesSplit, cross_val_score  # noqa: E402
from sklearn.pipeline import make_pipeline  # noqa: E402
from sklearn.preprocessing import StandardScaler  # noqa: E402
from sklearn.utils.estimator_checks import check_estimator  # noqa: E402

from gpi_hammerstein.estimator import GpiRegressor  # noqa: E402

U = drive(4000)
Y = actuator(U)
FEW = {"check_regressor_multioutput": "11 samples are fewer than the parameters of five outputs"}


@pytest.mark.filterwarnings("ignore")
def test_it_keeps_to_the_rules_of_estimators():
    # rows in any order and by the dozen: where they are checked, the model has no memory
    still = GpiRegressor(half_widths=[0.0], thresholds=[0.0], delay=0)
    checks = check_estimator(still, expected_failed_checks=FEW, on_fail=None)
    assert len(checks) > 40
    assert [one["check_name"] for one in checks if one["status"] == "failed"] == []


def test_it_identifies_and_simulates():
    X = U[:, None]
    fitted = GpiRegressor(rate=RATE).fit(X[:3000], Y[:3000])
    assert isinstance(fitted.model_, gpi.Model) and fitted.model_.rate == RATE
    np.testing.assert_array_equal(fitted.predict(X), fitted.model_.simulate(U))
    assert fitted.score(X[3000:], Y[3000:]) > 0.999
    assert clone(fitted).rate == RATE and not hasattr(clone(fitted), "model_")


def test_it_goes_into_pipelines_and_searches():
    X, y = U[:2000, None], Y[:2000]
    split = TimeSeriesSplit(2)
    pipeline = make_pipeline(StandardScaler(), GpiRegressor(rate=RATE, half_widths=4, thresholds=0))
    assert min(cross_val_score(pipeline, X, y, cv=split)) > 0.99
    choices = {"order": [1, 2]}
    search = GridSearchCV(GpiRegressor(rate=RATE, half_widths=4, thresholds=0), choices, cv=split)
    assert search.fit(X, y).best_score_ > 0.99

"""How uncertain numbers are printed."""

import numpy as np

import gpi_hammerstein as gpi
from gpi_hammerstein.explanation import number
from gpi_hammerstein.uncertain import p_value_in_words
from records import RATE, actuator, drive


def test_an_interval_that_holds_zero_is_not_determined() -> None:
    unsure = {"value": 0.02, "std": 0.03, "unit": "um", "determined": False}
    assert number("gain[0]", unsure) == "gain[0] not determined"
    assert number("gain[0]", unsure | {"std": 0.001, "determined": True}) == "gain[0] 0.02 ± 0.002 um"
    assert number("slew_limit", {"value": 3.0, "std": 0.0, "unit": "", "determined": True}) == "slew_limit 3"


def test_a_test_of_size_has_no_p_value() -> None:
    u = drive()
    model = gpi.identify(gpi.Record(u, actuator(u), RATE))
    rows = gpi.residual_tests(model, gpi.Record(u, actuator(u, seed=5), RATE))["tests"]
    assert {row["name"] for row in rows if row["p_value"] is None} >= {"prediction", "outliers"}
    for row in rows:
        assert row["passed"] == (row["statistic"] <= row["threshold"])
        assert (row["p_value"] is None) == (row["level"] is None)
        if row["p_value"] is not None:
            assert row["passed"] == (row["p_value"] >= row["level"])
        assert p_value_in_words(row) == ("-" if row["p_value"] is None else f"{row['p_value']:.2g}")


def test_weights_whose_interval_holds_zero_are_flagged() -> None:
    u = drive()
    model = gpi.identify(gpi.Record(u, actuator(u, noise=0.3), RATE), half_widths=8, thresholds=3)
    assert model.refinement is not None
    rows = model.refinement.parameters
    assert {row["determined"] for row in rows} == {False, True}
    for row in rows:
        holds_zero = row["std"] is None or 0 < abs(row["value"]) <= 1.96 * row["std"]
        if row["name"].startswith("u.weights"):
            assert row["determined"] == (not holds_zero)
        if row["name"].startswith(("u.half_widths", "offset")):
            assert row["determined"] == (row["std"] is not None)
    assert np.isfinite([row["value"] for row in rows]).all()

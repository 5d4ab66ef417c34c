"""Objects go through pickle and copy, and are the same afterwards."""

import copy
import pickle

import numpy as np
import pytest

import gpi_hammerstein as gpi
from records import RATE, actuator, drive, model_of
from test_effects import CASES, plant, with_effect

U = drive(300)
BANK = gpi.PlayBank([0.0, 0.3, 0.8], [1.0, 0.5, -0.2])
ZONES = gpi.Deadzones([-1.0, 0.0, 1.0], [0.2, 1.0, 0.3], reading="directional")
WAYS = {"pickle": lambda one: pickle.loads(pickle.dumps(one)), "copy": copy.copy, "deepcopy": copy.deepcopy}


@pytest.mark.parametrize("way", WAYS.values(), ids=WAYS)
@pytest.mark.parametrize("operator", [BANK, ZONES, gpi.Gpi(ZONES, BANK)], ids=lambda one: type(one).__name__)
def test_operators(operator, way):
    np.testing.assert_array_equal(way(operator)(U), operator(U))


@pytest.mark.parametrize("way", WAYS.values(), ids=WAYS)
def test_systems_and_models(way):
    model = with_effect(model_of(plant()), name="creep", **CASES["creep"][0])
    np.testing.assert_array_equal(way(model).simulate(U), model.simulate(U))
    np.testing.assert_array_equal(way(model.linear).simulate(U), model.linear.simulate(U))


@pytest.mark.parametrize("way", WAYS.values(), ids=WAYS)
@pytest.mark.parametrize("covered", [False, True])
def test_records(way, covered):
    extra = {"covariates": [U, U], "covariate_names": ["temp"], "covariate_units": ["K"]} if covered else {}
    names = {"input_units": ["V"], "output_names": ["x"]}
    record = gpi.Record([U, U], [actuator(U), U], RATE, warmup=[10, 20], **names, **extra)
    again = way(record)
    assert repr(again) == repr(record) and again.warmup == record.warmup
    assert again.covariate_names == record.covariate_names
    for name in ("u", "y", *(["covariates"] if covered else [])):
        for one, other in zip(getattr(again, name), getattr(record, name), strict=True):
            np.testing.assert_array_equal(one, other)

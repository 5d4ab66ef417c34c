"""Other packages' objects in and out."""

import numpy as np
import polars as pl
import pytest
import scipy.signal

import gpi_hammerstein as gpi
from records import RATE, actuator, drive

SYSTEM = gpi.StateSpace([[0.9, 0.2], [-0.2, 0.8]], [[1.0], [0.3]], [[0.5, -0.1]], [[0.05]])


@pytest.fixture
def record():
    u = drive(300)
    return gpi.Record(
        u, actuator(u), RATE, covariates=np.arange(300.0), input_units=["V"], output_units=["um"],
        covariate_names=["temp"], covariate_units=["degC"],
    )  # fmt: skip


def same(found, record):
    np.testing.assert_array_equal(found.u[0], record.u[0])
    np.testing.assert_array_equal(found.y[0], record.y[0])
    np.testing.assert_array_equal(found.covariates[0], record.covariates[0])
    for name in ("input", "output", "covariate"):
        for what in ("names", "units"):
            assert getattr(found, f"{name}_{what}") == getattr(record, f"{name}_{what}")
    assert found.rate == pytest.approx(RATE, rel=1e-12)
    return True


def equal(left, right):
    u = drive(200)
    np.testing.assert_allclose(left.simulate(u), right.simulate(u), rtol=0, atol=1e-10)
    return True


def test_polars_there_and_back(record):
    frame = gpi.interop.to_polars(record)
    assert frame.columns == ["t [s]", "u [V]", "y [um]", "temp [degC]"]
    assert same(gpi.read_record(frame), record)
    assert len(gpi.read_record([frame, frame]).u) == 2


def test_pandas_there_and_back(record):
    pd = pytest.importorskip("pandas")
    frame = gpi.interop.to_pandas(record)
    assert same(gpi.read_record(frame), record)
    assert same(gpi.read_record(frame.set_index("t [s]")), record)
    clock = pd.to_timedelta(frame.pop("t [s]"), unit="s")
    assert same(gpi.read_record(frame.set_index(pd.TimedeltaIndex(clock, name=None))), record)
    frame["note"] = "text"
    with pytest.raises(gpi.DataError, match="column `note` holds text"):
        gpi.read_record(frame, rate=RATE, covariate="note")
    assert "note" not in gpi.read_record(frame, rate=RATE).covariate_names


def test_xarray_there_and_back(record):
    xr = pytest.importorskip("xarray")
    dataset = gpi.interop.to_xarray(record)
    assert dataset["y"].attrs == {"units": "um"}
    assert same(gpi.read_record(dataset), record)
    with pytest.raises(gpi.DataError, match="`u` has 2 dimensions; select one experiment"):
        gpi.read_record(xr.Dataset({"u": (("t", "run"), np.zeros((3, 2)))}))


def test_frames_are_refused_as_files_are(record):
    with pytest.raises(gpi.DataError, match="the data frame.*header without rows"):
        gpi.read_record(pl.DataFrame({"u": [], "y": []}))
    with pytest.raises(gpi.DataError, match="NaN"):
        gpi.read_record(pl.DataFrame({"u": [1.0, None], "y": [1.0, 2.0]}), rate=1.0)


def test_control_there_and_back():
    control = pytest.importorskip("control")
    system = gpi.interop.to_control(SYSTEM, RATE)
    assert system.dt == 1 / RATE
    u = drive(200)
    _, y = control.forced_response(system, inputs=u)
    np.testing.assert_allclose(y, SYSTEM.simulate(u), rtol=0, atol=1e-10)
    assert equal(gpi.interop.from_control(system), SYSTEM)
    assert equal(gpi.interop.from_control(control.tf(system)), SYSTEM)
    with pytest.raises(gpi.ParameterError, match="continuous time; sample it first"):
        gpi.interop.from_control(control.tf([1], [1, 1]))


def test_dlti_there_and_back():
    system = gpi.interop.to_dlti(SYSTEM, RATE)
    u = drive(200)
    _, y, _ = scipy.signal.dlsim(system, u)
    np.testing.assert_allclose(y[:, 0], SYSTEM.simulate(u), rtol=0, atol=1e-10)
    assert equal(gpi.interop.from_dlti(system), SYSTEM)
    assert equal(gpi.interop.from_dlti(system.to_tf()), SYSTEM)
    with pytest.raises(gpi.ParameterError, match="make it discrete first"):
        gpi.interop.from_dlti(scipy.signal.lti([1.0], [1.0, 1.0]))

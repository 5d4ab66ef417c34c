"""Records: what is accepted, what is refused and why, and how they are split."""

import numpy as np
import pytest

import gpi_hammerstein as gpi
from gpi_hammerstein._native import time_axis


def ramp(samples, channels=1):
    return np.arange(float(samples * channels)).reshape(samples, channels)


# --- what a record holds -------------------------------------------------------------------------


def test_vectors_are_one_channel():
    record = gpi.Record([0.0, 1.0, 4.0], [5.0, 6.0, 7.0], 100)
    assert len(record.u) == len(record.y) == 1
    np.testing.assert_array_equal(record.u[0], [[0.0], [1.0], [4.0]])
    np.testing.assert_array_equal(record.y[0], [[5.0], [6.0], [7.0]])
    assert record.covariates[0].shape == (3, 0)
    assert (record.rate, record.samples, record.warmup) == (100.0, 3, [0])


def test_channels_and_experiments_are_kept_apart():
    u = [ramp(5, 2), 10 * ramp(3, 2)]
    y = [ramp(5, 3), -ramp(3, 3)]
    extra = [ramp(5), ramp(3)]
    record = gpi.Record(u, y, 2.5, covariates=extra, warmup=[2, 0])
    for held, given in [(record.u, u), (record.y, y), (record.covariates, extra)]:
        assert len(held) == 2
        for kept, original in zip(held, given, strict=True):
            np.testing.assert_array_equal(kept, original)
    assert record.samples == 8
    assert record.warmup == [2, 0]
    assert gpi.Record(u, y, 2.5, warmup=1).warmup == [1, 1]


def test_a_record_keeps_its_own_copy():
    u = ramp(4)
    record = gpi.Record(u, ramp(4), 1)
    u[0] = 99
    assert record.u[0][0, 0] == 0


def test_strides_integers_and_single_precision_are_read():
    wide = np.arange(12, dtype=np.float32).reshape(4, 3)
    record = gpi.Record(wide[:, ::2], wide.T[1], 1)
    np.testing.assert_array_equal(record.u[0], [[0, 2], [3, 5], [6, 8], [9, 11]])
    np.testing.assert_array_equal(record.y[0][:, 0], [1, 4, 7, 10])
    assert record.u[0].dtype == np.float64


def test_names_and_units():
    record = gpi.Record(
        ramp(3, 2),
        ramp(3),
        1,
        covariates=ramp(3),
        input_names=["drive_x", "drive_y"],
        output_names=["position"],
        covariate_names=["temperature"],
        input_units=["V", "V"],
        output_units=["um"],
        covariate_units=["degC"],
    )
    assert record.input_names == ["drive_x", "drive_y"]
    assert record.output_names == ["position"]
    assert record.covariate_names == ["temperature"]
    assert record.input_units == ["V", "V"]
    assert record.output_units == ["um"]
    assert record.covariate_units == ["degC"]
    for part in record.split(0.5):
        assert part.input_names == record.input_names
        assert part.output_units == record.output_units


def test_default_names_tell_channels_apart():
    record = gpi.Record(ramp(3, 2), ramp(3, 3), 1, covariates=ramp(3, 2))
    names = record.input_names + record.output_names + record.covariate_names
    assert [len(group) for group in (record.input_names, record.output_names)] == [2, 3]
    assert len(set(names)) == 7
    assert all(name.startswith("u") for name in record.input_names)
    assert all(name.startswith("y") for name in record.output_names)
    assert record.input_units == ["", ""]
    single = gpi.Record(ramp(3), ramp(3), 1)
    assert (single.input_names, single.output_names, single.covariate_names) == (["u"], ["y"], [])


# --- refusals ------------------------------------------------------------------------------------


def spoiled(rows, value):
    column = np.arange(20.0)
    column[rows] = value
    return column


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: gpi.Record(spoiled([7, 9], np.nan), ramp(20), 1), ["`u`", "row 7", "2 "]),
        (lambda: gpi.Record(ramp(20), spoiled([3], np.inf), 1), ["`y`", "row 3", "1 "]),
        (lambda: gpi.Record(ramp(20), spoiled([0, 19], -np.inf), 1), ["`y`", "row 0", "2 "]),
        (
            lambda: gpi.Record(ramp(20), ramp(20), 1, covariates=spoiled([5], np.nan), covariate_names=["T"]),
            ["`T`", "row 5"],
        ),
        (lambda: gpi.Record(ramp(20), ramp(19), 1), ["20", "19"]),
        (lambda: gpi.Record(ramp(20), ramp(20), 1, covariates=ramp(21)), ["20", "21"]),
        (lambda: gpi.Record([ramp(5), ramp(6)], [ramp(5), ramp(5)], 1), ["6", "5"]),
        (lambda: gpi.Record([ramp(5), ramp(5, 2)], [ramp(5), ramp(5)], 1), ["2", "1"]),
        (lambda: gpi.Record(ramp(5), ramp(5), 1, warmup=5), ["5", "6"]),
        (lambda: gpi.Record([], [], 1), ["0", "1"]),
        (lambda: gpi.Record(np.zeros(0), np.zeros(0), 1), ["0", "1"]),
    ],
)
def test_unusable_data_are_refused(build, words):
    with pytest.raises(gpi.DataError) as caught:
        build()
    assert isinstance(caught.value, ValueError)
    for word in words:
        assert word in str(caught.value)


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: gpi.Record(ramp(5), ramp(5), 0.0), ["`rate`", "0"]),
        (lambda: gpi.Record(ramp(5), ramp(5), -1.0), ["`rate`", "-1"]),
        (lambda: gpi.Record(ramp(5), ramp(5), np.nan), ["`rate`", "NaN"]),
        (lambda: gpi.Record(ramp(5), ramp(5), np.inf), ["`rate`", "inf"]),
        (lambda: gpi.Record([ramp(5), ramp(6)], [ramp(5)], 1), ["`u`", "2", "`y`", "1"]),
        (lambda: gpi.Record([ramp(5)] * 2, [ramp(5)] * 2, 1, warmup=[0]), ["`u`", "2", "`warmup`", "1"]),
        (lambda: gpi.Record(ramp(5, 2), ramp(5), 1, input_names=["only"]), ["1 names", "`u`", "2"]),
        (lambda: gpi.Record(ramp(5), ramp(5), 1, output_units=["V", "V"]), ["2 units", "`y`", "1"]),
        (lambda: gpi.Record(np.zeros((3, 2, 2)), ramp(3), 1), ["`u`", "[3, 2, 2]"]),
        (lambda: gpi.Record(["a", "b"], [1.0, 2.0], 1), ["`u`", "numbers"]),
    ],
)
def test_wrong_calls_are_refused(build, words):
    with pytest.raises(gpi.ParameterError) as caught:
        build()
    for word in words:
        assert word in str(caught.value)


@pytest.mark.parametrize(
    ("u", "y", "words"),
    [
        (np.full(200, 1.25), ramp(200), ["`u`", "constant", "1.25"]),
        (ramp(200), np.full(200, -3.0), ["`y`", "constant", "-3"]),
        (np.hstack([ramp(200), np.zeros((200, 1))]), ramp(200), ["`u2`", "constant", "0"]),
    ],
)
def test_identify_refuses_constant_columns(u, y, words):
    with pytest.raises(gpi.DataError) as caught:
        gpi.identify(gpi.Record(u, y, 1))
    for word in words:
        assert word in str(caught.value)


# --- splitting -----------------------------------------------------------------------------------


def test_split_keeps_the_past_as_warm_up():
    record = gpi.Record([ramp(10, 2), ramp(7, 2)], [ramp(10), ramp(7)], 5, warmup=[0, 3])
    first, rest = record.split(0.6)
    assert [len(u) for u in first.u] == [6, 5]
    assert first.warmup == [0, 3]
    np.testing.assert_array_equal(first.u[1], record.u[1][:5])
    np.testing.assert_array_equal(first.y[0], record.y[0][:6])
    assert [len(u) for u in rest.u] == [10, 7]
    assert rest.warmup == [6, 5]
    np.testing.assert_array_equal(rest.u[0], record.u[0])
    assert first.rate == rest.rate == 5


@pytest.mark.parametrize("fraction", [0.0, 1.0, -0.5, 2.0, np.nan])
def test_split_fraction_lies_between_zero_and_one(fraction):
    with pytest.raises(gpi.ParameterError, match="`fraction`"):
        gpi.Record(ramp(10), ramp(10), 1).split(fraction)


def test_split_that_leaves_nothing_is_refused():
    with pytest.raises(gpi.DataError):
        gpi.Record(ramp(3), ramp(3), 1).split(0.9)


# --- time stamps ---------------------------------------------------------------------------------


@pytest.mark.parametrize("rate", [0.3, 1.0, 50_000.0])
def test_time_axis_reads_the_rate(rate):
    found, jitter = time_axis(17.0 + np.arange(1000) / rate)
    assert found == pytest.approx(rate, rel=1e-9)
    assert jitter < 1e-5


def test_time_axis_tolerates_rounded_stamps():
    stamps = np.round(np.arange(1000) / 300, 5)
    found, jitter = time_axis(stamps)
    assert found == pytest.approx(300, rel=1e-4)
    steps = np.diff(stamps)
    assert jitter == pytest.approx(np.max(np.abs(steps / np.median(steps) - 1)), rel=1e-9)


def with_gap(row, gap):
    stamps = np.arange(100) * 0.5
    stamps[row + 1 :] += gap
    return stamps


@pytest.mark.parametrize(
    ("stamps", "words"),
    [
        ([], ["0", "2"]),
        ([1.0], ["1", "2"]),
        ([0.0, 1.0, np.nan, 3.0], ["time", "row 2"]),
        ([0.0, 1.0, 2.0, 1.5, 2.5], ["increase", "row 2", "2 s", "1.5 s"]),
        ([0.0, 1.0, 1.0, 2.0], ["increase", "row 1"]),
        (with_gap(40, 3.0), ["gap", "row 40", "20 s", "3.5 s", "0.5 s"]),
        (with_gap(40, 3.0) + with_gap(60, 1.0), ["2 gaps", "row 40"]),
        (np.arange(60) + 0.4 * (np.arange(60) % 3 == 0), ["uniform", "row 0"]),
        (np.cumsum(np.linspace(1, 2, 50)), ["uniform"]),
    ],
)
def test_time_axis_refuses(stamps, words):
    with pytest.raises(gpi.DataError) as caught:
        time_axis(stamps)
    for word in words:
        assert word in str(caught.value)


# --- a record is a sequence of samples -----------------------------------------------------------


def two_experiments():
    return gpi.Record(
        [ramp(10), 100 + ramp(6)],
        [-ramp(10), ramp(6)],
        4.0,
        covariates=[ramp(10, 2), ramp(6, 2)],
        warmup=[3, 0],
        input_units=["V"],
    )


def test_length_and_time_count_samples():
    record = two_experiments()
    assert len(record) == record.samples == 16
    assert [len(time) for time in record.time] == [10, 6]
    np.testing.assert_array_equal(record.time[0], np.arange(10) / 4.0)


def test_a_slice_counts_through_the_experiments():
    record = two_experiments()
    part = record[5:12]
    np.testing.assert_array_equal(np.concatenate(part.u)[:, 0], [5, 6, 7, 8, 9, 100, 101])
    np.testing.assert_array_equal(part.covariates[0], ramp(10, 2)[5:])
    assert (part.warmup, part.rate, part.input_units) == ([0, 0], 4.0, ["V"])
    assert record[1:].warmup == [2, 0] and len(record[:]) == 16
    np.testing.assert_array_equal(record[-2:].u[0][:, 0], [104, 105])


def test_a_slice_of_time_counts_from_the_start_of_each_experiment():
    part = two_experiments().between(1.0, 2.0)
    np.testing.assert_array_equal(part.u[0][:, 0], [4, 5, 6, 7])
    np.testing.assert_array_equal(part.u[1][:, 0], [104, 105])
    # a time that rounding has moved is that of the same sample
    record = gpi.Record(ramp(1000), ramp(1000), 1e3)
    for k in range(0, 990, 7):
        assert record.between(k / 1e3, (k + 3) / 1e3).u[0][:, 0].tolist() == [k, k + 1, k + 2]


@pytest.mark.parametrize(
    ("part", "error", "words"),
    [
        (lambda r: r[::2], gpi.ParameterError, "step of the slice is 2"),
        (lambda r: r[3], TypeError, r"record\[100:200\].*record.between"),
        (lambda r: r[0:3], gpi.ParameterError, "no scored sample; the record has 16 samples"),
        (lambda r: r[20:30], gpi.ParameterError, "no scored sample"),
        (lambda r: r.between(3.0, 4.0), gpi.ParameterError, "the longest of 2.5 s"),
        (lambda r: r.between(0.0, np.inf), gpi.ParameterError, "`end` = inf"),
    ],
)
def test_parts_without_samples_are_refused(part, error, words):
    with pytest.raises(error, match=words):
        part(two_experiments())


def test_an_experiment_is_a_frame():
    record = two_experiments()
    for frame in (record.to_pandas(1), record.to_polars(1)):
        assert list(frame.columns) == ["t [s]", "u [V]", "y", "x1", "x2"]
        assert list(frame["u [V]"]) == [100, 101, 102, 103, 104, 105]

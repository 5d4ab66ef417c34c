"""Reading records: formats, names, units, clocks, and what is refused."""

import gzip
from pathlib import Path

import h5py
import numpy as np
import polars as pl
import pytest
import scipy.io

import gpi_hammerstein as gpi
from gpi_hammerstein.io import read_recording
from gpi_hammerstein.io.columns import parse_header
from records import good_columns, write_csv

U = np.array([0.0, 1.0, 3.0, 2.0, 5.0])
Y = np.array([0.5, 1.5, 2.5, 2.0, 4.0])
T = np.arange(5) * 0.005


def columns(**changes: object) -> dict[str, object]:
    return {"t_s": T, "u_V": U, "y_um": Y} | changes


@pytest.mark.parametrize(
    ("header", "name", "unit"),
    [
        ("y_um", "y", "um"),
        ("u1_V", "u1", "V"),
        ("x_left", "x_left", ""),
        ("u_2", "u_2", ""),
        ("udot_deg_s", "udot", "deg/s"),
        ("y [mm]", "y", "mm"),
        ("_V", "_V", ""),
        ("t", "t", ""),
    ],
)
def test_the_unit_is_what_follows_the_last_underscore(header: str, name: str, unit: str) -> None:
    column = parse_header(header)
    assert (column.name, column.unit) == (name, unit)


def write_as(kind: str, folder: Path) -> Path:
    path = folder / f"record{kind}"
    arrays = {"t_s": T, "u_V": U, "y_um": Y}
    match kind:
        case ".csv":
            write_csv(path, columns())
        case ".csv.gz":
            text = write_csv(folder / "plain.csv", columns()).read_text()
            path.write_bytes(gzip.compress(text.encode()))
        case ".tsv":
            write_csv(path, columns())
            path.write_text("# a comment\n" + path.read_text().replace(",", "\t"))
        case ".parquet":
            pl.DataFrame(arrays).write_parquet(path)
        case ".npz":
            np.savez(path, **arrays)
        case ".mat":
            scipy.io.savemat(path, {name: values.reshape(-1, 1) for name, values in arrays.items()})
        case "-v73.mat":
            write_v73(path, {name: values.reshape(-1, 1) for name, values in arrays.items()})
    return path


def write_v73(path: Path, arrays: dict[str, np.ndarray]) -> None:
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in arrays.items():
            file.create_dataset(name, data=values.T).attrs["MATLAB_class"] = np.bytes_("double")
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")


@pytest.mark.parametrize("kind", [".csv", ".csv.gz", ".tsv", ".parquet", ".npz", ".mat", "-v73.mat"])
def test_every_format_gives_the_same_record(kind: str, tmp_path: Path) -> None:
    record = gpi.read_record(write_as(kind, tmp_path))
    np.testing.assert_array_equal(record.u[0], U[:, None])
    np.testing.assert_array_equal(record.y[0], Y[:, None])
    assert record.rate == 200.0
    assert (record.input_names, record.input_units) == (["u"], ["V"])
    assert (record.output_names, record.output_units) == (["y"], ["um"])


def test_columns_are_named_with_or_without_unit(tmp_path: Path) -> None:
    path = write_csv(tmp_path / "r.csv", {"clock_ms": 1e3 * T, "drive_V": U, "gap_um": Y, "temp_degC": U + Y})
    record = gpi.read_record(path, time="clock", input="drive_V", output="gap")
    assert record.rate == 200.0
    assert (record.covariate_names, record.covariate_units) == (["temp"], ["degC"])
    np.testing.assert_array_equal(record.covariates[0][:, 0], U + Y)
    assert (
        gpi.read_record(path, time="clock", input="drive", output="gap", covariate=[]).covariate_names == []
    )


def test_several_channels_are_found_in_order(tmp_path: Path) -> None:
    path = write_csv(tmp_path / "r.csv", {"t": T, "u1_V": U, "u_2": -U, "y1_um": Y, "y2_um": -Y})
    record = gpi.read_record(path)
    np.testing.assert_array_equal(record.u[0], np.column_stack([U, -U]))
    np.testing.assert_array_equal(record.y[0], np.column_stack([Y, -Y]))


def test_several_files_are_several_experiments(tmp_path: Path) -> None:
    first = write_csv(tmp_path / "a.csv", columns())
    second = write_csv(tmp_path / "b.csv", columns(u_V=2 * U))
    record = gpi.read_record([first, second], warmup=2)
    assert [len(u) for u in record.u] == [5, 5] and record.warmup == [2, 2]
    np.testing.assert_array_equal(gpi.read_record([first, second], experiment=1).u[0][:, 0], 2 * U)
    third = write_csv(tmp_path / "c.csv", columns(t_s=2 * T))
    with pytest.raises(gpi.DataError, match="200 and 100 Hz"):
        gpi.read_record([first, third])
    fourth = write_csv(tmp_path / "d.csv", {"t_s": T, "u_mV": U, "y_um": Y})
    with pytest.raises(gpi.DataError, match="u_V and u_mV"):
        gpi.read_record([first, fourth])


def test_realisations_are_experiments_and_periods_are_joined(tmp_path: Path) -> None:
    u = np.random.default_rng(0).normal(size=(8, 3, 2, 2))
    y = np.random.default_rng(1).normal(size=(8, 1, 2, 2))
    np.save(tmp_path / "u.npy", u)
    np.save(tmp_path / "y.npy", y)
    record = gpi.read_record(tmp_path / "u.npy", output="y.npy", rate=10.0)
    assert record.input_names == ["u1", "u2", "u3"] and record.output_names == ["y"]
    assert record.warmup == [8, 8]
    np.testing.assert_array_equal(record.u[1], np.concatenate([u[:, :, 1, 0], u[:, :, 1, 1]]))
    np.testing.assert_array_equal(record.y[0][8:], y[:, :, 0, 1])
    np.savez(tmp_path / "both.npz", u=u, y=y, fs=10.0)
    chosen = gpi.read_record(tmp_path / "both.npz", experiment="1", input="u", warmup=0)
    assert (chosen.rate, chosen.warmup) == (10.0, [0])
    np.testing.assert_array_equal(chosen.u[0], record.u[1])


def test_several_npy_pairs_are_one_record(tmp_path: Path) -> None:
    random = np.random.default_rng(0)
    signals = {name: random.normal(size=(8, 2, 3)) for name in ("u_low", "u_high", "y_low", "y_high")}
    for name, signal in signals.items():
        np.save(tmp_path / f"{name}.npy", signal)
    inputs = [tmp_path / "u_low.npy", tmp_path / "u_high.npy"]
    record = gpi.read_record(inputs, output=["y_low.npy", "y_high.npy"], rate=10.0)
    assert len(record.u) == 6
    np.testing.assert_array_equal(record.u[4], signals["u_high"][:, :, 1])
    np.testing.assert_array_equal(record.y[4], signals["y_high"][:, :, 1])
    with pytest.raises(gpi.ParameterError, match="names 1 files, but 2 .npy files"):
        gpi.read_record(inputs, output="y_low.npy", rate=10.0)
    with pytest.raises(gpi.DataError, match=r"y_mid.npy: no such file"):
        gpi.read_record(inputs, output=["y_low.npy", "y_mid.npy"], rate=10.0)
    with pytest.raises(gpi.ParameterError, match=r"r.csv together with .npy files"):
        gpi.read_record([*inputs, tmp_path / "r.csv"], rate=10.0)


def test_a_record_without_output_can_be_read_but_not_identified(tmp_path: Path) -> None:
    path = write_csv(tmp_path / "r.csv", {"t": T, "u": U})
    assert read_recording(path).runs[0].y.shape == (5, 0)
    with pytest.raises(gpi.DataError, match="no output column"):
        gpi.read_record(path)


def refuse(path: Path, *words: str, error: type[Exception] = gpi.DataError, **options: object) -> None:
    with pytest.raises(error) as caught:
        gpi.read_record(path, **options)
    for word in words:
        assert word in str(caught.value), f"`{word}` is not in `{caught.value}`"


@pytest.mark.parametrize("value", ["nan", "inf", "-inf", ""])
def test_samples_that_are_no_numbers_are_located(value: str, tmp_path: Path) -> None:
    y: list[object] = list(Y)
    y[1] = y[3] = value
    refuse(write_csv(tmp_path / "r.csv", columns(y_um=y)), "`y_um`", "2 NaN", "rows 1, 3")


def test_text_is_located(tmp_path: Path) -> None:
    y: list[object] = list(Y)
    y[2] = "broken"
    refuse(write_csv(tmp_path / "r.csv", columns(y_um=y)), "`y_um`", "`broken`", "row 2")
    labelled = write_csv(tmp_path / "l.csv", columns(label=["a"] * 5))
    # what nobody has named is not judged, but a note says that it is left out
    recording = read_recording(labelled)
    assert recording.notes == ["`label` is left out: it contains text, first `a` in row 0"]
    assert recording.record().covariate_names == []
    refuse(labelled, "`label`", "row 0", covariate="label")


@pytest.mark.parametrize("content", ["", "\n\n", "t,u,y\n"])
def test_empty_files_are_refused(content: str, tmp_path: Path) -> None:
    path = tmp_path / "r.csv"
    path.write_text(content)
    refuse(path, "empty")


def test_unreadable_files_are_refused(tmp_path: Path) -> None:
    refuse(tmp_path / "none.csv", "no such file")
    for name in ("r.npz", "r.npy", "r.mat", "r.parquet", "r.csv.gz"):
        (tmp_path / name).write_bytes(b"\x1f\x8b\x00garbage" * 20)
        refuse(tmp_path / name, "cannot be read", rate=1.0)
    (tmp_path / "r.ods").write_bytes(b"")
    refuse(tmp_path / "r.ods", "no known format", ".xlsx")


def test_mismatched_lengths_are_refused(tmp_path: Path) -> None:
    np.savez(tmp_path / "r.npz", u=U, y=Y[:4], rate=1.0)
    refuse(tmp_path / "r.npz", "`u` has 5", "`y` has 4")
    (tmp_path / "long.csv").write_text("t,u,y\n0,1,2\n1,2,3,4\n")
    refuse(tmp_path / "long.csv", "cannot be read as CSV")
    (tmp_path / "short.csv").write_text("t,u,y\n0,1,2\n1,2\n2,1,1\n")
    refuse(tmp_path / "short.csv", "`y`", "rows 1")
    np.savez(tmp_path / "turned.npz", u=np.zeros((2, 9)), y=np.zeros(2), rate=1.0)
    refuse(tmp_path / "turned.npz", "2 samples of 9 channels", "transpose")


def test_a_recorder_of_western_europe_is_read(tmp_path: Path) -> None:
    """Latin-1, semicolons, decimal commas, and words for what is measured."""
    lines = ["# Messung 23 \u00b0C", "time_ms;voltage_V;position_um"]
    lines += [f"{1e3 * t:g};{u:g};{y:.3e}".replace(".", ",") for t, u, y in zip(T, U, Y, strict=True)]
    path = tmp_path / "messung.csv"
    path.write_bytes("\n".join(lines).encode("latin-1"))
    record = gpi.read_record(path)
    assert (record.input_names, record.output_names, record.output_units) == (
        ["voltage"],
        ["position"],
        ["um"],
    )
    np.testing.assert_allclose(record.u[0][:, 0], U, rtol=1e-5)
    np.testing.assert_allclose(record.y[0][:, 0], Y, rtol=1e-3)
    # where there is a `u`, a voltage is only another column
    beside = write_csv(tmp_path / "beside.csv", {"t": T, "u": U, "voltage": Y, "y": Y})
    assert gpi.read_record(beside).covariate_names == ["voltage"]


def test_names_are_found_below_what_a_recorder_writes_above_them(tmp_path: Path) -> None:
    path = tmp_path / "scope.csv"
    rows = "".join(f"{t},{u},{y}\n" for t, u, y in zip(1e3 * T, U, Y, strict=True))
    path.write_text(f"Model,MSO-5204\nDate,2026-11-02,10:15\n\n# averaged\nt,u,y\n(ms),V,um\n{rows}")
    recording = read_recording(path)
    record = recording.record()
    assert record.input_units == ["V"] and record.output_units == ["um"]
    assert record.rate == pytest.approx(1 / (T[1] - T[0]))
    np.testing.assert_allclose(record.u[0][:, 0], U)
    assert recording.notes == ["skipped 2 lines above the names, first `Model,MSO-5204`"]

    path.write_text(f"t_ms,u_V,y_um\n{rows}")
    assert read_recording(path).notes == []
    path.write_text(f"t,u,y\n0,none,1\n{rows}")  # a row of text below the names is no line of names
    refuse(path, "column `u` holds text, first `none` in row 0")
    path.write_text("hello\n")
    refuse(path, "no rows below the header line `hello`")


def test_a_counter_without_a_unit_is_told(tmp_path: Path) -> None:
    path = write_csv(tmp_path / "r.csv", {"t": np.arange(5), "u_V": U, "y_um": Y})
    (note,) = read_recording(path).notes
    assert "taken as seconds, 1 Hz" in note and "--rate" in note
    assert read_recording(path, rate=50.0).notes == []


def test_all_that_is_missing_is_said_at_once(tmp_path: Path) -> None:
    path = write_csv(tmp_path / "r.csv", {"Kanal": T, "Alpha": U, "Beta": Y})
    refuse(path, "--input", "--output", "--time", "Kanal, Alpha, Beta")


def test_names_that_are_not_there_are_refused(tmp_path: Path) -> None:
    path = write_csv(tmp_path / "r.csv", {"a": T, "b": U, "c": Y})
    refuse(path, "no input column", "a, b, c")
    refuse(path, "no column `volt`", "a, b, c", input="volt")
    refuse(path, "no time column", "--rate", input="b", output="c")
    refuse(path, "`b`", "two roles", input="b", output="b", rate=1.0)
    (tmp_path / "d.csv").write_text("t,u,u,y\n0,1,2,3\n1,2,3,4\n")
    refuse(tmp_path / "d.csv", "2 columns are named `u`")


def test_options_out_of_range_are_wrong_calls(tmp_path: Path) -> None:
    path = write_csv(tmp_path / "r.csv", columns())
    refuse(path, "`rate` = -1", error=gpi.ParameterError, rate=-1.0)
    refuse(path, "`warmup` = -1", error=gpi.ParameterError, warmup=-1)
    refuse(path, "`resample` = -5", error=gpi.ParameterError, resample=-5.0)
    refuse(path, "100 times", "200 Hz", error=gpi.ParameterError, resample=1e12)
    refuse(path, "exclude each other", error=gpi.ParameterError, rate=1.0, resample=True)
    refuse(path, "number 1", "has 1", error=gpi.ParameterError, experiment="0-1")
    refuse(path, "`experiments` = x", error=gpi.ParameterError, experiment="x")


@pytest.mark.parametrize(
    ("stamps", "words"),
    [
        ([0.0, 0.1, 0.2, 0.15, 0.25, 0.35], ["row 2", "--resample"]),
        ([*np.arange(50) * 0.1, *(10 + np.arange(50) * 0.1)], ["gap", "row 49", "--resample"]),
        (np.cumsum([0.1, 0.2] * 25), ["not uniform", "--resample"]),
    ],
)
def test_clocks_that_fail_are_located_and_resampling_is_offered(
    stamps: object, words: list[str], tmp_path: Path
) -> None:
    t = np.asarray(stamps)
    path = write_csv(tmp_path / "r.csv", {"t_s": t, "u_V": 2 * t, "y_um": 3 * t})
    refuse(path, *words)
    recording = read_recording(path, resample=10.0)
    assert recording.rate == 10.0 and "10 Hz" in recording.notes[0]
    for run in recording.runs:
        # Linear signals survive linear interpolation.
        np.testing.assert_allclose(run.y, 1.5 * run.u, rtol=0, atol=1e-12)
        np.testing.assert_allclose(np.diff(run.u[:, 0]), 0.2, rtol=0, atol=1e-9)


def test_resampling_cuts_at_gaps_and_backward_jumps(tmp_path: Path) -> None:
    step = 0.01
    t = np.concatenate([np.arange(20) * step, 5 + np.arange(30) * step, 5.1 + np.arange(25) * step])
    path = write_csv(tmp_path / "r.csv", {"t": t, "u": np.arange(75.0), "y": np.arange(75.0)})
    recording = read_recording(path, resample=True)
    assert [len(run.u) for run in recording.runs] == [20, 30, 25]
    assert "1 gaps and 1 backward" in recording.notes[0]
    np.testing.assert_allclose(recording.runs[1].u[:, 0], np.arange(20.0, 50.0), atol=1e-9)
    repeated = write_csv(
        tmp_path / "d.csv", {"t": np.repeat(np.arange(9) * step, 2), "u": range(18), "y": range(18)}
    )
    assert "9 rows with a repeated time stamp" in read_recording(repeated, resample=True).notes[0]


def test_numbers_survive_a_file_exactly(tmp_path: Path) -> None:
    written = good_columns(300)
    record = gpi.read_record(write_csv(tmp_path / "r.csv", written))
    np.testing.assert_array_equal(record.u[0][:, 0], np.asarray(written["u_V"]))
    assert record.rate == 1000.0

"""Files as laboratories write them: each is read without options, or refused with advice that works."""

import importlib.util
import io
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest

import gpi_hammerstein as gpi
from gpi_hammerstein.io import extras, read_recording
from gpi_hammerstein.io.boundary import File
from gpi_hammerstein.io.columns import parse_header
from gpi_hammerstein.io.limits import Allowance
from gpi_hammerstein.io.roles import assign_roles
from reader_corpus import SAMPLES, signals
from records import actuator, drive

T, U, Y = signals().values()


def rows(separator: str = ",", comma: bool = False, columns: int = 3) -> str:
    cells = [[f"{value:.9g}" for value in row[:columns]] for row in zip(T, U, Y, strict=True)]
    text = "\n".join(separator.join(row) for row in cells) + "\n"
    return text.replace(".", ",") if comma else text


def is_the_record(path: Path, units: tuple[str, str] | None = ("V", "um")) -> list[str]:
    """Require the samples of the corpus, read without options, and return the notes."""
    recording = read_recording(path)
    record = recording.record()
    assert record.rate == pytest.approx(100.0)
    np.testing.assert_allclose(record.u[0][:, 0], U, rtol=1e-6, atol=1e-8)
    np.testing.assert_allclose(record.y[0][:, 0], Y, rtol=1e-6, atol=1e-8)
    if units is not None:
        assert (record.input_units[0], record.output_units[0]) == units
    return recording.notes


@pytest.mark.parametrize(
    ("headers", "roles"),
    [
        ("t_s u_V y_um", "t_s u_V y_um"),
        ("Zeit Spannung Weg", "Zeit Spannung Weg"),
        ("Zeit[s] Stellspannung[V] Sensorsignal[V]", "Zeit[s] Stellspannung[V] Sensorsignal[V]"),
        ("Time(ms) Command[V] Capacitive-sensor[nm]", "Time(ms) Command[V] Capacitive-sensor[nm]"),
        ("t cmd_V cap_nm", "t cmd_V cap_nm"),
        ("time AO0 AI0", "time AO0 AI0"),
        ("time Dev1/ao0 Dev1/ai0", "time Dev1/ao0 Dev1/ai0"),
        ("t u_in y_kip", "t u_in y_kip"),
        ("t/s U/V s/um", "t/s U/V s/um"),
        ("t_s reference_m motor_V position_m", "t_s motor_V position_m"),
        ("t desired_deg measured_deg", "t desired_deg measured_deg"),
        ("t_s volt_V temperature_degC x_um", "t_s volt_V x_um"),
        ("t u voltage y position", "t u y"),
    ],
)
def test_columns_are_recognised_by_their_names(headers: str, roles: str) -> None:
    found = assign_roles([parse_header(header) for header in headers.split()], source="r")
    assert found.time is not None
    assert [c.header for c in (found.time, *found.inputs, *found.outputs)] == roles.split()


@pytest.mark.parametrize("headers", ["t voltage current", "t displacement_in force_kip", "t CH1 CH2"])
def test_names_that_leave_a_choice_are_not_guessed(headers: str) -> None:
    with pytest.raises(gpi.DataError, match="--input"):
        assign_roles([parse_header(header) for header in headers.split()], source="r")


def test_a_guess_is_explained(tmp_path: Path) -> None:
    path = tmp_path / "r.csv"
    path.write_text("Zeit;Spannung [V];Weg [um]\n" + rows(";", comma=True))
    notes = is_the_record(path)
    assert (
        "`Spannung [V]` is taken as the input: its name contains `spannung` and its unit is V; --input names "
        "another column" in notes
    )


def test_an_undecided_output_is_told_where_it_is_needed(tmp_path: Path) -> None:
    path = tmp_path / "r.csv"
    path.write_text(
        "t_s,u_V,angle_deg,stroke_um\n" + "\n".join(f"{t},{u},{u},{u}" for t, u in zip(T, U, strict=True))
    )
    with pytest.raises(gpi.DataError, match="--output.*angle_deg, stroke_um"):
        gpi.read_record(path)
    assert gpi.read_record(path, output="stroke_um").output_names == ["stroke"]


@pytest.mark.parametrize("separator", [",", ";", "\t", " ", "   "])
def test_a_file_without_names_is_read(separator: str, tmp_path: Path) -> None:
    path = tmp_path / "r.txt"
    path.write_text(rows(separator))
    (note,) = is_the_record(path, ("", ""))
    assert "column2 is taken as the input" in note and "--input" in note


def test_a_file_without_names_and_time_asks_for_the_rate(tmp_path: Path) -> None:
    path = tmp_path / "r.dat"
    path.write_text("\n".join(f"{u:.6g}\t{y:.6g}" for u, y in zip(U, Y, strict=True)))
    with pytest.raises(gpi.DataError, match="--rate"):
        read_recording(path)
    np.testing.assert_allclose(gpi.read_record(path, rate=100.0).u[0][:, 0], U, rtol=1e-5, atol=1e-8)
    path.write_text("\n".join(f"{u}\t0\t{y}\t{y + u}" for u, y in zip(U, Y, strict=True)))
    with pytest.raises(gpi.DataError, match="column1, column2, column3, column4"):
        read_recording(path, rate=100.0)
    gpi.read_record(path, rate=100.0, input="column1", output="column3")


def test_names_in_a_comment_are_found(tmp_path: Path) -> None:
    np.savetxt(tmp_path / "r.txt", np.column_stack([T, U, Y]), header="t_s u_V y_um")
    is_the_record(tmp_path / "r.txt")
    np.savetxt(tmp_path / "r.csv", np.column_stack([T, U, Y]), header="run 3\nt_s,u_V,y_um", delimiter=",")
    is_the_record(tmp_path / "r.csv")


def test_empty_and_unnamed_columns_are_not_judged(tmp_path: Path) -> None:
    lines = [f"{line};;;" for line in rows(";").splitlines()]
    path = tmp_path / "r.csv"
    path.write_text("\n".join(["t_s;u_V;y_um;spare;;", *lines]))
    assert is_the_record(path) == ["`spare` is left out: it contains no numbers"]
    path.write_text("\n".join(["t_s;u_V;y_um", *lines]))  # separators only behind the samples
    assert is_the_record(path) == []
    lines = [f"{line};{place};ok;{place}" for place, line in enumerate(rows(";").splitlines())]
    path.write_text("\n".join(["t_s;u_V;y_um;k;state;k", *lines]))
    assert any("2 columns are named `k`" in note for note in is_the_record(path))


def test_of_two_tables_the_longer_one_is_read(tmp_path: Path) -> None:
    path = tmp_path / "r.csv"
    table = "Channel,Gain,Offset\n1,2.5,0.1\n2,1.0,-0.3\n\n"
    path.write_text(f"Logger 7\n{table}t,u,y\ns,V,um\n{rows()}")
    assert any("contains 2 tables" in note for note in is_the_record(path))
    path.write_text(f"t_s,u_V,y_um\n{rows()}\n{table}")
    assert any("contains 2 tables" in note for note in is_the_record(path))


@pytest.mark.parametrize("layout", ["%H:%M:%S.%f", "%Y-%m-%d %H:%M:%S.%f", "%d.%m.%Y %H:%M:%S.%f"])
def test_times_of_day_are_a_clock(layout: str, tmp_path: Path) -> None:
    import datetime

    begin = datetime.datetime(2026, 11, 2, 23, 59, 59, 800_000)  # midnight passes within the record
    stamps = [(begin + datetime.timedelta(seconds=float(t))).strftime(layout) for t in T]
    path = tmp_path / "r.csv"
    path.write_text(
        "Time,u_V,y_um\n" + "\n".join(f"{a},{u},{y}" for a, u, y in zip(stamps, U, Y, strict=True))
    )
    is_the_record(path)


def workbook(path: Path) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.active.title = "About"
    book.active.append(["Operator", "N. N."])
    book.active.append([1, 2])
    sheet = book.create_sheet("Run 1")
    sheet.append(["Logger 7"])
    sheet.append(["Time (s)", "Command [V]", "Position [um]", "Remark"])
    for place, (t, u, y) in enumerate(zip(T, U, Y, strict=True)):
        sheet.append([float(t), float(u), float(y), "start" if place == 0 else None])
    book.save(path)


def test_excel_is_read(tmp_path: Path) -> None:
    workbook(tmp_path / "r.xlsx")
    notes = is_the_record(tmp_path / "r.xlsx")
    assert any("the sheet `Run 1` is read" in note for note in notes)
    assert any("`Remark` is left out" in note for note in notes)
    (tmp_path / "r.csv").write_bytes((tmp_path / "r.xlsx").read_bytes())
    with pytest.raises(gpi.DataError, match=r"rename it so that it ends in \.xlsx"):
        read_recording(tmp_path / "r.csv")
    (tmp_path / "r.xls").write_bytes(b"\xd0\xcf\x11\xe0")
    with pytest.raises(gpi.DataError, match=r"save the sheet as \.xlsx"):
        read_recording(tmp_path / "r.xls")


def test_plain_hdf5_is_read(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "r.h5", "w") as file:
        run = file.create_group("measurement/run1")
        run.attrs["fs"] = 100.0
        run.create_dataset("drive", data=U).attrs["units"] = "V"
        run.create_dataset("sensor", data=Y).attrs["units"] = "um"
        file["calibration"] = np.arange(7.0)
        file["about"] = "text"
    notes = is_the_record(tmp_path / "r.h5")
    assert any("`calibration` is left out: it contains 7 values" in note for note in notes)
    table = np.rec.fromarrays([T, U, Y], names="t_s,u_V,y_um")
    with h5py.File(tmp_path / "r.hdf5", "w") as file:
        file["table"] = table
    is_the_record(tmp_path / "r.hdf5")
    with h5py.File(tmp_path / "r.hdf5", "a") as file:
        file["table2"] = h5py.ExternalLink("r.h5", "/calibration")
    with pytest.raises(gpi.DataError, match="a link to another object or file"):
        read_recording(tmp_path / "r.hdf5")


LVM = """LabVIEW Measurement\t
Writer_Version\t2
Separator\tTab
Decimal_Separator\t{point}
Multi_Headings\tYes
X_Columns\t{x}
***End_of_Header***\t
"""
SEGMENT = """\t
Channels\t2\t\t
Samples\t60\t60\t
Y_Unit_Label\tVolts\tMicrometers\t
X_Dimension\tTime\tTime\t
X0\t0\t0\t
Delta_X\t0.01\t0.01\t
***End_of_Header***\t\t\t
X_Value\tDrive\tSensor\tComment
"""


def lvm(x: str = "One", point: str = ".", segments: int = 1) -> str:
    body = ""
    for _ in range(segments):
        body += SEGMENT
        for t, u, y in zip(T, U, Y, strict=True):
            body += f"{f'{t:.6f}' if x == 'One' else ''}\t{u:.9f}\t{y:.9f}\t\n"
    text = LVM.format(x=x, point=point) + body
    return text.replace("0.0", "0,0").replace(".", ",") if point == "," else text


@pytest.mark.parametrize("x", ["One", "No"])
@pytest.mark.parametrize("point", [".", ","])
def test_lvm_is_read(x: str, point: str, tmp_path: Path) -> None:
    path = tmp_path / "r.lvm"
    path.write_text(lvm(x, point))
    is_the_record(path)
    path.write_text(lvm(x, point, segments=2))
    assert len(read_recording(path).runs) == 2


def tdms(path: Path, units: bool = True) -> None:
    nptdms = pytest.importorskip("nptdms")
    with nptdms.TdmsWriter(path) as writer:
        for group in ("run 1", "run 2"):
            writer.write_segment(
                [
                    nptdms.ChannelObject(
                        group, name, values, {"wf_increment": 0.01, "unit_string": unit if units else ""}
                    )
                    for name, values, unit in (("ao0", U, "Volts"), ("ai0", Y, "um"))
                ]
            )
        writer.write_segment([nptdms.ChannelObject("log", "state", np.arange(3))])


def test_tdms_is_read(tmp_path: Path) -> None:
    tdms(tmp_path / "r.tdms")
    notes = is_the_record(tmp_path / "r.tdms")
    assert any("other groups are left out" in note and "log" in note for note in notes)
    assert len(read_recording(tmp_path / "r.tdms").runs) == 2


def mdf(path: Path) -> None:
    asammdf = pytest.importorskip("asammdf")
    with asammdf.MDF(version="4.10") as file:
        file.append(
            [
                asammdf.Signal(samples=values, timestamps=T, name=name, unit=unit)
                for name, values, unit in (("Command", U, "V"), ("Position", Y, "um"))
            ]
        )
        file.append([asammdf.Signal(samples=np.arange(9.0), timestamps=np.arange(9.0), name="slow")])
        file.save(path, overwrite=True)


def test_mdf_is_read(tmp_path: Path) -> None:
    mdf(tmp_path / "r.mf4")
    notes = is_the_record(tmp_path / "r.mf4")
    assert any("other groups" in note for note in notes)


@pytest.mark.parametrize("module", ["openpyxl", "nptdms", "asammdf"])
def test_a_missing_library_is_named_with_the_command_that_installs_it(
    module: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(name: str) -> None:
        raise ImportError(name)

    monkeypatch.setattr(importlib, "import_module", fail)
    extra = {"openpyxl": "xlsx", "nptdms": "tdms", "asammdf": "mdf"}[module]
    path = Path(f"r.{extra}")
    with pytest.raises(gpi.DataError, match=rf"pip install 'gpi-hammerstein\[{extra}\]'"):
        extras.load(module, extra, File(path, b"", Allowance(path, 0)))


def test_missing_samples_are_left_out_in_one_step(tmp_path: Path) -> None:
    lines = rows().splitlines()
    lines[20] = lines[20].rsplit(",", 1)[0] + ","
    path = tmp_path / "r.csv"
    path.write_text("\n".join(["t_s,u_V,y_um", *lines]))
    with pytest.raises(gpi.DataError, match="--resample auto"):
        read_recording(path)
    recording = read_recording(path, resample=True)
    assert len(recording.runs) == 1 and len(recording.runs[0].u) == SAMPLES
    assert any("1 rows are left out" in note for note in recording.notes)
    with pytest.raises(gpi.DataError) as caught:  # without time stamps, resampling is no remedy
        read_recording(path, rate=100.0)
    assert "--resample" not in str(caught.value)


def test_rounded_stamps_ask_for_the_rate(tmp_path: Path) -> None:
    t = np.floor(np.arange(2000) / 8.0) / 1000.0  # 8 kHz, written in milliseconds
    path = tmp_path / "r.csv"
    path.write_text("t_s,u_V,y_um\n" + "\n".join(f"{a:.3f},{u},{u}" for a, u in zip(t, drive(), strict=True)))
    with pytest.raises(gpi.DataError, match=r"--rate, on average it is 80\d\d") as caught:
        read_recording(path)
    assert "--resample" not in str(caught.value)
    path.write_text("t_s,u_V,y_um\n" + "\n".join(f"{u},{u},{u}" for u in drive()))
    with pytest.raises(gpi.DataError, match="no clock"):
        read_recording(path)


def test_another_rate_than_that_of_the_file_is_told(tmp_path: Path) -> None:
    path = tmp_path / "r.csv"
    path.write_text("t_s,u_V,y_um\n" + rows())
    assert read_recording(path, rate=100.0).notes == []
    (note,) = read_recording(path, rate=250.0).notes
    assert "`t_s` says 100 Hz, but --rate 250 is used" in note


def test_swapped_columns_are_hinted_at(tmp_path: Path) -> None:
    t = np.arange(4000) / 1000.0
    u = 3.0 * np.sin(2 * np.pi * t)
    y = actuator(u)
    for names, swapped in (("t_s,u_V,y_um", False), ("t_s,y_um,u_V", True), ("t_s,input,output", False)):
        path = tmp_path / "r.csv"
        columns = np.column_stack([t, u, y])
        np.savetxt(path, columns, delimiter=",", header=names, comments="", fmt="%.9g")
        options = {"input": "y_um", "output": "u_V"} if swapped else {}
        if swapped:
            np.savetxt(path, columns, delimiter=",", header="t_s,u_V,y_um", comments="", fmt="%.9g")
        notes = read_recording(path, **options).notes
        assert any("look swapped" in note for note in notes) == swapped
        if swapped:
            assert "use --input u_V --output y_um" in " ".join(notes)


def test_every_laboratory_file_is_in_the_corpus_that_is_mutated() -> None:
    from reader_corpus import corpus

    names = {seed.suffix for seed in corpus()}
    wanted: dict[str, Callable[[], bool]] = {
        ".h5": lambda: True,
        ".lvm": lambda: True,
        ".xlsx": lambda: importlib.util.find_spec("openpyxl") is not None,
        ".tdms": lambda: importlib.util.find_spec("nptdms") is not None,
        ".mf4": lambda: importlib.util.find_spec("asammdf") is not None,
    }
    assert {suffix for suffix, there in wanted.items() if there()} <= names
    assert io.BytesIO(next(seed.content for seed in corpus() if seed.suffix == ".lvm")).read(7) == b"LabVIEW"

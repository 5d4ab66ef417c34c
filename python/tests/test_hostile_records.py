"""Record files that anybody may have written: each is read correctly or refused with an error of the package.

The readers are also attacked with mutated files: here with some hundred, by `make fuzz-readers` with many.
"""

import gzip
import io
import os
import socket
import struct
import subprocess
import sys
import time
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path

import h5py
import numpy as np
import polars as pl
import pytest
import scipy.io

import gpi_hammerstein as gpi
from data_folder import DATA
from fuzz_readers import GOOD, attack, read
from gpi_hammerstein.io import apart, read_recording
from gpi_hammerstein.io.boundary import opened
from reader_corpus import corpus
from records import write_csv

CASES = DATA / "cases" / "readers"
needs_cases = pytest.mark.skipif(
    not CASES.is_dir(), reason=f"NO HOSTILE RECORDS in {CASES}: set GPI_DATA_DIR"
)

U = np.array([0.0, 1.0, 3.0, 2.0, 5.0])
Y = np.array([0.5, 1.5, 2.5, 2.0, 4.0])


def refused(path: Path, *words: str, **options: object) -> None:
    """Require a DataError with the name of the file, and that it comes quickly."""
    begin = time.monotonic()
    with pytest.raises(gpi.DataError) as caught:
        read_recording(path, **options)
    for word in (path.name, *words):
        assert word in str(caught.value), f"`{word}` is not in `{caught.value}`"
    assert time.monotonic() - begin < 5.0


@needs_cases
def test_hostile_records_are_read_or_refused() -> None:
    files = sorted(CASES.iterdir())
    assert len(files) > 50
    results = {path.name: read(path) for path in files}
    assert {name: result for name, result in results.items() if result[0] not in GOOD} == {}
    # Honest files among them, and corrupt ones that are still whole where a record is.
    assert sum(kind == "read" for kind, _ in results.values()) > 20


@needs_cases
@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("special-t_c.npz", "`u` is left out: it contains complex numbers"),
        ("special-r_str.npz", "`rate` is left out: it contains text"),
        ("special-r_neg.npz", "a sampling rate of -5 Hz"),
        ("special-h12.npy", "needs 8000000000000 bytes"),
        ("special-csv_epoch_ms_nounit.csv", "no time in seconds"),
        ("special-csv_tiny_dt.csv", "too close"),
        ("special-list.parquet", "List(Float64)"),
        ("special-nul.csv", "not a text file"),
    ],
)
def test_the_reason_is_stated(name: str, words: str) -> None:
    refused(CASES / name, words, rate=1.0 if name.endswith(".npy") else None)


def test_the_corpus_is_read(tmp_path: Path) -> None:
    for index, seed in enumerate(corpus()):
        path = tmp_path / f"r{index}{seed.suffix}"
        path.write_bytes(seed.pack(seed.content))
        assert read(path) == ("read", ""), seed.name


def test_mutated_records_are_read_or_refused() -> None:
    outcome = attack(number=340, seed=20261124, jobs=1)
    assert outcome.failed == []
    assert sum(outcome.counts.values()) == 340
    kinds = {kind for _, kind in outcome.counts}
    assert {"read", "DataError"} <= kinds  # the attack reaches both


def test_a_process_that_dies_or_blocks_is_counted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The attack itself is tested with a worker that dies, blocks, and answers wrongly."""
    script = tmp_path / "worker.py"
    script.write_text(
        "import os, sys, time\n"
        "indices = range(*map(int, sys.argv[-3:]))\n"
        "print('ready', flush=True)\n"
        "for index in indices:\n"
        "    if index == 3: os.abort()\n"
        "    if index == 5: time.sleep(60)\n"
        "    print(index, 'foreign' if index == 7 else 'read', 10, 'details', flush=True)\n"
    )
    monkeypatch.setattr("fuzz_readers.__file__", str(script))
    monkeypatch.setattr("fuzz_readers.HANG_SECONDS", 1.0)
    outcome = attack(number=10, seed=0, jobs=1)
    found = [(index, what.split(":")[0]) for index, what in outcome.failed]
    assert found == [(3, "signal"), (5, "hang"), (7, "foreign")]
    assert sum(n for (_, kind), n in outcome.counts.items() if kind == "read") == 7


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="the system has no such files")
@pytest.mark.parametrize("kind", ["folder", "pipe", "device", "socket"])
def test_special_files_are_refused_before_they_are_read(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "r.csv"
    match kind:
        case "folder":
            path.mkdir()
        case "pipe":
            os.mkfifo(path)
        case "device":
            path.symlink_to("/dev/zero")
        case "socket":
            with socket.socket(socket.AF_UNIX) as server:
                monkeypatch.chdir(tmp_path)  # the name of a socket must be short
                server.bind(path.name)
    refused(path, f"{path}: is a {kind}; a record is a regular file")


def test_a_name_with_a_zero_byte_is_refused(tmp_path: Path) -> None:
    with pytest.raises(gpi.DataError, match="not the name of a file"):
        read_recording(tmp_path / "r\0.csv")


def zeros_in(kind: str, size: int) -> tuple[str, bytes]:
    """Return a small file of a format that contains many zeros."""
    stream = io.BytesIO()
    match kind:
        case "CSV":
            row = b"0,0,0\n" * 1000
            text = b"t_s,u_V,y_um\n" + row * (size // len(row))
            return "r.csv.gz", gzip.compress(text)
        case "NPZ":
            np.savez_compressed(stream, u=np.zeros(size // 8), y=np.zeros(size // 8), rate=1.0)
            return "r.npz", stream.getvalue()
        case "MAT 5":
            scipy.io.savemat(stream, {"u": np.zeros((size // 8, 1)), "fs": 1.0}, do_compression=True)
            return "r.mat", stream.getvalue()
        case "MAT 7.3":
            with h5py.File(stream, "w") as file:
                file.create_dataset("u", data=np.zeros((1, size // 8)), compression="gzip")
            return "r.mat", stream.getvalue()
        case _:
            pl.DataFrame({"t_s": np.zeros(size // 8), "u": np.zeros(size // 8)}).write_parquet(stream)
            return "r.parquet", stream.getvalue()


@pytest.mark.parametrize("kind", ["CSV", "NPZ", "MAT 5", "MAT 7.3", "Parquet"])
def test_a_small_file_cannot_take_much_memory(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    name, content = zeros_in(kind, 20 << 20)
    assert len(content) < 1 << 20
    path = tmp_path / name
    path.write_bytes(content)
    refused(path, "100 times as large as the file", "GPI_MAX_READ_RATIO", rate=1.0)
    monkeypatch.setenv("GPI_MAX_READ_RATIO", "100000000")
    monkeypatch.setenv("GPI_MAX_READ_BYTES", str(18 << 20))
    refused(path, f"more than {18 << 20} bytes", "GPI_MAX_READ_BYTES", rate=1.0)
    monkeypatch.delenv("GPI_MAX_READ_BYTES")
    assert read_recording(path, rate=1.0).runs[0].u.max() == 0.0


def test_the_size_of_a_plain_file_is_limited(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "r.csv"
    with path.open("wb") as file:
        file.truncate(1 << 40)  # needs no space on the disk
    refused(path, "GPI_MAX_READ_BYTES")
    monkeypatch.setenv("GPI_MAX_READ_BYTES", "1e9")
    with pytest.raises(gpi.ParameterError, match="GPI_MAX_READ_BYTES"):
        read_recording(path)


def test_the_number_of_columns_is_limited(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "r.csv"
    names = [f"c{index}" for index in range(20_000)]
    rows = "".join(f"{row / 10},1,2{',0' * 20_000}\n" for row in range(4))
    path.write_text(f"{','.join(['t_s', 'u_V', 'y_um', *names])}\n{rows}")
    refused(path, "has 20003 columns, more than 1000", "GPI_MAX_READ_COLUMNS")
    np.savez(tmp_path / "r.npz", u=np.zeros((2000, 1001)), rate=1.0)
    refused(tmp_path / "r.npz", "has 1001 columns")
    monkeypatch.setenv("GPI_MAX_READ_COLUMNS", "30000")
    begin = time.monotonic()
    assert len(read_recording(path).covariates) == 20_000
    assert time.monotonic() - begin < 15.0


@pytest.fixture
def other_file(tmp_path: Path) -> Iterator[Path]:
    path = tmp_path / "secret.h5"
    with h5py.File(path, "w") as file:
        file.create_dataset("u", data=U[None, :])
    (tmp_path / "raw.bin").write_bytes(U.tobytes())
    yield path


@pytest.mark.parametrize("kind", ["external link", "soft link", "external storage", "virtual"])
def test_a_record_contains_its_samples_itself(kind: str, other_file: Path, tmp_path: Path) -> None:
    path = tmp_path / "r.mat"
    with h5py.File(path, "w") as file:
        file.create_dataset("y", data=Y[None, :])
        match kind:
            case "external link":
                file["u"] = h5py.ExternalLink(str(other_file), "/u")
            case "soft link":
                file["u"] = h5py.SoftLink("/y")
            case "external storage":
                raw = [(str(tmp_path / "raw.bin"), 0, U.nbytes)]
                file.create_dataset("u", (1, len(U)), "f8", external=raw)
            case "virtual":
                layout = h5py.VirtualLayout((1, len(U)), "f8")
                layout[:] = h5py.VirtualSource(str(other_file), "u", (1, len(U)))
                file.create_virtual_dataset("u", layout)
    refused(path, "`u`", rate=1.0)
    # The files are what they seem: without the check, the library reads the other file.
    with h5py.File(path) as file:
        assert file["u"].shape == (1, len(U))


def test_sizes_that_a_file_only_claims_are_not_allocated(tmp_path: Path) -> None:
    path = tmp_path / "r.mat"
    with h5py.File(path, "w") as file:
        file.create_dataset("u", (1, 1 << 20), "f8", chunks=(1, 1 << 10))
    refused(path, "never written", rate=1.0)
    with h5py.File(path, "w") as file:
        file.create_dataset("u", (1, 1 << 50), "f8", chunks=(1, 1 << 10))
    refused(path, "GPI_MAX_READ_BYTES", rate=1.0)


@pytest.mark.parametrize("compressed", [False, True])
def test_mat_5_is_read_as_scipy_reads_it(compressed: bool, tmp_path: Path) -> None:
    random = np.random.default_rng(0)
    whole = {
        name: random.integers(0, 100, (7, 2)).astype(name)
        for name in ("int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64", "bool")
    }
    arrays = whole | {
        "u": random.normal(size=(7, 1)),
        "single": random.normal(size=(7, 3)).astype("f4"),
        "periods": random.normal(size=(7, 2, 1)),
        "small": np.arange(7.0),
        "a_name_that_is_long_enough_for_a_long_element": random.normal(size=(1, 7)),
    }
    others = {"s": {"a": 1.0}, "c": np.array([1, "x"], dtype=object), "text": "words", "z": np.zeros(7) * 1j}
    others["sparse"] = scipy.sparse.csc_matrix(np.eye(7))
    path = tmp_path / "r.mat"
    scipy.io.savemat(
        path, arrays | others, do_compression=compressed, oned_as="column", long_field_names=True
    )
    reference = scipy.io.loadmat(path)
    recording = read_recording(path, rate=1.0)
    columns = dict(zip([c.header for c in recording.covariates], recording.runs[0].covariates.T, strict=True))
    for name in arrays.keys() - {"u"}:
        for channel in range(reference[name].reshape(7, -1).shape[1]):
            header = name if reference[name].size == 7 else f"{name}{channel + 1}"
            np.testing.assert_array_equal(columns[header], reference[name].reshape(7, -1)[:, channel])
    np.testing.assert_array_equal(recording.runs[0].u, arrays["u"])
    assert {note.split("`")[1] for note in recording.notes} == set(others)


def test_mat_5_of_the_other_byte_order_and_mat_4_are_read(tmp_path: Path) -> None:
    def element(kind: int, data: bytes) -> bytes:
        return struct.pack(">II", kind, len(data)) + data + bytes(-len(data) % 8)

    def variable(name: str, values: np.ndarray) -> bytes:
        parts = element(6, struct.pack(">II", 6, 0)) + element(5, struct.pack(">ii", len(values), 1))
        return element(14, parts + element(1, name.encode()) + element(9, values.astype(">f8").tobytes()))

    path = tmp_path / "big.mat"
    header = b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack(">H", 0x0100) + b"MI"
    path.write_bytes(header + variable("u", U) + variable("y", Y))
    assert scipy.io.loadmat(path)["u"].ravel().tolist() == U.tolist()  # the file is what it claims to be
    np.testing.assert_array_equal(read_recording(path, rate=1.0).runs[0].u[:, 0], U)

    for order in "<>":
        four = tmp_path / "four.mat"
        content = b""
        for name, values in (("u", U), ("y", Y)):
            content += struct.pack(f"{order}5i", 1000 * (order == ">"), len(values), 1, 0, 2)
            content += name.encode() + b"\0" + values.astype(f"{order}f8").tobytes()
        four.write_bytes(content)
        assert scipy.io.loadmat(four)["u"].ravel().tolist() == U.tolist()
        record = gpi.read_record(four, rate=1.0)
        np.testing.assert_array_equal(record.u[0][:, 0], U)
        np.testing.assert_array_equal(record.y[0][:, 0], Y)


def test_texts_of_other_systems_are_read(tmp_path: Path) -> None:
    plain = write_csv(tmp_path / "r.csv", {"t_s": np.arange(5) * 0.1, "u_V": U, "y_um": Y}).read_text()
    for index, content in enumerate(
        [
            plain.replace("\n", "\r").encode(),
            plain.replace("\n", "\r\n").encode("utf-16"),
            gzip.compress(plain[:40].encode()) + gzip.compress(plain[40:].encode()) + bytes(9),
        ]
    ):
        path = tmp_path / f"r{index}.csv"
        path.write_bytes(content)
        record = gpi.read_record(path)
        np.testing.assert_array_equal(record.u[0][:, 0], U)
        np.testing.assert_array_equal(record.y[0][:, 0], Y)


def test_corrupt_compressed_data_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "r.csv.gz"
    whole = gzip.compress(b"t_s,u,y\n0,1,2\n1,2,3\n2,3,4\n")
    for content, words in (
        (whole[:-9], "incomplete"),
        (whole[:-8] + b"\0\0\0\0" + whole[-4:], "incorrect data check"),
        (whole + b"other", "incorrect header"),
    ):
        path.write_bytes(content)
        refused(path, "cannot be read as CSV", words)
    path = tmp_path / "r.npz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_BZIP2) as archive:
        archive.writestr("u.npy", b"0" * 1000)
    refused(path, "a method that NumPy does not use", rate=1.0)


def write_parquet(path: Path) -> Path:
    pl.DataFrame({"t_s": np.arange(5) * 0.1, "u_V": U, "y_um": Y}).write_parquet(path)
    return path


def test_a_library_that_ends_its_process_or_blocks_does_not_end_this_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write_parquet(tmp_path / "r.parquet")
    reader = apart.Reader()
    monkeypatch.setattr(apart, "_READER", reader)
    for program, words in (
        ("import os; input(); os.abort()", "the process that reads it ended with code -6"),
        ("print('{\"tables\":', flush=True)", "JSONDecodeError"),
        ("import time; time.sleep(60)", "GPI_MAX_READ_SECONDS"),
    ):
        monkeypatch.setattr(apart, "SERVER", ("-c", program))
        monkeypatch.setenv("GPI_MAX_READ_SECONDS", "1" if "sleep" in program else "100")
        with pytest.raises(gpi.DataError, match=r"r\.parquet: cannot be read as Parquet") as caught:
            read_recording(path)
        assert words in f"{caught.value} {type(caught.value.__cause__).__name__}"
        assert reader.process is None
    monkeypatch.undo()
    monkeypatch.setattr(apart, "_READER", reader)

    def interrupt(stream: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(apart, "receive", interrupt)
    with pytest.raises(KeyboardInterrupt):
        read_recording(path)
    monkeypatch.undo()
    monkeypatch.setattr(apart, "_READER", reader)
    # The answer to the request that was interrupted is not taken for the next one.
    other = tmp_path / "other.parquet"
    pl.DataFrame({"t_s": np.arange(5) * 0.1, "u_V": 2 * U, "y_um": Y}).write_parquet(other)
    np.testing.assert_array_equal(gpi.read_record(other).u[0][:, 0], 2 * U)
    first = reader.process
    np.testing.assert_array_equal(gpi.read_record(path).u[0][:, 0], U)
    assert reader.process is first  # one process reads all files
    reader.close()


def test_the_other_process_knows_folder_and_limits(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_parquet(tmp_path / "r.parquet")
    monkeypatch.chdir(tmp_path)
    assert len(read_recording("r.parquet").runs[0].u) == 5
    monkeypatch.setenv("GPI_MAX_READ_COLUMNS", "2")
    with pytest.raises(gpi.DataError, match=r"^r\.parquet: has 3 columns, more than 2"):
        read_recording("r.parquet")


@pytest.mark.skipif(not hasattr(os, "fork"), reason="the system has no fork")
def test_records_are_read_after_a_fork(tmp_path: Path) -> None:
    path = write_parquet(tmp_path / "r.parquet")
    program = (
        "import os, sys\n"
        "import gpi_hammerstein as gpi\n"
        "gpi.read_record(sys.argv[1])\n"
        "child = os.fork()\n"
        "gpi.read_record(sys.argv[1])\n"
        "code = 0 if child == 0 else os.waitpid(child, 0)[1]\n"
        "gpi.read_record(sys.argv[1])\n"
        "sys.exit(code)\n"
    )
    words = [sys.executable, "-W", "error", "-c", program, str(path)]
    found = subprocess.run(words, capture_output=True, text=True, timeout=60, check=False)
    assert (found.returncode, found.stderr) == (0, "")


class PanicException(BaseException):  # noqa: N818 (the name of the exception of Rust bindings)
    """Stands for the panic of a library, whose class cannot be imported."""


def test_panics_are_translated_and_interruptions_are_not(tmp_path: Path) -> None:
    path = tmp_path / "r.csv"
    path.write_text("t,u\n0,1\n1,2\n")
    for error, words in (
        (PanicException("index out of bounds"), "index out of bounds"),
        (MemoryError(), "not enough memory"),
        (RecursionError("too deep"), "too deep"),
        (KeyError("u"), "KeyError: 'u'"),
        (zlib.error("a\x1b[31m\nb"), "a\\x1b[31m"),
    ):
        with pytest.raises(gpi.DataError, match=r"r\.csv: cannot be read as CSV") as caught:
            with opened(path, "CSV"):
                raise error
        assert words in str(caught.value) and caught.value.__cause__ is error
    for stop in (KeyboardInterrupt, SystemExit, GeneratorExit):
        with pytest.raises(stop), opened(path, "CSV"):
            raise stop
    for ours in (gpi.ParameterError("as it is"), gpi.DataError("as it is")):
        with pytest.raises(type(ours), match="^as it is$"), opened(path, "CSV"):
            raise ours


def test_the_command_of_the_attack_reports_counts() -> None:
    words = [sys.executable, "fuzz_readers.py", "--number", "17", "--seed", "1", "--jobs", "1"]
    tools = Path(__file__).resolve().parents[2] / "tools"
    found = subprocess.run(words, cwd=tools, capture_output=True, text=True, check=False)
    assert found.returncode == 0, found.stdout + found.stderr
    assert "17 mutated files, seed 1" in found.stdout and "| signal" in found.stdout


def test_a_workbook_cannot_repeat_a_text_without_limit(tmp_path: Path) -> None:
    """A workbook stores a text once, and many cells can refer to it: 300 kB of text become 300 MB."""
    pytest.importorskip("openpyxl")
    import reader_corpus

    seed = reader_corpus.workbook(reader_corpus.signals())
    row = '<row r="{0}"><c r="A{0}" t="s"><v>0</v></c><c r="B{0}"><v>1</v></c><c r="C{0}"><v>2</v></c></row>'
    sheet = seed.content[: seed.content.index(b"<row")]
    sheet += "".join(row.format(place) for place in range(1, 1001)).encode() + b"</sheetData></worksheet>"
    path = tmp_path / "r.xlsx"
    path.write_bytes(seed.pack(sheet))
    with zipfile.ZipFile(path) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    text = b"x" * 300_000
    members["xl/sharedStrings.xml"] = (
        b'<sst xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"><si><t>'
        + text
        + b"</t></si></sst>"
    )
    kind = b"application/vnd.openxmlformats-officedocument.spreadsheetml.sharedStrings+xml"
    entry = b'<Override PartName="/xl/sharedStrings.xml" ContentType="' + kind + b'"/></Types>'
    types = "[Content_Types].xml"
    if b"sharedStrings" not in members[types]:
        members[types] = members[types].replace(b"</Types>", entry)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in members.items():
            archive.writestr(name, data)
    refused(path, "times as large as the file")


def test_a_workbook_of_claimed_size_is_read_in_its_real_size(tmp_path: Path) -> None:
    pytest.importorskip("openpyxl")
    import reader_corpus

    seed = reader_corpus.workbook(reader_corpus.signals())
    path = tmp_path / "r.xlsx"
    path.write_bytes(seed.pack(seed.content.replace(b'ref="A1:C61"', b'ref="A1:XFD1048576"')))
    assert b"XFD1048576" not in seed.content and read(path) == ("read", "")
    far = seed.content.replace(b'<c r="C61"', b'<c r="XFD61"')
    assert far != seed.content
    path.write_bytes(seed.pack(far))
    refused(path, "has 16384 columns, more than 1000")


def test_groups_of_hdf5_that_form_a_circle_are_read_once(tmp_path: Path) -> None:
    path = tmp_path / "r.h5"
    with h5py.File(path, "w") as file:
        run = file.create_group("run")
        run["u_V"], run["y_um"] = U, Y
        run.attrs["dt"] = 0.5
        run["again"] = file  # a hard link to the root
    recording = read_recording(path)
    assert recording.rate == 2.0
    np.testing.assert_array_equal(recording.runs[0].u[:, 0], U)
    with h5py.File(path, "a") as file:
        file["soft"] = h5py.SoftLink("/run/u_V")
    refused(path, "a link to another object or file")

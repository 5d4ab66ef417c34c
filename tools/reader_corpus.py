"""Record files of every format, and mutations of them, for attacks on the readers.

A mutation is a function of two numbers, the seed of the run and its index, so that each can be made again.
"""

import contextlib
import gzip
import io
import struct
import zipfile
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

SAMPLES = 60
# Numbers that are wrong as a size, an offset or a type.
EXTREME = [
    b"\0" * 8,
    b"\xff" * 8,
    b"\xff\xff\xff\x7f\0\0\0\0",
    b"\0" * 7 + b"\x80",
    b"\xff" * 7 + b"\x7f",
    b"\1",
]


@dataclass(frozen=True)
class Seed:
    """A valid file, `pack(content)`. Its content is also mutated, so that checksums do not stop attacks."""

    name: str
    """Name of the format, for tables."""
    suffix: str
    content: bytes
    pack: Callable[[bytes], bytes] = bytes


def signals() -> dict[str, np.ndarray]:
    """Return the columns of the record that every file contains."""
    t = np.arange(SAMPLES) * 0.01
    return {"t_s": t, "u_V": 3 * np.sin(7 * t), "y_um": np.cos(5 * t)}


def corpus() -> list[Seed]:
    """Return one file of every kind that the readers distinguish."""
    return [*texts(), *numpy_files(), *mat_files(), *parquet_files(), *laboratory_files()]


def texts() -> Iterator[Seed]:
    columns = signals()
    rows = list(zip(*columns.values(), strict=True))
    comma = "\n".join([",".join(columns), *(",".join(map(repr, map(float, row))) for row in rows)]).encode()
    cells = [";".join(f"{value:.6e}".replace(".", ",") for value in row) for row in rows]
    logger = "\r\n".join(['Recorder "7";b\xb0', "# averaged", "t;u;y", "s;V;um", *cells]).encode("latin-1")
    yield Seed("CSV", ".csv", comma)
    yield Seed("CSV", ".csv", logger)
    yield Seed("CSV", ".csv", comma.decode().encode("utf-16"))
    yield Seed("CSV gz", ".csv.gz", comma, lambda content: gzip.compress(content, mtime=0))


def numpy_files() -> Iterator[Seed]:
    columns = signals()

    def npy(array: np.ndarray) -> bytes:
        stream = io.BytesIO()
        np.save(stream, array)
        return stream.getvalue()

    def npz(content: bytes, write: Callable[..., None] = np.savez) -> bytes:
        """Put the mutated array `u_V` into an archive with valid checksums."""
        kind = zipfile.ZIP_STORED if write is np.savez else zipfile.ZIP_DEFLATED
        stream = io.BytesIO()
        with zipfile.ZipFile(stream, "w", kind) as archive:
            for name, array in columns.items():
                data = content if name == "u_V" else npy(array)
                archive.writestr(zipfile.ZipInfo(f"{name}.npy"), data, kind)
        return stream.getvalue()

    yield Seed("NPZ", ".npz", npy(columns["u_V"]), npz)
    yield Seed("NPZ", ".npz", npy(columns["u_V"]), lambda content: npz(content, np.savez_compressed))
    yield Seed("NPY", ".npy", npy(columns["u_V"]))
    yield Seed("NPY", ".npy", npy(np.asfortranarray(np.outer(columns["u_V"], [1, 2]).reshape(SAMPLES, 1, 2))))


def mat_files() -> Iterator[Seed]:
    import h5py
    import scipy.io

    arrays = {name: values[:, None] for name, values in signals().items()}
    more = {"info": {"gain": 2.0, "note": "text"}, "parts": np.array([1, "two"], dtype=object)}

    def mat5(contents: dict[str, object]) -> bytes:
        stream = io.BytesIO()
        scipy.io.savemat(stream, contents)
        # The header contains the time of writing, which would change the corpus.
        return b"MATLAB 5.0 MAT-file".ljust(116) + stream.getvalue()[116:]

    def compressed(content: bytes) -> bytes:
        """Compress each variable of a file as one element, as MATLAB does."""
        place, result = 128, content[:128]
        while place + 8 <= len(content):
            size = 8 + min(int.from_bytes(content[place + 4 : place + 8], "little"), len(content))
            data = zlib.compress(content[place : place + size])
            result += struct.pack("<II", 15, len(data)) + data
            place += size
        return result

    yield Seed("MAT 5", ".mat", mat5(arrays))
    yield Seed("MAT 5", ".mat", mat5(arrays | more))
    yield Seed(
        "MAT 5",
        ".mat",
        mat5({"y": np.outer(signals()["y_um"], [1, 2]), "u": signals()["u_V"], "fs": 100.0}),
        compressed,
    )
    four = io.BytesIO()
    scipy.io.savemat(four, arrays, format="4")
    yield Seed("MAT 4", ".mat", four.getvalue())
    for options in ({}, {"chunks": (1, SAMPLES), "compression": "gzip", "shuffle": True, "fletcher32": True}):
        stream = io.BytesIO()
        with h5py.File(stream, "w", userblock_size=512) as file:
            for name, values in arrays.items():
                data = file.create_dataset(name, data=values.T, **options)
                data.attrs["MATLAB_class"] = np.bytes_("double")
            file.create_group("info").attrs["MATLAB_class"] = np.bytes_("struct")
        header = b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM"
        yield Seed("MAT 7.3", ".mat", header + stream.getvalue()[len(header) :])


def parquet_files() -> Iterator[Seed]:
    import polars as pl

    frame = pl.DataFrame(signals())
    text = frame.with_columns(pl.col("u_V").cast(pl.String))
    repeated = frame.with_columns(pl.Series("y_um", [1.0, 2.0, 3.0] * (SAMPLES // 3)))
    for data, compression in ((frame, "uncompressed"), (text, "snappy"), (repeated, "zstd")):
        stream = io.BytesIO()
        data.write_parquet(stream, compression=compression)
        yield Seed("Parquet", ".parquet", stream.getvalue())


def laboratory_files() -> Iterator[Seed]:
    """Files of measurement programs; those whose library is not installed are left out."""
    import h5py

    columns = signals()
    stream = io.BytesIO()
    with h5py.File(stream, "w") as file:
        run = file.create_group("run")
        run.attrs["fs"] = 100.0
        run.create_dataset("drive", data=columns["u_V"]).attrs["units"] = "V"
        run.create_dataset("sensor", data=columns["y_um"], chunks=(SAMPLES,), compression="gzip")
    yield Seed("HDF5", ".h5", stream.getvalue())
    lines = ["LabVIEW Measurement", "Separator\tTab", "Decimal_Separator\t,", "***End_of_Header***\t", ""]
    lines += [
        "Channels\t2\t",
        "Y_Unit_Label\tVolts\tum\t",
        "Delta_X\t0,01\t0,01\t",
        "***End_of_Header***\t\t",
    ]
    lines += ["X_Value\tDrive\tSensor\tComment"]
    lines += [
        "\t".join(f"{value:.6f}".replace(".", ",") for value in row)
        for row in zip(*columns.values(), strict=True)
    ]
    yield Seed("LVM", ".lvm", "\r\n".join(lines).encode())
    for make in (workbook, tdms, mdf):
        with contextlib.suppress(ImportError):
            yield make(columns)


def workbook(columns: dict[str, np.ndarray]) -> Seed:
    """Return an Excel workbook; the XML of the sheet is mutated in an archive with valid checksums."""
    import openpyxl

    book = openpyxl.Workbook()
    book.active.append(list(columns))
    for row in zip(*columns.values(), strict=True):
        book.active.append([float(value) for value in row])
    stream = io.BytesIO()
    book.save(stream)
    with zipfile.ZipFile(stream) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    sheet = "xl/worksheets/sheet1.xml"

    def pack(content: bytes) -> bytes:
        packed = io.BytesIO()
        with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, data in members.items():
                # docProps contains the time of writing, which would change the corpus.
                if not name.startswith("docProps"):
                    archive.writestr(zipfile.ZipInfo(name), content if name == sheet else data)
        return packed.getvalue()

    return Seed("XLSX", ".xlsx", members[sheet], pack)


def tdms(columns: dict[str, np.ndarray]) -> Seed:
    import nptdms

    stream = io.BytesIO()
    with nptdms.TdmsWriter(stream) as writer:
        writer.write_segment(
            [
                nptdms.ChannelObject("run", name, columns[name], {"wf_increment": 0.01})
                for name in ("u_V", "y_um")
            ]
        )
    return Seed("TDMS", ".tdms", stream.getvalue())


def mdf(columns: dict[str, np.ndarray]) -> Seed:
    import datetime

    import asammdf

    stream = io.BytesIO()
    with asammdf.MDF(version="4.10") as file:
        file.start_time = datetime.datetime(2026, 1, 1, tzinfo=datetime.UTC)
        file.append(
            [
                asammdf.Signal(samples=columns[name], timestamps=columns["t_s"], name=name)
                for name in ("u_V", "y_um")
            ]
        )
        file.save(stream)
    return Seed("MDF", ".mf4", stream.getvalue())


def mutation(seeds: list[Seed], seed: int, index: int) -> tuple[str, bytes]:
    """Return the suffix and the content of one mutated file."""
    random = np.random.default_rng([seed, index])
    original = seeds[index % len(seeds)]
    if random.random() < 0.4:
        return original.suffix, original.pack(mutated(original.content, random))
    return original.suffix, mutated(original.pack(original.content), random)


def mutated(data: bytes, random: np.random.Generator) -> bytes:
    """Change the bytes in one way, or more rarely in several ways."""
    result = bytearray(data)
    for _ in range(random.geometric(0.6)):
        if not result:
            break
        place, other = (int(where) for where in random.integers(len(result), size=2))
        if random.random() < 0.5:  # headers and footers decide more than samples
            near = place % 256
            place = min(near, len(result) - 1) if random.random() < 0.5 else max(0, len(result) - 1 - near)
        length = int(random.choice([1, 2, 4, 8, 16, 64, 256]))
        match random.integers(7):
            case 0:
                for where in random.integers(len(result), size=random.integers(1, 9)):
                    result[where] ^= 1 << random.integers(8)
            case 1:
                result[place] = random.integers(256)
            case 2:
                del result[place:]
            case 3:
                result[place : place + length] = result[other : other + length]
            case 4:
                result[place:place] = random.bytes(length)
            case 5:
                del result[place : place + length]
            case 6:
                extreme = EXTREME[random.integers(len(EXTREME))][: int(random.choice([1, 2, 4, 8]))]
                result[place : place + len(extreme)] = extreme
    return bytes(result)

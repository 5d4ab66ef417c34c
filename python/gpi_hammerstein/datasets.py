"""Measured records that anybody may use, from their public addresses.

The files are downloaded from the addresses of their authors and checked by their SHA-256. If `GPI_DATA_DIR`
names a folder, this folder and its subfolder `measured` are searched first, so that no network is needed.
They contain one folder for each set.
"""

import hashlib
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gpi_hammerstein._native import DataError, ParameterError, Record
from gpi_hammerstein.io import read_record

__all__ = ["CATALOGUE", "Dataset", "fetch", "load"]


@dataclass(frozen=True)
class Dataset:
    """A set of records.

    Parameters
    ----------
    what
        A description of the measurement.
    authors, licence, home
        The authors, the licence, and the web page that describes the set.
    address
        The address of its files.
    files
        The SHA-256 of each file, by its path below `address`.
    parts
        The parts that `load` can return: the files of each part, and the function that makes a record of
        them.

    Examples
    --------
    >>> gpi.datasets.CATALOGUE["throttle-valve"].licence
    'BSD-3-Clause'
    """

    what: str
    authors: str
    licence: str
    home: str
    address: str
    files: Mapping[str, str]
    parts: Mapping[str, tuple[tuple[str, ...], Callable[..., Record]]]


def piezo(path: Path) -> Record:
    """Read a table without header. Column 1 is the drive, column 5 is the capacitive sensor."""
    table = np.loadtxt(path)
    return Record(table[:, 0], table[:, 4], 200.0, input_units=["V"], output_units=["um"])


def mirror(u: Path, y: Path) -> Record:
    """Read realisations of two periods. The first period is warm-up."""
    record = read_record(u, output=str(y), rate=6400.0)
    return Record(
        record.u,
        [1e6 * y for y in record.y],
        record.rate,
        warmup=record.warmup,
        input_units=["V"] * 3,
        output_units=["um"] * 3,
    )


def throttle(path: Path) -> Record:
    """Read the signals of a MAT file."""
    return read_record(path, rate=100.0)


def level(millivolts: int) -> tuple[tuple[str, ...], Callable[..., Record]]:
    """Return the files of one amplitude, and the function that reads them."""
    return tuple(f"data/{name}_{millivolts}mV_train.npy" for name in "uy"), mirror


MODEL, TEST = (
    f"MatLabCode/DiscreteBacklashModel/{name}_Vi_Do{end}.dat"
    for name, end in (("Model", ""), ("Test", "_Di"))
)
THROTTLES = ("Examples/Data/Throttle1.mat", "Examples/Data/Throttle3.mat")

CATALOGUE: dict[str, Dataset] = {
    "piezo-p885-dbo": Dataset(
        what="a piezo stack PI P-885.91 at 200 Hz: a full-scale sine, and a sine of varying amplitude",
        authors="Yan Naing Aye",
        licence="MIT",
        home="https://github.com/yan9a/DiscreteBacklashOperator",
        address="https://github.com/yan9a/DiscreteBacklashOperator/raw/79fd060d86cdf69be2388e29bf57b0766c273650/",
        files={
            MODEL: "672714f09302b892721aa44d72f337a7ee1a0eb1d107f4d6797ab47d849428ae",
            TEST: "6c33cb76d3f6e12f5074626710f71aeb43d8411a5ad0a56469ad01904221aae5",
        },
        parts={"model": ((MODEL,), piezo), "test": ((TEST,), piezo)},
    ),
    "piezo-fsm-cubespec": Dataset(
        what="a fast steering mirror, 3 piezos to 3 displacements at 6.4 kHz, multisines of three amplitudes",
        authors="Merijn Floren, KU Leuven",
        licence="CC-BY-4.0",
        home="https://github.com/merijnfloren/fsm-benchmark-data",
        address="https://github.com/merijnfloren/fsm-benchmark-data/raw/539a12fef384b086a8562b500498b2fa3899ef70/",
        files={
            "data/u_100mV_train.npy": "a53d6ee47ac1ea784c70e7634ce816467fb61effd8706eaf6b52f68142380a81",
            "data/y_100mV_train.npy": "06892ff7fc943712898d7ca741205e4d6574bec2a20e69a0052f986c27bd10ad",
            "data/u_200mV_train.npy": "59356f9b403b839231cf903acf6c99df33e0f4fbc820f4edd44dc169ac38dd3e",
            "data/y_200mV_train.npy": "b25b16b07fdbc7980bab4e98906ddaf2eaee41be0957c8911a469c3c426479d1",
            "data/u_300mV_train.npy": "0436437998307e8f8c86f824c1fee4e225f212861878bf58d42b2a5e2ecd0cb5",
            "data/y_300mV_train.npy": "38acb224027e728d7a3c44a0ce5538fcb74c836be585a1b318a6728c8a6820fb",
        },
        parts={f"{millivolts}mV": level(millivolts) for millivolts in (100, 200, 300)},
    ),
    "throttle-valve": Dataset(
        what="an engine throttle with friction at the output, random steps at 100 Hz; no Hammerstein system",
        authors="Axel Dürrbaum, University of Kassel",
        licence="BSD-3-Clause",
        home="https://github.com/MRT-RT/TS_Toolbox",
        address="https://github.com/MRT-RT/TS_Toolbox/raw/50938d18ccf2b84959d90fe7a424c4e3ac998096/",
        files={
            THROTTLES[0]: "86ea31f72b1c5e8e39df43c0c8e85bac66ac68d3fc38954bb9ee64775079a663",
            THROTTLES[1]: "a6b4c9516c6c55a6c0c79f22fcb2d4b18dd4e9c8f89403b607fec3bac804fc52",
        },
        parts={"1": ((THROTTLES[0],), throttle), "3": ((THROTTLES[1],), throttle)},
    ),
}


def fetch(name: str, part: str | None = None) -> list[Path]:
    """Return the files of a set, and download those that are missing.

    Parameters
    ----------
    name
        A name of `CATALOGUE`.
    part
        One of its parts; None takes the first one.

    Returns
    -------
    list of Path
        The files, in the folder `GPI_DATA_DIR` or in the cache of the user.

    Raises
    ------
    ParameterError
        The set or the part does not exist.
    DataError
        A file cannot be downloaded, or its SHA-256 is wrong.

    Examples
    --------
    >>> gpi.datasets.fetch("throttle-valve", "3")  # doctest: +SKIP
    """
    dataset, part = chosen(name, part)
    return [here(name, path) or fetched(dataset, path) for path in dataset.parts[part][0]]


def load(name: str, part: str | None = None) -> Record:
    """Return a record of a set.

    Parameters
    ----------
    name
        A name of `CATALOGUE`.
    part
        One of its parts; None takes the first one.

    Returns
    -------
    Record
        The record, with the units that the authors state.

    Raises
    ------
    ParameterError, DataError
        As in `fetch`.

    Examples
    --------
    >>> record = gpi.datasets.load("piezo-p885-dbo")  # doctest: +SKIP
    """
    dataset, own = chosen(name, part)
    return dataset.parts[own][1](*fetch(name, own))


def chosen(name: str, part: str | None) -> tuple[Dataset, str]:
    """Return the set and the name of the part."""
    if name not in CATALOGUE:
        raise ParameterError(f"`name` = {name}: must be one of {', '.join(CATALOGUE)}")
    dataset = CATALOGUE[name]
    part = part or next(iter(dataset.parts))
    if part not in dataset.parts:
        raise ParameterError(f"`part` = {part}: {name} has {', '.join(dataset.parts)}")
    return dataset, part


def here(name: str, path: str) -> Path | None:
    """Return the file below `GPI_DATA_DIR`, or None. A file with a wrong SHA-256 is an error."""
    folder = os.environ.get("GPI_DATA_DIR")
    for place in (Path(folder) / "measured" / name, Path(folder) / name) if folder else ():
        file = place / Path(path).name
        if file.is_file():
            if hashlib.sha256(file.read_bytes()).hexdigest() == CATALOGUE[name].files[path]:
                return file
            raise DataError(
                f"{file}: not the file of the set {name}, because its SHA-256 is different; remove it"
            )
    return None


def fetched(dataset: Dataset, path: str) -> Path:
    """Return the file in the cache of the user, and download it if it is not there."""
    import pooch

    address = dataset.address + path
    try:
        return Path(
            pooch.retrieve(address, f"sha256:{dataset.files[path]}", path=pooch.os_cache("gpi-hammerstein"))
        )
    except Exception as error:
        raise DataError(
            f"{address}: cannot be downloaded ({type(error).__name__}: {error}); without a network, put the "
            "file into a folder with the name of the set, and set GPI_DATA_DIR to the parent of this folder"
        ) from None

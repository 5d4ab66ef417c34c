"""The public benchmarks that can be reproduced: their files, splits, known physics and published errors.

Each benchmark reads the public file if it is in the folder, else the parts of it under their own names
(``train.csv.gz``), else it downloads the public file. The friction damper is read from the data folder only.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gpi_hammerstein._native import Record
from gpi_hammerstein.io import read_record
from gpi_hammerstein.reproduce import bouc_wen
from gpi_hammerstein.reproduce.benchmark_data import fetch
from gpi_hammerstein.reproduce.public import TRAINING, Benchmark

Array = NDArray[np.float64]

PUBLIC = {
    "SNLS80mV.mat": (
        "https://github.com/liouvill/PgDMM/raw/98346df8b4dffb6dbb932745cac6fa6917d5d594/silverbox_pgdmm/",
        "5c7413a52255af0cb4e2f93fb6903beb92b08965ba1e6ad0a6ffedfed8477ed4",
    ),
    "DATA_EMPS.mat": (
        "https://github.com/forgi86/sysid-neural-continuous/raw/956aa7ecd73061b0321c6f6098d74c9e4a7ce67a/"
        "examples/EMPS/data/",
        "6cf6814ae14618795da0101aae2bb97ff0c6351b0501b5492751b02b07facf7e",
    ),
    "dataBenchmark.csv": (
        "https://github.com/forgi86/sysid-neural-structures-fitting/raw/"
        "886c969c03e86422b8a81d9e826b5745a4934bb0/examples/CTS_example/data/",
        "ef2388ed822f3aef4aa80d6b0f2b466dd80b361786b3eafc7a2957c31ea323a7",
    ),
    "train.h5": (
        "https://github.com/forgi86/dynonet/raw/56699401b141065a45403a18977333e0ec8d7303/examples/BW/data/"
        "Test%20signals/",
        "a4df68f6101a22f9fc5032e98b3e773fc108a291378ef9cf69d1b128c7ac44a4",
    ),
}


def public(name: str, folder: Path) -> Path:
    """Return a public file, from the folder or from a download that is checked."""
    address, digest = PUBLIC[name]
    return fetch(address, {name: digest}, folder)[0]


def read_parts(folder: Path, parts: Mapping[str, str], columns: tuple[str, str]) -> dict[str, Record]:
    """Read parts that are files of their own."""
    u, y = columns
    return {name: read_record(folder / own, input=u, output=y, covariate=[]) for name, own in parts.items()}


def silverbox(folder: Path) -> dict[str, Record]:
    """Read two realisations of the multisine for the fit, another one, and the growing noise (the arrow)."""
    files = {TRAINING: "train.csv.gz", "validation": "valid.csv.gz"}
    if _has_parts(folder, "SNLS80mV.mat", files):
        return read_parts(folder, files, ("u_V", "y_V"))
    from scipy.io import loadmat

    content = loadmat(public("SNLS80mV.mat", folder))
    u, y = (np.ravel(content[name]).astype(np.float64) for name in ("V1", "V2"))
    rate = 1e7 / 2**14
    samples = {
        TRAINING: slice(40550, 58050),
        "validation": slice(118700, 127400),
        "arrow": slice(0, 40575),
    }
    return {name: _record(u[own], y[own], rate, "V", "V") for name, own in samples.items()}


def bouc_wen_parts(folder: Path) -> dict[str, Record]:
    """Read a multisine with noise for the fit; compute tests without noise from the published equations."""
    files = {TRAINING: "train_multisine.csv.gz"}
    if _has_parts(folder, "train.h5", files):
        training = read_parts(folder, files, ("u_N", "y_mm"))[TRAINING]
    else:
        import h5py

        with h5py.File(public("train.h5", folder)) as content:
            u, y = (np.ravel(content[name]).astype(np.float64) for name in ("u", "y"))
        training = _record(u, bouc_wen.MILLI * y, bouc_wen.RATE, "N", "mm")
    return {TRAINING: training, "multisine": bouc_wen.multisine(), "sweep": bouc_wen.sweep()}


def emps(folder: Path) -> dict[str, Record]:
    """Read the first experiment, of which blocks of time are held out."""
    files = {TRAINING: "emps_train.csv.gz"}
    if _has_parts(folder, "DATA_EMPS.mat", files):
        return read_parts(folder, files, ("motor_V", "position_m"))
    from scipy.io import loadmat

    content = loadmat(public("DATA_EMPS.mat", folder))
    u, y = (np.ravel(content[name]).astype(np.float64) for name in ("vir", "qm"))
    return {TRAINING: _record(u, y, 1000.0, "V", "m")}


def tanks(folder: Path) -> dict[str, Record]:
    """Read the estimation data, and the validation data where the public file is at hand."""
    files = {TRAINING: "estimation.csv.gz"}
    if _has_parts(folder, "dataBenchmark.csv", files):
        return read_parts(folder, files, ("u_V", "y_V"))
    content = np.genfromtxt(public("dataBenchmark.csv", folder), delimiter=",", names=True)
    rate = 0.25
    return {
        TRAINING: _record(content["uEst"], content["yEst"], rate, "V", "V"),
        "validation": _record(content["uVal"], content["yVal"], rate, "V", "V"),
    }


def damper(folder: Path) -> dict[str, Record]:
    """Read the characterization at 0.5 Hz; the last 30 % are the test."""
    whole = read_parts(folder, {TRAINING: "0.5Hz_30lb.csv.gz"}, ("displacement_in", "force_kip"))[TRAINING]
    training, last = whole.split(0.7)
    return {TRAINING: training, "last 30 %": last}


def _has_parts(folder: Path, name: str, files: Mapping[str, str]) -> bool:
    """Return whether the public file is not in the folder, and its parts are."""
    return not (folder / name).exists() and all((folder / own).exists() for own in files.values())


def _record(u: Array, y: Array, rate: float, input_unit: str, output_unit: str) -> Record:
    return Record(u, y, rate=rate, input_units=[input_unit], output_units=[output_unit])


#: The benchmarks by the name of their command.
BENCHMARKS: dict[str, Benchmark] = {
    own.name: own
    for own in (
        Benchmark(
            name="silverbox",
            folder="silverbox",
            title="Silverbox: an electronic oscillator with a hardening spring, measured",
            truth="The spring force is k1 y + k2 y^2 + k3 y^3 with k3 = 4.0 k1 / V^2, inside the loop; "
            "the damping falls slightly at small speed.",
            effects=("stiffness",),
            unit="mV",
            factor=1e3,
            read=silverbox,
            published={"polynomial state space (Paduart et al., 2010)": {"arrow": 0.26}},
        ),
        Benchmark(
            name="bouc-wen",
            folder="bouc-wen",
            title="Bouc-Wen: an oscillator with a hysteretic restoring force, simulated",
            truth="The restoring force is k y + z with alpha = k, beta gamma = 0.8 / mm and "
            "beta delta = -1.1 / mm; in the notation of hysteretic-stiffness, hysteretic_over_linear = 1, "
            "beta = 0.8, gamma = -1.1 and exponent 1.",
            effects=("hysteretic-stiffness",),
            unit="um",
            factor=1e3,
            read=bouc_wen_parts,
            published={
                "best linear model": {"multisine": 160.0},
                "polynomial state space": {"multisine": 13.4},
                "best neural network": {"multisine": 7.5},
            },
        ),
        Benchmark(
            name="emps",
            folder="emps",
            title="EMPS: a motor-driven positioning stage, measured under feedback",
            truth="The stage integrates force to position, with viscous and Coulomb friction: 94.7 kg, "
            "200 N s/m and 20.8 N. With 35.15 N/V, these are mass = 2.69 V s^2/m, damping = 5.69 V s/m "
            "and friction_force = 0.592 V.",
            effects=("friction",),
            unit="mm",
            factor=1e3,
            read=emps,
            published={},
            horizon=1.0,
        ),
        Benchmark(
            name="cascaded-tanks",
            folder="cascaded-tanks",
            title="Cascaded tanks: pump voltage to the level of the lower tank, measured",
            truth="The outflow grows with the square root of the level, and the tanks overflow.",
            effects=("saturation",),
            unit="V",
            factor=1.0,
            read=tanks,
            published={
                "neural state space": {"validation": 0.40},
                "polynomial NARX": {"validation": 0.41},
                "ARX": {"validation": 0.69},
            },
        ),
        Benchmark(
            name="friction-damper",
            folder="friction-damper",
            title="Friction damper: force over imposed displacement, measured",
            truth="The force is that of elastoplastic friction (stops) behind a gap.",
            effects=("friction", "backlash"),
            unit="kip",
            factor=1.0,
            read=damper,
            published={},
        ),
    )
}

"""Print the held-out errors on measured records and public benchmarks, next to the best simple rival.

One rule gives all errors (`Model.on_another_record`). Where the folder of a record contains a second
experiment, this is held out; elsewhere the ten blocks of time that `explain` holds out. The rivals (`rivals`)
are fitted to the same samples and scored on the same samples.

The records are searched in GPI_DATA_DIR (a folder with `measured`), else in `../shared`. Run it from the root
of the project: `make real-records`.
"""

import argparse
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "python" / "tests"))

import gpi_hammerstein as gpi  # noqa: E402
import score_tables  # noqa: E402
from data_folder import MEASURED  # noqa: E402
from gpi_hammerstein.files import write_atomically  # noqa: E402

MIRROR = "piezo-fsm-cubespec"


@dataclass(frozen=True)
class Answer:
    """What was found in a record, and the errors on what was held out, in the unit of the output."""

    name: str
    held_out: str
    effects: str
    verdict: str
    own: float
    rivals: list[dict[str, Any]]
    unit: str
    seconds: float

    def best(self) -> dict[str, Any]:
        """Return the rival with the smallest error on the held-out data."""
        return min(self.rivals, key=lambda row: row["holdout_rms"])

    def cells(self) -> tuple[str, ...]:
        """Return the cells of this record's row."""
        best = self.best()
        ratio = self.own / best["holdout_rms"]
        return (
            self.name,
            self.held_out,
            self.effects,
            self.verdict,
            f"{self.own:.4g} {self.unit}".strip(),
            f"{best['holdout_rms']:.4g} {self.unit}".strip(),
            f"{best['name']} ({best['detail']})",
            f"{ratio:.3f}" if ratio <= 1.0 else f"**{ratio:.3f}**",
            f"{self.seconds:.0f}",
        )


HEADS = (
    "record",
    "held out",
    "effects",
    "verdict",
    "model",
    "best rival",
    "which",
    "model over rival",
    "seconds",
)


def read(path: str, **options: Any) -> gpi.Record:
    """Read a file of the folder of measured records."""
    return gpi.read_record(MEASURED / path, **options)


def explained(name: str, record: gpi.Record, other: gpi.Record | None = None) -> Answer:
    """Explain a record."""
    begin = time.perf_counter()
    found = gpi.explain(record, holdout=other)
    seconds = time.perf_counter() - begin
    held_out = "ten blocks" if other is None else "another experiment"
    effects = ", ".join(found.effects) or "none"
    own = found.after["holdout"]["rms"]
    unit = record.output_units[0]
    return Answer(name, held_out, effects, found.verdict, own, found.rivals, unit, seconds)


def mirror(level: int) -> Answer:
    """Identify the linear dynamics of the steering mirror on five realisations; the sixth is held out."""
    u, y = (np.load(MEASURED / MIRROR / f"{name}_{level}mV_train.npy") for name in "uy")
    # (period, inputs, realisation, repetition): the first repetition is the warm-up of the second
    runs = [
        tuple(np.concatenate([signal[:, :, index, 0], signal[:, :, index, 1]]) for signal in (u, y))
        for index in range(6)
    ]
    period = len(u)
    train, test = (
        gpi.Record([one for one, _ in part], [two for _, two in part], 6400.0, warmup=period)
        for part in (runs[:5], runs[5:])
    )
    begin = time.perf_counter()
    model = gpi.identify(train, half_widths=[0.0], thresholds=0)
    seconds = time.perf_counter() - begin
    own = model.on_another_record(test)["error"]["rms"]
    return Answer(
        f"{MIRROR}, {level} mV",
        "another realisation",
        "not asked",
        "identified",
        own,
        gpi.rivals(train, test),
        "",
        seconds,
    )


def own_blocks(name: str, **options: Any) -> Callable[[], Answer]:
    """Return the task of a record whose own blocks are held out."""
    return lambda: explained(name.removesuffix(".gz").removesuffix(".csv"), read(name, **options))


UNEVEN: Mapping[str, Any] = {"resample": True, "covariate": []}

TASKS: dict[str, Callable[[], Answer]] = {
    "piezo-p885-dbo": lambda: explained(
        "piezo-p885-dbo",
        read("piezo-p885-dbo/model_1hz_fullscale.csv"),
        read("piezo-p885-dbo/test_1hz_varying_amplitude.csv", warmup=200),
    ),
    "silverbox": lambda: explained(
        "silverbox", read("silverbox/train.csv.gz"), read("silverbox/valid.csv.gz")
    ),
    "bouc-wen": own_blocks("bouc-wen/train_multisine.csv.gz"),
    "emps": own_blocks("emps/emps_train.csv.gz", input="motor_V", output="position_m"),
    "friction-damper": own_blocks(
        "friction-damper/0.5Hz_30lb.csv.gz", input="displacement_in", output="force_kip", covariate=[]
    ),
    "friction-damper 1 Hz": own_blocks(
        "friction-damper/1Hz_20lb.csv.gz", input="displacement_in", output="force_kip", covariate=[]
    ),
    "cascaded-tanks": own_blocks("cascaded-tanks/estimation.csv.gz"),
    "throttle-valve 1": own_blocks("throttle-valve/throttle1.csv"),
    "throttle-valve 3": own_blocks("throttle-valve/throttle3.csv"),
    "cavatappi creep": own_blocks("cavatappi-muscle/creep_step_400g_300s.csv", **UNEVEN),
    "cavatappi cycles": own_blocks("cavatappi-muscle/cycles_sample3_400g.csv", **UNEVEN),
    "cavatappi lifetime": own_blocks("cavatappi-muscle/lifetime_first_490_cycles.csv", **UNEVEN),
    "tendon 0": own_blocks("tendon-sheath-backlash/conf0_50.csv", input="u_deg", output="y_deg", **UNEVEN),
    "tendon 90": own_blocks("tendon-sheath-backlash/conf90_60.csv", input="u_deg", output="y_deg", **UNEVEN),
    "mirror": lambda: mirror(300),
}


def main() -> None:
    """Print the table, and write it to a file if one is given."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--only", metavar="TEXT", default="", help="only records whose name contains this")
    parser.add_argument("--markdown", type=Path, metavar="FILE", help="file to write the table to")
    options = parser.parse_args()
    if not MEASURED.is_dir():
        raise SystemExit(f"no measured records in {MEASURED}: set GPI_DATA_DIR")
    rows = []
    for name, task in TASKS.items():
        if options.only not in name:
            continue
        try:
            rows.append(task().cells())
        except gpi.GpiError as refusal:
            rows.append((name, "-", "-", f"refused: {refusal}", "-", "-", "-", "-", "-"))
        print("  ".join(rows[-1]), flush=True)
    table = score_tables.Table("Measured records, held out", HEADS, rows)
    if options.markdown:
        write_atomically(
            options.markdown, f"# Measured records\n\nMade by `make real-records`.\n\n{table.markdown()}"
        )


if __name__ == "__main__":
    main()

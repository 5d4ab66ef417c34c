"""Write the demo record of the package, and the effects that its simulator contained.

The stage comes from the simulator of the tests, which shares no code with the package. It has hysteresis
before a resonance, and two effects that the declared model does not contain: creep and mains hum. Run this
script again after a change of the simulator. The same seed gives the same files.
"""

import gzip
import io
import json
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "python" / "tests"))

import plants  # noqa: E402  the simulator that the tests use
from gpi_hammerstein.files import write_atomically  # noqa: E402
from plants.added import PeriodicDisturbance  # noqa: E402

DATA = ROOT / "python" / "gpi_hammerstein" / "data"
SEED = 46
SECONDS, RATE = 16.0, 1000.0
# Rms over that of the noise: less than one hundredth of the stroke, so that an engineer might overlook it.
EFFECTS = {"creep": 12.0, "periodic-disturbance": 4.0}


def compressed(run: plants.Recording) -> bytes:
    """Return the record as gzipped CSV. It has no file name and no time stamp, so that it is reproducible."""
    columns = zip(run.t, run.u, run.y, strict=True)
    rows = "".join(f"{t:.3f},{u:.4f},{y:.4f}\n" for t, u, y in columns)
    buffer = io.BytesIO()
    with gzip.GzipFile("", "wb", 9, buffer, mtime=0) as archive:
        archive.write(f"t_s,u_V,y_um\n{rows}".encode())
    return buffer.getvalue()


def main() -> None:
    """Draw the stage, run one experiment, and write the record."""
    plant = plants.draw(SEED, list(EFFECTS), EFFECTS, SECONDS, RATE)
    run = plant.record(0)
    hum = plant.effects["periodic-disturbance"]
    assert isinstance(hum, PeriodicDisturbance)
    truth = {
        "effects": list(EFFECTS),
        "rms_over_noise": {name: round(rms, 3) for name, rms in run.effect_rms_over_noise.items()},
        "hum_hz": round(hum.hz, 4),
        "noise_rms_um": float(f"{run.noise_std:.4g}"),
        "span_um": float(f"{np.ptp(run.y):.4g}"),
    }
    DATA.mkdir(exist_ok=True)
    record = compressed(run)
    write_atomically(DATA / "demo.csv.gz", record)
    write_atomically(DATA / "demo.truth.json", json.dumps(truth, indent=2) + "\n")
    print(f"demo.csv.gz: {len(run.u)} samples, {len(record) / 1e3:.0f} kB\n{json.dumps(truth)}")


if __name__ == "__main__":
    main()

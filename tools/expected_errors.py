"""Compare the error that `compensate` expects with the error that a simulated stage then makes.

A stage of the tests' simulator is identified from one record. The model is saved and loaded, as a user does
it, and computes the drive for a new reference. The stage is simulated under this drive without the noise of
its sensor. The printed ratio is the expected rms error divided by the rms error that the stage makes.
"""

import argparse
import sys
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "python" / "tests"))

import gpi_hammerstein as gpi  # noqa: E402
import plants  # noqa: E402  the simulator that the tests use
from plants.excitation import Array, Experiment, stream  # noqa: E402

SECONDS, RATE = 10.0, 2000.0
FACTOR = 2.0
STRENGTH = 10.0
PARTS = ("inversion", "parameters", "model", "past")
HEAD = ["stage", "made", "expected", "expected / made", *PARTS, "best static curve", "noise"]
KINDS = {"nothing": (), "creep": ("creep",)}


def reference(plant: plants.Plant, seed: int) -> Array:
    """Return a smooth random path that starts at rest: other levels and speeds on every stage."""
    random = stream("reference", seed)
    samples = round(3.0 * RATE)
    t = np.arange(samples) / RATE
    top = plant.resonance_hz * random.uniform(0.02, 0.1)
    path = np.zeros(samples)
    for hz in np.linspace(0.5, top, 12):
        path += np.sin(2 * np.pi * (hz * t + random.random())) / np.sqrt(hz)
    path = (path - path.min()) / np.ptp(path)
    low = random.uniform(0.1, 0.3)
    path = low + (random.uniform(0.6, 0.9) - low) * path
    rise = np.clip((t - 0.05) / 0.5, 0, 1)
    return plant.base.offset + plant.base.hysteresis.travel * path * rise**2 * (3 - 2 * rise)


def compared(seed: int, lacks: tuple[str, ...] = ()) -> list[float]:
    """Return the error of the stage, the expected one, their ratio, the parts, the baseline and the noise."""
    plant = plants.draw(seed, lacks, STRENGTH, seconds=SECONDS, rate=RATE)
    plant.in_motion = False
    own = plant.record(1)
    identified = gpi.identify(gpi.Record(own.u, own.y, own.rate))
    model = gpi.Model.from_json(identified.to_json())
    wanted = reference(plant, seed)
    found = model.compensate(wanted, start=0.0)
    noise, plant.noise_std = plant.noise_std, 0.0
    made = plant.simulate(Experiment(found.drive, RATE, found.lead, (0, 0)), plant.strengths)
    rms = float(np.sqrt(np.mean((made - wanted) ** 2)))
    expected = found.expected_error
    parts = [expected["parts"][name] for name in PARTS]
    static = found.error_static_curve["rms"]
    scale = 100 / np.ptp(wanted)
    # a part that the model does not know is None
    shares = [np.nan if part is None else scale * part for part in (*parts, static, noise)]
    return [scale * rms, scale * expected["rms"], expected["rms"] / rms, *shares]


def study(stages: int, lacks: tuple[str, ...], workers: int = 2) -> list[list[float]]:
    """Return the rows of so many stages."""
    with ProcessPoolExecutor(workers) as pool:
        return list(pool.map(partial(compared, lacks=lacks), range(stages)))


def within(rows: list[list[float]]) -> int:
    """Return the number of rows whose expected error is within the factor of the error that was made."""
    return sum(1 / FACTOR <= row[2] <= FACTOR for row in rows)


def table(rows: list[list[float]]) -> str:
    """Return the rows as a table."""
    lines = [HEAD, ["---"] * len(HEAD)]
    lines += [[str(seed), *(f"{value:.2g}" for value in row)] for seed, row in enumerate(rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def main() -> None:
    """Run the stages and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--stages", type=int, default=40, help="number of simulated stages")
    parser.add_argument("--lacks", choices=KINDS, default="nothing", help="effect that the model lacks")
    arguments = parser.parse_args()
    rows = study(arguments.stages, KINDS[arguments.lacks])
    print(table(rows))
    print(f"within a factor of {FACTOR:g}: {within(rows)} of {len(rows)}")


if __name__ == "__main__":
    main()

"""Measure how well a compensated drive works if the stage has changed since the identification.

A stage of the tests' simulator is identified. Then every parameter of it is changed by up to 5 %, and it gets
creep and one more mode. It has to follow a triangle of decreasing amplitude. Four drives are compared: the
best static curve from the reference to the drive, and the drives of three models. These models are that of
the stage before the change, a model that is identified again, and the model of `explain` from a record of the
changed stage. A second table compares the error that `compensate` expects with the error that a stage makes,
see tools/expected_errors.py. `--markdown` writes docs/tracking.md.
"""

import argparse
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "python" / "tests"))

import expected_errors  # noqa: E402
import gpi_hammerstein as gpi  # noqa: E402
import plants  # noqa: E402  the simulator that the tests use
from gpi_hammerstein.files import write_atomically  # noqa: E402
from plants.excitation import Array, Experiment, stream  # noqa: E402

SECONDS, RATE = 10.0, 2000.0
PERTURBATION = 0.05
LACKS = ("creep", "linear-dynamics")
STRENGTH = 10.0
REST, APPROACH = 0.1, 0.3  # seconds before the triangle
LOW, HIGH = 0.2, 0.8  # of the stage's travel
DRIVES = ("static curve", "as it was", "identified anew", "after `explain`")
HEAD = ["stage", *DRIVES, "gain", "explained by the change", "noise"]
TEXT = """# Tracking

Made by `make tracking`. A stage is identified from a record of {seconds:g} s. The stage comes from the
simulator of the tests, which shares no code with the package. Then every parameter of the stage (travel,
half-widths, weights, frequencies, damping) is changed by up to {perturbation:.0%}, and the stage gets creep
and one more mode, each with an rms of {strength:g} times that of the noise. The reference starts at rest,
goes to the middle of the range and then follows a triangle of decreasing amplitude for {turns} periods at a
twentieth of the resonance frequency. The table shows the tracking error, rms in per cent of the span of the
reference, without the noise of the sensor:

{table}

The columns are:

- `static curve`: the drive is a static curve of the reference. It is the polynomial of degree {degree} that
  fits the drive of the next column best.
- `as it was`: the drive is computed by `model.compensate` with a model of the stage before the change.
- `identified anew`: the model was identified by `identify` from one record of the changed stage.
- `after explain`: the model was found by `explain` from the same record.
- `gain`: the error of `static curve` divided by the error of `after explain`.
- `explained by the change`: the share of the error of `as it was`, in per cent of its power, that is caused
  by the difference between the two stages under this drive.
- `noise`: the rms of the sensor noise, in per cent of the span of the reference.

## The expected error

A stage is identified from one record of {seconds:g} s, and the saved model computes the drive for a new
random path from rest. `made` is the rms error of the true output, without the noise of the sensor, and
`expected` the rms error that `compensate` has predicted before, with its parts; all in per cent of the span
of the reference. The expected error is within a factor of {factor:g} of the error that was made on
**{within} of {count}** stages. On as many stages with creep (of {strength:g} times the noise), which the
model does not contain, it is on {lacking} of {count}.

{expected}
"""
TURNS = 6
DEGREE = 5


def changed(plant: plants.Plant, seed: int) -> plants.Plant:
    """Change every parameter of a stage by up to 5 %."""
    random = stream("perturbation", seed)

    def near(values: Array) -> Array:
        return values * (1 + PERTURBATION * random.uniform(-1, 1, np.shape(values)))

    hysteresis, mechanics = plant.base.hysteresis, plant.base.mechanics
    hysteresis = replace(
        hysteresis,
        travel=float(near(np.asarray(hysteresis.travel))),
        half_widths=near(hysteresis.half_widths),
        weights=near(hysteresis.weights),
    )
    modes = tuple(
        replace(mode, hz=float(near(np.asarray(mode.hz))), damping=float(near(np.asarray(mode.damping))))
        for mode in mechanics.modes
    )
    amplifier_hz = float(near(np.asarray(mechanics.amplifier_hz)))
    mechanics = replace(mechanics, amplifier_hz=amplifier_hz, modes=modes)
    plant.base = replace(plant.base, hysteresis=hysteresis, mechanics=mechanics)
    return plant


def recorded(plant: plants.Plant, seed: int) -> gpi.Record:
    """Run an experiment on a stage and return the record."""
    own = plant.record(seed)
    return gpi.Record(own.u, own.y, own.rate)


def output(plant: plants.Plant, drive: Array, lead: int) -> Array:
    """Return the output of a stage for a drive, without noise, from the reference's first sample on."""
    noise, plant.noise_std = plant.noise_std, 0.0
    try:
        return plant.simulate(Experiment(drive, RATE, lead, (0, 0)), plant.strengths)
    finally:
        plant.noise_std = noise


def reference(plant: plants.Plant) -> Array:
    """Return the reference: from rest to the middle of the travel, then a decaying triangle."""
    frequency = plant.resonance_hz / 20
    t = np.arange(round(TURNS * RATE / frequency)) / RATE
    triangle = np.interp(t * frequency % 1.0, [0, 0.25, 0.75, 1], [0, 1, -1, 0]) * (1 - t / t[-1])
    middle, half = 0.5 * (LOW + HIGH), 0.5 * (HIGH - LOW)
    approach = np.sin(np.linspace(0, np.pi / 2, round(APPROACH * RATE))) ** 2
    shares = [np.zeros(round(REST * RATE)), middle * approach, middle + half * triangle]
    return plant.base.offset + plant.base.hysteresis.travel * np.concatenate(shares)


def track(seed: int) -> list[float]:
    """Return the errors of all drives, the gain, the share explained by the change, and the noise."""
    before = plants.draw(seed, (), seconds=SECONDS, rate=RATE)
    before.in_motion = False
    after = plants.draw(seed, LACKS, STRENGTH, seconds=SECONDS, rate=RATE)
    after.in_motion = False
    before.noise_std = after.noise_std
    wanted, limits = reference(before), (0.0, before.base.hysteresis.volts)
    record = recorded(before, 1)
    after = changed(after, seed)
    anew = recorded(after, 2)
    span = np.ptp(wanted)

    def missed(plant: plants.Plant, drive: Array, lead: int) -> Array:
        return wanted - output(plant, drive, lead)

    def rms(error: Array) -> float:
        return float(100 * np.sqrt(np.mean(error**2)) / span)

    old = gpi.identify(record).compensate(wanted, limits=limits)
    line = np.polyval(np.polyfit(wanted, old.drive[old.lead :], DEGREE), wanted)
    errors = [rms(missed(after, line, 0)), rms(missed(after, old.drive, old.lead))]
    for model in (gpi.identify(anew), gpi.explain(anew).model):
        found = model.compensate(wanted, limits=limits)
        errors.append(rms(missed(after, found.drive, found.lead)))
    error = missed(after, old.drive, old.lead)
    own = missed(before, old.drive, old.lead)
    share = 1 - np.mean(own**2) / np.mean(error**2)
    return [*errors, errors[0] / errors[-1], 100 * share, 100 * after.noise_std / span]


def main() -> None:
    """Run all stages, and print or write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--stages", type=int, default=8, help="number of simulated stages")
    parser.add_argument("--expected", type=int, default=40, help="number of stages of the second table")
    parser.add_argument(
        "--markdown", type=Path, help="file to write the page to, for example docs/tracking.md"
    )
    arguments = parser.parse_args()
    rows = []
    for seed in range(arguments.stages):
        rows.append(track(seed))
        print(seed, " ".join(f"{value:.3g}" for value in rows[-1]), flush=True)
    texts = [[str(seed), *(f"{value:.3g}" for value in row)] for seed, row in enumerate(rows)]
    texts.append(["median", *(f"{value:.3g}" for value in np.median(rows, axis=0))])
    lines = [HEAD, ["---"] * len(HEAD), *texts]
    found = expected_errors.study(arguments.expected, ())
    lacking = expected_errors.study(arguments.expected, ("creep",))
    page = TEXT.format(
        seconds=SECONDS,
        perturbation=PERTURBATION,
        strength=STRENGTH,
        turns=TURNS,
        degree=DEGREE,
        factor=expected_errors.FACTOR,
        within=expected_errors.within(found),
        lacking=expected_errors.within(lacking),
        count=len(found),
        expected=expected_errors.table(found),
        table="\n".join(f"| {' | '.join(line)} |" for line in lines),
    )
    if arguments.markdown is None:
        print(page)
    else:
        write_atomically(arguments.markdown, page)


if __name__ == "__main__":
    main()

"""What `test_made_up_effect.py` asks of the package that has the made-up effect; a process of its own.

Run as `python made_up_effect.py FOLDER` with that package in PYTHONPATH.
"""

import json
import sys
from pathlib import Path

import numpy as np

import gpi_hammerstein as gpi
import oracle
from records import RATE, drive, model_of

NAME = "made-up-effect"
PERIOD = 0.6328 / 2
SINE, COSINE = 0.012, -0.016


def plant():
    """Three plays before a first-order lag, whose output moves by a few um."""
    hysteresis = oracle.Hysteresis(
        thresholds=np.array([0.0]),
        deadzone_weights=np.array([1.0]),
        half_widths=np.array([0.0, 0.4, 1.0]),
        weights=np.array([0.5, 0.2, 0.15]),
    )
    lag = oracle.Section(a=np.array([-0.7]), b=np.array([[0.3]]), c=np.array([[1.0]]))
    return oracle.Plant(
        hysteresis=[hysteresis],
        sections=[lag],
        feedthrough=np.zeros((1, 1)),
        held=[(0, 1.0)],
        offsets=[np.array([[0.7]])],
        starts=[None],
    )


def read(x):
    """The reading of a displacement."""
    return x + SINE * np.sin(2 * np.pi * x / PERIOD) + COSINE * np.cos(2 * np.pi * x / PERIOD)


def displacement(own, u):
    """The displacement before the sensor, and the offset behind it."""
    offset = own.offsets[0][0, 0]
    return own.simulate(u[:, None])[:, 0] - offset, offset


def with_effect(model, **values):
    described = json.loads(model.to_json())
    described["effects"] = [{"name": NAME, "output": 0, "period": PERIOD, **values}]
    return gpi.Model.from_json(json.dumps(described))


def main(folder: Path) -> None:
    """Write answers.json, answers.npz and model.json."""
    own, u = plant(), drive(1500)
    x, offset = displacement(own, u)
    record = gpi.Record(u, read(x) + offset, rate=RATE, input_units=["V"], output_units=["um"])
    model = with_effect(model_of(own), sine=SINE, cosine=COSINE)
    found = gpi.sensitivities(model, record)
    changed = own.with_values({"u.weights[1]": 0.21, "section[0].a1": -0.69})
    refined = gpi.refine(with_effect(model_of(changed), sine=0.0, cosine=0.0), record)
    model.save(folder / "model.json")
    again = gpi.load(folder / "model.json")
    answers = {
        "package": gpi.__file__,
        "effects": gpi.effect_names(),
        "names": list(found["names"]),
        "saved": json.loads((folder / "model.json").read_text())["effects"],
        "loaded": again.effects == model.effects,
        "refined": {row["name"]: row["value"] for row in refined.effects[0]["parameters"]},
        "weights": json.loads(refined.to_json())["hysteresis"][0]["plays"]["weights"],
    }
    (folder / "answers.json").write_text(json.dumps(answers))
    np.savez(
        folder / "answers.npz",
        simulated=model.simulate(u),
        loaded_output=again.simulate(u),
        jacobian=found["jacobians"][0][0],
    )


if __name__ == "__main__":
    main(Path(sys.argv[1]))

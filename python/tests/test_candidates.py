"""Records on which single candidates fail: each gives a model, or an error that names what the data lack."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

import gpi_hammerstein as gpi

RATE = 1000.0
BANK = gpi.PlayBank([0.0, 1.0, 3.0], [1.0, 0.4, 0.3])
Pair = tuple[NDArray[np.float64], NDArray[np.float64]]


def plant(u: NDArray[np.float64], noise: float = 0.01) -> Pair:
    """Three plays before a slow pole."""
    v = BANK(u)
    y, x = np.empty_like(v), v[0]
    for k, value in enumerate(v):
        y[k] = x
        x = 0.8 * x + 0.2 * value
    return u, y + noise * np.random.default_rng(3).normal(size=len(u))


def sine(frequency: float, samples: int = 2000, phase: float = 0.0) -> NDArray[np.float64]:
    return 5.0 * np.sin(2 * np.pi * frequency * np.arange(samples) / RATE + phase)


def step() -> Pair:
    return plant(np.where(np.arange(2000) > 300, 4.0, 0.0))


def pulse() -> Pair:
    return plant(5.0 * (np.arange(1000) == 100), noise=0.0)


def response_to_nothing() -> Pair:
    return gpi.multisine(2000, RATE, (0.5, 400.0), (0.0, 10.0), seed=2), 1.0 * (np.arange(2000) == 1000)


def constant_at_last() -> Pair:
    u = gpi.multisine(2000, RATE, (0.5, 200.0), (0.0, 10.0), seed=1)
    u[1500:] = u[1500]
    y = plant(u, 0.0)[1]
    y[1600:] = y[1600]
    return u, y


def butterfly() -> Pair:
    u = sine(2.0, 3000) * 2
    return u, BANK(u) ** 2 + 0.05 * np.random.default_rng(1).normal(size=3000)


RECORDS: dict[str, Callable[[], Pair]] = {
    "one period": lambda: plant(np.append(np.zeros(50), sine(0.5))),
    "twenty periods in motion": lambda: plant(sine(10.0, phase=0.7)),
    "static": lambda: (sine(2.0), 2 * sine(2.0)),
    "step": step,
    "pulse": pulse,
    "response to nothing": response_to_nothing,
    "constant at last": constant_at_last,
    "butterfly": butterfly,
    "60 samples": lambda: plant(gpi.multisine(60, RATE, (20, 400.0), (0.0, 10.0), seed=2)),
    "12 samples": lambda: plant(gpi.multisine(60, RATE, (20, 400.0), (0.0, 10.0), seed=2)[:12]),
}
TOO_LITTLE = {
    "12 samples": "usable samples, but",
    "60 samples": "usable samples, but",
    "response to nothing": "constant",
}


@pytest.mark.parametrize("name", RECORDS)
def test_identify_answers(name: str) -> None:
    u, y = RECORDS[name]()
    record = gpi.Record(u, y, RATE)
    if name == "12 samples":
        with pytest.raises(gpi.DataError, match=TOO_LITTLE[name]):
            gpi.identify(record)
        return
    model = gpi.identify(record)
    assert np.isfinite(model.error(record, fit_start=True)["rms"])


@pytest.mark.parametrize("name", RECORDS)
def test_explain_answers(name: str) -> None:
    u, y = RECORDS[name]()
    record = gpi.Record(u, y, RATE)
    if name in TOO_LITTLE:
        with pytest.raises(gpi.DataError, match=TOO_LITTLE[name]):
            gpi.explain(record, effects=[])
        return
    found = gpi.explain(record, effects=[])
    assert np.isfinite(found.after["train"]["rms"])


def test_many_experiments_of_unknown_start_take_no_products_of_their_starts() -> None:
    pieces = [gpi.multisine(900, RATE, (0.5, 200.0), (0.0, 10.0), seed=seed) for seed in range(6)]
    measured = [plant(u) for u in pieces]
    # each begins in motion
    record = gpi.Record([u[400:] for u, _ in measured], [y[400:] for _, y in measured], RATE)
    model = gpi.identify(record, order=1, half_widths=[0.0, 1.0, 3.0], thresholds=0)
    assert model.error(record, fit_start=True)["rms"] < 0.012
    # the products of all unknowns are those of the Jacobian's columns
    found = gpi.sensitivities(model, record)
    jacobian = np.concatenate([own for experiment in found["jacobians"] for own in experiment])
    scale = np.sqrt(np.diag(found["hessian"]))
    left = (found["hessian"] - jacobian.T @ jacobian) / np.outer(scale, scale)
    assert np.abs(left).max() < 1e-9
    starts = [i for i, name in enumerate(found["names"]) if name.startswith("start[")]
    assert len(starts) > 6

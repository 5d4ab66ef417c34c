"""Write testdata/*.json from the oracle: small vectors that both the Rust tests and the Python tests read.

    python tools/make_testdata.py

It needs only NumPy and SciPy. Matrices are lists of rows; signals are (samples, channels) or, for the
operators, one channel; Markov parameters are (outputs, inputs, taps).
"""

import json
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "python" / "tests"))

import oracle  # noqa: E402  the oracle is in the folder of the tests

SEED = 20180627


def plain(value):
    """Return arrays as lists, and complex numbers as [re, im] pairs."""
    value = np.asarray(value)
    if np.iscomplexobj(value):
        value = np.stack([value.real, value.imag], axis=-1)
    return value.tolist()


# --- operators -----------------------------------------------------------------------------------

WALK = [0.0, 1.5, 3.0, 3.0, 2.5, -0.5, -1.0, -3.25, -3.25, -2.0, 0.0, 2.0, 2.0, -2.0, 4.0, -4.0, 0.5]
PLATEAU = [2.0, 2.0, 1.0, 1.0, 1.0, 3.0, 3.0, -1.0, -1.0, 0.0, 0.0, -0.0, 2.0]
ALTERNATION = [4.0, -3.5, 3.0, -2.5, 2.0, -1.5, 1.0, -0.5, 0.25, -0.125, 0.0]
PUBLISHED_WALK = [0.0, 0.2, 0.5, 1.1, 1.25, 1.0, 0.2, -1.0]

# the numerical example of the source paper
PAPER_HALF_WIDTHS = [0.0769, 0.1538, 0.2307, 0.3076, 0.3845, 0.4614, 0.5383, 0.6152]
PAPER_WEIGHTS = [3.6590, 2.8098, 2.1577, 1.6569, 1.2724, 0.9771, 0.7503, 0.5762]
PAPER_THRESHOLDS = [round(0.8 * (i - 8), 1) for i in range(17)]
PAPER_SLOPES = [
    -0.198, -0.057, -0.1669, -0.13, -0.15, -0.037, 0.02, 0.23, 0.0,
    -0.249, -0.004, -0.2176, -0.0734, 0.0568, -0.058, -0.13, -2.479,
]  # fmt: skip


def deadzone_case(name, thresholds, weights, reading, signal, previous=0.0):
    """Return the output of one envelope for one signal."""
    output = oracle.deadzones(signal, thresholds, weights, reading, previous)
    return {
        "name": name,
        "reading": reading,
        "thresholds": thresholds,
        "weights": weights,
        "previous": previous,
        "input": signal,
        "output": plain(output),
    }


def play_case(name, half_width, signal, start=0.0):
    """Return the output of one play for one signal."""
    output = oracle.play(signal, half_width, start)
    return {
        "name": name,
        "half_width": half_width,
        "start": start,
        "input": signal,
        "output": plain(output),
    }


def bank_case(name, half_widths, weights, signal, start=None):
    """Return the output of one bank for one signal, and its final state."""
    start = [0.0] * len(half_widths) if start is None else start
    output, final = oracle.play_bank(signal, half_widths, weights, start)
    return {
        "name": name,
        "half_widths": half_widths,
        "weights": weights,
        "start": start,
        "input": signal,
        "output": plain(output),
        "final": plain(final),
    }


def gpi_case(name, envelope, bank, reading, signal):
    """Return the output of deadzones followed by plays, from rest."""
    output, final = oracle.gpi(signal, *envelope, *bank, reading)
    return {
        "name": name,
        "reading": reading,
        "thresholds": envelope[0],
        "deadzone_weights": envelope[1],
        "half_widths": bank[0],
        "weights": bank[1],
        "input": signal,
        "output": plain(output),
        "final": plain(final),
    }


def operators():
    """Return all cases of operators.json."""
    rng = np.random.default_rng(SEED)
    noise = plain(np.round(rng.normal(scale=3, size=40), 3))
    sine = plain(4 * np.sin(2 * np.pi * np.arange(60) / 40))
    tanh = plain(6 * np.tanh(0.4 * 5 * np.sin(2 * np.pi * np.arange(60) / 40)))
    both = ["one-sided", "directional"]
    tanh_half_widths = plain(0.45 * np.arange(7))
    zones = [
        case
        for reading in both
        for case in [
            deadzone_case(f"{reading}, threshold 2", [2.0], [1.0], reading, WALK),
            deadzone_case(f"{reading}, threshold -2", [-2.0], [1.0], reading, WALK),
            deadzone_case(f"{reading}, threshold 0", [0.0], [1.0], reading, WALK),
            deadzone_case(f"{reading}, plateaus", [1.0, -1.0], [2.0, 0.5], reading, PLATEAU),
            deadzone_case(f"{reading}, previous input", [0.5], [1.0], reading, PLATEAU, previous=2.0),
            deadzone_case(f"{reading}, equal thresholds", [1.0, 1.0], [1.0, -0.25], reading, noise),
            deadzone_case(f"{reading}, the paper's", PAPER_THRESHOLDS, PAPER_SLOPES, reading, noise),
        ]
    ]
    bank = [0.0, 0.5, 0.5, 2.0], [1.0, 0.75, -0.25, 0.5]
    return {
        "about": "Written by tools/make_testdata.py; compare with a relative tolerance of 1e-12.",
        "deadzones": zones,
        "plays": [
            play_case("from rest", 1.0, WALK),
            play_case("no width", 0.0, WALK),
            play_case("from a state", 0.5, WALK, start=-2.0),
            play_case("plateaus and touching edges", 1.0, PLATEAU),
            play_case("decaying alternation", 0.75, ALTERNATION),
            play_case("wider than the signal", 10.0, noise),
            play_case("tiny", 1e-12, [1e-12, 3e-12, 2e-12, -1e-12, 0.0]),
            play_case("huge", 1e12, [1e12, 3e12, 2e12, -1e12, 0.0]),
        ],
        "banks": [
            bank_case("published walk", [0.1, 0.2, 0.3, 0.4], [0.25] * 4, PUBLISHED_WALK),
            bank_case("published loop", [0.0, 0.45, 0.9, 1.35, 1.8, 2.25, 2.7],
                      [0.72, 0.6, 0.48, 0.36, 0.24, 0.12, 0.012], sine),
            bank_case("published tanh envelope, already applied", tanh_half_widths,
                      plain(0.65 * np.exp(-7.75e-4 * 0.45 * np.arange(7))), tanh),
            bank_case("equal half-widths, a negative weight", *bank, noise),
            bank_case("from a state", *bank, noise, start=[0.0, 1.0, -1.0, 2.5]),
            bank_case("the paper's", PAPER_HALF_WIDTHS, PAPER_WEIGHTS, noise),
        ],
        "gpis": [
            gpi_case(f"the paper's, {reading}", (PAPER_THRESHOLDS, PAPER_SLOPES),
                     (PAPER_HALF_WIDTHS, PAPER_WEIGHTS), reading, noise)
            for reading in both
        ]
        + [
            gpi_case(f"saturating, {reading}", ([0.0, 1.0, -1.0], [1.0, -0.4, -0.3]), bank, reading, WALK)
            for reading in both
        ],
    }  # fmt: skip


# --- linear dynamics -----------------------------------------------------------------------------

TWO_BY_TWO = (
    [[0.6, 0.3, 0.0], [-0.3, 0.6, 0.1], [0.0, 0.2, -0.4]],
    [[1.0, 0.0], [0.5, -1.0], [0.0, 2.0]],
    [[1.0, 0.0, 1.0], [0.0, 1.0, -1.0]],
    [[0.5, 0.0], [0.0, -0.5]],
)
RESONANCE = [[0.0, 1.0], [-400.0, -8.0]], [[0.0], [1.0]], [[400.0, 0.0]], [[0.0]]
CONTINUOUS = [3.391e10], [1.0, 3759.0, 2.063e7, 7.514e10]  # (48)


def fir_case(name, experiments, taps, ridge=0.0):
    """Return one regression over all experiments."""
    found = oracle.fir(experiments, taps, ridge)
    return {
        "name": name,
        "experiments": [
            {"input": plain(u), "output": plain(y), "warmup": warmup} for u, y, warmup in experiments
        ],
        "taps": taps,
        "ridge": ridge,
        "markov": plain(found.markov),
        "offsets": plain(found.offsets),
        "singular_values": plain(found.singular_values),
        "rank": found.rank,
        "residual_rms": plain(found.residual_rms),
        "samples": found.samples,
    }


def experiment(rng, samples, taps, offset, noise=0.0, warmup=0):
    """Return a white input, and its output for the Markov parameters `taps`, an offset and white noise."""
    outputs, inputs, _ = taps.shape
    u = np.round(rng.normal(size=(samples, inputs)), 2)
    y = oracle.convolve(taps, u) + offset + noise * rng.normal(size=(samples, outputs))
    return u, np.round(y, 6), warmup


def era_case(name, markov, order=None, blocks=None):
    """Return one realization. A, B and C are unique only up to the signs of the states."""
    (a, b, c, d), s = oracle.era(markov, order, blocks)
    return {
        "name": name,
        "markov": plain(markov),
        "order": order,
        "blocks": blocks,
        "singular_values": plain(s),
        "realized_order": len(a),
        "realized_markov": plain(oracle.markov(a, b, c, d, 12)),
        "poles": plain(np.sort_complex(oracle.poles(a))),
        "dc_gain": plain(oracle.dc_gain(a, b, c, d)),
    }


def hold_case(name, system, period):
    """Return a continuous-time state space and its zero-order hold."""
    a, b, c, d = system
    sampled = oracle.zero_order_hold(a, b, c, d, period)
    return {
        "name": name,
        "period": period,
        "continuous": {key: plain(m) for key, m in zip("ABCD", system, strict=True)},
        "discrete": {key: plain(m) for key, m in zip("ABCD", sampled, strict=True)},
    }


def paper_hold_case(period):
    """Return (48) with a zero-order hold; at 1e-2 s this is (49)."""
    sampled = oracle.zero_order_hold(*oracle.from_transfer_function(*CONTINUOUS), period)
    numerator, denominator = oracle.to_transfer_function(*sampled)
    return {
        "name": f"the paper's, sampled every {period:g} s",
        "period": period,
        "numerator": CONTINUOUS[0],
        "denominator": CONTINUOUS[1],
        "discrete_numerator": plain(numerator[0, 0]),
        "discrete_denominator": plain(denominator),
    }


def laurent_case(name, system, r, d):
    """Return the inverse truncated to -d .. r, and its result for a short output."""
    lags = 400
    series = oracle.laurent(*system, lags)
    taps = series[:, :, lags - d : lags + r + 1]
    y = np.round(np.sin(np.outer(np.arange(r + d + 8), 1 + np.arange(len(system[2])))), 3)
    return {
        "name": name,
        "system": {key: plain(m) for key, m in zip("ABCD", system, strict=True)},
        "r": r,
        "d": d,
        "taps": plain(taps),
        "error": float(oracle.truncation_error(series, r, d)),
        "y": plain(y),
        "v": plain(oracle.apply_noncausal(taps, d, y)),
    }


def linear():
    """Return all cases of linear.json."""
    rng = np.random.default_rng(SEED)
    siso = np.array([[[0.5, 1.0, -0.25]]])
    mimo = np.round(rng.normal(size=(2, 2, 3)), 2)
    k = np.arange(30.0)[:, None]
    sine = np.sin(0.7 * k), np.round(2 * np.sin(0.7 * k - 0.4) + 0.1 * rng.normal(size=k.shape), 4), 0
    system = tuple(np.array(m) for m in TWO_BY_TWO)
    lag = oracle.from_transfer_function([1.0, 0.3], [1.0, -1.2, 0.6])
    stiff = tuple(np.array(m) for m in RESONANCE)
    nonminimum = oracle.from_transfer_function([1.0, -2.5, 1.0], [1.0, -0.9, 0.5, 0.0])
    proper = oracle.from_transfer_function([1.0, -0.5], [1.0, 0.2])
    noisy_markov = oracle.markov(*lag, 21) + np.round(1e-3 * rng.normal(size=21), 6)
    return {
        "about": "Written by tools/make_testdata.py; compare with a relative tolerance of 1e-9.",
        "fir": [
            fir_case("one channel", [experiment(rng, 24, siso, 3.0, noise=0.1)], 3),
            fir_case("more taps than the system has", [experiment(rng, 40, siso, -1.0, noise=0.01)], 5),
            fir_case(
                "two experiments, two channels, warm-up",
                [experiment(rng, 20, mimo, [1.0, -2.0], 0.1, 4), experiment(rng, 16, mimo, [0.5, 2.0], 0.1)],
                3,
            ),
            fir_case("ridge", [experiment(rng, 24, siso, 3.0, noise=0.1)], 3, ridge=0.05),
            fir_case("one sine excites two of four taps", [sine], 4),
        ],
        "era": [
            era_case("second order", oracle.markov(*lag, 11)),
            era_case("two channels", oracle.markov(*system, 13)),
            era_case("noisy, order given", noisy_markov, order=2),
            era_case("blocks given", oracle.markov(*lag, 12), order=2, blocks=4),
        ],
        "zero_order_hold": [hold_case("resonance", stiff, 0.02), hold_case("two channels", system, 0.5)],
        "zero_order_hold_transfer_function": [paper_hold_case(1e-2), paper_hold_case(1e-5)],
        "laurent": [
            laurent_case("proper, minimum phase", proper, 8, 0),
            laurent_case("strictly proper, nonminimum phase", nonminimum, 6, 5),
            laurent_case("two channels", system, 5, 1),
        ],
    }


def dump(cases):
    """Return JSON text with one line for each field of a case."""

    def line(value):
        return json.dumps(value, allow_nan=False)

    sections = []
    for section, content in cases.items():
        if isinstance(content, str):
            sections.append(f"  {line(section)}: {line(content)}")
            continue
        blocks = []
        for case in content:
            fields = ",\n".join(f"      {line(key)}: {line(value)}" for key, value in case.items())
            blocks.append("    {\n" + fields + "\n    }")
        sections.append(f"  {line(section)}: [\n" + ",\n".join(blocks) + "\n  ]")
    return "{\n" + ",\n".join(sections) + "\n}\n"


def main():
    """Write both files."""
    folder = ROOT / "testdata"
    folder.mkdir(exist_ok=True)
    for name, cases in [("operators", operators()), ("linear", linear())]:
        (folder / f"{name}.json").write_text(dump(cases), encoding="utf-8")


if __name__ == "__main__":
    main()

"""Writes the demonstration records of the package: a simulated piezo stage under two experiments.

The simulator is independent of the package: its hysteresis has a smooth asymmetric envelope and a dense
bank of plays, its dynamics are continuous in time, and its sensor adds white noise. Run it again after a
change; the same seed gives the same files.
"""

import gzip
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import signal

Array = NDArray[np.float64]

DATA = Path(__file__).parent.parent / "python" / "gpi_hammerstein" / "data"
RATE = 2000.0
NOISE_UM = 0.006
OFFSET_UM = -2.5


def envelope(u: Array) -> Array:
    """Steeper at high voltage, as the loops of piezo stacks are."""
    bend = np.log1p(np.exp((u - 6.0) / 0.8)) - np.log1p(np.exp(-6.0 / 0.8))
    return np.asarray(u + 0.35 * bend)


def hysteresis(z: Array) -> Array:
    """Sums 60 plays; their weights fall exponentially with the half-width."""
    half_widths = np.linspace(0.0, 5.0, 60)
    weights = 0.055 * np.exp(-half_widths / 1.4)
    weights[0] = 1.25
    state = np.zeros_like(half_widths)
    v = np.empty_like(z)
    for k, value in enumerate(z):
        state = np.clip(state, value - half_widths, value + half_widths)
        v[k] = weights @ state
    return v


def dynamics(v: Array) -> Array:
    """An amplifier pole at 500 Hz before a resonance at 140 Hz, damping 0.05.

    The drive is held between samples and the hysteresis is rate-independent, so the zero-order hold of
    the continuous system is exact.
    """
    natural, damping, amplifier = 2 * np.pi * 140.0, 0.05, 2 * np.pi * 500.0
    numerator = [amplifier * natural**2]
    denominator = np.polymul([1.0, 2 * damping * natural, natural**2], [1.0, amplifier])
    discrete = signal.cont2discrete((numerator, denominator), 1 / RATE, method="zoh")
    return np.asarray(signal.lfilter(np.ravel(discrete[0]), discrete[1], v))


def seconds(duration: float) -> Array:
    return np.arange(round(duration * RATE)) / RATE


def rest(duration: float) -> Array:
    return np.zeros_like(seconds(duration))


def multisine(
    duration: float, low: float, high: float, centre: float, rms: float, random: np.random.Generator
) -> Array:
    """Random phases on every line of the band, faded in and out from and to zero.

    Amplitudes fall above 30 Hz, so that the resonance does not take up the whole stroke.
    """
    samples = len(seconds(duration))
    lines = np.fft.rfftfreq(samples, 1 / RATE)
    phases = np.exp(2j * np.pi * random.random(len(lines)))
    spectrum = np.where((lines >= low) & (lines <= high), phases / (1 + lines / 30.0), 0)
    wave = np.fft.irfft(spectrum, samples)
    fade = np.minimum(1.0, np.minimum(seconds(duration), duration - seconds(duration)) / 0.3)
    return np.asarray((centre + rms * wave / wave.std()) * np.sin(0.5 * np.pi * fade) ** 2)


def triangle(duration: float, frequency: float, peak: float) -> Array:
    """From zero up and down between shrinking limits around half the peak, back to zero in the end."""
    t = seconds(duration)
    wave = signal.sawtooth(2 * np.pi * frequency * t, 0.5)
    return np.asarray(
        0.5 * peak * (1 + wave * (1 - 0.8 * t / duration)) * np.minimum(1.0, (duration - t) / 0.2)
    )


def stairs(duration: float, levels: list[float]) -> Array:
    """Steps of equal length: they make the stage ring."""
    samples = len(seconds(duration))
    return np.repeat(levels, int(np.ceil(samples / len(levels))))[:samples]


def sine(duration: float, frequency: float, peaks: tuple[float, float]) -> Array:
    """A raised sine from zero whose peak moves from the first value to the second."""
    t = seconds(duration)
    return np.asarray(0.5 * np.interp(t, [0.0, duration], peaks) * (1 - np.cos(2 * np.pi * frequency * t)))


def first_experiment(random: np.random.Generator) -> Array:
    parts = [
        rest(0.4),
        multisine(4.0, 1.0, 980.0, 5.0, 1.4, random),
        triangle(3.0, 2.0, 10.0),
        stairs(2.5, [2.0, 5.0, 9.0, 6.0, 8.0, 3.0, 4.0, 1.0, 7.0, 0.0]),
        sine(2.0, 2.0, (9.5, 9.5)),
        rest(0.1),
    ]
    return np.concatenate(parts)


def second_experiment(random: np.random.Generator) -> Array:
    parts = [
        rest(0.3),
        sine(3.0, 3.0, (9.0, 2.0)),
        stairs(2.0, [7.0, 3.0, 6.0, 1.0, 4.0, 9.0, 2.0, 0.0]),
        multisine(2.5, 2.0, 700.0, 4.0, 1.1, random),
        triangle(2.0, 3.0, 8.0),
        rest(0.2),
    ]
    return np.concatenate(parts)


def write(path: Path, u: Array, random: np.random.Generator) -> None:
    # What the converter puts out is what the file says.
    u = np.round(u, 4)
    y = dynamics(hysteresis(envelope(u))) + OFFSET_UM + NOISE_UM * random.standard_normal(len(u))
    t = np.arange(len(u)) / RATE
    rows = [f"{a:.4f},{b:.4f},{c:.4f}\n" for a, b, c in zip(t, u, y, strict=True)]
    text = "t_s,u_V,y_um\n" + "".join(rows)
    # No name and no time in the header: the same record is the same file.
    with path.open("wb") as file, gzip.GzipFile("", "wb", 9, file, mtime=0) as archive:
        archive.write(text.encode())
    print(f"{path.name}: {len(u)} samples, {path.stat().st_size / 1e3:.0f} kB")


def main() -> None:
    random = np.random.default_rng(20240611)
    DATA.mkdir(exist_ok=True)
    write(DATA / "demo.csv.gz", first_experiment(random), random)
    write(DATA / "demo_again.csv.gz", second_experiment(random), random)


if __name__ == "__main__":
    main()

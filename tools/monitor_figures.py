"""Print how often `gpi monitor` raises false alarms, and how soon it notices changes, on simulated machines.

Every machine has random parameters and a model that was identified from a noisy record of it. Streams without
a change give the rate of false alarms. In the other streams, the gain changes by 1 %, the first resonance by
1 %, or the width of the hysteresis by 5 % after two minutes, and the time in motion until it is noticed is
measured. A name with a question mark has a probability below 95 %.
"""

import argparse
import sys
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

import gpi_hammerstein as gpi

Array = NDArray[np.float64]
RATE = 50.0
# Seconds of the record from which the model is identified, and before the change.
TRAINING, BEFORE, AFTER = 240.0, 120.0, 240.0
# Seconds of motion within which a change must be noticed.
WITHIN = 60.0
CHANGES = {"gain": 0.01, "resonance": 0.01, "hysteresis-width": 0.05}
# Samples that are passed to the monitor at once.
PART = 50_000


@dataclass(frozen=True)
class Machine:
    """A stage: plays, a resonance, noise."""

    half_widths: Array
    weights: Array
    frequency: float
    damping: float
    gain: float
    noise: float

    @staticmethod
    def of(seed: int) -> "Machine":
        """Return a machine with random parameters."""
        random = np.random.default_rng(seed)
        plays = int(random.integers(4, 9))
        weights = random.uniform(0.2, 1.0, plays) * np.exp(-np.linspace(0.0, 2.0, plays))
        return Machine(
            half_widths=np.r_[0.0, np.linspace(0.4, 4.0, plays)],
            weights=np.r_[1.5, weights] / (1.5 + weights.sum()),
            frequency=float(random.uniform(4.0, 9.0)),
            damping=float(random.uniform(0.02, 0.2)),
            gain=float(random.uniform(0.5, 20.0)),
            noise=float(10 ** random.uniform(-3.3, -2.5)),
        )

    def changed(self, what: str, sign: float) -> "Machine":
        """Return the machine after a change."""
        factor = 1.0 + sign * CHANGES[what]
        if what == "gain":
            return replace(self, gain=self.gain * factor)
        if what == "resonance":
            return replace(self, frequency=self.frequency * factor)
        return replace(self, half_widths=self.half_widths * factor)

    def output(self, u: Array, random: np.random.Generator) -> Array:
        """Return the measured output."""
        w = 2 * np.pi * self.frequency / RATE
        pole = np.exp(w * complex(-self.damping, np.sqrt(1 - self.damping**2)))
        a = [1.0, -2 * pole.real, abs(pole) ** 2]
        g = gpi.StateSpace.from_transfer_function([0.5 * sum(a), 0.5 * sum(a)], a)
        v = gpi.PlayBank(self.half_widths, self.weights)(u)
        noise = 10.0 * self.gain * self.noise * random.normal(size=len(u))
        return self.gain * g.simulate(v) + noise


def drive(seconds: float, random: np.random.Generator) -> Array:
    """Return a drive between 0 and 10: sines, steps that excite the resonance, and rests, in turn."""
    parts: list[Array] = []
    done = 0
    while done < seconds * RATE:
        count = int(random.uniform(10.0, 40.0) * RATE)
        t = np.arange(count) / RATE
        kind = random.integers(3)
        if kind == 0:
            frequencies = random.uniform(0.05, 10.0, 6)
            part = sum(np.sin(2 * np.pi * (f * t + random.random())) / (1 + f) for f in frequencies)
            part = np.asarray(part)
        elif kind == 1:
            levels = random.uniform(-1, 1, count // 100 + 1)
            part = np.repeat(levels, 100)[:count]
        else:
            part = np.sin(2 * np.pi * random.uniform(0.05, 1.0) * t) * np.linspace(1.0, 0.2, count)
        low, high = np.sort(random.uniform(0.0, 10.0, 2)) if random.random() < 0.5 else (0.0, 10.0)
        span = max(float(np.ptp(part)), 1e-9)
        parts.append(low + (high - low) * (part - part.min()) / span)
        done += count
        if random.random() < 0.2:
            rest = int(random.uniform(5.0, 60.0) * RATE)
            parts.append(np.full(rest, parts[-1][-1]))
            done += rest
    return np.concatenate(parts)[: int(seconds * RATE)]


def model_of(seed: int) -> tuple[Machine, gpi.Model]:
    """Return a machine and the model that was identified from its record."""
    machine, random = Machine.of(seed), np.random.default_rng([seed, 1])
    u = drive(TRAINING, random)
    u[: int(RATE)] = 0.0
    record = gpi.Record(u, machine.output(u, random), RATE)
    return machine, gpi.identify(record)


def unchanged(seed: int, streams: int, hours: float) -> list[tuple[int, list[str]]]:
    """Return the false alarms of some streams: the number of the stream and the names."""
    machine, model = model_of(seed)
    found = []
    for stream in range(streams):
        random = np.random.default_rng([seed, 2, stream])
        u = drive(3600.0 * hours, random)
        y = machine.output(u, random)
        monitor = gpi.Monitor(model)
        for first in range(0, len(u), PART):
            monitor.push(u[first : first + PART], y[first : first + PART])
        if monitor.changed:
            found.append((stream, [f"{c['what']} {c['size']:+.3g} {c['unit']}" for c in monitor.changes]))
    return found


def noticed(seed: int, streams: int) -> list[tuple[str, float | None, list[str]]]:
    """Return, for each change, the seconds of motion until it is noticed (None: too late) and the names."""
    machine, model = model_of(seed)
    found = []
    for what in CHANGES:
        for stream in range(streams):
            random = np.random.default_rng([seed, 3, stream])
            after = machine.changed(what, (-1.0) ** stream)
            u = drive(BEFORE + AFTER, random)
            state = random.bit_generator.state
            before_y = machine.output(u, random)
            random.bit_generator.state = state
            after_y = after.output(u, random)
            split = int(BEFORE * RATE)
            y = np.r_[before_y[:split], after_y[split:]]
            monitor = gpi.Monitor(model)
            monitor.push(u[:split], y[:split])
            early = monitor.changed
            when, moved, part = None, 0.0, int(monitor.period * RATE)
            for first in range(split, len(u), part):
                monitor.push(u[first : first + part], y[first : first + part])
                moved += monitor.period * bool(np.ptp(u[first : first + part]) > 0)
                if moved >= WITHIN:
                    break
                if when is None and monitor.changed:
                    when = moved
            names = (
                ["early"]
                if early
                else [
                    change["what"] + ("?" if change["confidence"] < 0.95 else "")
                    for change in monitor.changes
                ]
            )
            found.append((what, when, names))
    return found


def main() -> int:
    """Run the streams and print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--machines", type=int, default=20)
    parser.add_argument("--streams", type=int, default=10, help="streams of each machine without a change")
    parser.add_argument("--hours", type=float, default=10.0)
    parser.add_argument("--changed", type=int, default=10, help="streams of each machine and change")
    parser.add_argument("--seed", type=int, default=100)
    parser.add_argument("--processes", type=int, default=2)
    given = parser.parse_args()
    seeds = range(given.seed, given.seed + given.machines)
    began = time.monotonic()
    with ProcessPoolExecutor(given.processes) as pool:
        changed = list(pool.map(noticed, seeds, [given.changed] * len(seeds)))
        for what in CHANGES:
            own = [one for of in changed for one in of if one[0] == what]
            times = sorted(when for _, when, _ in own if when is not None)
            right = sum(names == [what] for _, _, names in own)
            median = f", median {times[len(times) // 2]:.0f} s" if times else ""
            print(
                f"{what} {100 * CHANGES[what]:g} %: noticed within {WITHIN:.0f} s of motion in "
                f"{len(times)} of {len(own)} "
                f"({100 * len(times) / len(own):.0f} %){median}; named as that alone {right}"
            )
            others = Counter("+".join(names) or "nothing" for _, _, names in own if names != [what])
            print(f"  else: {dict(others)}")
        alarms = 0
        for seed, found in zip(
            seeds,
            pool.map(unchanged, seeds, [given.streams] * len(seeds), [given.hours] * len(seeds)),
            strict=True,
        ):
            alarms += len(found)
            for stream, names in found:
                print(f"false alarm: machine {seed}, stream {stream}: {', '.join(names)}")
    hours = given.machines * given.streams * given.hours
    print(f"{alarms} false alarms in {hours:g} hours; {time.monotonic() - began:.0f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""Print how often `explain` names the right effect, and the error before and after.

Records: those with labels under `blind/dev` of the data folder (`GPI_DATA_DIR`, else `../shared`), and
plants of the tests' own simulator, drawn at random. `python tools/scoreboard.py --help` lists the options.
"""

import argparse
import json
import os
import sys
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "python" / "tests"))

import gpi_hammerstein as gpi  # noqa: E402
import plants  # noqa: E402  the simulator that the tests use

# What the labels call effects that the catalogue has under another name.
ALSO = {"duffing": "stiffness", "preisach": "hysteresis-shape"}
# Effects of the plants that are drawn one at a time; G's order and delay belong to the declared model here.
SINGLE = [name for name in plants.CATALOGUE if name not in ("delay", "linear-dynamics")]


@dataclass
class Result:
    """One record explained: errors over the noise."""

    name: str
    wanted: tuple[str, ...]
    found: tuple[str, ...]
    verdict: str
    before: float
    after: float
    again: float
    seconds: float

    def is_right(self) -> bool:
        """Whether the effects are those of the label."""
        return sorted(self.wanted) == sorted(self.found)

    def line(self) -> str:
        """One line of the table."""
        return (
            f"{'  ' if self.is_right() else '! '}{self.name:34s} {', '.join(self.wanted) or '-':44s} "
            f"{', '.join(self.found) or '-':44s} {self.verdict:16s} {self.before:8.2f} {self.after:6.2f} "
            f"{self.again:6.2f} {self.seconds:6.1f} s"
        )


HEAD = (
    f"  {'record':34s} {'wanted':44s} {'found':44s} {'verdict':16s} {'before':>8s} {'after':>6s} "
    f"{'again':>6s} {'time':>8s}"
)


def explained(
    name: str, wanted: tuple[str, ...], record: gpi.Record, again: gpi.Record, noise: float
) -> Result:
    """Explain a record and score the model on another experiment of the same plant."""
    begin = time.perf_counter()
    found = gpi.explain(record)
    seconds = time.perf_counter() - begin
    error = found.model.error(again, fit_start=True)["rms"]
    before, after = (errors["holdout"]["rms"] / noise for errors in (found.before, found.after))
    effects = tuple(found.effects)
    return Result(name, wanted, effects, found.verdict, before, after, error / noise, seconds)


def labelled(folder: str, name: str) -> Result:
    """Explain one record of the data folder."""
    label = json.loads((Path(folder) / "labels.json").read_text())[name]
    wanted = tuple(ALSO.get(effect, effect) for effect in label["effects"])
    record, again = (gpi.read_record(Path(folder) / f"{name}{part}.csv.gz") for part in ("", ".again"))
    return explained(name, wanted, record, again, label["noise_std_um"])


def simulated(seed: int, effects: tuple[str, ...], strength: float | None, seconds: float) -> Result:
    """Explain one record of the simulator."""
    plant = plants.draw(seed, effects, strength, seconds)
    record, again = (as_record(plant.record(number)) for number in (0, 1))
    unnamed = any(effect in plants.OUTSIDE or effect == "unattributed" for effect in effects)
    wanted = () if unnamed else effects
    name = f"plant {seed} {'+'.join(plant.effects) if unnamed else ''}"
    return explained(name, wanted, record, again, plant.noise_std)


def as_record(run: plants.Recording) -> gpi.Record:
    """Return a simulated recording as the package reads one."""
    columns = {} if run.x is None else {"covariates": run.x}
    return gpi.Record(run.u, run.y, rate=run.rate, input_units=["V"], output_units=["um"], **columns)


def work(arguments: argparse.Namespace) -> Iterator[tuple[object, ...]]:
    """Yield what to do: a function and its arguments."""
    root = Path(os.environ.get("GPI_DATA_DIR", Path(__file__).resolve().parents[2] / "shared"))
    folder = root / "blind" / "dev"
    if arguments.records and (folder / "labels.json").exists():
        for name in sorted(json.loads((folder / "labels.json").read_text())):
            yield labelled, str(folder), name
    random = np.random.default_rng(arguments.seed)
    for number in range(arguments.plants):
        kind = number % 10
        if kind == 0:
            effects: tuple[str, ...] = ()
        elif kind == 9:
            effects = ("unattributed",)
        else:
            count = 1 if kind < 7 else kind - 5
            effects = tuple(str(name) for name in random.choice(SINGLE, count, replace=False))
        yield simulated, arguments.seed + number, effects, arguments.strength, arguments.seconds


def confusion(results: list[Result]) -> None:
    """Print how often each single effect was found, and what was found instead."""
    print("\nsingle effects: wanted -> found")
    table: dict[str, Counter[str]] = {}
    for result in results:
        if len(result.wanted) <= 1:
            wanted = result.wanted[0] if result.wanted else "none"
            table.setdefault(wanted, Counter())[", ".join(sorted(result.found)) or "none"] += 1
    for wanted, found in sorted(table.items()):
        total, right = found.total(), found[wanted]
        others = "; ".join(f"{count} x {name}" for name, count in found.most_common() if name != wanted)
        print(f"  {wanted:22s} {right:3d} of {total:3d}   {others}")


def main() -> None:
    """Explain, and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--plants", type=int, default=40, help="plants of the simulator")
    parser.add_argument("--seed", type=int, default=1000, help="the first plant's seed")
    parser.add_argument("--strength", type=float, default=None, help="rms of every effect over the noise")
    parser.add_argument("--seconds", type=float, default=30.0, help="length of the simulated records")
    parser.add_argument("--no-records", dest="records", action="store_false", help="plants alone")
    arguments = parser.parse_args()
    print(HEAD, flush=True)
    results = []
    with ProcessPoolExecutor(max_workers=os.cpu_count()) as pool:
        jobs = [pool.submit(*job) for job in work(arguments)]  # type: ignore[arg-type]
        for job in jobs:
            result: Result = job.result()  # type: ignore[assignment]
            results.append(result)
            print(result.line(), flush=True)
    confusion(results)
    right = [result for result in results if result.is_right()]
    clean = [result for result in results if not result.wanted]
    print(f"\nright: {len(right)} of {len(results)}")
    print(f"false alarms where nothing is to be found: {sum(bool(r.found) for r in clean)} of {len(clean)}")
    if right:
        ratios = np.array([result.after for result in right])
        print(
            f"held-out error over the noise, where right: median {np.median(ratios):.3f}, "
            f"worst {ratios.max():.3f}"
        )
        print(
            f"time: median {np.median([r.seconds for r in results]):.1f} s, "
            f"longest {max(r.seconds for r in results):.1f} s"
        )


if __name__ == "__main__":
    main()

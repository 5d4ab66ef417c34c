"""Print how often `explain` names the right effects, and the error before and after.

The records are those with labels under `blind/dev` and `blind/foreign` of the data folder (`GPI_DATA_DIR`,
else `../shared`), plants of the tests' simulator that are drawn at random, and stages of other textbooks.
`python tools/scoreboard.py --help` lists the options.
"""

import argparse
import json
import os
import shlex
import sys
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from dataclasses import asdict
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "python" / "tests"))

import plants  # noqa: E402  the simulator that the tests use
import score_tables  # noqa: E402
import textbook_tables  # noqa: E402
from data_folder import DEV, FOREIGN  # noqa: E402
from gpi_hammerstein.files import write_atomically  # noqa: E402
from plants import textbook  # noqa: E402
from scores import Result, clean, foreign, labelled, of_copy, of_textbook, piece, simulated  # noqa: E402

# Effects of the simulated plants. G's order and delay are left out: here, the declared model contains them.
SINGLE = [name for name in plants.CATALOGUE if name not in ("delay", "linear-dynamics")]
POWER_STRENGTHS = (0.2, 0.5, 1.0, 2.0, 3.0)  # rms of the effect over that of the noise

Job = tuple[Callable[..., Result], tuple[object, ...]]


class Kept:
    """Results in a file, so that a stopped run can be continued."""

    def __init__(self, path: Path | None) -> None:
        """Read the results of an earlier run."""
        self.path = path
        self.results: dict[str, Result] = {}
        if path is not None and path.exists():
            for name, values in json.loads(path.read_text()).items():
                lists = ("wanted", "found", "may", "one_of")
                names = {key: tuple(values[key]) for key in lists if values.get(key) is not None}
                self.results[name] = Result(**{**values, **names})

    @staticmethod
    def name(job: Job) -> str:
        """Return the unique name of a job."""
        function, values = job
        return " ".join([function.__name__, *(getattr(value, "__name__", str(value)) for value in values)])

    def find(self, job: Job) -> Result | None:
        """Return the job's result if the file contains it."""
        return self.results.get(self.name(job))

    def add(self, job: Job, result: Result) -> Result:
        """Add a result to the file."""
        self.results[self.name(job)] = result
        if self.path is not None:
            known = {name: asdict(result) for name, result in self.results.items()}
            write_atomically(self.path, json.dumps(known, indent=1))
        return result


HEAD = (
    f"  {'record':34s} {'wanted':44s} {'found':44s} {'verdict':16s} {'before':>8s} {'after':>6s} "
    f"{'again':>6s} {'time':>8s}"
)


def line(result: Result) -> str:
    """Return the line of one record, below `HEAD`."""
    name = result.name if result.strength is None else f"{result.name} at {result.strength:g}"
    return (
        f"{'  ' if result.is_right() else '! '}{name:34s} {', '.join(result.wanted) or '-':44s} "
        f"{', '.join(result.found) or '-':44s} {result.verdict:16s} {result.before:8.2f} {result.after:6.2f} "
        f"{result.again:6.2f} {result.seconds:6.1f} s"
    )


def mixed_work(arguments: argparse.Namespace) -> Iterator[Job]:
    """Yield labelled records, and plants with no, one, two or three effects or one outside the catalogue."""
    for function, folder in ((labelled, DEV), (foreign, FOREIGN)) if arguments.records else ():
        labels = folder / "labels.json"
        names = sorted(json.loads(labels.read_text())) if labels.exists() else []
        yield from ((function, (folder, name)) for name in names if (arguments.only or "") in name)
    random = np.random.default_rng(arguments.seed)
    for number in range(arguments.plants):
        kind = number % 10
        if kind == 0:
            effects: tuple[str, ...] = ()
        elif kind == 9:
            effects = ("unattributed",)
        else:
            count = 1 if kind < 7 else kind - 5
            count = min(count, len(arguments.effects))
            effects = tuple(str(name) for name in random.choice(arguments.effects, count, replace=False))
        yield simulated, (arguments.seed + number, effects, arguments.strength, arguments.seconds)


def power_work(arguments: argparse.Namespace) -> Iterator[Job]:
    """Yield every single effect at every strength, on a few plants each."""
    for name in arguments.effects:
        for strength in POWER_STRENGTHS:
            for number in range(arguments.power_seeds):
                yield simulated, (arguments.seed + number, (name,), strength, arguments.seconds)


def textbook_work(arguments: argparse.Namespace) -> Iterator[Job]:
    """Yield some seeds of every stage of another textbook; every second one starts in motion."""
    for stages, number in (
        (textbook.ORDINARY, arguments.textbook),
        (textbook.MECHANICS, arguments.mechanics),
    ):
        for name in stages:
            # a whole name means this stage alone
            if arguments.only == name or (arguments.only not in stages and (arguments.only or "") in name):
                seeds = range(arguments.seed, arguments.seed + number)
                yield from ((of_textbook, (name, seed)) for seed in seeds)


def clean_work(arguments: argparse.Namespace) -> Iterator[Job]:
    """Yield records that lack nothing and have another experiment: simulated, of a textbook, and labelled."""
    if not arguments.clean:
        return
    seeds = range(arguments.seed, arguments.seed + arguments.clean)
    yield from ((clean, (seed, arguments.seconds)) for seed in seeds)
    yield from ((of_textbook, ("clean", seed)) for seed in seeds)
    for function, folder, effects in ((labelled, DEV, "effects"), (foreign, FOREIGN, "must")):
        labels = folder / "labels.json"
        for name, label in sorted(json.loads(labels.read_text()).items()) if labels.exists() else ():
            others = (*label[effects], *label.get("may", ()))
            if not others and (folder / f"{name}.again.csv.gz").exists():
                yield function, (folder, name)


def piece_work(arguments: argparse.Namespace) -> Iterator[Job]:
    """Yield pieces of long records of stages with two effects; every fifth one lacks nothing."""
    random = np.random.default_rng(arguments.seed)
    for number in range(arguments.pieces):
        drawn = tuple(str(name) for name in random.choice(arguments.effects, 2, replace=False))
        yield piece, (arguments.seed + number, drawn if number % 5 else (), arguments.seconds)


def copies(work: Iterable[Job], seed: int | None) -> Iterator[Job]:
    """Yield the jobs, or those of changed copies of their records where there is a seed."""
    for function, values in work:
        yield (function, values) if seed is None else (of_copy, (seed, function, *values))


def run(pool: Executor, work: Iterable[Job], kept: Kept) -> list[Result]:
    """Run the jobs whose results are not in the file, and print one line for each record, in order."""
    jobs = [(job, None if kept.find(job) else pool.submit(job[0], *job[1])) for job in work]
    results = []
    for job, running in jobs:
        result = kept.find(job) if running is None else kept.add(job, running.result())
        assert result is not None
        results.append(result)
        print(line(result), flush=True)
    return results


def reproduced(result: Result) -> str:
    """Return the command that explains the record of one textbook stage again."""
    seed = result.name.split(",")[0].split()[-1]
    option = "textbook" if result.stage in textbook.ORDINARY else "mechanics"
    return (
        f"python tools/scoreboard.py --no-records --plants 0 --{option} 1 --seed {seed} --only {result.stage}"
    )


def as_markdown(tables: Iterable[score_tables.Table], title: str) -> str:
    """Return the tables, below a title and the command that made them."""
    words = iter(sys.argv[1:])
    # the file of earlier results and the number of processes do not change the tables
    told = [word for word in words if word not in ("--keep", "--processes") or next(words) is None]
    command = shlex.join(["python", "tools/scoreboard.py", *told])
    return "\n".join([f"# {title}\n\nMade by `{command}`.\n", *(table.markdown() for table in tables)])


def main() -> None:
    """Explain all records, and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--plants", type=int, default=40, help="number of simulated plants")
    parser.add_argument("--seed", type=int, default=1000, help="seed of the first plant")
    parser.add_argument(
        "--strength", type=float, default=None, help="rms of every effect over that of the noise"
    )
    parser.add_argument("--seconds", type=float, default=30.0, help="length of the simulated records in s")
    parser.add_argument(
        "--no-records", dest="records", action="store_false", help="leave out the labelled records"
    )
    parser.add_argument(
        "--only",
        metavar="TEXT",
        help="only the labelled records and textbook stages whose name contains this",
    )
    parser.add_argument(
        "--textbook",
        type=int,
        default=0,
        metavar="N",
        help="N seeds of every stage of other textbooks; odd seeds start in motion",
    )
    parser.add_argument(
        "--mechanics",
        type=int,
        default=0,
        metavar="N",
        help="N seeds of every stage with a force inside the mechanics, alone and beside another effect",
    )
    parser.add_argument(
        "--clean",
        type=int,
        default=0,
        metavar="N",
        help="N records each of simulated and of textbook stages that lack nothing, and the labelled ones",
    )
    parser.add_argument(
        "--pieces",
        type=int,
        default=0,
        metavar="N",
        help="N pieces cut out of long records while the stage moves, in which no false effect may be named",
    )
    parser.add_argument(
        "--copy",
        type=int,
        metavar="SEED",
        help="change every output sample by a part of 1e-9 at random, which must not change an answer",
    )
    parser.add_argument(
        "--processes",
        type=int,
        default=os.cpu_count(),
        metavar="N",
        help="number of records at the same time",
    )
    parser.add_argument(
        "--effects",
        nargs="+",
        choices=SINGLE,
        default=SINGLE,
        metavar="EFFECT",
        help="draw only these effects",
    )
    parser.add_argument("--power", action="store_true", help="also test single effects near the noise level")
    parser.add_argument(
        "--power-seeds", type=int, default=3, help="number of plants for each effect and strength"
    )
    parser.add_argument(
        "--markdown",
        type=Path,
        metavar="FILE",
        help="file to write the tables to, for example docs/scoreboard.md",
    )
    parser.add_argument(
        "--keep", type=Path, metavar="FILE", help="file of results; a stopped run is continued from it"
    )
    arguments = parser.parse_args()
    kept = Kept(arguments.keep)
    print(HEAD, flush=True)
    with ProcessPoolExecutor(max_workers=arguments.processes) as pool:
        mixed, near_noise, other, lacking_nothing, cut = (
            run(pool, copies(work, arguments.copy), kept)
            for work in (
                mixed_work(arguments),
                power_work(arguments) if arguments.power else [],
                textbook_work(arguments),
                clean_work(arguments),
                piece_work(arguments),
            )
        )
    tables = []
    if mixed:
        tables += [score_tables.singles(mixed), score_tables.by_number(mixed), score_tables.summary(mixed)]
    if near_noise:
        tables.append(score_tables.power(near_noise))
    if other:
        tables += [textbook_tables.by_stage(other), textbook_tables.totals(other)]
        tables.append(textbook_tables.mistakes(other, reproduced))
    if lacking_nothing:
        tables.append(score_tables.clean(lacking_nothing))
    if cut:
        tables.append(score_tables.pieces(cut))
    for table in tables:
        print(table.text())
    seconds = [result.seconds for result in (*mixed, *near_noise, *other, *lacking_nothing, *cut)]
    if seconds:
        print(f"\ntime: median {np.median(seconds):.1f} s, longest {max(seconds):.1f} s")
    if arguments.markdown is not None:
        arguments.markdown.parent.mkdir(parents=True, exist_ok=True)
        is_alone = not (arguments.plants or arguments.records or arguments.clean)
        parts = [arguments.textbook and "stages of other textbooks"]
        parts.append(arguments.mechanics and "forces inside the mechanics")
        title = ": ".join(["Scoreboard", *([" and ".join(filter(None, parts))] if is_alone else [])])
        write_atomically(arguments.markdown, as_markdown(tables, title))


if __name__ == "__main__":
    main()

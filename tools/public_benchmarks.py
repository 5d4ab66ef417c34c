"""Explain the public benchmarks, and print the names and errors next to what is known and published.

The files are searched in GPI_DATA_DIR (a folder with `measured`), else in `../shared`, and downloaded if they
are in neither. Run it from the root of the project: `make public-benchmarks`.
"""

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "python" / "tests"))

import gpi_hammerstein as gpi  # noqa: E402
import score_tables  # noqa: E402
from gpi_hammerstein.explanation import to_dict  # noqa: E402
from gpi_hammerstein.files import write_atomically  # noqa: E402
from gpi_hammerstein.reproduce.catalogue import BENCHMARKS  # noqa: E402
from gpi_hammerstein.reproduce.public import TRAINING, Reproduction, reproduce  # noqa: E402

INTRODUCTION = """# Public benchmarks

Made by `make public-benchmarks`. `gpi reproduce NAME` runs one of them, prints the explanation and draws the
errors.

All errors are rms errors of simulation: the model sees the input alone, and the initial state is fitted to
the first samples. The error of the training part is that of blocks of time that were not used for the fit.
The error over horizons is that of predictions over this time, each from an initial state that is fitted to
the samples before it (`Model.over_horizons`), on all of the training part.
The multisine and the sweep of `bouc-wen` have no noise: they are integrated from the published equations,
and the official test files are other realisations. Published errors are those of the official tests.
"""


def rows(answer: Reproduction) -> list[tuple[str, ...]]:
    """Return one row for each part of a benchmark."""
    benchmark = answer.benchmark
    found = []
    for part, (before, after) in answer.errors.items():
        published = [
            f"{source}: {errors[part]:.4g}"
            for source, errors in benchmark.published.items()
            if part in errors
        ]
        name = f"{part}, held out" if part == TRAINING else part
        sizes = (f"{before:.4g} {benchmark.unit}", f"{after:.4g} {benchmark.unit}")
        found.append((benchmark.name, name, *sizes, "; ".join(published)))
    return found


def names(answer: Reproduction) -> tuple[str, ...]:
    """Return what is known, and what was named."""
    known = ", ".join(answer.benchmark.effects) or "none in the catalogue"
    named = ", ".join(answer.found.effects) or "none"
    false = ", ".join(answer.false_names) or "none"
    return answer.benchmark.name, known, named, false, answer.found.verdict, f"{answer.seconds:.0f}"


def parameters(answer: Reproduction) -> str:
    """Return what is known of the plant, and the parameters that were found."""
    lines = [f"## {answer.benchmark.title}", "", answer.benchmark.truth, ""]
    for step in to_dict(answer.found)["steps"]:
        if step["effect"] in answer.benchmark.effects:
            sizes = (
                f"`{name}` {own['value']:.4g} ± {own['std']:.2g} {own['unit']}".rstrip()
                for name, own in step["parameters"].items()
            )
            lines += [f"Found for `{step['effect']}`: {', '.join(sizes)}.", ""]
    return "\n".join(lines)


def main() -> None:
    """Print the tables, and write them to a file if one is given."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--only", metavar="TEXT", default="", help="only benchmarks whose name contains this")
    parser.add_argument("--markdown", type=Path, metavar="FILE", help="file to write the tables to")
    options = parser.parse_args()
    answers = []
    for name, benchmark in BENCHMARKS.items():
        if options.only not in name:
            continue
        try:
            answers.append(reproduce(benchmark))
        except gpi.DataError as absent:
            print(f"{name}: {absent}", file=sys.stderr)
            continue
        for row in rows(answers[-1]):
            print("  ".join(row), flush=True)
    heads = ("benchmark", "known effects", "named", "false names", "verdict", "seconds")
    tables = [
        score_tables.Table("Names", heads, [names(answer) for answer in answers]),
        score_tables.Table(
            "Errors",
            ("benchmark", "part", "declared model", "final model", "published"),
            [row for answer in answers for row in rows(answer)],
        ),
    ]
    if options.markdown:
        parts = [INTRODUCTION, *(table.markdown() for table in tables), *map(parameters, answers)]
        write_atomically(options.markdown, "\n".join(parts))


if __name__ == "__main__":
    main()

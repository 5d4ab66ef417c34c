"""Tables and pictures of residual tests for commands."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.table import Table

from gpi_hammerstein.cli.output import escape, picture
from gpi_hammerstein.uncertain import OF_SIZE, p_value_in_words

if TYPE_CHECKING:
    from gpi_hammerstein.plot import Residuals

# The picture that shows the structure of each test best.
PICTURES = {
    "mean": "residual_time",
    "whiteness": "residual_autocorrelation",
    "lines": "residual_spectrum",
    "past-input": "residual_spectrum",
    "past-intermediate": "residual_spectrum",
    "level": "residual_over_input",
    "speed": "residual_over_speed",
    "direction": "residual_over_input",
    "amplitude": "residual_time",
    "level-to-level": "residual_time",
    "trend": "residual_time",
    "prediction": "residual_over_input",
    "higher-order": "residual_time",
    "outliers": "residual_time",
}


def file_name(kind: str, output: int, outputs: int) -> str:
    """Return the file name of a picture, numbered from 1 if there are several outputs."""
    return f"{kind}.png" if outputs == 1 else f"{kind}_{output + 1}.png"


def name_pictures(tests: list[dict[str, Any]], outputs: Sequence[str], *, drawn: bool = True) -> None:
    """Add the ``picture`` to every failed test; it is None if the test passes or no pictures are drawn."""
    for test in tests:
        kind = PICTURES.get(test["name"], "residual_time")
        name = file_name(kind, outputs.index(test["output"]), len(outputs))
        test["picture"] = name if drawn and not test["passed"] else None


def write_residual_pictures(folder: Path, left: "Residuals") -> None:
    """Draw the residual of every output over time, frequency, input, speed and lag."""
    from gpi_hammerstein import plot

    outputs = len(left.record.output_names)
    for output in range(outputs):
        draws = {
            "residual_time": plot.residual_in_time,
            "residual_spectrum": plot.residual_spectrum,
            "residual_over_input": plot.residual_over_input,
            "residual_over_speed": plot.residual_over_speed,
            "residual_autocorrelation": plot.residual_autocorrelation,
        }
        for kind, draw in draws.items():
            width = 10.0 if kind == "residual_time" else 8.0
            path = folder / file_name(kind, output, outputs)
            picture(path, lambda ax, draw=draw, output=output: draw(left, ax, output=output), width)  # type: ignore[misc]


def tests_table(tests: Sequence[dict[str, Any]]) -> Table:
    """Return a table of the tests."""
    table = Table(title="Tests of the residual", title_justify="left", caption_justify="left")
    if any(test["p_value"] is None for test in tests):
        table.caption = OF_SIZE
    several = len({test["output"] for test in tests}) > 1
    names = ["output"] * several + ["test", "statistic", "threshold", "p-value", "passed", "points to"]
    for name in names:
        table.add_column(name, justify="right" if name in ("statistic", "threshold", "p-value") else "left")
    for test in tests:
        table.add_row(
            *[escape(test["output"])] * several,
            test["name"],
            f"{test['statistic']:.3g}",
            f"{test['threshold']:.3g}",
            p_value_in_words(test),
            "yes" if test["passed"] else "[red]no[/]",
            escape(test["points_to"]),
        )
    return table

"""`gpi reproduce fsm`: a steering mirror with hysteresis inside the mechanical loop."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer
from rich.table import Table

from gpi_hammerstein import files
from gpi_hammerstein._native import Model
from gpi_hammerstein.cli import options
from gpi_hammerstein.cli.output import (
    console,
    escape,
    picture,
    print_json,
    say_written,
)
from gpi_hammerstein.cli.progress import progress_bar
from gpi_hammerstein.explanation import in_words, to_dict
from gpi_hammerstein.json_values import write_json
from gpi_hammerstein.reproduce.steering_mirror import (
    HELD_OUT,
    LEVELS,
    ORDER,
    PUBLISHED,
    Level,
    SteeringMirror,
    frequency_response,
    steering_mirror,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Frequencies in Hz around the resonance that moves most with the amplitude.
SHOWN = (880.0, 1080.0)


def steering_mirror_command(
    data: Annotated[
        Path | None,
        typer.Option(help="Folder of the arrays. Default: the data folder, or a download.", metavar="DIR"),
    ] = None,
    levels: Annotated[
        str, typer.Option(help="Amplitudes in mV that are used for the fit.", metavar="100,200,300")
    ] = ",".join(map(str, LEVELS)),
    order: Annotated[int, typer.Option(min=2, help="Order (number of states) of the linear part.")] = ORDER,
    realisations: Annotated[
        int, typer.Option(min=1, max=HELD_OUT, help="Number of realisations that are used for the fit.")
    ] = HELD_OUT,
    out: options.Out = None,
    log: options.Log = False,
    as_json: options.Json = False,
) -> None:
    """Find the effects that the model of a fast steering mirror lacks, and compare with published models.

    The mirror has three piezos and three displacements, measured at three amplitudes. The last realisation of
    each amplitude is held out. Writes fsm.json, model.json and pictures of the frequency response at each
    amplitude to DIR.
    """
    chosen = options.parse_numbers("levels", levels)
    fitted = [int(level) for level in np.atleast_1d(np.asarray(chosen))]
    with progress_bar(log=log) as progress:
        mirror = steering_mirror(
            data, fitted=fitted, order=order, realisations=realisations, progress=progress
        )
    result = describe(mirror)
    if out is not None:
        with files.staged(out) as folder:
            files.save_model(mirror.found.model, folder / "model.json")
            draw(mirror, folder)
            result["files"] = sorted([*(file.name for file in folder.iterdir()), "fsm.json"])
            write_json(result, folder / "fsm.json")
    if as_json:
        print_json(result)
        return
    screen = console()
    screen.print(comparison(mirror))
    screen.print()
    for sentence in in_words(result["explanation"], "um"):
        screen.print(escape(sentence))
    say_written(screen, out, result["files"])


def describe(mirror: SteeringMirror) -> dict[str, Any]:
    """Return the errors of all models and the explanation, for JSON."""
    return {
        "schema": "gpi-reproduction/1",
        "example": "fsm",
        "fitted_mv": list(mirror.fitted),
        "seconds": mirror.seconds,
        "published_percent": {name: list(errors) for name, errors in PUBLISHED.items()},
        "stages": [
            {
                "name": stage.name,
                "parameters": stage.parameters,
                "error_percent": {str(level): error for level, error in stage.errors.items()},
            }
            for stage in mirror.stages
        ],
        "explanation": to_dict(mirror.found),
        "files": [],
    }


def comparison(mirror: SteeringMirror) -> Table:
    """Return the table that the command prints."""
    fitted = ", ".join(map(str, mirror.fitted))
    title = (
        f"One model for all amplitudes, fitted at {fitted} mV in {mirror.seconds:.0f} s; error in % of the "
        "output's rms"
    )
    table = Table(title=title, title_justify="left")
    table.add_column("model", min_width=44)
    table.add_column("parameters", justify="right")
    for level in LEVELS:
        table.add_column(f"{level} mV", justify="right", min_width=6)
    for name, errors in PUBLISHED.items():
        table.add_row(name, "", *(f"{error:.2f}" for error in errors))
    table.add_section()
    for stage in mirror.stages:
        shown = (f"{stage.errors[level]:.2f}" for level in LEVELS)
        table.add_row(stage.name, str(stage.parameters), *shown)
    return table


def draw(mirror: SteeringMirror, folder: Path) -> None:
    """Draw the frequency response at each amplitude, with the first and with the last model."""
    for name, stage in (("before", mirror.stages[0]), ("after", mirror.stages[-1])):
        title = f"{stage.name}: {stage.parameters} parameters for all amplitudes"
        part = partial(draw_responses, levels=mirror.levels, model=stage.model, title=title)
        picture(folder / f"frequency_response_{name}.png", part)


def draw_responses(ax: "Axes", levels: list[Level], model: Model, title: str) -> None:
    """Draw the measured and the simulated response from the first input to the first output."""
    from gpi_hammerstein.plot.style import CYCLE

    for level, colour in zip(levels, CYCLE, strict=False):
        frequencies, measured = frequency_response(level)
        _, simulated = frequency_response(level, model)
        shown = (frequencies >= SHOWN[0]) & (frequencies <= SHOWN[1])
        for response, style, label in (
            (measured, ".", f"{level.millivolts} mV, measured"),
            (simulated, "-", "model"),
        ):
            size = np.abs(response[shown, 0, 0])
            ax.semilogy(frequencies[shown], size, style, ms=3, lw=1.2, color=colour, label=label)
    ax.set_xlabel("frequency [Hz]")
    ax.set_ylabel("y1 over u1 [um/V]")
    ax.set_title(title)
    ax.legend(ncols=3, fontsize="small")

"""`gpi reproduce paper`: the example of the source paper, as numbers and pictures."""

import textwrap
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.table import Table

from gpi_hammerstein import files
from gpi_hammerstein.cli import options
from gpi_hammerstein.cli.output import console, picture, print_json, say_written, working
from gpi_hammerstein.json_values import write_json
from gpi_hammerstein.reproduce.paper import PERIOD, Paper, ReadingResult, paper, response

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def paper_command(out: options.Out = None, as_json: options.Json = False) -> None:
    """Run the numerical example of the source paper, its figures 3 to 6.

    It is run with both deadzone conventions of equation (3), and with a third one in which thresholds act
    with both signs. Writes paper.json and a picture for each figure and convention to DIR.
    """
    with working("running the paper's example"):
        found = paper()
        result = describe(found)
    if out is not None:
        with working("drawing"), files.staged(out) as folder:
            draw(found, folder)
            result["files"] = sorted([*(file.name for file in folder.iterdir()), "paper.json"])
            write_json(result, folder / "paper.json")
    if as_json:
        print_json(result)
        return
    screen = console()
    screen.print(summary_table(found))
    screen.print()
    screen.print(refined_table(found))
    screen.print(
        "The refinement uses the first 20 001 samples without noise. A dash means that the record does not "
        "determine all play weights. `undetermined` is the number of unidentifiable combinations of "
        "parameters."
    )
    screen.print()
    print(textwrap.fill(found.errata, 100))
    say_written(screen, out, result["files"])


def describe(found: Paper) -> dict[str, Any]:
    """Return the numbers of the figures, for JSON."""
    return {
        "schema": "gpi-reproduction/1",
        "example": "paper",
        "period_s": PERIOD,
        "poles": found.system.poles,
        "zeros": found.system.zeros,
        "markov": found.markov,
        "readings": [
            {
                "reading": reading.name,
                "condition": reading.condition,
                "figure_3": {"markov": reading.markov, "relative_error": reading.markov_error},
                "realisations": [
                    {
                        "order": realisation.order,
                        "poles": realisation.system.poles,
                        "figure_4": {"relative_error": realisation.system_error},
                        "figure_5": {
                            "rms_over_span": spread(realisation.v_hat_multisine, reading.v_multisine),
                        },
                        "figure_6": {"rms_over_span": realisation.v_error},
                        "inverse_truncation": realisation.truncation,
                    }
                    for realisation in reading.realisations
                ],
                "refined": {
                    "relative_error": reading.refined.system_error,
                    "weights_error": reading.refined.weights_error,
                    "deadzone_weights_error": reading.refined.deadzone_weights_error,
                    "undetermined": reading.refined.undetermined,
                    "status": reading.refined.status,
                },
            }
            for reading in found.readings
        ],
        "errata": found.errata,
        "files": [],
    }


def spread(estimate: Any, truth: Any) -> float:
    """Return the rms error over the inner samples as a fraction of the span."""
    inner = slice(200, 5800)
    return float(np.sqrt(np.mean((estimate - truth)[inner] ** 2)) / np.ptp(truth))


def summary_table(found: Paper) -> Table:
    """Return the table that the command prints."""
    table = Table(title="Relative errors after scaling", title_justify="left")
    table.add_column("convention", min_width=11)
    for name in ("condition", "taps (Fig. 3)", "order", "G (Fig. 4)", "v (Fig. 5)", "v, sine (Fig. 6)"):
        table.add_column(name, justify="right", min_width=len("order") if name == "order" else 9)
    for reading in found.readings:
        for index, realisation in enumerate(reading.realisations):
            head = (reading.name, f"{reading.condition:.3g}", f"{reading.markov_error:.4f}")
            table.add_row(
                *(head if index == 0 else ("", "", "")),
                str(realisation.order),
                f"{realisation.system_error:.4f}",
                f"{spread(realisation.v_hat_multisine, reading.v_multisine):.3e}",
                f"{realisation.v_error:.3e}",
            )
    return table


def refined_table(found: Paper) -> Table:
    """Return the table of the joint refinement."""
    table = Table(
        title="Joint refinement, order 3, with the true half-widths and thresholds", title_justify="left"
    )
    for name in ("convention", "G", "play weights", "deadzone weights", "undetermined"):
        table.add_column(name, justify="left" if name == "convention" else "right", min_width=9)
    for reading in found.readings:
        refined = reading.refined
        known = np.isfinite(refined.weights_error)
        table.add_row(
            reading.name,
            f"{refined.system_error:.1e}",
            f"{refined.weights_error:.1e}" if known else "-",
            f"{refined.deadzone_weights_error:.1e}",
            str(refined.undetermined),
        )
    return table


def draw(found: Paper, folder: Path) -> None:
    """Draw every figure for every deadzone convention."""
    for reading in found.readings:
        name = reading.name.replace("-", "_")
        picture(folder / f"fig3_{name}.png", partial(figure_3, found=found, reading=reading))
        picture(folder / f"fig4_{name}.png", partial(figure_4, found=found, reading=reading))
        picture(folder / f"fig5_{name}.png", partial(figure_5, reading=reading))
        picture(folder / f"fig6_top_{name}.png", partial(figure_6_top, reading=reading))
        picture(folder / f"fig6_loop_{name}.png", partial(figure_6_loop, reading=reading), 6.0, 6.0)


def colours() -> tuple[str, ...]:
    """Return the colours of all pictures."""
    from gpi_hammerstein.plot.style import CYCLE

    return CYCLE


def figure_3(ax: "Axes", found: Paper, reading: ReadingResult) -> None:
    """Draw the true and the estimated Markov parameters."""
    blue, vermilion, *_ = colours()
    ax.plot(found.markov, "o", ms=6, mfc="none", color=blue, label="true")
    ax.plot(reading.markov, "x", ms=5, color=vermilion, label="estimated, scaled")
    ax.set_xlabel("lag [samples]")
    ax.set_ylabel("Markov parameter [-]")
    ax.set_title(f"Fig. 3, {reading.name}: relative error {reading.markov_error:.4f}")
    ax.legend()


def figure_4(ax: "Axes", found: Paper, reading: ReadingResult) -> None:
    """Draw the magnitudes of the true and the identified G."""
    blue, *others = colours()
    angles = np.linspace(1e-3, np.pi, 1000)
    truth = response(found.system, angles)
    ax.plot(angles / PERIOD, 20 * np.log10(np.abs(truth)), color=blue, lw=2, label="true")
    for realisation, colour in zip(reading.realisations, others, strict=False):
        estimate = response(realisation.system, angles)
        estimate = estimate * np.real(np.vdot(truth, truth)) / np.real(np.vdot(truth, estimate))
        label = f"order {realisation.order}: {realisation.system_error:.4f}"
        ax.plot(angles / PERIOD, 20 * np.log10(np.abs(estimate)), "--", color=colour, label=label)
    ax.set_xscale("log")
    ax.set_xlabel("frequency [rad/s]")
    ax.set_ylabel("magnitude [dB]")
    ax.set_title(f"Fig. 4, {reading.name}: relative error after scaling")
    ax.legend()


def figure_5(ax: "Axes", reading: ReadingResult) -> None:
    """Draw v and v-hat of the record around a peak of v."""
    blue, *others = colours()
    peak = int(np.argmax(np.abs(reading.v_multisine)))
    shown = slice(max(peak - 60, 0), peak + 60)
    samples = np.arange(len(reading.v_multisine))[shown]
    ax.plot(samples, reading.v_multisine[shown], color=blue, lw=2, label="v")
    for realisation, colour in zip(reading.realisations, others, strict=False):
        label = f"v-hat, order {realisation.order}"
        ax.plot(samples, realisation.v_hat_multisine[shown], "--", color=colour, label=label)
    ax.set_xlabel("sample k [-]")
    ax.set_ylabel("intermediate signal v [-]")
    ax.set_title(f"Fig. 5, {reading.name}: the record's intermediate signal")
    ax.legend()


def figure_6_top(ax: "Axes", reading: ReadingResult) -> None:
    """Draw v and v-hat of the sine over time."""
    blue, *others = colours()
    t = PERIOD * np.arange(len(reading.v))
    ax.plot(t, reading.v, color=blue, lw=2, label="v")
    for realisation, colour in zip(reading.realisations, others, strict=False):
        label = f"v-hat, order {realisation.order}: {realisation.v_error:.2e} of the span"
        ax.plot(t, realisation.v_hat, "--", color=colour, label=label)
    ax.set_xlabel("time [s]")
    ax.set_ylabel("intermediate signal v [-]")
    ax.set_title(f"Fig. 6 (top), {reading.name}")
    ax.legend()


def figure_6_loop(ax: "Axes", reading: ReadingResult) -> None:
    """Draw the true and the estimated hysteresis loop."""
    blue, *others = colours()
    inner = slice(200, 5800)
    ax.plot(reading.sine[inner], reading.v[inner], color=blue, lw=2, label="v")
    for realisation, colour in zip(reading.realisations, others, strict=False):
        label = f"v-hat, order {realisation.order}"
        ax.plot(reading.sine[inner], realisation.v_hat[inner], "--", color=colour, label=label)
    ax.set_xlabel("input u [-]")
    ax.set_ylabel("intermediate signal v [-]")
    ax.set_title(f"Fig. 6 (bottom), {reading.name}")
    ax.legend()

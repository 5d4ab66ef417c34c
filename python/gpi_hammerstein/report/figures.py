"""SVG pictures that use the colours of the page."""

import io
import re
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gpi_hammerstein import plot
from gpi_hammerstein._native import Explanation, Model, StateSpace, era
from gpi_hammerstein.plot.linear import settling_taps
from gpi_hammerstein.plot.signals import draw_loop
from gpi_hammerstein.plot.style import BLACK, BLUE, CYCLE, SHADE, pale

Draw = Callable[..., object]

# Axes and text are drawn in this unique colour. It and black are replaced by the text colour of the page.
INK = "#0a0b0c"
# Background of legends, which is replaced by the background of the page.
PAPER = "#fafbfc"
# Largest number of experiments whose residual is drawn over time.
MOST_EXPERIMENTS = 4
# Largest number of Markov parameters for a Hankel matrix.
MOST_TAPS = 400
STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",
    "font.family": "sans-serif",
    "path.simplify_threshold": 0.5,
    "text.color": INK,
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "axes.titlecolor": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "grid.color": "#8888887f",
    "figure.facecolor": "none",
    "axes.facecolor": "none",
    "savefig.facecolor": "none",
    "legend.facecolor": PAPER,
    "legend.edgecolor": "none",
    "legend.framealpha": 0.8,
}


def pictures(found: Explanation) -> Iterator[tuple[str, str, Draw, tuple[float, float]]]:
    """Yield every picture: a key, a caption, the function that draws it, and its size in inches."""
    model = found.model
    record = found.record
    wide, usual, square = (12.0, 4.0), (7.0, 4.2), (5.5, 5.5)

    def hysteresis(ax: Axes) -> None:
        u = record.u[0]
        draw_loop(ax, model, u, None)

    yield (
        "loop",
        "Output over input: measured, and simulated before and after.",
        lambda ax: plot.loops(found, ax),
        square,
    )
    yield (
        "loop-v",
        "Hysteresis loop of the model: the intermediate signal over the input.",
        hysteresis,
        square,
    )
    for index, name in enumerate(record.output_names):
        of = f" of {name}" if len(record.output_names) > 1 else ""
        for experiment in range(min(len(record.u), MOST_EXPERIMENTS)):
            when = f", experiment {experiment}" if len(record.u) > 1 else ""
            draw_time = partial(plot.residual_in_time, found, experiment=experiment, output=index)
            yield f"time-{index}-{experiment}", f"Residual{of} over time{when}.", draw_time, wide
        draws: list[tuple[str, str, Callable[..., Axes], tuple[float, float]]] = [
            ("spectrum", f"Residual{of} over frequency.", plot.residual_spectrum, usual),
            ("input", f"Residual{of} over the input.", plot.residual_over_input, usual),
            ("speed", f"Residual{of} over the speed of the input.", plot.residual_over_speed, usual),
            (
                "autocorrelation",
                f"Autocorrelation of the residual{of}.",
                plot.residual_autocorrelation,
                usual,
            ),
        ]
        for key, what, draw, size in draws:
            yield f"{key}-{index}", what, partial(draw, found, output=index), size
    bode = "Frequency response of the linear part, with 95 % bands if they are known."
    yield (
        "bode",
        bode,
        lambda ax: plot.bode(model.linear, model.rate, ax, refinement=model.refinement),
        usual,
    )
    yield "markov", "Markov parameters of the linear part.", lambda ax: plot.markov(model, ax), usual
    yield (
        "singular-values",
        "Singular values of the Hankel matrix of these Markov parameters.",
        lambda ax: plot.singular_values(realised(model), ax),
        usual,
    )


def realised(model: Model) -> StateSpace:
    """Return the linear part as a result of ERA, which contains singular values."""
    taps = max(settling_taps(model.linear), 4 * model.linear.order + 2)
    return era(model.linear.markov(min(taps, MOST_TAPS)), max(model.linear.order, 1))


def page_colours() -> dict[str, str]:
    """Return the colours of the page for each colour of a picture. The page may be light or dark."""
    mixed = {pale(own): f"color-mix(in srgb, {own} {100 * SHADE:g}%, var(--paper))" for own in CYCLE}
    return mixed | {INK: "currentColor", BLACK: "currentColor", PAPER: "var(--paper)", BLUE: "var(--blue)"}


def as_svg(key: str, draw: Draw, size: tuple[float, float]) -> str:
    """Draw one picture as an SVG element, without use of the state of pyplot."""
    text = io.StringIO()
    # the salt makes the names of clip paths unique and reproducible
    with mpl.rc_context({**STYLE, "svg.hashsalt": key}):
        figure = Figure(figsize=size, layout="constrained")
        draw(ax=figure.add_subplot())
        figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    svg = text.getvalue()
    svg = re.sub("<!--.*?-->", "", svg[svg.index("<svg") :], flags=re.DOTALL)
    # powers of ten request one font: add a fallback
    svg = svg.replace("font-family: 'DejaVu Sans';", "font-family: 'DejaVu Sans', sans-serif;")
    for color, by_page in page_colours().items():
        svg = re.sub(color, by_page, svg, flags=re.IGNORECASE)
    # the page determines the size
    head, rest = svg.split(">", 1)
    return re.sub(r' (?:width|height)="[^"]*"', "", head) + ">" + rest

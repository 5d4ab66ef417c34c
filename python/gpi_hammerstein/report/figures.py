"""Pictures as SVG that follow the page's colours."""

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

# Axes and text are drawn in this colour, which nothing else has; it and black become the page's own.
INK = "#0a0b0c"
# The page's own background, behind legends.
PAPER = "#fafbfc"
# Experiments whose residual is drawn in time.
MOST_EXPERIMENTS = 4
# Markov parameters that a Hankel matrix is made of, at most.
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
    """Yield every picture: a key, what it shows, how it is drawn, and its size in inches."""
    model = found.model
    record = found.record
    wide, usual, square = (12.0, 4.0), (7.0, 4.2), (5.5, 5.5)

    def hysteresis(ax: Axes) -> None:
        u = record.u[0]
        draw_loop(ax, model, u, None)

    yield "loop", "Output over input: measured, before and after.", lambda ax: plot.loops(found, ax), square
    yield "loop-v", "The hysteresis alone: what the dynamics are driven with.", hysteresis, square
    for index, name in enumerate(record.output_names):
        of = f" of {name}" if len(record.output_names) > 1 else ""
        for experiment in range(min(len(record.u), MOST_EXPERIMENTS)):
            when = f", experiment {experiment}" if len(record.u) > 1 else ""
            draw_time = partial(plot.residual_in_time, found, experiment=experiment, output=index)
            yield f"time-{index}-{experiment}", f"The residual{of} in time{when}.", draw_time, wide
        draws: list[tuple[str, str, Callable[..., Axes], tuple[float, float]]] = [
            ("spectrum", f"The residual{of} over frequency.", plot.residual_spectrum, usual),
            ("input", f"The residual{of} over the input.", plot.residual_over_input, usual),
            ("speed", f"The residual{of} over the input's speed.", plot.residual_over_speed, usual),
            (
                "autocorrelation",
                f"How far the residual{of} remembers itself.",
                plot.residual_autocorrelation,
                usual,
            ),
        ]
        for key, what, draw, size in draws:
            yield f"{key}-{index}", what, partial(draw, found, output=index), size
    bode = "The frequency response of the linear part, with bands where they are known."
    yield (
        "bode",
        bode,
        lambda ax: plot.bode(model.linear, model.rate, ax, refinement=model.refinement),
        usual,
    )
    yield "markov", "Markov parameters of the linear part.", lambda ax: plot.markov(model, ax), usual
    yield (
        "singular-values",
        "Singular values of the Hankel matrix of its Markov parameters.",
        lambda ax: plot.singular_values(realised(model), ax),
        usual,
    )


def realised(model: Model) -> StateSpace:
    """Return the linear part as ERA sees it, which knows its singular values."""
    taps = max(settling_taps(model.linear), 4 * model.linear.order + 2)
    return era(model.linear.markov(min(taps, MOST_TAPS)), max(model.linear.order, 1))


def page_colours() -> dict[str, str]:
    """Return what colours of a picture are on the page, which may be light or dark."""
    mixed = {pale(own): f"color-mix(in srgb, {own} {100 * SHADE:g}%, var(--paper))" for own in CYCLE}
    return mixed | {INK: "currentColor", BLACK: "currentColor", PAPER: "var(--paper)", BLUE: "var(--blue)"}


def as_svg(key: str, draw: Draw, size: tuple[float, float]) -> str:
    """Draw one picture as an SVG element; nothing of pyplot's state is touched."""
    text = io.StringIO()
    # the salt keeps the names of clip paths apart, and the file the same from run to run
    with mpl.rc_context({**STYLE, "svg.hashsalt": key}):
        figure = Figure(figsize=size, layout="constrained")
        draw(ax=figure.add_subplot())
        figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    svg = text.getvalue()
    svg = re.sub("<!--.*?-->", "", svg[svg.index("<svg") :], flags=re.DOTALL)
    # powers of ten name one font; where it is missing, another one without serifs will do
    svg = svg.replace("font-family: 'DejaVu Sans';", "font-family: 'DejaVu Sans', sans-serif;")
    for color, by_page in page_colours().items():
        svg = re.sub(color, by_page, svg, flags=re.IGNORECASE)
    # the page gives the width
    head, rest = svg.split(">", 1)
    return re.sub(r' (?:width|height)="[^"]*"', "", head) + ">" + rest

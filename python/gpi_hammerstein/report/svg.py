"""Pictures of Matplotlib as small SVG elements that use the colours of the page.

The page permits no style attributes. They become attributes of their own, such as ``stroke``, which SVG has
for every property that Matplotlib uses.
"""

import io
import re
from collections.abc import Callable
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

from gpi_hammerstein.plot.style import BLACK, BLUE, CYCLE, SHADE, pale

Draw = Callable[..., object]

# Axes and text are drawn in this unique colour. It and black are replaced by the text colour of the page.
INK = "#0a0b0c"
# Background of legends, which is replaced by the background of the page.
PAPER = "#fafbfc"
# Dots per inch of the parts that are drawn as pixels.
RESOLUTION = 150
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


def page_colours() -> dict[str, str]:
    """Return the colours of the page for each colour of a picture. The page may be light or dark."""
    mixed = {pale(own): f"color-mix(in srgb, {own} {100 * SHADE:g}%, var(--paper))" for own in CYCLE}
    return mixed | {INK: "currentColor", BLACK: "currentColor", PAPER: "var(--paper)", BLUE: "var(--blue)"}


def as_svg(key: str, draw: Draw, size: tuple[float, float]) -> str:
    """Draw one picture as an SVG element, without use of the state of pyplot.

    Parameters
    ----------
    key
        The name of the picture, from which the names of its clip paths are made.
    draw
        The function that draws on ``ax``.
    size
        Width and height in inches.

    Returns
    -------
    str
        The element, without a width and a height: the page determines the size.

    Examples
    --------
    >>> as_svg("line", lambda ax: ax.plot([0, 1]), (3.0, 2.0))[:4]
    '<svg'
    """
    text = io.StringIO()
    # the salt makes the names of clip paths unique and reproducible
    with mpl.rc_context({**STYLE, "svg.hashsalt": key}):
        figure = Figure(figsize=size, dpi=RESOLUTION, layout="constrained")
        draw(ax=figure.add_subplot())
        figure.savefig(text, format="svg", dpi=RESOLUTION, metadata={"Date": None, "Creator": None})
    svg = text.getvalue()
    svg = re.sub("<!--.*?-->|<metadata>.*?</metadata>", "", svg[svg.index("<svg") :], flags=re.DOTALL)
    svg = re.sub(r"<defs>\s*<style.*?</style>\s*</defs>", "", svg, flags=re.DOTALL)
    svg = re.sub(r' style="([^"]*)"', lambda found: attributes(found[1]), svg)
    # a tenth of a point is smaller than a dot of a screen
    svg = re.sub(r"(?<=[ \"])(-?\d+\.\d)\d+(?=[ \"\n])", r"\1", svg)
    svg = re.sub(r"\s*\n\s*", "\n", svg).replace("\nL ", "L").replace(" L", "L")
    for color, by_page in page_colours().items():
        svg = re.sub(color, by_page, svg, flags=re.IGNORECASE)
    head, rest = svg.split(">", 1)
    return re.sub(r' (?:width|height)="[^"]*"', "", head) + ">" + rest


def attributes(style: str) -> str:
    """Return the declarations of a style attribute as attributes.

    Parameters
    ----------
    style
        The declarations, as Matplotlib writes them. The short form ``font`` contains a size and a family.

    Returns
    -------
    str
        Attributes, each after a space.

    Examples
    --------
    >>> attributes("fill: none; font: 10px sans-serif")
    ' fill="none" font-size="10px" font-family="sans-serif"'
    """
    found = []
    for declaration in style.split(";"):
        name, _, value = (part.strip() for part in declaration.partition(":"))
        if name == "font":
            parts = re.fullmatch(r"(.*?)\s*([\d.]+px)\s+(.*)", value)
            if parts is None:
                raise ValueError(f"not a font that Matplotlib writes: {value}")
            weight, size, family = parts.groups()
            if weight:
                found.append(f' font-weight="{weight}"')
            found += [f' font-size="{size}"', f' font-family="{family}"']
        elif name == "font-family":
            # powers of ten request one font: add a fallback
            found.append(f' font-family="{value}, sans-serif"')
        elif name:
            found.append(f' {name}="{value}"')
    return "".join(found)

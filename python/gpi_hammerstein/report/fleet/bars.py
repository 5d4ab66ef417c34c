"""How many devices have each effect and each verdict, as bars with confidence intervals."""

from collections.abc import Mapping, Sequence
from html import escape

from gpi_hammerstein.escaping import visible
from gpi_hammerstein.fleet.rare import CONFIDENCE, Share

WIDTH, HEIGHT = 220.0, 20.0
MOST_ROWS = 60
"""Names that are listed; the names of a strange table could fill the page."""


def shares_table(shares: Sequence[Share], head: str, meanings: Mapping[str, str]) -> str:
    """Return a table with one bar for each name.

    Parameters
    ----------
    shares
        How many devices have each name.
    head
        What the names are.
    meanings
        What a name means.

    Returns
    -------
    str
        A table; a sentence if there is no name.
    """
    if not shares:
        return f"<p>No device has an {escape(head)}.</p>"
    rows = "".join(
        f"<tr><td>{escape(visible(one.name))}</td><td>{bar(one)}</td>"
        f'<td class="number">{one.count:,} of {one.all:,}</td><td class="number">{percent(one)}</td>'
        f'<td class="number">{100 * one.low:.3g} to {100 * one.high:.3g} %</td>'
        f"<td>{escape(meanings.get(one.name, ''))}</td></tr>"
        for one in shares[:MOST_ROWS]
    )
    more = f"<p>{len(shares) - MOST_ROWS:,} more are not listed.</p>" if len(shares) > MOST_ROWS else ""
    return (
        f'<div class="scroll"><table class="shares"><tr><th>{escape(head)}</th><th>share of the devices</th>'
        f'<th class="number">devices</th><th class="number">share</th>'
        f'<th class="number">{100 * CONFIDENCE:.0f} % interval</th><th>what it is</th></tr>'
        f"{rows}</table></div>{more}"
    )


def percent(one: Share) -> str:
    """Return a share in percent."""
    return f"{100 * one.count / one.all:.3g} %"


def bar(one: Share) -> str:
    """Return a share as a bar, with the interval as a line."""
    length, low, high = (WIDTH * part for part in (one.count / one.all, one.low, one.high))
    return (
        f'<svg class="share" viewBox="0 0 {WIDTH:g} {HEIGHT:g}" role="img" '
        f'aria-label="{percent(one)}"><rect class="full" x="0" y="4" width="{WIDTH:g}" height="12"/>'
        f'<rect class="bar" x="0" y="4" width="{length:.1f}" height="12"/>'
        f'<path class="interval" d="M{low:.1f} 10H{high:.1f}M{low:.1f} 6V14M{high:.1f} 6V14"/></svg>'
    )

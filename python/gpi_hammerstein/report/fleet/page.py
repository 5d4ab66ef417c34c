"""The HTML page of a fleet."""

import hashlib
import os
from collections.abc import Sequence
from html import escape
from pathlib import Path
from string import Template

import numpy as np
import polars as pl

from gpi_hammerstein._native import effect_names
from gpi_hammerstein.files import require_file, write_atomically
from gpi_hammerstein.fleet.dates import as_date
from gpi_hammerstein.fleet.devices import Fleet, fleet_of
from gpi_hammerstein.fleet.distances import NOTABLE, Distances, distances
from gpi_hammerstein.fleet.figures import Figure, Scaled, scaled
from gpi_hammerstein.fleet.rare import effect_shares, verdict_shares
from gpi_hammerstein.fleet.reading import read_fleet
from gpi_hammerstein.fleet.robust import Array
from gpi_hammerstein.fleet.trends import Trend, trends
from gpi_hammerstein.fleet.unusual import Unusual, unusual
from gpi_hammerstein.report import provenance
from gpi_hammerstein.report.answers import VERDICTS
from gpi_hammerstein.report.fleet import tables, words
from gpi_hammerstein.report.fleet.axis import Axis
from gpi_hammerstein.report.fleet.bars import shares_table
from gpi_hammerstein.report.fleet.data import page_data
from gpi_hammerstein.report.fleet.distributions import histogram
from gpi_hammerstein.report.fleet.links import link_to
from gpi_hammerstein.report.fleet.over_dates import over_dates
from gpi_hammerstein.report.page import text_of
from gpi_hammerstein.report.policy import policy
from gpi_hammerstein.report.tables import pairs

SCRIPTS = ("browser/samples.js", "browser/fleet_values.js", "browser/fleet_table.js", "browser/fleet_page.js")
STYLES = ("page.css", "fleet/fleet.css")
FIRST = 12
"""Distributions that are shown at once; the sizes of further effects are below a heading that opens."""

Table = pl.DataFrame | str | os.PathLike[str]
Axes = list[tuple[Figure, Axis, Array]]


def fleet_html(
    table: pl.DataFrame, *, folder: Path, page: Path, command: str | None = None, digest: str | None = None
) -> str:
    """Return the page of a fleet.

    Parameters
    ----------
    table
        The columns of `gpi-fleet/1`.
    folder
        The folder that contains ``records`` with the results of each record.
    page
        The file that will contain the page, to which links are relative.
    command
        The command that made the page, for its foot.
    digest
        The SHA-256 of the table's file, for the foot of the page.

    Returns
    -------
    str
        The page, in UTF-8.
    """
    fleet = fleet_of(table)
    known = distances(fleet)
    found, over_time = unusual(fleet, known), trends(fleet)
    axes = axes_of(fleet)
    links = {
        device: address
        for device, record in enumerate(fleet.latest)
        if record >= 0 and (address := link_to(fleet.table["name"][int(record)], folder, page))
    }
    verdicts, effects = verdict_shares(fleet), effect_shares(fleet)
    script = '"use strict";\n' + "\n".join(text_of(name) for name in SCRIPTS)
    style = "\n".join(text_of(name) for name in STYLES)
    drawn = [
        histogram(one, axis, marked(fleet, known, found, one), at) for at, (one, axis, _) in enumerate(axes)
    ]
    return Template(text_of("fleet/page.html")).substitute(
        policy=policy(script, style),
        style=style,
        script=script,
        samples=page_data(fleet, axes, found, links),
        title=words.count(len(fleet.names), "device"),
        facts_line=escape(facts_line(fleet)),
        answers=words.answers(fleet, known, found, verdicts, effects, over_time),
        notes=listed(fleet.notes),
        unusual=tables.unusual_table(fleet, known, found, links),
        distributions="".join(drawn[:FIRST]) or "<p>No figure is known.</p>",
        further=further(drawn[FIRST:]),
        effects=shares_table(effects, "effect", effect_names()),
        verdicts=shares_table(
            verdicts, "verdict", {name: text.partition(": ")[2] for name, text in VERDICTS.items()}
        ),
        trends=tables.trends_table(fleet, over_time),
        over_dates=dated(fleet, axes, over_time),
        errors=tables.errors_table(fleet),
        method=listed(words.method()),
        origin=origin(fleet, command, digest),
    )


def axes_of(fleet: Fleet) -> Axes:
    """Return the figures that a device has, their axes, and their values for all records on these scales."""
    found: Axes = []
    for figure in fleet.figures:
        own = scaled(*fleet.of_devices(figure))
        if not np.isfinite(own.values).any():
            continue
        found.append((figure, Axis.of(own), on_scale(figure.values, own)))
    return found


def on_scale(values: Array, own: Scaled) -> Array:
    """Return the values of all records on the scale on which those of the devices are compared."""
    if not own.logarithmic:
        return values
    return np.log(np.maximum(own.sign * values, np.exp(np.nanmin(own.values))))


def marked(
    fleet: Fleet, known: Distances, found: Sequence[Unusual], figure: Figure
) -> list[tuple[int, int, str, bool]]:
    """Return the devices that stand out, and whether they do by this figure."""
    at = next((place for place, one in enumerate(known.figures) if one is figure), None)
    rows = []
    for one in found:
        device = int(fleet.judged[one.place])
        z = np.nan if at is None else known.z[one.place, at]
        far = z >= NOTABLE if figure.upward else abs(z) >= NOTABLE
        rows.append((one.place, device, fleet.names[device], bool(far)))
    return rows


def dated(fleet: Fleet, axes: Axes, over_time: Sequence[Trend]) -> str:
    """Return the pictures over dates; a sentence if there are none."""
    drawn = []
    for at, (figure, axis, values) in enumerate(axes):
        if not figure.judged:
            continue
        own = axis.scaled
        every = Axis.of(Scaled(values, figure.std, figure.values, own.logarithmic, own.sign, own.median))
        of_fleet = [one for one in over_time if one.device < 0 and one.figure is figure]
        drawn.append(over_dates(figure, every, fleet.days, of_fleet, at))
    pictures = [one for one in drawn if one]
    if not pictures:
        return "<p>There are too few dates for pictures over time.</p>"
    return f'<div class="figures small">{"".join(pictures[:FIRST])}</div>{further(pictures[FIRST:])}'


def further(drawn: Sequence[str]) -> str:
    """Return pictures below a heading that opens."""
    if not drawn:
        return ""
    head = f"<summary>{words.count(len(drawn), 'more size')} of effects</summary>"
    return f'<details>{head}<div class="figures small">{"".join(drawn)}</div></details>'


def facts_line(fleet: Fleet) -> str:
    """Return the size of the fleet in one line."""
    days = fleet.days[np.isfinite(fleet.days)]
    dates = f" · {as_date(days.min())} to {as_date(days.max())}" if len(days) else ""
    return f"{words.count(len(fleet.table), 'record')}{dates} · page of {provenance.date()}"


def listed(sentences: Sequence[str]) -> str:
    """Return sentences as a list; nothing if there are none."""
    items = "".join(f"<li>{escape(one)}</li>" for one in sentences)
    return f"<ul>{items}</ul>" if items else ""


def origin(fleet: Fleet, command: str | None, digest: str | None) -> str:
    """Return the command, the date, the hash of the table and the versions."""
    rows = [("date", provenance.date())]
    if digest is not None:
        rows.append(("SHA-256 of the table", digest))
    rows.append(("versions", provenance.versions().rpartition(", uPlot")[0]))
    line = f"<pre>{escape(command)}</pre>" if command else ""
    return line + pairs(rows)


def fleet_report(table: Table, path: str | os.PathLike[str], *, command: str | None = None) -> None:
    """Write one interactive HTML page of a fleet. The write is atomic.

    The page shows the distributions of all figures, how many devices have each effect and each verdict, which
    devices stand out and why, trends over the dates of the records, and a table of all devices with links to
    the results of each record. It needs no network and no other file, except those that its links lead to.

    Parameters
    ----------
    table : polars.DataFrame or path
        The table of `batch`, or its file ``fleet.parquet``. Results of records are searched in ``records``
        beside this file, or beside the page for a data frame.
    path : path
        The file, for example ``fleet.html``.
    command : str, optional
        The command that made the page, for its foot.

    Raises
    ------
    ParameterError
        The file cannot be written, or a column of `gpi-fleet/1` is missing in a data frame.
    DataError
        The file of the table cannot be read, or has another version.

    Examples
    --------
    >>> gpi.fleet_report("fleet/fleet.parquet", "fleet/fleet.html")  # doctest: +SKIP
    """
    require_file(path)
    if isinstance(table, pl.DataFrame):
        write_fleet(table, path, file=None, command=command)
    else:
        write_fleet(read_fleet(table), path, file=Path(table), command=command)


def write_fleet(
    table: pl.DataFrame, path: str | os.PathLike[str], *, file: Path | None, command: str | None = None
) -> None:
    """Write the page of a table that was read.

    Parameters
    ----------
    table
        The columns of `gpi-fleet/1`.
    path
        The file for the page.
    file
        The file of the table, beside which the results of records are searched; None for none.
    command
        The command that made the page, for its foot.

    Raises
    ------
    ParameterError
        The file cannot be written.
    """
    page = Path(path)
    digest = None if file is None else hashlib.sha256(file.read_bytes()).hexdigest()
    folder = page.parent if file is None else file.parent
    text = fleet_html(table, folder=folder, page=page, command=command, digest=digest)
    write_atomically(page, text)

"""The tables of the page of a fleet.

Names, messages and file names are escaped, because anybody may have written them.
"""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import PurePath

import numpy as np

from gpi_hammerstein.escaping import visible
from gpi_hammerstein.fleet.devices import Fleet
from gpi_hammerstein.fleet.distances import Distances
from gpi_hammerstein.fleet.trends import YEAR, Trend
from gpi_hammerstein.fleet.unusual import Unusual
from gpi_hammerstein.report.fleet.distributions import title
from gpi_hammerstein.report.tables import table

MOST_ROWS = 200
"""Rows of a table without a search; the table of all devices has every one."""
FIRST = 25
"""Devices that stand out and are shown at once."""
LONG = 90.0
"""Days from the first date to the last one, above which slopes are per year."""
LONGEST_TEXT = 300
"""Characters of a message; a message of a library can contain a part of a file."""


def unusual_table(fleet: Fleet, known: Distances, found: Sequence[Unusual], links: Mapping[int, str]) -> str:
    """Return the devices that stand out, each with its reasons.

    Parameters
    ----------
    fleet, known, found
        The devices, the distances of their figures, and those that stand out.
    links
        Addresses by device.

    Returns
    -------
    str
        A table; a sentence if no device stands out.
    """
    if not found:
        return "<p>No device stands out.</p>"
    rows = []
    for one in found[:MOST_ROWS]:
        device = int(fleet.judged[one.place])
        why = "".join(f"<li>{escape(shortened(text))}</li>" for text in one.why)
        q = f"{known.q[one.place]:.2g}" if np.isfinite(known.q[one.place]) else "-"
        rows.append(
            f"<tr><td>{chooser(device, fleet.names[device])}</td><td><ul>{why}</ul></td>"
            f'<td class="number">{q}</td><td>{link(links.get(device))}</td></tr>'
        )
    others = f"<details><summary>{len(rows) - FIRST:,} more</summary>{_unusual(rows[FIRST:])}</details>"
    return _unusual(rows[:FIRST]) + (others if len(rows) > FIRST else "") + more(len(found))


def _unusual(rows: Sequence[str]) -> str:
    return (
        '<div class="scroll"><table class="unusual"><tr><th>device</th><th>why</th><th class="number">q</th>'
        f"<th>result</th></tr>{''.join(rows)}</table></div>"
    )


def chooser(device: int, name: str) -> str:
    """Return the name of a device as a button that marks the device in all pictures."""
    return f'<button type="button" class="device" data-device="{device}">{escape(shortened(name))}</button>'


def link(address: str | None) -> str:
    """Return a link to the files of a record."""
    if address is None:
        return ""
    what = "report" if address.endswith(".html") else "explanation"
    return f'<a href="{escape(address)}">{what}</a>'


def shortened(text: str) -> str:
    """Return a text of one line that is not too long."""
    shown = visible(text)
    return shown if len(shown) <= LONGEST_TEXT else f"{shown[:LONGEST_TEXT]} .."


def more(rows: int) -> str:
    """Return how many rows are not in a table."""
    return f"<p>{rows - MOST_ROWS:,} more are not listed here.</p>" if rows > MOST_ROWS else ""


def trends_table(fleet: Fleet, found: Sequence[Trend]) -> str:
    """Return the trends of the fleet, and the significant ones of devices."""
    of_fleet = [one for one in found if one.device < 0]
    of_devices = [one for one in found if one.device >= 0]
    if not found:
        return ""
    unit = "year" if np.ptp(fleet.days[np.isfinite(fleet.days)]) > LONG else "day"
    head = ["figure", "kind", f"change in one {unit}", "dates", "p", "q", "significant"]
    parts = [table(head, [_trend(one, one.kind, unit) for one in of_fleet], (2, 3, 4, 5))] if of_fleet else []
    significant = [one for one in of_devices if one.significant]
    if of_devices:
        parts.append(
            f"<h3>Trends of single devices</h3><p>{len(of_devices):,} trends of devices with at least three "
            f"dates were tested; {len(significant):,} are significant.</p>"
        )
    if significant:
        rows = [_trend(one, shortened(fleet.names[one.device]), unit) for one in significant[:MOST_ROWS]]
        parts.append(table(["figure", "device", *head[2:]], rows, (2, 3, 4, 5)) + more(len(significant)))
    return "".join(parts)


def _trend(one: Trend, what: str, unit: str) -> list[str]:
    slope = one.slope if unit == "year" else one.slope / YEAR
    change = f"{100 * slope:+.2g} %" if one.relative else f"{slope:+.2g} {one.figure.unit}".rstrip()
    significant = "yes" if one.significant else "no"
    return [title(one.figure), what, change, f"{one.dates:,}", f"{one.p:.2g}", f"{one.q:.2g}", significant]


def reason_of(error: str, file: str) -> str:
    """Return a message without the name of the file at its start, so that equal reasons are equal texts.

    Parameters
    ----------
    error, file
        The message, and the file of the record; the message may contain another path to it.

    Examples
    --------
    >>> reason_of("/lab/runs/a.csv: is empty", "runs/a.csv")
    'is empty'
    """
    head, _, reason = error.partition(": ")
    return reason if reason and PurePath(head).name == PurePath(file).name else error


def errors_table(fleet: Fleet) -> str:
    """Return the records without a result: how many for each reason, and which.

    Parameters
    ----------
    fleet
        The table and its devices.

    Returns
    -------
    str
        A table; a sentence if every record has a result.
    """
    groups: dict[str, list[str]] = defaultdict(list)
    for file, error in fleet.table.select("file", "error").iter_rows():
        if error is not None:
            groups[reason_of(error, file or "")].append(file or "")
    if not groups:
        return "<p>Every record has a result.</p>"
    rows = [
        [
            f"{len(files):,}",
            shortened(reason),
            shortened(", ".join(files[:5]) + (", .." if len(files) > 5 else "")),
        ]
        for reason, files in sorted(groups.items(), key=lambda pair: (-len(pair[1]), pair[0]))
    ]
    return table(["records", "why there is no result", "files"], rows[:MOST_ROWS], (0,)) + more(len(rows))

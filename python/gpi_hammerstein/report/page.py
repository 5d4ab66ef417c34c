"""The HTML page of a report."""

import os
from collections.abc import Sequence
from html import escape
from importlib.resources import files
from string import Template

from gpi_hammerstein._native import Explanation
from gpi_hammerstein.explanation import in_words, to_dict
from gpi_hammerstein.files import require_file, write_atomically
from gpi_hammerstein.report import provenance, tables
from gpi_hammerstein.report.answers import VERDICTS, answers
from gpi_hammerstein.report.components import components
from gpi_hammerstein.report.data import page_data
from gpi_hammerstein.report.figures import Picture, linear_pictures, loop_pictures
from gpi_hammerstein.report.policy import policy
from gpi_hammerstein.report.quality import facts
from gpi_hammerstein.report.series import PROBABILITY, Errors
from gpi_hammerstein.report.svg import as_svg

SCRIPTS = (
    "vendor/uPlot.iife.min.js",
    "browser/samples.js",
    "browser/chart.js",
    "browser/group.js",
    "browser/curves.js",
    "browser/page.js",
    "browser/enlarge.js",
)
STYLES = ("vendor/uPlot.min.css", "page.css")


def report_html(
    found: Explanation,
    *,
    command: str | None = None,
    notes: Sequence[str] = (),
    model_file: str | None = None,
) -> str:
    """Return a report as one self-contained HTML page.

    Parameters
    ----------
    found
        The result of `explain`.
    command
        The command that made the report, for the foot of the page.
    notes
        Notes on changes of the samples while they were read.
    model_file
        The name of the model file beside the page, for the commands that go on from it.

    Returns
    -------
    str
        The page, in UTF-8.

    Examples
    --------
    >>> page = report_html(found)  # doctest: +SKIP
    """
    record, model, errors = found.record, found.model, Errors(found)
    units = set(record.output_units)
    unit = units.pop() if len(units) == 1 else ""
    own = components(found, errors)
    script, style = script_and_style()
    date, samples = provenance.date(), sum(len(u) for u in record.u)
    listed = "".join(f"<li>{escape(note)}</li>" for note in notes)
    return Template(text_of("page.html")).substitute(
        policy=policy(script, style),
        style=style,
        script=script,
        samples=page_data(found, errors),
        title=escape(f"{', '.join(record.input_names)} → {', '.join(record.output_names)}"),
        verdict=escape(found.verdict),
        verdict_short=escape(VERDICTS[found.verdict].partition(":")[0]),
        facts_line=escape(f"{samples} samples at {record.rate:g} Hz · {date}"),
        answers=answers(found, own, unit),
        band_words=escape(band_in_words(errors)),
        sentences="".join(f"<p>{escape(one)}</p>" for one in in_words(to_dict(found), unit, numbers=False)),
        components=tables.contributions(found, own, unit),
        rejected=tables.rejected(found, unit),
        effects=tables.effects(found),
        errors=tables.errors(found, unit),
        rivals=tables.rivals(found, unit),
        tests=tables.tests(found),
        loops="".join(figure(one) for one in loop_pictures(found, errors)),
        linear="".join(figure(one) for one in linear_pictures(model)),
        structure=tables.pairs(tables.structure(model).items()),
        poles=tables.poles(model),
        parameters=tables.parameters(model),
        quality=tables.pairs(facts(record)),
        notes=f"<ul>{listed}</ul>" if listed else "",
        next_experiment=next_experiment(found),
        commands="".join(
            f"<p>{escape(why)}</p><pre>{escape(line)}</pre>"
            for why, line in provenance.commands(model, model_file)
        ),
        origin=origin(found, command, date, model_file),
    )


def script_and_style() -> tuple[str, str]:
    """Return the text of the script and of the style sheet of every page."""
    script = '"use strict";\n' + "\n".join(text_of(name) for name in SCRIPTS)
    return script, "\n".join(text_of(name) for name in STYLES)


def page_policy() -> str:
    """Return the content security policy of every page, for a server that sends it as a header."""
    return policy(*script_and_style())


def text_of(name: str) -> str:
    """Return the text of a file of this package."""
    return files("gpi_hammerstein.report").joinpath(name).read_text("utf-8").strip()


def band_in_words(errors: Errors) -> str:
    """Return what the prediction band is, and how wide it is."""
    names, units = errors.names, errors.record.output_units
    widths = [
        f"±{errors.half_band(index):.3g} {unit}".rstrip() + (f" ({name})" if len(names) > 1 else "")
        for index, (name, unit) in enumerate(zip(names, units, strict=True))
    ]
    unseen = errors.collected(0)[1]
    which = "held-out samples" if unseen else "samples of this record, which the fit has seen,"
    return f"Band: {100 * PROBABILITY:.0f} % of the {which} are within {', '.join(widths)} of the simulation."


def figure(picture: Picture) -> str:
    """Return a picture that is enlarged by a click."""
    text = escape(picture.what)
    svg = as_svg(picture.key, picture.draw, picture.size)
    button = f'<button class="open" aria-label="Enlarge: {text}">{svg}</button>'
    own = "" if picture.experiment is None else f' data-experiment="{picture.experiment}"'
    return f"<figure{own}>{button}<figcaption>{text}</figcaption></figure>"


def next_experiment(found: Explanation) -> str:
    """Return the next experiment; nothing if none is proposed."""
    if not found.next_experiment:
        return ""
    why, command = found.next_experiment["why"], found.next_experiment["command"]
    line = f"<pre>{escape(command)}</pre>" if command else ""
    why = escape(why[:1].upper() + why[1:])
    return f'<h3 id="next">Next experiment</h3><p>{why}.</p>{line}<h3>Use the model</h3>'


def origin(found: Explanation, command: str | None, date: str, model_file: str | None) -> str:
    """Return the command, the date, the hash of the samples and the versions."""
    rows = [("date", date), ("SHA-256 of the samples", provenance.data_hash(found.record))]
    if model_file is not None:
        rows.append(("model", model_file))
    rows.append(("versions", provenance.versions()))
    line = f"<pre>{escape(command)}</pre>" if command else ""
    return line + tables.pairs(rows)


def write_report(
    found: Explanation,
    path: str | os.PathLike[str],
    *,
    command: str | None = None,
    notes: Sequence[str] = (),
    model_file: str | None = None,
) -> None:
    """Write a report as one HTML file. The write is atomic.

    Parameters
    ----------
    found
        The result of `explain`.
    path
        The file, for example ``report.html``.
    command
        The command that made the report, for the foot of the page.
    notes
        Notes on changes of the samples while they were read.
    model_file
        The name of the model file beside the page, for the commands that go on from it.

    Raises
    ------
    ParameterError
        The folder does not exist or cannot be written.

    Examples
    --------
    >>> write_report(found, "report.html")  # doctest: +SKIP
    """
    require_file(path)
    page = report_html(found, command=command, notes=notes, model_file=model_file)
    write_atomically(path, page)

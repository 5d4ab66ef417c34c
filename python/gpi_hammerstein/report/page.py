"""The HTML page of a report."""

import base64
import hashlib
import os
from collections.abc import Sequence
from html import escape
from importlib.resources import files
from string import Template

from gpi_hammerstein._native import Explanation, __version__
from gpi_hammerstein.explanation import in_words, to_dict
from gpi_hammerstein.files import require_file, write_atomically
from gpi_hammerstein.report import tables
from gpi_hammerstein.report.figures import as_svg, pictures
from gpi_hammerstein.report.quality import facts

VERDICTS = {
    "explained": "Explained: the residual has no structure beyond noise.",
    "partly-explained": "Partly explained: the residual still has structure.",
    "unattributed": "Unattributed: no effect of the catalogue explains the residual.",
    "outside-class": "Outside the class of this model: its structure is wrong for this record.",
}
# Pictures of each part of the page, by the beginning of their keys.
PARTS: dict[str, tuple[str, ...]] = {
    "loop": ("loop",),
    "residual": ("time", "spectrum", "input", "speed", "autocorrelation"),
    "linear": ("bode", "markov", "singular-values"),
}


def report_html(found: Explanation, *, command: str | None = None, notes: Sequence[str] = ()) -> str:
    """Return a report as one self-contained HTML page.

    Parameters
    ----------
    found
        The result of `explain`.
    command
        The command that made the report, for the footer of the page.
    notes
        Notes on changes of the samples while they were read.

    Returns
    -------
    str
        The page, in UTF-8.

    Examples
    --------
    >>> page = report_html(found)  # doctest: +SKIP
    """
    record, result = found.record, to_dict(found)
    units = set(record.output_units)
    unit = units.pop() if len(units) == 1 else ""
    first, *rest = in_words(result, unit, numbers=False)
    drawn = [(key, what, as_svg(key, draw, size)) for key, what, draw, size in pictures(found)]

    def shown(part: str) -> str:
        return "".join(figure(*one) for one in drawn if one[0].startswith(PARTS[part]))

    script = files("gpi_hammerstein.report").joinpath("page.js").read_text("utf-8")
    title = f"{', '.join(record.input_names)} → {', '.join(record.output_names)}"
    return Template(files("gpi_hammerstein.report").joinpath("page.html").read_text("utf-8")).substitute(
        policy=policy(script),
        script=script,
        title=escape(title),
        verdict=escape(found.verdict),
        verdict_words=VERDICTS[found.verdict],
        first=escape(first),
        sentences="".join(f"<p>{escape(sentence)}</p>" for sentence in rest),
        next_experiment=next_experiment(found),
        errors=tables.errors(found, unit),
        rivals=tables.rivals(found, unit),
        effects=tables.effects(found),
        rejected=tables.rejected(found),
        loop=shown("loop"),
        residual=shown("residual"),
        tests=tables.tests(found),
        linear=shown("linear"),
        poles=tables.poles(found.model),
        structure=tables.pairs(tables.structure(found.model).items()),
        quality=tables.pairs(facts(record)),
        notes="".join(f"<li>{escape(note)}</li>" for note in notes),
        command=f"<pre>{escape(command)}</pre>" if command else "",
        version=escape(__version__),
    )


def policy(script: str) -> str:
    """Return the content security policy of a page with one script.

    The page loads nothing, sends nothing, and runs this script only. Pictures have style attributes, and the
    points of large pictures are embedded images.
    """
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    rules = {
        "default-src": "'none'",
        "script-src": f"'sha256-{digest}'",
        "style-src": "'unsafe-inline'",
        "img-src": "data:",
        "base-uri": "'none'",
        "form-action": "'none'",
    }
    return "; ".join(f"{name} {value}" for name, value in rules.items())


def figure(key: str, what: str, svg: str) -> str:
    """Return a picture that is enlarged by a click."""
    kind, text = key.split("-")[0], escape(what)
    button = f'<button class="open" aria-label="Enlarge: {text}">{svg}</button>'
    return f'<figure class="{kind}">{button}<figcaption>{text}</figcaption></figure>'


def next_experiment(found: Explanation) -> str:
    """Return the section on the next experiment; it is empty if none is proposed."""
    if not found.next_experiment:
        return ""
    why, command = found.next_experiment["why"], found.next_experiment["command"]
    line = f"<pre>{escape(command)}</pre>" if command else ""
    return f"<section><h2>Next experiment</h2><p>{escape(why)}.</p>{line}</section>"


def write_report(
    found: Explanation,
    path: str | os.PathLike[str],
    *,
    command: str | None = None,
    notes: Sequence[str] = (),
) -> None:
    """Write a report as one HTML file. The write is atomic.

    Parameters
    ----------
    found
        The result of `explain`.
    path
        The file, for example ``report.html``.
    command
        The command that made the report, for the footer of the page.
    notes
        Notes on changes of the samples while they were read.

    Raises
    ------
    ParameterError
        The folder does not exist or cannot be written.

    Examples
    --------
    >>> write_report(found, "report.html")  # doctest: +SKIP
    """
    require_file(path)
    write_atomically(path, report_html(found, command=command, notes=notes))

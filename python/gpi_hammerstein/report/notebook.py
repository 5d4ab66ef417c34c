"""HTML representations of a record, a model and an explanation for notebooks."""

from html import escape

from gpi_hammerstein._native import Explanation, Model, Record
from gpi_hammerstein.explanation import in_words, to_dict
from gpi_hammerstein.report import tables
from gpi_hammerstein.report.quality import facts


def record(record: Record) -> str:
    """Return the rate, the length and the ranges of a record as an HTML table."""
    return tables.pairs(facts(record))


def model(model: Model) -> str:
    """Return the structure and the poles of a model as HTML tables."""
    rows = dict(tables.structure(model))
    rows["sampling rate"] = f"{model.rate:g} Hz"
    if model.effects:
        rows["effects"] = ", ".join(effect["name"] for effect in model.effects)
    if model.refinement is not None:
        rms = ", ".join(f"{value:.4g}" for value in model.refinement.residual_rms)
        rows["residual rms"] = f"{rms} {model.output_units[0]}".rstrip()
    return tables.pairs(rows.items()) + tables.poles(model)


def explanation(found: Explanation) -> str:
    """Return the result of an explanation as sentences and HTML tables."""
    units = set(found.record.output_units)
    unit = units.pop() if len(units) == 1 else ""
    words = "".join(f"<p>{escape(one)}</p>" for one in in_words(to_dict(found), unit, numbers=False))
    return words + tables.errors(found, unit) + tables.effects(found)

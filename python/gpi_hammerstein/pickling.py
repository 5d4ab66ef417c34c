"""Pickling and copying of operators, linear systems, records and models.

A pickled model contains the same as its file: it has no `identification`, and of its `refinement` only the
parameters with their standard deviations, the noise floor and the status. Explanations and identifications
cannot be pickled. Save their model, or the result of `to_dict()`.
"""

import copyreg
from typing import Any

from gpi_hammerstein._native import Deadzones, Gpi, Model, PlayBank, Record, StateSpace

__all__ = ["register"]


def register() -> None:
    """Register the functions with which `pickle` and `copy` rebuild these objects.

    Examples
    --------
    >>> import copy
    >>> copy.copy(gpi.PlayBank([0.0, 0.5], [1.0, 2.0])).weights.tolist()
    [1.0, 2.0]
    """
    copyreg.pickle(PlayBank, lambda bank: (PlayBank, (bank.half_widths, bank.weights)))
    copyreg.pickle(Deadzones, lambda zones: (Deadzones, (zones.thresholds, zones.weights, zones.reading)))
    copyreg.pickle(Gpi, lambda own: (Gpi, (own.envelope, own.plays)))
    copyreg.pickle(StateSpace, lambda system: (StateSpace, (system.A, system.B, system.C, system.D)))
    copyreg.pickle(Model, lambda model: (model_from, (model.to_json(),)))
    copyreg.pickle(Record, lambda record: (record_from, (parts(record),)))


def model_from(text: str) -> Model:
    """Return the model from a JSON text."""
    return Model.from_json(text)


def parts(record: Record) -> dict[str, Any]:
    """Return the parts of a record, as arguments of its constructor."""
    channels = [f"{kind}_{what}" for kind in ("input", "output", "covariate") for what in ("names", "units")]
    own = {name: getattr(record, name) for name in ("u", "y", "rate", "covariates", "warmup", *channels)}
    if not record.covariate_names:
        own |= {"covariates": None, "covariate_names": None, "covariate_units": None}
    return own


def record_from(own: dict[str, Any]) -> Record:
    """Return the record from its parts."""
    return Record(**own)

"""Pickling and copying of what is made of numbers: operators, linear systems, records, models.

A model goes as its file does: without its `identification` and `refinement`. Results of long work
(explanations, identifications) are not pickled; save their model, or `to_dict()`.
"""

import copyreg
from typing import Any

from gpi_hammerstein._native import Deadzones, Gpi, Model, PlayBank, Record, StateSpace

__all__ = ["register"]


def register() -> None:
    """Tell `pickle` and `copy` how to make these objects anew.

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
    """Return the model of a JSON text."""
    return Model.from_json(text)


def parts(record: Record) -> dict[str, Any]:
    """Return what a record is made of."""
    channels = [f"{kind}_{what}" for kind in ("input", "output", "covariate") for what in ("names", "units")]
    own = {name: getattr(record, name) for name in ("u", "y", "rate", "covariates", "warmup", *channels)}
    if not record.covariate_names:
        own |= {"covariates": None, "covariate_names": None, "covariate_units": None}
    return own


def record_from(own: dict[str, Any]) -> Record:
    """Return the record that is made of these parts."""
    return Record(**own)

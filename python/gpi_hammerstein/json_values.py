"""Results as values that JSON can represent."""

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

__all__ = ["plain", "write_json"]


def plain(value: Any) -> Any:
    """Convert arrays to lists, and numbers that are not finite to None, for JSON."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [plain(item) for item in value]
    if isinstance(value, complex):
        return [plain(value.real), plain(value.imag)]
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def write_json(result: Mapping[str, Any], path: Path) -> None:
    """Write one JSON object to a file, in an indented form."""
    path.write_text(json.dumps(plain(result), allow_nan=False, indent=2) + "\n", encoding="utf-8")

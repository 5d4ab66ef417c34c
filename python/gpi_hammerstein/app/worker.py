"""What the process of a search does; :mod:`gpi_hammerstein_launcher.search` starts it.

The answer to a request is ``{"progress": ..}`` while it works, and at the end ``{"done": ..}``,
``{"stopped": ..}`` or ``{"failed": ..}``.
"""

import json
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from gpi_hammerstein import files
from gpi_hammerstein._native import Explanation, GpiError, Progress, explain
from gpi_hammerstein.explanation import in_words, to_dict
from gpi_hammerstein.held_out import rule_of
from gpi_hammerstein.io import Recording, read_recording
from gpi_hammerstein.json_values import plain
from gpi_hammerstein.report import report_html

# Seconds between two reports of the progress: more of them could not be read.
PAUSE = 0.1
# The first stage after the declared model was fitted. From then on, a search that is stopped has a model.
SEARCHES = "score test"
FIELDS = ("stage", "trial", "done", "error", "elapsed", "remaining")
REPORT, MODEL, EXPLANATION = "report.html", "model.json", "explanation.json"
NOTHING_KEPT = (
    "The search was stopped before the declared model was fitted, so that there was no model to keep."
)

Tell = Callable[[dict[str, Any]], None]


class Stopped(Exception):
    """The user wants the search to stop."""


def work(request: dict[str, Any], stop: threading.Event, tell: Tell) -> None:
    """Search, and write the results to a folder.

    Parameters
    ----------
    request
        ``paths``, ``reading`` (the arguments of `read_record`), ``effects``, ``out`` (the folder) and
        ``command`` (the same search on the command line).
    stop
        Is set when the search should stop.
    tell
        Is called with each line of the answer.

    Examples
    --------
    >>> work({"paths": ["run.csv"], "out": "found", **others}, threading.Event(), print)  # doctest: +SKIP
    """
    last, keeps = -PAUSE, False

    def progress(now: Progress) -> None:
        nonlocal last, keeps
        if stop.is_set():
            raise Stopped
        keeps = keeps or now.stage == SEARCHES
        if time.monotonic() - last < PAUSE and now.done < 1.0:
            return
        last = time.monotonic()
        tell({"progress": {name: getattr(now, name) for name in FIELDS}, "keeps": keeps})

    try:
        recording = read_recording([Path(path) for path in request["paths"]], **request["reading"])
        found = explain(recording.record(), effects=request["effects"], progress=progress)
        tell({"writing": True})
        tell({"done": written(found, recording, Path(request["out"]), request["command"])})
    except Stopped:
        tell({"stopped": NOTHING_KEPT})
    except GpiError as error:
        tell({"failed": {"error": type(error).__name__, "message": str(error)}})
    except Exception as error:
        tell({"failed": {"error": type(error).__name__, "message": f"{type(error).__name__}: {error}"}})


def written(found: Explanation, recording: Recording, out: Path, command: str) -> dict[str, Any]:
    """Write the report, the model and the explanation; return what the page shows at once."""
    page = report_html(found, command=command, notes=recording.notes, model_file=MODEL)
    result = to_dict(found)
    units = set(found.record.output_units)
    unit = units.pop() if len(units) == 1 else ""
    with files.staged(out) as folder:
        (folder / REPORT).write_text(page, encoding="utf-8")
        (folder / MODEL).write_text(found.model.to_json(), encoding="utf-8")
        text = json.dumps(plain(result), allow_nan=False, indent=2)
        (folder / EXPLANATION).write_text(text + "\n", encoding="utf-8")
    model = found.model
    shown: dict[str, Any] = plain(
        {
            "verdict": found.verdict,
            "effects": found.effects,
            "interrupted": found.interrupted,
            "sentences": list(in_words(result, unit, numbers=False)),
            "error": result["error"],
            "rule": rule_of(found),
            "unit": unit,
            "inputs": channels(model.input_names, model.input_units),
            "outputs": channels(model.output_names, model.output_units),
            "rate": model.rate,
            "command": command,
        }
    )
    return shown


def channels(names: list[str], units: list[str]) -> list[dict[str, str]]:
    """Return the names and units of channels."""
    return [{"name": name, "unit": unit} for name, unit in zip(names, units, strict=True)]

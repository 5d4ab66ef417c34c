"""What one run of the app remembers: files, the search, its results, and what is drawn."""

import math
import threading
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gpi_hammerstein._native import DataError, Model, ParameterError, __version__, effect_names
from gpi_hammerstein.app.choices import choices_from, number
from gpi_hammerstein.app.drive import SIMULATED, drive
from gpi_hammerstein.app.look import look
from gpi_hammerstein.app.search import Search
from gpi_hammerstein.app.settings import largest_upload
from gpi_hammerstein.app.signals import Signals
from gpi_hammerstein.app.uploads import Upload, Uploads
from gpi_hammerstein.app.worker import EXPLANATION, MODEL, REPORT
from gpi_hammerstein.export import export_c
from gpi_hammerstein.files import load_model
from gpi_hammerstein.inspection.command import command

COMPENSATOR = "gpi_compensator"
# The files that the page offers, and how a browser should take them.
OFFERED = {
    REPORT: "text/html; charset=utf-8",
    MODEL: "application/json",
    EXPLANATION: "application/json",
    SIMULATED: "text/csv; charset=utf-8",
    f"{COMPENSATOR}.h": "text/plain; charset=utf-8",
    f"{COMPENSATOR}.c": "text/plain; charset=utf-8",
}


@dataclass(frozen=True)
class Result:
    """The files of a search that is done."""

    folder: Path
    model: Model


class Session:
    """The state of one run of the app.

    Parameters
    ----------
    folder
        The private folder. Whoever makes it removes it.

    Examples
    --------
    >>> from pathlib import Path
    >>> Session(Path("private")).state()["search"] is None
    True
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self.uploads: Uploads = Uploads(folder)
        self.search: Search | None = None
        self._starting = threading.Lock()
        self._searches = 0
        self._out: Path | None = None
        self._result: Result | None = None
        self._drawn: dict[str, Signals] = {}

    def state(self) -> dict[str, Any]:
        """Return what the page needs when it is opened or loaded again."""
        return {
            "version": __version__,
            "largest_upload": largest_upload(),
            "effects": effect_names(),
            "search": self.status(),
        }

    def status(self) -> dict[str, Any] | None:
        """Return what the search does, with the names of files that the user knows; None without a search."""
        if self.search is None:
            return None
        status = self.search.status()
        if "message" in status:
            status["message"] = self.uploads.shown(status["message"])
        return status

    def inspect(self, request: dict[str, Any]) -> dict[str, Any]:
        """Inspect files."""
        facts, signals = look(self.uploads, choices_from(request))
        self._draw("record", signals)
        return {**facts, "drawn": signals is not None}

    def start(self, request: dict[str, Any]) -> dict[str, Any] | None:
        """Start a search."""
        with self._starting:
            return self._start(request)

    def _start(self, request: dict[str, Any]) -> dict[str, Any] | None:
        if self.search is not None and self.search.is_running():
            raise ParameterError("a search is running; stop it before another one is started")
        choices = choices_from(request)
        uploads = self.uploads.find(choices.files)
        if self.search is not None:
            self.result_or_none()
            self.search.close()
        self._searches += 1
        self._out = self._folder / f"result-{self._searches}"
        self.search = Search(
            {
                "paths": [str(upload.path) for upload in uploads],
                "reading": choices.reading(),
                "effects": choices.effects,
                "out": str(self._out),
                "command": on_the_command_line(uploads, request),
            }
        )
        return self.status()

    def cancel(self, request: dict[str, Any]) -> dict[str, Any] | None:
        """Stop the search."""
        if self.search is None:
            raise ParameterError("no search was started")
        self.search.cancel()
        return self.status()

    def result_or_none(self) -> Result | None:
        """Return the files of the last search that is done; None if there is none."""
        done = self.search is not None and self.search.status()["state"] == "done"
        if done and self._out is not None and (self._result is None or self._result.folder != self._out):
            self._result = Result(self._out, load_model(self._out / MODEL))
            self._drawn.pop("other", None)
        return self._result

    def result(self) -> Result:
        """Return the files of the last search that is done.

        Raises
        ------
        ParameterError
            No search is done.
        """
        result = self.result_or_none()
        if result is None:
            raise ParameterError("there is no model yet; start a search first")
        return result

    def drive(self, request: dict[str, Any]) -> dict[str, Any]:
        """Drive another record through the model."""
        result = self.result()
        found, signals = drive(result.model, self.uploads, choices_from(request), result.folder)
        self._draw("other", signals)
        return {**found, "files": [SIMULATED]}

    def export(self, request: dict[str, Any]) -> dict[str, Any]:
        """Write the compensator in C."""
        result = self.result()
        low, high = number(request, "low"), number(request, "high")
        limits = None
        if low is not None or high is not None:
            limits = (-math.inf if low is None else low, math.inf if high is None else high)
        compensator = export_c(
            result.model,
            result.folder,
            limits=limits,
            precision="double" if request.get("precision") == "double" else "single",
            name=COMPENSATOR,
        )
        return {
            "compensated": compensator.compensated,
            "left": [f"{part}: {why}" for part, why in compensator.left],
            "files": [f"{COMPENSATOR}.h", f"{COMPENSATOR}.c"],
        }

    def file(self, name: str) -> Path:
        """Return a file of the results.

        Raises
        ------
        DataError
            There is no such file.
        """
        path = self.result().folder / name
        if name not in OFFERED or not path.is_file():
            raise DataError(f"{name}: was not written yet")
        return path

    def signals(self, which: str) -> Signals:
        """Return what is drawn of the record or of the other record.

        Raises
        ------
        DataError
            Nothing was read.
        """
        if which not in self._drawn:
            raise DataError("there is nothing to draw; drop a file first")
        return self._drawn[which]

    def _draw(self, which: str, signals: Signals | None) -> None:
        self._drawn.pop(which, None)
        if signals is not None:
            self._drawn[which] = signals

    def close(self) -> None:
        """End a search that still runs."""
        if self.search is not None:
            self.search.close()


def on_the_command_line(uploads: list[Upload], request: dict[str, Any]) -> str:
    """Return the command that makes the same search, for the foot of the report."""
    choices = choices_from(request)
    options = {**choices.columns(), "experiments": choices.experiments}
    if choices.effects is not None:
        options["effects"] = ",".join(choices.effects) or "none"
    names = [upload.name for upload in uploads]
    return command("explain", names, options, "--report", "-o", "explained")

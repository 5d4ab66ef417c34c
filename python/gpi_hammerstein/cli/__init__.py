"""The command `gpi`."""

import os
import shlex
import sys
from collections.abc import Callable, Sequence
from typing import Annotated, Any

import typer

from gpi_hammerstein._native import DataError, ParameterError, __version__
from gpi_hammerstein.cli.app import app as app_command
from gpi_hammerstein.cli.batch import batch
from gpi_hammerstein.cli.compare import compare
from gpi_hammerstein.cli.compensate import compensate
from gpi_hammerstein.cli.datasets import datasets
from gpi_hammerstein.cli.demo import demo
from gpi_hammerstein.cli.excite import excite
from gpi_hammerstein.cli.explain import explain
from gpi_hammerstein.cli.export import export
from gpi_hammerstein.cli.help import Command, Group
from gpi_hammerstein.cli.identify import identify
from gpi_hammerstein.cli.inspect import inspect
from gpi_hammerstein.cli.monitor import monitor
from gpi_hammerstein.cli.output import complain
from gpi_hammerstein.cli.report import report
from gpi_hammerstein.cli.reproduce import reproduce
from gpi_hammerstein.cli.simulate import simulate
from gpi_hammerstein.cli.validate import validate

DONE, FAILED, WRONG_CALL, UNUSABLE_DATA, INTERRUPTED = 0, 1, 2, 3, 130

app: typer.Typer = typer.Typer(
    name="gpi",
    cls=Group,
    no_args_is_help=True,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
    help="Identify piezo and other smart-material actuators from measured data.\n\n"
    "To start, run `gpi demo`. Then run `gpi inspect` with a record of your own.",
    epilog="Exit codes: 0 success, 2 wrong call, 3 unusable data, 4 the machine has changed (monitor), 130 "
    "interrupted, 143 terminated, "
    "1 any other error.",
)


def _print_version(wanted: bool) -> None:
    if wanted:
        print(f"gpi {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    pass


EXAMPLES: dict[Callable[..., Any], str] = {
    demo: "gpi demo -o out/demo",
    inspect: "gpi inspect run.csv",
    identify: "gpi identify run.csv --input u_V --output y_um -o model",
    explain: "gpi explain run.csv --holdout-record other.csv -o explained --report",
    report: "gpi report run.csv",
    batch: "gpi batch runs -o fleet",
    simulate: "gpi simulate model/model.json drive.csv -o prediction",
    validate: "gpi validate model/model.json other.csv -o check",
    monitor: "gpi monitor model/model.json today.csv",
    compare: "gpi compare old/model.json new/model.json run.csv",
    compensate: "gpi compensate model/model.json path.csv --limits -10,150 -o drive",
    export: "gpi export model/model.json --limits -10,150 --c compensator",
    app_command: "gpi app",
}
for _command, _example in EXAMPLES.items():
    app.command(cls=Command, epilog=f"Example: {_example}")(_command)
app.add_typer(excite, name="excite")
app.add_typer(datasets, name="datasets")
app.add_typer(reproduce, name="reproduce")


def run(arguments: Sequence[str] | None = None) -> int:
    """Run the command `gpi` and return its exit code.

    Parameters
    ----------
    arguments
        The arguments after ``gpi``; None takes those of the process.

    Returns
    -------
    int
        0 success, 2 wrong call, 3 unusable data, 130 interrupted, 1 any other error.

    Examples
    --------
    >>> run(["simulate", "no-such-model.json", "no-such-record.csv"])  # doctest: +SKIP
    3
    """
    try:
        words = sys.argv[1:] if arguments is None else list(arguments)
        code = app(args=words, standalone_mode=False, obj=shlex.join(["gpi", *words]))
        return code if isinstance(code, int) else DONE
    except ParameterError as error:
        return complain(error, WRONG_CALL)
    except DataError as error:
        return complain(error, UNUSABLE_DATA)
    except (KeyboardInterrupt, typer.Abort):
        return complain("interrupted; nothing was written", INTERRUPTED)
    except BrokenPipeError:
        # The reader of the pipe was closed: redirect the interpreter's last flush to nowhere.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return FAILED
    except Exception as error:
        if os.environ.get("GPI_DEBUG"):
            raise
        # Typer has its own copy of Click's exceptions, which are recognised by their method `show`.
        if callable(show := getattr(error, "show", None)):
            show()
            return int(getattr(error, "exit_code", WRONG_CALL))
        return complain(error, FAILED)
    except BaseException as error:
        # A panic of the native module is a BaseException, and has already printed its location.
        if type(error).__name__ != "PanicException":
            raise
        return complain(f"a bug in the native module: {error}", FAILED)

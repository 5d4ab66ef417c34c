"""`gpi batch`: explain many records, with one row for each of them in a table."""

from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Annotated, Any

import polars as pl
import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table

from gpi_hammerstein._native import ParameterError
from gpi_hammerstein.cli import options
from gpi_hammerstein.cli.explain import split_effects
from gpi_hammerstein.cli.output import console, escape, print_json

WORK = "Workers"
# Errors that are shown; the table has all.
SHOWN = 5

Records = Annotated[
    list[Path] | None,
    typer.Argument(
        metavar="RECORD",
        help="Record files, folders with record files, or patterns such as 'runs/*.csv'.",
        show_default=False,
    ),
]
Out = Annotated[
    Path,
    typer.Option(
        "--out", "-o", metavar="DIR", help="Folder for the results.", callback=options.writable_folder
    ),
]


def batch(
    records: Records = None,
    out: Out = ...,  # type: ignore[assignment]  # required
    manifest: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="CSV or Parquet table of the records instead of RECORD: columns `file`, `device`, `date` "
            "and options of this command.",
        ),
    ] = None,
    input: options.Input = None,
    output: options.Output = None,
    time: options.Time = None,
    rate: options.Rate = None,
    covariate: options.Covariate = None,
    resample: options.Resample = None,
    warmup: options.Warmup = None,
    experiments: options.Experiments = None,
    effects: options.Effects = None,
    require: options.Require = None,
    order: options.Order = None,
    half_widths: options.HalfWidths = None,
    thresholds: options.Thresholds = None,
    delay: options.Delay = None,
    reading: options.Reading = "one-sided",
    hysteresis: options.Hysteresis = None,
    workers: Annotated[
        int | None,
        typer.Option(
            min=1, help="Processes. Default: one for each processor.", metavar="N", rich_help_panel=WORK
        ),
    ] = None,
    threads: Annotated[
        int, typer.Option(min=1, help="Threads of each process.", metavar="N", rich_help_panel=WORK)
    ] = 1,
    memory: Annotated[
        float | None,
        typer.Option(
            min=0.1, help="Memory of each process, in GiB. Default: no limit.", rich_help_panel=WORK
        ),
    ] = None,
    dask: Annotated[
        bool, typer.Option("--dask", help="Use a Dask cluster on this machine.", rich_help_panel=WORK)
    ] = False,
    scheduler: Annotated[
        str | None,
        typer.Option(
            help="Use the Dask cluster of this scheduler, such as tcp://host:8786.",
            metavar="ADDRESS",
            rich_help_panel=WORK,
        ),
    ] = None,
    report: Annotated[bool, typer.Option("--report", help="Also write report.html of each record.")] = False,
    as_json: options.Json = False,
) -> int:
    """Explain many records, and write one row for each of them to DIR/fleet.parquet.

    DIR/records/NAME/ gets model.json and explanation.json of each record. A batch that was stopped continues
    where it was. A record that cannot be read or explained gets a row with its error.
    """
    from gpi_hammerstein.fleet import batch as run

    given: dict[str, Any] = {
        "input": options.split_names(input),
        "output": options.split_names(output),
        "time": time,
        "rate": rate,
        "covariate": [] if covariate == ["none"] else options.split_names(covariate),
        "resample": options.parse_resample(resample),
        "warmup": warmup,
        "experiment": experiments,
        "effects": split_effects(effects),
        "require": split_effects(require),
        "order": order,
        "half_widths": options.parse_numbers("half_widths", half_widths),
        "thresholds": options.parse_numbers("thresholds", thresholds),
        "delay": delay,
        "reading": None if reading == "one-sided" else reading,
        "hysteresis": hysteresis,
    }
    with cluster(scheduler, dask, workers) as client, bar() as tell:
        table = run(
            records or (),
            out=out,
            manifest=manifest,
            executor=client,
            workers=workers,
            threads=threads,
            memory=memory,
            report=report,
            progress=tell,
            **{name: value for name, value in given.items() if value is not None},
        )
    if as_json:
        print_json(in_numbers(table, out))
    else:
        summarise(console(), table, out)
    return 0


@contextmanager
def cluster(scheduler: str | None, local: bool, workers: int | None) -> Iterator[Any]:
    """Yield a client of a Dask cluster; None if none is wanted."""
    if scheduler is None and not local:
        yield None
        return
    try:
        from distributed import Client, LocalCluster
    except ImportError:
        raise ParameterError(
            "`dask`: Dask is not installed; install it by `pip install gpi-hammerstein[dask]`"
        ) from None
    if scheduler is not None:
        try:
            client = Client(scheduler)  # type: ignore[no-untyped-call]
        except (OSError, ValueError) as error:
            raise ParameterError(f"`scheduler` = {scheduler}: no Dask scheduler answers: {error}") from None
        with closing(client):
            yield client
        return
    made: Any = LocalCluster(n_workers=workers, threads_per_worker=1)  # type: ignore[no-untyped-call]
    with made, Client(made) as client:  # type: ignore[no-untyped-call]
        Console(stderr=True).print(f"dashboard: {client.dashboard_link}")
        yield client


@contextmanager
def bar() -> Iterator[Callable[[int, int], None] | None]:
    """Yield a function that shows how many records are done; None if stderr is no terminal."""
    errors = Console(stderr=True)
    if not errors.file.isatty():
        yield None
        return
    columns = (BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TimeRemainingColumn())
    with Progress(*columns, console=errors, transient=True) as shown:
        task = shown.add_task("")
        yield lambda done, every: shown.update(task, completed=done, total=every)


def in_numbers(table: pl.DataFrame, out: Path) -> dict[str, Any]:
    """Return the summary of a batch as a JSON object."""
    return {
        "schema": "gpi-batch/1",
        "records": len(table),
        "failed": table["error"].is_not_null().sum(),
        "verdicts": dict(table["verdict"].drop_nulls().value_counts(sort=True).iter_rows()),
        "effects": dict(table["effects"].explode().drop_nulls().value_counts(sort=True).iter_rows()),
        "table": str(out / "fleet.parquet"),
    }


def summarise(screen: Console, table: pl.DataFrame, out: Path) -> None:
    """Print how often each verdict and each effect occurs, and the first errors."""
    known = in_numbers(table, out)
    screen.print(f"{known['records']} records, {known['failed']} of them without a result")
    for title, counts in (("verdict", known["verdicts"]), ("effect", known["effects"])):
        if counts:
            shown = Table(title_justify="left")
            shown.add_column(title)
            shown.add_column("records", justify="right")
            for name, count in counts.items():
                shown.add_row(escape(name), str(count))
            screen.print(shown)
    failed = table.filter(pl.col("error").is_not_null())
    for file, error in failed.select("file", "error").head(SHOWN).iter_rows():
        screen.print(f"[yellow]no result[/] {escape(file)}: {escape(error)}")
    if len(failed) > SHOWN:
        screen.print(f"and {len(failed) - SHOWN} more in the column `error`")
    screen.print(f"Written to {escape(str(out))}: fleet.parquet, records/")

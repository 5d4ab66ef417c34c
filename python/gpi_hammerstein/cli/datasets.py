"""`gpi datasets`: list and download measured records that anybody may use."""

from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from gpi_hammerstein import files
from gpi_hammerstein.cli import options
from gpi_hammerstein.cli.help import Command, Group
from gpi_hammerstein.cli.output import console, escape, print_json, working
from gpi_hammerstein.escaping import in_cell

datasets: typer.Typer = typer.Typer(
    cls=Group, no_args_is_help=True, help="List and download measured records that anybody may use."
)

Name = Annotated[
    str, typer.Argument(help="Name of a set; `gpi datasets list` lists them.", show_default=False)
]
Part = Annotated[str | None, typer.Option(help="One of its parts. Default: the first one.")]
Out = Annotated[
    Path,
    typer.Option(
        "--out", "-o", metavar="DIR", help="Folder for the records.", callback=options.writable_folder
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]


@datasets.command("list", cls=Command, epilog="Example: gpi datasets list")
def list_all(as_json: Json = False) -> None:
    """List the sets with their parts, licences and web pages."""
    from gpi_hammerstein.datasets import CATALOGUE

    if as_json:
        print_json(
            {
                name: {
                    "what": one.what,
                    "parts": list(one.parts),
                    "authors": one.authors,
                    "licence": one.licence,
                    "home": one.home,
                }
                for name, one in CATALOGUE.items()
            }
        )
        return
    table = Table(show_lines=True)
    for head in ("set", "what", "parts", "licence", "home"):
        table.add_column(head, overflow="fold")
    for name, one in CATALOGUE.items():
        licence = f"{one.licence}\n{one.authors}"
        table.add_row(*map(escape, (name, one.what, ", ".join(one.parts), licence, one.home)))
    console().print(table)


@datasets.command(cls=Command, epilog="Example: gpi datasets fetch piezo-p885-dbo -o data")
def fetch(name: Name, part: Part = None, out: Out = Path(".")) -> None:
    """Download a part of a set, and write a CSV file for each experiment. All commands read these files."""
    from gpi_hammerstein.datasets import chosen, load
    from gpi_hammerstein.interop import to_polars

    dataset, own = chosen(name, part)
    with working(f"downloading {name}"):
        record = load(name, own)
    count = len(record.u)
    names = [f"{name}-{own}.csv"] if count == 1 else [f"{name}-{own}-{i}.csv" for i in range(count)]
    with files.staged(out) as folder:
        for experiment, file in enumerate(names):
            to_polars(record, experiment).rename(in_cell).write_csv(folder / file)
    screen = console()
    screen.print(f"{escape(dataset.what)}. By {escape(dataset.authors)}, {dataset.licence}: {dataset.home}")
    if any(record.warmup):
        warmup = max(record.warmup)
        screen.print(f"The first {warmup} samples of each file are warm-up: use --warmup {warmup}.")
    screen.print("Written: " + ", ".join(escape(str(out / file)) for file in names))

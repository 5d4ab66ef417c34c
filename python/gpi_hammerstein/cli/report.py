"""`gpi report`: one HTML page with the results of `gpi explain`, or of the table of `gpi batch`."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from gpi_hammerstein import files
from gpi_hammerstein._native import ParameterError
from gpi_hammerstein.cli import options
from gpi_hammerstein.cli.explain import explained, split_effects
from gpi_hammerstein.cli.output import common_unit, console, escape, working
from gpi_hammerstein.explanation import in_words, to_dict
from gpi_hammerstein.files import require_file

# Devices of a fleet that are printed; the page has all.
SHOWN = 5

Out = Annotated[
    Path,
    typer.Option("--out", "-o", metavar="FILE", help="File for the page.", callback=options.writable_file),
]


def report(
    context: typer.Context,
    records: options.Records,
    input: options.Input = None,
    output: options.Output = None,
    time: options.Time = None,
    rate: options.Rate = None,
    covariate: options.Covariate = None,
    resample: options.Resample = None,
    warmup: options.Warmup = None,
    experiments: options.Experiments = None,
    holdout_record: Annotated[
        Path | None,
        typer.Option(help="Another experiment of the same actuator for the test.", metavar="FILE"),
    ] = None,
    effects: options.Effects = None,
    out: Out = Path("report.html"),
) -> int:
    """Find the effects that a model lacks, and write one HTML page with all results.

    If RECORD is the table of `gpi batch`, fleet.parquet, the page is that of the fleet: distributions,
    effects, devices that stand out and why, trends.

    The page needs no network and no other files. The model is written to the same folder, as model.json for
    report.html, and as NAME.model.json for NAME.html. `gpi explain --report` writes the page together with
    the other results.
    """
    from gpi_hammerstein.fleet.reading import is_fleet

    if any(is_fleet(record) for record in records):
        given = {
            "input": input,
            "output": output,
            "time": time,
            "rate": rate,
            "covariate": covariate,
            "resample": resample,
            "warmup": warmup,
            "experiments": experiments,
            "holdout-record": holdout_record,
            "effects": effects,
        }
        return report_fleet(records, given, out, context.obj)
    model_file = model_beside(out)
    require_file(model_file, "out")
    from gpi_hammerstein.report import write_report

    read: dict[str, Any] = {
        "input": input,
        "output": output,
        "time": time,
        "rate": rate,
        "covariate": covariate,
        "resample": resample,
        "warmup": warmup,
    }
    chosen = split_effects(effects)
    recording, found, _ = explained(records, read, experiments, holdout_record, effects=chosen)
    files.save_model(found.model, model_file)
    with working("drawing"):
        write_report(found, out, command=context.obj, notes=recording.notes, model_file=model_file.name)
    screen = console()
    for sentence in in_words(to_dict(found), common_unit(found.record), numbers=False):
        screen.print(escape(sentence))
    screen.print(f"Written: {escape(str(out))}, {escape(str(model_file))}")
    return 130 if found.interrupted else 0


def report_fleet(records: list[Path], given: Mapping[str, Any], out: Path, command: str) -> int:
    """Write the page of a fleet. Options of a record are refused."""
    if len(records) > 1:
        raise ParameterError("`records`: the table of a fleet is reported alone; give no other file")
    for name, value in given.items():
        if value is not None and value != []:
            raise ParameterError(
                f"`{name}`: is an option of a record, and {records[0]} is the table of a fleet"
            )
    from gpi_hammerstein.fleet.reading import read_fleet
    from gpi_hammerstein.fleet.unusual import unusual_devices
    from gpi_hammerstein.report.fleet import write_fleet

    table = read_fleet(records[0])
    with working("drawing"):
        found = unusual_devices(table)
        write_fleet(table, out, file=records[0], command=command)
    screen = console()
    screen.print(f"{len(found)} device{' stands' if len(found) == 1 else 's stand'} out")
    for device, why in found.head(SHOWN).select("device", "why").iter_rows():
        screen.print(f"{escape(device)}: {escape('; '.join(why))}")
    if len(found) > SHOWN:
        screen.print(f"and {len(found) - SHOWN} more on the page")
    screen.print(f"Written: {escape(str(out))}")
    return 0


def model_beside(page: Path) -> Path:
    """Return the name of the model file of a page, which differs for pages of one folder."""
    return page.with_name("model.json" if page.stem == "report" else f"{page.stem}.model.json")

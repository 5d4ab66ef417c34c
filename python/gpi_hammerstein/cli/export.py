"""`gpi export`: write a compensator as source code."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from gpi_hammerstein import files
from gpi_hammerstein._native import ParameterError
from gpi_hammerstein.cli import options
from gpi_hammerstein.cli.output import console, escape
from gpi_hammerstein.cli.simulate import ModelFile
from gpi_hammerstein.export import export_c, export_rust

Rust = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="Write a Rust module, for example compensator.rs.",
        callback=options.writable_file,
    ),
]
C = Annotated[
    Path | None,
    typer.Option(
        "--c", metavar="DIR", help="Write NAME.h and NAME.c in C99.", callback=options.writable_folder
    ),
]
Limits = Annotated[
    options.Pair | None,
    typer.Option(
        parser=options.read_pair,
        metavar="LOW,HIGH",
        help="Lowest and highest drive, in the unit of the input.",
    ),
]
PrecisionOption = Annotated[
    Literal["single", "double"], typer.Option(help="Number type: float and f32, or double and f64.")
]
Name = Annotated[str, typer.Option(help="Prefix of the names of files, types and functions in C.")]


def export(
    model_file: ModelFile,
    rust: Rust = None,
    c: C = None,
    limits: Limits = None,
    precision: PrecisionOption = "single",
    name: Name = "gpi_compensator",
) -> None:
    """Write a compensator for a microcontroller, which computes the drive from a reference sample by sample.

    It compensates hysteresis and creep exactly. Of the dynamics it compensates only the DC gain. The code
    needs no heap and no library. Its comments contain the hash of the model, the units and the limits.
    """
    if rust is None and c is None:
        raise ParameterError(
            "nothing to write: name a file (--rust compensator.rs) or a folder (--c compensator)"
        )
    model = files.load_model(model_file)
    written = []
    if rust is not None:
        compensator = export_rust(model, rust, limits=limits, precision=precision)
        written.append(rust)
    if c is not None:
        compensator = export_c(model, c, limits=limits, precision=precision, name=name)
        written += [c / f"{name}.h", c / f"{name}.c"]
    screen = console()
    screen.print(f"Compensated: {', '.join(compensator.compensated)}.")
    for part, why in compensator.left:
        screen.print(f"[yellow]not compensated[/] {part}: {escape(why)}.")
    screen.print("Written: " + ", ".join(escape(str(file)) for file in written))

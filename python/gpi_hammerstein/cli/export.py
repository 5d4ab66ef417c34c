"""`gpi export`: write a model, its compensator or its monitor for other programs."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from gpi_hammerstein import files
from gpi_hammerstein._native import ParameterError
from gpi_hammerstein.cli import options
from gpi_hammerstein.cli.output import console, escape
from gpi_hammerstein.cli.simulate import ModelFile
from gpi_hammerstein.export import (
    SCRIPT,
    export_c,
    export_fmu,
    export_mat,
    export_model_c,
    export_model_rust,
    export_monitor_c,
    export_rust,
)

What = Annotated[
    Literal["model", "compensator", "monitor"] | None,
    typer.Option(
        help="The model with its effects, which computes the output from the input; or the compensator, "
        "which computes the drive from a reference; or the monitor, which tests whether the machine has "
        "changed (in C). Default: compensator in C and Rust, model elsewhere.",
        show_default=False,
    ),
]
Fmu = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="Write an FMU for co-simulation (FMI 3.0), for example model.fmu. It needs a C compiler.",
        callback=options.writable_file,
    ),
]
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
Mat = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="Write the model for MATLAB and Octave, for example model.mat, and next to it simulate_gpi.m.",
        callback=options.writable_file,
    ),
]
Limits = Annotated[
    options.Pair | None,
    typer.Option(
        parser=options.read_pair,
        metavar="LOW,HIGH",
        help="Lowest and highest drive of a compensator, in the unit of the input.",
    ),
]
PrecisionOption = Annotated[
    Literal["single", "double"],
    typer.Option(help="Number type of C and Rust: float and f32, or double and f64."),
]
Name = Annotated[
    str | None,
    typer.Option(
        help="Prefix of the names of files, types and functions in C. Default: gpi_model, gpi_compensator or "
        "gpi_monitor.",
        show_default=False,
    ),
]


def export(
    model_file: ModelFile,
    what: What = None,
    rust: Rust = None,
    c: C = None,
    fmu: Fmu = None,
    mat: Mat = None,
    limits: Limits = None,
    precision: PrecisionOption = "single",
    name: Name = None,
) -> None:
    """Write a model, its compensator or its monitor for other programs, which run it sample by sample.

    The source code needs no heap and no library. Its comments contain the hash of the model, the units and
    the limits. A compensator compensates hysteresis and creep exactly. Of the dynamics it compensates only
    the DC gain.
    """
    if rust is None and c is None and fmu is None and mat is None:
        own = what or "compensator"
        raise ParameterError(
            f"nothing to write: name a folder (--c {own}) or a file (--rust {own}.rs, --fmu {what or 'model'}"
            ".fmu, --mat model.mat)"
        )
    if what == "monitor" and (c is None or rust is not None or fmu is not None or mat is not None):
        raise ParameterError("`what` = monitor: a monitor is written in C (--c DIR), and in nothing else")
    if mat is not None and what == "compensator":
        raise ParameterError("`what` = compensator: --mat writes models only; use --c, --rust or --fmu")
    code: str = what or "compensator"
    elsewhere: Literal["model", "compensator"] = "compensator" if what == "compensator" else "model"
    asked = {code} if rust is not None or c is not None else set()
    asked |= {elsewhere} if fmu is not None or mat is not None else set()
    if "compensator" not in asked and limits is not None:
        raise ParameterError(
            f"`limits` = {limits.low:g}, {limits.high:g}: only a compensator has limits; leave out --limits, "
            "or add --what compensator"
        )
    model = files.load_model(model_file)
    written: list[Path] = []
    if rust is not None:
        if code == "model":
            export_model_rust(model, rust, precision=precision)
        else:
            export_rust(model, rust, limits=limits, precision=precision)
        written.append(rust)
    if c is not None:
        name = name or f"gpi_{code}"
        if code == "model":
            export_model_c(model, c, precision=precision, name=name)
        elif code == "monitor":
            export_monitor_c(model, c, precision=precision, name=name)
            written += [c / f"{name}_model.h", c / f"{name}_model.c"]
        else:
            export_c(model, c, limits=limits, precision=precision, name=name)
        written += [c / f"{name}.h", c / f"{name}.c"]
    if fmu is not None:
        export_fmu(model, fmu, what=elsewhere, limits=limits if elsewhere == "compensator" else None)
        written.append(fmu)
    if mat is not None:
        export_mat(model, mat)
        written += [mat, mat.parent / SCRIPT]
    screen = console()
    if "compensator" in asked:
        compensator = model.compensator(limits=limits)
        screen.print(f"Compensated: {', '.join(compensator.compensated)}.")
        for part, why in compensator.left:
            screen.print(f"[yellow]not compensated[/] {part}: {escape(why)}.")
    screen.print("Written: " + ", ".join(escape(str(file)) for file in written))

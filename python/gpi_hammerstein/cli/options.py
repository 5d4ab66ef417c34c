"""Options that several commands share, and the functions that parse them."""

from pathlib import Path
from typing import Annotated, Literal, NamedTuple

import typer

from gpi_hammerstein import files
from gpi_hammerstein._native import DataError, Model, ParameterError
from gpi_hammerstein.files import require_file, require_folder
from gpi_hammerstein.io import Recording
from gpi_hammerstein.io.for_model import read_for_model

COLUMNS = "Columns"
MODEL = "Model"


class Pair(NamedTuple):
    """Two numbers, the lower one first."""

    low: float
    high: float


def read_pair(text: str) -> Pair:
    """Parse two numbers that are separated by a comma, as all lists on the command line."""
    try:
        low, high = (float(part) for part in text.split(","))
    except ValueError:
        raise typer.BadParameter(
            f"`{text}` must be two numbers that are separated by a comma, such as -10,150"
        ) from None
    return Pair(low, high)


def writable_folder(context: typer.Context, out: Path | None) -> Path | None:
    """Refuse a folder that cannot be written, before the work begins."""
    if out is not None and not context.resilient_parsing:
        require_folder(out)
    return out


def writable_file(context: typer.Context, option: typer.CallbackParam, file: Path | None) -> Path | None:
    """Refuse a file that cannot be written, before the work begins."""
    if file is not None and not context.resilient_parsing:
        require_file(file, str(option.name))
    return file


Records = Annotated[
    list[Path],
    typer.Argument(
        metavar="RECORD",
        help="Record files of one actuator: text (.csv, .txt, .csv.gz, ..), .xlsx, .parquet, .npz, .npy (see "
        "--output), .mat, .h5, .lvm, .tdms or .mf4.",
        show_default=False,
    ),
]
Input = Annotated[
    list[str] | None,
    typer.Option(
        "--input",
        "-u",
        metavar="NAME,..",
        help="Input columns. Names such as `u`, `u1`, `voltage` are recognised.",
        rich_help_panel=COLUMNS,
    ),
]
Output = Annotated[
    list[str] | None,
    typer.Option(
        "--output",
        "-y",
        metavar="NAME,..",
        help="Output columns. Names such as `y`, `y1`, `position` are recognised. For .npy records, give the "
        ".npy files of the outputs.",
        rich_help_panel=COLUMNS,
    ),
]
Time = Annotated[
    str | None,
    typer.Option(
        "--time", metavar="NAME", help="Time column. `t` and `time` are recognised.", rich_help_panel=COLUMNS
    ),
]
Rate = Annotated[
    float | None,
    typer.Option(
        "--rate",
        metavar="HZ",
        help="Sampling rate in Hz, for a record without a time column.",
        rich_help_panel=COLUMNS,
    ),
]
Covariate = Annotated[
    list[str] | None,
    typer.Option(
        "--covariate",
        metavar="NAME,..",
        help="Other measured columns. Default: all other columns. `none` ignores them.",
        rich_help_panel=COLUMNS,
    ),
]
Resample = Annotated[
    str | None,
    typer.Option(
        "--resample",
        metavar="RATE|auto",
        help="Make the sampling uniform: interpolate linearly to RATE in Hz (`auto`: the median time step), "
        "and cut the record at gaps and where the clock jumps back.",
        rich_help_panel=COLUMNS,
    ),
]
Warmup = Annotated[
    int | None,
    typer.Option("--warmup", min=0, help="Samples at the start of every experiment that are not scored."),
]
Experiments = Annotated[
    str | None,
    typer.Option("--experiments", metavar="0-4,7", help="Experiments to use, numbered from 0."),
]
RemoveMean = Annotated[
    bool,
    typer.Option(
        "--remove-mean", help="Remove a constant offset, such as the zero of a sensor, from the error."
    ),
]
FitStart = Annotated[
    bool,
    typer.Option(
        "--fit-start/--no-fit-start",
        help="Fit the unknown initial state (plays, dynamics) of the tested record, or simulate it from the "
        "steady state at its first input.",
    ),
]
Effects = Annotated[
    str | None,
    typer.Option(
        help="Effects that may be added, separated by commas. Default: all. `none`: no effect.", metavar="A,B"
    ),
]
Require = Annotated[
    str | None,
    typer.Option(
        help="Effects that are added even if they are not significant, separated by commas.", metavar="A,B"
    ),
]
Order = Annotated[
    int | None,
    typer.Option(
        min=1, help="Order of the linear part. Additional states are then an effect.", rich_help_panel=MODEL
    ),
]
HalfWidths = Annotated[
    str | None,
    typer.Option(help="Number of plays, or their half-widths.", rich_help_panel=MODEL, metavar="N|R1,R2,.."),
]
Thresholds = Annotated[
    str | None,
    typer.Option(
        help="Number of deadzones, or their thresholds.", rich_help_panel=MODEL, metavar="N|H1,H2,.."
    ),
]
Delay = Annotated[
    int | None,
    typer.Option(
        min=0, help="Use a gain with this delay, in samples, as the linear part.", rich_help_panel=MODEL
    ),
]
Reading = Annotated[
    Literal["one-sided", "directional"],
    typer.Option(
        help="Deadzone convention: a function of u alone, or of u and its direction.", rich_help_panel=MODEL
    ),
]
Hysteresis = Annotated[
    Literal["plays", "stops"] | None,
    typer.Option(
        help="Plays, whose output lags behind the input, or stops, whose output leads it (friction). "
        "Default: what the data ask for.",
        show_default=False,
        rich_help_panel=MODEL,
    ),
]
Out = Annotated[
    Path | None,
    typer.Option(
        "--out",
        "-o",
        metavar="DIR",
        help="Folder for the output files.",
        show_default=False,
        callback=writable_folder,
    ),
]
Log = Annotated[
    bool,
    typer.Option("--log", help="Print the progress as lines on stderr, also if stderr is not a terminal."),
]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object on stdout and nothing else.")]


def read(
    records: list[Path],
    *,
    input: list[str] | None,
    output: list[str] | None,
    time: str | None,
    rate: float | None,
    covariate: list[str] | None,
    resample: str | None,
    warmup: int | None,
    experiments: str | None = None,
    model: Model | None = None,
) -> Recording:
    """Read a record according to the options.

    Columns that have the names of the channels of `model` are taken as these channels, unless the options
    name others.
    """
    return read_for_model(
        model,
        records,
        input=split_names(input),
        output=split_names(output),
        time=time,
        rate=rate,
        covariate=[] if covariate == ["none"] else split_names(covariate),
        warmup=warmup,
        resample=parse_resample(resample),
        experiment=experiments,
    )


def load_model(file: Path, then: str = "RECORD") -> Model:
    """Read a model; a file that is no model may have changed places with the other argument, `then`."""
    try:
        return files.load_model(file)
    except DataError as error:
        if file.suffix == ".json":
            raise
        raise DataError(f"{error}; the model file comes first: MODEL {then}") from error


def split_names(names: list[str] | None) -> list[str] | None:
    """Split names that are separated by commas."""
    if not names:
        return None
    return [part.strip() for name in names for part in name.split(",") if part.strip()]


def parse_resample(text: str | None) -> bool | float | None:
    """Parse ``auto`` or a rate in Hz."""
    if text is None:
        return None
    if text.strip().lower() == "auto":
        return True
    try:
        return float(text)
    except ValueError:
        raise ParameterError(f"`resample` = {text}: must be a rate in Hz or `auto`") from None


def parse_numbers(name: str, text: str | None) -> int | list[float] | None:
    """Parse a count (one integer) or a list of numbers that are separated by commas."""
    if text is None:
        return None
    parts = [part.strip() for part in text.split(",") if part.strip()]
    try:
        if len(parts) == 1 and parts[0].isdecimal():
            return int(parts[0])
        numbers = [float(part) for part in parts]
    except ValueError:
        numbers = []
    if not numbers:
        raise ParameterError(f"`{name}` = {text}: must be a count, or numbers separated by commas")
    return numbers

"""`gpi inspect`: what a record contains, what can be identified from it, and the next command."""

from typing import Any

from gpi_hammerstein.cli import options
from gpi_hammerstein.cli.output import console, escape, print_json, working


def inspect(
    records: options.Records,
    input: options.Input = None,
    output: options.Output = None,
    time: options.Time = None,
    rate: options.Rate = None,
    covariate: options.Covariate = None,
    resample: options.Resample = None,
    as_json: options.Json = False,
) -> None:
    """Show what a record contains, what a model of it can determine, and the command to run next.

    Prints the columns with their units and roles, and why they have these roles; the rate and the gaps;
    saturation and quantisation; the frequency band, the strokes and the order of persistent excitation of
    the input; and whether input and output look swapped, or the input looks like that of a closed loop.
    Nothing is fitted and nothing is written.
    """
    from gpi_hammerstein.inspection import inspect as look

    read: dict[str, Any] = {
        "input": options.split_names(input),
        "output": options.split_names(output),
        "time": time,
        "rate": rate,
        "covariate": [] if covariate == ["none"] else options.split_names(covariate),
        "resample": options.parse_resample(resample),
    }
    with working("reading"):
        found = look(list(records), **read)
    if as_json:
        print_json(found.to_dict())
        return
    console().print(escape(str(found)))

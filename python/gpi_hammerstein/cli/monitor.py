"""`gpi monitor`: whether a machine has changed since its model was made."""

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from gpi_hammerstein._native import DataError, Model, Monitor, ParameterError
from gpi_hammerstein.cli import options
from gpi_hammerstein.cli.output import console, escape, print_json
from gpi_hammerstein.cli.simulate import ModelFile
from gpi_hammerstein.io.recording import Run
from gpi_hammerstein.monitoring import streams
from gpi_hammerstein.monitoring.words import changes_in_words, duration

CHANGED = 4

Places = Annotated[
    list[Path],
    typer.Argument(
        metavar="RECORD",
        help="Record files or folders of them, in the order of time, or - for CSV lines on standard input.",
        show_default=False,
    ),
]
Noise = Annotated[
    str | None,
    typer.Option(
        metavar="S,..",
        help="Standard deviation of the noise of each output. Default: that of the model's training record.",
        show_default=False,
    ),
]
FalseAlarms = Annotated[float, typer.Option(metavar="N", help="False alarms per hour of data, at most.")]
Follow = Annotated[bool, typer.Option("--follow", help="Wait for new files in the folder, until Ctrl-C.")]
UntilChange = Annotated[bool, typer.Option("--until-change", help="End at the first change.")]


def monitor(
    model_file: ModelFile,
    records: Places,
    input: options.Input = None,
    output: options.Output = None,
    time: options.Time = None,
    rate: options.Rate = None,
    covariate: options.Covariate = None,
    resample: options.Resample = None,
    noise: Noise = None,
    false_alarms: FalseAlarms = 1e-4,
    follow: Follow = False,
    until_change: UntilChange = False,
    as_json: options.Json = False,
) -> int:
    """Test whether a machine has changed since its model was made: what, by how much, and since when.

    Simulates the model along with the machine, and tests the residual for a change of the offset, the gain,
    the first resonance, the width of the hysteresis, the noise, and for new lines. The exit code is 4 if a
    change was noticed, else 0.

    Standard input has a header line and one line for each sample, at the sampling rate of the model.
    """
    model = options.load_model(model_file)
    watch = Monitor(model, noise=_noise(noise), false_alarms_per_hour=false_alarms)
    screen = console()
    read = {
        "input": options.split_names(input),
        "output": options.split_names(output),
        "covariate": [] if covariate == ["none"] else options.split_names(covariate),
    }
    if records == [Path("-")]:
        runs = _of_stdin(model, watch, read)
    else:
        clock = {"time": time, "rate": rate, "resample": options.parse_resample(resample)}
        runs = _of_files(model, records, follow, read | clock)
    told: set[str] = set()
    try:
        for is_new, run in runs:
            if is_new:
                watch.end_experiment()
            watch.push(run.u, run.y, run.covariates if run.covariates.shape[1] else None)
            if not as_json:
                fresh = [change for change in watch.changes if change["what"] not in told]
                told |= {change["what"] for change in fresh}
                for sentence in changes_in_words(fresh, watch.watched) if fresh else ():
                    screen.print(f"{duration(watch.seconds)}: {escape(sentence)}")
            if until_change and watch.changed:
                break
    except KeyboardInterrupt:
        # what was found until now is the result of a stream that does not end
        if not watch.seconds:
            raise
    changes, proposal = watch.changes, _proposal(watch.changed, records)
    if as_json:
        print_json(
            {
                "schema": "gpi-monitor/1",
                "model": str(model_file),
                "records": [str(record) for record in records],
                "seconds": watch.seconds,
                "false_alarms_per_hour": false_alarms,
                "tested": watch.watched,
                "changed": watch.changed,
                "changes": changes,
                "next": proposal,
            }
        )
    else:
        screen.print(f"After {duration(watch.seconds)} of data:")
        for sentence in changes_in_words(changes, watch.watched):
            screen.print(escape(sentence))
        if proposal:
            screen.print(escape(f"{proposal['why']}: {proposal['command']}"))
    return CHANGED if watch.changed else 0


def _noise(text: str | None) -> list[float] | None:
    if text is None:
        return None
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise ParameterError(f"`noise` = {text}: must be numbers that are separated by commas") from None


def _of_stdin(model: Model, watch: Monitor, read: dict[str, Any]) -> Iterator[tuple[bool, Run]]:
    samples = max(round(watch.period * model.rate), 1)
    for run in streams.of_lines(model, sys.stdin, samples=samples, **read):
        yield False, run


def _of_files(
    model: Model, records: Sequence[Path], follow: bool, read: dict[str, Any]
) -> Iterator[tuple[bool, Run]]:
    if not follow:
        for run in streams.of_files(model, streams.record_files(records), **read):
            yield True, run
        return
    if len(records) != 1 or not records[0].is_dir():
        raise ParameterError("`follow`: give one folder, whose new files are read")
    for file in streams.followed(records[0], _complain):
        try:
            yield from ((True, run) for run in streams.of_files(model, [file], **read))
        except DataError as error:
            # the next file may be right
            _complain(str(error))


def _complain(text: str) -> None:
    print(f"gpi: {escape(text)}", file=sys.stderr)


def _proposal(changed: bool, records: Sequence[Path]) -> dict[str, str] | None:
    if not changed:
        return None
    record = "RECORD" if records == [Path("-")] or records[-1].is_dir() else str(records[-1])
    return {
        "why": "A model of the machine as it is now follows from a record since the change",
        "command": f"gpi identify {record} -o model",
    }

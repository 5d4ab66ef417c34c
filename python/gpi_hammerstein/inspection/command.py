"""The command to run next."""

import shlex
from collections.abc import Mapping, Sequence
from typing import Any

from gpi_hammerstein.inspection.excitation import Excitation
from gpi_hammerstein.inspection.identifiable import Answer

# Duration of a proposed experiment in s: long enough for each kind, and short enough to be handled.
SECONDS = {"triangle": 60.0, "multisine": 20.0, "steps": 600.0}
# Largest number of samples of a proposed experiment.
MOST_SAMPLES = 1e6
# Periods of a triangle of decreasing amplitude.
PERIODS = 20
# Part of half the sampling rate up to which a multisine is proposed.
TOP = 0.4


def command(name: str, files: Sequence[str], options: Mapping[str, Any], *more: str) -> str:
    """Return a command of the command line.

    Parameters
    ----------
    name
        The command.
    files
        The files of the record.
    options
        The options that have to be repeated so that the record is read in the same way; None and False are
        left out.
    more
        Further words.

    Examples
    --------
    >>> command("report", ["my run.csv"], {"rate": 100.0, "input": ["u", "v"]})
    "gpi report 'my run.csv' --rate 100 --input u --input v"
    """
    words = ["gpi", name, *files]
    for option, value in options.items():
        if value is None or value is False:
            continue
        for one in value if isinstance(value, list | tuple) else [value]:
            text = "auto" if one is True else f"{one:.10g}" if isinstance(one, float) else str(one)
            words += [f"--{option}", text]
        if value == [] and option == "covariate":
            words += ["--covariate", "none"]
    return shlex.join([*words, *more])


def experiment(answers: Sequence[Answer], found: Excitation, rate: float, unit: str) -> dict[str, str] | None:
    """Return the experiment that would determine most of what the record does not.

    Parameters
    ----------
    answers
        What can be determined.
    found
        The excitation by the first input, whose range is kept.
    rate
        Sampling rate in Hz.
    unit
        The unit of the input.

    Returns
    -------
    dict
        ``why`` and ``command``; None if nothing is missing that another drive would show.

    Examples
    --------
    >>> from gpi_hammerstein.inspection.excitation import Excitation
    >>> once = Excitation(0.0, 10.0, (1.0, 1.0), 1, 10.0, 1, 1.0, 0.0, None)
    >>> experiment([Answer("hysteresis", "no", "", "triangle")], once, 1000.0, "V")["command"]
    'gpi excite triangle --rate 1000 --duration 60 --frequency 0.3333 --range 0,10 --unit V -o next.csv'
    """
    missing = [answer for answer in answers if answer.experiment and answer.possible != "yes"]
    if not missing:
        return None
    worst = next((answer for answer in missing if answer.possible == "no"), missing[0])
    kind = worst.experiment
    seconds = min(SECONDS[kind], MOST_SAMPLES / rate)
    words = ["gpi", "excite", kind, "--rate", f"{rate:.10g}", "--duration", f"{seconds:.6g}"]
    if kind == "triangle":
        words += ["--frequency", f"{PERIODS / seconds:.4g}"]
    if kind == "multisine":
        words += ["--band", f"{2 / seconds:.4g},{TOP * 0.5 * rate:.4g}"]
    low, high = (found.low, found.high) if found.span() > 0 else (0.0, 1.0)
    words += ["--range", f"{low:.4g},{high:.4g}"]
    if unit.isalnum():
        words += ["--unit", unit]
    same = [answer.what for answer in missing if answer.experiment == kind]
    return {"why": f"for {'; '.join(same)}", "command": shlex.join([*words, "-o", "next.csv"])}

"""Write the answers of `explain` on the blind records. The project does not have the labels of these records.

The records are in `blind/exam` of the data folder (`GPI_DATA_DIR`, else `../shared`). An answer contains the
effects in the order in which they were added, the verdict, the error before and after, the noise floor, and
the run time.
"""

import argparse
import json
import sys
import time
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "python" / "tests"))

import gpi_hammerstein as gpi  # noqa: E402
from data_folder import EXAM  # noqa: E402
from gpi_hammerstein.files import write_atomically  # noqa: E402

ANSWERS = Path(__file__).resolve().parents[1] / "docs" / "blind-exam.json"
SUFFIX = ".csv.gz"
DIGITS = 4
PROCESSES = 2


def answer(name: str) -> dict[str, Any]:
    """Explain one record; a rejection of the record is also an answer."""
    begin = time.perf_counter()
    try:
        found = gpi.explain(gpi.read_record(EXAM / f"{name}{SUFFIX}"))
    except gpi.GpiError as refusal:
        return {"refused": str(refusal), "seconds": time.perf_counter() - begin}
    explanation = found.to_dict()
    return {
        "effects": explanation["effects"],
        "verdict": explanation["verdict"],
        "rms": {
            when: {part: figures["rms"] for part, figures in errors.items()}
            for when, errors in explanation["error"].items()
        },
        "noise_floor": {key: explanation["noise_floor"][key] for key in ("rms", "how")},
        "seconds": time.perf_counter() - begin,
    }


def rounded(value: Any) -> Any:
    """Return the same value with floats rounded to 4 significant digits."""
    if isinstance(value, Mapping):
        return {key: rounded(item) for key, item in value.items()}
    if isinstance(value, list):
        return [rounded(item) for item in value]
    return float(f"{value:.{DIGITS}g}") if isinstance(value, float) else value


def examine(names: list[str]) -> dict[str, Any]:
    """Explain the records and return their answers, sorted by name; progress is printed on stderr."""
    answers = {}
    with ProcessPoolExecutor(PROCESSES) as pool:
        jobs = {pool.submit(answer, name): name for name in names}
        for job in as_completed(jobs):
            found = answers[jobs[job]] = rounded(job.result())
            said = ", ".join(found["effects"]) or "none" if "effects" in found else found["refused"]
            print(f"{jobs[job]}: {said}, {found['seconds']} s", file=sys.stderr, flush=True)
    return {
        "schema": "gpi-blind-exam/1",
        "version": gpi.__version__,
        "records": dict(sorted(answers.items())),
    }


def main() -> None:
    """Explain all records, or only those that are named, and write the answers."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--only", nargs="+", metavar="RECORD", help="explain only these records, and print their answers"
    )
    arguments = parser.parse_args()
    names = sorted(path.name.removesuffix(SUFFIX) for path in EXAM.glob(f"*{SUFFIX}"))
    if not names:
        raise SystemExit(f"no blind records in {EXAM}: set GPI_DATA_DIR")
    unknown = sorted(set(arguments.only or []) - set(names))
    if unknown:
        raise SystemExit(f"not among {names[0]} to {names[-1]}: {', '.join(unknown)}")
    text = json.dumps(examine(arguments.only or names), indent=2) + "\n"
    if arguments.only:
        print(text, end="")
    else:
        ANSWERS.parent.mkdir(exist_ok=True)
        write_atomically(ANSWERS, text)


if __name__ == "__main__":
    main()

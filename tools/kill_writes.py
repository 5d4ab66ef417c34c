"""Kill processes while they write a folder of results, and count the folders that are damaged.

A run writes a folder of several files again and again, each time with a new generation number in every file,
and is killed by SIGKILL at a random moment. Then the folder must have the files of exactly one generation,
and files of the user that were in it. After one more run, nothing temporary may be left beside it or in it.
Two kinds of runs are killed:

- the functions of the package that write, in a process that does nothing else;
- the command `gpi validate`, which writes pictures and JSON.
"""

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from _typeshed import TraceFunction

FILES = 8
BYTES = 20_000
# A note of the user, which no run may change.
FOREIGN = {"note.txt": "mine", "more/note.txt": "mine too"}


@dataclass
class Count:
    """What was seen after the kills."""

    kills: int = 0
    mixed: int = 0
    lost: int = 0
    left: int = 0
    temporary_before: int = 0

    def __str__(self) -> str:
        """Return the counts as one line."""
        return (
            f"{self.kills} kills: {self.mixed} mixed folders, {self.lost} folders without the user's files, "
            f"{self.left} temporary files or folders after the next run "
            f"({self.temporary_before} kills had left some for it)"
        )


def write_generation(out: Path, generation: int) -> None:
    """Write one generation of files, each of which contains its number."""
    from gpi_hammerstein.files import staged

    with staged(out) as folder:
        for index in range(FILES):
            line = f"{generation}\n"
            (folder / f"file{index}.txt").write_text(line * (BYTES // len(line)))


def generations(out: Path) -> set[str]:
    """Return the generations of the files in a folder; an incomplete folder has the generation `part`."""
    files = [out / f"file{index}.txt" for index in range(FILES)]
    found = {line for file in files if file.exists() for line in file.read_text().splitlines()}
    complete = all(file.exists() for file in files) or not any(file.exists() for file in files)
    return found if complete else found | {"part"}


def leftovers(out: Path) -> list[Path]:
    """Return the temporary files and folders beside and in a folder."""
    return [*out.parent.glob(".*"), *out.rglob(".*")]


def make_foreign(out: Path) -> None:
    """Create the files of the user."""
    for name, text in FOREIGN.items():
        (out / name).parent.mkdir(parents=True, exist_ok=True)
        (out / name).write_text(text)


def foreign_is_there(out: Path) -> bool:
    """Return whether the files of the user are unchanged."""
    return all((out / name).is_file() and (out / name).read_text() == text for name, text in FOREIGN.items())


def kill_writers(kills: int, seed: int) -> Count:
    """Kill a process that writes generation after generation, at random moments."""
    chance, count = random.Random(seed), Count()
    with tempfile.TemporaryDirectory() as place:
        out = Path(place) / "out"
        make_foreign(out)
        write_generation(out, 0)
        for number in range(kills):
            child = os.fork()
            if child == 0:
                for step in range(1_000_000):
                    write_generation(out, 1_000_000 * (number + 1) + step)
                os._exit(0)
            # Some writes are over before the kill.
            time.sleep(chance.uniform(0.001, 0.06))
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
            count.kills += 1
            count.mixed += len(generations(out)) != 1
            count.lost += not foreign_is_there(out)
            count.temporary_before += bool(leftovers(out))
            write_generation(out, number)
            count.left += len(leftovers(out))
    return count


def kill_command(kills: int, seed: int) -> Count:
    """Kill `gpi validate` at random moments, mostly around the end of its work, when it writes."""
    chance, count = random.Random(seed), Count()
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        out = folder / "out"
        make_foreign(out)
        model, record = make_inputs(folder)

        def arguments(skip: int) -> list[str]:
            # The skipped time is stored in validation.json and changes the pictures.
            words = ["validate", str(model), str(record), "--skip", f"{skip / 1000}", "-o", str(out)]
            return [sys.executable, "-c", "from gpi_hammerstein_launcher import main; main()", *words]

        began = time.monotonic()
        quiet(arguments(1))
        seconds = time.monotonic() - began
        sample = snapshot(out)
        known = {json.dumps(sample)}
        for number in range(kills):
            child = subprocess.Popen(arguments(1 + number % 2), stdout=subprocess.DEVNULL)
            with suppress(subprocess.TimeoutExpired):
                child.wait(chance.uniform(0.5, 1.05) * seconds)
            child.kill()
            child.wait()
            count.kills += 1
            seen = json.dumps(snapshot(out))
            count.temporary_before += bool(leftovers(out))
            count.lost += not foreign_is_there(out)
            quiet(arguments(1 + number % 2))
            count.left += len(leftovers(out))
            known.add(json.dumps(snapshot(out)))
            # A whole generation, of this run or of the one before: the same run always writes the same files.
            count.mixed += seen not in known
    return count


def make_inputs(folder: Path) -> tuple[Path, Path]:
    """Write a small model and the record that it is of."""
    import numpy as np

    import gpi_hammerstein as gpi

    u = gpi.multisine(400, 1000.0, (5.0, 400.0), (0.0, 10.0))
    y = gpi.PlayBank([0.0, 2.0], [1.0, 0.5])(u)
    model = gpi.identify(gpi.Record(u, y, 1000.0), delay=0, half_widths=[0.0, 2.0], thresholds=0)
    gpi.save(model, folder / "model.json")
    table = np.column_stack([np.arange(len(u)) / 1000.0, u, y])
    np.savetxt(folder / "record.csv", table, delimiter=",", header="t_s,u_V,y_um", comments="")
    return folder / "model.json", folder / "record.csv"


def snapshot(out: Path) -> dict[str, str]:
    """Return the content of the results in a folder."""
    files = sorted(file for file in out.iterdir() if file.is_file() and file.name not in FOREIGN)
    return {file.name: file.read_bytes().hex() for file in files}


def quiet(arguments: list[str]) -> None:
    """Run a command to its end."""
    subprocess.run(arguments, check=True, stdout=subprocess.DEVNULL)


def kill_at_every_line(write: Callable[[], None], check: Callable[[int], None], stride: int = 1) -> int:
    """Kill `write` before the first, second, .. line of the package's writing functions; check after each
    kill.

    Every change of the file system is made in a line of these functions or of `shutil`, and both are counted.

    Parameters
    ----------
    write
        The work of the process that is killed.
    check
        Is called with the number of the line after each kill.
    stride
        Kill only before every line whose number is a multiple of this number.

    Returns
    -------
    int
        The number of kills.
    """
    watched = (os.sep + os.path.join("gpi_hammerstein", "files") + os.sep, os.sep + "shutil.py")
    kills = 0
    for number in range(stride, 1_000_000, stride):
        child = os.fork()
        if child == 0:
            seen = 0

            def trace(
                frame: FrameType, event: str, _: object, number: int = number
            ) -> "TraceFunction | None":
                nonlocal seen
                code = frame.f_code
                # The search for processes in the folder has many lines and changes nothing.
                if code.co_name == "_is_current" or not any(part in code.co_filename for part in watched):
                    return None
                if event == "line":
                    seen += 1
                    if seen == number:
                        os.kill(os.getpid(), signal.SIGKILL)
                return trace

            sys.settrace(trace)
            write()
            os._exit(0)
        _, status = os.waitpid(child, 0)
        check(number)
        if not os.WIFSIGNALED(status):
            if os.waitstatus_to_exitcode(status):
                raise SystemExit(f"the run that was not killed failed at line {number}")
            return kills
        kills += 1
    raise SystemExit("the work does not end")


def main() -> int:
    """Print the counts; return 1 if a folder was damaged or something was left."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=200, help="kills of the writing functions")
    parser.add_argument("--commands", type=int, default=20, help="kills of the whole command")
    parser.add_argument("--seed", type=int, default=0)
    chosen = parser.parse_args()
    writers = kill_writers(chosen.kills, chosen.seed)
    print(f"writing functions: {writers}", flush=True)
    commands = kill_command(chosen.commands, chosen.seed)
    print(f"gpi validate: {commands}")
    return int(any((one.mixed, one.lost, one.left) != (0, 0, 0) for one in (writers, commands)))


if __name__ == "__main__":
    sys.exit(main())

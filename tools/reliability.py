"""Attack the package with hostile files and killed runs, and write the counts to docs/reliability.md.

Each part is a command of its own, which this one runs with a new seed: the mutated model files and states of
`crates/gpi-core/tests/hostile_models.rs`, the mutated records of `tools/fuzz_readers.py`, and the killed
writes of `tools/kill_writes.py`. The exit code is 1 if one of them fails. `tools/reliability_page.md` is the
text of the page.
"""

import argparse
import os
import subprocess
import sys
import time
from pathlib import Path

from gpi_hammerstein.files import write_atomically

ROOT = Path(__file__).resolve().parents[1]

PAGE = ROOT / "tools" / "reliability_page.md"


def run(command: list[str], **environment: str) -> tuple[bool, str]:
    """Run a command in the project's folder; return whether it succeeded, and what it printed."""
    print("$", *command, flush=True)
    done = subprocess.run(
        command,
        cwd=ROOT,
        env={**os.environ, **environment},
        stdout=subprocess.PIPE,
        text=True,
        check=False,
    )
    print(done.stdout, flush=True)
    return done.returncode == 0, done.stdout


def counts(printed: str) -> str:
    """Return the lines of the test of models that contain counts."""
    lines = [line.rstrip() for line in printed.splitlines()]
    return "\n".join(line for line in lines if line[:9].strip().isdigit())


def main() -> None:
    """Run all parts, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--models", type=int, default=1_000_000, help="number of mutated models")
    parser.add_argument("--records", type=int, default=100_000, help="number of mutated records")
    parser.add_argument("--kills", type=int, default=200, help="number of killed writes")
    parser.add_argument("--seed", type=int, default=int(time.time()), help="seed of all parts")
    parser.add_argument(
        "--markdown",
        type=Path,
        metavar="FILE",
        help="file to write the page to, for example docs/reliability.md",
    )
    arguments = parser.parse_args()
    seed = str(arguments.seed)
    test = ["cargo", "test", "--release", "-p", "gpi-core", "--test", "hostile_models", "--", "--nocapture"]
    models, of_models = run(test, GPI_HOSTILE_MODELS=str(arguments.models), GPI_HOSTILE_SEED=seed)
    fuzz = [sys.executable, "tools/fuzz_readers.py", "--number", str(arguments.records), "--seed", seed]
    records, of_records = run(fuzz)
    kills, of_kills = run([sys.executable, "tools/kill_writes.py", "--kills", str(arguments.kills)])
    if arguments.markdown is not None:
        page = PAGE.read_text(encoding="utf-8").format(
            date=time.strftime("%Y-%m-%d"),
            seed=seed,
            models=counts(of_models),
            records=of_records.strip(),
            kills=of_kills.strip(),
        )
        write_atomically(arguments.markdown, page)
    sys.exit(0 if models and records and kills else 1)


if __name__ == "__main__":
    main()

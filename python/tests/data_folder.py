"""Where measured and blind records are, which are not part of the project.

`GPI_DATA_DIR` names the folder that holds `measured` and `blind`; without it `../shared` beside the project
is tried. Tests that need them are skipped where there are none, and say so.
"""

import os
from pathlib import Path

import pytest

DATA = Path(os.environ.get("GPI_DATA_DIR") or Path(__file__).resolve().parents[3] / "shared")
MEASURED = DATA / "measured"
DEV, EXAM, FOREIGN = (DATA / "blind" / name for name in ("dev", "exam", "foreign"))

needs_measured = pytest.mark.skipif(
    not MEASURED.is_dir(), reason=f"NO MEASURED RECORDS in {DATA}: set GPI_DATA_DIR to run these tests"
)

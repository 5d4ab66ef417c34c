"""Draw the picture of README: the residual of a measured piezo stack before and after.

It needs the measured data. Run it from the root of the project: `python tools/readme_picture.py`.
"""

import os
import sys
from pathlib import Path

import matplotlib

matplotlib.use("agg")

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "python" / "tests"))

import matplotlib.pyplot as plt  # noqa: E402

import gpi_hammerstein as gpi  # noqa: E402
from data_folder import DATA  # noqa: E402

PICTURE = ROOT / "docs" / "images" / "before-and-after.png"


def main() -> None:
    """Explain the full-scale record and draw the residual."""
    os.environ["GPI_DATA_DIR"] = str(DATA)
    found = gpi.explain(gpi.datasets.load("piezo-p885-dbo"))
    ax = gpi.plot.residual_in_time(found)
    ax.set_title(f"Measured piezo stack: {', '.join(found.effects)} found and added (grey: held out)")
    ax.set_ylim(-0.9, 0.9)
    PICTURE.parent.mkdir(exist_ok=True)
    ax.figure.savefig(PICTURE, dpi=110)
    plt.close(ax.figure)
    before, after = (when["holdout"]["rms"] for when in (found.before, found.after))
    print(f"held out {before:.4f} -> {after:.4f} um rms; drawn to {PICTURE.relative_to(ROOT)}")


if __name__ == "__main__":
    main()

"""Draw the picture of README: the residual of the demo record before and after effects were added.

Run it from the root of the project: `python tools/readme_picture.py`.
"""

from importlib.resources import as_file, files
from pathlib import Path

import matplotlib

matplotlib.use("agg")

import matplotlib.pyplot as plt  # noqa: E402

import gpi_hammerstein as gpi  # noqa: E402

ROOT = Path(__file__).resolve().parents[1]
PICTURE = ROOT / "docs" / "images" / "before-and-after.png"


def main() -> None:
    """Explain the demo record, and draw the residual over time and its spectrum."""
    with as_file(files("gpi_hammerstein") / "data" / "demo.csv.gz") as record:
        found = gpi.explain(gpi.read_record(record))
    fig, (left, right) = plt.subplots(1, 2, figsize=(11, 3.6), width_ratios=(3, 2), layout="constrained")
    gpi.plot.residual_in_time(found, left).set_title("Error of the model over time (grey: held out)")
    gpi.plot.residual_spectrum(found, right).set_title("Its spectrum")
    PICTURE.parent.mkdir(exist_ok=True)
    fig.savefig(PICTURE, dpi=110)
    plt.close(fig)
    before, after = (when["holdout"]["rms"] for when in (found.before, found.after))
    print(f"held out {before:.4f} -> {after:.4f} um rms; drawn to {PICTURE.relative_to(ROOT)}")


if __name__ == "__main__":
    main()

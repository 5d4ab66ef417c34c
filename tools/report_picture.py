"""Draw the picture of docs/howto/report.md: the first screen of the report on the demo record.

It needs Chromium and its driver. Run it from the root of the project: `python tools/report_picture.py`.
"""

import sys
import tempfile
from importlib.resources import as_file, files
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "python" / "tests"))

import gpi_hammerstein as gpi  # noqa: E402
from browser import opened  # noqa: E402

PICTURE = ROOT / "docs" / "images" / "report.png"
WIDTH, HEIGHT = 1200, 865


def main() -> None:
    """Explain the record, open the report, and keep the first screen."""
    with as_file(files("gpi_hammerstein") / "data" / "demo.csv.gz") as record:
        found = gpi.explain(gpi.read_record(record))
    with tempfile.TemporaryDirectory() as folder:
        page = Path(folder) / "report.html"
        found.report(page)
        with opened(page, Path(folder), WIDTH, HEIGHT) as driver:
            driver.execute_script("document.documentElement.style.overflow = 'hidden'")  # no scroll bar
            driver.save_screenshot(str(PICTURE))
    print(f"drawn to {PICTURE.relative_to(ROOT)}")


if __name__ == "__main__":
    main()

"""Run the notebooks of the documentation, and write their outputs into the files.

Every viewer then shows the outputs. A notebook also contains a digest of the code that made them. A test
fails if the code was changed afterwards. The tutorial needs the measured data. Run it from the root of the
project: `make notebooks`.
"""

import hashlib
import os
import sys
import tempfile
from pathlib import Path

import nbclient
import nbformat

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "python" / "tests"))

from data_folder import DATA  # noqa: E402

DOCS = ROOT / "docs"
SECONDS = 300
KERNEL = {"display_name": "Python 3", "language": "python", "name": "python3"}


def digest(notebook: nbformat.NotebookNode) -> str:
    """Return the SHA-256 of the code of a notebook."""
    code = [cell.source for cell in notebook.cells if cell.cell_type == "code"]
    return hashlib.sha256("\0".join(code).encode()).hexdigest()


def run(notebook: nbformat.NotebookNode, folder: Path) -> None:
    """Run a notebook in a folder. An error in a cell is an error here."""
    resources = {"metadata": {"path": str(folder)}}
    client = nbclient.NotebookClient(
        notebook, timeout=SECONDS, kernel_name="python3", resources=resources, record_timing=False
    )
    client.execute()


def main() -> None:
    """Run all notebooks and write them."""
    os.environ["GPI_DATA_DIR"] = str(DATA)
    for path in sorted(DOCS.rglob("*.ipynb")):
        notebook = nbformat.read(path, 4)
        with tempfile.TemporaryDirectory() as folder:
            run(notebook, Path(folder))
        notebook.metadata = {
            "kernelspec": KERNEL,
            "language_info": {"name": "python"},
            "gpi_hammerstein": {"code_sha256": digest(notebook)},
        }
        nbformat.write(notebook, path)
        print(f"{path.relative_to(ROOT)}: {path.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()

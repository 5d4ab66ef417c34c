"""Documentation pages that run: tutorial, how-to pages, notebooks, and the code of README."""

import os
import re
import subprocess
import sys
from importlib.resources import files
from pathlib import Path
from typing import Any

import matplotlib
import nbclient
import nbformat
import polars as pl
import pytest
from myst_nb.core.read import read_myst_markdown_notebook

import gpi_hammerstein as gpi
from data_folder import DATA, MEASURED

matplotlib.use("agg")

import matplotlib.pyplot as plt  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
PAGES = sorted(
    page
    for page in [*DOCS.rglob("*.md"), *DOCS.rglob("*.ipynb")]
    if page.suffix == ".ipynb" or "file_format: mystnb" in page.read_text(encoding="utf-8")
)
# The command and the interpreter of this environment come first, and Matplotlib opens no window.
ENVIRONMENT = {
    **os.environ,
    "PATH": os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")]),
    "GPI_DATA_DIR": str(DATA),
    "MPLBACKEND": "agg",
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name, value in ENVIRONMENT.items():
        monkeypatch.setenv(name, value)
    # in the notebooks pictures are drawn inline
    monkeypatch.delenv("MPLBACKEND")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_there_are_pages() -> None:
    names = {page.stem for page in PAGES}
    assert {"tutorial", "gaps", "experiments", "excitation", "effects", "microcontroller"} <= names
    assert sum(page.suffix == ".ipynb" for page in PAGES) >= 3


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES, ids=[page.stem for page in PAGES])
def test_a_page_runs_from_top_to_bottom(page: Path, folder: Path) -> None:
    text = page.read_text(encoding="utf-8")
    if "datasets.load" in text and not MEASURED.is_dir():
        pytest.skip(f"NO MEASURED RECORDS in {DATA}: set GPI_DATA_DIR to run this page")
    notebook = nbformat.reads(text, 4) if page.suffix == ".ipynb" else read_myst_markdown_notebook(text)
    resources = {"metadata": {"path": str(folder)}}
    nbclient.NotebookClient(notebook, timeout=300, kernel_name="python3", resources=resources).execute()
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    assert outputs, "a page that shows nothing"


def blocks(text: str) -> list[tuple[str, str]]:
    """Languages and texts of the fenced blocks of a page."""
    return re.findall(r"^```(\w+)\n(.*?)^```$", text, flags=re.DOTALL | re.MULTILINE)


@pytest.mark.slow
def test_the_code_of_readme_runs(folder: Path) -> None:
    """In the order of the page, on the record of the demonstration under the names that README uses."""
    demo = files("gpi_hammerstein") / "data" / "demo.csv.gz"
    frame = pl.read_csv(demo).head(5000)  # enough to run, quicker than the whole
    frame.write_csv("record.csv")
    frame.write_csv("other.csv")
    frame.select(pl.col("t_s"), (pl.col("y_um") * 0.5 + 20.0).alias("y_um")).head(3000).write_csv("path.csv")
    ran = {"sh": 0, "python": 0}
    names: dict[str, Any] = {}
    for language, code in blocks((ROOT / "README.md").read_text(encoding="utf-8")):
        if language == "python":
            exec(compile(code, "README.md", "exec"), names)
            ran["python"] += 1
        # what sets the package up is run by whoever runs this
        for line in code.splitlines() if language == "sh" else []:
            if line.startswith("gpi "):
                result = subprocess.run(
                    line, shell=True, env=ENVIRONMENT, capture_output=True, text=True, check=False
                )
                assert result.returncode == 0, f"{line}\n{result.stdout}{result.stderr}"
                ran["sh"] += 1
    plt.close("all")
    assert ran["sh"] >= 8 and ran["python"] >= 4
    assert isinstance(names["found"], gpi.Explanation)
    assert Path("report.html").is_file() and Path("explained/report.html").is_file()


def cited(text: str) -> set[str]:
    """Equations of the page on theory that a text names, such as (T4) or (E6)."""
    return set(re.findall(r"\(([TE]\d+)\)", text))


def test_every_equation_that_is_cited_is_in_the_theory() -> None:
    theory = (DOCS / "theory.md").read_text(encoding="utf-8")
    there = set(re.findall(r"\\tag\{(\w+)\}", theory)) | cited(theory)
    sources = [*(ROOT / "crates").rglob("*.rs"), *(ROOT / "python" / "gpi_hammerstein").rglob("*.py")]
    used = set().union(*(cited(source.read_text(encoding="utf-8")) for source in sources))
    assert used <= there, f"not in docs/theory.md: {sorted(used - there)}"
    assert len(used) >= 15, "docstrings cite the theory"
    assert {f"`{name}`" for name in gpi.effect_names()} <= set(re.findall(r"`[a-z-]+`", theory))


def test_the_site_builds_without_a_warning(tmp_path: Path) -> None:
    call = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-D", "nb_execution_mode=off"]
    result = subprocess.run(
        [*call, str(DOCS), str(tmp_path / "site")],
        env=ENVIRONMENT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == 0, result.stderr
    reference = (tmp_path / "site" / "reference" / "index.html").read_text(encoding="utf-8")
    assert all(f"gpi_hammerstein.{name}" in reference for name in ("PlayBank", "identify", "explain"))

"""Documentation pages that run: tutorial, how-to pages, notebooks, and the code of README."""

import importlib
import os
import re
import subprocess
import sys
from importlib.resources import files
from pathlib import Path
from typing import Any

import matplotlib
import nbformat
import numpy as np
import polars as pl
import pytest
from myst_nb.core.read import read_myst_markdown_notebook

import gpi_hammerstein as gpi
from browser import complaints, needs_browser, opened
from data_folder import DATA, MEASURED
from run_notebooks import digest, run

matplotlib.use("agg")

import matplotlib.pyplot as plt  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
PAGES = sorted(
    page
    for page in [*DOCS.rglob("*.md"), *DOCS.rglob("*.ipynb")]
    if page.suffix == ".ipynb" or "file_format: mystnb" in page.read_text(encoding="utf-8")
)
NOTEBOOKS = [page for page in PAGES if page.suffix == ".ipynb"]
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?")
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
    assert len(NOTEBOOKS) >= 4


def texts(notebook: nbformat.NotebookNode) -> list[str]:
    """What each cell of a notebook prints, without pictures."""
    outputs = [cell.get("outputs", []) for cell in notebook.cells]
    return [
        "".join(one.get("text", one.get("data", {}).get("text/plain", "")) for one in cell)
        for cell in outputs
    ]


@pytest.mark.parametrize("page", NOTEBOOKS, ids=[page.stem for page in NOTEBOOKS])
def test_a_notebook_shows_the_outputs_of_its_code(page: Path) -> None:
    notebook = nbformat.read(page, 4)
    stored = notebook.metadata["gpi_hammerstein"]["code_sha256"]
    assert stored == digest(notebook), "the code was changed: run `make notebooks`"
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    assert "error" not in {output.output_type for output in outputs}
    assert sum("image/png" in output.get("data", {}) for output in outputs) >= 2
    assert sum(bool(text) for text in texts(notebook)) >= 5


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES, ids=[page.stem for page in PAGES])
def test_a_page_runs_from_top_to_bottom(page: Path, folder: Path) -> None:
    text = page.read_text(encoding="utf-8")
    if "datasets.load" in text and not MEASURED.is_dir():
        pytest.skip(f"NO MEASURED RECORDS in {DATA}: set GPI_DATA_DIR to run this page")
    notebook = nbformat.reads(text, 4) if page.suffix == ".ipynb" else read_myst_markdown_notebook(text)
    stored = texts(notebook)
    run(notebook, folder)
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    assert outputs, "a page that shows nothing"
    if page in NOTEBOOKS:
        for old, new in zip(stored, texts(notebook), strict=True):
            assert NUMBER.sub("#", new) == NUMBER.sub("#", old), "other results: run `make notebooks`"
            # another processor rounds in another way
            numbers = [np.array(NUMBER.findall(text), float) for text in (new, old)]
            np.testing.assert_allclose(*numbers, rtol=0.05, atol=2e-3)


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


def test_pieces_of_an_output_are_joined_within_words(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(DOCS))
    joined = importlib.import_module("streams").joined
    pieces = [("stdout", "Writt"), ("stderr", "a note\n"), ("stdout", "en: model.json\n")]
    outputs = [nbformat.v4.new_output("stream", name=name, text=text) for name, text in pieces]
    told = {output["name"]: output["text"] for output in joined(outputs)}
    assert told == {"stdout": "Written: model.json\n", "stderr": "a note\n"}


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site without the outputs of pages that are not notebooks. A warning is an error."""
    folder = tmp_path_factory.mktemp("site")
    call = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-D", "nb_execution_mode=off"]
    result = subprocess.run(
        [*call, "-d", str(folder / "doctrees"), str(DOCS), str(folder / "html")],
        env=ENVIRONMENT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == 0, result.stderr
    return folder / "html"


@pytest.mark.xdist_group("site")
def test_the_site_has_every_public_name_and_links_to_its_source(site: Path) -> None:
    reference = (site / "reference" / "index.html").read_text(encoding="utf-8")
    assert all(f"gpi_hammerstein.{name}" in reference for name in ("PlayBank", "identify", "explain"))
    assert "_modules/gpi_hammerstein/plot/residuals.html#residual_spectrum" in reference


def test_the_pictures_of_a_page_are_links_to_the_code_that_draws_them(tmp_path: Path) -> None:
    """A small page with the extension of the gallery, because the real page takes long to run."""
    page = "# Page\n\n:::{container} gallery\nAll.\n:::\n\n## First\n\n![a](a.png)\n\n## Second\n\ntext\n"
    (tmp_path / "index.md").write_text(page, encoding="utf-8")
    (tmp_path / "a.png").write_bytes((DOCS / "images" / "report.png").read_bytes())
    conf = f"""import sys; sys.path.insert(0, {str(DOCS)!r})
extensions = ["myst_parser", "gallery"]
myst_enable_extensions = ["colon_fence"]
"""
    (tmp_path / "conf.py").write_text(conf, encoding="utf-8")
    call = [sys.executable, "-m", "sphinx", "-q", "-W", str(tmp_path), str(tmp_path / "html")]
    result = subprocess.run(call, env=ENVIRONMENT, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
    html = (tmp_path / "html" / "index.html").read_text(encoding="utf-8")
    (gallery,) = re.findall(r'<div class="thumbnails.*?</div>', html, flags=re.DOTALL)
    assert re.findall(r'href="(#[^"]*)"', gallery) == ["#first"]
    assert "<img" in gallery and "First" in gallery


@needs_browser
@pytest.mark.xdist_group("site")
@pytest.mark.parametrize("width", [1400, 390])
def test_formulas_are_typeset_without_a_network_and_nothing_is_wider_than_the_page(
    site: Path, width: int, tmp_path: Path
) -> None:
    ask = """
        const done = arguments[arguments.length - 1];
        MathJax.startup.promise.then(() => done({
            formulas: document.querySelectorAll("mjx-container svg").length,
            wrong: document.querySelectorAll("mjx-merror, [data-mml-node=merror]").length,
            raw: document.querySelector("article").innerText.includes("\\\\hat"),
            wide: document.documentElement.scrollWidth - innerWidth,
        }))"""
    # a browser that resolves no name: all that it shows is in the folder
    with opened(site / "theory.html", tmp_path, width, network=False) as driver:
        driver.set_script_timeout(30)
        seen = driver.execute_async_script(ask)
        assert seen["formulas"] > 100 and seen["wrong"] == 0 and not seen["raw"]
        assert seen["wide"] <= 0
        assert complaints(driver) == []
        for page in ("index.html", "comparison.html", "real-records.html", "howto/report.html"):
            driver.get((site / page).as_uri())
            assert driver.execute_script("return document.documentElement.scrollWidth - innerWidth") <= 0, (
                page
            )
        assert complaints(driver) == []

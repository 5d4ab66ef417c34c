"""The page of a report: whole, self-contained, and rendered by a browser without complaint."""

import re
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree

import matplotlib.image
import numpy as np
import pytest

import gpi_hammerstein as gpi
from gpi_hammerstein import cli
from gpi_hammerstein.report import notebook, report_html
from gpi_hammerstein.report.quality import facts
from records import RATE, actuator, drive, good_columns, write_csv

BROWSER = shutil.which("chromium") or shutil.which("google-chrome")
needs_browser = pytest.mark.skipif(BROWSER is None, reason="NO chromium: the report is not rendered")
PICTURES = 10


@pytest.fixture(scope="module")
def found():
    u = drive()
    y = actuator(u) + 0.05 * np.sin(2 * np.pi * 50.3 * np.arange(len(u)) / RATE)
    channels = {
        "input_names": ["u<1>"],
        "input_units": ["V"],
        "output_names": ["y & z"],
        "output_units": ["µm"],
    }
    return gpi.explain(gpi.Record(u, y, RATE, **channels))


@pytest.fixture(scope="module")
def page(found):
    return report_html(found, command="gpi report 'a<b>.csv'", notes=["resampled & cut"])


class Tags(HTMLParser):
    """Checks that tags are closed in order, and collects what is linked."""

    VOID = {"meta", "link", "br", "img", "hr", "input"}

    def __init__(self):
        super().__init__()
        self.open, self.links, self.text = [], [], []

    def handle_starttag(self, tag, attributes):
        self.links += [value for name, value in attributes if name in ("src", "href", "xlink:href") and value]
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.links += [value for name, value in attributes if name in ("src", "href", "xlink:href") and value]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)


def test_the_page_is_whole_and_needs_nothing_else(page):
    tags = Tags()
    tags.feed(page)
    assert tags.open == []
    assert all(link.startswith(("#", "data:")) for link in tags.links)
    assert not re.search(r"url\((?!#|data:)|@import|fetch\(|XMLHttp", page)
    assert "$" not in page


def test_the_page_says_what_was_found(found, page):
    tags = Tags()
    tags.feed(page)
    text = " ".join(tags.text)
    assert found.effects == ["periodic-disturbance"] and found.verdict == "explained"
    for said in (
        "The model lacked periodic-disturbance",
        "Explained: the residual has no structure beyond noise.",
        f"{found.before['holdout']['rms']:.4g}",
        f"{found.after['holdout']['rms']:.4g}",
        f"{found.steps[1]['parameters'][0]['value']:.5g}",
        "whiteness",
        "damping",
        "1000 Hz",
        "u<1> → y & z",
        "rms [µm]",
        "gpi report 'a<b>.csv'",
        "resampled & cut",
        gpi.__version__,
    ):
        assert said in text, said


def test_pictures_are_drawn_and_do_not_share_names(page):
    pictures = re.findall(r"<svg.*?</svg>", page, flags=re.DOTALL)
    assert len(pictures) == PICTURES
    names = []
    for svg in pictures:
        tree = ElementTree.fromstring(svg)
        assert "viewBox" in tree.attrib and "height" not in tree.attrib
        clips = {clip.attrib["id"] for clip in tree.iter("{http://www.w3.org/2000/svg}clipPath")}
        assert set(re.findall(r"url\(#([^)]*)\)", svg)) <= clips
        names += clips
        # black is the page's own
        assert "currentColor" in svg and not re.search("#000000|#0a0b0c", svg)
    assert len(names) == len(set(names))


def test_the_same_explanation_gives_the_same_page(found, page):
    assert report_html(found, command="gpi report 'a<b>.csv'", notes=["resampled & cut"]) == page


def rendered(tmp_path, page, *options, script=""):
    """What a browser makes of a page: its title after a script has run, complaints, the screen."""
    file, shot = tmp_path / "page.html", tmp_path / "shot.png"
    file.write_text(page.replace("</body>", f"<script>{script}</script></body>"), encoding="utf-8")
    command = [BROWSER, "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", *options]
    command += ["--enable-logging=stderr", "--virtual-time-budget=5000"]
    command += [f"--user-data-dir={tmp_path / 'user'}"]

    def run(what):
        words = [*command, what, file.as_uri()]
        return subprocess.run(words, capture_output=True, text=True, check=True, timeout=120)

    dom = run("--dump-dom")
    run(f"--screenshot={shot}")
    title = re.search("<title>(.*?)</title>", dom.stdout)[1]
    complaints = [line for line in dom.stderr.splitlines() if "CONSOLE" in line]
    return title, complaints, matplotlib.image.imread(shot)[:, :, :3]


SIZES = 'document.title = document.documentElement.scrollWidth + " " + window.innerWidth;'


@needs_browser
@pytest.mark.slow
@pytest.mark.parametrize("width", [1400, 500])
def test_a_browser_renders_it_without_complaint(tmp_path, page, width):
    title, complaints, screen = rendered(tmp_path, page, f"--window-size={width},2000", script=SIZES)
    assert complaints == []
    wide, window = map(int, title.split())
    assert wide <= window
    # a light page with pictures on it
    assert np.mean(screen > 0.95) > 0.6
    assert len(np.unique((screen * 15).astype(int).reshape(-1, 3), axis=0)) > 50


@needs_browser
@pytest.mark.slow
def test_in_the_dark_it_is_dark(tmp_path, page):
    dark = "--blink-settings=preferredColorScheme=0"
    _, complaints, screen = rendered(tmp_path, page, "--window-size=1400,2000", dark)
    assert complaints == []
    assert np.mean(screen < 0.2) > 0.6
    assert np.mean(screen.min(axis=2) > 0.6) > 0.005  # text


ENLARGE = """
(() => {
const small = document.querySelectorAll("button.open")[2];
small.click();
const big = dialog.querySelector("svg"), before = big.getAttribute("viewBox");
const at = { clientX: 300, clientY: 300, bubbles: true, cancelable: true };
big.dispatchEvent(new WheelEvent("wheel", { ...at, deltaY: -500 }));
const zoomed = big.getAttribute("viewBox");
big.dispatchEvent(new PointerEvent("pointerdown", { ...at, pointerId: 1 }));
big.dispatchEvent(new PointerEvent("pointermove", { ...at, clientX: 350, pointerId: 1 }));
const moved = big.getAttribute("viewBox");
big.dispatchEvent(new PointerEvent("pointerup", { ...at, pointerId: 1 }));
big.dispatchEvent(new MouseEvent("dblclick", at));
const home = big.getAttribute("viewBox");
const open = dialog.open;
dialog.querySelector(".close").click();
document.title = [open, dialog.open, before === home, zoomed, moved].join(";");
})();
"""


@needs_browser
@pytest.mark.slow
def test_pictures_enlarge_zoom_and_move(tmp_path, page):
    title, complaints, _ = rendered(tmp_path, page, script=ENLARGE)
    assert complaints == []
    was_open, is_open, is_home, zoomed, moved = title.split(";")
    assert (was_open, is_open, is_home) == ("true", "false", "true")
    zoomed, moved = (np.array(box.split(), dtype=float) for box in (zoomed, moved))
    width = float(re.search(r'viewBox="0 0 ([\d.]+)', page)[1])
    assert zoomed[2] != width and moved[0] < zoomed[0] and moved[1] == zoomed[1]


def test_the_record_speaks_of_itself():
    k = np.arange(1000)
    u = np.clip(np.round(np.sin(2 * np.pi * 5 * k / 1000), 1), -0.8, 0.8)
    said = dict(facts(gpi.Record(u, np.sin(k), 1000.0, input_units=["V"], warmup=10)))
    assert said["samples"] == "1000 (1 s)" and said["not scored, at the start"] == "10 samples"
    assert "-0.8 to 0.8 V, steps of 0.1 V" in said["u"]
    assert "% of the samples at the lowest value" in said["u"] and "highest" in said["u"]
    assert "below 5 Hz" in said["excitation by u"]
    still = dict(facts(gpi.Record(np.ones(50), np.sin(k[:50]), 1000.0)))
    assert still["excitation by u"] == "none: the input is constant"


def test_notebooks_show_tables(found):
    assert "periodic-disturbance" in found._repr_html_() and "<table>" in found._repr_html_()
    assert "linear part" in found.model._repr_html_() and "damping" in found.model._repr_html_()
    assert "1000 Hz" in found.record._repr_html_()
    assert notebook.record(found.record) == found.record._repr_html_()


def test_the_command_writes_a_page(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_csv(Path("run.csv"), good_columns())
    assert cli.run(["report", "run.csv", "--effects", "none", "-o", "own.html"]) == 0
    assert "Written: own.html" in capsys.readouterr().out
    page = Path("own.html").read_text(encoding="utf-8")
    assert "gpi report run.csv --effects none -o own.html" in page
    assert cli.run(["report", "run.csv", "--effects", "none", "-o", "missing/own.html"]) == 2
    assert "cannot be written" in capsys.readouterr().err


def test_explain_writes_the_page_beside_the_rest(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_csv(Path("run.csv"), good_columns())
    assert cli.run(["explain", "run.csv", "--effects", "none", "--report"]) == 2
    assert "name the folder" in capsys.readouterr().err
    assert cli.run(["explain", "run.csv", "--effects", "none", "--report", "-o", "out", "--json"]) == 0
    assert '"report.html"' in capsys.readouterr().out
    assert "</html>" in Path("out/report.html").read_text(encoding="utf-8")


def test_an_explanation_writes_itself(tmp_path, found):
    found.report(tmp_path / "own.html", command="by hand")
    assert "by hand" in (tmp_path / "own.html").read_text(encoding="utf-8")
    with pytest.raises(gpi.ParameterError, match="cannot be written"):
        found.report(tmp_path / "missing" / "own.html")

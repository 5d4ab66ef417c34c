"""The page of a report: whole, self-contained, and rendered by a browser without complaint."""

import base64
import hashlib
import json
import re
from html.parser import HTMLParser
from importlib.resources import files
from pathlib import Path
from types import SimpleNamespace
from xml.etree import ElementTree

import numpy as np
import pytest

import gpi_hammerstein as gpi
from gpi_hammerstein import cli
from gpi_hammerstein.explanation import to_dict
from gpi_hammerstein.report import notebook, packing, provenance, report_html, series
from gpi_hammerstein.report.components import components
from gpi_hammerstein.report.curves import classes
from gpi_hammerstein.report.data import span
from gpi_hammerstein.report.quality import facts
from records import RATE, actuator, drive, good_columns, write_csv

# One process, so that what they share is made once.
pytestmark = pytest.mark.xdist_group("report")

# One loop of the record and one of the model, and three pictures of the linear part.
PICTURES = 5
VENDOR = files("gpi_hammerstein.report") / "vendor"


@pytest.fixture(scope="session")
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


COMMAND = {"command": "gpi report 'a<b>.csv'", "notes": ["resampled & cut"], "model_file": "my model.json"}


@pytest.fixture(scope="session")
def page(found):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SOURCE_DATE_EPOCH", "1700000000")
        return report_html(found, **COMMAND)


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
    assert not re.search(r"url\((?!#|data:)|@import|fetch\(|XMLHttp|WebSocket|eval\(|new Function", page)
    # no attribute has styles or code, which the policy forbids
    body = re.sub(r"<(script|style)[^>]*>.*?</\1>", "", page, flags=re.DOTALL)
    assert not re.search(r"<[^>]*\s(style|on\w+)=", body) and "$" not in body
    assert len(page.encode()) < 2_000_000


def test_the_policy_permits_one_script_and_one_style_sheet(page):
    [rules] = re.findall(r'http-equiv="Content-Security-Policy" content="([^"]*)"', page)
    rules = dict(rule.split(" ", 1) for rule in rules.split("; "))
    assert rules["default-src"] == "'none'" and rules["img-src"] == "data:"
    for tag in ("script", "style"):
        [text] = re.findall(f"<{tag}>(.*?)</{tag}>", page, flags=re.DOTALL)
        digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
        assert rules[f"{tag}-src"] == f"'sha256-{digest}'"


def test_the_page_says_what_was_found(found, page):
    tags = Tags()
    tags.feed(page)
    text = " ".join(tags.text)
    assert found.effects == ["periodic-disturbance"] and found.verdict == "explained"
    for said in (
        "The model lacked periodic-disturbance",
        "The residual has no structure beyond noise.",
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
        "2023-11-14 22:13 UTC",
        provenance.data_hash(found.record),
        "gpi validate 'my model.json' OTHER.csv",
        f"All {len(found.model.refinement.parameters)} parameters",
        "times smaller error",
        "The residual passes",
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


def test_the_same_explanation_gives_the_same_page(found, page, monkeypatch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    assert report_html(found, **COMMAND) == page


def unpacked(stored):
    kind = {"i2": "<i2", "f4": "<f4"}[stored["kind"]]
    return stored["offset"] + stored["step"] * np.frombuffer(base64.b64decode(stored["data"]), kind).astype(
        float
    )


@pytest.mark.parametrize(("size", "scale"), [(2, 1e-12), (4, 1e-12), (2, 1.0), (4, 1.0), (2, 1e300)])
def test_packed_samples_are_rounded_to_half_a_step(size, scale):
    values = scale * np.random.default_rng(0).standard_normal(500)
    stored = packing.packed(values, size)
    step = np.ptp(values) / (2 * packing.LARGEST) if size == 2 else np.abs(values).max() * 2.0**-23
    assert np.abs(unpacked(stored) - values).max() <= 0.501 * step
    assert (unpacked(packing.packed(np.full(3, 2.5 * scale), size)) == 2.5 * scale).all()


def test_fine_residuals_need_more_bytes():
    values = np.linspace(0.0, 1.0, 100)
    assert packing.bytes_of(values, 1e-3) == 2 and packing.bytes_of(values, 1e-6) == 4
    assert packing.bytes_of(1e39 * values, 1e-6) == 2


def test_all_samples_are_in_the_page(found, page):
    [text] = re.findall(r'<script type="application/json" id="samples">(.*?)</script>', page, flags=re.DOTALL)
    data = json.loads(text)
    assert "<" not in text and data["inputs"] == [{"name": "u<1>", "unit": "V"}]
    [part] = data["experiments"][0]["parts"]
    own = {name: unpacked(stored) for name, stored in part["signals"].items()}
    fine = 1e-4 * np.ptp(found.record.y[0])
    assert part["every"] == 1 and own["measured0"] == pytest.approx(found.record.y[0][:, 0], abs=fine)
    assert own["errorAfter0"] == pytest.approx(found.residuals_after[0][:, 0], abs=fine)


def test_groups_keep_every_extreme(found):
    """If the samples do not fit, the extremes of each group and the largest error are stored."""
    errors = series.Errors(found)
    groups, window = series.parts(errors, 8_000)[0]
    every, samples = groups["every"], len(found.record.y[0])
    after = (found.record.y[0] - found.residuals_after[0])[:, 0]
    for name, values in (("measured0", found.record.y[0][:, 0]), ("after0", after)):
        low, high = map(unpacked, groups["signals"][name])
        for k in range(len(low)):
            own = values[k * every : (k + 1) * every]
            assert (low[k], high[k]) == pytest.approx((own.min(), own.max()), abs=1e-3)
    assert len(low) == -(-samples // every) and window["every"] == 1
    first, last = errors.largest(0, 0)
    assert window["first"] <= (first + last) // 2 <= window["last"]
    stored = sum(len(base64.b64decode(one["data"])) for pair in groups["signals"].values() for one in pair)
    stored += sum(len(base64.b64decode(one["data"])) for one in window["signals"].values())
    assert stored <= 8_000


def test_the_largest_error_is_found_and_wrong_samples_are_not():
    class Found:
        record = gpi.Record(np.arange(4000.0), np.zeros(4000), 10.0, warmup=100)
        warmups, held_out = [100], [[(0, 4000)]]
        residuals_before = residuals_after = [np.zeros((4000, 1))]
        wrong_samples = [{"experiment": 0, "output": "y", "row": 3000}]

    error = Found.residuals_after[0]
    error[:100], error[3000], error[1500:1510] = 50.0, 90.0, 1.0
    Found.wrong_samples[0]["output"] = Found.record.output_names[0]
    errors = series.Errors(Found)
    first, last = errors.largest(0, 0)
    assert first <= 1500 and last >= 1510 and last - first == series.SHORTEST_DETAIL
    assert errors.half_band(0) == 0.0


def test_the_prediction_band_covers(found):
    """For errors of one distribution, the band covers a new error with 95 %, on average over the records."""
    random = np.random.default_rng(5)
    covered = []
    for _ in range(400):

        class Found:
            record = gpi.Record(np.arange(60.0), np.zeros(60), 10.0)
            warmups, held_out, wrong_samples = [0], [[(10, 49)]], []
            residuals_before = residuals_after = [random.standard_cauchy((60, 1))]

        covered.append(np.mean(np.abs(random.standard_cauchy(200)) <= series.Errors(Found).half_band(0)))
    # 39 errors: the largest but one of the 40 places, 38/40
    assert np.mean(covered) == pytest.approx(0.95, abs=0.01)


def test_components_add_up(found):
    [one] = components(found, series.Errors(found))
    steps = to_dict(found)["steps"]
    assert one.effect == "periodic-disturbance" and one.evidence > 1
    assert one.share == pytest.approx(1 - (steps[1]["train_rms"] / steps[0]["train_rms"]) ** 2)
    # the hum of amplitude 0.05 is all that was added
    assert one.size[0] == pytest.approx(0.05 / np.sqrt(2), rel=0.1)


def test_classes_are_means_and_quantiles():
    x = np.repeat(np.arange(40.0), 100)
    error = x + np.tile(np.arange(100.0), 40)
    own = classes(x, [error, -error])
    mean, low, high = own["errors"][0]
    middle = np.array([error[x == value].mean() for value in range(1, 39)])
    assert mean[1:-1] == pytest.approx(middle, abs=1.5) and len(own["x"]) == 40
    assert np.subtract(high, low)[1:-1] == pytest.approx(0.9 * 99, abs=0.5)
    assert classes(np.ones(500), [error[:500]] * 2) is None


def test_the_hash_is_that_of_the_samples():
    record = gpi.Record(
        *([np.array(one) for one in side] for side in ([[1.0, 2.0], [3.0]], [[4.0, 5.0], [6.0]])), 10.0
    )
    bytes_ = np.array([1.0, 2.0, 4.0, 5.0, 3.0, 6.0], dtype="<f8").tobytes()
    assert provenance.data_hash(record) == hashlib.sha256(bytes_).hexdigest()


def test_the_library_in_the_page_is_the_named_one():
    assert f"(v{provenance.UPLOT})" in (VENDOR / "uPlot.iife.min.js").read_text("utf-8")[:100]
    assert provenance.UPLOT in (VENDOR / "README.md").read_text("utf-8")
    assert "MIT License" in (VENDOR / "LICENSE").read_text("utf-8")


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


def test_simulated_samples_that_are_not_scored_do_not_stretch_the_axis():
    y = np.array([[1.0], [2.0], [3.0], [2.0]])
    errors = SimpleNamespace(
        record=SimpleNamespace(y=[y]),
        before=[np.array([[900.0], [0.0], [-0.5], [0.0]])],
        after=[np.array([[-900.0], [0.25], [0.0], [1.5]])],
        scored=lambda experiment, output: np.array([False, True, True, True]),
    )
    assert span(errors, 0, 0) == [0.5, 3.5]


def test_the_command_writes_a_page(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_csv(Path("run.csv"), good_columns())
    assert cli.run(["report", "run.csv", "--effects", "none", "-o", "own.html"]) == 0
    assert "Written: own.html, own.model.json" in capsys.readouterr().out
    page = Path("own.html").read_text(encoding="utf-8")
    assert "gpi report run.csv --effects none -o own.html" in page and "gpi validate own.model.json" in page
    # nothing has to run again
    assert cli.run(["validate", "own.model.json", "run.csv"]) == 0
    assert cli.run(["report", "run.csv", "--effects", "none"]) == 0
    assert gpi.load("model.json").to_json() == gpi.load("own.model.json").to_json()
    capsys.readouterr()
    assert cli.run(["report", "run.csv", "--effects", "none", "-o", "missing/own.html"]) == 2
    assert "cannot be written" in capsys.readouterr().err


def test_explain_writes_the_page_beside_the_rest(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_csv(Path("run.csv"), good_columns())
    assert cli.run(["explain", "run.csv", "--effects", "none", "--report"]) == 2
    assert "name the folder" in capsys.readouterr().err
    assert cli.run(["explain", "run.csv", "--effects", "none", "--report", "-o", "out", "--json"]) == 0
    assert '"report.html"' in capsys.readouterr().out
    page = Path("out/report.html").read_text(encoding="utf-8")
    assert "</html>" in page and "gpi validate model.json" in page and Path("out/model.json").exists()


def test_an_explanation_writes_itself(tmp_path, found):
    found.report(tmp_path / "own.html", command="by hand")
    assert "by hand" in (tmp_path / "own.html").read_text(encoding="utf-8")
    with pytest.raises(gpi.ParameterError, match="cannot be written"):
        found.report(tmp_path / "missing" / "own.html")

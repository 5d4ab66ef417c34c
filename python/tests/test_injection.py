"""Names and units that try to become source code, HTML, a terminal command, a formula or a cell."""

import base64
import csv
import hashlib
import io
import json
import re
import shutil
import subprocess

import numpy as np
import pytest
from matplotlib.figure import Figure

import gpi_hammerstein as gpi
from data_folder import DATA
from gpi_hammerstein import cli, escaping, plot
from gpi_hammerstein.report.policy import policy
from test_compensator import creeping, path

CASES = DATA / "cases" / "inject"
REFUSED = {
    "newline": "um\n",
    "code behind a newline": "*/\n__attribute__((constructor)) static void p(void) {}\n/*",
    "Rust behind a newline": "V\npub fn pwned() { std::process::exit(42) }\n//",
    "carriage return": "V\rpub fn pwned() {}",
    "include": 'V */\n#include "/etc/passwd"\n/*',
    "NUL": "V\0",
    "title of the terminal": "\x1b]0;title\x07\x1b[2J",
    "control sequence of one byte": "\x9b2J",
    "tab": "\t=1+1",
    "right to left": "\u202e */ evil",
    "isolate": "\u2066x\u2069",
    "line separator": "a\u2028b",
    "length": "u" * 100_000,
}
HONEST = {
    "end of a comment": "*/ __attribute__((constructor)) static void pwned(void) { } /*",
    "begin and end": "/*/ int pwned_symbol; /*/",
    "stars": "**//**//",
    "star at the end": "x*",
    "slash at the beginning": "/x",
    "backslash": "u\\",
    "trigraph": "u??/",
    "many question marks": "*??/??/",
    "HTML": "<script>alert(1)</script>",
    "HTML out of a title": "</title></style><img src=x onerror=alert(2)>",
    "attribute": "\" onmouseover='alert(1)'",
    "template": "$name ${x} $$ %s%n {0} {x!r}",
    "formula of TeX": "$\\frac$",
    "formulas of TeX": "$x$ and \\$y$",
    "formula": '=HYPERLINK("http://evil","u")',
    "formula with a sign": "-1+1",
    "formula with an at": "@SUM(1)",
    "cells": 'u,"x";y',
    "markup": "[bold red]X[/]",
    "end of no markup": "[/nope]",
    "other scripts": "位 β² µm °C",
    "beyond the basic plane": "😀",
}
needs_c = pytest.mark.skipif(shutil.which("cc") is None, reason="NO C COMPILER: exported C is not compiled")
needs_rust = pytest.mark.skipif(
    shutil.which("rustc") is None, reason="NO RUSTC: exported Rust is not compiled"
)


def file_of(text):
    """A model file in which all names and units are this text."""
    parts = json.loads(creeping().to_json())
    for side in ("inputs", "outputs"):
        parts[side] = [{"name": text, "unit": text}]
    return json.dumps(parts)


def record_of(text):
    u = np.random.default_rng(1).normal(size=200)
    own = {f"{side}_{what}": [text] for side in ("input", "output") for what in ("names", "units")}
    return gpi.Record(u, u, 1000.0, **own)


@pytest.mark.parametrize("text", REFUSED.values(), ids=REFUSED)
def test_no_honest_name_is_refused(text):
    with pytest.raises(gpi.DataError, match=r"the text at `inputs\[0\].name`") as refused:
        gpi.Model.from_json(file_of(text))
    with pytest.raises(gpi.DataError, match="the name"):
        record_of(text)
    said = str(refused.value)
    assert said.isprintable() and len(said) < 400
    for side in ("covariate_names", "input_units"):
        own = {"covariates": np.zeros((9, 1)), side: [text]}
        with pytest.raises(gpi.DataError, match="the name|the unit"):
            gpi.Record(np.arange(9.0), np.arange(9.0), 1.0, **own)


def test_half_a_surrogate_pair_is_refused():
    with pytest.raises(gpi.DataError, match="surrogate"):
        record_of("u\ud800")
    with pytest.raises(gpi.DataError, match="hex escape"):
        gpi.Model.from_json(file_of("u\ud800"))


@pytest.mark.parametrize("place", ["label", "status"])
def test_texts_deep_in_a_model_file_are_checked(place):
    parts = json.loads(creeping().to_json())
    parts["effects"][0][place] = "\x1b[2J"
    with pytest.raises(gpi.DataError, match=r"U\+001B"):
        gpi.Model.from_json(json.dumps(parts))


def in_c(folder, model):
    """The exported C without comments, as the preprocessor sees it; its symbols are checked."""
    gpi.export_c(model, folder, name="own")
    flags = ["-std=c99", "-trigraphs", "-Wall", "-Wextra", "-Werror"]
    subprocess.run(["cc", *flags, "-c", "-o", folder / "own.o", folder / "own.c"], check=True)
    listed = subprocess.run(
        ["nm", "-f", "posix", folder / "own.o"], capture_output=True, text=True, check=True
    )
    assert {line.split()[0] for line in listed.stdout.splitlines() if " T " in line} == {
        "own_start",
        "own_step",
    }
    assert "pwned" not in listed.stdout
    seen = subprocess.run(
        ["cc", *flags, "-E", "-P", folder / "own.c"], capture_output=True, text=True, check=True
    )
    return seen.stdout


def in_rust(folder, model):
    """The exported Rust without comments; it is compiled, and its documentation has no HTML of its own."""
    folder.mkdir(exist_ok=True)
    gpi.export_rust(model, folder / "own.rs")
    build = ["rustc", "--edition", "2024", "-D", "warnings", "--crate-type", "lib", "--out-dir", folder]
    subprocess.run([*build, folder / "own.rs"], check=True)
    lines = (folder / "own.rs").read_text(encoding="utf-8").splitlines()
    comments = [line for line in lines if line.lstrip().startswith("//")]
    assert not any(re.search(r"(?<!\\)<[a-z/]", line) for line in comments)
    return [line for line in lines if line not in comments]


@needs_c
@pytest.mark.parametrize("text", HONEST.values(), ids=HONEST)
def test_c_has_the_code_of_a_plain_model(tmp_path, text):
    plain = in_c(tmp_path / "plain", gpi.Model.from_json(file_of("u")))
    assert in_c(tmp_path / "own", gpi.Model.from_json(file_of(text))) == plain


@needs_rust
@pytest.mark.parametrize("text", HONEST.values(), ids=HONEST)
def test_rust_has_the_code_of_a_plain_model(tmp_path, text):
    plain = in_rust(tmp_path / "plain", gpi.Model.from_json(file_of("u")))
    assert in_rust(tmp_path / "own", gpi.Model.from_json(file_of(text))) == plain


def headers(file):
    return next(csv.reader(io.StringIO(file.read_text(encoding="utf-8"))))


@pytest.mark.parametrize("text", HONEST.values(), ids=HONEST)
@pytest.mark.filterwarnings("ignore:Glyph")
def test_a_drive_has_cells_and_no_formula(tmp_path, capsys, text):
    (tmp_path / "model.json").write_text(file_of(text), encoding="utf-8")
    rows = "\n".join(f"{0.001 * k:.3f},{value!r}" for k, value in enumerate(path(300).tolist()))
    (tmp_path / "wanted.csv").write_text(f"t_s,reference\n{rows}\n")
    arguments = ["compensate", str(tmp_path / "model.json"), str(tmp_path / "wanted.csv")]
    assert cli.run([*arguments, "-o", str(tmp_path / "out"), "--limits=-9,9"]) == 0
    own, said = headers(tmp_path / "out" / "drive.csv"), capsys.readouterr()
    assert own[:2] == ["t", escaping.in_cell(text)] and f"predicted_{text}" in own
    assert not any(cell.startswith(("=", "+", "-", "@", "\t")) for cell in own)
    # the terminal shows the name as it is
    assert f"The range of {text} is" in said.out.replace("\n", " ")


@pytest.mark.parametrize("text", HONEST.values(), ids=HONEST)
@pytest.mark.filterwarnings("ignore:Glyph")
def test_pictures_show_names_as_they_are(text):
    record = record_of(text)
    figure = Figure()
    ax = figure.add_subplot()
    plot.record(record, ax)
    buffer = io.StringIO()
    import matplotlib as mpl

    with mpl.rc_context({"svg.fonttype": "none"}):
        figure.savefig(buffer, format="svg")
    shown = re.findall(r"<text[^>]*>([^<]*)</text>", buffer.getvalue())
    from html import unescape

    assert any(unescape(one) == f"{text} [{text}]" for one in shown), shown


@pytest.mark.filterwarnings("ignore:Glyph")
def test_a_report_contains_only_its_own_elements(tmp_path):
    """Its elements are those of a report with plain names, and its policy permits its own script only."""
    rng = np.random.default_rng(3)
    u = gpi.multisine(1200, 1000.0, (0.5, 300.0), (0.0, 10.0), seed=3)
    y = gpi.PlayBank([0.0, 1.0], [1.0, 0.5])(u) + 0.01 * rng.standard_normal(len(u))

    def page(text):
        own = {f"{side}_{what}": [text] for side in ("input", "output") for what in ("names", "units")}
        found = gpi.explain(gpi.Record(u, y, 1000.0, **own), order=1, half_widths=[0.0, 1.0], effects=[])
        return gpi.report.report_html(found, command=text, notes=[text])

    def elements(html):
        return re.findall(r"<(/?[a-zA-Z!][a-zA-Z-]*)", html)

    def parts(html):
        """The elements of the page, and the kinds of elements of its pictures (their ticks vary)."""
        page = re.sub(r"<svg.*?</svg>", "", html, flags=re.DOTALL)
        pictures = re.findall(r"<svg.*?</svg>", html, flags=re.DOTALL)
        return elements(page), set(elements("".join(pictures)))

    hostile = page("</title></style><script>alert(1)</script>\"'$x$ &amp; ${title}")
    assert parts(hostile) == parts(page("plain"))
    scripts = re.findall(r"<script>(.*?)</script>", hostile, flags=re.DOTALL)
    digest = base64.b64encode(hashlib.sha256(scripts[0].encode()).digest()).decode()
    assert len(scripts) == 1 and f"script-src 'sha256-{digest}'" in hostile
    [style] = re.findall(r"<style>(.*?)</style>", hostile, flags=re.DOTALL)
    assert policy(scripts[0], style) in hostile and "default-src 'none'" in hostile
    # the policy is read before anything that it forbids
    assert hostile.index("Content-Security-Policy") < hostile.index("<title")


def test_messages_do_not_command_the_terminal(tmp_path, capsys):
    file = tmp_path / "\x1b[2J.csv"
    assert cli.run(["identify", str(file)]) in (2, 3)
    said = capsys.readouterr()
    assert "\x1b" not in said.err + said.out and r"\x1b[2J" in said.err


@pytest.mark.skipif(not CASES.is_dir(), reason=f"NO CASES in {CASES}: set GPI_DATA_DIR to run these tests")
@needs_c
@needs_rust
@pytest.mark.filterwarnings("ignore:Glyph")
def test_every_case_is_refused_or_harmless(tmp_path, capsys):
    plain = {}
    refused, harmless = [], []
    for number, file in enumerate(sorted(CASES.iterdir())):
        folder = tmp_path / str(number)
        folder.mkdir()
        try:
            if file.suffix == ".json":
                model = gpi.load(file)
            else:
                record = gpi.read_record(file)
                model = gpi.identify(record, order=1, delay=0, half_widths=[0.0, 0.5], thresholds=0)
                figure = Figure()
                plot.record(record, figure.add_subplot())
                figure.savefig(folder / "picture.png")
                capsys.readouterr()
                cli.run(["identify", str(file), "-o", str(folder / "out")])
                said = capsys.readouterr()
                assert "\x1b" not in said.out + said.err
        except gpi.GpiError as error:
            assert "\x1b" not in str(error)
            refused.append(file.name)
            continue
        # the same model with plain names has the same code
        parts = json.loads(model.to_json())
        for side in ("inputs", "outputs"):
            parts[side] = [{"name": "a", "unit": "b"}]
        plain = gpi.Model.from_json(json.dumps(parts))
        assert in_c(folder / "c", model) == in_c(folder / "plain", plain)
        assert in_rust(folder / "rust", model) == in_rust(folder / "plain", plain)
        harmless.append(file.name)
    assert len(refused) + len(harmless) == len(list(CASES.iterdir())) > 0
    for name in ("bidi.json", "c_newline.json", "csvout_nl.json", "include.json", "rustnl.json", "esc.csv"):
        assert name in refused

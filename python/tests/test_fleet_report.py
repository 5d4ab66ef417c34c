"""The page of a fleet: the devices that stand out and why, trends, and a page that no text can change."""

import datetime
import html
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest

import gpi_hammerstein as gpi
from browser import complaints, needs_browser, opened
from fleets import SPREAD, size, table, usual, with_defects
from gpi_hammerstein.cli import run
from gpi_hammerstein.fleet import row
from gpi_hammerstein.fleet.devices import fleet_of
from gpi_hammerstein.fleet.distances import FALSE_SHARE, distances, false_discovery
from gpi_hammerstein.fleet.reading import is_fleet, read_fleet
from gpi_hammerstein.fleet.robust import orthogonalized, tau
from gpi_hammerstein.fleet.scatter import Scatter, tail_of
from test_report import Tags

HOSTILE = "</script><script>alert(1)</script>\"'&<img src=x onerror=alert(2)>\u202e\x1b[2J"


def written(rows: list[dict[str, Any]], folder: Path, version: str = row.VERSION) -> Path:
    """Write the table of a batch as `gpi batch` does."""
    file = folder / "fleet.parquet"
    table(rows).write_parquet(file, metadata={"schema": version})
    return file


def page_of(rows: list[dict[str, Any]], folder: Path) -> str:
    gpi.fleet_report(table(rows), folder / "fleet.html")
    return (folder / "fleet.html").read_text(encoding="utf-8")


def data_of(page: str) -> Any:
    [text] = re.findall(r'<script type="application/json" id="samples">(.*?)</script>', page, flags=re.DOTALL)
    assert "<" not in text
    return json.loads(text)


# The estimators


def test_tau_estimates_are_those_of_a_normal_distribution_and_ignore_a_few_wrong_values() -> None:
    x = np.random.default_rng(0).normal(3.0, 2.0, (4000, 2))
    x[:80, 1] = 1e6
    location, scale = tau(x)
    assert location == pytest.approx([3.0, 3.0], abs=0.15)
    assert scale == pytest.approx([2.0, 2.0], rel=0.06)
    assert tau(np.ones((9, 1)))[1] == 0


def test_the_covariance_is_that_of_the_usual_rows() -> None:
    random = np.random.default_rng(1)
    truth = np.array([[4.0, 1.5, 0.0], [1.5, 1.0, 0.3], [0.0, 0.3, 9.0]])
    x = random.multivariate_normal([1.0, 2.0, 3.0], truth, 3000)
    x[:300] = [40.0, -30.0, 100.0]
    found = Scatter.of(x)
    assert np.abs(found.covariance - truth).max() < 0.12 * 9
    assert found.centre == pytest.approx([1.0, 2.0, 3.0], abs=0.15)
    assert orthogonalized(x)[:300].min() > orthogonalized(x)[300:].max()


@pytest.mark.parametrize(("rows", "columns", "repetitions"), [(20, 1, 200), (50, 4, 200), (400, 4, 50)])
def test_p_values_are_calibrated(rows: int, columns: int, repetitions: int) -> None:
    random = np.random.default_rng(2)
    found = []
    for _ in range(repetitions):
        x = random.normal(size=(rows, columns))
        scatter = Scatter.of(x)
        found.append(scatter.p_values(scatter.squared(x), np.full(rows, float(columns))))
    p = np.concatenate(found)
    for level in (0.05, 0.01, 0.001):
        # four standard deviations of a count
        assert np.sum(p < level) < level * len(p) + 4 * np.sqrt(level * len(p))


def test_long_tails_are_noticed() -> None:
    random = np.random.default_rng(3)
    normal = (random.normal(size=(1000, 5)) ** 2).sum(axis=1)
    long = normal / random.chisquare(5, 1000) * 5
    assert np.isinf(tail_of(normal, 5))
    assert 3 <= tail_of(long, 5) < 15
    # a few defects are no tail
    normal[:50] = 100.0
    assert tail_of(normal, 5) > 100


def test_false_discovery_is_that_of_benjamini_and_hochberg() -> None:
    from scipy.stats import false_discovery_control

    p = np.random.default_rng(4).random(50) ** 3
    assert false_discovery(p) == pytest.approx(false_discovery_control(p))


# Devices that stand out


@pytest.mark.parametrize(("devices", "fleets"), [(50, 100), (200, 60), (1000, 30)])
def test_usual_fleets_have_no_more_false_ones_than_stated(devices: int, fleets: int) -> None:
    """In a fleet without defects, every device that stands out is false: it must happen in 1 % of fleets."""
    any_false = sum(
        bool((distances(fleet_of(table(usual(devices, seed)))).q <= FALSE_SHARE).any())
        for seed in range(fleets)
    )
    # more have a probability of 4 % at most, at the stated rate
    assert any_false <= 1 + 3 * fleets // 100


def test_long_tails_do_not_make_many_devices_unusual() -> None:
    """The tails of Student's distribution with 5 degrees of freedom: at most 2 % of the devices."""
    rows = usual(1000, 5, lambda random, shape: random.standard_t(5, shape))
    assert len(gpi.unusual_devices(table(rows))) <= 20


@pytest.mark.parametrize("seed", range(4))
def test_defects_are_found(seed: int) -> None:
    """1,000 devices of which 5 % have a defect: 95 % are found, and 2 % of what is found is false."""
    rows = usual(1000, seed)
    bad = with_defects(rows, 0.05, seed)
    found = set(gpi.unusual_devices(table(rows))["device"])
    assert len(found & bad) >= 0.95 * len(bad)
    assert len(found - bad) <= 0.02 * len(found)


def test_figures_of_six_standard_deviations_are_found() -> None:
    rows, names = usual(1000, 7), list(SPREAD)
    for device in range(50):
        rows[device][names[device % 4]] *= np.exp(-6.5 * SPREAD[names[device % 4]])
    found = set(gpi.unusual_devices(table(rows))["device"])
    assert sum(f"D{device:04}" in found for device in range(50)) >= 47
    assert sum(f"D{device:04}" not in found for device in range(50, 1000)) >= 949


def why_of(rows: list[dict[str, Any]], device: str) -> list[str]:
    found = gpi.unusual_devices(table(rows)).filter(pl.col("device") == device)
    return [] if found.is_empty() else found["why"][0].to_list()


def test_reasons_are_in_words() -> None:
    rows = usual(300, 11)
    middle = np.median([one["sensitivity"] for one in rows])
    rows[0]["sensitivity"] = 0.86 * middle
    rows[1]["effects"] = ["creep", "backlash"]
    rows[2]["verdict"], rows[2]["verdict_reason"] = "outside-class", "the output saturates"
    rows[3]["rms_after"] *= 3
    rows[4]["sensitivity"] *= -1
    assert why_of(rows, "D0000")[0].startswith("sensitivity 14 % below the fleet's median (")
    assert why_of(rows, "D0000")[0].endswith("robust standard deviations)")
    assert why_of(rows, "D0001") == ["has backlash, which no other of 300 devices has"]
    assert why_of(rows, "D0002") == [
        "the verdict is outside-class (the output saturates), which no other of 300 devices has; "
        "the fleet's is explained"
    ]
    assert "error over noise 3" in why_of(rows, "D0003")[0]
    assert "sensitivity -1." in why_of(rows, "D0004")[0]
    assert "not of the sign" in why_of(rows, "D0004")[0]


def test_an_unusual_combination_is_found() -> None:
    rows = usual(1000, 12)
    # both 2.75 standard deviations, in directions that do not occur together
    middle = {name: np.median([one[name] for one in rows]) for name in ("resonance_hz", "sensitivity")}
    rows[0]["resonance_hz"] = middle["resonance_hz"] * np.exp(2.75 * SPREAD["resonance_hz"])
    rows[0]["sensitivity"] = middle["sensitivity"] * np.exp(-2.75 * SPREAD["sensitivity"])
    [why] = why_of(rows, "D0000")
    assert re.match(r"the combination of .* is unusual \(robust distance \d", why)
    assert "resonance" in why and "sensitivity" in why


def test_a_common_effect_is_no_reason_and_noise_counts_less() -> None:
    rows = usual(200, 13)
    for one in rows[:30]:
        one["effects"] = ["creep", "drift"]
    for one in rows[30:34]:
        one["effects"] = ["creep", "outliers"]
    rows[34]["effects"] = ["creep", "coloured-noise"]
    rows[33]["effects"] = ["creep", "outliers", "backlash"]
    assert why_of(rows, "D0000") == []
    assert why_of(rows, "D0030") == []
    # it adds to another reason, and is one if almost no device has it
    assert why_of(rows, "D0033") == [
        "has backlash, which no other of 200 devices has",
        "has outliers, which 4 of 200 devices have",
    ]
    assert why_of(rows, "D0034") == ["has coloured-noise, which no other of 200 devices has"]


def test_an_uncertain_size_counts_less() -> None:
    rows = usual(100, 14)
    for device, std in ((0, 0.002), (1, 0.05)):
        rows[device]["sizes"] = [size("creep", "gain[0]", 0.12, std), rows[device]["sizes"][1]]
    assert why_of(rows, "D0000")[0].startswith("creep: gain[0] 2.")
    assert why_of(rows, "D0001") == []


def test_sizes_are_compared_if_they_mean_the_same() -> None:
    rows = usual(60, 15)
    for device, one in enumerate(rows):
        one["effects"] = ["creep", "drift", "periodic-disturbance"]
        if device % 2:
            one["sizes"] = [size("creep", f"gain[{k}]", 0.02) for k in range(2)]
        one["sizes"] += [
            size("drift", f"drift[{second:.4f} s]", value) for second, value in ((5, 0.1), (10, -0.3))
        ]
        one["sizes"] += [size("periodic-disturbance", "phase", 1.0, unit="rad")]
    figures = {one.label: one for one in fleet_of(table(rows)).figures}
    assert "drift: largest drift" in figures
    assert set(figures["drift: largest drift"].values) == {-0.3}
    assert {"creep: gain[0] (of 2 parameters)", "creep: gain[1]"} <= set(figures)
    assert not any("phase" in label for label in figures)


def test_a_device_is_judged_by_its_latest_record() -> None:
    rows = usual(60, 16)
    for date, effects in (("2026-03-02", []), ("2026-02-28T10:00", ["backlash"]), (None, ["stiffness"])):
        rows.append(rows[5] | {"date": date, "effects": effects, "file": str(date)})
    rows.append(rows[5] | {"date": "2026-05-01", "error": "broken", "verdict": None, "file": "failed"})
    fleet = fleet_of(table(rows))
    assert len(fleet.names) == 60
    assert fleet.table["file"][int(fleet.latest[5])] == "2026-03-02"
    assert why_of(rows, "D0005") == []


def test_records_with_another_unit_are_not_compared() -> None:
    rows = usual(60, 17)
    for one in rows[:5]:
        one["unit"], one["sensitivity"] = "mrad", 1e3
    assert why_of(rows, "D0000") == []
    assert "5 records have another unit than um" in fleet_of(table(rows)).notes[0]


# Trends


def dated(devices: int, dates: int, ageing: float, seed: int) -> list[dict[str, Any]]:
    """Return rows of devices that are recorded every month; the sensitivity changes by a part per month."""
    random, rows = np.random.default_rng(seed), []
    for one in usual(devices, seed):
        for month in range(dates):
            day = datetime.date(2026, 1, 1) + datetime.timedelta(days=30 * month)
            change = {
                "sensitivity": one["sensitivity"] * (1 + ageing * month + 0.001 * random.normal()),
                "resonance_hz": one["resonance_hz"] * (1 + 0.001 * random.normal()),
            }
            rows.append(one | change | {"date": day.isoformat(), "file": f"{one['file']}-{month}"})
    return rows


def test_ageing_is_a_trend_within_devices() -> None:
    found = gpi.fleet_trends(table(dated(40, 4, -0.002, 21)))
    first = found.row(0, named=True)
    assert (first["kind"], first["figure"], first["unit"]) == ("within devices", "sensitivity", "1/year")
    assert first["slope"] == pytest.approx(-0.002 * 365.25 / 30, rel=0.1)
    assert first["q"] < 1e-6
    others = found.filter(pl.col("figure") != "sensitivity")
    assert others["q"].min() > FALSE_SHARE


def test_the_trend_of_one_device_is_found_and_others_have_none() -> None:
    rows = dated(20, 12, 0.0, 22)
    for one in rows:
        if one["device"] == "D0003":
            one["sensitivity"] *= 1 - 0.004 * (int(one["date"][5:7]) + 12 * (one["date"] > "2026-12"))
    found = gpi.fleet_trends(table(rows)).filter((pl.col("kind") == "device") & (pl.col("q") <= FALSE_SHARE))
    assert found.select("device", "figure").rows() == [("D0003", "sensitivity")]


def test_fleets_without_trends_have_none() -> None:
    """Each of twenty fleets has a false trend with a probability of 2 %: of the fleet, or of a device."""
    false = sum(
        gpi.fleet_trends(table(dated(12, 5, 0.0, seed)))["q"].min() <= FALSE_SHARE for seed in range(20)
    )
    assert false <= 2


def test_the_test_within_devices_is_that_of_mann_and_kendall() -> None:
    """For one device with equal values, the p-value is that of the normal approximation of SciPy."""
    from scipy.stats import kendalltau

    from gpi_hammerstein.fleet.trends import _variance

    random = np.random.default_rng(23)
    days, values = np.arange(40.0) // 2, random.integers(0, 8, 40).astype(float)
    first, second = np.triu_indices(40, 1)
    total = (np.sign(days[second] - days[first]) * np.sign(values[second] - values[first])).sum()
    expected = kendalltau(days, values, method="asymptotic").pvalue
    from scipy.special import ndtr

    assert 2 * ndtr(-abs(total) / np.sqrt(_variance(days, values))) == pytest.approx(expected, rel=1e-9)


def test_other_dates_are_refused_with_a_note(tmp_path: Path) -> None:
    rows = usual(12, 24)
    for one, date in zip(
        rows, ["2026-03-02", "2026-03-03T10:00:00+01:00", "3/2/2026", "<b>", ""], strict=False
    ):
        one["date"] = date
    [note] = fleet_of(table(rows)).notes
    assert note.startswith("2 dates are left out") and "`3/2/2026`, `<b>`" in note
    assert html.escape(note) in page_of(rows, tmp_path)


# The page


@pytest.fixture(scope="module")
def rows() -> list[dict[str, Any]]:
    found = dated(100, 3, -0.001, 31)
    with_defects(found, 0.05, 32)
    found.append(dict.fromkeys(row.COLUMNS) | {"file": "x.csv", "name": "x", "error": "x.csv: is empty"})
    return found


def test_the_page_is_whole_and_needs_nothing_else(rows: list[dict[str, Any]], tmp_path: Path) -> None:
    page = page_of(rows, tmp_path)
    tags = Tags()
    tags.feed(page)
    assert tags.open == []
    assert all(link.startswith(("#", "data:")) for link in tags.links)
    assert not re.search(
        r"url\((?!#|data:)|@import|fetch\(|XMLHttp|WebSocket|eval\(|new Function|innerHTML", page
    )
    body = re.sub(r"<(script|style)[^>]*>.*?</\1>", "", page, flags=re.DOTALL)
    assert not re.search(r"<[^>]*\s(style|on\w+)=", body)
    text = " ".join(tags.text)
    for said in (
        "Fleet of 101 devices",
        "301 records",
        "2026-01-01 to 2026-03-02",
        "is empty",
        "within devices",
    ):
        assert said in text, said
    # the size of backlash is one more figure
    assert page.count("data-figure=") == 10 and page.count("data-dates=") >= 9


def test_the_policy_permits_one_script_and_one_style_sheet(
    rows: list[dict[str, Any]], tmp_path: Path
) -> None:
    import base64
    import hashlib

    page = page_of(rows, tmp_path)
    [policy] = re.findall(r'http-equiv="Content-Security-Policy" content="([^"]*)"', page)
    rules = dict(rule.split(" ", 1) for rule in policy.split("; "))
    assert rules["default-src"] == "'none'"
    for tag in ("script", "style"):
        [text] = re.findall(f"<{tag}>(.*?)</{tag}>", page, flags=re.DOTALL)
        digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
        assert rules[f"{tag}-src"] == f"'sha256-{digest}'"


def test_hostile_texts_are_escaped_everywhere(tmp_path: Path) -> None:
    found = usual(30, 41)
    texts = ("file", "name", "device", "date", "verdict", "verdict_reason", "unit", "rival")
    found[0] |= dict.fromkeys(texts, HOSTILE) | {"effects": [HOSTILE, "creep"]}
    for one in found:
        one["unit"] = HOSTILE
        one["sizes"] = [
            size(HOSTILE, HOSTILE, np.random.default_rng(1).normal(), unit=HOSTILE),
            *one["sizes"],
        ]
    found.append(
        dict.fromkeys(row.COLUMNS) | {"file": HOSTILE, "name": "..", "error": f"{HOSTILE}: {HOSTILE}"}
    )
    page = page_of(found, tmp_path)
    tags = Tags()
    tags.feed(page)
    assert tags.open == []
    assert "<img" not in page and "alert(1)</script>" not in page
    assert page.count("<script") == page.count("</script>") == 2
    assert "\u202e" not in page and "\x1b" not in page
    assert data_of(page)["devices"][0]["name"].startswith("</script><script>alert(1)")
    assert html.escape("</script><script>alert(1)</script>") in page


def test_links_lead_to_the_results_of_a_record(tmp_path: Path) -> None:
    found = usual(12, 42)
    records = tmp_path / "fleet" / "records"
    names = ["r0", "r1", "a b<'\"&#?%:", "../records/r0", "..", "x" * 400]
    for one, name in zip(found, names, strict=False):
        one["name"] = name
    for name, file in (("r0", "report.html"), ("r1", "explanation.json"), (names[2], "report.html")):
        (records / name).mkdir(parents=True)
        (records / name / file).write_text("{}")
    (records / "r0" / "explanation.json").write_text("{}")
    (records / "report.html").write_text("")
    gpi.fleet_report(written(found, tmp_path / "fleet"), tmp_path / "fleet.html")
    links = [one["link"] for one in data_of((tmp_path / "fleet.html").read_text())["devices"]]
    assert links[:2] == ["fleet/records/r0/report.html", "fleet/records/r1/explanation.json"]
    assert links[2] == "fleet/records/a%20b%3C%27%22%26%23%3F%25%3A/report.html"
    assert links[3:] == [None] * 9


@pytest.mark.parametrize("devices", [0, 1, 2, 9, 15])
def test_small_fleets_have_a_page(devices: int, tmp_path: Path) -> None:
    page = page_of(usual(devices, 43), tmp_path)
    tags = Tags()
    tags.feed(page)
    assert tags.open == [] and f"Fleet of {devices} device" in page
    if devices < 10:
        assert gpi.unusual_devices(table(usual(devices, 43))).is_empty()


def test_fleets_with_little_known_have_a_page(tmp_path: Path) -> None:
    failed = [
        dict.fromkeys(row.COLUMNS) | {"file": f"{k}.csv", "name": f"{k}", "error": f"/lab/{k}.csv: is empty"}
        for k in range(20)
    ]
    page = page_of(failed, tmp_path)
    assert "20 of 20 records" in page and page.count("is empty") == 1
    sparse = usual(40, 44)
    random = np.random.default_rng(44)
    for one in sparse:
        for name in ("rms_before", "rms_after", "noise_floor", "resonance_hz", "damping", "sensitivity"):
            if random.random() < 0.4:
                one[name] = random.choice([None, np.nan, np.inf])
        one["sizes"] = None
    assert gpi.unusual_devices(table(sparse)).is_empty()
    page_of(sparse, tmp_path)
    equal = [one | {name: 1.0 for name in SPREAD} for one in usual(40, 45)]
    equal[0]["resonance_hz"] = 2.0
    assert why_of(equal, "D0000")[0].startswith("resonance 100 % above the fleet's median (")
    page_of(equal, tmp_path)


@pytest.mark.parametrize("value", [1e308, -1e308, 5e-324, 0.0, -1.0, 1e-300])
def test_strange_numbers_are_no_trouble(value: float, tmp_path: Path) -> None:
    found = usual(30, 46)
    found[0] |= {name: value for name in ("rms_before", "rms_after", "noise_floor", *SPREAD)}
    found[0]["sizes"] = [size("creep", "gain[0]", value, 1e308), *found[0]["sizes"][1:]]
    for at, one in enumerate(found[1:4]):
        one["hysteresis_width"] = value * (-1) ** at
    page = page_of(found, tmp_path)
    text = re.sub(r"<(script|style)[^>]*>.*?</\1>", "", page, flags=re.DOTALL)
    assert not re.search(r"\b(nan|inf)\b", text, flags=re.IGNORECASE)


def test_the_size_of_the_page_is_that_of_the_fleet(tmp_path: Path) -> None:
    assert len(page_of(usual(1000, 47), tmp_path).encode()) < 1_000_000


# Files and the command


def test_only_tables_of_a_batch_are_fleets(tmp_path: Path) -> None:
    file = written(usual(12, 51), tmp_path)
    assert is_fleet(file) and read_fleet(file).height == 12
    record = tmp_path / "run.parquet"
    pl.DataFrame({"t": [0.0, 1.0], "gpi-fleet/1": [1.0, 2.0]}).write_parquet(record)
    with pytest.raises(gpi.DataError, match="schema"):
        read_fleet(record)
    pl.DataFrame({"t": [0.0, 1.0]}).write_parquet(record)
    assert not is_fleet(record) and not is_fleet(tmp_path) and not is_fleet(tmp_path / "gone.parquet")
    with pytest.raises(gpi.DataError, match="no table of `gpi batch`"):
        read_fleet(record)


def test_another_version_or_another_type_is_refused(tmp_path: Path) -> None:
    with pytest.raises(gpi.DataError, match="has the schema gpi-fleet/2; this version reads gpi-fleet/1"):
        read_fleet(written(usual(12, 52), tmp_path, "gpi-fleet/2"))
    file = tmp_path / "other.parquet"
    whole = table(usual(12, 52))
    whole.with_columns(damping=pl.lit("x")).write_parquet(file, metadata={"schema": "gpi-fleet/1"})
    with pytest.raises(gpi.DataError, match="column `damping` has the type String"):
        read_fleet(file)
    with pytest.raises(gpi.ParameterError, match="column `sizes` is missing"):
        gpi.unusual_devices(whole.drop("sizes"))


def test_a_damaged_table_is_refused(tmp_path: Path) -> None:
    file = written(usual(12, 53), tmp_path)
    whole = file.read_bytes()
    random = np.random.default_rng(53)
    for _ in range(15):
        data = bytearray(whole)
        for place in random.integers(4, len(data) - 8, 8):
            data[place] = random.integers(256)
        file.write_bytes(data)
        try:
            table_read = read_fleet(file)
        except gpi.DataError as error:
            assert str(error).startswith(str(file))
            continue
        gpi.unusual_devices(table_read)
    file.write_bytes(whole[: len(whole) // 2] + whole[-200:])
    with pytest.raises(gpi.DataError):
        read_fleet(file)


def test_the_command_writes_the_page(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = usual(60, 54)
    found[3]["effects"] = ["creep", "backlash"]
    file, page = written(found, tmp_path), tmp_path / "fleet.html"
    assert run(["report", str(file), "-o", str(page)]) == 0
    shown = capsys.readouterr().out
    assert "1 devices stand out" not in shown and "1 device stands out" in shown
    assert "D0003: has backlash" in shown
    assert sorted(one.name for one in tmp_path.iterdir()) == ["fleet.html", "fleet.parquet"]
    assert "gpi report" in page.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    "option",
    [
        ["--input", "u"],
        ["--output", "y"],
        ["--time", "t"],
        ["--rate", "10"],
        ["--covariate", "none"],
        ["--resample", "auto"],
        ["--warmup", "5"],
        ["--experiments", "0"],
        ["--holdout-record", "x.csv"],
        ["--effects", "none"],
    ],
)
def test_options_of_a_record_are_refused(
    option: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = written(usual(12, 55), tmp_path)
    assert run(["report", str(file), "-o", str(tmp_path / "p.html"), *option]) == 2
    assert f"`{option[0][2:]}`: is an option of a record" in capsys.readouterr().err
    assert not (tmp_path / "p.html").exists()


def test_a_fleet_is_reported_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = written(usual(12, 56), tmp_path)
    assert run(["report", str(file), str(file), "-o", str(tmp_path / "p.html")]) == 2
    assert "is reported alone" in capsys.readouterr().err
    assert (
        run(["report", str(written(usual(12, 56), tmp_path, "gpi-fleet/9")), "-o", str(tmp_path / "p.html")])
        == 3
    )


# In a browser


@needs_browser
@pytest.mark.parametrize(("width", "dark"), [(1400, False), (390, True)])
def test_the_page_in_a_browser(rows: list[dict[str, Any]], tmp_path: Path, width: int, dark: bool) -> None:
    found = [one | {"device": HOSTILE} if one["device"] == "D0007" else one for one in rows]
    page_of(found, tmp_path)
    with opened(tmp_path / "fleet.html", tmp_path, width, dark=dark) as driver:
        ask = driver.execute_script
        assert complaints(driver) == []
        assert ask("return document.documentElement.scrollWidth") <= width
        assert ask("return document.querySelectorAll('#table tbody tr').length") == 100
        # a device is marked in every distribution and over all dates
        driver.find_element("css selector", "#unusual button.device").click()
        assert ask("return document.querySelectorAll('figure[data-figure] path.mark').length") == 9
        assert ask("return document.querySelectorAll('figure[data-dates] circle.mark').length") == 27
        chosen = ask("return document.querySelector('#chosen h2').textContent")
        assert chosen == ask("return document.querySelector('#unusual button.device').textContent")
        ask(
            "document.querySelector('circle.dot:last-of-type')"
            ".dispatchEvent(new MouseEvent('click', { bubbles: true }))"
        )
        assert ask("return document.querySelectorAll('figure[data-figure] path.mark').length") in (9, 10)
        # sorted by the resonance, falling
        ask(
            "[...document.querySelectorAll('#table th button')]"
            ".find((button) => button.textContent === 'resonance [Hz]').click()"
        )
        cells = ask(
            "return [...document.querySelectorAll('#table tbody tr')].map((r) => r.cells[8].textContent)"
        )
        values = np.array([float(one) for one in cells if one])
        assert (np.diff(values) <= 0).all() and len(values) == 100
        driver.find_element("id", "search").send_keys("alert(1)")
        assert ask("return document.querySelectorAll('#table tbody tr').length") == 1
        assert ask("return document.querySelectorAll('img').length") == 0
        assert ask("return getComputedStyle(document.body).backgroundColor") == (
            "rgb(20, 23, 26)" if dark else "rgb(255, 255, 255)"
        )
        assert complaints(driver) == []

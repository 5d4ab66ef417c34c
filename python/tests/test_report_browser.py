"""The report in a real browser: quick, zoomed, read, and fit for a phone, the dark and paper."""

import base64
import io
import re
import time

import matplotlib.image
import numpy as np
import pytest

import gpi_hammerstein as gpi
from browser import complaints, needs_browser, opened
from gpi_hammerstein.report import report_html
from gpi_hammerstein.report.series import DATA_BYTES, Errors, parts

# One process, so that the page is made once.
pytestmark = [needs_browser, pytest.mark.xdist_group("report browser")]

RATE = 1000.0
LARGEST_PAGE = 2_000_000
SECONDS = 2.0


def explained(lengths, outputs=2):
    """Some experiments of a play, with a hum that the declared model lacks; the outputs are proportional."""
    random = np.random.default_rng(3)
    us, ys = [], []
    for k, samples in enumerate(lengths):
        u = gpi.multisine(samples, RATE, (0.5, 300.0), (0.0, 10.0), seed=k)
        v = gpi.PlayBank([0.0, 1.0], [1.0, 0.5])(u)
        hum = 0.2 * np.sin(2 * np.pi * 50.3 * np.arange(samples) / RATE)
        noise = 0.02 * random.standard_normal((samples, outputs))
        us.append(u)
        ys.append(np.column_stack([(v + hum) / (1 + o) for o in range(outputs)]) + noise)
    record = gpi.Record(
        us,
        ys,
        RATE,
        input_names=["drive"],
        input_units=["V"],
        output_names=["tip", "gauge"][:outputs],
        output_units=["µm", "mV"][:outputs],
    )
    return gpi.explain(record, order=1, half_widths=[0.0, 1.0], effects=[])


@pytest.fixture(scope="session")
def found():
    return explained([3000, 4000])


@pytest.fixture(scope="session")
def file(found, tmp_path_factory):
    path = tmp_path_factory.mktemp("report") / "report.html"
    found.report(path)
    return path


@pytest.fixture
def driver(file, tmp_path):
    with opened(file, tmp_path) as own:
        yield own
        assert complaints(own) == []


def shown(driver):
    """The range of time of every linked picture."""
    script = "return group.charts.map((chart) => [chart.plot.scales.x.min, chart.plot.scales.x.max])"
    return np.array(driver.execute_script(script))


def over(driver, chart):
    return driver.find_element("css selector", f"#{chart} .u-over")


def dragged(driver, chart, start, end):
    """Drag from one part of the width of a picture to another one."""
    from selenium.webdriver import ActionChains

    area = over(driver, chart)
    driver.execute_script("arguments[0].scrollIntoView({block: 'center'})", area)
    width = area.size["width"]
    move = ActionChains(driver, duration=50)
    move.move_to_element_with_offset(area, round((start - 0.5) * width), 0).click_and_hold()
    move.move_by_offset(round((end - start) * width), 0).release().perform()


def hovered(driver, chart, place):
    """Point at a picture and return what is read, by its label."""
    from selenium.webdriver import ActionChains

    area = over(driver, chart)
    driver.execute_script("arguments[0].scrollIntoView({block: 'center'})", area)
    offset = round((place - 0.5) * area.size["width"])
    ActionChains(driver, duration=50).move_to_element_with_offset(area, offset, 0).perform()
    time.sleep(0.1)
    text = driver.execute_script("return document.getElementById('readout').textContent")
    read = re.findall(r"([a-z ]+) (-?[\d.e+-]+)(?: to (-?[\d.e+-]+))?(?: \S+)?  ", text)
    return {label.strip(): (float(low), float(high or low)) for label, low, high in read}


def test_it_is_drawn_quickly_and_without_complaint(driver):
    drawn = "const t = performance.timing; return t.loadEventEnd - t.navigationStart"
    assert driver.execute_script(drawn) < 1000 * SECONDS
    # every picture has a canvas with ink in more than one colour
    for canvas in driver.find_elements("css selector", ".chart canvas"):
        colours = driver.execute_script(
            "const c = arguments[0], d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;"
            "return new Set(new Uint32Array(d.buffer)).size",
            canvas,
        )
        assert colours > 3
    assert len(driver.find_elements("css selector", ".chart canvas")) == 8


@pytest.mark.parametrize("chart", ["chart-output", "chart-residual", "chart-inputs"])
def test_a_drag_zooms_all_linked_pictures(driver, chart):
    whole = shown(driver)
    dragged(driver, chart, 0.25, 0.5)
    zoomed = shown(driver)
    length = whole[0, 1]
    # the picture of the largest error is the second one and stays as it is
    for index in (0, 2, 3):
        assert zoomed[index] == pytest.approx([0.25 * length, 0.5 * length], abs=0.01 * length)
    assert (zoomed[1] == whole[1]).all()
    driver.find_element("id", "whole").click()
    assert (shown(driver) == whole).all()


def test_a_drag_in_the_largest_error_and_the_buttons(driver):
    before = shown(driver)
    driver.find_element("id", "largest").click()
    assert shown(driver)[0] == pytest.approx(before[1])
    driver.find_element("id", "out").click()
    assert np.ptp(shown(driver)[0]) == pytest.approx(2 * np.ptp(before[1]))
    driver.find_element("id", "in").click()
    driver.find_element("id", "right").click()
    assert shown(driver)[0].mean() != pytest.approx(before[1].mean())
    dragged(driver, "chart-detail", 0.3, 0.6)
    assert np.ptp(shown(driver)[0]) == pytest.approx(0.3 * np.ptp(before[1]), rel=0.05)


@pytest.mark.parametrize(("chart", "zoom"), [("chart-output", False), ("chart-residual", True)])
def test_hover_reads_the_record(driver, found, chart, zoom):
    if zoom:
        dragged(driver, chart, 0.5, 0.55)
    read = hovered(driver, chart, 0.6)
    sample = round(read["time"][0] * RATE)
    low, high = shown(driver)[0]
    assert sample / RATE == pytest.approx(low + 0.6 * (high - low), abs=0.01 * (high - low) + 1 / RATE)
    measured = found.record.y[0][sample, 0]
    before, after = found.residuals_before[0][sample, 0], found.residuals_after[0][sample, 0]
    truth = {
        "measured": measured,
        "before": measured - before,
        "after": measured - after,
        "residual before": before,
        "residual after": after,
        "drive": found.record.u[0][sample, 0],
    }
    for label, value in truth.items():
        assert read[label] == pytest.approx((value, value), abs=1e-3), label
    # the pointer is at the same time in the other pictures
    places = driver.execute_script(
        "return group.charts.filter((c) => !c.detail).map((c) => c.plot.posToVal(c.plot.cursor.left, 'x'))"
    )
    assert places == pytest.approx([places[0]] * 3, abs=2e-3 * (high - low))


def test_experiment_and_output_are_chosen(driver, found):
    from selenium.webdriver.support.ui import Select

    Select(driver.find_element("id", "experiment")).select_by_index(1)
    Select(driver.find_element("id", "output")).select_by_index(1)
    assert shown(driver)[0, 1] == pytest.approx((4000 - 1) / RATE)
    read = hovered(driver, "chart-output", 0.4)
    sample = round(read["time"][0] * RATE)
    assert read["measured"][0] == pytest.approx(found.record.y[1][sample, 1], abs=1e-3)
    titles = [title.text for title in driver.find_elements("css selector", ".u-title")]
    assert "Residual of gauge: measured minus simulated" in titles
    loops = driver.execute_script(
        "return [...document.querySelectorAll('figure[data-experiment]')].map((f) => f.hidden)"
    )
    assert loops == [True, False]


def test_lines_are_hidden(driver):
    button = driver.find_element("css selector", "#lines .before")
    before = driver.execute_script("return group.charts[2].plot.scales.y.max")
    button.click()
    assert button.get_attribute("aria-pressed") == "false"
    assert not driver.execute_script("return group.charts[0].plot.series[1].show")
    button.click()
    assert driver.execute_script("return group.charts[2].plot.scales.y.max") == before


def test_pictures_enlarge_zoom_and_move(driver):
    script = """
    document.querySelector("figure:not([hidden]) button.open").click();
    const big = dialog.querySelector("svg"), before = big.getAttribute("viewBox");
    const at = { clientX: 300, clientY: 300, bubbles: true, cancelable: true };
    big.dispatchEvent(new WheelEvent("wheel", { ...at, deltaY: -500 }));
    const zoomed = big.getAttribute("viewBox");
    big.dispatchEvent(new PointerEvent("pointerdown", { ...at, pointerId: 1 }));
    big.dispatchEvent(new PointerEvent("pointermove", { ...at, clientX: 350, pointerId: 1 }));
    const moved = big.getAttribute("viewBox");
    big.dispatchEvent(new PointerEvent("pointerup", { ...at, pointerId: 1 }));
    big.dispatchEvent(new MouseEvent("dblclick", at));
    const home = big.getAttribute("viewBox"), open = dialog.open;
    dialog.querySelector(".close").click();
    return [open, dialog.open, before, home, zoomed, moved];
    """
    was_open, is_open, before, home, *boxes = driver.execute_script(script)
    assert was_open and not is_open and before == home
    zoomed, moved = (np.array(box.split(), dtype=float) for box in boxes)
    assert zoomed[2] < float(before.split()[2]) and moved[0] < zoomed[0] and moved[1] == zoomed[1]


@pytest.mark.parametrize("width", [1400, 390])
def test_nothing_is_wider_than_the_screen(file, tmp_path, width):
    with opened(file, tmp_path, width) as driver:
        assert driver.execute_script("return document.documentElement.scrollWidth") <= width
        assert complaints(driver) == []


def screen(driver):
    return matplotlib.image.imread(io.BytesIO(driver.get_screenshot_as_png()))[:, :, :3]


@pytest.mark.parametrize("dark", [False, True])
def test_it_is_light_or_dark(file, tmp_path, dark):
    with opened(file, tmp_path, dark=dark) as driver:
        pixels = screen(driver)
        assert complaints(driver) == []
    paper, ink = (
        (pixels < 0.2, pixels.min(axis=2) > 0.6) if dark else (pixels > 0.9, pixels.max(axis=2) < 0.4)
    )
    assert np.mean(paper) > 0.6 and np.mean(ink) > 0.005


def test_paper_is_white_and_shows_everything(file, tmp_path):
    """On paper, all tables are open, the colours are those of paper, and no picture is too wide."""
    with opened(file, tmp_path, dark=True) as driver:
        driver.execute_script(
            "addEventListener('beforeprint', () => { document.title = JSON.stringify(["
            "[...document.querySelectorAll('details')].every((d) => d.open), colour('ink'),"
            "Math.max(...group.charts.map((c) => c.plot.width))]) })"
        )
        pdf = base64.b64decode(driver.execute_cdp_cmd("Page.printToPDF", {"printBackground": True})["data"])
        assert pdf.startswith(b"%PDF") and len(re.findall(rb"/Type\s*/Page\b", pdf)) < 15
        opened_all, ink, width = driver.execute_script("return JSON.parse(document.title)")
        assert opened_all and ink == "#16191d" and width < 700
        # on the screen, it is dark again
        assert driver.execute_script("return colour('ink')") == "#e7eaee"
        assert complaints(driver) == []


class Long:
    """An explanation of a million samples: the answers of a short one with the signals of a long one."""

    def __init__(self, found, samples):
        random = np.random.default_rng(1)
        t = np.arange(samples) / RATE
        u = 5 + 5 * np.sin(2 * np.pi * 0.01 * t)
        y = u + np.sin(2 * np.pi * 7 * t)
        after = 0.02 * random.standard_normal(samples)
        after[700_000:700_400] += 0.5
        # one sample differs: it must be visible in the picture of the whole record
        y[123_456] += 40.0
        self._found = found
        self.record = gpi.Record(u, y, RATE)
        self.residuals_after, self.residuals_before = [after[:, None]], [after[:, None] + 0.1]
        self.warmups, self.held_out, self.wrong_samples = [0], [[(1000, 2000)]], []

    def __getattr__(self, name):
        return getattr(self._found, name)


def test_a_million_samples_stay_fluent(tmp_path, monkeypatch):
    found = Long(explained([3000], outputs=1), 1_000_000)
    monkeypatch.setattr("gpi_hammerstein.report.page.components", lambda *_: [])
    monkeypatch.setattr("gpi_hammerstein.report.page.to_dict", lambda _: found._found.to_dict())
    page = report_html(found)
    assert len(page.encode()) <= LARGEST_PAGE
    path = tmp_path / "long.html"
    path.write_text(page, encoding="utf-8")
    with opened(path, tmp_path) as driver:
        drawn = "const t = performance.timing; return t.loadEventEnd - t.navigationStart"
        assert driver.execute_script(drawn) < 1000 * SECONDS
        assert driver.execute_script("return Math.max(...group.charts[0].plot.data[2])") > 40.0
        # a zoom is computed in less time than two pictures of a film
        script = "const t = performance.now(); for (let i = 0; i < 20; i++) group.zoom(10 * i, 900 - 10 * i);"
        assert driver.execute_script(script + " return (performance.now() - t) / 20") < 80
        driver.find_element("id", "largest").click()
        first, last = shown(driver)[0] * RATE
        assert first <= 700_000 and last >= 700_399
        assert "every sample" in driver.find_element("id", "resolution").text
        read = hovered(driver, "chart-residual", 0.5)
        sample = round(read["time"][0] * RATE)
        assert read["residual after"][0] == pytest.approx(found.residuals_after[0][sample, 0], abs=1e-3)
        assert complaints(driver) == []
    assert sum(len(one["signals"]) for one in parts(Errors(found), DATA_BYTES)[0]) > 0

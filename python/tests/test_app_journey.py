"""A journey of a new user in a real browser: an own record, `gpi app`, the report, the C file."""

import json
import re
import shutil
import signal
import subprocess
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gpi_hammerstein as gpi
from browser import complaints, needs_browser, opened
from records import good_columns, write_csv
from served import PATIENCE, started

pytestmark = needs_browser


# What a browser does if a file is dropped.
DROP = """
const transfer = new DataTransfer();
transfer.items.add(new File(["no record"], arguments[1]));
const dropped = { dataTransfer: transfer, bubbles: true, cancelable: true };
arguments[0].dispatchEvent(new DragEvent("drop", dropped));
"""


def until(driver: Any, condition: Any) -> None:
    from selenium.webdriver.support.ui import WebDriverWait

    WebDriverWait(driver, PATIENCE, poll_frequency=0.05).until(lambda driver: condition())


def saved(folder: Path, name: str) -> Path:
    """A file that the browser saves, as soon as it is complete."""
    end = time.monotonic() + PATIENCE
    while not (folder / name).exists() and time.monotonic() < end:
        time.sleep(0.05)
    return folder / name


def test_from_an_own_record_to_the_c_file(tmp_path: Path) -> None:
    from selenium.webdriver.support.ui import Select

    t, u, y = good_columns(1500).values()
    # a laboratory's file: names that nobody knows, and no rate in sight
    record = write_csv(tmp_path / "run 7.csv", {"alpha": u, "beta": y})  # type: ignore[dict-item]
    other = write_csv(tmp_path / "other.csv", good_columns(1200, seed=5))
    home, downloads = tmp_path / "home", tmp_path / "downloads"
    home.mkdir()
    with started(home) as (process, address), opened(address, tmp_path) as driver:
        driver.execute_cdp_cmd(
            "Browser.setDownloadBehavior", {"behavior": "allow", "downloadPath": str(downloads)}
        )

        def see(name: str) -> Any:
            return driver.find_element("id", name)

        def save(name: str) -> Path:
            driver.find_element("css selector", f'a[href="results/{name}?download"]').click()
            return saved(downloads, name)

        until(driver, lambda: driver.find_elements("id", "file") and see("view-record").is_displayed())
        assert re.fullmatch(re.escape(address.split("?")[0]) + r"[\w-]+/", driver.current_url)  # no token
        # a wrong file is refused with a message on the page
        driver.execute_script(DROP, see("drop"), "notes.docx")
        until(driver, lambda: see("error-record").is_displayed())
        assert see("error-record").text.startswith("notes.docx: no known format")
        # the record: the page says what is missing, and the user chooses
        see("file").send_keys(str(record))
        until(driver, lambda: see("problem").is_displayed() and not see("error-record").is_displayed())
        assert not see("start").is_enabled()
        see("rate").send_keys("1000\t")
        for header, role in (("alpha", "input"), ("beta", "output")):
            until(driver, lambda: see("found").get_attribute("aria-busy") == "false")
            choice = driver.find_element("css selector", f'#columns select[data-header="{header}"]')
            Select(choice).select_by_visible_text(role)
        until(driver, lambda: see("start").is_enabled())
        assert see("size").text == "run 7.csv: 1500 samples at 1000 Hz, 1.5 s"
        until(driver, lambda: len(driver.find_elements("css selector", "#plots-record canvas")) == 3)
        # by keyboard
        see("start").send_keys("\n")
        until(driver, lambda: see("now-stage").text not in ("", "starting"))
        assert see("cancel").is_displayed()
        until(driver, lambda: see("view-result").is_displayed())
        assert see("verdict").text == "explained"
        # the report in its frame: its script has run, and it is kept away from the page around it
        driver.switch_to.frame(see("report"))
        until(driver, lambda: len(driver.find_elements("css selector", ".chart canvas")) == 8)
        driver.find_element("id", "largest").click()
        zoomed = driver.execute_script(
            "return group.charts[0].plot.scales.x.max - group.charts[0].plot.scales.x.min"
        )
        assert zoomed < 1.0
        assert driver.execute_script("return origin") == "null"
        driver.switch_to.default_content()
        # and in a tab of its own
        page = driver.current_window_handle
        driver.find_element("css selector", 'a[target="_blank"]').click()
        until(driver, lambda: len(driver.window_handles) == 2)
        driver.switch_to.window(next(one for one in driver.window_handles if one != page))
        until(driver, lambda: len(driver.find_elements("css selector", ".chart canvas")) == 8)
        driver.close()
        driver.switch_to.window(page)
        # another record, whose columns have other names
        driver.find_element("css selector", "#drop-other summary").click()
        see("other-input").send_keys("u")
        see("other-output").send_keys("y")
        see("other").send_keys(str(other))
        until(driver, lambda: see("driven").is_displayed() and see("errors").text)
        model = gpi.Model.from_json(save("model.json").read_text())
        direct = model.compare(gpi.read_record(other))
        rms, unit = re.findall(r"rms error ([\d.e-]+) ?(\S*)", see("errors").text)[0]
        assert float(rms) == pytest.approx(direct.error["rms"], rel=1e-3)
        assert len(driver.find_elements("css selector", "#plots-other canvas")) == 4
        table = np.loadtxt(save("simulated.csv"), delimiter=",", skiprows=1)
        assert table[:, 1] == pytest.approx(direct.simulated[0][:, 0], abs=1e-9)
        # the files
        assert "gpi explain 'run 7.csv' --input alpha" in save("report.html").read_text().replace(
            "&#x27;", "'"
        )
        assert json.loads(save("explanation.json").read_text())["verdict"] == "explained"
        see("low").send_keys("-5")
        see("high").send_keys("5\n")
        until(driver, lambda: driver.find_elements("css selector", "#exported a"))
        code = [save(f"gpi_compensator.{ending}") for ending in ("h", "c")]
        assert "from -5 to 5" in code[0].read_text()
        if compiler := shutil.which("cc"):
            command = [compiler, "-std=c99", "-Wall", "-Werror", "-c", str(code[1]), "-o", "/dev/null"]
            assert subprocess.run(command, capture_output=True, check=False).returncode == 0
        # the page that is loaded again shows where it was
        driver.refresh()
        until(driver, lambda: see("view-result").is_displayed())
        # what the browser says is only that the page refused the wrong file
        assert [line for line in complaints(driver) if "422" not in line] == []
        process.send_signal(signal.SIGINT)
        assert process.wait(1.0) == 130
    assert list(home.iterdir()) == []

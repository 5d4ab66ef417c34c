"""The server of `gpi app`: who may speak to it, what it says of bad files, and what it makes of good ones."""

import http.client
import json
import os
import re
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gpi_hammerstein as gpi
from gpi_hammerstein.app import require_libraries
from gpi_hammerstein.app.routes import PAGE
from gpi_hammerstein.app.search import RUNNING
from gpi_hammerstein.app.signals import GROUPS, Channel, Signals
from gpi_hammerstein.app.worker import NOTHING_KEPT, work
from gpi_hammerstein.cli import run
from records import RATE, actuator, drive, good_columns, write_csv
from served import Client, served, started


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Records: one that is explained in seconds, another one of it, and one whose search takes longer."""
    folder = tmp_path_factory.mktemp("lab")
    write_csv(folder / "stage.csv", good_columns(1500))
    other = good_columns(1200, seed=5)
    write_csv(folder / "other.csv", other)
    write_csv(folder / "drive.csv", {name: other[name] for name in ("t_s", "u_V")})
    u = drive(2000)
    t = np.arange(2000) / RATE
    hum = 0.3 * np.sin(2 * np.pi * 50.3 * t) + 0.2 * np.sin(2 * np.pi * 120.7 * t)
    write_csv(folder / "long.csv", {"t_s": t.round(9), "u_V": u, "y_um": actuator(u) + hum + 0.1 * t})
    return folder


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    with served(tmp_path_factory.mktemp("private")) as own:
        yield own.enter()


@pytest.fixture
def stranger(client: Client) -> Client:
    """A client of the same server that has not opened its address."""
    return Client(client.port, client.token, client.code, client.folder, client.session, {}, client.place)


PATHS = [
    *(path[1:] for path in PAGE),
    "state",
    "progress",
    "signals/record",
    "results/report.html",
    "nothing",
]
POSTS = ["files?name=a.csv", "inspect", "search", "cancel", "drive", "export"]


@pytest.mark.parametrize("path", PATHS)
def test_every_page_needs_the_cookie(path: str, client: Client, stranger: Client) -> None:
    assert stranger.get(path).status == 403
    for cookie in (f"{client.origin}=x", f"gpi-app-{client.port}=", f"gpi-app-{client.port}=ö{client.token}"):
        assert stranger.get(path, Cookie=cookie).status == 403
    # the cookie alone, outside of the folder to which the browser sends it
    assert client.get("/" + path).status == 403
    if "/" + path in PAGE:
        assert client.get(path).status == 200


@pytest.mark.parametrize("path", POSTS)
def test_every_change_needs_cookie_and_origin(path: str, client: Client, stranger: Client) -> None:
    assert stranger.post(path, {}).status == 403
    for origin in (
        None,
        "null",
        "http://evil.example",
        "http://127.0.0.1",
        f"http://localhost:{client.port}",
    ):
        refused = client.post(path, {}, Origin=origin)
        assert (refused.status, refused.body) == (403, b"This request comes from another page.\n")


@pytest.mark.parametrize("host", ["evil.example", "localhost:{port}", "127.0.0.1", "127.0.0.1:1", None])
def test_another_name_of_the_server_is_refused(host: str | None, client: Client) -> None:
    name = None if host is None else host.format(port=client.port)
    for answer in (client.get("", Host=name), client.get(f"/?token={client.token}", Host=name)):
        # the server itself refuses a request without a name
        assert answer.status in ((400, 421) if host is None else (421,))
        assert "Set-Cookie" not in answer.headers


def test_the_address_opens_the_page_and_the_code_only_once(client: Client, stranger: Client) -> None:
    for wrong in ("/?token=", "/?token=x", f"/?code={client.token}", f"state?token={client.token}"):
        assert stranger.get(wrong).status == 403
    for path, status in (
        (f"/?token={client.token}", 200),
        (f"/?code={client.code}", 200),
        (f"/?code={client.code}", 403),
        (f"/?token={client.token}", 200),
    ):
        answer = stranger.get(path)
        assert answer.status == status
        if status == 200:
            # a redirection would lose a strict cookie, so the page itself goes on, without the token
            assert f'content="0; url={client.place}"' in answer.body.decode()
            assert client.token.encode() not in answer.body and len(client.place) > 20
            words = {word.strip().lower() for word in answer.headers["Set-Cookie"].split(";")[1:]}
            # other ports of this machine do not get the cookie: their pages are not in this folder
            assert {"httponly", "samesite=strict", f"path={client.place}".lower()} <= words


def test_every_answer_has_a_strict_policy(client: Client, stranger: Client) -> None:
    answers = [client.get(path) for path in PATHS] + [stranger.get(""), client.get("", Host="evil.example")]
    for answer in [*answers, client.post("inspect", {}), stranger.get(f"/?token={client.token}")]:
        policy = answer.headers["Content-Security-Policy"]
        assert "default-src 'none'" in policy and "unsafe" not in policy
        assert not re.search(r"https?:|\*|blob:", policy), policy
        assert "frame-ancestors 'none'" in policy
        assert answer.headers["X-Content-Type-Options"] == "nosniff"
        assert answer.headers["Cache-Control"] == "no-store"
        assert answer.headers["Referrer-Policy"] == "no-referrer"
    page = client.get("").body.decode()
    assert not re.search(r"https?://|<script(?! src)|<style| style=| on\w+=", page)


BAD = {
    "notes.docx": (b"anything", "notes.docx: no known format; names of record files end in .csv"),
    "signal.npy": (b"\x93NUMPY", r"signal\.npy: a \.npy file contains only one signal"),
    "empty.csv": (b"", r"empty\.csv: "),
    "words.csv": (b"t,u,y\n0,1,2\n1,x,3\n2,3,4\n", r"words\.csv: .*row 1"),
    "broken.parquet": (b"PAR1 and nothing else", r"broken\.parquet: "),
    "cut.csv.gz": (b"\x1f\x8b\x08\x00", r"cut\.csv\.gz: "),
    "..%2F..%2Fetc%2Fpasswd.docx": (b"x", "^passwd.docx: no known format"),
    "%1b%5b2J.docx": (b"x", r"^\\x1b\[2J\.docx: no known format"),
}


@pytest.mark.parametrize("name", BAD)
def test_a_bad_file_is_refused_with_the_message_of_the_package(name: str, client: Client) -> None:
    content, words = BAD[name]
    answer = client.post(f"files?name={name}", content)
    if answer.status == 200:
        answer = client.post("inspect", {"files": [answer.json()["key"]]})
        found = answer.json()
        message = found.get("message") or found["problem"]
    else:
        message = answer.json()["message"]
    assert re.search(words, message), message
    assert answer.status in (200, 422) and "Traceback" not in message
    assert str(client.folder) not in answer.body.decode()


def test_names_of_files_are_not_paths(client: Client, lab: Path) -> None:
    content = (lab / "stage.csv").read_bytes()
    before = set(client.folder.rglob("*"))
    answer = client.post("files?name=..%2F..%2Fmy%20run.CSV", content).json()
    [new] = set(client.folder.rglob("*")) - before
    assert answer["name"] == "my run.CSV" and re.fullmatch(r"[0-9a-f]{32}\.csv", new.name)
    assert new.parent == client.folder and new.stat().st_mode & 0o077 == 0
    found = client.post("inspect", {"files": [answer["key"]]}).json()
    assert found["files"] == ["my run.CSV"]
    assert found["next"]["command"] == "gpi report 'my run.CSV' -o 'my run.html'"
    assert new.stem not in json.dumps(found)
    for keys in ([], ["x"], [str(new)], "x", None):
        refused = client.post("inspect", {"files": keys})
        assert refused.status == 422 and "`files`" in refused.json()["message"]


def test_a_file_has_a_largest_size(client: Client, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GPI_MAX_UPLOAD_BYTES", "1000")
    assert client.get("state").json()["largest_upload"] == 1000
    before = set(client.folder.rglob("*"))
    parts = (b"x" * 400 for _ in range(10))
    for content in (b"x" * 1001, parts):
        answer = client.post("files?name=big.csv", content)
        assert answer.status == 413
        assert re.search("big.csv: has more than 1000 bytes.*GPI_MAX_UPLOAD_BYTES", answer.json()["message"])
    assert set(client.folder.rglob("*")) == before
    assert client.post("files?name=small.csv", b"x" * 1000).status == 200
    monkeypatch.setenv("GPI_MAX_UPLOAD_BYTES", "much")
    assert client.post("files?name=big.csv", b"x").json()["error"] == "ParameterError"
    assert client.post("inspect", b"[" * (1 << 21)).status == 413


@pytest.mark.parametrize("body", [b"{", b"[]", b"\xff"])
def test_a_request_that_is_no_object_is_refused(body: bytes, client: Client) -> None:
    assert client.post("inspect", body).status == 400


@pytest.mark.parametrize(
    ("request_", "words"),
    [
        ({"rate": "fast"}, "`rate` = fast: must be a number"),
        ({"resample": [1]}, "`resample`"),
        ({"input": "u"}, "`input`.*list of names"),
        ({"time": 3}, "`time` = 3: must be a text"),
    ],
)
def test_a_wrong_choice_names_the_field(request_: dict[str, Any], words: str, client: Client) -> None:
    answer = client.post("inspect", {"files": ["x"], **request_})
    assert answer.status == 422 and re.search(words, answer.json()["message"])


def test_inspection_and_roles(client: Client, lab: Path, tmp_path: Path) -> None:
    key = client.upload(lab / "stage.csv")
    found = client.post("inspect", {"files": [key]}).json()
    direct = gpi.inspect(lab / "stage.csv").to_dict()
    for part in ("columns", "clock", "record", "inputs", "outputs", "findings", "identifiable"):
        assert found[part] == json.loads(json.dumps(direct[part])), part
    drawn = client.get("signals/record").json()
    assert [line["kind"] for line in drawn["lines"]] == ["input", "output"]
    assert drawn["lines"][0]["unit"] == "V" and len(drawn["loops"]) == 1
    # names that nobody knows: the roles are chosen, and the time stands still without a rate
    t, u, y = good_columns(1500).values()
    key = client.upload(write_csv(tmp_path / "names.csv", {"alpha": u, "beta": y, "gamma": t}))  # type: ignore[dict-item]
    found = client.post("inspect", {"files": [key]}).json()
    assert found["problem"] and not found["drawn"]
    assert client.get("signals/record").status == 422
    chosen = {"files": [key], "input": ["alpha"], "output": ["beta"], "covariate": [], "rate": "1000"}
    found = client.post("inspect", chosen).json()
    assert found["problem"] is None and found["drawn"]
    assert [row["role"] for row in found["columns"]] == ["input", "output", "unused"]


def test_pictures_keep_extremes_and_zoom() -> None:
    values = np.zeros((100_000, 1))
    values[54_321] = 7.0
    signals = Signals([Channel("u", "V", "input")], [values], 1000.0)
    whole = signals.part(0)
    assert whole["every"] > 1 and len(whole["time"]) <= 2 * GROUPS + 2
    assert max(whole["lines"][0]["values"]) == 7.0
    near = signals.part(0, 54.3, 54.4)
    assert near["every"] == 1
    assert near["lines"][0]["values"][near["time"].index(54.321)] == 7.0
    assert len(signals.part(0, 99.9999, 1e9)["time"]) >= 2
    with pytest.raises(gpi.ParameterError, match="`experiment` = 1"):
        signals.part(1)


def events(client: Client) -> list[dict[str, Any]]:
    """All events of a search."""
    with closing(http.client.HTTPConnection("127.0.0.1", client.port, timeout=60)) as connection:
        cookie = "; ".join(f"{name}={value}" for name, value in client.cookies.items())
        connection.request("GET", client.place + "progress", headers={"Cookie": cookie})
        answer = connection.getresponse()
        assert answer.headers["Content-Type"].startswith("text/event-stream")
        lines = answer.read().decode().split("\n\n")
    return [json.loads(line.removeprefix("data: ")) for line in lines if line.startswith("data: ")]


@pytest.fixture(scope="module")
def searched(client: Client, lab: Path) -> list[dict[str, Any]]:
    """The events of a search that is complete."""
    key = client.upload(lab / "stage.csv")
    started_ = client.post("search", {"files": [key], "effects": ["creep"]})
    assert started_.status == 200, started_.body
    assert "is running" in client.post("search", {"files": [key]}).json()["message"]
    return events(client)


def test_a_search_is_watched(searched: list[dict[str, Any]]) -> None:
    told = [one["progress"] for one in searched if one["progress"]]
    done = [one["done"] for one in told]
    assert len(told) > 3 and done == sorted(done) and done[-1] == 1.0
    assert {one["stage"] for one in told} >= {"structures", "done"}
    assert (
        told[-1]["error"] > 0 and any(one["trial"] for one in told) and any(one["remaining"] for one in told)
    )
    keeps = [one["keeps"] for one in searched]
    assert not keeps[0] and keeps[-1] and keeps == sorted(keeps)
    assert searched[-1]["state"] == "done" and searched[-1]["result"]["verdict"] == "explained"
    command = searched[-1]["result"]["command"]
    assert command == "gpi explain stage.csv --effects creep --report -o explained"


def test_the_results_are_those_of_the_package(
    client: Client, searched: list[dict[str, Any]], lab: Path
) -> None:
    direct = gpi.explain(gpi.read_record(lab / "stage.csv"), effects="creep")
    assert client.get("results/model.json?download").body.decode() == direct.model.to_json()
    explanation = client.get("results/explanation.json").json()
    assert explanation["error"]["after"] == direct.after
    saved = client.get("results/report.html?download")
    assert saved.headers["Content-Disposition"] == 'attachment; filename="report.html"'
    page = client.get("results/report.html")
    assert page.body == saved.body and b"gpi explain stage.csv --effects creep" in page.body
    policy = page.headers["Content-Security-Policy"]
    assert "sandbox allow-scripts" in policy and "allow-same-origin" not in policy
    # the policy of the page itself, which permits its script by its hash
    [own] = re.findall(r'http-equiv="Content-Security-Policy" content="([^"]+)"', page.body.decode())
    assert own in policy and "'sha256-" in own and "unsafe" not in policy
    assert str(client.folder) not in page.body.decode()
    for name in ("nothing.txt", "..%2Fmodel.json", "simulated.csv%00"):
        assert client.get(f"results/{name}").status in (404, 422)


def test_another_record_is_driven_through_the_model(
    client: Client, searched: list[dict[str, Any]], lab: Path
) -> None:
    model = gpi.Model.from_json(client.get("results/model.json").body.decode())
    answer = client.post("drive", {"files": [client.upload(lab / "other.csv")]})
    found, direct = answer.json(), model.compare(gpi.read_record(lab / "other.csv"))
    assert found["error"] == pytest.approx(dict(direct.error)) and found["rule"] == direct.rule
    assert found["fit_percent"] == pytest.approx(dict(direct.fit_percent))
    kinds = [line["kind"] for line in client.get("signals/other").json()["lines"]]
    assert kinds == ["input", "simulated", "output", "residual"]
    rows = client.get("results/simulated.csv").body.decode().splitlines()
    assert rows[0] == "t,y" and len(rows) == 1201
    assert float(rows[600].split(",")[1]) == pytest.approx(direct.simulated[0][599, 0])
    # without an output, it is only simulated
    found = client.post("drive", {"files": [client.upload(lab / "drive.csv")]}).json()
    assert found["error"] is None
    assert [line["kind"] for line in client.get("signals/other").json()["lines"]] == ["input", "simulated"]
    # a record of another rate is refused
    slow = client.post("drive", {"files": [client.upload(lab / "drive.csv")], "rate": 10})
    assert slow.status == 422 and "1000 Hz" in slow.json()["message"]


def test_the_compensator_is_written_in_c(
    client: Client, searched: list[dict[str, Any]], tmp_path: Path
) -> None:
    answer = client.post("export", {"low": "-5", "high": 5, "precision": "double"}).json()
    assert (
        answer["files"] == ["gpi_compensator.h", "gpi_compensator.c"]
        and "hysteresis" in answer["compensated"]
    )
    model = gpi.Model.from_json(client.get("results/model.json").body.decode())
    gpi.export_c(model, tmp_path, limits=(-5, 5), precision="double")
    for name in answer["files"]:
        assert client.get(f"results/{name}").body == (tmp_path / name).read_bytes()
    refused = client.post("export", {"low": 5, "high": -5})
    assert refused.status == 422 and refused.json()["error"] == "ParameterError"


def test_a_search_that_is_stopped_keeps_its_model(
    client: Client, searched: list[dict[str, Any]], lab: Path
) -> None:
    old = client.get("results/model.json").body.decode()
    assert client.post("search", {"files": [client.upload(lab / "long.csv")]}).status == 200
    client.wait(lambda status: status["keeps"] or status["state"] not in RUNNING)
    assert client.post("cancel", {}).json()["state"] == "stopping"
    status = client.wait(lambda status: status["state"] not in RUNNING)
    assert status["state"] == "done" and status["result"]["interrupted"]
    assert status["result"]["sentences"][0].startswith("The search was stopped before it was complete")
    kept = client.get("results/model.json").body.decode()
    assert kept != old and gpi.Model.from_json(kept).rate == RATE


def test_a_second_wish_ends_the_search_at_once(client: Client, lab: Path) -> None:
    assert client.post("search", {"files": [client.upload(lab / "long.csv")]}).status == 200
    begin = time.monotonic()
    assert client.post("cancel", {}).json()["state"] == "stopping"
    status = client.post("cancel", {}).json()
    assert status["state"] == "stopped" and "ended at once" in status["message"]
    assert client.session.search is not None
    client.session.search.close()
    assert time.monotonic() - begin < 1.0


def test_a_process_that_dies_is_a_message(client: Client, lab: Path) -> None:
    assert client.post("search", {"files": [client.upload(lab / "long.csv")]}).status == 200
    # the list of children is not complete while the thread that started one of them ends
    found: list[int] = []
    while not found and client.get("state").json()["search"]["state"] in RUNNING:
        command = {one: Path(f"/proc/{one}/cmdline").read_bytes() for one in children(os.getpid())}
        found = [one for one, words in command.items() if b"gpi_hammerstein_launcher.search" in words]
    assert found, "no process of a search was seen"
    os.kill(found[0], signal.SIGKILL)
    status = client.wait(lambda status: status["state"] not in RUNNING)
    assert status["state"] == "failed" and "ended with code -9" in status["message"]


def worked(path: Path, out: Path, stop: threading.Event) -> dict[str, Any]:
    """The last answer of a search in this process."""
    answers: list[dict[str, Any]] = []
    request = {"paths": [str(path)], "reading": {}, "effects": None, "out": str(out), "command": "gpi"}
    work(request, stop, answers.append)
    return answers[-1]


def test_before_the_model_is_fitted_nothing_is_kept(lab: Path, tmp_path: Path) -> None:
    stop = threading.Event()
    stop.set()
    assert worked(lab / "long.csv", tmp_path / "out", stop) == {"stopped": NOTHING_KEPT}
    assert not (tmp_path / "out").exists()


def test_an_unusable_record_fails_with_its_message(tmp_path: Path) -> None:
    t = np.arange(1500) / RATE
    path = write_csv(tmp_path / "still.csv", {"t_s": t, "u_V": 0.0 * t, "y_um": t})
    failed = worked(path, tmp_path / "out", threading.Event())["failed"]
    assert failed["error"] == "DataError" and "`u`" in failed["message"]


def test_without_the_libraries_the_message_says_how_to_install_them(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("gpi_hammerstein.app.find_spec", lambda name: None if name == "uvicorn" else name)
    with pytest.raises(gpi.ParameterError, match=r"needs uvicorn.*pip install 'gpi-hammerstein\[app\]'"):
        require_libraries()
    assert run(["app", "--no-browser"]) == 2
    assert "pip install 'gpi-hammerstein[app]'" in capsys.readouterr().err


def children(process: int) -> list[int]:
    """The processes that a process has started."""
    tasks = Path(f"/proc/{process}/task").glob("*/children")
    return [int(one) for task in tasks for one in task.read_text().split()]


def has_ended(process: int) -> bool:
    """Whether a process is gone, or only waits for somebody to note its end."""
    try:
        return Path(f"/proc/{process}/stat").read_text().rsplit(")")[-1].split()[0] in "ZX"
    except FileNotFoundError:
        return True


def test_ctrl_c_ends_server_and_search_within_a_second(tmp_path: Path, lab: Path) -> None:
    with started(tmp_path) as (process, address):
        port, token = re.findall(r":(\d+)/\?token=(\S+)", address)[0]
        [folder] = tmp_path.iterdir()
        assert folder.stat().st_mode & 0o777 == 0o700
        own = Client(int(port), token, "", folder, None)  # type: ignore[arg-type]
        own.enter()
        key = own.upload(lab / "long.csv")
        assert own.post("search", {"files": [key]}).status == 200
        own.wait(lambda status: status["progress"])
        # a page that is closed while it listens, and one that is closed while it sends
        for line in ("GET {}progress", "POST {}files?name=cut.csv"):
            with closing(http.client.HTTPConnection("127.0.0.1", own.port)) as connection:
                connection.putrequest(*line.format(own.place).split(), skip_host=True)
                cookie = "; ".join(f"{name}={value}" for name, value in own.cookies.items())
                for header in (f"Host: 127.0.0.1:{port}", f"Cookie: {cookie}", f"Origin: {own.origin}"):
                    connection.putheader(*header.split(": "))
                connection.putheader("Content-Length", "0" if line.startswith("GET") else "1000")
                connection.endheaders(b"" if line.startswith("GET") else b"t,u")
                time.sleep(0.2)
        own.wait(lambda status: len([*folder.glob("*.csv")]) == 1)
        [worker] = children(process.pid)
        begin = time.monotonic()
        process.send_signal(signal.SIGINT)
        assert process.wait(10) == 130
        while not has_ended(worker) and time.monotonic() - begin < 5:
            time.sleep(0.01)
        assert time.monotonic() - begin < 1.0
        assert process.stderr is not None
        # the browser may have saved what it was sent
        assert process.stderr.read() == "gpi: interrupted\n"
        assert list(tmp_path.iterdir()) == []

"""Sets by their address: what is here is taken, what is not is fetched, what is another is refused."""

import hashlib
import http.server
import threading
from dataclasses import replace

import numpy as np
import pytest

import gpi_hammerstein as gpi
from data_folder import DATA, needs_measured
from gpi_hammerstein import cli, datasets

TEXT = "\n".join(f"{np.sin(k):.6f}\t0\t0\t0\t{2 * np.sin(k):.6f}" for k in range(300)).encode()


@pytest.fixture
def own(monkeypatch, tmp_path):
    """A set of one small file, its cache and its folder empty."""
    monkeypatch.setenv("GPI_DATA_DIR", str(tmp_path / "data"))
    monkeypatch.setattr("pooch.os_cache", lambda name: tmp_path / "cache")
    path = "folder/own.dat"
    made = replace(
        datasets.CATALOGUE["piezo-p885-dbo"],
        files={path: hashlib.sha256(TEXT).hexdigest()},
        parts={"all": ((path,), datasets.piezo)},
        address="http://127.0.0.1:1/",
    )
    monkeypatch.setitem(datasets.CATALOGUE, "own", made)
    return tmp_path / "data" / "own"


def test_a_file_that_is_here_is_taken(own):
    own.mkdir(parents=True)
    (own / "own.dat").write_bytes(TEXT)
    assert datasets.fetch("own") == [own / "own.dat"]
    record = datasets.load("own", "all")
    assert (record.rate, record.input_units, record.output_units) == (200.0, ["V"], ["um"])
    np.testing.assert_allclose(record.y[0], 2 * record.u[0], atol=2e-6)


def test_another_file_is_refused(own):
    own.mkdir(parents=True)
    (own / "own.dat").write_bytes(TEXT + b" ")
    with pytest.raises(gpi.DataError, match="its SHA-256 is different"):
        datasets.load("own")


def test_without_a_network_it_says_what_to_do(own):
    with pytest.raises(gpi.DataError, match="cannot be downloaded.*GPI_DATA_DIR"):
        datasets.load("own")


@pytest.mark.parametrize("sent", [TEXT, TEXT[:-1]])
def test_what_is_fetched_is_checked_and_kept(own, monkeypatch, sent):
    asked = []

    class Handler(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            asked.append(self.path)
            self.send_response(200)
            self.end_headers()
            self.wfile.write(sent)

        def log_message(self, *_):
            pass

    server = http.server.HTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    try:
        address = f"http://127.0.0.1:{server.server_address[1]}/"
        monkeypatch.setitem(datasets.CATALOGUE, "own", replace(datasets.CATALOGUE["own"], address=address))
        if sent == TEXT:
            assert datasets.load("own").samples == datasets.load("own").samples == 300
            assert asked == ["/folder/own.dat"]
        else:
            with pytest.raises(gpi.DataError, match="cannot be downloaded"):
                datasets.load("own")
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


def test_unknown_names_are_told():
    with pytest.raises(gpi.ParameterError, match="`name` = other: must be one of piezo-p885-dbo"):
        datasets.load("other")
    with pytest.raises(gpi.ParameterError, match="`part` = 9: throttle-valve has 1, 3"):
        datasets.load("throttle-valve", "9")


def test_the_command_lists_and_fetches(own, tmp_path, capsys):
    own.mkdir(parents=True)
    (own / "own.dat").write_bytes(TEXT)
    assert cli.run(["datasets", "list"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "piezo-fsm-cubespec" in said and "CC-BY-4.0" in said and "100mV, 200mV" in said
    assert cli.run(["datasets", "fetch", "own", "-o", str(tmp_path / "out")]) == 0
    assert "MIT" in capsys.readouterr().out
    record = gpi.read_record(tmp_path / "out" / "own-all.csv")
    np.testing.assert_array_equal(record.u[0], datasets.load("own").u[0])
    assert (record.rate, record.output_units) == (200.0, ["um"])
    assert cli.run(["datasets", "fetch", "nothing"]) == 2


@needs_measured
@pytest.mark.parametrize(
    ("name", "part", "shape"),
    [
        ("piezo-p885-dbo", "model", (8027, 1)),
        ("throttle-valve", "1", (2498, 1)),
        ("throttle-valve", "3", (6350, 1)),
        ("piezo-fsm-cubespec", "300mV", (16384, 3)),
    ],
)
def test_measured_sets(monkeypatch, name, part, shape):
    monkeypatch.setenv("GPI_DATA_DIR", str(DATA))
    record = datasets.load(name, part)
    assert record.u[0].shape == shape and len(record.u) == (6 if shape[1] == 3 else 1)
    if shape[1] == 3:
        assert record.warmup == [8192] * 6 and 1 < np.std(record.y[0]) < 10

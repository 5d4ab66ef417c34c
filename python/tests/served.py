"""`gpi app` for the tests: its server in a thread, a client without a browser, the command in a process."""

import http.client
import json
import os
import re
import secrets
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import gpi_hammerstein
from gpi_hammerstein.app.guard import Guard
from gpi_hammerstein.app.routes import application
from gpi_hammerstein.app.server import listening, server_for
from gpi_hammerstein.app.session import Session

PATIENCE = 60.0


@dataclass
class Answer:
    status: int
    headers: http.client.HTTPMessage
    body: bytes

    def json(self) -> Any:
        return json.loads(self.body)


@dataclass
class Client:
    """What a browser would send, with paths in the folder of the page unless they begin with a slash.

    Every header can be replaced, and None leaves it out.
    """

    port: int
    token: str
    code: str
    folder: Path
    session: Session
    cookies: dict[str, str] = field(default_factory=dict)
    place: str = "/"

    @property
    def origin(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    def send(
        self, method: str, path: str, body: Any = None, headers: Mapping[str, str | None] | None = None
    ) -> Answer:
        own: dict[str, str | None] = {"Host": f"127.0.0.1:{self.port}", "Connection": "close"}
        if self.cookies:
            own["Cookie"] = "; ".join(f"{name}={value}" for name, value in self.cookies.items())
        if method == "POST":
            own["Origin"] = self.origin
        content = json.dumps(body).encode() if isinstance(body, dict) else body
        with closing(http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE)) as connection:
            where = path if path.startswith("/") else self.place + path
            connection.putrequest(method, where, skip_host=True, skip_accept_encoding=True)
            if isinstance(content, bytes):
                own["Content-Length"] = str(len(content))
            elif content is not None:
                own["Transfer-Encoding"] = "chunked"
            for name, value in {**own, **(headers or {})}.items():
                if value is not None:
                    connection.putheader(name, value)
            try:
                connection.endheaders(content, encode_chunked=not isinstance(content, bytes))
            except (BrokenPipeError, ConnectionResetError):
                pass  # refused before everything was sent
            answer = connection.getresponse()
            return Answer(answer.status, answer.headers, answer.read())

    def get(self, path: str, **headers: str | None) -> Answer:
        return self.send("GET", path, headers=headers)

    def post(self, path: str, body: Any, **headers: str | None) -> Answer:
        return self.send("POST", path, body, headers)

    def enter(self) -> "Client":
        """Open the address that the terminal shows, and keep the cookie."""
        answer = self.get(f"/?token={self.token}")
        name, value = answer.headers["Set-Cookie"].split(";")[0].split("=", 1)
        self.cookies = {name: value}
        [self.place] = re.findall(r'url=(/[\w-]+/)"', answer.body.decode())
        return self

    def upload(self, path: Path) -> str:
        answer = self.post(f"files?name={path.name}", path.read_bytes())
        assert answer.status == 200, answer.body
        return str(answer.json()["key"])

    def wait(self, until: Any) -> dict[str, Any]:
        """The status of the search as soon as it satisfies a condition."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            status: dict[str, Any] = self.get("state").json()["search"]
            if until(status):
                return status
            time.sleep(0.02)
        raise TimeoutError(status)


@contextmanager
def served(folder: Path) -> Iterator[Client]:
    """The server in a thread, as `gpi app` starts it, with its files in `folder`."""
    token, code = secrets.token_urlsafe(32), secrets.token_urlsafe(32)
    with closing(Session(folder)) as session, closing(listening()) as own:
        port = own.getsockname()[1]
        server = server_for(Guard(application(session), port, token, [code]))
        thread = threading.Thread(target=server.run, kwargs={"sockets": [own]})
        thread.start()
        try:
            yield Client(port, token, code, folder, session)
        finally:
            server.should_exit = server.force_exit = True
            thread.join(PATIENCE)


@contextmanager
def started(temporary: Path, **settings: str) -> Iterator[tuple["subprocess.Popen[str]", str]]:
    """The command `gpi app --no-browser` in another process, and its address."""
    package = str(Path(gpi_hammerstein.__file__).parent.parent)
    code = "import gpi_hammerstein_launcher; gpi_hammerstein_launcher.main()"
    process = subprocess.Popen(
        [sys.executable, "-c", code, "app", "--no-browser"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"PYTHONPATH": package, "TMPDIR": str(temporary)} | settings,
    )
    try:
        assert process.stdout is not None
        found = re.search(r"http://127\.0\.0\.1:\d+/\?token=\S+", process.stdout.readline())
        assert found, process.stderr and process.stderr.read()
        yield process, found.group()
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGKILL)
        process.communicate()

"""The server on 127.0.0.1, and the browser that shows its page."""

import secrets
import socket
import sys
import tempfile
import threading
import webbrowser
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import uvicorn

from gpi_hammerstein.app.guard import Guard
from gpi_hammerstein.app.routes import application
from gpi_hammerstein.app.session import Session
from gpi_hammerstein.app.settings import largest_upload
from gpi_hammerstein.files.exchange import recover
from gpi_hammerstein.files.temporary import note_written, sweep, temporary_folder

# Bytes of the token: 256 bits cannot be guessed.
TOKEN_BYTES = 32


class Server(uvicorn.Server):
    """A server that leaves signals to the program: Ctrl-C then ends it at once, whatever it does."""

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Change no handler of a signal."""
        yield


def serve(*, open_browser: bool, say: Callable[[str], object] = print) -> None:
    """Run the app until it is interrupted.

    Parameters
    ----------
    open_browser
        Whether the page is opened in the browser of the user.
    say
        Is called with the address of the page.

    Raises
    ------
    ParameterError
        The setting of the largest file is wrong.
    KeyboardInterrupt
        Ctrl-C was pressed.

    Examples
    --------
    >>> serve(open_browser=False)  # doctest: +SKIP
    http://127.0.0.1:38123/?token=..
    """
    largest_upload()
    home = Path(tempfile.gettempdir())
    # what a run that was killed has left
    sweep(home, recover)
    with temporary_folder(home) as folder, closing(Session(folder)) as session, closing(listening()) as own:
        port = own.getsockname()[1]
        token, code = secrets.token_urlsafe(TOKEN_BYTES), secrets.token_urlsafe(TOKEN_BYTES)
        guard = Guard(application(session), port, token, [code])
        # from now on the browser may save results, which this process does not see
        note_written()
        say(f"{guard.origin}/?token={token}")
        if open_browser:
            # a browser without windows would keep this thread
            where = f"{guard.origin}/?code={code}"
            threading.Thread(target=webbrowser.open, args=(where,), daemon=True).start()
        server_for(guard).run(sockets=[own])


def server_for(guard: Guard) -> Server:
    """Return the server of an application.

    Parameters
    ----------
    guard
        The application.

    Examples
    --------
    >>> server_for(guard).run(sockets=[listening()])  # doctest: +SKIP
    """
    return Server(
        uvicorn.Config(
            guard,
            http="h11",
            ws="none",
            loop="asyncio",
            lifespan="off",
            log_level="error",
            access_log=False,
            server_header=False,
            proxy_headers=False,
        )
    )


def listening() -> socket.socket:
    """Return a socket on a free port of 127.0.0.1, which other machines cannot reach.

    Examples
    --------
    >>> with listening() as own:
    ...     own.getsockname()[0]
    '127.0.0.1'
    """
    own = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    if sys.platform == "win32":
        # without it, another program could take the same port
        own.setsockopt(socket.SOL_SOCKET, socket.SO_EXCLUSIVEADDRUSE, 1)
    own.bind(("127.0.0.1", 0))
    # a browser that comes before the server is ready waits
    own.listen()
    return own

"""`gpi app`: the whole way from a record to a model in a browser, on this machine only.

A server on 127.0.0.1 shows one page (:mod:`.server`, :mod:`.routes`). Every request must come from that page
(:mod:`.guard`). Files that are dropped on it are kept in a private temporary folder (:mod:`.uploads`). The
search runs in another process (:mod:`.search`, :mod:`.worker`), so that the page answers meanwhile and the
search can be ended at any moment.

The server needs Starlette and uvicorn, which the extra `app` installs.
"""

from importlib.util import find_spec

from gpi_hammerstein._native import ParameterError

__all__ = ["require_libraries"]


def require_libraries() -> None:
    """Refuse to start without the libraries of the server.

    Raises
    ------
    ParameterError
        Starlette or uvicorn is not installed. The message contains the command that installs them.

    Examples
    --------
    >>> require_libraries()
    """
    missing = [name for name in ("starlette", "uvicorn") if find_spec(name) is None]
    if missing:
        raise ParameterError(
            f"`gpi app` needs {' and '.join(missing)}, which is not installed; run: "
            "pip install 'gpi-hammerstein[app]'"
        )

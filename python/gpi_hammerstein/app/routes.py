"""The addresses of the server, and what they answer."""

import asyncio
import json
import math
from collections.abc import AsyncIterator, Awaitable, Callable
from importlib.resources import files
from typing import Any

from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, Request
from starlette.responses import FileResponse, JSONResponse, Response, StreamingResponse
from starlette.routing import Route

from gpi_hammerstein._native import GpiError, ParameterError
from gpi_hammerstein.app.search import RUNNING
from gpi_hammerstein.app.session import OFFERED, Session
from gpi_hammerstein.app.settings import MOST_REQUEST
from gpi_hammerstein.app.uploads import TooLarge
from gpi_hammerstein.app.worker import REPORT
from gpi_hammerstein.json_values import plain
from gpi_hammerstein.report import page_policy

# Where the files of the page are in the package, and what they are.
PAGE = {
    "/": ("app", "browser/app.html", "text/html"),
    "/app.css": ("app", "browser/app.css", "text/css"),
    "/app.js": ("app", "browser/app.js", "text/javascript"),
    "/plots.js": ("app", "browser/plots.js", "text/javascript"),
    "/report.css": ("report", "page.css", "text/css"),
    "/uPlot.css": ("report", "vendor/uPlot.min.css", "text/css"),
    "/uPlot.js": ("report", "vendor/uPlot.iife.min.js", "text/javascript"),
    "/chart.js": ("report", "browser/chart.js", "text/javascript"),
}
# Seconds between two looks at the search: a change is seen at once, and a look costs microseconds.
LOOK = 0.1
# Seconds after which a stream without news says that it is alive, so that a browser does not give up.
ALIVE = 15.0

Answer = Callable[[Request], Awaitable[Response]]


def application(session: Session) -> Starlette:
    """Return the application, without the checks of :mod:`gpi_hammerstein.app.guard`.

    Parameters
    ----------
    session
        What this run remembers.

    Returns
    -------
    Starlette
        The application.

    Examples
    --------
    >>> from pathlib import Path
    >>> len(application(Session(Path("private"))).routes) > 10
    True
    """

    async def state(request: Request) -> Response:
        return JSONResponse(session.state())

    async def receive(request: Request) -> Response:
        name = request.query_params.get("name", "")
        upload = await session.uploads.receive(name, request.headers.get("content-length"), request.stream())
        return JSONResponse({"key": upload.key, "name": upload.name, "size": upload.size})

    async def signals(request: Request) -> Response:
        query = request.query_params
        drawn = session.signals(request.path_params["which"])
        numbers = (real(query.get("from"), 0.0), real(query.get("to"), math.inf))
        experiment = round(real(query.get("experiment"), 0.0))
        return JSONResponse(await run_in_threadpool(drawn.part, experiment, *numbers))

    async def progress(request: Request) -> Response:
        headers = {"X-Accel-Buffering": "no"}
        return StreamingResponse(events(session), media_type="text/event-stream", headers=headers)

    async def result(request: Request) -> Response:
        name = request.path_params["name"]
        path = await run_in_threadpool(session.file, name)
        if "download" in request.query_params:
            return FileResponse(path, filename=name, media_type=OFFERED[name])
        headers = report_headers() if name == REPORT else {}
        return FileResponse(path, headers=headers, media_type=OFFERED[name])

    posts = {
        "/inspect": session.inspect,
        "/search": session.start,
        "/cancel": session.cancel,
        "/drive": session.drive,
        "/export": session.export,
    }
    return Starlette(
        routes=[
            *(Route(path, page_file(*where)) for path, where in PAGE.items()),
            *(Route(path, posted(work, session), methods=["POST"]) for path, work in posts.items()),
            Route("/state", state),
            Route("/files", receive, methods=["POST"]),
            Route("/signals/{which}", signals),
            Route("/progress", progress),
            Route("/results/{name}", result),
        ],
        exception_handlers={
            GpiError: lambda request, error: refusal(session, error),
            # the page was closed while it sent something
            ClientDisconnect: lambda request, error: Response(status_code=400),
            HTTPException: lambda request, error: JSONResponse({"message": error.detail}, error.status_code),
        },
    )


def report_headers() -> dict[str, str]:
    """Return the policy of the report.

    The report is a page of its own with its own script, which its policy permits by its hash. It contains
    names from the user's files. It is therefore shown in a sandbox, as a document of an unknown origin: even
    if a text in it became a script, this script could neither reach the app nor its cookie. Only the page of
    the app may contain it in a frame.
    """
    policy = f"{page_policy()}; sandbox allow-scripts allow-modals; frame-ancestors 'self'"
    # browsers refuse to show a page in a tab that has a sandbox and isolates itself from other windows
    return {"Content-Security-Policy": policy, "Cross-Origin-Opener-Policy": "unsafe-none"}


def page_file(package: str, name: str, kind: str) -> Answer:
    """Return what answers with a file of the package."""
    content = files(f"gpi_hammerstein.{package}").joinpath(name).read_bytes()

    async def answer(request: Request) -> Response:
        return Response(content, media_type=kind)

    return answer


def posted(work: Callable[[dict[str, Any]], dict[str, Any] | None], session: Session) -> Answer:
    """Return what answers to a JSON object with another one; the work is done in a thread."""

    async def answer(request: Request) -> Response:
        body = b""
        async for chunk in request.stream():
            body += chunk
            if len(body) > MOST_REQUEST:
                raise HTTPException(413, f"the request has more than {MOST_REQUEST} bytes")
        try:
            content = json.loads(body or b"{}")
        except ValueError:
            raise HTTPException(400, "the request is not JSON") from None
        if not isinstance(content, dict):
            raise HTTPException(400, "the request is not a JSON object")
        return JSONResponse(plain(await run_in_threadpool(work, content)))

    return answer


def refusal(session: Session, error: Exception) -> Response:
    """Return the message of an error of the package, with the names of files that the user knows."""
    kind = "DataError" if isinstance(error, TooLarge) else type(error).__name__
    content = {"error": kind, "message": session.uploads.shown(str(error))}
    return JSONResponse(content, 413 if isinstance(error, TooLarge) else 422)


async def events(session: Session) -> AsyncIterator[str]:
    """Yield what the search does, as server-sent events, until it ends."""
    seen, silent = -1, 0.0
    while (status := session.status()) is not None:
        if status["version"] != seen:
            seen, silent = status["version"], 0.0
            yield f"data: {json.dumps(plain(status))}\n\n"
        if status["state"] not in RUNNING:
            return
        silent += LOOK
        if silent > ALIVE:
            silent = 0.0
            yield ": alive\n\n"
        await asyncio.sleep(LOOK)


def real(text: str | None, default: float) -> float:
    """Return a number of a query."""
    if text is None:
        return default
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if math.isnan(value):
        raise ParameterError(f"`{text}`: must be a number")
    return value

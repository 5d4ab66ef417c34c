"""The check of every request: it must come from the page that this run of the app has opened.

Other programs and other pages can reach a port of 127.0.0.1 too. These checks keep them out:

- **Host.** A page of another site can let its own name point to 127.0.0.1 (DNS rebinding). Its requests then
  have this name as `Host`, and are refused.
- **Token.** The address that is printed contains a random token. It is exchanged for a cookie, which every
  other request must have. Scripts cannot read the cookie (`HttpOnly`), and requests that another site causes
  do not have it (`SameSite=Strict`). A browser sends a cookie also to other ports of 127.0.0.1, where another
  user may listen. This one is therefore bound to a folder with a random name, in which all pages are.
- **Origin.** A request that changes something must name this server as its `Origin`.
- **Code.** The address with which the browser is started is visible to other users of the machine in the list
  of processes. It contains a code in place of the token, which is valid only once.

Every response has a strict content security policy: the page loads nothing from elsewhere, sends nothing
elsewhere, and runs no script but its own files.
"""

import secrets
from collections.abc import Iterable
from urllib.parse import parse_qs

from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import cookie_parser
from starlette.responses import HTMLResponse, PlainTextResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

POLICY = "; ".join(
    (
        "default-src 'none'",
        "script-src 'self'",
        "style-src 'self'",
        "img-src 'self' data:",
        "connect-src 'self'",
        "frame-src 'self'",
        "frame-ancestors 'none'",
        "form-action 'none'",
        "base-uri 'none'",
    )
)
HEADERS = {
    "Content-Security-Policy": POLICY,
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
}
# Bytes of the random name of the folder: 128 bits cannot be guessed.
PLACE_BYTES = 16
# The cookie is `SameSite=Strict`. If the first address was opened from elsewhere, a browser does not send it
# with a redirection, but it does if this page itself goes on.
ENTRANCE = (
    '<!doctype html><html lang="en"><meta charset="utf-8"><title>gpi app</title>'
    '<link rel="icon" href="data:,">'
    '<meta http-equiv="refresh" content="0; url={place}"><p><a href="{place}">Continue</a>'
)
CLOSED = (
    "This page belongs to a run of `gpi app`, and this request does not come from it. Open the address that "
    "`gpi app` has printed in the terminal.\n"
)


class Guard:
    """The application, behind the checks.

    Parameters
    ----------
    app
        The application.
    port
        The port of the server.
    token
        The secret of this run.
    codes
        Codes that open the page once in place of the token.

    Examples
    --------
    >>> guard = Guard(application, 8000, secrets.token_urlsafe(32))  # doctest: +SKIP
    """

    def __init__(self, app: ASGIApp, port: int, token: str, codes: Iterable[str] = ()) -> None:
        self.app: ASGIApp = app
        self.host: str = f"127.0.0.1:{port}"
        self.origin: str = f"http://{self.host}"
        # Cookies do not distinguish ports: two runs of the app must not take the same name.
        self.cookie: str = f"gpi-app-{port}"
        self.place: str = f"/{secrets.token_urlsafe(PLACE_BYTES)}/"
        self._token = token
        self._codes = set(codes)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, or refuse it."""
        if scope["type"] == "lifespan":
            await self.app(scope, receive, send)
            return

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in HEADERS.items():
                    headers.setdefault(name, value)
            await send(message)

        answer = self._refusal(scope)
        if answer is None:
            own = {**scope, "path": scope["path"][len(self.place) - 1 :]}
            await self.app(own, receive, send_with_headers)
        else:
            await answer(scope, receive, send_with_headers)

    def _refusal(self, scope: Scope) -> Response | None:
        """Return the answer to a request that does not reach the application."""
        headers = Headers(scope=scope)
        if scope["type"] != "http" or headers.getlist("host") != [self.host]:
            return PlainTextResponse("This server has another name.\n", 421)
        if scope["path"] == "/" and scope["method"] == "GET" and scope["query_string"]:
            query = parse_qs(scope["query_string"].decode("latin-1"))
            if self._opens(query.get("token", [""])[0]) or self._opens_once(query.get("code", [""])[0]):
                entrance = HTMLResponse(ENTRANCE.format(place=self.place))
                entrance.set_cookie(
                    self.cookie, self._token, path=self.place, httponly=True, samesite="strict"
                )
                return entrance
        cookies = cookie_parser(headers.get("cookie", ""))
        if not scope["path"].startswith(self.place) or not self._opens(cookies.get(self.cookie, "")):
            return PlainTextResponse(CLOSED, 403)
        if scope["method"] not in ("GET", "HEAD") and headers.getlist("origin") != [self.origin]:
            return PlainTextResponse("This request comes from another page.\n", 403)
        return None

    def _opens(self, given: str) -> bool:
        """Compare in a time that does not depend on the place of the first difference."""
        return secrets.compare_digest(given.encode(), self._token.encode())

    def _opens_once(self, given: str) -> bool:
        found = [code for code in self._codes if secrets.compare_digest(given.encode(), code.encode())]
        self._codes.difference_update(found)
        return bool(found)

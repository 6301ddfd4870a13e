"""A request in, the same request if it comes from this machine's own page, else a refusal out.

The page has the rights of who started it: it reads and writes files and starts programs. So it listens on loopback alone; every
request needs a secret that only the terminal has shown; names that lead here from outside (DNS rebinding) are refused, so is
whatever another page has a browser send. An answer may load nothing from anywhere else.
"""

from __future__ import annotations

import hmac
from collections.abc import Mapping
from dataclasses import dataclass
from html import escape
from urllib.parse import parse_qsl

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import HTMLResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

#: What a page of ours may load and do: itself, its own style and script, pictures that are in it.
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; form-action 'self'; "
    "frame-src 'self'; frame-ancestors 'self'; base-uri 'none'"
)
#: What a report may, which has its style in it, and no script.
POLICY_OF_REPORT = (
    "default-src 'none'; style-src 'unsafe-inline'; img-src data:; frame-ancestors 'self'; base-uri 'none'; sandbox"
)

#: Methods that change nothing, which a link may have.
SAFE = ("GET", "HEAD")

_HEADERS: Mapping[str, str] = {
    "Cache-Control": "no-store",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "same-origin",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "SAMEORIGIN",
}


@dataclass(frozen=True)
class Door:
    """Who is let in.

    Attributes
    ----------
    token : the secret, as the address in the terminal has it.
    port : on which the page is; names of this machine on it are the only ones that it answers to.
    once : another secret, that lets in a single time: other users of this machine may see what a browser is started with.
    """

    token: str
    port: int
    once: str = ""

    @property
    def hosts(self) -> tuple[str, ...]:
        """What a request may call this machine."""
        port = "" if self.port == 80 else f":{self.port}"  # which browsers leave out
        return tuple(f"{name}{port}" for name in ("127.0.0.1", "localhost"))

    @property
    def cookie(self) -> str:
        """Name of the cookie that holds the secret; of each port one, as browsers tell no ports apart."""
        return f"calib-{self.port}"

    @property
    def address(self) -> str:
        """What to open in a browser."""
        return f"http://{self.hosts[0]}/?token={self.token}"

    @property
    def address_once(self) -> str:
        """The same, for a browser that is started with it."""
        return f"http://{self.hosts[0]}/?token={self.once}"


class Guarded:
    """An application that only requests of its own page reach; that a secret for once was used is the one thing it keeps."""

    def __init__(self, app: ASGIApp, door: Door) -> None:
        self.app, self.door = app, door
        self._once = door.once

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, or refuse it."""
        if scope["type"] == "lifespan":
            await self.app(scope, receive, send)
            return
        if scope["type"] != "http":  # there are no sockets here
            await send({"type": "websocket.close", "code": 1008})
            return

        async def safely(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in {**_HEADERS, "Content-Security-Policy": POLICY}.items():
                    headers.setdefault(name, value)
            await send(message)

        refused = self._refusal(scope)
        await (self.app if refused is None else refused)(scope, receive, safely)

    def _refusal(self, scope: Scope) -> Response | None:
        """Why a request is refused, or the page that lets in who has the secret; None for a request that is let in."""
        headers, door = Headers(scope=scope), self.door
        host = headers.get("host", "")
        if host not in door.hosts:
            return _said(403, "This address is not that of the page", f"Open http://{door.hosts[0]} on the machine it runs on.")
        if scope["method"] not in SAFE and not _from_our_page(headers, host):
            return _said(403, "Another page asked for this", "Only calib's own page may change what is here.")
        given = _given(scope.get("query_string", b"")) if scope["path"] == "/" else ""
        if given and scope["method"] == "GET":
            if self._once and _same(given, self._once):
                self._once = ""
            elif not _same(given, door.token):
                return _said(403, "This address is out of date", _AGAIN)
            # Not a redirection, which a browser that comes from elsewhere would follow without the cookie.
            page = _page("calib", '<p><a href="/">Go on</a></p>', '<meta http-equiv="refresh" content="0; url=/">')
            entered = HTMLResponse(page)
            entered.set_cookie(door.cookie, door.token, httponly=True, samesite="strict", path="/")
            return entered
        if headers.get("sec-fetch-site") in ("cross-site", "same-site"):
            return _said(403, "Another page asked for this", "Open the page by its address, or go on in its own tab.")
        if not any(_same(value, door.token) for value in _cookies(headers.get("cookie", ""), door.cookie)):
            return _said(403, "This browser has not been let in", _AGAIN)
        return None


_AGAIN = "Open the address that `calib serve` shows in its terminal; it ends in a secret that lets you in."


def _from_our_page(headers: Headers, host: str) -> bool:
    """Whether a request that changes something comes from a page of ours: browsers say so of each, and no page can forge it."""
    origin = headers.get("origin")
    return origin == f"http://{host}" if origin is not None else headers.get("sec-fetch-site") == "same-origin"


def _same(one: str, other: str) -> bool:
    return hmac.compare_digest(one.encode("utf-8", "replace"), other.encode())


def _cookies(header: str, name: str) -> list[str]:
    """What stands under a name among cookies: browsers send those of every port of this machine, of any form and name."""
    pairs = (part.strip().partition("=") for part in header.split(";"))
    return [value for key, _, value in pairs if key == name]


def _given(query: bytes) -> str:
    """The secret in an address; "" if none, or no address of ours."""
    try:
        return dict(parse_qsl(query.decode("latin-1"), max_num_fields=8)).get("token", "")
    except ValueError:
        return ""


def _said(status: int, what: str, advice: str) -> Response:
    return HTMLResponse(_page(what, f"<h1>{escape(what)}</h1><p>{escape(advice)}</p>"), status)


def _page(title: str, body: str, head: str = "") -> str:
    begin = '<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><link rel="icon" href="data:,">'
    return f"{begin}<title>{escape(title)}</title>{head}</head><body><main>{body}</main></body></html>"

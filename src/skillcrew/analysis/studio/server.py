"""The studio as a server: who asks is looked at first, what is answered is only ever read."""

import json
import socket
import socketserver
import sys
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import parse_qs

from skillcrew.analysis.page.assemble import Template, assemble
from skillcrew.analysis.studio.guard import Guard
from skillcrew.analysis.studio.studio import Studio
from skillcrew.errors import UserError, one_line

TABLE = Template(
    "studio.html",
    ("look.css", "parts.css", "studio.css"),
    ("text.js", "theme.js", "chart.js", "curves.js", "table.js", "studio.js"),
    loads="; connect-src 'self'",
)
LINE = Template("line.html", ("look.css",))
"""Instead of the page of a run: one line."""

HEADERS = {
    "Cache-Control": "no-store",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
}
NOTHING = "default-src 'none'; frame-ancestors 'none'"
OWN_PAGE = "frame-ancestors 'none'"
"""What else is allowed, the page itself says."""
SANDBOX = "sandbox allow-scripts; default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'"
"""Of the page of a run, whose own policy is stricter yet: it is of no site, and reaches nobody."""

AGAIN = 2
"""Seconds after which a browser asks again for a page that is being made."""

SLOWEST = 30.0
"""Seconds that a request may take to arrive."""


class Server(ThreadingHTTPServer):
    """Listens for browsers.

    Args:
        studio: what is shown.
        host: name or address to listen at.
        port: likewise; 0 for any that is free.

    Raises:
        UserError: it cannot listen there.
    """

    daemon_threads = True
    allow_reuse_port = False

    def __init__(self, studio: Studio, host: str, port: int):
        self.studio = studio
        try:
            self.address_family, _, _, _, address = socket.getaddrinfo(
                host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
            )[0]
            super().__init__((str(address[0]), int(address[1])), Handler)
        except (OSError, OverflowError, UnicodeError) as error:
            raise UserError(_refused(host, port, error)) from error
        self.guard = Guard(host, self.server_port)
        shown = f"[{host}]" if ":" in host else host
        self.url = f"http://{shown}:{self.server_port}/"

    def server_bind(self) -> None:
        """Without asking the network for the machine's name, which may take long."""
        socketserver.TCPServer.server_bind(self)
        self.server_name, self.server_port = str(self.server_address[0]), int(self.server_address[1])

    def handle_error(self, request: Any, client_address: Any) -> None:
        """One line for what goes wrong in a request; nothing for a browser that went away."""
        error = sys.exception()
        if not isinstance(error, OSError):
            print(f"skillcrew: studio: {one_line(repr(error))}", file=sys.stderr)


def _refused(host: str, port: int, error: Exception) -> str:
    said = getattr(error, "strerror", None) or str(error)
    if isinstance(error, socket.gaierror | UnicodeError):
        return f"--host {host}: no name or address of this machine ({said})"
    return f"--port {port}: cannot be listened at on {host} ({said.lower()}); give another, or 0 for any"


class Handler(BaseHTTPRequestHandler):
    """Answers one request."""

    server_version = "skillcrew"
    sys_version = ""
    timeout = SLOWEST

    def do_GET(self) -> None:
        """Answers, or says why not."""
        assert isinstance(self.server, Server)
        studio = self.server.studio
        if (refused := self.server.guard.refusal(self.headers)) is not None:
            self._answer(f"refused: {refused}\n", "text/plain", HTTPStatus.FORBIDDEN)
            return
        path, _, query = self.path.partition("?")
        keys = parse_qs(query).get("run", [])
        if path == "/":
            self._answer(assemble(None, "Runs", TABLE), "text/html", policy=OWN_PAGE)
        elif path == "/runs":
            self._answer(as_json(studio.runs()), "application/json")
        elif path == "/curves":
            self._answer(as_json(studio.curves(keys)), "application/json")
        elif path == "/page" and len(keys) == 1:
            self._page(studio, keys[0])
        elif path == "/favicon.ico":
            self._answer("", "text/plain", HTTPStatus.NO_CONTENT)
        else:
            self._answer("there is nothing of that name here\n", "text/plain", HTTPStatus.NOT_FOUND)

    do_HEAD = do_GET

    def _not_allowed(self) -> None:
        self.close_connection = True
        self._answer("nothing can be changed here\n", "text/plain", HTTPStatus.METHOD_NOT_ALLOWED)

    do_POST = do_PUT = do_DELETE = do_PATCH = do_OPTIONS = do_TRACE = do_CONNECT = _not_allowed

    def _page(self, studio: Studio, key: str) -> None:
        try:
            shown = studio.page(key)
        except UserError as error:
            self._line(str(error), HTTPStatus.NOT_FOUND)
            return
        if shown.page is not None:
            self._answer(shown.page, "text/html", policy=SANDBOX)
        else:
            self._line(shown.line, HTTPStatus.OK, {"Refresh": str(AGAIN)} if shown.waits else {})

    def _line(self, line: str, status: HTTPStatus, headers: dict[str, str] | None = None) -> None:
        self._answer(assemble(None, line, LINE), "text/html", status, OWN_PAGE, headers)

    def _answer(
        self,
        text: str,
        kind: str,
        status: HTTPStatus = HTTPStatus.OK,
        policy: str = NOTHING,
        headers: dict[str, str] | None = None,
    ) -> None:
        body = text.encode("utf-8", "replace")
        self.send_response(status)
        of_this = {"Content-Type": f"{kind}; charset=utf-8", "Content-Length": str(len(body))}
        policies = {"Content-Security-Policy": policy}
        allow = {"Allow": "GET, HEAD"} if status == HTTPStatus.METHOD_NOT_ALLOWED else {}
        for name, value in {**HEADERS, **policies, **of_this, **allow, **(headers or {})}.items():
            self.send_header(name, value)
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(body)

    def log_message(self, format: str, *args: Any) -> None:
        """Nothing: a browser asks every second."""


def as_json(value: Any) -> str:
    """Plain JSON: no number in it is none."""
    return json.dumps(value, allow_nan=False, separators=(",", ":"))

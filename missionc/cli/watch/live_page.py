"""Local web server for a live report: the report in a frame, a banner above it, and server-sent events.

The frame shows the written file, byte for byte. The page around it listens to one stream of server-sent events and
reloads the frame when there is another report.
"""

from __future__ import annotations

import base64
import hashlib
import json
import threading
from dataclasses import asdict, replace
from functools import cached_property
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler
from pathlib import Path
from typing import Literal, Self

from missionc.base.late_dataclass import Record
from missionc.cli.page_server import PageServer, Quiet
from missionc.tools.guard import NAMES

PAGE = (Path(__file__).resolve().parent / "live.html").read_text(encoding="utf-8")
POLICY = (
    "default-src 'none'; script-src 'sha256-{}'; style-src 'unsafe-inline'; img-src data:; frame-src 'self'; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
SILENCE = 10.0
"""Seconds without news after which a message is sent, to detect closed pages."""

State = Literal["checking", "planning", "planned", "wrong"]


class News(Record):
    """Contents of a page: mission, status and findings."""

    mission: str
    state: State = "checking"
    says: str = ""
    report: int = 0
    """Number of reports so far, including the displayed one."""


class LivePage:
    """Context manager during which the page is available on this machine."""

    def __init__(self, mission: str) -> None:
        self._news = News(mission)
        self._report = b""
        self._changed = threading.Condition()
        self._server = _Server(_Handler)
        self._server.live = self

    def __enter__(self) -> Self:
        self._server.begin()
        return self

    def __exit__(self, *exception: object) -> None:
        self._server.end()

    @property
    def address(self) -> str:
        return f"http://{NAMES[0]}:{self._server.server_port}/"

    @property
    def hosts(self) -> tuple[str, ...]:
        """Names of this machine with the port, as requests must state them; other names indicate DNS rebinding."""
        return tuple(f"{name}:{self._server.server_port}" for name in NAMES)

    @property
    def report(self) -> bytes:
        return self._report

    def tell(self, state: State, says: str = "", report: bytes = b"") -> None:
        """Send the status to every open page.

        Args:
            state: status.
            says: findings as text.
            report: new report; empty if the current one stays.
        """
        with self._changed:
            self._news = replace(self._news, state=state, says=says, report=self._news.report + bool(report))
            self._report = report or self._report
            self._changed.notify_all()

    def news(self, known: News | None) -> News:
        """Wait for contents that differ from ``known``, at most ``SILENCE`` seconds, and return the current ones."""
        with self._changed:
            self._changed.wait_for(lambda: self._news != known, SILENCE)
            return self._news


class _Server(PageServer):
    live: LivePage

    @cached_property
    def policy(self) -> str:
        script = PAGE.partition("<script>")[2].partition("</script>")[0]
        return POLICY.format(base64.b64encode(hashlib.sha256(script.encode("utf-8")).digest()).decode("ascii"))


class _Handler(Quiet, BaseHTTPRequestHandler):
    server: _Server

    def do_GET(self) -> None:
        if self.headers.get("Host") not in self.server.live.hosts:
            self.send_error(HTTPStatus.FORBIDDEN)
            return
        match self.path.partition("?")[0]:
            case "/":
                self._send(PAGE.encode("utf-8"), "text/html; charset=utf-8", self.server.policy)
            case "/report.html" if self.server.live.report:
                self._send(self.server.live.report, "text/html; charset=utf-8", "frame-ancestors 'self'")
            case "/news":
                self._stream()
            case _:
                self.send_error(HTTPStatus.NOT_FOUND)

    def _send(self, content: bytes, kind: str, policy: str) -> None:
        self._begin(kind)
        self.send_header("Content-Security-Policy", policy)
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        self.wfile.write(content)

    def _stream(self) -> None:
        self._begin("text/event-stream")
        self.end_headers()
        known: News | None = None
        while True:
            news = self.server.live.news(known)
            line = f"data: {json.dumps(asdict(news))}" if news != known else ": nothing new"
            self.wfile.write(f"{line}\n\n".encode())
            known = news

    def _begin(self, kind: str) -> None:
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", kind)
        self.send_header("Cache-Control", "no-store")
        self.send_header("X-Content-Type-Options", "nosniff")

"""Web page of a flight in progress, with a local server, which shows the events of an online monitoring session.

It is available on this machine only, behind the guard. All data is stored here, so that a page that is opened late or
reloaded shows the same; each open page listens to one stream of server-sent events.
"""

from __future__ import annotations

import json
import secrets
import threading
import time
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler
from typing import TYPE_CHECKING, Self

from missionc.cli.page_server import PageServer, Quiet
from missionc.tools.guard import ALWAYS, Guard

if TYPE_CHECKING:  # loads arrays
    from missionc.base.trace import Trace
    from missionc.ir import Mission
    from missionc.ir.kernel.nodes import Kernel
    from missionc.output.flight_page.flight_record import Seen, Tone
    from missionc.verification.monitoring.live.session import Event

PAUSE = 0.1
"""Minimum time between two messages to a page, seconds."""

SILENCE = 1.0
"""Time after which a page without news gets an empty message, seconds."""

MOST_PAGES = 16


class FlightPage:
    """Context manager during which the page of one flight is available at ``address``.

    The program that flies, or monitors the flight, calls its methods; each call takes microseconds, from any thread::

        session = Session(mission, kernel)
        with FlightPage(mission, kernel) as page:
            page.set_plan(trace)              # the current plan, drawn as paths; again when it changes
            for event in session.feed(line):
                page.publish(event)           # steps, verdicts, missing agents: all events of the session
            page.heard(session.steps.newest)  # a sample has arrived, even if it completes no step
            page.tell("`north` is closed", "risk", t=12.0)  # a line of news, with a time of the mission
            page.set_world(changed, kernel)   # other regions or obstacles; the same agents, steps and goals
            page.end("the mission is over")   # no more events; the page stays until the context ends

    Final verdicts, missing agents and speeds above the maximum become news automatically.
    """

    def __init__(self, mission: Mission, kernel: Kernel) -> None:
        from missionc.output.flight_page.flight_record import FlightRecord

        self._record = FlightRecord(mission, kernel)
        self._changed = threading.Condition()
        self._count = 0
        self._server = _Server(_Handler)
        self._server.page = self
        self.guard = Guard(secrets.token_urlsafe(24), self._server.server_port)

    def __enter__(self) -> Self:
        self._server.begin()
        return self

    def __exit__(self, *exception: object) -> None:
        self._server.end()

    @property
    def address(self) -> str:
        """Address of the page with its token, which gives access to the page."""
        return self.guard.address

    # ------------------------------------------------------------------ writing

    def publish(self, event: Event) -> None:
        """Show an event of an online monitoring session."""
        with self._changed:
            self._record.take(event)
            self._news()

    def heard(self, newest: float) -> None:
        """Record that a sample has arrived.

        Args:
            newest: latest time of all samples, seconds of the mission.
        """
        with self._changed:
            self._record.hear(newest)

    def tell(self, says: str, tone: Tone = "plain", t: float | None = None) -> None:
        """Add a line of news.

        Args:
            says: text of the line.
            tone: ``plain``, ``good``, ``risk`` or ``bad``.
            t: time, seconds of the mission; None for none.
        """
        with self._changed:
            self._record.tell(says, tone, t)
            self._news()

    def set_plan(self, trace: Trace | None) -> None:
        """Set the current plan, or None for no plan."""
        with self._changed:
            self._record.set_plan(trace)
            self._news()

    def set_world(self, mission: Mission, kernel: Kernel) -> None:
        """Set a mission with changed regions or obstacles; agents, steps and goals must be the same."""
        with self._changed:
            self._record.set_world(mission, kernel)
            self._news()

    def end(self, says: str) -> None:
        """End the flight, with the result in words."""
        with self._changed:
            self._record.end(says)
            self._news()

    def _news(self) -> None:
        self._count += 1
        self._changed.notify_all()

    # ------------------------------------------------------------------ reading

    def since(self, seen: Seen | None, count: int) -> tuple[Seen, int, bytes]:
        """Wait for changes, at most ``SILENCE`` seconds.

        Args:
            seen: state that a page shows; None for an empty page.
            count: number of changes that it has received.

        Returns:
            New state of the page, the new number of changes, and the message as JSON.
        """
        with self._changed:
            self._changed.wait_for(lambda: self._count != count, SILENCE)
            count = self._count
            known, told = self._record.since(seen)
        return known, count, json.dumps(told(), separators=(",", ":"), allow_nan=False).encode()


class _Server(PageServer):
    page: FlightPage

    def __init__(self, handler: type[BaseHTTPRequestHandler]) -> None:
        from missionc.output.flight_page.flight_record import flight_html

        super().__init__(handler)
        self.html, self.policy = flight_html()
        self.places = threading.BoundedSemaphore(MOST_PAGES)


class _Handler(Quiet, BaseHTTPRequestHandler):
    server: _Server

    def do_GET(self) -> None:
        match self.server.page.guard.path(self.path, self.headers):
            case "":
                self._begin(HTTPStatus.OK, "text/html; charset=utf-8")
                self.send_header("Content-Security-Policy", self.server.policy)
                self.send_header("Content-Length", str(len(self.server.html)))
                self.end_headers()
                self.wfile.write(self.server.html)
            case "news":
                self._stream()
            case None:
                self._refuse(HTTPStatus.FORBIDDEN)
            case _:
                self._refuse(HTTPStatus.NOT_FOUND)

    def _stream(self) -> None:
        if not self.server.places.acquire(blocking=False):
            self._refuse(HTTPStatus.SERVICE_UNAVAILABLE)
            return
        try:
            self._begin(HTTPStatus.OK, "text/event-stream")
            self.end_headers()
            seen, count = None, -1
            while True:
                seen, count, message = self.server.page.since(seen, count)
                self.wfile.write(b"data: " + message + b"\n\n")
                time.sleep(PAUSE)
        finally:
            self.server.places.release()

    def _refuse(self, status: HTTPStatus) -> None:
        content = f"{status.phrase.lower()}\n".encode()
        self._begin(status, "text/plain")
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        self.wfile.write(content)

    def _begin(self, status: HTTPStatus, kind: str) -> None:
        self.send_response_only(status)
        self.send_header("Content-Type", kind)
        for name, value in ALWAYS.items():
            self.send_header(name, value)

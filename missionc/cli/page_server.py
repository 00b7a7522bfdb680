"""Servers of a page on this machine alone: how they begin and end, and what they keep to themselves."""

from __future__ import annotations

import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from socketserver import StreamRequestHandler

from missionc.tools.guard import NAMES


class PageServer(ThreadingHTTPServer):
    """A server on a port that is free; each request has a thread, for which nobody waits at the end."""

    daemon_threads = True
    block_on_close = False

    def __init__(self, handler: type[BaseHTTPRequestHandler]) -> None:
        super().__init__((NAMES[0], 0), handler)
        self._thread = threading.Thread(target=self.serve_forever, args=(0.1,), daemon=True)

    def begin(self) -> None:
        """Answer from now on."""
        self._thread.start()

    def end(self) -> None:
        """Answer nobody any more."""
        self.shutdown()
        self.server_close()

    def handle_error(self, request: object, client_address: object) -> None:
        """A browser that hangs up is no news."""


class Quiet(StreamRequestHandler):
    """What every handler of requests has: the terminal hears nothing of them, it is for findings."""

    timeout = 30

    def log_message(self, format: str, *words: object) -> None:
        """Nothing is written."""

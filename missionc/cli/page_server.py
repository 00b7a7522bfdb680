"""Local servers of a page on this machine: start, end and access."""

from __future__ import annotations

import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from socketserver import StreamRequestHandler

from missionc.tools.guard import NAMES


class PageServer(ThreadingHTTPServer):
    """Server on a free port; each request has a thread, and the end waits for none."""

    daemon_threads = True
    block_on_close = False

    def __init__(self, handler: type[BaseHTTPRequestHandler]) -> None:
        super().__init__((NAMES[0], 0), handler)
        self._thread = threading.Thread(target=self.serve_forever, args=(0.1,), daemon=True)

    def begin(self) -> None:
        """Start answering requests."""
        self._thread.start()

    def end(self) -> None:
        """Stop answering requests."""
        self.shutdown()
        self.server_close()

    def handle_error(self, request: object, client_address: object) -> None:
        """Ignore browsers that close the connection."""


class Quiet(StreamRequestHandler):
    """Common part of all request handlers: prints nothing on the terminal, which is for findings."""

    timeout = 30

    def log_message(self, format: str, *words: object) -> None:
        """Write nothing."""

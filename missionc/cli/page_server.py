"""Local web servers for one page each, available on this machine only."""

from __future__ import annotations

import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from socketserver import StreamRequestHandler

from missionc.tools.guard import NAMES


class PageServer(ThreadingHTTPServer):
    """Server on a free port; each request has a thread, and the server ends without waiting for them."""

    daemon_threads = True
    block_on_close = False

    def __init__(self, handler: type[BaseHTTPRequestHandler]) -> None:
        super().__init__((NAMES[0], 0), handler)
        self._thread = threading.Thread(target=self.serve_forever, args=(0.1,), daemon=True)

    def begin(self) -> None:
        """Start the thread that answers requests."""
        self._thread.start()

    def end(self) -> None:
        """Stop answering requests, and close the port."""
        self.shutdown()
        self.server_close()

    def handle_error(self, request: object, client_address: object) -> None:
        """Ignore errors of a connection, such as a browser that closes it."""


class Quiet(StreamRequestHandler):
    """Base class of request handlers that print nothing on the terminal."""

    timeout = 30

    def log_message(self, format: str, *words: object) -> None:
        """Do nothing, instead of logging a request."""

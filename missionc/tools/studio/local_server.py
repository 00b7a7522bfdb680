"""HTTP server of the studio: its page, reports, and a WebSocket for each open page, on this machine only."""

from __future__ import annotations

import asyncio
import logging
import secrets
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from http import HTTPStatus
from pathlib import Path

from websockets.asyncio.server import ServerConnection, serve
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

from missionc.tools.guard import ALWAYS, NAMES, Guard
from missionc.tools.studio.session import Session
from missionc.tools.studio.workplace import Workplace

ASSETS = Path(__file__).resolve().parent / "assets"
KINDS = {".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml"}
FILES = {"": "index.html", "studio.js": "studio.js", "studio.css": "studio.css", "icon.svg": "icon.svg"}
"""Files of the page by request path; no other files of the disk are served."""
SOCKET = "socket"
NONCE = "%%NONCE%%"

PAGE = (
    "default-src 'none'; script-src 'self'; style-src 'self' 'nonce-{nonce}'; style-src-attr 'unsafe-inline'; "
    "img-src 'self' data:; frame-src 'self'; connect-src 'self' ws://127.0.0.1:{port} ws://localhost:{port}; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
"""Content security policy of the page.

CodeMirror's styles carry the nonce; browsers style inserted words inline.
"""

REPORT = "sandbox allow-scripts; frame-ancestors 'self'"
"""Additional policy of a report page: without an origin, it cannot send requests to this server."""

MOST_PAGES = 8
"""Maximum number of open pages; each has a language server."""
LONGEST_MESSAGE = 1 << 20
"""Maximum size of a message, bytes: a text of maximum size with all characters escaped, and some overhead."""

log = logging.getLogger(__name__)
log.addHandler(logging.NullHandler())
log.propagate = False


class LocalServer:
    """Server that answers the requests that the guard accepts."""

    def __init__(self, workplace: Workplace) -> None:
        self._workplace = workplace
        self._open = 0
        self._files = {name: (ASSETS / file).read_bytes() for name, file in FILES.items()}
        self.guard = Guard(secrets.token_urlsafe(24), 0)

    @asynccontextmanager
    async def serving(self) -> AsyncIterator[None]:
        """Context manager during which the page is available at the guard's ``address``."""
        async with serve(
            self._speak,
            NAMES[0],
            0,
            process_request=self._respond,
            max_size=LONGEST_MESSAGE,
            compression=None,
            ping_interval=None,
            close_timeout=1,
            server_header=None,
            logger=log,
        ) as server:
            port = server.sockets[0].getsockname()[1]
            self.guard = Guard(self.guard.token, port)
            yield

    def _respond(self, connection: ServerConnection, request: Request) -> Response | None:
        """HTTP response to a request; None if it may open a WebSocket."""
        name = self.guard.path(request.path, request.headers)
        if name is None:
            return _answer(HTTPStatus.FORBIDDEN, b"forbidden\n", "text/plain")
        if name == SOCKET:
            if not self.guard.opens(request.headers):
                return _answer(HTTPStatus.FORBIDDEN, b"forbidden\n", "text/plain")
            full = self._open >= MOST_PAGES
            return _answer(HTTPStatus.SERVICE_UNAVAILABLE, b"too many pages\n", "text/plain") if full else None
        if name in self._files:
            content = self._files[name]
            kind = KINDS[Path(FILES[name]).suffix]
            nonce = secrets.token_urlsafe(12)
            policy = PAGE.format(nonce=nonce, port=self.guard.port)
            return _answer(HTTPStatus.OK, content.replace(NONCE.encode(), nonce.encode()), kind, policy)
        if name in self._workplace.reports:
            return _answer(HTTPStatus.OK, self._workplace.reports[name], KINDS[".html"], REPORT)
        return _answer(HTTPStatus.NOT_FOUND, b"not found\n", "text/plain")

    async def _speak(self, socket: ServerConnection) -> None:
        """Exchange messages between one page's socket and its session."""
        outgoing: asyncio.Queue[str] = asyncio.Queue()

        async def send() -> None:
            while True:
                await socket.send(await outgoing.get())

        self._open += 1
        sender = asyncio.ensure_future(send())
        session = Session(self._workplace, outgoing.put_nowait)
        session.__enter__()
        try:
            async for message in socket:
                session.receive(message)
        except ConnectionClosed:
            pass
        finally:
            sender.cancel()
            self._open -= 1
            # It waits for a planner to end.
            await asyncio.to_thread(session.__exit__, None, None, None)


def _answer(status: HTTPStatus, content: bytes, kind: str, policy: str = "default-src 'none'") -> Response:
    headers = Headers(
        {
            **ALWAYS,
            "Content-Type": f"{kind}; charset=utf-8",
            "Content-Length": str(len(content)),
            "Content-Security-Policy": policy,
            "Connection": "close",
        }
    )
    return Response(status.value, status.phrase, headers, content)

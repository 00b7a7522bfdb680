"""A studio's server in a thread, with requests of a browser and of an attacker."""

from __future__ import annotations

import asyncio
import http.client
import itertools
import json
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any, Self
from urllib.parse import urlsplit

from websockets.sync.client import ClientConnection, connect

from missionc.base.limits import Limits
from missionc.cli.studio_planner import StudioPlanner
from missionc.tools.studio.local_server import LocalServer
from missionc.tools.studio.text_file import TextFile, opened_text
from missionc.tools.studio.workplace import Workplace

PATIENCE = 60.0
"""Timeout in seconds, far more than any answer takes."""


class Page:
    """Page with its socket; ``told`` are the received notifications."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket
        self.told: list[dict[str, Any]] = []
        self._numbers = itertools.count(1)

    def ask(self, method: str, **params: Any) -> Any:
        """Result of a request, or its error as ``{"error": …}``."""
        number = next(self._numbers)
        self.send({"id": number, "method": method, "params": params})
        while True:
            message = json.loads(self.socket.recv(PATIENCE))
            if message.get("id") == number:
                return message["result"] if "result" in message else {"error": message["error"]}
            self.told.append(message)

    def send(self, message: dict[str, Any]) -> None:
        self.socket.send(json.dumps({"jsonrpc": "2.0", **message}))

    def hear(self, method: str) -> Any:
        """Parameters of the next notification of this kind."""
        while True:
            for message in self.told:
                if message.get("method") == method:
                    self.told.remove(message)
                    return message["params"]
            self.told.append(json.loads(self.socket.recv(PATIENCE)))

    def open_text(self, text: str, version: int = 1) -> str:
        """Start like a page, with a text of its own instead of the first one; returns its URI."""
        uri = str(self.ask("studio/begin")["uri"])
        self.ask("initialize", processId=None, rootUri=None, capabilities={})
        self.send({"method": "initialized", "params": {}})
        document = {"uri": uri, "languageId": "mission", "version": version, "text": text}
        self.send({"method": "textDocument/didOpen", "params": {"textDocument": document}})
        return uri


class Serving:
    """Running server; ``address`` is that of the page with its token."""

    def __init__(self, home: Path, first: TextFile, plans: Path) -> None:
        self.server = LocalServer(Workplace(home, first, plans, partial(StudioPlanner, 0.0)))
        self._loop = asyncio.new_event_loop()
        self._ended = asyncio.Event()
        self._ready = threading.Event()
        self._thread = threading.Thread(target=self._run)

    def __enter__(self) -> Self:
        self._thread.start()
        assert self._ready.wait(PATIENCE)
        return self

    def __exit__(self, *exception: object) -> None:
        self._loop.call_soon_threadsafe(self._ended.set)
        self._thread.join(PATIENCE)
        assert not self._thread.is_alive()

    def _run(self) -> None:
        async def serve() -> None:
            async with self.server.serving():
                self._ready.set()
                await self._ended.wait()

        self._loop.run_until_complete(serve())
        self._loop.close()

    @property
    def address(self) -> str:
        return self.server.guard.address

    def get(self, path: str | None = None, **headers: str) -> tuple[int, bytes, dict[str, str]]:
        """Status, content and headers of the answer; ``path`` is sent unchanged, by default the page's own."""
        parts = urlsplit(self.address)
        client = http.client.HTTPConnection("127.0.0.1", parts.port or 0, timeout=PATIENCE)
        client.putrequest("GET", parts.path if path is None else path, skip_host="Host" in headers)
        for name, value in headers.items():
            client.putheader(name.replace("_", "-"), value)
        client.endheaders()
        answer = client.getresponse()
        content = answer.read()
        client.close()
        return answer.status, content, {name.lower(): value for name, value in answer.getheaders()}

    @contextmanager
    def page(self, origin: str | None = None) -> Iterator[Page]:
        parts = urlsplit(self.address)
        own = f"http://{parts.netloc}"
        with connect(f"ws://{parts.netloc}{parts.path}socket", origin=origin or own, open_timeout=PATIENCE) as socket:  # type: ignore[arg-type]
            yield Page(socket)


@contextmanager
def studio(home: Path, text: str, name: str = "a.mission") -> Iterator[Serving]:
    """Studio with a text from a file in its folder."""
    path = home / name
    path.write_bytes(text.encode("utf-8"))
    first = opened_text(path, Limits())
    assert isinstance(first, TextFile)
    plans = home.parent / "plans"
    plans.mkdir()
    with Serving(home, first, plans) as serving:
        yield serving

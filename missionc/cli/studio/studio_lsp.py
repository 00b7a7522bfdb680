"""The language server of one page: it knows the one text that is open there, and hands on what the map shows."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from missionc.lsp.open_text import LIMITS, OpenText
from missionc.lsp.scene.scene import Json, scene
from missionc.lsp.server import Server, made


class StudioLsp(Server):
    """Args:
    allowed: whether a text is the one that is open; of others nothing is read, nor what they would include.
    show: called with each version of the text and its scene, in the loop's thread.
    """

    def __init__(self, allowed: Callable[[str], bool], show: Callable[[OpenText, Json | None], None]) -> None:
        super().__init__()
        self._allowed, self._show = allowed, show
        self._tasks: set[asyncio.Task[None]] = set()
        made(self)

    def put(self, uri: str, version: int) -> None:
        if not self._allowed(uri):
            return
        super().put(uri, version)
        task = asyncio.ensure_future(self._draw(self.open[uri]))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _draw(self, text: OpenText) -> None:
        """The scene of a text, unless there is a newer version by then."""

        def made_scene() -> Json | None:
            return scene(text.source, text.outline.declarations, LIMITS)

        drawn = await asyncio.to_thread(made_scene)
        if self.open.get(text.uri) is text:
            self._show(text, drawn)

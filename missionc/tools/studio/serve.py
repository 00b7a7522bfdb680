"""Life of the studio from its first page to Ctrl-C: the server, its folder for plans, and the browser."""

from __future__ import annotations

import asyncio
import os
import signal
import tempfile
from collections.abc import Callable
from pathlib import Path

from missionc.base.signals import Stopped
from missionc.base.supervision import HANDLED
from missionc.tools.studio.local_server import LocalServer
from missionc.tools.studio.planner import NewPlanner
from missionc.tools.studio.text_file import TextFile
from missionc.tools.studio.workplace import Workplace

PREFIX = "missionc-studio-"
"""Prefix of the folder for plans, which is in the system's temporary folder."""


def serve(home: Path, first: TextFile, planner: NewPlanner, ready: Callable[[str], None]) -> None:
    """Serve until a signal arrives.

    Args:
        home: the only folder in which missions are opened and saved.
        first: initial text of a page.
        planner: as in ``Workplace``.
        ready: called with the page's address once it is available.

    Raises:
        Stopped: always, at the end; the folder for plans is removed by then.
    """
    with tempfile.TemporaryDirectory(prefix=PREFIX) as plans:
        number = asyncio.run(_serve(Workplace(home, first, Path(plans), planner), ready))
    raise Stopped(number)


async def _serve(workplace: Workplace, ready: Callable[[str], None]) -> int:
    """Serve, and return the number of the signal that ended it."""
    loop = asyncio.get_running_loop()
    ended: asyncio.Future[int] = loop.create_future()

    def end(number: int) -> None:
        if ended.done():
            os._exit(128 + number)  # a second one ends the process at once, as everywhere
        ended.set_result(number)

    for number in HANDLED:
        if signal.getsignal(number) != signal.SIG_IGN:  # like the hang-up signal under `nohup`
            loop.add_signal_handler(number, end, number)
    server = LocalServer(workplace)
    async with server.serving():
        ready(server.guard.address)
        return await ended

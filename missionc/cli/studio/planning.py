"""Compilations beside the page, one at a time, in a thread that starts, asks and ends the planner process."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable
from typing import Self

from missionc.cli.compile_request import CompileRequest
from missionc.cli.watch.file_changes import EVERY
from missionc.cli.watch.planner_process import Ended, Planner


class Planning:
    """A context in which requests are carried out.

    Args:
        tell: called in the thread with each new line of how far the request under way is.
        ended: called in the thread with its end; not of one that was stopped.
    """

    def __init__(self, tell: Callable[[str], None], ended: Callable[[Ended], None]) -> None:
        self._tell, self._ended = tell, ended
        self._orders: queue.SimpleQueue[Callable[[Planner], bool]] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._run, daemon=True, name="planning")

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *exception: object) -> None:
        self._orders.put(lambda planner: False)
        self._thread.join()

    def start(self, request: CompileRequest, backend: str) -> None:
        """Begin with a request, and leave the one before."""

        def order(planner: Planner) -> bool:
            planner.start(request, backend)
            return True

        self._orders.put(order)

    def stop(self) -> None:
        """Leave what is under way."""

        def order(planner: Planner) -> bool:
            planner.stop()
            return True

        self._orders.put(order)

    def _run(self) -> None:
        with Planner(aloud=False) as planner:
            said = ""
            while self._carried_out(planner):
                ended = planner.ended()
                if planner.progress != said:
                    said = planner.progress
                    self._tell(said)
                if ended:
                    self._ended(ended)

    def _carried_out(self, planner: Planner) -> bool:
        """The next order, where one comes within a moment; whether to go on."""
        try:
            order = self._orders.get(timeout=EVERY)
        except queue.Empty:
            return True
        return order(planner)

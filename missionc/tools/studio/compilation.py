"""Compilations of a page's text: start, progress and end of the planner process, and the saved plan folder.

    says MC701 MC702

One compilation runs at a time, in a separate thread.
"""

from __future__ import annotations

import asyncio
import os
import queue
import shutil
import threading
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

from missionc import Diagnostic, Source
from missionc.output.folder.file_names import REPORT
from missionc.output.folder.write_folder import write_folder
from missionc.tools.studio.planner import LOOK_EVERY, Ended, NewPlanner, Planner
from missionc.tools.studio.workplace import Workplace

DONE = 0
"""Exit status of a successful compilation."""


class Planning:
    """Context manager with a thread that compiles texts.

    Args:
        planner: as in ``Workplace``.
        tell: called in the thread with each new line of progress.
        ended: called in the thread at the end of a compilation that was not stopped.
    """

    def __init__(self, planner: NewPlanner, tell: Callable[[str], None], ended: Callable[[Ended], None]) -> None:
        self._planner, self._tell, self._ended = planner, tell, ended
        self._orders: queue.SimpleQueue[Callable[[Planner], bool]] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._run, daemon=True, name="planning")

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *exception: object) -> None:
        self._orders.put(lambda planner: False)
        self._thread.join()

    def start(self, source: Source, output: Path, backend: str) -> None:
        """Start compiling a text into a folder, and stop the current compilation.

        Args:
            source: text of the mission.
            output: path of the plan folder.
            backend: name of a backend, or ``auto``.
        """

        def order(planner: Planner) -> bool:
            planner.compile(source, output, backend)
            return True

        self._orders.put(order)

    def stop(self) -> None:
        """Stop the current compilation."""

        def order(planner: Planner) -> bool:
            planner.stop()
            return True

        self._orders.put(order)

    def _run(self) -> None:
        with self._planner() as planner:
            said = ""
            while self._carried_out(planner):
                ended = planner.ended()
                if planner.progress != said:
                    said = planner.progress
                    self._tell(said)
                if ended:
                    self._ended(ended)

    def _carried_out(self, planner: Planner) -> bool:
        """Run the next command of the page, if one arrives within ``LOOK_EVERY``; return whether to continue."""
        try:
            order = self._orders.get(timeout=LOOK_EVERY)
        except queue.Empty:
            return True
        return order(planner)


@dataclass(frozen=True, slots=True)
class Kept:
    """Finished compilation.

    Args:
        folder: path of its plan folder.
        mission: name of its mission.
        planned: whether there is a plan.
    """

    folder: Path
    mission: str
    planned: bool


class Compilation:
    """Context manager for the compilations of one page; a new one replaces the current one.

    Args:
        workplace: state shared by all pages.
        tell: called in the loop's thread with each line of progress.
        ended: called in the loop's thread with the end, and the name of the report, or an empty text.
    """

    def __init__(self, workplace: Workplace, tell: Callable[[str], None], ended: Callable[[Ended, str], None]) -> None:
        self._workplace, self._ended = workplace, ended
        self._kept: Kept | None = None
        self._begun: Kept | None = None
        self._report = ""
        loop = asyncio.get_running_loop()
        self._planning = Planning(
            workplace.planner,
            lambda line: _call(loop, lambda: tell(line)),
            lambda end: _call(loop, lambda: self._end(end)),
        )

    def __enter__(self) -> Self:
        self._planning.__enter__()
        return self

    def __exit__(self, *exception: object) -> None:
        self._planning.__exit__(*exception)
        self._drop()

    def start(self, source: Source, mission: str, backend: str) -> None:
        """Start compiling a text into a new folder of the studio.

        Args:
            source: text of the mission.
            mission: name of the mission.
            backend: name of a backend, or ``auto``.
        """
        self._begun = Kept(self._workplace.folder(), mission, False)
        self._planning.start(source, self._begun.folder, backend)

    def stop(self) -> None:
        self._begun = None
        self._planning.stop()

    def keep(self, force: bool) -> Path | Diagnostic | None:
        """Save the last plan to ``build/NAME``.

        Args:
            force: whether to replace an existing folder.

        Returns:
            The path, an error, or None without a plan.
        """
        if self._kept is None or not self._kept.planned:
            return None
        target = Path("build") / self._kept.mission
        return write_folder(target, _files(self._kept.folder), force) or target

    def _end(self, end: Ended) -> None:
        if self._begun is None:
            return  # it was stopped at the very end
        self._drop()
        self._kept, self._begun = replace(self._begun, planned=end.status == DONE), None
        page = self._kept.folder / REPORT
        self._report = self._workplace.publish(page.read_bytes()) if page.is_file() else ""
        self._ended(end, self._report)

    def _drop(self) -> None:
        """Delete the folder and the report of the previous plan."""
        if self._kept is not None:
            shutil.rmtree(self._kept.folder, ignore_errors=True)
        self._workplace.withdraw(self._report)
        self._kept, self._report = None, ""


def _call(loop: asyncio.AbstractEventLoop, act: Callable[[], None]) -> None:
    if not loop.is_closed():
        loop.call_soon_threadsafe(act)


def _files(folder: Path) -> list[tuple[str, bytes]]:
    found = []
    for place, _, names in os.walk(folder):
        for name in sorted(names):
            path = Path(place) / name
            found.append((path.relative_to(folder).as_posix(), path.read_bytes()))
    return found

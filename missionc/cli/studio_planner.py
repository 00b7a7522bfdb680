"""Planner of ``missionc studio``: the separate process of ``--watch``, without output on the terminal."""

from __future__ import annotations

from pathlib import Path

from missionc.base.source import Source
from missionc.base.units import Seconds
from missionc.cli.compile_request import CompileRequest
from missionc.cli.options import EXPLAIN_LIMIT
from missionc.cli.watch.planner_process import Planner


class StudioPlanner(Planner):
    """Context manager that compiles texts as ``missionc compile`` does.

    Args:
        explain_limit: time limit for the explanation of infeasibility, seconds.
    """

    def __init__(self, explain_limit: float = EXPLAIN_LIMIT) -> None:
        super().__init__(aloud=False)
        self._explain_limit = Seconds(explain_limit)

    def compile(self, source: Source, output: Path, backend: str) -> None:
        """Start compiling a text, and stop the current compilation.

        Args:
            source: text of the mission.
            output: path of the plan folder.
            backend: name of a backend, or ``auto``.
        """
        self.start(CompileRequest(source, output=output, explain_limit=self._explain_limit, quiet=True), backend)

"""Planner of ``missionc studio``: the process of ``--watch``, which prints nothing."""

from __future__ import annotations

from pathlib import Path

from missionc.base.source import Source
from missionc.base.units import Seconds
from missionc.cli.compile_request import CompileRequest
from missionc.cli.options import EXPLAIN_LIMIT
from missionc.cli.watch.planner_process import Planner


class StudioPlanner(Planner):
    """A context in which texts are compiled as by ``missionc compile``.

    Args:
        explain_limit: seconds for explaining why there is no plan.
    """

    def __init__(self, explain_limit: float = EXPLAIN_LIMIT) -> None:
        super().__init__(aloud=False)
        self._explain_limit = Seconds(explain_limit)

    def compile(self, source: Source, output: Path, backend: str) -> None:
        """Compile a text into a folder; the one before is stopped."""
        self.start(CompileRequest(source, output=output, explain_limit=self._explain_limit, quiet=True), backend)

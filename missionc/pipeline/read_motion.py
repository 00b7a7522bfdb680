"""Reader of a motion from a file, or from a folder that was written.

in   a path, the Mission
out  its trace
says MC009 MC704 MC705
"""

from __future__ import annotations

from pathlib import Path

from missionc.base.limits import Limits
from missionc.base.source import Source
from missionc.base.trace import Trace
from missionc.diagnostics.code import TRACE_UNREADABLE
from missionc.diagnostics.model import Diagnostic
from missionc.ir import Mission
from missionc.syntax.read_file import read_text


def read_motion(path: str | Path, mission: Mission, limits: Limits) -> tuple[Trace | None, list[Diagnostic]]:
    """The motion in a file, ``plan.json`` or CSV, or in a folder's ``plan.json``; or what keeps it from being one."""
    from missionc.monitoring.read_trace import read_trace  # numpy, which no other use of this module loads

    file = Path(path) / "plan.json" if Path(path).is_dir() else Path(path)
    text = read_text(file, str(file), limits.trace_bytes, TRACE_UNREADABLE)
    if isinstance(text, Diagnostic):
        return None, [text]
    return read_trace(Source(str(file), text), mission, limits)

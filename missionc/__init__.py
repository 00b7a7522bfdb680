"""missionc: a compiler for multi-robot missions.

``check`` finds what is wrong with a mission, ``compile`` turns it into a
verified plan, ``monitor`` judges a trace. All three take and give values, and
never print.
"""

from __future__ import annotations

from missionc.version import __version__

TYPE_CHECKING = False  # checkers take it for true; what brings it would be loaded before signals are seen to
if TYPE_CHECKING:
    from missionc.backends.api import Attempt, CutShort, Impossible, NotFound, Progress, Reason, Scope, Violation
    from missionc.backends.options import Options
    from missionc.base.continuous_time import ContinuousTime
    from missionc.base.diagnostics.code import Severity
    from missionc.base.diagnostics.model import Diagnostic
    from missionc.base.limits import Limits
    from missionc.base.source import Source
    from missionc.compiler.driver import check, compile, monitor
    from missionc.compiler.front_end import Checked
    from missionc.compiler.graphs import link_graph, roadmap_graphs
    from missionc.compiler.results import (
        Alternative,
        Blame,
        Change,
        Compiled,
        Explained,
        InvalidMission,
        Monitored,
        NearMiss,
        Relaxation,
        Trial,
        Unverified,
        Verified,
    )
    from missionc.frontend.syntax.lark_grammar import grammar

__all__ = [
    "Alternative",
    "Attempt",
    "Blame",
    "Change",
    "Checked",
    "Compiled",
    "ContinuousTime",
    "CutShort",
    "Diagnostic",
    "Explained",
    "Impossible",
    "InvalidMission",
    "Limits",
    "Monitored",
    "NearMiss",
    "NotFound",
    "Options",
    "Progress",
    "Reason",
    "Relaxation",
    "Scope",
    "Severity",
    "Source",
    "Trial",
    "Unverified",
    "Verified",
    "Violation",
    "__version__",
    "check",
    "compile",
    "grammar",
    "link_graph",
    "monitor",
    "roadmap_graphs",
]

HOMES = {
    "missionc.backends.api": (
        "Attempt",
        "CutShort",
        "Violation",
        "Impossible",
        "NotFound",
        "Progress",
        "Reason",
        "Scope",
    ),
    "missionc.backends.options": ("Options",),
    "missionc.base.diagnostics.code": ("Severity",),
    "missionc.base.diagnostics.model": ("Diagnostic",),
    "missionc.compiler.driver": ("check", "compile", "monitor"),
    "missionc.base.limits": ("Limits",),
    "missionc.compiler.front_end": ("Checked",),
    "missionc.compiler.results": (
        "Alternative",
        "Blame",
        "Change",
        "Compiled",
        "Explained",
        "Monitored",
        "NearMiss",
        "InvalidMission",
        "Relaxation",
        "Trial",
        "Unverified",
        "Verified",
    ),
    "missionc.base.source": ("Source",),
    "missionc.compiler.graphs": ("link_graph", "roadmap_graphs"),
    "missionc.base.continuous_time": ("ContinuousTime",),
    "missionc.frontend.syntax.lark_grammar": ("grammar",),
}
"""Where each public name lives: loaded when it is first used, so that a child process loads only its own module."""


def __getattr__(name: str) -> object:
    from importlib import import_module

    for home, names in HOMES.items():
        if name in names:
            return getattr(import_module(home), name)
    raise AttributeError(f"module 'missionc' has no attribute {name!r}")

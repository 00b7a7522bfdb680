"""missionc: a compiler for multi-robot missions.

``Mission`` builds a mission in Python. ``check`` reports errors in a mission, ``compile`` turns the mission into a
verified plan, and ``monitor`` evaluates a trace. Each takes a ``Mission``, a file or a text. No function prints.
"""

from __future__ import annotations

from missionc.base.late_names import late_names
from missionc.version import __version__

TYPE_CHECKING = False  # type checkers take it for true; its import would come before the signal handlers
if TYPE_CHECKING:
    from missionc.backends.api import Attempt, CutShort, Impossible, NotFound, Progress, Reason, Scope, Violation
    from missionc.backends.options import Options
    from missionc.base.continuous_time import ContinuousTime
    from missionc.base.diagnostics.code import Severity
    from missionc.base.diagnostics.model import Diagnostic
    from missionc.base.limits import Limits
    from missionc.base.source import Source
    from missionc.compiler.driver import compile
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
    from missionc.frontend.builder.functions import (
        ball,
        box,
        connected,
        cylinder,
        disc,
        distance,
        heading,
        inside,
        maximum,
        minimum,
        polygon,
        state,
        touches,
    )
    from missionc.frontend.builder.items import double_integrator, single_integrator, unicycle
    from missionc.frontend.builder.mission import Mission
    from missionc.frontend.builder.parts import Agents, Formula, Quantity, Region, Shape, formula, quantity, shape
    from missionc.frontend.syntax.lark_grammar import grammar
    from missionc.tools.api.folders import export, plot, replan, report, simulate, verify
    from missionc.tools.api.missions import check, monitor
    from missionc.tools.api.sweeps import sweep

# fmt: off
__all__ = [
    "Agents", "Alternative", "Attempt", "Blame", "Change", "Checked", "Compiled", "ContinuousTime", "CutShort",
    "Diagnostic", "Explained", "Formula", "Impossible", "InvalidMission", "Limits", "Mission", "Monitored",
    "NearMiss", "NotFound", "Options", "Progress", "Quantity", "Reason", "Region", "Relaxation", "Scope", "Severity",
    "Shape", "Source", "Trial", "Unverified", "Verified", "Violation", "__version__", "ball", "box", "check",
    "compile", "connected", "cylinder", "disc", "distance", "double_integrator", "export", "formula", "grammar",
    "heading", "inside", "link_graph", "maximum", "minimum", "monitor", "plot", "polygon", "quantity", "replan",
    "report", "roadmap_graphs", "shape", "simulate", "single_integrator", "state", "sweep", "touches", "unicycle",
    "verify",
]
# fmt: on

HOMES = {
    home: tuple(names.split())
    for home, names in {
        "missionc.backends.api": "Attempt CutShort Impossible NotFound Progress Reason Scope Violation",
        "missionc.backends.options": "Options",
        "missionc.base.continuous_time": "ContinuousTime",
        "missionc.base.diagnostics.code": "Severity",
        "missionc.base.diagnostics.model": "Diagnostic",
        "missionc.base.limits": "Limits",
        "missionc.base.source": "Source",
        "missionc.compiler.driver": "compile",
        "missionc.compiler.front_end": "Checked",
        "missionc.compiler.graphs": "link_graph roadmap_graphs",
        "missionc.compiler.results": "Alternative Blame Change Compiled Explained "
        "InvalidMission Monitored NearMiss Relaxation Trial Unverified Verified",
        "missionc.frontend.builder.functions": "ball box connected cylinder disc distance heading "
        "inside maximum minimum polygon state touches",
        "missionc.frontend.builder.items": "double_integrator single_integrator unicycle",
        "missionc.frontend.builder.mission": "Mission",
        "missionc.frontend.builder.parts": "Agents Formula Quantity Region Shape formula quantity shape",
        "missionc.frontend.syntax.lark_grammar": "grammar",
        "missionc.tools.api.folders": "export plot replan report simulate verify",
        "missionc.tools.api.missions": "check monitor",
        "missionc.tools.api.sweeps": "sweep",
    }.items()
}
"""Module of each public name, loaded at first use, so that a child process loads only its own module."""


__getattr__ = late_names(__name__, HOMES)

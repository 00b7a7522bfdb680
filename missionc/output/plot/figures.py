"""Figures of a plan: the requested picture as the bytes of a file.

says MC404, MC715
"""

from __future__ import annotations

from missionc.backends.roadmap_graph import RoadmapGraph
from missionc.base.diagnostics.code import NO_SUCH_MOMENT
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.trace import Trace
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from missionc.output.plot.figure_request import DISTANCES, ROBUSTNESS, TIMELINE, FigureRequest
from missionc.output.plot.plot import missing, plot, rendered


def refuse_moments(request: FigureRequest, mission: Mission) -> Diagnostic | None:
    """Diagnostic of a snapshot after the mission's end; None if all are within it."""
    last = float(mission.step * mission.steps)
    late = [moment for moment in request.at if moment > last + 1e-9]
    if not late:
        return None
    message = f"a snapshot at {late[0]:g} s is after the end of the mission at {last:g} s"
    return Diagnostic(NO_SUCH_MOMENT, message, None, help=f"use a time from 0 to {last:g} with `--at`")


def figure(
    request: FigureRequest,
    mission: Mission,
    kernel: Kernel,
    trace: Trace,
    backend: str,
    suffix: str,
    roadmaps: tuple[RoadmapGraph, ...] = (),
) -> bytes | Diagnostic:
    """Requested picture of a plan as bytes, the same each time, or a diagnostic.

    Args:
        backend: backend of the plan, for the title of a map.
        suffix: ``svg``, ``png`` or ``pdf``.
        roadmaps: roadmaps drawn below the paths of a map.
    """
    wrong = missing() or refuse_moments(request, mission)
    if wrong:
        return wrong
    from missionc.output.plot import plot_charts, plot_strip

    width = request.width
    match request.kind:
        case kind if kind == ROBUSTNESS:
            return rendered(lambda each: plot_charts.draw_robustness(each, mission, kernel, trace, width), suffix, True)
        case kind if kind == DISTANCES:
            return rendered(lambda each: plot_charts.draw_distances(each, mission, trace, width), suffix, True)
        case kind if kind == TIMELINE:
            return rendered(lambda each: plot_charts.draw_timeline(each, mission, kernel, trace, width), suffix, True)
        case _ if request.at or width:
            return rendered(lambda each: plot_strip.draw_strip(each, mission, trace, request, roadmaps), suffix, True)
        case _:
            return plot(mission, trace, backend, suffix, roadmaps=roadmaps)

"""Graphs of a mission for networkx: the roadmaps it is planned on, and the links of its agents at a step.

in   Checked or Compiled
out  graphs of networkx
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from missionc.backends.options import ROADMAP_PRESETS
from missionc.backends.roadmap_graph import RoadmapGraph
from missionc.backends.smt.spec import SMT
from missionc.base.diagnostics.code import NO_ROADMAP
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.memory import limited
from missionc.base.trace import Trace
from missionc.compiler.front_end import Checked
from missionc.compiler.results import Compiled, Verified
from missionc.output.plot.figure_request import ROADMAP, FigureRequest

if TYPE_CHECKING:
    import networkx

MEMORY = 8 << 30
"""Bytes that building a roadmap may take."""


def roadmap_graphs(mission: Checked | Compiled, *, seed: int = 0) -> tuple[networkx.DiGraph, ...]:
    """The roadmaps of a mission, one for each kind of agent, in the order in which it names the kinds.

    Of a ``Compiled`` those that its plan was found on; else the first ones that the smt backend would plan on, built
    without solving. A node has ``x``, ``y`` (and ``z``) in metres, ``labels``, the regions that it is in, ``starts``,
    the agents that may start there, and of agents that brake ``vx``, ``vy`` in m/s; an edge has ``steps``,
    ``duration`` in seconds and ``length`` in metres; the graph has ``agents``. Several words are one text with spaces.

    Args:
        seed: of the roadmaps that are built.

    Raises:
        ValueError: the mission has errors, or no roadmap can be built; the message begins with the code.
        ModuleNotFoundError: networkx is not installed; it comes with the extra ``graph``.
    """
    from missionc.output.graphs import roadmap_to_networkx

    checked = mission.checked if isinstance(mission, Compiled) else mission
    planned = planned_on(mission) if isinstance(mission, Compiled) else ()
    roadmaps = planned or first_roadmaps(checked, seed)
    if isinstance(roadmaps, Diagnostic):
        raise ValueError(f"{roadmaps.code.name}: {roadmaps.message}")
    return tuple(roadmap_to_networkx(roadmap, checked.valid_mission.step) for roadmap in roadmaps)


def link_graph(mission: Checked, trace: Trace, graph: str, step: int) -> networkx.Graph:
    """Who is linked to whom at a step of a motion: the agents of one of the mission's graphs, and their links.

    A node is an agent with ``x``, ``y`` (and ``z``) in metres and its ``team``; an edge has ``length`` and ``margin``,
    by how much the link holds, in metres; the graph has ``graph``, ``step`` and ``time``, in seconds. It is a
    ``DiGraph`` where some two agents have another range one way than the other way.

    Args:
        trace: of the mission's agents, such as ``Verified.plan.trace``.
        graph: the name of a graph that the mission declares.
        step: from 0 to the last of the trace.

    Raises:
        ValueError: the mission has errors or no such graph, or the trace no such step.
        ModuleNotFoundError: networkx is not installed; it comes with the extra ``graph``.
    """
    from missionc.output.graphs import links_to_networkx

    if mission.mission is None:
        raise ValueError(f"`{mission.file}` has errors: it has no graphs")
    named = {each.name: each for each in mission.mission.graphs}
    if graph not in named:
        raise ValueError(f"there is no graph `{graph}`; the mission has {', '.join(named) or 'none'}")
    last = trace.position.shape[1] - 1
    if not 0 <= step <= last:
        raise ValueError(f"there is no step {step}; the trace has the steps 0 to {last}")
    return links_to_networkx(mission.mission, named[graph], trace, step)


def planned_on(compiled: Compiled) -> tuple[RoadmapGraph, ...]:
    """The roadmaps that a plan was found on; none where there is no plan, or it was found on none."""
    return compiled.outcome.report.roadmaps if isinstance(compiled.outcome, Verified) else ()


def first_roadmaps(checked: Checked, seed: int, preset: str = "") -> tuple[RoadmapGraph, ...] | Diagnostic:
    """The first roadmaps that can be built, without solving; or why there are none.

    Args:
        preset: how the mission is planned; where the smt backend plans it as published, it builds its own.

    Raises:
        ValueError: the mission has errors.
    """
    from missionc.backends.smt.paper.build_prm import published_graphs
    from missionc.backends.smt.roadmap.roadmap import NoRoadmap  # it loads scipy and shapely
    from missionc.backends.smt.roadmap.roadmap_graph import first_graphs

    if checked.mission is None or checked.kernel is None:
        raise ValueError(f"`{checked.file}` has errors: it has no roadmap")
    try:
        with limited(MEMORY):
            if preset in ROADMAP_PRESETS and checked.choice and checked.choice.backend == SMT.name:
                built = published_graphs(checked.mission, seed)
            else:
                built = first_graphs(checked.mission, checked.kernel, seed)
    except MemoryError as error:
        built = NoRoadmap(str(error) or "it takes too much memory")
    if isinstance(built, NoRoadmap):
        return Diagnostic(NO_ROADMAP, f"no roadmap could be built: {built.statement}", None)
    return built


def picture_of(compiled: Compiled, request: FigureRequest, suffix: str, seed: int) -> bytes | Diagnostic:
    """The picture of a plan; its roadmap is the one that the plan was found on, or the first that can be built."""
    from missionc.output.plot.figures import figure  # it loads matplotlib

    plan, checked = compiled.plan, compiled.checked
    roadmaps = (planned_on(compiled) or first_roadmaps(checked, seed)) if request.kind == ROADMAP else ()
    if isinstance(roadmaps, Diagnostic):
        return roadmaps
    return figure(request, checked.valid_mission, checked.valid_kernel, plan.trace, plan.backend, suffix, roadmaps)

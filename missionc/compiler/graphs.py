"""Graphs of a mission for networkx: roadmaps for planning, and the agents' links at a step.

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
"""Memory limit for building a roadmap, bytes."""


def roadmap_graphs(mission: Checked | Compiled, *, seed: int = 0) -> tuple[networkx.DiGraph, ...]:
    """Roadmaps of a mission as networkx graphs, one for each kind of agent, in the mission's order of kinds.

    For a ``Compiled``, these are the roadmaps of its plan; else the first ones of the smt backend, built without
    solving. A node has ``x``, ``y`` (and ``z``) in metres; ``labels``, its regions; ``starts``, the agents that may
    start there; and for agents with momentum ``vx``, ``vy`` in m/s. An edge has ``steps``, ``duration`` in seconds and
    ``length`` in metres. The graph has ``agents``. Several words are joined by spaces.

    Args:
        seed: seed for roadmaps that are built now.

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
    """Links between agents at one step of a trace, for one of the mission's graphs, as a networkx graph.

    A node is an agent with ``x``, ``y`` (and ``z``) in metres and its ``team``. An edge has ``length`` and ``margin``
    of the link, in metres. The graph has ``graph``, ``step`` and ``time``, in seconds. It is a ``DiGraph`` if some pair
    of agents has different ranges in the two directions.

    Args:
        trace: trace of the mission's agents, such as ``Verified.plan.trace``.
        graph: name of a graph in the mission.
        step: from 0 to the last step of the trace.

    Raises:
        ValueError: the mission has errors or no such graph, or the trace has no such step.
        ModuleNotFoundError: networkx is not installed; it comes with the extra ``graph``.
    """
    from missionc.output.graphs import links_to_networkx

    if mission.mission is None:
        raise ValueError(f"`{mission.file}` has errors, so there are no graphs")
    named = {each.name: each for each in mission.mission.graphs}
    if graph not in named:
        raise ValueError(f"there is no graph `{graph}`; the mission has {', '.join(named) or 'none'}")
    last = trace.position.shape[1] - 1
    if not 0 <= step <= last:
        raise ValueError(f"there is no step {step}; the trace has the steps 0 to {last}")
    return links_to_networkx(mission.mission, named[graph], trace, step)


def planned_on(compiled: Compiled) -> tuple[RoadmapGraph, ...]:
    """Roadmaps on which a plan was found; empty without a plan or roadmaps."""
    return compiled.outcome.report.roadmaps if isinstance(compiled.outcome, Verified) else ()


def first_roadmaps(checked: Checked, seed: int, preset: str = "") -> tuple[RoadmapGraph, ...] | Diagnostic:
    """Initial roadmaps of the smt backend, built without solving, or a diagnostic that there are none.

    Args:
        preset: planning preset; for the published method of the smt backend, its own roadmaps.

    Raises:
        ValueError: the mission has errors.
    """
    from missionc.backends.smt.paper.build_prm import published_graphs
    from missionc.backends.smt.roadmap.roadmap import NoRoadmap  # loads scipy and shapely
    from missionc.backends.smt.roadmap.roadmap_graph import first_graphs

    if checked.mission is None or checked.kernel is None:
        raise ValueError(f"`{checked.file}` has errors, so there is no roadmap")
    try:
        with limited(MEMORY):
            if preset in ROADMAP_PRESETS and checked.choice and checked.choice.backend == SMT.name:
                built = published_graphs(checked.mission, seed)
            else:
                built = first_graphs(checked.mission, checked.kernel, seed)
    except MemoryError as error:
        built = NoRoadmap(str(error) or "the roadmap takes too much memory")
    if isinstance(built, NoRoadmap):
        return Diagnostic(NO_ROADMAP, f"no roadmap could be built: {built.statement}", None)
    return built


def picture_of(compiled: Compiled, request: FigureRequest, suffix: str, seed: int) -> bytes | Diagnostic:
    """Picture of a plan as bytes of the format ``suffix``; a roadmap picture uses the plan's roadmap, or builds one."""
    from missionc.output.plot.figures import figure  # loads matplotlib

    plan, checked = compiled.plan, compiled.checked
    roadmaps = (planned_on(compiled) or first_roadmaps(checked, seed)) if request.kind == ROADMAP else ()
    if isinstance(roadmaps, Diagnostic):
        return roadmaps
    return figure(request, checked.valid_mission, checked.valid_kernel, plan.trace, plan.backend, suffix, roadmaps)

"""Roadmaps, and links between agents at a step of a trace, as networkx graphs.

Networkx comes with the extra ``graph`` and is loaded only here, when a graph is requested. All attributes are numbers
and texts, so that ``networkx.write_graphml`` and ``networkx.node_link_data`` can write them unchanged.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from missionc.backends.roadmap_graph import RoadmapGraph
from missionc.base.diagnostics.code import EXTRA_MISSING
from missionc.base.trace import Array, Trace
from missionc.ir import Graph, Mission
from missionc.ir.couplings import directed
from missionc.ir.language.margins.links import link_margin

if TYPE_CHECKING:
    import networkx


def roadmap_to_networkx(roadmap: RoadmapGraph, step: float) -> networkx.DiGraph:
    """Roadmap as a directed graph; of several motions between two nodes, the one with the fewest steps.

    Args:
        step: duration of a step, seconds.
    """
    nx = _networkx()
    graph = nx.DiGraph(agents=" ".join(roadmap.agents))
    moves = bool(roadmap.velocity.any())
    for node, (name, labels, starts) in enumerate(zip(roadmap.names, roadmap.labels, roadmap.starts, strict=True)):
        velocity = {f"v{axis}": value for axis, value in _place(roadmap.velocity[node]).items() if moves}
        place = _place(roadmap.position[node])
        graph.add_node(name, **place, **velocity, labels=" ".join(labels), starts=" ".join(starts))
    for edge in roadmap.edges:
        ends = roadmap.names[edge.source], roadmap.names[edge.target]
        if not graph.has_edge(*ends) or edge.steps < graph.edges[ends]["steps"]:
            graph.add_edge(*ends, steps=edge.steps, duration=edge.steps * float(step), length=edge.length)
    return graph


def links_to_networkx(mission: Mission, graph: Graph, trace: Trace, step: int) -> networkx.Graph:
    """Communication graph at a step, with a node for each agent and an edge for each link.

    Directed if its ranges are.
    """
    nx = _networkx()
    agents = [mission.agents[index] for index in graph.agents]
    one_way = directed(graph)
    links = (nx.DiGraph if one_way else nx.Graph)(graph=graph.name, step=step, time=step * float(mission.step))
    for agent in agents:
        links.add_node(agent.name, **_place(trace.position[agent.index, step]), team=agent.team)
    for number, one in enumerate(agents):
        for other in agents[:number] * one_way + agents[number + 1 :]:
            places = trace.position[one.index, step], trace.position[other.index, step]
            margin = float(link_margin(graph, one.index, other.index, *places))
            if margin > 0:
                length = float(((places[0] - places[1]) ** 2).sum() ** 0.5)
                links.add_edge(one.name, other.name, length=length, margin=margin)
    return links


def _place(point: Array) -> dict[str, float]:
    return dict(zip("xyz", map(float, point), strict=False))


def _networkx() -> networkx:
    try:
        import networkx
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            f"{EXTRA_MISSING.name}: a graph needs networkx, which is not installed; "
            "install it with `pip install 'missionc[graph]'`",
            name=error.name,
        ) from error
    return networkx

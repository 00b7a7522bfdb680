"""A roadmap as a value: nodes, edges with their steps and lengths, and labels.

Source:
    [strel] Fig. 2.
"""

from __future__ import annotations

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array


class RoadmapEdge(Record, eq=False):
    """A motion from node to node.

    Args:
        source: index of its first node; ``target`` likewise.
        steps: number of steps.
        length: metres.
        path: (points, dim), metres: positions at its steps; for a straight motion only its ends.
    """

    source: int
    target: int
    steps: int
    length: float
    path: Array


class RoadmapGraph(Record, eq=False):
    """Nodes and edges of one kind of agent, before they are unrolled to steps.

    Args:
        agents: names of its agents.
        names: names of the nodes: their indices, or those of the user's roadmap.
        position: (nodes, dim), metres.
        velocity: (nodes, dim), m/s; zero for rest.
        labels: for each node, the regions that contain it.
        starts: for each node, the agents that may start there.
        edges: in the order of their nodes; the reverse is a separate edge.
    """

    agents: tuple[str, ...]
    names: tuple[str, ...]
    position: Array
    velocity: Array
    labels: tuple[tuple[str, ...], ...]
    starts: tuple[tuple[str, ...], ...]
    edges: tuple[RoadmapEdge, ...]


def show_roadmaps(roadmaps: tuple[RoadmapGraph, ...]) -> str:
    """Text of ``--emit roadmap``: for each roadmap its nodes with their labels, then its edges."""
    return "\n".join("\n".join(_lines(roadmap)) + "\n" for roadmap in roadmaps)


def _lines(roadmap: RoadmapGraph) -> list[str]:
    both = {(edge.source, edge.target) for edge in roadmap.edges}
    one_way = [edge for edge in roadmap.edges if (edge.target, edge.source) not in both]
    ways = len({frozenset(pair) for pair in both})
    lines = [
        f"roadmap of {', '.join(roadmap.agents)}",
        f"{_count(len(roadmap.names), 'node')}, {_count(ways, 'way')} between them"
        + (f", {len(one_way)} one-way" if one_way else ""),
    ]
    width = max(map(len, roadmap.names), default=0)
    moves = [any(velocity) for velocity in roadmap.velocity.tolist()]
    for node, (name, labels, starts) in enumerate(zip(roadmap.names, roadmap.labels, roadmap.starts, strict=True)):
        says = [*labels, *([f"start of {', '.join(starts)}"] if starts else [])]
        says += [f"moving {_vector(roadmap.velocity[node])} m/s"] if moves[node] else []
        lines.append(f"  {name:>{width}}  {_vector(roadmap.position[node])}" + (f"  {'; '.join(says)}" if says else ""))
    for edge in roadmap.edges:
        back = (edge.target, edge.source) in both
        if back and edge.target < edge.source:
            continue
        source, target = roadmap.names[edge.source], roadmap.names[edge.target]
        arrow = "--" if back else "->"
        lines.append(
            f"  {source:>{width}} {arrow} {target:<{width}}  {_count(edge.steps, 'step')}, {edge.length:.6g} m"
        )
    return lines


def _vector(values: Array) -> str:
    return f"({', '.join(f'{value:.6g}' for value in values.tolist())})"


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"

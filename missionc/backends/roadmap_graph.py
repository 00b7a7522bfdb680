"""Roadmap as a value: nodes, edges with their steps and lengths, and labels.

Source:
    [strel] Fig. 2.
"""

from __future__ import annotations

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array


class RoadmapEdge(Record, eq=False):
    """Directed edge of a roadmap: a motion from one node to another.

    Args:
        source: index of the first node; ``target``: index of the last node.
        steps: number of steps that the motion takes.
        length: path length, metres.
        path: positions at the steps, (points, dim), metres; for a straight motion only its ends.
    """

    source: int
    target: int
    steps: int
    length: float
    path: Array


class RoadmapGraph(Record, eq=False):
    """Roadmap of agents with equal dynamics and bodies, before it is unrolled over time.

    Args:
        agents: names of the agents that use the roadmap.
        names: names of the nodes: their indices, or the names in the user's roadmap.
        position: node positions, (nodes, dim), metres.
        velocity: node velocities, (nodes, dim), m/s; zero for rest.
        labels: for each node, the names of the regions that contain it.
        starts: for each node, the names of the agents that may start there.
        edges: edges in the order of their source nodes; the reverse of an edge is a separate edge.
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

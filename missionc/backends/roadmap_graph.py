"""A roadmap as a value that can be looked at: nodes, edges with their steps and lengths, and what holds where.

Source:
    [strel] Fig. 2.
"""

from __future__ import annotations

from dataclasses import dataclass

from missionc.base.trace import Array


@dataclass(frozen=True, slots=True, eq=False)
class RoadmapEdge:
    """A motion from node to node.

    Args:
        source: the number of the node it starts at; ``target`` likewise.
        steps: how many steps it takes.
        length: metres.
        path: (points, dim), metres: where it goes, at its steps; of a straight motion only its ends.
    """

    source: int
    target: int
    steps: int
    length: float
    path: Array


@dataclass(frozen=True, slots=True, eq=False)
class RoadmapGraph:
    """The nodes and edges of one kind of agent, before they are unrolled to steps.

    Args:
        agents: the names of those that move on it.
        names: of the nodes: their numbers, or what the user's own roadmap calls them.
        position: (nodes, dim), metres.
        velocity: (nodes, dim), m/s; zero where agents may rest.
        labels: for each node the regions that its place is in.
        starts: for each node the agents that may start there.
        edges: in the order of their nodes; a way back is an edge of its own.
    """

    agents: tuple[str, ...]
    names: tuple[str, ...]
    position: Array
    velocity: Array
    labels: tuple[tuple[str, ...], ...]
    starts: tuple[tuple[str, ...], ...]
    edges: tuple[RoadmapEdge, ...]


def show_roadmaps(roadmaps: tuple[RoadmapGraph, ...]) -> str:
    """The text of ``--emit roadmap``: for each roadmap its nodes with what holds there, then its edges."""
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

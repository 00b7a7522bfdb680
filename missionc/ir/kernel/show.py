"""Printer of the kernel for ``--emit kernel``, with one node per line.

Every node except leaves has a name, ``%1``, ``%2``, …, children before parents, so that shared nodes are visible.
"""

from __future__ import annotations

import math
from typing import assert_never

from missionc.ir import Graph, Mission
from missionc.ir.kernel import nodes as k
from missionc.ir.kernel.walk import children, postorder


def show(kernel: k.Kernel, mission: Mission) -> str:
    """Text of the kernel: every node, followed by the requirements and the preferences."""
    goals = kernel.goals
    words = KernelWords(mission)
    lines: list[str] = []
    names: dict[k.Node, str] = {}
    for node in postorder(goal.formula for goal in goals):
        text = words.of(node, tuple(names[child] for child in children(node)))
        if _inline(node):
            names[node] = text
        else:
            names[node] = f"%{len(lines) + 1}"
            lines.append(f"{names[node]} = {text}")
    lines.extend(f"{asked(goal.weight)} {goal.name} = {names[goal.formula]}" for goal in goals)
    return "\n".join(lines) + "\n"


def _inline(node: k.Node) -> bool:
    match node:
        case k.Atom() | k.Is():
            return True
        case k.Not(body):
            return _inline(body)
        case k.All(parts) | k.Any(parts):
            return not parts
        case _:
            return False


class KernelWords:
    """Printer of a kernel node from the texts of its children."""

    def __init__(self, mission: Mission) -> None:
        self.mission = mission

    def of(self, node: k.Node, below: tuple[str, ...]) -> str:
        match node:
            case k.Atom(predicate):
                return predicate.show(self)
            case k.Is(agents):
                return f"is({', '.join(self.agent(index) for index in sorted(agents))})"
            case k.Not():
                return f"not {below[0]}"
            case k.All():
                return f"all({', '.join(below)})" if below else "true"
            case k.Any():
                return f"any({', '.join(below)})" if below else "false"
            case k.AtLeast(count):
                return f"at-least {count} ({', '.join(below)})"
            case k.WindowNode(_, low, high):
                return f"{'always' if node.every else 'eventually'} {window(low, high)} {below[0]}"
            case k.UntilNode(_, _, low, high):
                word = ("until", "release", "since", "trigger")[node.every + 2 * (low < 0)]
                return f"{below[0]} {word} {window(low, high)} {below[1]}"
            case k.NeighbourNode(graph):
                return f"{_every(node)}neighbour on {self.graph(graph)} {below[0]}"
            case k.ReachNode(graph, _, _, hops):
                return f"{below[0]} {_every(node)}reach {hops} hops on {self.graph(graph)} {below[1]}"
            case k.RouteNode(graph, _, _, low, high):
                return f"{below[0]} {_every(node)}route {metres_text(low, high)} on {self.graph(graph)} {below[1]}"
            case k.PathLength(graph, agent, low, high):
                return f"path to {self.agent(agent)} {metres_text(low, high)} on {self.graph(graph)}"
            case k.At(agent):
                return f"at {self.agent(agent)} {below[0]}"
            case _:
                assert_never(node)

    def agent(self, index: int) -> str:
        return self.mission.agents[index].name

    def graph(self, graph: Graph, agents: tuple[int, ...] | None = None) -> str:
        agents = graph.agents if agents is None else agents
        declared = next((known for known in self.mission.graphs if known.name == graph.name), graph)
        return graph.name if declared.agents == agents else f"{graph.name} over {', '.join(map(self.agent, agents))}"

    def angle(self, value: float) -> str:
        return f"{number_text(value)} rad"

    def inequality(self, terms: tuple[tuple[float, str], ...], constant: float, sign: str) -> str:
        parts = [word if weight == 1 else f"{number_text(weight)}*{word}" for weight, word in terms]
        return f"({' + '.join([*parts, number_text(constant)])} {sign} 0)"


def asked(weight: float | None) -> str:
    """Keyword of a goal: ``require`` for a requirement (``weight`` None), ``prefer[weight]`` for a preference."""
    return "require" if weight is None else f"prefer[{number_text(weight)}]"


def _every(node: k.NeighbourNode | k.ReachNode | k.RouteNode) -> str:
    return "every " if node.every else ""


def window(low: int, high: int | None) -> str:
    return f"[{low}..{'end' if high is None else high}]"


def metres_text(low: float, high: float) -> str:
    return f"{number_text(low)}..{'' if math.isinf(high) else number_text(high)} m"


def number_text(value: float) -> str:
    return f"{value:.12g}"

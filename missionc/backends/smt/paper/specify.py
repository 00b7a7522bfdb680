"""Requirements of a mission in the logic of [strel], over the states of each agent's roadmap.

    in   Mission, one Roadmap for each agent
    out  Specification

Derived operators are expanded to operators with an encoding: ``somewhere``, ``everywhere`` and ``surround`` by *reach*
and *escape*, ``implies`` by *not* and *or*, ``every`` and ``some`` by *and* and *or* over agents.

Source:
    [strel] Definition 4 and its derived operators.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, TypeAlias, assert_never

from missionc import ir
from missionc.backends.smt.roadmap.labels import Labels
from missionc.backends.smt.roadmap.roadmap import Roadmap
from missionc.ir.language.walk_formulas import formulas_bottom_up

Term: TypeAlias = list[Any]
"""Formula in JSON: the operator's word, then the indices of its children and its bounds."""


@dataclass(slots=True)
class Specification:
    """Formulas by index, children first; the last formula must be true for the team at step 0.

    Args:
        graphs: graphs used, by their indices in *reach* and *escape*.
    """

    terms: list[Term] = field(default_factory=list)
    graphs: list[ir.Graph] = field(default_factory=list)

    def add(self, *term: Any) -> int:
        """Add a formula and return its index."""
        self.terms.append([*term])
        return len(self.terms) - 1

    def graph(self, graph: ir.Graph) -> int:
        """Index of a graph, which is added if it is new."""
        if graph not in self.graphs:
            self.graphs.append(graph)
        return self.graphs.index(graph)


def specify(mission: ir.Mission, prms: tuple[Roadmap, ...]) -> Specification:
    """Conjunction of all requirements of a mission that the logic of [strel] can express."""
    spec, labels = Specification(), Labels(mission, prms)
    known: dict[ir.Formula, int] = {}
    for formula in formulas_bottom_up(each.formula for each in mission.requirements):
        known[formula] = _term(formula, known, spec, labels, mission.steps)
    spec.add("and", [known[each.formula] for each in mission.requirements])
    return spec


def _term(formula: ir.Formula, known: dict[ir.Formula, int], spec: Specification, labels: Labels, steps: int) -> int:
    match formula:
        case ir.Truth(value):
            return spec.add("and" if value else "or", [])
        case ir.Holds(predicate):
            agents = range(len(labels.roadmaps))
            return spec.add("states", [labels.states(predicate, agent).nonzero()[0].tolist() for agent in agents])
        case ir.Belongs(agents):
            return spec.add("agents", list(agents.agents))
        case ir.AtLeastOf(kind, _, agents, body):
            parts = [spec.add("of", agent, known[body]) for agent in agents.agents]
            return spec.add("and" if kind == "every" else "or", parts)
        case ir.OfAgent(agent, body):
            return spec.add("of", agent, known[body])
        case ir.Apply(operator, operands, bounds):
            below = [known[operand] for operand in operands]
            if isinstance(bounds, ir.Length):
                return _spatial(operator.name, below, bounds, spec)
            if isinstance(bounds, ir.Window):
                return spec.add(operator.name, *below, bounds.low, bounds.high)
            return _boolean(operator.name, below, spec)
        case ir.Without():
            raise AssertionError("`without any` is rejected before the specification")
        case _:
            assert_never(formula)


def _boolean(name: str, below: list[int], spec: Specification) -> int:
    if name == "not":
        return spec.add("not", *below)
    if name == "implies":
        condition, consequence = below
        return spec.add("or", [spec.add("not", condition), consequence])
    return spec.add(name, below)


def _spatial(name: str, below: list[int], length: ir.Length, spec: Specification) -> int:
    graph = spec.graph(length.graph)
    most = len(length.graph.agents) - 1
    low, high = math.ceil(max(length.low, 0)), min(length.high, most)
    high = math.floor(high)
    true = spec.add("and", [])
    match name:
        case "reach":
            return spec.add("reach", *below, graph, max(low, 1), high)
        case "escape":
            return spec.add("escape", *below, graph, low, high)
        case "somewhere":
            return spec.add("reach", true, *below, graph, max(low, 1), high)
        case "everywhere":
            broken = spec.add("not", *below)
            return spec.add("not", spec.add("reach", true, broken, graph, max(low, 1), high))
        case _:  # surround
            inner, border = below
            outside = spec.add("not", spec.add("or", [inner, border]))
            leaves = spec.add("reach", inner, outside, graph, 1, high)
            far = spec.add("escape", inner, graph, high + 1, most)
            return spec.add("and", [inner, spec.add("not", leaves), spec.add("not", far)])

"""Expansion of requirements and preferences to kernel formulas by the operators' definitions.

in   Mission, as resolved
out  Kernel, in which a formula that is used twice is one node
says MC207
"""

from __future__ import annotations

from itertools import chain
from typing import assert_never

from missionc import ir
from missionc.base.diagnostics.code import TOO_LARGE_TO_EXPAND
from missionc.base.diagnostics.model import Diagnostic, Label
from missionc.base.limits import Limits
from missionc.base.source import Span
from missionc.ir.couplings import directed
from missionc.ir.kernel.nodes import All, Any, At, AtLeast, Atom, Goal, Is, Kernel, Node, Not, Reach
from missionc.ir.kernel.normal_form import normal_forms
from missionc.ir.kernel.walk import children, postorder
from missionc.ir.language.operator import TooLarge, Use
from missionc.ir.language.operators import by_name
from missionc.ir.language.walk_formulas import formulas
from missionc.ir.language.weighed_routes import nodes_at_most, whole_bounds


def expand(mission: ir.Mission, limits: Limits | None = None) -> tuple[Kernel | None, list[Diagnostic]]:
    """Kernel form of all requirements and preferences, and findings; None if an operator exceeds the size limit."""
    expansion = _Expansion((limits or Limits()).formula_nodes)
    for formula in formulas(mission):
        expansion.nodes[formula] = expansion.expanded(formula)
    if expansion.findings:
        return None, expansion.findings
    return _normal(mission, expansion.nodes), []


def _normal(mission: ir.Mission, written: dict[ir.Formula, Node]) -> Kernel:
    """Kernel in negation normal form, from the expanded formula of each formula of the mission."""
    forms = normal_forms(written.values())
    nodes = {formula: forms[node, True] for formula, node in written.items()}
    goals = [
        [Goal(goal.name, nodes[goal.formula], goal.formula.span, weight) for goal, weight in weighted]
        for weighted in (
            [(each, None) for each in mission.requirements],
            [(each, each.weight) for each in mission.preferences],
        )
    ]
    used = set(postorder(goal.formula for goal in chain(*goals)))
    opposites = {forms[node, True]: forms[node, False] for node in written.values() if (node, False) in forms}
    return Kernel(
        tuple(goals[0]), tuple(goals[1]), nodes, {node: other for node, other in opposites.items() if other in used}
    )


class _Expansion:
    """Kernel nodes of the formulas expanded so far, by formula identity."""

    def __init__(self, room: int) -> None:
        self.room = room
        self.findings: list[Diagnostic] = []
        self.nodes: dict[ir.Formula, Node] = {}
        self.linked: dict[ir.Predicate, Node] = {}

    def expanded(self, formula: ir.Formula) -> Node:
        """Kernel form of a formula whose operands are already expanded."""
        span = formula.span
        match formula:
            case ir.Truth(value):
                return All((), span) if value else Any((), span)
            case ir.Holds(predicate):
                return Atom(predicate, span) if predicate.graph is None else self.connected(predicate, span)
            case ir.Belongs(agents):
                return Is(frozenset(agents.agents), span)
            case ir.Apply():
                return self.applied(formula)
            case ir.AtLeastOf(kind, number, agents, body):
                inner = self.nodes[body]
                return _of_agents(kind, number, tuple(At(agent, inner, span) for agent in agents.agents), span)
            case ir.OfAgent(agent, body):
                return At(agent, self.nodes[body], span)
            case ir.Without(cases=cases):
                return All(tuple(self.nodes[case] for case in cases), span)
            case _:
                assert_never(formula)

    def applied(self, formula: ir.Apply) -> Node:
        arguments = tuple(self.nodes[operand] for operand in formula.operands)
        use = Use(arguments, formula.bounds, formula.span, formula.comparison, formula.number, self.room)
        node = _too_many_sums(use) or by_name[formula.operator.name].expand(use)
        if isinstance(node, TooLarge):
            self.findings.append(_too_large(formula, node.nodes, self.room))
            return Any((), formula.span)
        # The negation of the whole is not the author's: the span stays with the formula itself.
        own = isinstance(node, Not) and children(node.body) and node.body.span == formula.span
        return All((node,), formula.span) if own else node

    def connected(self, predicate: ir.Predicate, span: Span) -> Node:
        """Kernel form of a connectivity predicate: a new node with the span, whose children equal predicates share."""
        return All(tuple(self.of_part(part, part.restricted) for part in predicate.parts), span)

    def of_part(self, part: ir.Predicate, graph: ir.Graph | None) -> Node:
        if graph is None or not graph.agents:
            return All(())
        if part not in self.linked:
            self.linked[part] = _linked(graph)
        return self.linked[part]


def _linked(graph: ir.Graph) -> Node:
    """Formula that every agent of the graph has a route to the first agent, and for directed links also back."""
    first, *others = graph.agents

    def route(end: int) -> Node:
        return Reach(graph, All(()), Is(frozenset((end,))), len(others))

    to_first = route(first)
    there = tuple(At(agent, to_first) for agent in others)
    back = tuple(At(first, route(agent)) for agent in others) if directed(graph) else ()
    return All(there + back)


def _too_many_sums(use: Use) -> TooLarge | None:
    """Size estimate if a use with link weights needs more than ``room`` kernel nodes; None otherwise."""
    if not isinstance(use.bounds, ir.Length) or use.bounds.weight is None:
        return None
    cost = len(use.graph.agents) * nodes_at_most(use.bounds, whole_bounds(use.bounds)[1])
    return TooLarge(cost) if cost > use.room else None


def _of_agents(kind: str, number: int, parts: tuple[Node, ...], span: Span) -> Node:
    match kind:
        case "every":
            return All(parts, span)
        case "some":
            return Any(parts, span)
        case _:
            return AtLeast(number, parts, span)


def _too_large(formula: ir.Apply, nodes: int, room: int) -> Diagnostic:
    bounds = formula.bounds
    if isinstance(bounds, ir.Length) and bounds.weight is not None:
        return Diagnostic(
            TOO_LARGE_TO_EXPAND,
            f"this `{formula.operator.name}` expands to at least {nodes} parts; the limit is {room}",
            Label(formula.span, f"the expansion distinguishes every sum of `{bounds.word}`"),
            help="raise the limit with `--limit formula_nodes=VALUE`",
        )
    return Diagnostic(
        TOO_LARGE_TO_EXPAND,
        f"this `{formula.operator.name}` expands to at least {nodes} parts; the limit is {room}",
        Label(formula.span, "too many routes have at least this length"),
        notes=("a lower bound requires the set of visited agents",),
        help="raise the limit with `--limit formula_nodes=VALUE`",
    )

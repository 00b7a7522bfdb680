"""Loss of agents: the meaning of a formula about a team without some of its agents.

Graphs lose the links of lost agents, and quantifiers skip these agents; ``connected`` and formations are about the
remaining ones. Formulas that name a lost agent, or measure a distance to it, have no meaning.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations
from typing import assert_never

from missionc import ir
from missionc.base.source import Span
from missionc.ir.language.walk_formulas import as_written, formulas_bottom_up


def without_any(
    number: int, agents: ir.AgentSet, body: ir.Formula, span: Span
) -> tuple[ir.Without, tuple[ir.Formula, ...]]:
    """Formula for every loss of ``number`` of the agents, and the parts of ``body`` that name an agent that may be
    lost.
    """
    lost = tuple(combinations(agents.agents, number))
    losses = [_Loss(frozenset(some)) for some in lost]
    cases = tuple(loss.of(body) for loss in losses)
    named = {part.span: part for loss in losses for part in loss.named}
    return ir.Without(number, agents, body, lost, cases, span), tuple(named.values())


def named_members(formula: ir.Formula) -> int:
    """Number of agents and links in the sets of a formula, which each loss copies."""
    count = 0
    for part in formulas_bottom_up([formula], as_written):
        match part:
            case ir.Holds(predicate):
                count += len(predicate.others) + (len(predicate.formation.edges) if predicate.formation else 0)
            case ir.Apply(bounds=ir.Length(graph=graph)):
                count += len(graph.agents)
            case ir.AtLeastOf(agents=agents):
                count += len(agents.agents)
    return count


class _Loss:
    """Rewrites formulas for the loss of the ``lost`` agents; ``named`` collects subformulas that name one of them."""

    def __init__(self, lost: frozenset[int]) -> None:
        self.lost = lost
        self.named: list[ir.Formula] = []
        self._graphs: dict[ir.Graph, ir.Graph] = {}

    def of(self, formula: ir.Formula) -> ir.Formula:
        """The formula without the lost agents; the same object if nothing changes."""
        made: dict[ir.Formula, ir.Formula] = {}
        for each in formulas_bottom_up([formula], as_written):
            made[each] = self._left(each, [made[part] for part in as_written(each)])
        return made[formula]

    def _left(self, formula: ir.Formula, parts: Sequence[ir.Formula]) -> ir.Formula:
        same = all(part is before for part, before in zip(parts, as_written(formula), strict=True))
        match formula:
            case ir.Truth() | ir.Belongs():
                return formula
            case ir.Holds(predicate, span):
                return formula if self.lost.isdisjoint(predicate.others) else self._holds(formula, predicate, span)
            case ir.Apply(bounds=bounds):
                if isinstance(bounds, ir.Length) and not self.lost.isdisjoint(bounds.graph.agents):
                    bounds = replace(bounds, graph=self._graph(bounds.graph))
                same = same and bounds is formula.bounds
                return formula if same else replace(formula, operands=tuple(parts), bounds=bounds)
            case ir.AtLeastOf(kind, number, agents):
                left = self._agents(agents)
                number = {"every": len(left.agents), "some": 1}.get(kind, number)
                return (
                    formula if same and left is agents else replace(formula, number=number, agents=left, body=parts[0])
                )
            case ir.OfAgent(agent):
                if agent in self.lost:
                    self.named.append(formula)
                return formula if same else replace(formula, body=parts[0])
            case ir.Without(number, agents, _, _, _, span):
                left = self._agents(agents)
                if same and left is agents:
                    return formula
                further, named = without_any(min(number, len(left.agents)), left, parts[0], span)
                self.named.extend(named)
                return further
            case _:
                assert_never(formula)

    def _holds(self, formula: ir.Holds, predicate: ir.Predicate, span: Span) -> ir.Formula:
        left = predicate.among(predicate.others - self.lost)
        if left is not None:
            return ir.Holds(left, span)
        if predicate.graph is None and predicate.formation is None:
            self.named.append(formula)
        return ir.Truth(True, span)

    def _agents(self, agents: ir.AgentSet) -> ir.AgentSet:
        left = tuple(agent for agent in agents.agents if agent not in self.lost)
        return agents if left == agents.agents else replace(agents, agents=left)

    def _graph(self, graph: ir.Graph) -> ir.Graph:
        if graph not in self._graphs:
            left = tuple(agent for agent in graph.agents if agent not in self.lost)
            self._graphs[graph] = replace(graph, agents=left)
        return self._graphs[graph]

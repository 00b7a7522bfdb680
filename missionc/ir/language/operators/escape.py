"""``escape[a..b] f``: a route of agents that satisfy ``f``, ends included, to an agent at a distance within the bounds.

The distance is that of the shortest path over all agents, so route and distance are separate formulas for each target.
With a lower bound of 0, the evaluated agent itself is a target if it satisfies ``f``.

Source:
    [strel] Table 1; of three possible readings, the reading of its prose.
"""

from __future__ import annotations

from missionc.ir import Apply
from missionc.ir.kernel.nodes import All, Any, Is, Node, Reach
from missionc.ir.language.operator import Bounds, Operator, Use
from missionc.ir.language.weighed_routes import distance_from, most_hops, no_hops


def expand(use: Use) -> Node:
    (body,) = use.arguments
    length, span = use.length, use.span
    if length.low <= 0:
        return body

    def towards(agent: int) -> Node:
        end = All((body, Is(frozenset((agent,)), span)), span)
        route = Reach(length.graph, body, end, most_hops(length), span)
        return All((route, distance_from(length, agent, span)), span)

    return Any(tuple(towards(agent) for agent in length.graph.agents), span)


def traps(use: Apply) -> tuple[str, ...]:
    return ("escape without a lower bound" if no_hops(use) else "length of an escape",)


OPERATOR = Operator(
    name="escape",
    letter="E",
    bounds=Bounds.LENGTH,
    expand=expand,
    says="a route over agents that satisfy the operand leads to an agent at a distance within the bounds",
    reads="a route on {graph} leads from {here} to an agent{perhaps} whose shortest way from {here} is "
    "{far}, and {body:agent on it, both ends included,}",
    example="escape[hops 2.. on radio] not threat",
    traps=traps,
)

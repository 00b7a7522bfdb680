"""``count[a..b] f >= n``: so many agents with ``f`` have their shortest way from here within the bounds.

The agent itself counts where the lower bound is 0, also outside the graph.
"""

from __future__ import annotations

from missionc.ir import Apply
from missionc.kernel.nodes import All, At, AtLeast, Is, Node, Not
from missionc.language.operator import Bounds, Fixity, Operator, Use
from missionc.language.route_lengths import distance_to, no_hops


def expand(use: Use) -> Node:
    (body,) = use.arguments
    length, span = use.length, use.span

    def counts(agent: int) -> Node:
        other = Not(Is(frozenset((agent,)), span), span)
        return All((other, distance_to(length, agent, span), At(agent, body, span)), span)

    itself = (body,) if length.low <= 0 else ()
    parts = itself + tuple(counts(agent) for agent in length.graph.agents)
    return _compared(parts, use)


def _compared(parts: tuple[Node, ...], use: Use) -> Node:
    span, number = use.span, use.number
    match use.comparison:
        case ">=":
            return AtLeast(number, parts, span)
        case ">":
            return AtLeast(number + 1, parts, span)
        case "<=":
            return Not(AtLeast(number + 1, parts, span), span)
        case "<":
            return Not(AtLeast(number, parts, span), span)
        case "=":
            return All((AtLeast(number, parts, span), Not(AtLeast(number + 1, parts, span), span)), span)
        case _:
            raise AssertionError(use.comparison)


def traps(use: Apply) -> tuple[str, ...]:
    return ("count of oneself",) if no_hops(use) else ()


OPERATOR = Operator(
    name="count",
    letter="",
    fixity=Fixity.PREFIX,
    bounds=Bounds.LENGTH,
    spatial=True,
    expand=expand,
    says="so many agents where it holds are as far away as the bounds say",
    reads="of the agents whose shortest way from {here} on {graph} is {far}{included}, there are {number} "
    "of which each {body}",
    example="count[hops 1..1 on radio] field >= 2",
    traps=traps,
)

"""``everywhere[a..b] f``: ``not somewhere[a..b] not f``, every route within the bounds ends at an agent with ``f``."""

from __future__ import annotations

from missionc.ir.kernel.nodes import Node, Not
from missionc.ir.language.operator import Bounds, Fixity, Operator, TooLarge, Use
from missionc.ir.language.operators.reach import of_routes, reach
from missionc.ir.language.weighed_routes import always_true


def expand(use: Use) -> Node | TooLarge:
    (body,) = use.arguments
    broken = reach(use, always_true(use.span), Not(body, use.span))
    return broken if isinstance(broken, TooLarge) else Not(broken, use.span)


OPERATOR = Operator(
    name="everywhere",
    letter="",
    fixity=Fixity.PREFIX,
    bounds=Bounds.LENGTH,
    spatial=True,
    expand=expand,
    says="every route within the bounds ends at an agent where it holds",
    reads="{body:agent to which {route} leads from {here}{included}}",
    example="everywhere[hops 0..1 on radio] not fire",
    traps=of_routes,
)

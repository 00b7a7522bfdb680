"""``somewhere[a..b] f``: ``true reach[a..b] f``, a route within the bounds to an agent with ``f``."""

from __future__ import annotations

from missionc.ir.kernel.nodes import Node
from missionc.ir.language.operator import Bounds, Fixity, Operator, TooLarge, Use
from missionc.ir.language.operators.reach import of_routes, reach
from missionc.ir.language.weighed_routes import always_true


def expand(use: Use) -> Node | TooLarge:
    (body,) = use.arguments
    return reach(use, always_true(use.span), body)


OPERATOR = Operator(
    name="somewhere",
    letter="",
    fixity=Fixity.PREFIX,
    bounds=Bounds.LENGTH,
    spatial=True,
    expand=expand,
    says="some route within the bounds ends at an agent where it holds",
    reads="{route} leads from {here} to an agent{perhaps} that {body}",
    example="somewhere[hops 1..2 on radio] base",
    traps=of_routes,
)

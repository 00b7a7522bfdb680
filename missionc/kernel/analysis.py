"""The look-ahead of kernel formulas: how many steps must follow the one that each is asked at."""

from __future__ import annotations

from collections.abc import Iterable
from typing import assert_never

from missionc.kernel.nodes import (
    All,
    Any,
    Apart,
    At,
    AtLeast,
    Atom,
    Is,
    Nearby,
    Node,
    Not,
    Reach,
    Route,
    Sometime,
    Throughout,
    Until,
)
from missionc.kernel.walk import children, postorder


def steps_ahead(roots: Iterable[Node]) -> dict[Node, int]:
    """Of every node of formulas that a mission lasts long enough for; a window to the end counts up to where it begins.

    Source:
        [strel] Definition 5, with ``until``'s left side asked one step less far.
    """
    known: dict[Node, int] = {}
    for node in postorder(roots):
        match node:
            case Throughout(body, low, high) | Sometime(body, low, high):
                known[node] = low if high is None else high + known[body]
            case Until(hold, end, low, high):
                ends = low if high is None else high + known[end]
                held = high - 1 + known[hold] if high else 0
                known[node] = max(ends, held)
            case Atom() | Is() | Not() | All() | Any() | AtLeast() | Nearby() | Reach() | Route() | Apart() | At():
                known[node] = max((known[child] for child in children(node)), default=0)
            case _:
                assert_never(node)
    return known

"""Conjuncts of kernel formulas: necessary conditions on one agent or the team, each over time windows."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

from missionc.ir.kernel.nodes import All, Always, At, Node
from missionc.ir.kernel.walk import asks


class Conjunct(NamedTuple):
    """Necessary condition: a formula that must hold for an agent, or for the team (None), over nested windows,
    outermost first."""

    agent: int | None
    windows: tuple[Always, ...]
    formula: Node

    @property
    def steps(self) -> slice | None:
        """Steps at which the formula must hold; None for nested windows, whose steps are not a single range."""
        match self.windows:
            case ():
                return slice(0, 1)
            case (window,):
                return asks(window)[0].steps
            case _:
                return None


def conjuncts(formulas: Iterable[Node]) -> Iterator[Conjunct]:
    """Yield the conjuncts of formulas that must be true at step 0, in their order, without repetition."""
    work = [Conjunct(None, (), formula) for formula in formulas][::-1]
    seen: set[Conjunct] = set()
    while work:
        what = work.pop()
        if what in seen:
            continue
        seen.add(what)
        agent, windows, node = what
        match node:
            case All(parts):
                work.extend(Conjunct(agent, windows, part) for part in reversed(parts))
            case Always(body):
                work.append(Conjunct(agent, (*windows, node), body))
            case At(who, body):
                work.append(Conjunct(who, windows, body))
            case _:
                yield what

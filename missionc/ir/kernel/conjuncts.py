"""Conjuncts of kernel formulas: necessary parts, each about an agent or the team, over windows."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

from missionc.ir.kernel.nodes import All, Always, At, Node
from missionc.ir.kernel.walk import asks


class Conjunct(NamedTuple):
    """A formula that must hold for an agent, or for the team (None), over nested windows, the outermost first."""

    agent: int | None
    windows: tuple[Always, ...]
    formula: Node

    @property
    def steps(self) -> slice | None:
        """The steps at which it must hold; None for nested windows, which are more than one range."""
        match self.windows:
            case ():
                return slice(0, 1)
            case (window,):
                return asks(window)[0].steps
            case _:
                return None


def conjuncts(formulas: Iterable[Node]) -> Iterator[Conjunct]:
    """Yield the conjuncts that these formulas need at step 0, in their order, each once."""
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

"""Facts that a must-analysis found of formulas: values that stay from one version of a mission to the next.

Sets of agents are the bits of a number.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import field

from missionc.base.late_dataclass import dataclass
from missionc.ir import Agent, Formula, Predicate


@dataclass(frozen=True, slots=True)
class Sure:
    """The agents of whom a formula is surely true, and surely false; ``number`` says which formulas are the same."""

    number: int
    true: int
    false: int

    @property
    def opposite(self) -> Sure:
        return Sure(-self.number, self.false, self.true)


@dataclass(slots=True)
class SureFacts:
    """``everyone``: the bits of all agents. What stood in earlier versions of the mission may still be among it."""

    everyone: int
    sure: dict[Formula, Sure] = field(default_factory=dict)
    numbers: dict[Hashable, int] = field(default_factory=dict)
    members: dict[int, frozenset[int]] = field(default_factory=dict)
    predicates: dict[Predicate, tuple[int, int]] = field(default_factory=dict)
    kinds: tuple[tuple[Agent, int], ...] = ()
    """One agent of each kind (those alike in all but name), and the bits of all of that kind."""

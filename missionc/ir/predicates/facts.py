"""Facts of predicates: properties that all kinds of predicates provide."""

from __future__ import annotations

from typing import Self

from missionc.ir.couplings import Formation, Graph
from missionc.ir.places import Region
from missionc.ir.predicates.views import Array, Borders, Changes, Measures, Phrases, Words


class PredicateFacts:
    """Base class of predicates about an agent or the team at one step; each kind overrides some of these defaults."""

    __slots__ = ()

    @property
    def region(self) -> Region | None:
        """Region whose border, possibly moved by the agent's body radius, is the boundary of truth; None if no region
        has such a border."""
        return None

    @property
    def graph(self) -> Graph | None:
        """Communication graph that the predicate reads; None if it reads no graph."""
        return None

    @property
    def restricted(self) -> Graph | None:
        """Communication graph restricted to the agents that must be connected; None if the predicate reads no graph."""
        return self.graph

    @property
    def formation(self) -> Formation | None:
        """Formation that the predicate is about; None if it is about no formation."""
        return None

    @property
    def about_team(self) -> bool:
        """True if the predicate's truth at a step is the same for every agent."""
        return False

    @property
    def others(self) -> frozenset[int]:
        """Agents that the predicate names, whose positions it reads for every evaluated agent."""
        return frozenset()

    @property
    def pairs(self) -> tuple[tuple[int, int], ...]:
        """Pairs of named agents whose positions the predicate compares."""
        return ()

    def pairs_of(self, agent: int) -> tuple[tuple[int, int], ...]:
        """Pairs of agents whose positions the predicate compares if it is evaluated for ``agent``."""
        return self.pairs

    def asked_of(self, agent: int) -> Self:
        """Predicate without relations of ``agent`` to itself, for evaluation at that agent."""
        return self

    def among(self, agents: frozenset[int]) -> Self | None:
        """Predicate restricted to the named agents that are in ``agents``; None if nothing remains."""
        return self if self.others <= agents else None

    @property
    def parts(self) -> tuple[Self, ...]:
        """Predicates about fewer agents whose conjunction equals this predicate; the predicate itself if it cannot be
        split."""
        return (self,)

    @property
    def reads_speed(self) -> bool:
        return False

    @property
    def reads_heading(self) -> bool:
        return False

    @property
    def reads_motion(self) -> bool:
        """True if it depends on the motion to the next step, whatever the dynamics."""
        return False

    @property
    def is_of_speed(self) -> bool:
        """True if the margin is in m/s."""
        return False

    @property
    def reads_past(self) -> bool:
        """True if the predicate depends on earlier steps, so that the agent's current state does not decide it."""
        return False

    @property
    def regions(self) -> tuple[Region, ...]:
        """Regions on which the predicate depends."""
        return () if self.region is None else (self.region,)

    @property
    def unit(self) -> str:
        """Unit of the predicate's margin."""
        return "m"

    @property
    def open_border(self) -> bool:
        """True if the predicate is false when its margin is exactly 0."""
        return False

    @property
    def is_exact(self) -> bool:
        """True if the predicate is satisfied only at exact positions, which random roadmap nodes have only by
        chance."""
        return False

    def reads_oneself(self, dimension: int) -> bool:
        """Return true if the predicate depends on the state of the evaluated agent."""
        return not self.about_team

    def margin(self, view: Measures) -> Array:
        """Margin of the predicate: signed distance to the boundary of its truth, positive if true; (...), metres.

        The unit is m/s if ``is_of_speed``. A margin of 0 does not decide the truth.
        """
        raise NotImplementedError

    def rate(self, view: Changes) -> Array:
        """Upper bound on the rate of change of the margin: (...), m/s."""
        raise NotImplementedError

    def moved(self, borders: Borders) -> Self:
        """Predicate with the boundary of its truth moved."""
        raise NotImplementedError

    def show(self, words: Words) -> str:
        """Text of the predicate as a formula."""
        raise NotImplementedError

    def phrases(self, words: Phrases) -> tuple[str, str]:
        """Wording of the predicate and of its negation: verb phrases about an agent, or clauses about the team."""
        raise NotImplementedError

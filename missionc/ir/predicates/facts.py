"""Facts of predicates: what is asked of one whichever it is."""

from __future__ import annotations

from typing import Self

from missionc.ir.couplings import Formation, Graph
from missionc.ir.places import Region
from missionc.ir.predicates.views import Array, Borders, Changes, Measures, Phrases, Words


class PredicateFacts:
    """A proposition about an agent or the team at one step; a kind says otherwise where it differs from this."""

    __slots__ = ()

    @property
    def region(self) -> Region | None:
        """The region whose border is the border of its truth, moved by the agent's body or not at all."""
        return None

    @property
    def graph(self) -> Graph | None:
        """The graph that it is about."""
        return None

    @property
    def restricted(self) -> Graph | None:
        """That graph over the agents alone that are to be connected on it."""
        return self.graph

    @property
    def formation(self) -> Formation | None:
        """The formation that it is about."""
        return None

    @property
    def about_team(self) -> bool:
        """Whether it has one truth at a step, whichever agent it is asked of."""
        return False

    @property
    def others(self) -> frozenset[int]:
        """The agents that it names: it reads where these are, whichever agent it is asked of."""
        return frozenset()

    @property
    def pairs(self) -> tuple[tuple[int, int], ...]:
        """The named agents whose places it compares with each other."""
        return ()

    def pairs_of(self, agent: int) -> tuple[tuple[int, int], ...]:
        """The agents whose places it compares with each other, asked of an agent."""
        return self.pairs

    def asked_of(self, agent: int) -> Self:
        """It without what an agent, of whom it is asked, is to itself."""
        return self

    def among(self, agents: frozenset[int]) -> Self | None:
        """What it asks of those it names, as far as they are among these; None where that is nothing."""
        return self if self.others <= agents else None

    @property
    def parts(self) -> tuple[Self, ...]:
        """Predicates about fewer agents, of which it is the conjunction; itself where there are none."""
        return (self,)

    @property
    def reads_speed(self) -> bool:
        return False

    @property
    def reads_heading(self) -> bool:
        return False

    @property
    def is_of_speed(self) -> bool:
        """Whether its margin is in m/s."""
        return False

    @property
    def reads_past(self) -> bool:
        """Whether the steps before bear on it: no state of an agent decides it."""
        return False

    @property
    def regions(self) -> tuple[Region, ...]:
        """The regions that it is about."""
        return () if self.region is None else (self.region,)

    @property
    def unit(self) -> str:
        """The unit of its margin."""
        return "m"

    @property
    def open_border(self) -> bool:
        """Whether it is false where its margin is exactly 0."""
        return False

    @property
    def is_exact(self) -> bool:
        """Whether it wants agents at places that a roadmap, whose places are drawn at random, has only by chance."""
        return False

    def reads_oneself(self, dimension: int) -> bool:
        """Whether the state of the agent that it is asked of bears on it."""
        return not self.about_team

    def margin(self, view: Measures) -> Array:
        """The signed distance to the border of its truth, positive where true: (...), metres.

        Where it ``is_of_speed``, m/s. At exactly 0 the sign says nothing.
        """
        raise NotImplementedError

    def rate(self, view: Changes) -> Array:
        """A bound on how fast its margin changes: (...), metres per second."""
        raise NotImplementedError

    def moved(self, borders: Borders) -> Self:
        """It with the border of its truth moved."""
        raise NotImplementedError

    def show(self, words: Words) -> str:
        """It as a formula."""
        raise NotImplementedError

    def phrases(self, words: Phrases) -> tuple[str, str]:
        """What it says and what its negation says: verbs of an agent, or clauses where it is about the team."""
        raise NotImplementedError

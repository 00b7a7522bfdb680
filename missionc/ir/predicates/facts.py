"""Facts of predicates, common to all kinds."""

from __future__ import annotations

from typing import Self

from missionc.ir.couplings import Formation, Graph
from missionc.ir.places import Region
from missionc.ir.predicates.views import Array, Borders, Changes, Measures, Phrases, Words


class PredicateFacts:
    """Facts of a proposition about an agent or the team at one step; kinds override these defaults."""

    __slots__ = ()

    @property
    def region(self) -> Region | None:
        """Region whose border, possibly moved by the agent's body, is the boundary of truth."""
        return None

    @property
    def graph(self) -> Graph | None:
        """Graph of the predicate."""
        return None

    @property
    def restricted(self) -> Graph | None:
        """That graph restricted to the agents that must be connected."""
        return self.graph

    @property
    def formation(self) -> Formation | None:
        """Formation of the predicate."""
        return None

    @property
    def about_team(self) -> bool:
        """True if its truth at a step is the same for every agent."""
        return False

    @property
    def others(self) -> frozenset[int]:
        """Named agents, whose positions it reads for every evaluated agent."""
        return frozenset()

    @property
    def pairs(self) -> tuple[tuple[int, int], ...]:
        """Pairs of named agents whose positions it compares."""
        return ()

    def pairs_of(self, agent: int) -> tuple[tuple[int, int], ...]:
        """Pairs of agents whose positions it compares if evaluated for ``agent``."""
        return self.pairs

    def asked_of(self, agent: int) -> Self:
        """The predicate without relations of ``agent`` to itself, if evaluated for it."""
        return self

    def among(self, agents: frozenset[int]) -> Self | None:
        """The predicate restricted to those of its named agents in ``agents``; None if nothing remains."""
        return self if self.others <= agents else None

    @property
    def parts(self) -> tuple[Self, ...]:
        """Predicates about fewer agents whose conjunction it is; itself if it cannot be split."""
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
        """True if its margin is in m/s."""
        return False

    @property
    def reads_past(self) -> bool:
        """True if it depends on earlier steps, so that no state of an agent decides it."""
        return False

    @property
    def regions(self) -> tuple[Region, ...]:
        """Regions of the predicate."""
        return () if self.region is None else (self.region,)

    @property
    def unit(self) -> str:
        """The unit of its margin."""
        return "m"

    @property
    def open_border(self) -> bool:
        """True if the predicate is false at margin exactly 0."""
        return False

    @property
    def is_exact(self) -> bool:
        """True if it needs exact positions, which a roadmap with random nodes only has by chance."""
        return False

    def reads_oneself(self, dimension: int) -> bool:
        """Return whether it depends on the state of the evaluated agent."""
        return not self.about_team

    def margin(self, view: Measures) -> Array:
        """Signed distance to the boundary of its truth, positive if true: (...), metres.

        In m/s if it ``is_of_speed``. At exactly 0 the sign is undecided.
        """
        raise NotImplementedError

    def rate(self, view: Changes) -> Array:
        """Bound on the rate of change of its margin: (...), m/s."""
        raise NotImplementedError

    def moved(self, borders: Borders) -> Self:
        """The predicate with the boundary of its truth moved."""
        raise NotImplementedError

    def show(self, words: Words) -> str:
        """Text as a formula."""
        raise NotImplementedError

    def phrases(self, words: Phrases) -> tuple[str, str]:
        """Wording of it and of its negation: verbs of an agent, or clauses if it is about the team."""
        raise NotImplementedError

"""Margins of non-temporal formulas for one agent at given points, if its position and speed decide them.

in   Mission, an agent, points and, if relevant, its speed
out  the domain for ``kernel.evaluate``
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from missionc.base.trace import Array
from missionc.ir import Mission, Predicate
from missionc.ir.kernel.evaluate import Domain
from missionc.ir.kernel.nodes import NeighbourNode, PathLength, ReachNode, RouteNode, UntilNode, WindowNode
from missionc.ir.language.margins.predicate_margins import of_states


class PointMargins(Domain["Array | None"]):
    """Domain of margins of one agent at points, (points,), metres; None for formulas that the position does not decide.

    Args:
        speed: speed at the points, (points,), m/s; if None, predicates of speed are undecided.
    """

    def __init__(self, mission: Mission, agent: int, points: Array, speed: Array | None = None) -> None:
        self.mission, self.agent, self.points = mission, agent, points
        self.known, self.velocity = speed is not None, np.zeros_like(points)
        if speed is not None:
            self.velocity[:, 0] = speed

    def atom(self, predicate: Predicate, holds: bool) -> Array | None:
        """Margin of a predicate (or of its negation) at the points: (points,), metres; None if undecided."""
        if predicate.others or predicate.about_team or predicate.restricted is not None:
            return None
        if predicate.reads_past or predicate.reads_heading or (predicate.reads_speed and not self.known):
            return None
        value: Array = of_states(predicate, self.mission, self.agent, self.points, self.velocity)
        return value if holds else 0.0 - value

    def member(self, agents: frozenset[int], holds: bool) -> Array | None:
        """Infinite margin, positive if the agent is a member: (points,), metres."""
        return np.full(len(self.points), np.inf if (self.agent in agents) == holds else -np.inf)

    def meet(self, parts: Sequence[Array | None]) -> Array | None:
        """Least of the known margins of a conjunction: (points,), metres; None if no margin is known."""
        known = [part for part in parts if part is not None]
        return np.min(np.stack(known), axis=0) if known else None

    def join(self, parts: Sequence[Array | None]) -> Array | None:
        """Greatest margin of a disjunction: (points,), metres; None if a margin is unknown."""
        known = [part for part in parts if part is not None]
        return np.max(np.stack(known), axis=0) if known and len(known) == len(parts) else None

    def at_least(self, count: int, parts: Sequence[Array | None]) -> Array | None:
        """The ``count``-th largest margin of the parts: (points,), metres; None if a margin is unknown."""
        known = [part for part in parts if part is not None]
        if len(known) < len(parts):
            return None
        chosen: Array = np.sort(np.stack(known), axis=0)[-count]
        return chosen

    def window(self, node: WindowNode, body: Array | None) -> Array | None:
        """None instead of margins, (points,), metres: the position at one time does not decide a temporal operator."""
        return None

    def until(self, node: UntilNode, hold: Array | None, end: Array | None) -> Array | None:
        """None instead of margins, (points,), metres: the position at one time does not decide a temporal operator."""
        return None

    def at(self, agent: int, body: Array | None) -> Array | None:
        """Margin of the body if ``agent`` is this agent: (points,), metres; None for another agent."""
        return body if agent == self.agent else None

    def neighbour(self, node: NeighbourNode, body: Array | None) -> Array | None:
        """None instead of margins, (points,), metres: links depend on other agents."""
        return None

    def reach(self, node: ReachNode, through: Array | None, end: Array | None) -> Array | None:
        """None instead of margins, (points,), metres: routes depend on other agents."""
        return None

    def route(self, node: RouteNode, through: Array | None, end: Array | None) -> Array | None:
        """None instead of margins, (points,), metres: routes depend on other agents."""
        return None

    def path_length(self, node: PathLength, holds: bool) -> Array | None:
        """None instead of margins, (points,), metres: path lengths depend on other agents."""
        return None

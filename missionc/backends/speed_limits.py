"""Local speed limits: greatest speed of an agent at points, derived from requirements that hold at all times.

    in   Mission, formulas of one agent without temporal operators
    out  greatest speed at each point

``apron implies speed <= 4 m/s`` is a limit of 4 m/s in the apron only.

Margins of non-temporal formulas for one agent at given points, if its position and speed decide them.

in   Mission, an agent, points and, if relevant, its speed
out  the domain for ``kernel.evaluate``
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from missionc.base.trace import Array, Flags
from missionc.geometry.dynamics import speeds
from missionc.ir import Mission, Predicate
from missionc.ir.kernel.evaluate import Domain, evaluate
from missionc.ir.kernel.nodes import Atom, NeighbourNode, Node, PathLength, ReachNode, RouteNode, UntilNode, WindowNode
from missionc.ir.kernel.walk import postorder
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


HALVINGS = 12
"""Number of bisection steps between an allowed and a forbidden speed."""

LEAST = 0.05
"""Least fraction of its top speed that an agent keeps at any point, so that it can always move."""


def slowness(mission: Mission, agent: int, nodes: Sequence[Node], points: Array) -> Array | None:
    """Time per metre, relative to that at top speed, at points (points, dim), metres -> (points,), dimensionless.

    The result is None if no formula limits the speed. A formula is a limit if it holds at rest but not at top speed.
    """
    about_speed = [node for node in nodes if any(_of_speed(each) for each in postorder((node,)))]
    if not about_speed:
        return None
    slowest, top = speeds(mission.agents[agent].dynamics)
    allowed = np.full(len(points), top)

    def holds(speed: Array) -> Flags:
        values = evaluate(about_speed, PointMargins(mission, agent, points, speed))
        known = [value for node in about_speed if (value := values[node]) is not None]
        held: Flags = np.min(np.broadcast_arrays(*known, np.zeros(len(points))), axis=0) >= 0
        return held

    least = max(slowest, LEAST * top)
    bound = holds(np.full(len(points), least)) & ~holds(allowed)
    if not bound.any():
        return None
    low, high = np.where(bound, least, top), allowed
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        good = holds(middle)
        low, high = np.where(good, middle, low), np.where(good, high, middle)
    slower: Array = top / low
    return slower


def _of_speed(node: Node) -> bool:
    return isinstance(node, Atom) and node.predicate.reads_speed and not node.predicate.reads_heading

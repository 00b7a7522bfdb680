"""Local speed limits: greatest speed of an agent at points, derived from requirements that hold at all times.

    in   Mission, formulas of one agent without temporal operators
    out  greatest speed at each point

``apron implies speed <= 4 m/s`` is a limit of 4 m/s in the apron only.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from missionc.backends.point_margins import PointMargins
from missionc.base.trace import Array, Flags
from missionc.geometry.dynamics import speeds
from missionc.ir import Mission
from missionc.ir.kernel.evaluate import evaluate
from missionc.ir.kernel.nodes import Atom, Node
from missionc.ir.kernel.walk import postorder

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

"""Required separation of agents for many pairs at once: the ellipsoids of ``Mission.spacing`` as a scaled distance."""

from __future__ import annotations

from weakref import WeakKeyDictionary

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Indices
from missionc.ir import Mission


class SpacingTable(Record, eq=False):
    """Table of the required separations ``Mission.spacing``; agents with equal radius, vehicle and drift are of one
    kind.

    Two agents are far enough apart if their difference, each axis multiplied by ``metric``, is at least ``between``
    long.

    Args:
        kind: index of each agent's kind, (agents,).
        sideways: required horizontal distance by kind, (kinds, kinds), metres.
        flatness: ratio of the horizontal to the vertical half axis, (kinds, kinds).
        dimension: dimension of the mission's world.
    """

    kind: Indices
    sideways: Array
    flatness: Array
    dimension: int

    @staticmethod
    def of(mission: Mission) -> SpacingTable:
        """Table of required separations of a mission, computed once per mission."""
        if mission not in _TABLES:
            _TABLES[mission] = _made(mission)
        return _TABLES[mission]

    def between(self, first: Indices, second: Indices) -> Array:
        """Required horizontal distances between the centres of agents ``first`` and ``second``, metres; index arrays
        (...) broadcast."""
        return np.asarray(self.sideways[self.kind[first], self.kind[second]])

    def metric(self, first: Indices, second: Indices) -> Array | None:
        """Factors on each axis of the pairs' differences, (..., dim), dimensionless; None if all directions are
        equal."""
        if self.round:
            return None
        factors = np.ones((*np.broadcast_shapes(np.shape(first), np.shape(second)), self.dimension))
        factors[..., 2] = self.flatness[self.kind[first], self.kind[second]]
        return factors

    @property
    def round(self) -> bool:
        """True if the required distance of every pair is the same in all directions."""
        return bool((self.flatness == 1).all())

    @property
    def widest(self) -> float:
        """Greatest required distance of any pair in any direction, metres; 0 without agents."""
        return float((self.sideways * np.maximum(1.0, 1.0 / self.flatness)).max(initial=0.0))

    def among(self, agents: Indices) -> float:
        """Greatest required horizontal distance between two agents of the kinds of ``agents``, metres.

        Args:
            agents: mission indices, (some,).
        """
        kinds = self.kind[agents]
        return float(self.sideways[np.ix_(kinds, kinds)].max(initial=0.0))


_TABLES: WeakKeyDictionary[Mission, SpacingTable] = WeakKeyDictionary()


def _made(mission: Mission) -> SpacingTable:
    kinds: dict[object, int] = {}
    first: list[int] = []
    kind = []
    for agent in mission.agents:
        key = (agent.radius, agent.vehicle, mission.drift[agent.index] if mission.drift else 0.0)
        if key not in kinds:
            kinds[key] = len(kinds)
            first.append(agent.index)
        kind.append(kinds[key])
    table = [[mission.spacing(one, other) for other in first] for one in first]
    sideways, flatness = (
        np.array([[getattr(each, axis) for each in row] for row in table], dtype=float).reshape(len(first), len(first))
        for axis in ("sideways", "flatness")
    )
    return SpacingTable(np.array(kind, dtype=np.int64), sideways, flatness, mission.dimension)

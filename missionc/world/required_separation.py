"""Required separation of agents, for many pairs at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from missionc.base.late_dataclass import dataclass
from missionc.base.trace import Array
from missionc.ir import Mission


@dataclass(frozen=True, slots=True, eq=False)
class Spacing:
    """``Mission.spacing`` as a table: agents with one radius and one vehicle are of one kind."""

    kind: NDArray[np.int64]
    table: Array

    @staticmethod
    def of(mission: Mission) -> Spacing:
        kinds: dict[object, int] = {}
        first: list[int] = []
        kind = []
        for agent in mission.agents:
            key = (agent.radius, agent.vehicle)
            if key not in kinds:
                kinds[key] = len(kinds)
                first.append(agent.index)
            kind.append(kinds[key])
        table = [[float(mission.spacing(one, other)) for other in first] for one in first]
        return Spacing(np.array(kind, dtype=np.int64), np.array(table).reshape(len(first), len(first)))

    def between(self, first: NDArray[np.int64], second: NDArray[np.int64]) -> Array:
        """Metres from centre to centre, of agents by their numbers: two arrays that broadcast to one."""
        return np.asarray(self.table[self.kind[first], self.kind[second]])

    @property
    def widest(self) -> float:
        """The largest of any two, metres; 0 where there is no agent."""
        return float(self.table.max(initial=0.0))

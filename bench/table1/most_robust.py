"""Greatest robustness of a mission: stlpy's formula tree in HiGHS, maximised instead of stopped at the first point.

The encoding of ``formula_rows``, with one more variable ρ: each predicate that counts holds by at least ρ metres.
Agents start at points. The speed limit of a single integrator, and those of a double integrator on speed and
acceleration, are squares within the discs. Obstacles are predicates like the others, as in stlpy's benchmarks, at the
samples only.

Source:
    V. Kurtz and H. Lin, Mixed-integer programming for STL with fewer binary variables.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from scipy.optimize import Bounds, milp

from missionc.base.trace import Array
from missionc.ir import Mission
from missionc.ir.dynamics.kinds import DoubleIntegrator, SingleIntegrator
from missionc.ir.kernel.nodes import Kernel
from table1.formula_rows import FormulaRows, Terms
from table1.scene import Unsupported
from table1.specification import Stl, specification

SQUARE = (1 - 1e-4) / np.sqrt(2)
"""Half the side of a square within a disc of radius 1."""


@dataclass(frozen=True, slots=True)
class Optimum:
    """Robustness in metres, None without a plan; ``proven``: HiGHS ended, within ``seconds`` of the processor."""

    robustness: float | None
    proven: bool
    seconds: float


def most_robust(mission: Mission, kernel: Kernel, limit: float) -> Optimum:
    """Plan of the greatest robustness at the samples, within ``limit`` seconds of the solver.

    Raises:
        Unsupported: no linear form, or no starts at points.
    """
    starts = [agent.start.point for agent in mission.agents if agent.start is not None]
    if mission.dimension != 2 or len(starts) < len(mission.agents) or None in starts:
        raise Unsupported("all agents have to start at points of the plane")
    start = np.array(starts, dtype=float)
    rows = _Rows(mission, start)
    rows.formula(specification(mission, kernel, start, guard=0.0), 0, None)
    begin = time.process_time()
    robustness, proven = rows.solve(limit)
    return Optimum(robustness, proven, time.process_time() - begin)


class _Rows(FormulaRows):
    """Variables: ρ, positions step by step, velocities step by step of double integrators, then the binaries."""

    def __init__(self, mission: Mission, start: Array) -> None:
        super().__init__()
        self.mission, self.size = mission, start.size
        states = self.size * (mission.steps + 1)
        self.low, self.high = (np.repeat([each], mission.steps + 1, axis=0) for each in _sides(mission, self.size))
        self.low[0] = self.high[0] = start.ravel()
        for agent in mission.agents:
            if agent.finish is not None and agent.finish.point is not None:
                self.low[-1, 2 * agent.index : 2 * agent.index + 2] = agent.finish.point
                self.high[-1, 2 * agent.index : 2 * agent.index + 2] = agent.finish.point
        speeds = np.repeat([float(agent.dynamics.top_speed) * SQUARE for agent in mission.agents], 2)
        self.most = float(np.min(np.subtract(mission.world.high, mission.world.low))) / 2
        if all(isinstance(agent.dynamics, SingleIntegrator) for agent in mission.agents):
            self.columns, self.fastest = 1 + states, np.zeros(0)
            for step in range(mission.steps):
                for axis in range(self.size):
                    self.within(
                        [(self.place(step + 1, axis), 1.0), (self.place(step, axis), -1.0)], speeds[axis] * mission.step
                    )
        elif all(isinstance(agent.dynamics, DoubleIntegrator) for agent in mission.agents):
            self.columns, self.fastest = 1 + 2 * states, np.tile(speeds, mission.steps + 1)
            self.fastest[: self.size] = 0.0
            most = [float(agent.dynamics.top_acceleration) * SQUARE * mission.step for agent in mission.agents]
            for step in range(mission.steps):
                for axis in range(self.size):
                    here, there = (states + self.place(each, axis) for each in (step, step + 1))
                    self.within([(there, 1.0), (here, -1.0)], most[axis // 2])
                    moved = [(self.place(step + 1, axis), 1.0), (self.place(step, axis), -1.0)]
                    half = mission.step / 2
                    self.within([*moved, (here, -half), (there, -half)], 0.0)
        else:
            raise Unsupported("dynamics without a linear form")
        self.states = self.columns

    def place(self, step: int, axis: int) -> int:
        """Column of a coordinate."""
        return 1 + self.size * step + axis

    def predicate(self, node: Stl, step: int) -> tuple[Terms, float]:
        """Terms of a predicate, minus ρ."""
        weights = node.a.ravel()
        terms = [(self.place(step, int(axis)), float(weights[axis])) for axis in np.flatnonzero(weights)]
        lowest = np.minimum(weights * self.low[step], weights * self.high[step]).sum() - self.most
        return [*terms, (0, -1.0)], float(lowest)

    def solve(self, limit: float) -> tuple[float | None, bool]:
        switches = np.zeros(self.columns - self.states)
        low = np.concatenate([[0.0], self.low.ravel(), -self.fastest, switches])
        high = np.concatenate([[self.most], self.high.ravel(), self.fastest, switches + 1])
        found = milp(
            np.eye(1, self.columns)[0] * -1,
            integrality=(np.arange(self.columns) >= self.states).astype(int),
            bounds=Bounds(low, high),
            constraints=self.constraints(),
            options={"time_limit": limit},
        )
        return (None if found.x is None else float(found.x[0])), found.status in (0, 2)


def _sides(mission: Mission, size: int) -> tuple[Array, Array]:
    """Least and greatest coordinates of the agents' centres, (size,) each, metres."""
    radius = np.repeat([float(agent.radius) for agent in mission.agents], 2)
    low, high = (np.tile(each, size // 2).astype(float) for each in (mission.world.low, mission.world.high))
    return low + radius, high - radius

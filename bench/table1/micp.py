"""MICP: stlpy's formula tree as a mixed-integer program, solved by HiGHS (from scipy).

The first feasible point is the result.

stlpy's own mixed-integer solvers need a licence of Gurobi or Mosek for problems of this size. Here ``formula_rows`` is
the encoding with few binaries. The speed limit is a square within the disc. There is no cost, since it would
only take time. The seed draws the starts; the solver chooses the finishes.

Source:
    [clot] Table I, MICP; V. Kurtz and H. Lin, Mixed-integer programming for STL with fewer binary variables.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import Bounds, milp

from missionc.base.trace import Array, Trace
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from table1.formula_rows import FormulaRows, Terms
from table1.scene import box, speed, stand, trace
from table1.specification import Stl, specification


def plan(mission: Mission, kernel: Kernel, seed: int, limit: float, between: bool = False) -> Trace | str:
    generator = np.random.default_rng(seed)
    start = stand(mission, box(mission.agents[0].start), generator)
    rows = _Rows(mission, start)
    rows.formula(specification(mission, kernel, start, between), 0, None)
    return rows.solve(limit)


class _Rows(FormulaRows):
    """Variables: the positions, step by step, then the binaries."""

    def __init__(self, mission: Mission, start: Array) -> None:
        super().__init__()
        self.mission, self.size = mission, start.size
        count = len(mission.agents)
        self.low = np.tile(mission.world.low, count).astype(float)
        self.high = np.tile(mission.world.high, count).astype(float)
        self.places = self.size * (mission.steps + 1)
        self.columns, self.binaries = self.places, 0
        self.start = start.ravel()
        most = speed(mission) * mission.step / np.sqrt(2) * (1 - 1e-4)
        for column in range(self.size, self.places):
            self.within([(column, 1.0), (column - self.size, -1.0)], most)

    def predicate(self, node: Stl, step: int) -> tuple[Terms, float]:
        weights = node.a.ravel()
        terms = [(self.size * step + axis, float(weights[axis])) for axis in np.flatnonzero(weights)]
        return terms, float(np.minimum(weights * self.low, weights * self.high).sum())

    def solve(self, limit: float) -> Trace | str:
        steps = self.mission.steps + 1
        switches = self.columns - self.places
        low = np.concatenate([np.tile(self.low, steps), np.zeros(switches)])
        high = np.concatenate([np.tile(self.high, steps), np.ones(switches)])
        low[: self.size] = high[: self.size] = self.start
        whole = (np.arange(self.columns) >= self.places).astype(int)
        found = milp(
            np.zeros(self.columns),
            integrality=whole,
            bounds=Bounds(low, high),
            constraints=self.constraints(),
            options={"time_limit": 10 * limit},
        )
        if found.x is None:
            return f"HiGHS: {found.message}"
        position = found.x[: self.places].reshape(steps, -1, 2).swapaxes(0, 1)
        return trace(self.mission, np.ascontiguousarray(position))

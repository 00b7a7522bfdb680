"""MICP: stlpy's formula tree as a mixed-integer program, solved by HiGHS (from scipy).

The first feasible point is the result.

stlpy's own mixed-integer solvers need a licence of Gurobi or Mosek for problems of this size. Here each branch of an
``or`` has a binary variable, an ``and`` passes its own on (the encoding with few binaries), and a predicate is one row
with the smallest sufficient constant. The speed limit is a square within the disc. There is no cost, since it would
only take time. The seed draws the starts; the solver chooses the finishes.

Source:
    [clot] Table I, MICP; V. Kurtz and H. Lin, Mixed-integer programming for STL with fewer binary variables.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import Bounds, LinearConstraint, milp
from scipy.sparse import coo_array

from missionc.base.trace import Array, Trace
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from table1.scene import box, speed, stand, trace
from table1.specification import Stl, specification


def plan(mission: Mission, kernel: Kernel, seed: int, limit: float, between: bool = False) -> Trace | str:
    generator = np.random.default_rng(seed)
    start = stand(mission, box(mission.agents[0].start), generator)
    rows = _Rows(mission, start)
    rows.formula(specification(mission, kernel, start, between), 0, None)
    return rows.solve(limit)


class _Rows:
    """Variables: the positions, step by step, then the binaries."""

    def __init__(self, mission: Mission, start: Array) -> None:
        self.mission, self.size = mission, start.size
        count = len(mission.agents)
        self.low = np.tile(mission.world.low, count).astype(float)
        self.high = np.tile(mission.world.high, count).astype(float)
        self.places = self.size * (mission.steps + 1)
        self.columns, self.binaries = self.places, 0
        self.entries: list[tuple[int, int, float]] = []
        self.least: list[float] = []
        self.start = start.ravel()
        most = speed(mission) * mission.step / np.sqrt(2) * (1 - 1e-4)
        for column in range(self.size, self.places):
            self.row([(column, 1.0), (column - self.size, -1.0)], -most)
            self.row([(column, -1.0), (column - self.size, 1.0)], -most)

    def row(self, terms: list[tuple[int, float]], least: float) -> None:
        self.entries.extend((len(self.least), column, weight) for column, weight in terms)
        self.least.append(least)

    def formula(self, node: Stl, step: int, switch: int | None) -> None:
        """Add rows so that ``node`` holds at ``step`` if the binary ``switch`` is 1, or always without one."""
        if node.is_predicate():
            weights, bound = node.a.ravel(), float(node.b[0])
            terms = [(self.size * step + axis, float(weights[axis])) for axis in np.flatnonzero(weights)]
            if switch is not None:
                slack = bound - float(np.minimum(weights * self.low, weights * self.high).sum())
                terms, bound = [*terms, (switch, -slack)], bound - slack
            self.row(terms, bound)
        elif node.combination_type == "and":
            for part, ahead in zip(node.subformula_list, node.timesteps, strict=True):
                self.formula(part, step + ahead, switch)
        else:
            switches = [self.columns + number for number in range(len(node.subformula_list))]
            self.columns += len(switches)
            # A sum of binaries, at least 1, or at least the enclosing binary.
            above = [] if switch is None else [(switch, -1.0)]
            self.row([(each, 1.0) for each in switches] + above, 1.0 if switch is None else 0.0)
            for part, ahead, each in zip(node.subformula_list, node.timesteps, switches, strict=True):
                self.formula(part, step + ahead, each)

    def solve(self, limit: float) -> Trace | str:
        row, column, weight = (np.array(each) for each in zip(*self.entries, strict=True))
        matrix = coo_array((weight, (row, column)), shape=(len(self.least), self.columns)).tocsr()
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
            constraints=LinearConstraint(matrix, np.array(self.least), np.inf),
            options={"time_limit": 10 * limit},
        )
        if found.x is None:
            return f"HiGHS: {found.message}"
        position = found.x[: self.places].reshape(steps, -1, 2).swapaxes(0, 1)
        return trace(self.mission, np.ascontiguousarray(position))

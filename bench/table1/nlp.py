"""NLP: stlpy's smooth robustness, maximized by SNOPT, from the Drake wheel.

The formula tree is that of MICP. Positions follow from velocities, each in a square within the disc of the speed limit.
k = 2 is stlpy's default, as are its random initial value and its objective, maximum robustness. The seed draws the
starts; the finishes are part of the formula.

Source:
    [clot] Table I, NLP; Y. Gilpin, V. Kurtz and H. Lin, A smooth robustness measure of STL for symbolic control.
"""

from __future__ import annotations

import contextlib
import sys

import numpy as np
import pydrake.solvers

from missionc.base.trace import Trace
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from table1.scene import box, speed, stand, trace
from table1.specification import specification

# stlpy 0.3 imports these by their names in Drake of 2022.
for stale in ("pydrake.solvers.all", "pydrake.solvers.branch_and_bound"):
    sys.modules.setdefault(stale, pydrake.solvers)


def plan(mission: Mission, kernel: Kernel, seed: int, limit: float) -> Trace | str:
    with contextlib.redirect_stdout(None):  # it reports that Gurobi is missing
        from stlpy.solvers.drake.drake_smooth import DrakeSmoothSolver
        from stlpy.systems import LinearSystem

    start = stand(mission, box(mission.agents[0].start), np.random.default_rng(seed))
    size, count = start.size, len(mission.agents)
    one = np.eye(size)
    system = LinearSystem(one, mission.step * one, one, 0 * one)
    solver = DrakeSmoothSolver(
        specification(mission, kernel, start), system, start.ravel(), mission.steps, verbose=False
    )
    fastest = np.full(size, speed(mission) / np.sqrt(2) * (1 - 1e-4))
    solver.AddControlBounds(-fastest, fastest)
    solver.AddStateBounds(np.tile(mission.world.low, count), np.tile(mission.world.high, count))
    states = solver.Solve()[0]
    if states is None:
        return "SNOPT found nothing"
    position = np.asarray(states).T.reshape(mission.steps + 1, count, 2).swapaxes(0, 1)
    return trace(mission, np.ascontiguousarray(position))

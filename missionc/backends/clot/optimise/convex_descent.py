"""Sequential convex programming: from a plan to a shorter or smoother plan, through plans only.

Near a trajectory with all margins satisfied, margins are nearly linear, and the smoothness is quadratic: the best
nearby trajectory solves a convex quadratic program. Margins that the solution violates, because they are curved or were
not included, are linearised there too, and the program is solved again. Levenberg-Marquardt (``levenberg_marquardt``)
finds plans from far away, but is slow along active margins; this method is not.

Source:
    [clot] Problem 1, (2); Duchi, Boyd and Mattingley, "Sequential Convex Programming", 2018.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import piqp
from scipy import sparse

from missionc.backends.clot.cost_weights import longest_step
from missionc.backends.clot.optimise.active_set import Demand
from missionc.backends.clot.optimise.candidate import System
from missionc.backends.clot.optimise.motion_residuals import Costs
from missionc.backends.clot.optimise.residuals import Rows, rows
from missionc.backends.clot.settings import clot_settings
from missionc.base.trace import Array


def descend(
    control: Array,
    costs: Costs,
    demand: Demand,
    steps: int,
    gain: float,
    cuts: int,
    go_on: Callable[[], bool] = lambda: True,
) -> Array:
    """Control points with less length and bend, whose satisfied margins remain satisfied; (agents, points, dim),
    metres.

    Args:
        control: control points of a plan, (agents, points, dim), metres.
        steps: maximum number of steps.
        gain: relative improvement below which a step is the last.
        cuts: number of programs solved for one step, each with the violations of the previous program.
    """
    settings = clot_settings(costs.mission).shortening
    system, here = System(costs, control), Vicinity(control, costs, demand)
    scale = max(1.0, longest_step(costs.mission))
    reach = settings.reach * scale
    for left in reversed(range(steps)):
        if not go_on() or reach < settings.least_reach * scale or not system.count:
            break
        ahead = here.best(system, reach, cuts)
        if ahead is None:
            reach /= 2
            continue
        before, after = system.smoothness(control), system.smoothness(ahead)
        if after >= before:
            break
        control = ahead
        if left == 0 or before - after < gain * before:
            break
        here = Vicinity(control, costs, demand)
        if costs.weights.metres:
            system = System(costs, control)
    return control


def ascend(
    control: Array,
    costs: Costs,
    demand: Demand,
    steps: int,
    accept: Callable[[Array], float | None],
    go_on: Callable[[], bool] = lambda: True,
) -> Array:
    """Control points with the largest least margin of the formulas that a sequence of convex programs reaches.

    Each program moves the control points by at most ``reach`` along each axis, and maximises the ``t`` that every
    linearised margin exceeds. A step without improvement is repeated with half the reach.

    Args:
        control: control points of a plan, (agents, points, dim), metres.
        accept: function from control points to the robustness of their trajectory, metres; None if it is no plan.

    Source:
        [clot] Problem 1, with the robustness as the only objective.
    """
    settings = clot_settings(costs.mission).shortening
    scale = max(1.0, longest_step(costs.mission))
    reach, best = settings.reach * scale, accept(control)
    system = System(costs, control)
    for _ in range(steps):
        if best is None or reach < settings.least_ascent * scale or not system.count or not go_on():
            break
        seen = max(best, 0.0) + 2 * reach  # no wider margin becomes the least one within a step
        active = demand.active(*costs.splines.states(control))
        tasks = [rows(group, control, max(0.0, seen - group.spare)) for group in costs.tasks(control, active)]
        motion = [rows(group, control, 2 * reach) for group in costs.motion(control)]
        ahead = _widest(system, control, tasks, motion, reach)
        gained = None if ahead is None else accept(ahead)
        if ahead is None or gained is None or gained <= best + settings.same * reach:
            reach /= 2
            continue
        control, best = ahead, gained
    return control


def _widest(system: System, control: Array, tasks: list[Rows], motion: list[Rows], reach: float) -> Array | None:
    """Control points near a trajectory with the largest least margin of ``tasks``; None if the program has no
    solution."""
    smooth = 1e-4  # weight of the smoothness, against a metre of margin
    aims, fixed = ([replace(part, weight=1.0) for part in some if part.value.size] for some in (tasks, motion))
    (side, value), (fixed_side, fixed_value) = system.jacobian(aims), system.jacobian(fixed)
    if not len(value):
        return None
    left = np.concatenate([np.full(len(part.value), part.spare) for part in aims]) - value
    allowed = np.maximum(fixed_value, 0.0) - fixed_value
    column = sparse.csc_matrix(np.append(np.ones(len(value)), np.zeros(len(fixed_value)))[:, None])
    sides = sparse.csc_matrix(sparse.hstack([sparse.vstack([side, fixed_side]), column]))
    smoothness = smooth * (system.base + sparse.identity(system.count))
    matrix = sparse.csc_matrix(sparse.block_diag([smoothness, sparse.csc_matrix([[1e-6]])]))
    pull = np.append(smooth * system.pull(control), -1.0)
    most = np.append(np.full(system.count, reach), left.max() + reach)
    answer = _solved(matrix, pull, sides, np.append(left, allowed), most)
    return None if answer is None else control + system.moved(answer[:-1])


class Vicinity:
    """Linearised conditions around a trajectory, and the used fraction of each target margin, by name."""

    def __init__(self, control: Array, costs: Costs, demand: Demand) -> None:
        self.control, self.costs = control, costs
        self.active = demand.active(*costs.splines.states(control))
        self.parts = self.near(control)
        self.used: dict[str, float] = {}
        for part in self.parts:
            self.used[part.name] = max(self.used.get(part.name, 0.0), _used(part))

    def near(self, control: Array) -> list[Rows]:
        """Residual rows of the relevant margins at control points, (agents, points, dim), metres."""
        within = clot_settings(self.costs.mission).shortening.near
        groups = (rows(group, control, within) for group in self.costs.groups(control, self.active))
        return [replace(part, weight=1.0) for part in groups if part.value.size]

    def worse(self, than: Vicinity) -> list[Rows]:
        """Rows whose margin is below a part of its target, and smaller than in the trajectory of ``than``."""
        return _broken(self.parts, than.used)

    def best(self, system: System, reach: float, cuts: int) -> Array | None:
        """Best nearby control points, (agents, points, dim), metres; None if the result violates a margin."""
        shares = (0.5, 0.25)  # of the movement to a solution that still violates something after all cuts
        program = _Program(system, system.pull(self.control), reach)
        moved, parts = np.zeros(system.count), self.parts
        for _ in range(cuts):
            program.add(parts, moved, self.used)
            answer = program.solved()
            if answer is None:
                break
            moved = answer
            parts = _broken(self.near(self.control + system.moved(moved)), self.used)
            if not parts:
                return self.control + system.moved(moved)
        some = (self.control + system.moved(share * moved) for share in shares)
        return next((ahead for ahead in some if not _broken(self.near(ahead), self.used)), None)


def _broken(parts: list[Rows], used: Mapping[str, float]) -> list[Rows]:
    """Rows that use up more than half of their target margin, and more than the fraction ``used`` of their name."""
    most_used = 0.5  # share of its target that a margin may lose in one step
    found = [part.taken(part.value > max(used.get(part.name, 0.0), most_used) * _spare(part)) for part in parts]
    return [part for part in found if part.value.size]


def _used(part: Rows) -> float:
    """Used fraction of the target margin in the worst of some rows."""
    return float(part.value.max()) / _spare(part)


def _spare(part: Rows) -> float:
    least_spare = 1e-6  # metres
    return max(part.spare, least_spare)


class _Program:
    """Quadratic program: least smoothness cost over displacements of at most ``reach`` metres per axis, under linear
    constraints."""

    def __init__(self, system: System, pull: Array, reach: float) -> None:
        convex = 1e-6  # added to the diagonal, so that a program has a unique solution
        self.system, self.pull = system, pull
        self.matrix = (system.base + convex * sparse.identity(system.count)).tocsc()
        self.box = np.full(system.count, reach)
        self.sides: list[sparse.csr_matrix] = []
        self.bounds: list[Array] = []

    def add(self, parts: list[Rows], moved: Array, used: Mapping[str, float]) -> None:
        """Add constraints, linearised at a displacement (unknowns,), metres, that preserve the used fraction of each
        target margin."""
        side, value = self.system.jacobian(parts)
        allowed = np.concatenate(
            [np.zeros(0), *(np.full(len(part.value), used.get(part.name, 0.0) * part.spare) for part in parts)]
        )
        self.sides.append(side)
        self.bounds.append(allowed - value + side @ moved)

    def solved(self) -> Array | None:
        """Optimal displacement of the unknowns, (unknowns,), metres; None without a solution."""
        return _solved(
            self.matrix, self.pull, sparse.vstack(self.sides, format="csc"), np.concatenate(self.bounds), self.box
        )


def _solved(matrix: sparse.csc_matrix, pull: Array, side: sparse.csc_matrix, bound: Array, most: Array) -> Array | None:
    """Minimiser ``x`` of ``x' matrix x / 2 + pull x`` with ``side x <= bound`` and ``|x| <= most``; None without a
    minimiser."""
    precision, gap, patience = 1e-4, 1e-3, 20  # programs with an answer take about 15 iterations
    solver = piqp.SparseSolver()
    settings = solver.settings
    settings.kkt_solver = piqp.KKTSolver.sparse_ldlt_ineq_cond
    settings.eps_abs = settings.eps_rel = precision
    settings.eps_duality_gap_abs = settings.eps_duality_gap_rel = gap
    settings.max_iter = patience
    solver.setup(matrix, pull, None, None, side, None, bound, -most, most)
    if solver.solve() != piqp.PIQP_SOLVED:
        return None
    answer: Array = np.array(solver.result.x)
    return answer

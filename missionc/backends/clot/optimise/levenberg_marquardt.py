"""Levenberg-Marquardt over all agents and steps at once: from a nearly feasible candidate to a feasible one.

Every shortfall is a row of a sparse least-squares problem, which every iteration solves exactly. Each iteration selects
the active conditions by the current trajectory, unless a witness fixes them.

Source:
    [clot] Problem 1, (4); Nocedal and Wright, "Numerical Optimization", 10.3.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from missionc.backends.clot.cost_weights import longest_step
from missionc.backends.clot.optimise.active_set import Demand
from missionc.backends.clot.optimise.candidate import Look, System
from missionc.backends.clot.optimise.motion_residuals import Costs
from missionc.backends.clot.settings import clot_settings
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array


class Polished(Record, eq=False):
    """Result of a local optimisation (polish).

    Args:
        control: control points, (agents, points, dim), metres.
        shortfall: shortfall of the worst margin from its target, metres; at most 0 if all targets are reached.
        worst: name of the residual group of the worst margin.
        cost: sum of all costs.
    """

    control: Array
    shortfall: float
    worst: str
    cost: float
    iterations: int


def polish(
    control: Array,
    costs: Costs,
    demand: Demand,
    iterations: int,
    go_on: Callable[[], bool] = lambda: True,
    tell: Callable[[int, float], None] = lambda iteration, margin: None,
) -> Polished:
    """Local optimisation of a trajectory in at most ``iterations`` steps; it ends early when all margins nearly reach
    their targets.

    Args:
        control: initial control points, (agents, points, dim), metres.
        tell: receives at each step its number and the worst margin of the best trajectory so far, metres.
    """
    settings = clot_settings(costs.mission).polish
    wide = costs.spare.scaled > 0
    enough = settings.wide_enough if wide else settings.enough
    least_damping, most_damping = 1e-6, 1e4
    eager, patient = 8, 4  # the active set is chosen at each of the first iterations, then at every few
    system = System(costs, control)
    damping, penalty = settings.damping, 1.0
    most = max(settings.longest, longest_step(costs.mission))

    def decided(control: Array) -> Look:
        """Evaluation of control points, (agents, points, dim), metres, with conditions that their own values select."""
        return Look(control, costs, demand.active(*costs.splines.states(control)), system)

    now = best = decided(control)
    done = 0
    while done < iterations and now.total(penalty) > 0 and go_on():
        done += 1
        tell(done, -best.shortfall)
        step = system.step(now.control, now.rows, damping, penalty)
        longest = float(np.linalg.norm(step, axis=-1).max(initial=0.0))
        if longest > most:
            step *= most / longest
        ahead = Look(now.control + step, costs, now.active, system)
        gain = now.total(penalty) - ahead.total(penalty)
        settled = gain <= settings.settled * now.total(penalty)
        if gain > 0:
            damping = max(damping / 4, least_damping)
            now = ahead
            if done < eager or done % patient == 0 or settled:
                now = decided(now.control)
                if now.rank(enough if wide else np.inf) < best.rank(enough if wide else np.inf):
                    best = now
        else:
            damping = min(damping * 6, most_damping)
            settled = damping == most_damping
        if settled and now.shortfall > 0:
            untangled = demand.untangled(*costs.splines.states(now.control))
            if untangled is not None:
                demand = untangled
                now = decided(now.control)
                continue
        if settled and now.filled < enough:
            break
        if settled:
            if penalty >= settings.hardest:
                break
            penalty, damping = penalty * settings.harder, settings.damping
    return Polished(best.control, best.shortfall, best.worst, best.total(1.0), done)

"""``minimize duration``: plans of fewer and fewer steps after which every agent stays where it is.

Everybody is put to rest after some step, and the motion is polished until it is a plan again.
What lies between the shortest plan found and the longest time at which none was found is halved.
That none was found proves nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from missionc.backends.clot.optimise.goal_terms import Demand
from missionc.backends.clot.optimise.levenberg_marquardt import polish
from missionc.backends.clot.optimise.motion_residuals import Costs
from missionc.backends.clot.optimise.own_state_stays import with_stays
from missionc.backends.clot.settings import clot_settings
from missionc.base.trace import Array, Trace


@dataclass(frozen=True, slots=True, eq=False)
class Shortened:
    """A plan's control points, its motion, what it costs to change it so that it lasts no longer, and what to tell."""

    control: Array
    trace: Trace
    costs: Costs
    note: str


def shorten(
    control: Array,
    made: Trace,
    demand: Demand,
    costs: Costs,
    accept: Callable[[Array], Trace | None],
    go_on: Callable[[], bool],
    least: int = 0,
) -> Shortened:
    """The same plan, or one that is over sooner.

    Args:
        control: the plan's control points, (agents, points, dim), metres; ``made`` its motion.
        demand: what is asked of it, without saying when, for that has to change.
        accept: the motion of control points, if it is as good a plan.
        least: steps that every plan takes.
    """
    before = best = duration(made)
    too_short = least - 1
    best_costs = costs
    while best - too_short > 1 and go_on():
        target = (best + too_short) // 2
        resting = replace(costs, splines=replace(costs.splines, rest=target))
        for start in _starts(made.position, best, target):
            first = np.where(costs.splines.fixed[..., None], control, costs.splines.through(start))
            stays = with_stays(demand, *costs.splines.states(first))
            iterations = clot_settings(costs.mission).shortening.duration_iterations
            tried = polish(resting.splines.at_rest(first), resting, stays, iterations, go_on).control
            motion = accept(tried)
            if motion is not None and duration(motion) <= target:
                control, made, best_costs, best = tried, motion, resting, duration(motion)
                break
        else:
            too_short = target
    if best <= least:
        end = "no plan takes less"
    else:
        end = f"no plan of {best - 1} was found" if best - too_short <= 1 else "the search ended first"
    return Shortened(control, made, best_costs, f"lasts {best} steps, {before} before it was made less; {end}")


def duration(made: Trace) -> int:
    """After how many steps nobody moves any more."""
    return made.lasts


def _starts(position: Array, lasts: int, target: int) -> Iterator[Array]:
    """A motion that ``lasts`` so many steps in fewer, (agents, steps + 1, dim): all of it sooner; or cut short."""
    step = np.arange(position.shape[1])
    time = np.minimum(step * (lasts / max(target, 1)), lasts)
    here = np.minimum(time.astype(np.int64), lasts - 1)
    share = (time - here)[:, None]
    yield position[:, here] * (1 - share) + position[:, here + 1] * share
    yield position[:, np.minimum(step, target)]

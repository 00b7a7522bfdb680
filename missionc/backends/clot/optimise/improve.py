"""Anytime improvement of a plan: preferences by weight, then the objective; without an objective, fewer detours.

A preference is added as a goal of a local optimisation from the plan; the objective is improved by a descent from the
plan. A result is accepted only if it is a better plan.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from missionc.backends.api import no_bound
from missionc.backends.clot.cost_weights import AIMS, TIDY, with_room
from missionc.backends.clot.optimise.active_set import Demand
from missionc.backends.clot.optimise.convex_descent import ascend, descend
from missionc.backends.clot.optimise.levenberg_marquardt import polish
from missionc.backends.clot.optimise.motion_residuals import Costs
from missionc.backends.clot.optimise.own_state_stays import with_stays
from missionc.backends.clot.optimise.retiming import retime
from missionc.backends.clot.settings import clot_settings
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Trace
from missionc.ir import Mission, Objective
from missionc.ir.kernel.nodes import Kernel
from missionc.verification.monitoring.monitor import least_robustness, monitor
from missionc.verification.monitoring.normalised_margins import Margins


class Shortened(Record, eq=False):
    """Plan after shortening, with at most the original duration: control points, trace, costs that preserve the
    duration, and a note."""

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
    """Plan of the shortest duration found; the given plan if none is shorter.

    Args:
        control: control points of the plan, (agents, points, dim), metres; ``made``: its trace.
        demand: goals of the plan without fixed times, which have to change.
        accept: function from control points to their trace if it is an equally good plan, otherwise None.
        least: lower bound of the steps of every plan.
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
        end = "optimal"
    else:
        end = f"no plan of {best - 1} steps found" if best - too_short <= 1 else "the search ended early"
    return Shortened(control, made, best_costs, f"duration {best} steps (first plan: {before}); {end}")


def duration(made: Trace) -> int:
    """Number of steps after which no agent moves."""
    return made.lasts


def _starts(position: Array, lasts: int, target: int) -> Iterator[Array]:
    """Yield faster versions of a trajectory of ``lasts`` steps, (agents, steps + 1, dim), metres: time-scaled, then
    truncated."""
    step = np.arange(position.shape[1])
    time = np.minimum(step * (lasts / max(target, 1)), lasts)
    here = np.minimum(time.astype(np.int64), lasts - 1)
    share = (time - here)[:, None]
    yield position[:, here] * (1 - share) + position[:, here + 1] * share
    yield position[:, np.minimum(step, target)]


class Improved(Record, eq=False):
    """Improved plan: control points, trace, and notes on how it was found."""

    control: Array
    trace: Trace
    notes: tuple[str, ...]


def improve(
    control: Array,
    made: Trace,
    mission: Mission,
    kernel: Kernel,
    graph: Kernel,
    demand: Demand,
    costs: Costs,
    accept: Callable[[Array], Trace | None],
    go_on: Callable[[], bool],
    enough: Callable[[float], float] = no_bound,
) -> Improved:
    """Plan that satisfies more preferences or improves the objective; the given plan if none is found.

    Args:
        control: control points of the plan, (agents, points, dim), metres; ``made``: its trace.
        accept: function from control points to their trace if it is a plan, otherwise None.
        enough: lower bound function, as ``Budget.lower_bound``.
    """
    settings = clot_settings(mission).shortening
    roots = demand.roots
    notes: list[str] = []
    for wish in sorted(graph.preferences, key=lambda each: -(each.weight or 0.0)):
        if not go_on():
            notes.append(f"preference `{wish.name}` not satisfied: the search ended early")
            continue
        if not _kept(wish.name, mission, kernel, made):
            for choices in (demand.choices, {}):  # the schedule's choices, or those nearest to holding
                wider = Demand.of(mission, (*roots, wish.formula), choices, mission.steps)
                candidate = polish(control, costs, wider, settings.iterations, go_on).control
                motion = accept(candidate)
                if motion is not None and _kept(wish.name, mission, kernel, motion):
                    break
            else:
                notes.append(f"preference `{wish.name}` not satisfied: no plan that satisfies it was found")
                continue
            control, made = candidate, motion
        roots = (*roots, wish.formula)
        notes.append(f"preference `{wish.name}` satisfied")
    shortened = mission.objective is Objective.DURATION
    full_demand = Demand.of(mission, roots, {} if shortened else demand.choices, mission.steps)
    if shortened:

        def as_satisfying(tried: Array) -> Trace | None:
            motion = accept(tried)
            return motion if motion is not None and as_many(mission, kernel, made, motion) else None

        anew = tuple(goal.formula for goal in graph.requirements) + roots[len(demand.roots) :]
        full_demand = Demand.of(mission, anew, {}, mission.steps)  # the time of refilling is free too
        shorter = shorten(control, made, full_demand, costs, as_satisfying, go_on, int(enough(made.lasts)))
        control, made, costs = shorter.control, shorter.trace, shorter.costs
        full_demand = with_stays(full_demand, *costs.splines.states(control))
        notes.append(shorter.note)
    measure, before = _measure(mission, kernel), made
    if mission.objective is Objective.ROBUSTNESS:
        aimed = replace(costs, spare=with_room(mission))

        def robustness(tried: Array) -> float | None:
            motion = accept(tried)
            kept = motion is not None and as_many(mission, kernel, before, motion)
            return least_robustness(mission, kernel, motion) if kept and motion is not None else None

        for choices in (demand.choices, {}):  # what was scheduled, then what is nearest
            full_demand = Demand.of(mission, roots, choices, mission.steps)
            control = ascend(control, aimed, full_demand, settings.ascent, robustness, go_on)
        chosen = full_demand.witness(*costs.splines.states(control))
        made, full_demand = accept(control) or made, Demand.of(mission, roots, chosen, mission.steps)
    for aim in AIMS.get(mission.objective, (TIDY,)):
        if measure is travelled and travelled(made) - enough(travelled(made)) <= settings.same:
            notes.append("the distance is optimal")
            break
        steps = min(aim.steps, settings.tidy // max(1, control.size)) if aim is TIDY else aim.steps
        aimed = replace(costs, weights=aim.weights(costs.weights))
        tried = descend(control, aimed, full_demand, steps, aim.gain, aim.cuts, go_on)
        motion = made if tried is control else accept(tried)
        better = motion is not None and as_many(mission, kernel, made, motion)
        if motion is not None and better and (measure is None or measure(motion) < measure(made)):
            control, made = tried, motion
    best = made

    def as_good(tried: Array) -> Trace | None:
        motion = accept(tried)
        if motion is None or (measure is not None and measure(motion) > measure(best)):
            return None
        return motion if as_many(mission, kernel, best, motion) else None

    control, made = rested(control, made, kernel, costs, full_demand, as_good, go_on)
    if measure is not None and made is not before:
        name, unit = mission.objective.value, "m^2/s^3" if mission.objective is Objective.ENERGY else "m"
        notes.append(f"{name} {abs(measure(made)):.6g} {unit} (first plan: {abs(measure(before)):.6g} {unit})")
    return Improved(control, made, tuple(notes))


def _measure(mission: Mission, kernel: Kernel) -> Callable[[Trace], float] | None:
    """Function from a trace to the quantity that the objective minimises; None without an objective."""
    if mission.objective is Objective.ROBUSTNESS:
        return lambda made: -least_robustness(mission, kernel, made)
    return MEASURES.get(mission.objective)


def rested(
    control: Array,
    made: Trace,
    kernel: Kernel,
    costs: Costs,
    demand: Demand,
    accept: Callable[[Array], Trace | None],
    go_on: Callable[[], bool],
) -> tuple[Array, Trace]:
    """Control points of a plan, (agents, points, dim), metres, and its motion, with more rest and no narrower margins.

    Args:
        accept: the motion of control points, if it is an equally good plan.
    """
    margins, least = margins_of(kernel, costs, control, made), -clot_settings(costs.mission).shortening.wider

    def as_calm(tried: Array) -> Trace | None:
        motion = accept(tried)
        return motion if motion and margins_of(kernel, costs, tried, motion).wider(margins, least) else None

    return retime(control, made, demand, costs, as_calm, go_on)


def margins_of(kernel: Kernel, costs: Costs, control: Array, plan: Trace) -> Margins:
    """Normalised margins of a plan with these control points, (agents, points, dim), metres."""
    most = clot_settings(costs.mission).shortening.margin
    return Margins.of(costs.mission, kernel, plan, costs.body_margin(control), most)


def travelled(made: Trace) -> float:
    """Total length of all agents' paths, metres."""
    return made.metres


def effort(made: Trace) -> float:
    """Integral over time of all agents' squared accelerations, m²/s³. [clot] (2)."""
    return made.effort


MEASURES = {Objective.DISTANCE: travelled, Objective.ENERGY: effort}


def _kept(name: str, mission: Mission, kernel: Kernel, made: Trace) -> bool:
    return any(each.name == name and each.satisfied for each in monitor(mission, kernel, made).preferences)


def as_many(mission: Mission, kernel: Kernel, before: Trace, after: Trace) -> bool:
    """Return true if every preference that ``before`` satisfies is satisfied by ``after``."""
    return all(
        _kept(goal.name, mission, kernel, after) or not _kept(goal.name, mission, kernel, before)
        for goal in kernel.preferences
    )

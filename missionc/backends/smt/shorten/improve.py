"""Anytime improvement of a plan: preferences by weight, then the objective, then paths without detours."""

from __future__ import annotations

from collections.abc import Callable

from missionc.backends.api import Progress, no_bound
from missionc.backends.smt.encode.lower import deep
from missionc.backends.smt.refine.conflict_limit import effort
from missionc.backends.smt.refine.lazy_constraints import JointMotion, LazyConstraints
from missionc.backends.smt.roadmap.labels import Labels
from missionc.backends.smt.sat.solve import Stopped, Unsatisfiable
from missionc.backends.smt.shorten.held_goals import Goals
from missionc.backends.smt.shorten.minimize_distance import shorten_distance
from missionc.backends.smt.shorten.minimize_duration import duration, shorten_duration
from missionc.backends.smt.shorten.shorten_paths import shorten_paths
from missionc.ir import Objective
from missionc.ir.kernel.nodes import Kernel


def improve(
    plan: JointMotion,
    kernel: Kernel,
    literals: tuple[int, ...],
    search: LazyConstraints,
    enough: Callable[[float], float] = no_bound,
) -> JointMotion:
    """The same plan or one that is better; what was and was not reached is noted.

    Args:
        literals: what asks for each requirement, then for each preference.
        enough: as of a ``Budget``.
    """
    required = literals[: len(kernel.requirements)]
    formulas = [goal.formula for goal in kernel.requirements]
    wishes = zip(kernel.preferences, literals[len(required) :], strict=True)
    for goal, literal in sorted(wishes, key=lambda wish: -(wish[0].weight or 0.0)):
        search.listen(Progress("prefer", search.rounds, f"`{goal.name}`"))
        result = search.find((*required, literal), effort=effort(search.mission, search.clauses))
        match result:
            case JointMotion():
                plan, required = result, (*required, literal)
                formulas.append(goal.formula)
                search.account.notes.append(f"`{goal.name}` is kept")
            case Unsatisfiable():
                why = "no plan on this roadmap keeps it too" if search.proves else "no plan was found that keeps it too"
                search.account.notes.append(f"`{goal.name}` is not kept: {why}")
            case Stopped():
                search.account.notes.append(f"`{goal.name}` is not kept: the search ended first")

    def with_shorter_paths(plan: JointMotion, still_from: int | None = None) -> JointMotion:
        with search.account.stage("calm"):
            agents = range(search.motion.agents)
            return JointMotion(shorten_paths(plan.states, agents, formulas, search.motion, search.mission, still_from))

    match search.mission.objective:
        case Objective.DISTANCE:
            labels = Labels(search.mission, search.motion.roadmaps)
            goals = Goals(tuple(formulas), search.mission, search.motion, labels)
            with deep():
                return shorten_distance(with_shorter_paths(plan), goals, required, search, with_shorter_paths, enough)
        case Objective.DURATION:
            plan = shorten_duration(plan, required, search, enough)
            return with_shorter_paths(plan, duration(plan.states))
        case _:
            return with_shorter_paths(plan)

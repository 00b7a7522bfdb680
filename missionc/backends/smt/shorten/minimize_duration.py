"""``minimize duration``: the fewest steps after which every agent stays where it is."""

from __future__ import annotations

import numpy as np

from missionc.backends.api import Progress
from missionc.backends.smt.encode.clauses import FALSE, Clauses, Literals, TooLarge
from missionc.backends.smt.encode.lower_motion import Motion
from missionc.backends.smt.refine.conflict_limit import effort
from missionc.backends.smt.refine.lazy_constraints import JointMotion, LazyConstraints
from missionc.backends.smt.roadmap.roadmap import Indices
from missionc.backends.smt.sat.solve import Stopped, Unsatisfiable


def shorten_duration(plan: JointMotion, required: tuple[int, ...], search: LazyConstraints) -> JointMotion:
    """Halves what lies between the shortest plan found and what is known to be too short."""
    impossible, best = -1, duration(plan.states)
    try:
        still = add_stillness(search.clauses, search.motion)
    except TooLarge:
        search.account.notes.append(f"lasts {best} steps; too many clauses to look for fewer")
        return plan
    while best - impossible > 1:
        target = (best + impossible) // 2
        search.listen(Progress("improve", search.rounds, f"{best} steps; are {target} enough?"))
        result = search.find((*required, *still[target:].tolist()), effort=effort(search.clauses))
        match result:
            case JointMotion(states):
                plan, best = result, duration(states)
            case Unsatisfiable():
                impossible = target
            case Stopped():
                search.account.notes.append(
                    f"lasts {best} steps; whether {impossible + 1} are enough was not decided in time"
                )
                return plan
    search.account.notes.append(f"lasts {best} steps, the fewest on this roadmap")
    return plan


def duration(states: Indices) -> int:
    """After how many steps nobody changes its state, (agents, steps + 1), any more."""
    changes = np.flatnonzero((states[:, 1:] != states[:, :-1]).any(axis=0))
    return int(changes[-1]) + 1 if changes.size else 0


def add_stillness(clauses: Clauses, motion: Motion) -> Literals:
    """For each step, (steps,), a literal that implies that nobody changes its state from it to the next."""
    still = clauses.fresh(motion.steps)
    for states in motion.states:
        step, state = np.nonzero(states[:-1] != FALSE)
        clauses.add(-still[step], -states[step, state], states[step + 1, state])
    return still

"""``minimize duration``: the fewest steps after which every agent stays where it is."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from missionc.backends.api import Progress
from missionc.backends.smt.encode.clauses import FALSE, Clauses, Literals, TooLarge
from missionc.backends.smt.encode.lower_motion import Motion
from missionc.backends.smt.refine.conflict_limit import effort
from missionc.backends.smt.refine.lazy_constraints import JointMotion, LazyConstraints
from missionc.backends.smt.roadmap.roadmap import Indices
from missionc.backends.smt.sat.solve import Stopped, Unsatisfiable
from missionc.backends.smt.settings import smt_settings


def shorten_duration(
    plan: JointMotion, required: tuple[int, ...], search: LazyConstraints, enough: Callable[[float], float]
) -> JointMotion:
    """Halves what lies between the shortest plan found and what is known, or was asked in vain, to be too short.

    Args:
        enough: as of a ``Budget``.
    """
    best, stops = duration(plan.states), 0
    impossible = vain = int(enough(best)) - 1
    try:
        still = add_stillness(search.clauses, search.motion)
    except TooLarge:
        search.account.notes.append(f"lasts {best} steps; too many clauses to look for fewer")
        return plan
    while best - vain > 1 and stops < smt_settings(search.mission).shortening.undecided:
        target = (best + vain) // 2
        search.listen(Progress("improve", search.rounds, f"{best} steps; are {target} enough?"))
        result = search.find((*required, *still[target:].tolist()), effort=effort(search.mission, search.clauses))
        match result:
            case JointMotion(states):
                plan, best = result, duration(states)
            case Unsatisfiable():
                impossible = vain = target
            case Stopped():
                vain, stops = target, stops + 1
    if not search.proves:
        known = ", the fewest that were found on this roadmap"
    elif best - impossible <= 1:
        known = ", the fewest on this roadmap"
    else:
        known = f"; no plan on this roadmap takes less than {impossible + 1}" if impossible >= 0 else ""
        known += f"; whether {vain} are enough was not decided in time"
    search.account.notes.append(f"lasts {best} steps{known}")
    return plan


def duration(states: Indices) -> int:
    """After how many steps nobody changes its state, (agents, steps + 1), any more."""
    return int(rests_from(states).max(initial=0))


def rests_from(states: Indices) -> Indices:
    """After how many steps each agent changes its state, (agents, steps + 1), no more: (agents,)."""
    changes = states[:, 1:] != states[:, :-1]
    last = changes.shape[1] - np.argmax(changes[:, ::-1], axis=1)
    return np.where(changes.any(axis=1), last, 0)


def add_stillness(clauses: Clauses, motion: Motion) -> Literals:
    """For each step, (steps,), a literal that implies that nobody changes its state from it to the next."""
    still = clauses.fresh(motion.steps)
    for states in motion.states:
        step, state = np.nonzero(states[:-1] != FALSE)
        clauses.add(-still[step], -states[step, state], states[step + 1, state])
    return still

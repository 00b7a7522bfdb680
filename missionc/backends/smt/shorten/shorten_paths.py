"""Local search that replaces one agent's path at a time by a shorter one and keeps every goal.

A model of the clauses has no reason to be tidy: who has nothing to do does
anything. What the goals rest on is kept (``slack``); within it, and clear of
all others, an agent takes the shortest way (``time_expanded_path``).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable

from missionc.backends.smt.encode.lower import deep
from missionc.backends.smt.encode.lower_motion import Motion
from missionc.backends.smt.roadmap.labels import Labels
from missionc.backends.smt.roadmap.roadmap import Indices
from missionc.backends.smt.settings import smt_settings
from missionc.backends.smt.shorten.held_goals import Goals
from missionc.backends.smt.shorten.slack import EvaluatedMotion, slack
from missionc.backends.smt.shorten.time_expanded_path import JointPaths
from missionc.ir import Mission
from missionc.ir.kernel.analysis import remembering
from missionc.ir.kernel.nodes import Node


def shorten_paths(
    states: Indices,
    agents: Iterable[int],
    formulas: Iterable[Node],
    motion: Motion,
    mission: Mission,
    still_from: int | None = None,
) -> Indices:
    """The same joint motion, (agents, steps + 1), or one in which some of these agents go a shorter way.

    Which formulas hold of the one hold of the other, and it has no collisions if the one has none.
    Agents of whom something is asked that reads the past keep their way: each step of it bears on what comes later.
    Nobody is asked again before somebody else goes another way.

    Args:
        still_from: from this step on whoever is given another way stays where it is.
    """
    settings = smt_settings(mission).shortening
    gain = 1e-6  # a way that costs less by no more than this, in metres, is not taken.
    formulas = tuple(formulas)
    everyone = sorted(set(agents) - remembering(formulas))
    if motion.steps == 0 or not everyone:
        return states
    goals = Goals(formulas, mission, motion, Labels(mission, motion.roadmaps))
    evaluated = EvaluatedMotion.of(goals, states)
    if not evaluated.good:
        return states
    paths = JointPaths(states, motion, mission)
    still_from = motion.steps if still_from is None else still_from
    waiting = deque(everyone)
    left = settings.rounds * len(waiting)
    while waiting and left and goals.work < settings.work:
        left -= 1
        agent = waiting.popleft()
        before = paths.states[agent].copy()
        with deep():
            room = slack(goals, agent, evaluated)
        way = paths.shorter_path(agent, room, still_from, gain)
        if way is None:
            continue
        paths.take(agent, way)
        after = EvaluatedMotion.of(goals, paths.states)
        if not after.good:
            paths.take(agent, before)
            continue
        evaluated = after
        waiting.extend(other for other in everyone if other != agent and other not in waiting)
    return paths.states

"""A backend that reads goals and obstacles: each agent drives along one axis, then along the other, and waits there."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from missionc.extension import (
    BackendExtension,
    Budget,
    Feature,
    Kernel,
    Mission,
    NotFound,
    Options,
    Outcome,
    Planned,
    Reason,
    Report,
    Trace,
    nodes,
    of_states,
    signed_distance,
    verify,
)


class Elbow(BackendExtension):
    name = "elbow"
    features = frozenset({Feature.EXTENSION_PREDICATE, Feature.EXTENSION_RULES})

    def plan(self, mission: Mission, kernel: Kernel, options: Options, budget: Budget) -> Outcome:
        paths = []
        for agent in mission.agents:
            goals = [each for goal in kernel.requirements for each in _goals(goal.formula, agent.index)]
            clear = [path for path in _paths(mission, agent, goals) if _is_clear(mission, agent, path)]
            if not clear:
                return NotFound(Reason.SOLVER, f"`elbow` has no path for `{agent.name}`", Report())
            paths.append(clear[0])
        position = np.array(paths)
        velocity = np.diff(position, axis=1, append=position[:, -1:]) / mission.step
        velocity[:, -1] = velocity[:, -2]
        trace = Trace(mission.step, position, velocity, np.zeros(position.shape[:2]))
        if not verify(mission, kernel, trace).passed:
            return NotFound(Reason.SOLVER, "the paths of `elbow` do not satisfy all requirements", Report())
        return Planned(trace, Report(sizes=(("paths", len(paths)),)))


def _goals(node: nodes.Node, agent: int) -> Iterator[Any]:
    """The predicates that an agent has to satisfy at some time; verification sees to all else."""
    match node:
        case nodes.All(parts=parts):
            for part in parts:
                yield from _goals(part, agent)
        case nodes.At(body=body, agent=asked) if asked == agent:
            yield from _goals(body, agent)
        case nodes.Eventually(body=nodes.Atom(predicate=predicate)):
            yield predicate


def _paths(mission: Mission, agent: Any, goals: list[Any]) -> Iterator[np.ndarray]:
    """Paths to places that satisfy all goals, (steps + 1, 2) in metres, the nearest places first."""
    axes = [np.arange(low, high, 0.25) for low, high in zip(mission.world.low, mission.world.high, strict=True)]
    places = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
    for predicate in goals:
        places = places[of_states(predicate, mission, agent.index, places, np.zeros_like(places)) > 0.01]
    reach = agent.dynamics.top_speed * mission.step
    if agent.start.point is None:
        return
    start = np.array(agent.start.point)
    for place in sorted(places, key=lambda place: float(np.abs(place - start).sum())):
        for first in (0, 1):
            corner = np.where(np.arange(2) == first, place, start)
            legs = [(start, corner), (corner, place)]
            counts = [int(np.ceil(np.abs(b - a).sum() / reach)) for a, b in legs]
            moves = [
                a + (b - a) * np.arange(1, n + 1)[:, None] / n for (a, b), n in zip(legs, counts, strict=True) if n
            ]
            path = np.concatenate([start[None], *moves])
            if len(path) <= mission.steps + 1:
                yield np.concatenate([path, np.repeat(path[-1:], mission.steps + 1 - len(path), axis=0)])


def _is_clear(mission: Mission, agent: Any, path: np.ndarray) -> bool:
    """True if the body of an agent stays off all obstacles along a path."""
    share = np.linspace(0, 1, 20)[:, None, None]
    places = path[:-1] * (1 - share) + path[1:] * share
    needed = agent.radius + mission.clearance
    return all((signed_distance(np, each.shape, places) > needed + 0.1).all() for each in mission.obstacles)


BACKEND = Elbow()

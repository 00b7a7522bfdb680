"""A first joint motion through the key frames: teams go together, round what stands in their way."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from missionc.backends.clot.cost_graph import Margin
from missionc.backends.clot.frames import Frame
from missionc.backends.clot.guide import Guide, along
from missionc.backends.clot.schedule import Schedule
from missionc.ir import Connected, InFormation, Mission
from missionc.plan import Array


def sketch(
    mission: Mission,
    schedule: Schedule,
    found: Sequence[Frame],
    guide: Guide,
    generator: np.random.Generator,
    detour: float,
) -> Array:
    """Positions at the steps, (agents, steps + 1, dim), metres.

    Args:
        detour: how likely a team goes another way than the shortest.
    """
    position = np.zeros((len(mission.agents), mission.steps + 1, mission.dimension))
    position[:, 0] = found[0].position
    for earlier, later in pairwise(found):
        span = later.step - earlier.step
        share = np.arange(1, span + 1) / span
        for team in _teams(mission, schedule, earlier.step, later.step):
            position[team, earlier.step + 1 : later.step + 1] = _together(
                mission, team, earlier.position[team], later.position[team], share, guide, generator.random() < detour
            )
    return position


def _together(
    mission: Mission, team: list[int], start: Array, end: Array, share: Array, guide: Guide, other_way: bool
) -> Array:
    """A team's middle goes round the obstacles, everybody keeps the place beside it: (agents, steps, dim)."""
    middle, goal = start.mean(axis=0), end.mean(axis=0)
    radius = max(mission.agents[agent].radius for agent in team) + mission.clearance
    extent = max(float(np.linalg.norm(each - each.mean(axis=0), axis=1).max()) for each in (start, end))
    way = guide.way(middle, goal, radius + 0.1 + extent, radius)
    if way is not None and other_way:
        second = guide.way(middle, goal, radius + 0.1 + extent / 2, radius, along(way, np.linspace(0.1, 0.9, 60)))
        way = way if second is None else second
    if way is None:
        way = np.stack([middle, goal])
    centre = along(way, share)
    around = (start - middle)[:, None] * (1 - share)[None, :, None] + (end - goal)[:, None] * share[None, :, None]
    moved: Array = centre[None] + around
    return moved


def _teams(mission: Mission, schedule: Schedule, begin: int, end: int) -> list[list[int]]:
    """The agents that a formation or a connected graph ties together between two steps."""
    pairs: list[tuple[int, int]] = []
    for hold in schedule.holds:
        term = hold.term
        if not (isinstance(term, Margin) and term.holds and hold.low < end and hold.high > begin):
            continue
        match term.predicate:
            case InFormation(formation):
                pairs.extend((edge.first, edge.second) for edge in formation.edges)
            case Connected(_, agents):
                pairs.extend((agents[0], other) for other in agents[1:])
            case _:
                pass
    count = len(mission.agents)
    first, second = (np.array(column, dtype=np.int64) for column in (zip(*pairs, strict=True) if pairs else ((), ())))
    tied = coo_matrix((np.ones(len(first)), (first, second)), shape=(count, count))
    number, label = connected_components(tied, directed=False)
    return [np.flatnonzero(label == team).tolist() for team in range(number)]

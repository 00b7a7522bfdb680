"""Cover of a mission: cells that contain all positions, and possible moves between them, for each kind of agent.

    in   Mission, its relaxed kernel
    out  Cover

Its states and moves have the form of roadmaps, so that the same lowering applies. A roadmap contains some trajectories;
a cover contains all trajectories, and more.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from missionc.backends.cover.bodies import SLACK, standing_room
from missionc.backends.cover.cells import Border, Cells, borders_asked, borders_of_obstacles, cells_of, with_points
from missionc.backends.cover.may_moves import furthest, may_move, nearest
from missionc.backends.smt.roadmap.roadmap import Roadmap
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags, Indices
from missionc.geometry.distance_ranges import signed_distance_range
from missionc.ir import Agent, InitialSet, Mission
from missionc.ir.kernel.nodes import Kernel

TOUCH = 1e-5
"""Distance, metres, by which a start or finish may miss its region or point."""


class Cover(Record, eq=False):
    """Over-approximation of all trajectories of a mission: a roadmap for each kind of agent whose states are cells.

    Args:
        cells: cells that the states of each roadmap represent.
        strides: for each roadmap, numbers of steps and the pairs of cells reachable in them, (cells, cells), if
            stricter than single moves.
        never: for each agent, the cells that it cannot reach in time, (steps + 1, cells).
        boxes: corners, (dim,) each, metres, of boxes around the regions in requirements.
    """

    roadmaps: tuple[Roadmap, ...]
    cells: tuple[Cells, ...]
    strides: tuple[tuple[tuple[int, Flags], ...], ...]
    never: dict[int, Flags]
    boxes: tuple[tuple[Array, Array], ...]

    @property
    def states(self) -> int:
        """Number of cells over all kinds of agents."""
        return sum(map(len, self.cells))


def build_cover(mission: Mission, kernel: Kernel, count: int) -> Cover:
    """Cover with at most ``count`` cells for each kind of agent, and a cell for each exact start and finish."""
    kinds: dict[object, list[Agent]] = {}
    for agent in mission.agents:
        kinds.setdefault((agent.dynamics, agent.radius, agent.altitude), []).append(agent)
    made = []
    boxes: list[tuple[Array, Array]] = []
    around = np.array(mission.world.low) - SLACK, np.array(mission.world.high) + SLACK
    for agents in kinds.values():
        asked = borders_asked(mission, kernel, agents[0])
        boxes += [border.box(*around) for border in asked]
        made.append(_of_kind(mission, agents, (*borders_of_obstacles(mission, agents[0]), *asked), count))
    never = {agent: flags for *_, late in made for agent, flags in late.items()}
    roadmaps, cells, strides, _ = zip(*made, strict=True)
    return Cover(roadmaps, cells, strides, never, tuple(boxes))


def _of_kind(
    mission: Mission, agents: list[Agent], borders: tuple[Border, ...], count: int
) -> tuple[Roadmap, Cells, tuple[tuple[int, Flags], ...], dict[int, Flags]]:
    first, steps = agents[0], mission.steps
    exact = dict.fromkeys(place.point for agent in agents for place in agent.ends if place.point is not None)
    points = np.array(list(exact), dtype=np.float64).reshape(len(exact), mission.dimension)
    cells = with_points(cells_of(mission, first, borders, count), points)
    standing = _standing(mission, first, cells)
    starts = [_cells_in(cells, agent.start, standing[0]) for agent in agents]
    finishes = [_cells_in(cells, agent.finish, standing[-1]) for agent in agents]
    single = np.arange(len(cells)) >= len(cells) - len(points)
    standing[:, single] = False  # otherwise the cells around them represent them
    for ends, step in ((starts, 0), (finishes, steps)):
        for agent, end in zip(agents, ends, strict=True):
            place = agent.start if step == 0 else agent.finish
            if place is not None and place.point is not None:
                standing[step, end] = True
    dynamics = first.dynamics
    move = may_move(cells, nearest(dynamics, mission.step, 1, mission.dimension), furthest(dynamics, mission.step))
    moves = np.argwhere(move).astype(np.int64)
    roadmap = Roadmap(
        agents=tuple(agent.index for agent in agents),
        position=cells.middle,
        velocity=np.zeros_like(cells.low),
        heading=np.full(len(cells), np.nan),
        moves=moves,
        standing=standing,
        allowed=np.ones((steps, len(moves)), dtype=np.bool_),
        starts=tuple(starts),
        finishes=tuple(finishes),
    )
    strides = tuple(_strides(mission, first, cells, move))
    never = {
        agent.index: _out_of_reach(mission, agent, cells, start, finish)
        for agent, start, finish in zip(agents, starts, finishes, strict=True)
    }
    return roadmap, cells, strides, never


def _standing(mission: Mission, agent: Agent, cells: Cells) -> Flags:
    """Return true for each cell with a position that is clear of obstacles at each step: (steps + 1, cells)."""
    standing: Flags = np.ones((mission.steps + 1, len(cells)), dtype=np.bool_)
    for obstacle in mission.obstacles:
        steps = (0,) if obstacle.constant else range(mission.steps + 1)
        for step in steps:
            clear = standing_room(obstacle, agent, mission, step, cells.low, cells.high)
            standing[slice(None) if obstacle.constant else step] &= clear
    return standing


def _cells_in(cells: Cells, place: InitialSet | None, clear: Flags) -> Indices:
    """Indices of the clear cells that an agent at a start or finish may be in; all clear cells if ``place`` is None."""
    if place is None:
        inside = np.ones(len(cells), dtype=np.bool_)
    elif place.point is not None:
        inside = np.all((cells.low == place.point) & (cells.high == place.point), axis=1)
    else:
        inside = signed_distance_range(place.shape, cells.low, cells.high).low <= TOUCH
    return np.flatnonzero(inside & clear)


def _strides(mission: Mission, agent: Agent, cells: Cells, move: Flags) -> Iterator[tuple[int, Flags]]:
    """Yield 2, 4, 8, … steps with the possible moves over them; each single move overestimates the range by up to a
    cell's size."""
    within, steps = move, 2
    while steps <= mission.steps:
        within = (within.astype(np.float32) @ within.astype(np.float32)) > 0
        may = may_move(
            cells,
            nearest(agent.dynamics, mission.step, steps, mission.dimension),
            furthest(agent.dynamics, steps * mission.step),
        )
        if (within & ~may).any():
            yield steps, may
            within = within & may
        if may.all():
            return
        steps *= 2


def _out_of_reach(mission: Mission, agent: Agent, cells: Cells, start: Indices, finish: Indices) -> Flags:
    """Return true for each cell that is too far from the start or the finish at each step: (steps + 1, cells)."""
    steps = np.arange(mission.steps + 1)
    never: Flags = np.zeros((len(steps), len(cells)), dtype=np.bool_)
    for ends, seconds in ((start, steps * mission.step), (finish, steps[::-1] * mission.step)):
        if len(ends):
            away = cells.distance.low[ends].min(axis=0)
            reach = np.array([furthest(agent.dynamics, float(each)) for each in seconds])
            never |= away[None, :] > reach[:, None]
    return never

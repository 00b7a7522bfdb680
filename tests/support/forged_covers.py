"""Covers that claim as much as their checks allow, which includes every possible forgery."""

from __future__ import annotations

import random
import re
from collections.abc import Callable, Hashable, Iterable
from dataclasses import replace
from itertools import combinations

import numpy as np

from missionc.base.trace import Array, Flags
from missionc.ir import Agent, Mission
from missionc.ir.kernel.nodes import Goal, Kernel
from missionc.verification.certificate import MOTION
from missionc.verification.impossibility.bodies import blocked
from missionc.verification.impossibility.check_bodies import CheckedLabels, check_pairs
from missionc.verification.impossibility.check_motion import (
    MotionLimits,
    check_absent,
    check_moves,
    check_turns,
    check_visits,
    limits_of,
)
from missionc.verification.impossibility.cnf import Cnf
from missionc.verification.impossibility.cover_document import CellsOfKind, ClaimedCover, Label
from missionc.verification.impossibility.encode_formulas import Never, refutation
from missionc.verification.impossibility.intervals import Boxes, Interval


def boldest(mission: Mission, kernel: Kernel, cells: int, draw: random.Random) -> ClaimedCover:
    """Cover with random cells and all claims that its checks allow, one after the other."""
    names = tuple(goal.name for goal in kernel.requirements)
    limits = limits_of(mission, kernel.requirements)
    agents = tuple(agent.index for agent in mission.agents)
    cover = ClaimedCover(names, agents, len(agents) > 1, _kinds(mission, cells, draw), {}, {}, {}, (), {}, ())
    cover = replace(cover, kinds=tuple(_moving(mission, cover, kind, limits) for kind in cover.kinds))
    for agent in mission.agents:
        cover = _placed(mission, cover, agent, limits[agent.index])
    for pair in combinations(agents, 2):
        cover = _kept_apart(mission, cover, pair)
    labels = _Boldest(mission, cover)
    refutation(mission, kernel.requirements, cover, labels)
    return replace(cover, labels=tuple(labels.made))


def _placed(mission: Mission, cover: ClaimedCover, agent: Agent, limits: MotionLimits) -> ClaimedCover:
    """Cover with the claimed absences of an agent."""
    own, cells = agent.index, len(cover.kind_of(agent.index))

    def absent(flags: Flags) -> ClaimedCover:
        return replace(cover, absent={**cover.absent, own: flags})

    shape = mission.steps + 1, cells
    placed = absent(
        _all_but(
            shape, lambda flags: check_absent(mission, absent(flags), agent, limits), lambda cell, step: (step, cell)
        )
    )

    def visited(flags: Flags) -> ClaimedCover:
        return replace(placed, not_both={**cover.not_both, own: flags})

    return visited(_all_but((cells, cells), lambda flags: check_visits(mission, visited(flags), agent, limits)))


def _kept_apart(mission: Mission, cover: ClaimedCover, pair: tuple[int, int]) -> ClaimedCover:
    """Cover with the claims on pairs of cells of two agents."""

    def apart(flags: Flags) -> ClaimedCover:
        return replace(cover, not_together={**cover.not_together, pair: flags})

    shape = tuple(len(cover.kind_of(agent)) for agent in pair)
    return apart(_all_but(shape, lambda flags: check_pairs(mission, apart(flags), pair)))


def _kinds(mission: Mission, cells: int, draw: random.Random) -> tuple[CellsOfKind, ...]:
    alike: dict[Hashable, list[int]] = {}
    for agent in mission.agents:
        alike.setdefault((agent.dynamics, agent.radius, agent.altitude), []).append(agent.index)
    return tuple(_kind(mission, tuple(agents), cells, draw) for agents in alike.values())


def _kind(mission: Mission, agents: tuple[int, ...], cells: int, draw: random.Random) -> CellsOfKind:
    places = [mission.agents[agent].start for agent in agents] + [mission.agents[agent].finish for agent in agents]
    points = np.array(
        sorted({place.point for place in places if place is not None and place.point is not None}), dtype=np.float64
    )
    points = points.reshape(-1, mission.dimension)
    low, high = _cut(mission, cells, draw)
    bare = ClaimedCover((), (), False, (), {}, {}, {}, (), {}, ())
    full = np.zeros(len(low), dtype=np.bool_)
    for number, obstacle in enumerate(mission.obstacles):
        if obstacle.constant:
            radius = float(mission.agents[agents[0]].radius)
            full |= blocked(mission, bare, number, radius, 0, (low, high))
    boxes = np.concatenate([low[~full], points]), np.concatenate([high[~full], points])
    return CellsOfKind(agents, boxes, len(points), (low[full], high[full]), {}, {})


def _cut(mission: Mission, cells: int, draw: random.Random) -> Boxes:
    """World cut into boxes, by repeated random cuts."""
    whole = np.array(mission.world.low) - 2 * MOTION, np.array(mission.world.high) + 2 * MOTION
    boxes: list[tuple[Array, Array]] = [whole]
    while len(boxes) < cells:
        low, high = boxes.pop(draw.randrange(len(boxes)))
        axis = draw.randrange(mission.dimension)
        at = draw.choice([draw.uniform(low[axis], high[axis]), round(draw.uniform(low[axis], high[axis]), 1)])
        at = min(max(at, low[axis]), high[axis])
        first, second = high.copy(), low.copy()
        first[axis] = second[axis] = at
        boxes += [(low, first), (second, high)]
    return np.array([low for low, _ in boxes]), np.array([high for _, high in boxes])


def _moving(mission: Mission, cover: ClaimedCover, kind: CellsOfKind, limits: tuple[MotionLimits, ...]) -> CellsOfKind:
    own, size = [limits[agent] for agent in kind.agents], len(kind)

    def moves(steps: int) -> Flags:
        return _all_but(
            (size, size),
            lambda flags: (
                fault for each in own for fault in check_moves(mission, replace(kind, no_move={steps: flags}), each)
            ),
            lambda target, source, _: (source, target),
        )

    def turns(steps: int) -> Flags:
        return _all_but(
            (size, size, size),
            lambda flags: (
                fault for each in own for fault in check_turns(mission, replace(kind, no_turn={steps: flags}), each)
            ),
            lambda first, second, third, _: (first, second, third),
        )

    within = [steps for steps in (1, 2, 3, 4) if steps <= mission.steps]
    turning = [1, 2] if np.isfinite(own[0].dynamics.top_acceleration) else []
    return replace(
        kind,
        no_move={steps: moves(steps) for steps in within},
        no_turn={steps: turns(steps) for steps in turning if 2 * steps <= mission.steps},
    )


def _all_but(
    shape: tuple[int, ...],
    faults: Callable[[Flags], Iterable[str]],
    where: Callable[..., tuple[int, ...]] = lambda *cells: cells,
) -> Flags:
    """All flags set except those that a check rejects; it names cells in its own order."""
    flags: Flags = np.ones(shape, dtype=np.bool_)
    while True:
        fault = next(iter(faults(flags)), None)
        if fault is None:
            return flags
        at = where(*map(int, re.findall(r"\d+", re.sub(r"\w+\[\d+\]", "", fault))))
        assert flags[at], fault
        flags[at] = False


class _Boldest(CheckedLabels):
    """Labels that claim all margins."""

    def __init__(self, mission: Mission, cover: ClaimedCover) -> None:
        super().__init__(mission, cover)
        self.made: list[Label] = []

    def _checked(self, key: Hashable, of: str, agents: tuple[int, ...], margin: Callable[[], Interval]) -> Never:
        if key not in self._known:
            measured, sizes = margin(), [len(self.cover.kind_of(agent)) for agent in agents]
            shape = {"cells": sizes, "moves": sizes * 2, "pairs": sizes}[of]
            never_true = np.array(np.broadcast_to(measured.high < -self._certain, shape))
            never_false = np.array(np.broadcast_to(measured.low > self._certain, shape))
            self.made.append(Label("leaf", of, agents, never_true, never_false))
            self._known[key] = never_true, never_false
        return self._known[key]


def followed(mission: Mission, goals: tuple[Goal, ...], position: Array) -> Cnf:
    """Clauses of a known motion, (agents, steps + 1, dim), metres: each of its positions is a cell of its own."""
    agents = tuple(range(len(position)))
    places, number = np.unique(position.reshape(-1, mission.dimension), axis=0, return_inverse=True)
    at = number.reshape(position.shape[:2])
    absent = {agent: at[agent][:, None] != np.arange(len(places)) for agent in agents}
    kind = CellsOfKind(agents, (places, places), 0, (places[:0], places[:0]), {}, {})
    cover = ClaimedCover((), agents, False, (kind,), {}, absent, {}, (), {}, ())
    return refutation(mission, goals, cover, _Boldest(mission, cover))

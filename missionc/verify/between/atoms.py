"""Sign of margins along a motion, proved between samples: the intervals in which predicates and links hold.

A margin that changes by at most so much per second keeps the sign that it has
in the middle of a stretch, if it is large enough there; else the stretch is
halved, down to ``RESOLUTION``. What is left is not decided.

Source:
    Mirtich, "Impulse-based Dynamic Simulation of Rigid Body Systems" (1996), section 2.3.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias, assert_never

import numpy as np

from missionc.base.trace import Array
from missionc.curves.piecewise_polynomials import Indices
from missionc.ir import (
    Altitude,
    Compare,
    Connected,
    Coordinate,
    DistanceBetween,
    DistanceTo,
    Feature,
    Graph,
    InFormation,
    Inside,
    Mission,
    Predicate,
    Proximity,
    Speed,
    Touches,
)
from missionc.language.margins import compare, formation, inside, region, touches
from missionc.language.margins.predicate_margins import holds, link_margin
from missionc.verify.between.interval_sets import Signal
from missionc.verify.between.motion_clock import STEP, Motion
from missionc.world.signed_distance import distance_between

RESOLUTION = 1e-4
"""Seconds: no stretch shorter than this is halved."""

CHUNK = 1 << 17
"""Stretches looked at together: bounds the memory."""

EVALUATIONS = 10_000_000
"""After so many, for one predicate, nothing more is decided: still sound, only coarser."""

ROUTES = "a kernel has routes in the place of `connected`"

Margin: TypeAlias = Callable[[Indices, Indices, Array], Array]
"""A margin as a function of items, pieces and the seconds since they began: (count,) three times -> (count,)."""


def atom_signals(predicate: Predicate, agents: Indices, motion: Motion) -> list[Signal]:
    """When a predicate holds at each of these agents; of one about the team, its one signal.

    Raises:
        ValueError: the predicate is ``connected``; a kernel has routes in its place.
    """
    if isinstance(predicate, InFormation):
        agents = np.zeros(1, dtype=np.int64)
    border = 0
    rate = _rate(predicate, agents, motion)
    if not rate.any() and isinstance(predicate, Compare) and _still(predicate, motion.mission):
        border = 1 if bool(holds(predicate, np.zeros(1))[0]) else -1
    return _signals(_margin(predicate, agents, motion), rate, motion, border)


def link_signals(graph: Graph, first: Indices, second: Indices, motion: Motion) -> list[Signal]:
    """When pairs of agents are linked."""

    def margin(pair: Indices, piece: Indices, local: Array) -> Array:
        here, there = (motion.position(agent[pair], piece, local) for agent in (first, second))
        return np.asarray(link_margin(graph, here, there))

    if isinstance(graph, Proximity):
        rate = motion.relative_speed(first, second)
    else:
        rate = np.maximum(motion.speed[first], motion.speed[second])
    return _signals(margin, rate, motion, 0)


# ------------------------------------------------------------------- margins


def _margin(predicate: Predicate, agents: Indices, motion: Motion) -> Margin:
    mission, everyone = motion.mission, np.arange(len(motion.mission.agents))[:, None]
    radii = np.array([agent.radius for agent in mission.agents])
    altitudes = np.array([agent.altitude for agent in mission.agents])

    def margin(item: Indices, piece: Indices, local: Array) -> Array:
        agent = agents[item]

        def at(other: int | Indices) -> Array:
            return motion.position(np.broadcast_to(other, agent.shape), piece, local)

        def value(feature: Feature) -> Array:
            match feature:
                case DistanceTo(int() as target):
                    return np.asarray(distance_between(np, at(agent), at(target)))
                case DistanceBetween(first, second):
                    return np.asarray(distance_between(np, at(first), at(second)))
                case _:
                    velocity = motion.velocity(agent, piece, local) if isinstance(feature, Speed) else None
                    return np.asarray(compare.own_feature(np, feature, altitudes[agent], at(agent), velocity))

        found: Array
        match predicate:
            case Inside(place, True):
                found = inside.margin(np, place, radii[agent], at(agent))
            case Inside(place):
                found = region.margin(np, place, at(agent))
            case Touches(place):
                found = touches.margin(np, place, radii[agent], at(agent))
            case Compare():
                found = compare.margin(predicate, mission.dimension, value) + np.zeros(item.shape)
            case InFormation(shape):
                together = motion.position(everyone, piece[None], np.broadcast_to(local, (len(everyone), local.size)))
                found = formation.margin(np, shape, together)
            case Connected():
                raise ValueError(ROUTES)
            case _:
                assert_never(predicate)
        return found

    return margin


def _rate(predicate: Predicate, agents: Indices, motion: Motion) -> Array:
    """(agents, pieces): the margin changes at most so much per second."""
    match predicate:
        case Inside() | Touches():
            return motion.speed[agents]
        case Compare():
            return _rate_of_comparison(predicate, agents, motion)
        case InFormation(shape):
            if not shape.edges:
                return np.zeros((1, motion.joints.size - 1))
            ends = np.array([(edge.first, edge.second) for edge in shape.edges])
            edges = motion.relative_speed(ends[:, 0], ends[:, 1])
            return np.asarray((edges.sum(axis=0) if shape.total else edges.max(axis=0))[None])
        case Connected():
            raise ValueError(ROUTES)
        case _:
            assert_never(predicate)


def _rate_of_comparison(predicate: Compare, agents: Indices, motion: Motion) -> Array:
    direction = np.zeros(motion.mission.dimension)
    rate = np.zeros((agents.size, motion.joints.size - 1))
    for weight, feature in predicate.terms:
        match feature:
            case Coordinate(axis):
                direction[axis] += weight
            case Altitude():
                direction[2:] += weight
            case Speed():
                rate += abs(weight) * motion.acceleration[agents]
            case DistanceTo(int() as target):
                rate += abs(weight) * motion.relative_speed(agents, np.full_like(agents, target))
            case DistanceTo():
                rate += abs(weight) * motion.speed[agents]
            case DistanceBetween(first, second):
                rate += abs(weight) * motion.relative_speed(np.array([first]), np.array([second]))
            case _:
                assert_never(feature)
    rate += motion.speed_along(agents, direction)
    return rate / compare.scale(predicate, motion.mission.dimension)


def _still(predicate: Compare, mission: Mission) -> bool:
    """Whether no motion changes the comparison: it reads nothing but the altitude of a plane."""
    return mission.dimension == 2 and all(isinstance(feature, Altitude) for _, feature in predicate.terms)


# --------------------------------------------------------------------- signs


def _signals(margin: Margin, rate: Array, motion: Motion, border: int) -> list[Signal]:
    """When each item's margin is surely positive, and when surely negative.

    Args:
        rate: (items, pieces), per second.
        border: 1 or -1 says what a margin of exactly 0 means; 0 leaves it open.
    """
    items, pieces = rate.shape
    slack = 0.0 if border else motion.slack
    shortest = max(1, int(RESOLUTION / motion.mission.step * STEP))
    there = np.flatnonzero(np.tile(np.diff(motion.joints) > 0, items))
    waiting = [
        (item, piece, motion.joints[piece], motion.joints[piece + 1])
        for item, piece in (np.divmod(there[begin : begin + CHUNK], pieces) for begin in range(0, there.size, CHUNK))
    ]
    found: list[tuple[Indices, Indices, Indices, Indices]] = []
    spent = 0
    while waiting:
        item, piece, low, high = waiting.pop()
        middle = (low + high) // 2
        value = margin(item, piece, motion.local(piece, middle))
        spent += item.size
        change = rate[item, piece] * motion.reach(low, high)
        sign = np.where(value > change + slack, 1, np.where(value < -change - slack, -1, 0))
        if border:
            sign = np.where((value == 0) & (change == 0), border, sign)
        done = (sign != 0) | (high - low <= shortest) | (change <= slack) | (spent > EVALUATIONS)
        found.append((item[done], low[done], high[done], sign[done]))
        item, piece, low, middle, high = (column[~done] for column in (item, piece, low, middle, high))
        item, piece, low, high = np.r_[item, item], np.r_[piece, piece], np.r_[low, middle], np.r_[middle, high]
        for begin in range(0, item.size, CHUNK):
            part = slice(begin, begin + CHUNK)
            waiting.append((item[part], piece[part], low[part], high[part]))
    return _joined(items, *(np.concatenate(columns) for columns in zip(*found, strict=True)))


def _joined(items: int, item: Indices, low: Indices, high: Indices, sign: Indices) -> list[Signal]:
    """Stretches of one sign, joined; where the sign jumps, the moment belongs to what begins."""
    order = np.lexsort((high, low, item))
    item, low, high, sign = item[order], low[order], high[order], sign[order]
    first = np.flatnonzero(np.r_[True, (np.diff(item) != 0) | (np.diff(sign) != 0)])
    last = np.r_[first[1:] - 1, item.size - 1]
    sure: list[list[tuple[int, int]]] = [[] for _ in range(items)]
    never: list[list[tuple[int, int]]] = [[] for _ in range(items)]
    rows = list(zip(item[first].tolist(), low[first].tolist(), high[last].tolist(), sign[first].tolist(), strict=True))
    for (who, start, stop, what), after in zip(rows, [*rows[1:], (-1, 0, 0, 0)], strict=True):
        jumps = after[0] == who and what * after[3] < 0
        if what and stop - jumps >= start:
            (sure if what > 0 else never)[who].append((start, stop - jumps))
    return [Signal(tuple(sure[who]), tuple(never[who])) for who in range(items)]

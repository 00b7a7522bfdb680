"""``minimize distance``: the metres all agents travel together.

Lengths are counted in units and rounded down, so that what is shown to be
impossible is impossible: the shortest plan is at least so many units long. How
long a plan is, is measured and not counted.

Source:
    Bailleux and Boufkhad, "Efficient CNF encoding of Boolean cardinality constraints", 2003.
"""

from __future__ import annotations

import time

import numpy as np

from missionc.backends.api import Progress
from missionc.backends.smt.clauses import FALSE, TRUE, Clauses, Literals, TooLarge
from missionc.backends.smt.lower_motion import Motion
from missionc.backends.smt.roadmap import Indices
from missionc.backends.smt.search import Found, Search
from missionc.backends.smt.solve import Stopped, Unsatisfiable
from missionc.ir import Mission
from missionc.plan import Array
from missionc.world.dynamics import States, motion_of

PATIENCE = 60.0
"""Seconds, if the time limit leaves them."""

UNITS = 1200
"""What the first plan's length is divided into; the clauses grow with its square."""

CHORDS = 16
"""A curved move is as long as so many straight pieces between its points."""


def shorten_distance(found: Found, kept: tuple[int, ...], search: Search) -> Found:
    """Asks for a shorter plan until there is none, or no time."""
    until = time.monotonic() + PATIENCE
    lengths = [move_lengths(search.mission, search.motion, number) for number in range(len(search.motion.roadmaps))]
    best = travelled(found.states, search.motion, lengths)
    unit = best / UNITS
    if unit == 0.0:
        return found
    counted = [np.floor(length / unit).astype(np.int64) for length in lengths]
    units = travelled_units(found.states, search.motion, counted)
    try:
        total = add_total(search.clauses, search.motion, counted, units)
    except TooLarge:
        search.account.notes.append(f"{best:.6g} m in all; too many clauses to look for less")
        return found
    least = 0
    while least < units:
        target = units - max(1, (units - least) // 4)
        search.listen(Progress("improve", search.rounds, f"{best:.4g} m, at least {least * unit:.4g} m"))
        result = search.find((*kept, -int(total[target])), until)
        match result:
            case Found(states):
                units = travelled_units(states, search.motion, counted)
                if travelled(states, search.motion, lengths) < best:
                    found, best = result, travelled(states, search.motion, lengths)
            case Unsatisfiable():
                least = target + 1
            case Stopped():
                break
    gap = 1 - least * unit / best if best else 0.0
    search.account.notes.append(
        f"{best:.6g} m in all; no plan on this roadmap is shorter than {least * unit:.6g} m (a gap of {gap:.1%})"
    )
    return found


def move_lengths(mission: Mission, motion: Motion, number: int) -> Array:
    """How long each move of a roadmap is: (moves,), metres."""
    roadmap = motion.roadmaps[number]
    states = States(roadmap.position, roadmap.velocity)
    source, target = roadmap.moves.T
    dynamics = mission.agents[roadmap.agents[0]].dynamics
    position, velocity, acceleration = motion_of(dynamics, states.take(source), states.take(target), mission.step)
    moment = np.linspace(0.0, mission.step, CHORDS + 1)[:, None, None]
    points = position + velocity * moment + acceleration * (0.5 * moment**2)
    return np.asarray(np.linalg.norm(np.diff(points, axis=0), axis=-1).sum(axis=0))


def travelled(states: Indices, motion: Motion, lengths: list[Array]) -> float:
    """The sum of the moves' lengths along a joint motion, (agents, steps + 1)."""
    moves = (_taken(row, motion, agent) for agent, row in enumerate(states))
    return float(sum(lengths[motion.roadmap_of[agent]][each].sum() for agent, each in enumerate(moves)))


def travelled_units(states: Indices, motion: Motion, counted: list[Indices]) -> int:
    moves = (_taken(row, motion, agent) for agent, row in enumerate(states))
    return int(sum(counted[motion.roadmap_of[agent]][each].sum() for agent, each in enumerate(moves)))


def _taken(row: Indices, motion: Motion, agent: int) -> Indices:
    """The numbers of the moves between an agent's states, (steps + 1,): (steps,)."""
    roadmap = motion.roadmap(agent)
    count = len(roadmap.position)
    keys = roadmap.moves[:, 0] * count + roadmap.moves[:, 1]
    return np.searchsorted(keys, row[:-1] * count + row[1:])


def add_total(clauses: Clauses, motion: Motion, counted: list[Indices], most: int) -> Literals:
    """Literals, (most + 1,), implied by a joint motion: the ``k``-th by one longer than ``k`` units."""
    numbers = [
        number
        for agent in range(motion.agents)
        for number in _moves(clauses, motion, agent, counted[motion.roadmap_of[agent]], most)
    ]
    while len(numbers) > 1:
        pairs = zip(numbers[::2], numbers[1::2], strict=False)
        odd = numbers[len(numbers) // 2 * 2 :]
        numbers = [_sum(clauses, one, other, most + 1) for one, other in pairs] + odd
    total = np.full(most + 1, FALSE, dtype=np.int32)
    if numbers:
        total[: len(numbers[0])] = numbers[0][: most + 1]
    return total


def _moves(clauses: Clauses, motion: Motion, agent: int, counted: Indices, most: int) -> list[Literals]:
    """For each step the length of the agent's move from it, as literals: the ``k``-th for more than ``k`` units."""
    roadmap, states = motion.roadmap(agent), motion.states[agent]
    source, target = roadmap.moves.T
    numbers = []
    for step in range(motion.steps):
        here, there = states[step, source], states[step + 1, target]
        live = (here != FALSE) & (there != FALSE) & roadmap.allowed[step] & (counted > 0)
        size = int(counted[live].max(initial=0))
        if size == 0:
            continue
        number = clauses.fresh(size)
        clauses.add(-here[live], -there[live], number[counted[live] - 1])
        clauses.add(-number[1:], number[:-1])
        numbers.append(number[: most + 1])
    return numbers


def _sum(clauses: Clauses, one: Literals, other: Literals, most: int) -> Literals:
    """The sum of two numbers of this form, exact up to ``most``."""
    clauses.reserve(len(one) * len(other))
    total = clauses.fresh(min(len(one) + len(other), most))
    left = np.concatenate([[TRUE], one]).astype(np.int32)
    right = np.concatenate([[TRUE], other]).astype(np.int32)
    row, column = np.meshgrid(np.arange(len(left)), np.arange(len(right)), indexing="ij")
    counts = (row + column > 0) & (row + column <= len(total))
    clauses.add(-left[row[counts]], -right[column[counts]], total[row[counts] + column[counts] - 1])
    return total

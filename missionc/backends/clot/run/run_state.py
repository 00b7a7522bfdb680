"""Checkpoints of trajectory optimisation: conversion of a run's state between two steps to a ``Snapshot`` and back.

All random draws follow from the seed and the attempt's index, and an initial trajectory from these only. An attempt is
therefore saved as its index, and a result as the index of its attempt and the trajectory.

Search results of Algorithm 2: final joint trajectories, and the closest infeasible candidates.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import Any

import numpy as np

from missionc.backends.api import Attempt, Snapshot, UnusableSnapshot, Violation
from missionc.backends.clot.optimise.active_set import Choices
from missionc.backends.clot.optimise.control_points import splines
from missionc.backends.clot.settings import clot_settings
from missionc.base.late_dataclass import Record
from missionc.base.strict_json import is_finite_number
from missionc.base.trace import Array, Solved, read_solved
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from missionc.ir.kernel.walk import children, graph_of, postorder, window_of

UNUSABLE = (ValueError, KeyError, IndexError, TypeError, OverflowError, RecursionError)
"""Exceptions that reading an invalid snapshot may raise."""


class Nearest(Record, eq=False):
    """Best infeasible candidate: control points, shortfall in metres, and origin.

    ``sketch`` is the index of the attempt with its schedule and joint waypoints, and ``motion`` the initial trajectory
    of its optimisation, (agents, steps + 1, dim), metres; None if another search cannot use it.
    """

    control: Array
    shortfall: float
    sketch: int | None
    motion: Array | None


class RunCandidate(Record, eq=False):
    """Trajectory that is not a plan, with its evaluation."""

    nearest: Nearest
    attempt: Attempt

    @property
    def rank(self) -> tuple[float, int]:
        """Sort key of the candidate; smaller is better."""
        return self.nearest.shortfall, self.attempt.wrong


class Searching(Record, eq=False):
    """State of a search (Algorithm 2) between two rounds, in the form of ``to_arrays``, and its progress."""

    arrays: Mapping[str, Array]
    text: str
    planned: int
    margin: float


class Reached(Record, eq=False):
    """Plan as control points, (agents, points, dim), metres, and choices; ``final`` if it must not be improved
    further."""

    control: Array
    choices: Choices
    final: bool = False
    solved: tuple[Solved, ...] = ()


class State(Record, eq=False):
    """State of a run between two steps.

    Args:
        number: index of the next or current attempt, from 0.
        furthest: number of planned agents and margin, metres, of the search that planned the most agents without a
            joint trajectory.
        notes: notes so far.
        work: work units done.
        beside: texts of the caller, by name.
        search: state of the current attempt's search; ``reached``: plan of the current attempt.
    """

    number: int = 0
    nearest: Nearest | None = None
    furthest: tuple[int, float] | None = None
    notes: tuple[str, ...] = ()
    work: float = 0.0
    beside: Mapping[str, str] = field(default_factory=dict)
    search: Searching | None = None
    reached: Reached | None = None


def to_snapshot(state: State, graph: Kernel) -> Snapshot:
    """State of a run as arrays and JSON values."""
    arrays: dict[str, Array] = {}
    words: dict[str, Any] = {
        "number": state.number,
        "furthest": None if state.furthest is None else [state.furthest[0], _number(state.furthest[1])],
        "notes": list(state.notes),
        "work": state.work,
        "beside": dict(state.beside),
        "nearest": None,
        "search": None,
        "reached": state.reached is not None,
    }
    if state.nearest is not None:
        words["nearest"] = {"shortfall": _number(state.nearest.shortfall), "sketch": state.nearest.sketch}
        arrays["nearest.control"] = state.nearest.control
        if state.nearest.motion is not None:
            arrays["nearest.motion"] = state.nearest.motion
    if state.search is not None:
        search = state.search
        words["search"] = {"text": search.text, "planned": search.planned, "margin": _number(search.margin)}
        arrays |= {f"search.{name}": array for name, array in search.arrays.items()}
    if state.reached is not None:
        place = {node: index for index, node in enumerate(postorder(graph.formulas))}
        rows = [(place[node], agent, step, chosen) for (node, agent, step), chosen in state.reached.choices.items()]
        words["solved"] = [each.as_record() for each in state.reached.solved]
        arrays["reached.control"] = state.reached.control
        arrays["reached.choices"] = np.array(rows, dtype=np.float64).reshape(-1, 4)
    return Snapshot(arrays, words)


def from_snapshot(snapshot: Snapshot, mission: Mission, graph: Kernel) -> State:
    """State of a run that ``to_snapshot`` saved.

    Raises:
        UnusableSnapshot: the snapshot is no state of a run of this mission.
    """
    try:
        return _read(snapshot.arrays, snapshot.words, mission, graph)
    except UNUSABLE as wrong:
        raise UnusableSnapshot(f"no state of a run of this mission: {wrong}") from wrong


def _read(arrays: Mapping[str, Array], words: Mapping[str, Any], mission: Mission, graph: Kernel) -> State:
    nearest = search = reached = furthest = None
    moves = len(mission.agents), mission.steps + 1, mission.dimension
    control = len(mission.agents), splines(mission).points, mission.dimension
    if words["nearest"] is not None:
        fields = words["nearest"]
        sketch = None if fields["sketch"] is None else _count(fields["sketch"])
        motion = None if sketch is None else _shaped(arrays["nearest.motion"], moves)
        nearest = Nearest(_shaped(arrays["nearest.control"], control), _margin(fields["shortfall"]), sketch, motion)
    if words["furthest"] is not None:
        planned, margin = words["furthest"]
        furthest = _count(planned), _margin(margin)
    if words["search"] is not None:
        fields = words["search"]
        own = {name.removeprefix("search."): array for name, array in arrays.items() if name.startswith("search.")}
        if len(own["motion"]):
            _shaped(own["motion"], (len(own["motion"]), *moves[1:]))
        search = Searching(own, str(fields["text"]), _count(fields["planned"]), _margin(fields["margin"]))
    if words["reached"]:
        chosen = _choices(arrays["reached.choices"], mission, graph)
        solved = read_solved(words["solved"], mission.names)
        reached = Reached(_shaped(arrays["reached.control"], control), chosen, solved=solved)
    notes = tuple(map(str, words["notes"]))
    beside = {str(name): str(word) for name, word in dict(words["beside"]).items()}
    return State(_count(words["number"]), nearest, furthest, notes, _work(words["work"]), beside, search, reached)


def _choices(rows: Array, mission: Mission, graph: Kernel) -> Choices:
    order = postorder(graph.formulas)
    choices = {}
    for index, agent, step, chosen in rows.astype(np.int64).tolist():
        node = order[_within(index, len(order))]
        most = mission.steps + 1 if window_of(node) else len(mission.agents if graph_of(node) else children(node))
        place = _within(agent, len(mission.agents)), _within(step, mission.steps + 1)
        choices[node, *place] = _within(chosen, most)
    return choices


def _within(number: int, count: int) -> int:
    if not 0 <= number < count:
        raise ValueError(f"{number} is not one of {count}")
    return number


def _count(number: object) -> int:
    if not isinstance(number, int) or number < 0:
        raise ValueError(f"{str(number)[:40]} is no count")
    return number


def _number(value: float) -> float | None:
    """Number for JSON; None for an infinite number."""
    return float(value) if np.isfinite(value) else None


def _work(value: object) -> float:
    if not is_finite_number(value) or value < 0:
        raise ValueError(f"{str(value)[:40]} is no amount of work")
    return float(value)


def _margin(value: object) -> float:
    return -np.inf if value is None else float(str(value))


def _shaped(array: Array, shape: tuple[int, ...]) -> Array:
    if array.shape != shape:
        raise ValueError(f"an array of shape {array.shape} instead of {shape}")
    return array


class Searched(Record, eq=False):
    """Result of a search: joint trajectories, each (agents, steps + 1, dim), metres, the cheapest first; possibly none.

    ``planned`` is the largest number of agents planned together, and ``margin`` the best margin of such a candidate,
    metres. ``iterations`` counts the local optimisations of complete rounds, ``found`` all joint trajectories.

    Source:
        [clot] V-A.2, which reports both numbers.
    """

    motions: tuple[Array, ...]
    planned: int
    margin: float
    iterations: int = 0
    found: int = 0

    @property
    def sizes(self) -> dict[str, int]:
        """Numbers of local iterations and joint trajectories, by name, for the report."""
        return {"local iterations": self.iterations, "joint motions": self.found}

    @property
    def rank(self) -> tuple[int, float]:
        """Sort key of the result; larger means more agents planned."""
        return self.planned, self.margin


def near(mission: Mission) -> float:
    """Shortfall up to which a candidate trajectory is optimised again, metres."""
    settings = clot_settings(mission).attempts
    furthest = max(agent.dynamics.top_speed for agent in mission.agents) * mission.step
    return max(settings.near, settings.near * furthest)


def freed(choices: Choices, graph: Kernel, come_to: Attempt) -> Choices:
    """Choices without those of violated requirements, so that their times and agents are chosen again."""
    names = {each.name for each in come_to.violated}
    free = set(postorder(wanted.formula for wanted in graph.requirements if wanted.name in names))
    return {key: chosen for key, chosen in choices.items() if key[0] not in free}


def failure_statement(best: Attempt | None, furthest: Searched | None, mission: Mission) -> str:
    """Text of the best candidate's violations; without a candidate, of the search's progress."""
    if best is None and furthest is not None:
        count, agents, margin = furthest.planned, len(mission.agents), furthest.margin
        return f"{count} of {agents} agents planned; the last agent lacks {-margin:.3g} m of margin"
    if best is None:
        return "the search completed no candidate plan"
    wrong = [
        *(
            Violation(f"`{each.name}`", each.agents, each.step or 0, each.robustness, each.unit)
            for each in best.violated
        ),
        *best.worst_faults(),
    ]
    return f"the best candidate violates {'; '.join(_text(fault, mission) for fault in wrong)}"


def _text(fault: Violation, mission: Mission) -> str:
    who = " and ".join(fault.agents[:2])
    by = f" by {fault.short}" if fault.short else ""
    return f"{fault.what}{f' of {who}' if who else ''} at {fault.step * mission.step:g} s{by}"

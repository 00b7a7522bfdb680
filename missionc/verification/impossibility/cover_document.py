"""Cover of a mission as a document: cells of the complete space, and claims of impossible states and moves.

    in   ``cover.json``
    out  ClaimedCover, untrusted

Each claim excludes something, so that a missing claim weakens the proof but is never unsound.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from math import comb
from typing import Any, TypeAlias

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.strict_json import NotJsonError, parse_json
from missionc.base.trace import Array, Flags
from missionc.ir import Mission
from missionc.verification.impossibility.intervals import Boxes

COVER, COVER_SCHEMA = "cover.json", "missionc.cover/1"

FURTHEST = 1e12
"""Maximum distance of a cell from the origin, metres, so that computed values stay finite."""

MOST_CELLS = 3000
"""Maximum number of cells for agents of one kind up to which claims about pairs of cells are checked."""

MOST_THIRDS = 120
"""Maximum number of cells for agents of one kind up to which claims about triples of cells are checked."""

MOST_BOXES = 20_000
"""Maximum number of boxes in one list: cells, excluded boxes, or boxes of a body."""

MOST_ROOMS = 2_000
"""Maximum number of boxes with a limited number of agents, and of boxes that lie in one body."""

MOST_CHOICES = 10_000
"""Maximum number of agent subsets that are too large for a box."""

Json: TypeAlias = Any


class Unreadable(ValueError):
    """Error: the file is not a cover of this mission."""


class CellsOfKind(Record, eq=False):
    """Cells for agents of one kind (equal bodies and dynamics), and the impossible moves between cells.

    Args:
        agents: mission indices.
        boxes: corners, (cells, dim) twice, metres; the last ``points`` are points where agents start and finish.
        left_out: corners of boxes without a clear centre, (boxes, dim) twice.
        no_move: by number of steps, impossible moves between cells: (cells, cells).
        no_turn: by number of steps, impossible triples of cells at equal intervals: (cells, cells, cells).
    """

    agents: tuple[int, ...]
    boxes: Boxes
    points: int
    left_out: Boxes
    no_move: Mapping[int, Flags]
    no_turn: Mapping[int, Flags]

    def __len__(self) -> int:
        return len(self.boxes[0])


class Label(Record, eq=False):
    """Cells in which a leaf of a formula never holds, and cells in which it always holds.

    Args:
        leaf: its text.
        of: kind of arrays: ``cells`` of one agent, (cells,), its ``moves``, or ``pairs`` of cells of two agents,
            (cells, cells).
    """

    leaf: str
    of: str
    agents: tuple[int, ...]
    never_true: Flags
    never_false: Flags


class ClaimedCover(Record, eq=False):
    """Cells of the complete space for each agent, with claims of impossible states and moves.

    Args:
        conflict: names of the requirements that no motion satisfies together.
        asked: the agents that the proof is about.
        apart: True if their bodies keep the separation.
        kinds: cells of each kind of agents.
        bodies: by the name of a combined shape from ``bodies.names``, boxes inside it, (boxes, dim) twice.
        absent: for each agent, impossible cells at each step: (steps + 1, cells).
        not_both: for some agents, pairs of cells that they cannot both visit: (cells, cells).
        at_most: boxes, corners (dim,) each, with the maximum number of agents in them.
        not_together: for some pairs of agents, impossible pairs of cells at one step: (cells, cells).
        labels: in the order of their use in the encoding.
    """

    conflict: tuple[str, ...]
    asked: tuple[int, ...]
    apart: bool
    kinds: tuple[CellsOfKind, ...]
    bodies: Mapping[str, Boxes]
    absent: Mapping[int, Flags]
    not_both: Mapping[int, Flags]
    at_most: tuple[tuple[Array, Array, int], ...]
    not_together: Mapping[tuple[int, int], Flags]
    labels: tuple[Label, ...]

    def kind_of(self, agent: int) -> CellsOfKind:
        return next(kind for kind in self.kinds if agent in kind.agents)

    @property
    def cells(self) -> int:
        return sum(map(len, self.kinds))


# --------------------------------------------------------------------- writing


def document(cover: ClaimedCover, mission: Mission) -> bytes:
    """Content of ``cover.json`` for a cover."""
    names = [agent.name for agent in mission.agents]
    content: dict[str, Json] = {
        "schema": COVER_SCHEMA,
        "mission": mission.name,
        "conflict": list(cover.conflict),
        "asked": [names[agent] for agent in cover.asked],
        "apart": cover.apart,
        "bodies": {name: _corners(boxes) for name, boxes in cover.bodies.items()},
        "kinds": [_kind(kind, names) for kind in cover.kinds],
        "absent": {names[agent]: _packed(flags) for agent, flags in cover.absent.items()},
        "not_both": {names[agent]: _packed(flags) for agent, flags in cover.not_both.items()},
        "at_most": [{"box": [low.tolist(), high.tolist()], "agents": most} for low, high, most in cover.at_most],
        "not_together": [
            {"agents": [names[agent] for agent in pair], "cells": _packed(flags)}
            for pair, flags in cover.not_together.items()
        ],
        "labels": [
            {
                "leaf": label.leaf,
                "of": label.of,
                "agents": [names[agent] for agent in label.agents],
                "never_true": _packed(label.never_true),
                "never_false": _packed(label.never_false),
            }
            for label in cover.labels
        ],
    }
    lines = (f"{json.dumps(key)}: {json.dumps(value, separators=(',', ':'))}" for key, value in content.items())
    return ("{\n" + ",\n".join(lines) + "\n}\n").encode()


def _kind(kind: CellsOfKind, names: Sequence[str]) -> Json:
    return {
        "agents": [names[agent] for agent in kind.agents],
        "cells": _corners(kind.boxes),
        "points": kind.points,
        "left_out": _corners(kind.left_out),
        "no_move": {str(steps): _packed(flags) for steps, flags in kind.no_move.items()},
        "no_turn": {str(steps): _packed(flags) for steps, flags in kind.no_turn.items()},
    }


def _corners(boxes: Boxes) -> Json:
    return [[low, high] for low, high in zip(boxes[0].tolist(), boxes[1].tolist(), strict=True)]


def _packed(flags: Flags) -> Json:
    """Indices of the set flags, as nested lists by row."""
    return np.flatnonzero(flags).tolist() if flags.ndim == 1 else [_packed(row) for row in flags]


# --------------------------------------------------------------------- reading


def read_cover(text: str, mission: Mission) -> ClaimedCover:
    """The cover that a ``cover.json`` text contains.

    Raises:
        Unreadable: it is not a cover of this mission.
    """
    try:
        found = parse_json(text)
    except NotJsonError as error:
        raise Unreadable(str(error)) from error
    try:
        return _Reader(mission).cover(found)
    except (KeyError, TypeError, ValueError, IndexError, OverflowError, AttributeError) as error:
        raise Unreadable(f"not a cover of this mission: {error}") from error


class _Reader:
    """Reader of untrusted JSON values; invalid values raise ``Unreadable`` or ``ValueError``."""

    def __init__(self, mission: Mission) -> None:
        self.mission, self.dimension, self.steps = mission, mission.dimension, mission.steps
        self.numbers = {agent.name: agent.index for agent in mission.agents}

    def cover(self, found: Json) -> ClaimedCover:
        if found["schema"] != COVER_SCHEMA or found["mission"] != self.mission.name:
            raise ValueError(f"its schema is not {COVER_SCHEMA}, or it belongs to another mission")
        kinds = tuple(self.kind(each) for each in found["kinds"])
        size = {agent: len(kind) for kind in kinds for agent in kind.agents}
        if sorted(agent for kind in kinds for agent in kind.agents) != list(range(len(self.mission.agents))):
            raise ValueError("not every agent is of one kind")
        rows, asked = self.steps + 1, self.agents(found["asked"])
        pairs = [self.pair(each["agents"]) for each in found["not_together"]]
        if not {agent for pair in pairs for agent in pair} <= set(asked):
            raise ValueError("an unexpected pair of agents")
        if len(found["at_most"]) > MOST_ROOMS or any(len(each) > MOST_ROOMS for each in found["bodies"].values()):
            raise ValueError("too many boxes")
        rooms = tuple(self.room(each) for each in found["at_most"])
        if any(comb(len(asked), most + 1) > MOST_CHOICES for *_, most in rooms):
            raise ValueError("too many choices of agents")
        return ClaimedCover(
            conflict=tuple(map(_text, found["conflict"])),
            asked=asked,
            apart=found["apart"] is True,
            kinds=kinds,
            bodies={_text(name): self.boxes(each) for name, each in found["bodies"].items()},
            absent=self.of_agents(found["absent"], lambda agent: (rows, size[agent])),
            not_both=self.of_agents(found["not_both"], lambda agent: (size[agent], size[agent])),
            at_most=rooms,
            not_together={
                pair: _flags(each["cells"], tuple(size[agent] for agent in pair))
                for pair, each in zip(pairs, found["not_together"], strict=True)
            },
            labels=tuple(self.label(each, kinds) for each in found["labels"]),
        )

    def kind(self, found: Json) -> CellsOfKind:
        agents, boxes, points = self.agents(found["agents"]), self.boxes(found["cells"]), found["points"]
        count = len(boxes[0])
        if not agents:
            raise ValueError("a kind without agents")
        if count > MOST_CELLS or (found["no_turn"] and count > MOST_THIRDS):
            raise ValueError("too many cells")
        if type(points) is not int or not 0 <= points <= count:
            raise ValueError("points that are not cells")
        return CellsOfKind(
            agents=agents,
            boxes=boxes,
            points=points,
            left_out=self.boxes(found["left_out"]),
            no_move={self.number(steps): _flags(each, (count,) * 2) for steps, each in found["no_move"].items()},
            no_turn={self.number(steps): _flags(each, (count,) * 3) for steps, each in found["no_turn"].items()},
        )

    def label(self, found: Json, kinds: tuple[CellsOfKind, ...]) -> Label:
        agents = self.agents(found["agents"])
        sizes = [len(kind) for agent in agents for kind in kinds if agent in kind.agents]
        shape = {"cells": sizes[:1], "moves": sizes[:1] * 2, "pairs": sizes[:2]}[found["of"]]
        if len(agents) != (2 if found["of"] == "pairs" else 1):
            raise ValueError("a label with the wrong agents")
        never = (_flags(found[name], tuple(shape)) for name in ("never_true", "never_false"))
        return Label(_text(found["leaf"]), found["of"], agents, *never)

    def agents(self, found: Json) -> tuple[int, ...]:
        agents = tuple(self.numbers[name] for name in found)
        if len(set(agents)) < len(agents):
            raise ValueError("an agent twice")
        return agents

    def pair(self, found: Json) -> tuple[int, int]:
        first, second = self.agents(found)
        return first, second

    def of_agents(self, found: Json, shape: Callable[[int], tuple[int, ...]]) -> dict[int, Flags]:
        return {self.numbers[name]: _flags(each, shape(self.numbers[name])) for name, each in found.items()}

    def number(self, found: str) -> int:
        number = int(found)
        if not 0 < number <= self.steps or str(number) != found:
            raise ValueError("more steps than the mission has")
        return number

    def room(self, found: Json) -> tuple[Array, Array, int]:
        low, high = self.boxes([found["box"]])
        if type(found["agents"]) is not int or found["agents"] < 0:
            raise ValueError("an invalid number of agents")
        return low[0], high[0], found["agents"]

    def boxes(self, found: Json) -> Boxes:
        if len(found) > MOST_BOXES:
            raise ValueError("too many boxes")
        corners = np.array(found, dtype=np.float64).reshape(len(found), 2, self.dimension)
        if not ((np.abs(corners) <= FURTHEST).all() and (corners[:, 0] <= corners[:, 1]).all()):
            raise ValueError("an empty box, or a box outside the world")
        return corners[:, 0], corners[:, 1]


def _text(found: Json) -> str:
    if not isinstance(found, str):
        raise TypeError("an entry that is not a text")
    return found


def _flags(found: Json, shape: tuple[int, ...]) -> Flags:
    """Boolean array of the given shape, from the indices of the set flags in each row."""
    flags: Flags = np.zeros(shape, dtype=np.bool_)
    if len(shape) == 1:
        numbers = np.array(found, dtype=object)
        if any(type(each) is not int or not 0 <= each < shape[0] for each in numbers):
            raise ValueError("an unknown cell")
        flags[numbers.astype(np.int64)] = True
        return flags
    if len(found) != shape[0]:
        raise ValueError("rows for unknown cells")
    for row, each in enumerate(found):
        flags[row] = _flags(each, shape[1:])
    return flags

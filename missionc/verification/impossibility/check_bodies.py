"""Checks of two claims of an impossibility certificate: boxes that cannot contain several bodies, and leaf labels.

    in   Mission, ClaimedCover
    out  Labels; descriptions of the unproved claims

A label is checked when the encoding requests it.

Source:
    Oler, "A finite packing problem", 1961; and Dirichlet's principle, for a box cut into parts too small for two.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Iterator
from itertools import combinations, product

import numpy as np

from missionc.base.trace import Array, Flags
from missionc.ir import BeaconCover, Box, Graph, Mission, Predicate, Proximity, Sight
from missionc.ir.couplings import range_of
from missionc.verification.certificate import MOTION
from missionc.verification.impossibility.bodies import boxes_in, lies_in, name_in_graph, name_of_obstacle, parts
from missionc.verification.impossibility.check_motion import inflated
from missionc.verification.impossibility.cover_document import ClaimedCover, Label, Unreadable
from missionc.verification.impossibility.encode_formulas import Never
from missionc.verification.impossibility.intervals import (
    Boxes,
    Interval,
    IntervalView,
    between,
    exactly,
    greater,
    length,
    less,
    must_be_apart,
    pairwise,
)

CERTAIN = 1e-9
"""Rounding tolerance of margins, metres or m/s: a margin this near to 0 may have either sign."""

ROUNDED = 1e-14
"""Rounding error of computed values, as a fraction of the largest coordinate."""

INSIDE = 4e-6
"""Depth inside a body, metres, from which it surely blocks a line of sight."""


class CheckedLabels:
    """Labels of formula leaves from a certificate, checked in the order of their use.

    ``faults`` lists the unproved labels.
    """

    def __init__(self, mission: Mission, cover: ClaimedCover) -> None:
        self.mission, self.cover = mission, cover
        self.faults: list[str] = []
        self._known: dict[Hashable, Never] = {}
        self._left: Iterator[Label] = iter(cover.labels)
        self._certain = max(CERTAIN, ROUNDED * max(map(abs, (*mission.world.low, *mission.world.high))))

    def own(self, predicate: Predicate, agent: int) -> Never:
        kind = self.cover.kind_of(agent)

        def margin() -> Interval:
            view = IntervalView(self.mission, {agent: inflated(kind)})
            return exactly(predicate.margin(view))

        return self._checked((predicate, kind), "cells", (agent,), margin)

    def moves(self, predicate: Predicate, agent: int) -> Never:
        kind = self.cover.kind_of(agent)

        def margin() -> Interval:
            boxes = inflated(kind)
            here, there = pairwise(boxes, boxes)
            way = length(between(here, there)) + Interval(np.array(-2 * MOTION), np.array(2 * MOTION))
            speed = way / self.mission.step
            return exactly(predicate.margin(IntervalView(self.mission, {agent: here}, speed)))

        return self._checked((predicate, kind, "moves"), "moves", (agent,), margin)

    def pair(self, predicate: Predicate, first: int, second: int) -> Never:
        def margin() -> Interval:
            here, there = self._pairwise(first, second)
            return exactly(predicate.margin(IntervalView(self.mission, {first: here, second: there})))

        return self._checked((predicate, first, second), "pairs", (first, second), margin)

    def link(self, graph: Graph, sender: int, receiver: int) -> Never:
        kinds = self.cover.kind_of(sender), self.cover.kind_of(receiver)
        reach = float(graph.radius) if isinstance(graph, BeaconCover) else float(range_of(graph, sender, receiver))
        key = graph, kinds, reach
        return self._checked(key, "pairs", (sender, receiver), lambda: self._link_margin(graph, sender, receiver))

    def _checked(self, key: Hashable, of: str, agents: tuple[int, ...], margin: Callable[[], Interval]) -> Never:
        if key not in self._known:
            label = next(self._left, None)
            if label is None or label.of != of or label.agents != agents:
                raise Unreadable("its labels do not match the requirements")
            measured = margin()
            shape = label.never_true.shape
            may_hold = np.broadcast_to(measured.high >= -self._certain, shape)
            may_fail = np.broadcast_to(measured.low <= self._certain, shape)
            for wrong, word in ((label.never_true & may_hold, "hold"), (label.never_false & may_fail, "fail")):
                for cells in np.argwhere(wrong)[:1].tolist():
                    self.faults.append(f"`{label.leaf}` may {word} in {_cells(cells)}")
            self._known[key] = label.never_true, label.never_false
        return self._known[key]

    def _pairwise(self, first: int, second: int) -> tuple[Boxes, Boxes]:
        return pairwise(inflated(self.cover.kind_of(first)), inflated(self.cover.kind_of(second)))

    # --------------------------------------------------------------- links

    def _link_margin(self, graph: Graph, sender: int, receiver: int) -> Interval:
        """Interval of a link's margin over the agents' cells.

        At most ``-inf`` if the two agents never see each other.
        """
        here, there = self._pairwise(sender, receiver)
        match graph:
            case Proximity():
                return float(range_of(graph, sender, receiver)) - self._apart(sender, receiver, here, there)
            case Sight():
                margin = float(range_of(graph, sender, receiver)) - self._apart(sender, receiver, here, there)
                blind = self._hidden(graph, here, there)
                nothing = np.full(blind.shape, -np.inf)  # it may be hidden anywhere
                return Interval(nothing, np.where(blind, -np.inf, margin.high))
            case BeaconCover(beacons=beacons):
                both = []
                for beacon in beacons:
                    at = np.array(beacon)
                    near = [float(graph.radius) - length(between((at, at), boxes)) for boxes in (here, there)]
                    both.append(less(*near))
                margin = both[0]
                for each in both[1:]:
                    margin = greater(margin, each)
                return margin

    def _apart(self, sender: int, receiver: int, here: Boxes, there: Boxes) -> Interval:
        return greater(length(between(here, there)), must_be_apart(self.mission, sender, receiver))

    def _hidden(self, graph: Sight, here: Boxes, there: Boxes) -> Flags:
        """Flags of pairs of boxes between which every line crosses a blocking box: (one, other).

        The crossing point with an axis-aligned plane is monotone in each coordinate of the ends, so the corners of the
        boxes suffice.
        """
        shape = np.broadcast_shapes(here[0].shape[:-1], there[0].shape[:-1])
        hidden: Flags = np.zeros(shape, dtype=np.bool_)
        for number, whole in enumerate(graph.shapes):
            plain = [part for part in parts(whole) if isinstance(part, Box)]
            for body in (*plain, *boxes_in(name_in_graph(graph, number), self.cover)):
                for axis, (low, high) in enumerate(zip(body.low, body.high, strict=True)):
                    for at in (low + 2 * INSIDE, (low + high) / 2, high - 2 * INSIDE):
                        if not low + INSIDE <= at <= high - INSIDE:
                            continue
                        for one, other in ((here, there), (there, here)):
                            hidden |= _crosses_within(body, axis, at, one, other)
        return hidden


def _crosses_within(body: Box, axis: int, at: float, one: Boxes, other: Boxes) -> Flags:
    """Flags of box pairs on opposite sides of a plane between which every line crosses the plane inside a body.

    Args:
        at: coordinate of the plane along ``axis``, metres.
    """
    result = np.asarray((one[1][..., axis] < at - INSIDE) & (other[0][..., axis] > at + INSIDE))
    if not result.any():
        return result
    dimension, largest = len(body.low), max(float(np.abs(corner).max()) for corner in (*one, *other))
    with np.errstate(divide="ignore", invalid="ignore"):
        for begin, end in product(product((0, 1), repeat=dimension), repeat=2):
            first = [one[side][..., number] for number, side in enumerate(begin)]
            last = [other[side][..., number] for number, side in enumerate(end)]
            way = last[axis] - first[axis]
            share = (at - first[axis]) / way
            for across in range(dimension):
                if across != axis:
                    aside = last[across] - first[across]
                    off = INSIDE + ROUNDED * largest * (1 + np.abs(aside / way))
                    point: Array = first[across] + share * aside
                    result = result & (point > body.low[across] + off) & (point < body.high[across] - off)
    return result


def _cells(cells: list[int]) -> str:
    return f"cell {cells[0]}" if len(cells) == 1 else f"cells {cells[0]} and {cells[1]}"


MOST_PARTS = 12
"""Maximum number of parts into which a box is cut along each axis."""


def check_boxes(mission: Mission, cover: ClaimedCover) -> Iterator[str]:
    """Yield a message for each claimed inner box of a shape that does not lie in the shape."""
    shapes = {name_of_obstacle(number): each.shape for number, each in enumerate(mission.obstacles)}
    for graph in mission.graphs:
        if isinstance(graph, Sight):
            shapes.update((name_in_graph(graph, number), shape) for number, shape in enumerate(graph.shapes))
    for name in cover.bodies:
        if name not in shapes:
            yield f"the mission has no {name}"
        elif not all(lies_in(box, shapes[name]) for box in boxes_in(name, cover)):
            yield f"a box is not inside {name} as stated"


def check_rooms(mission: Mission, cover: ClaimedCover) -> Iterator[str]:
    """Yield a message for each box that may contain more agents than claimed."""
    pairs = [must_be_apart(mission, one, other) for one, other in combinations(cover.asked, 2)]
    for low, high, most in cover.at_most:
        if not pairs or most < fits([float(side) + 2 * MOTION for side in high - low], min(pairs)):
            yield f"more than {most} agents may be in a box of {' by '.join(f'{side:.4g}' for side in high - low)} m"


def fits(sides: list[float], apart: float) -> float:
    """Upper bound on the number of points with pairwise distance ``apart`` in a box with these sides, all in metres."""
    if apart <= 0:
        return math.inf
    widest = apart / math.sqrt(len(sides))
    most = math.prod(math.floor(side / widest) + 1 for side in sides)
    for counts in product(range(1, MOST_PARTS + 1), repeat=len(sides)):
        if math.hypot(*(side / count for side, count in zip(sides, counts, strict=True))) < apart:
            most = min(most, math.prod(counts))
    if len(sides) == 2:
        area, half_round = math.prod(sides) / apart**2, sum(sides) / apart
        most = min(most, math.floor(2 / math.sqrt(3) * area + half_round + 1 + 1e-9))
    return most


def check_pairs(mission: Mission, cover: ClaimedCover, agents: tuple[int, int]) -> Iterator[str]:
    """Yield a message for each pair of cells that is claimed impossible for two agents without proof.

    Proofs are too little distance in the cells, or no path to them. The remaining pairs of cells must contain every
    start, and no move may lead from one of them to an excluded pair in which both agents fit.
    """
    never = cover.not_together[agents]
    first, second = (inflated(cover.kind_of(agent)) for agent in agents)
    distance = length(between(*pairwise(first, second)))
    room = distance.high >= must_be_apart(mission, *agents)
    left = ~never
    touch = [_touching(boxes) for boxes in (first, second)]
    beside = (touch[0] @ left.astype(np.float32) > 0) | (left.astype(np.float32) @ touch[1] > 0)
    begins = _starts(mission, cover, agents[0])[:, None] & _starts(mission, cover, agents[1])[None, :]
    for one, other in np.argwhere(never & room & (beside | begins))[:1].tolist():
        names = [mission.agents[agent].name for agent in agents]
        yield f"{names[0]} may be in cell {one} while {names[1]} is in cell {other}"


def _touching(boxes: Boxes) -> Array:
    low, high = boxes
    meet = (low[:, None] <= high[None]) & (low[None] <= high[:, None])
    return np.asarray(np.all(meet, axis=2), dtype=np.float32)


def _starts(mission: Mission, cover: ClaimedCover, agent: int) -> Flags:
    """Flags of an agent's possible cells at its first step, (cells,); an exact start stands for the cells around it."""
    return np.asarray(~cover.absent[agent][0])

"""Bodies and labels of a certificate: what is blocked, what lies in a shape, how many fit, what holds where."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from missionc import ir
from missionc.base.trace import Flags
from missionc.base.units import Metres, Seconds
from missionc.ir import Ball, Box, Difference, Disc, Intersection, Shape, Union
from missionc.ir.predicates import Compare, Coordinate, DistanceTo, Inside, Speed
from missionc.verification.impossibility import bodies as module
from missionc.verification.impossibility.bodies import blocked, boxes_in, lies_in, parts
from missionc.verification.impossibility.check_bodies import CheckedLabels, check_boxes, check_pairs, check_rooms, fits
from missionc.verification.impossibility.cover_document import CellsOfKind, Label, Unreadable
from missionc.verification.impossibility.intervals import Boxes
from tests.support.random_runs import SPAN
from tests.unit.verification.test_check_motion import absent, boxes, cells, corridor, cover, pairs

WALL = Box((2.0, -1.0), (3.0, 2.0))
PILLAR = Disc((2.5, 0.5), 0.5)


def standing(shape: Shape, **more: object) -> ir.Mission:
    obstacle = ir.Obstacle("wall", shape, ir.Still(), SPAN)
    return corridor(obstacles=(replace(obstacle, **more),))  # type: ignore[arg-type]


# ------------------------------------------------------------------- bodies


def test_a_shape_is_the_union_of_its_parts() -> None:
    cut = Difference(WALL, PILLAR)
    assert list(parts(Union(Union(WALL, PILLAR), cut))) == [WALL, PILLAR, cut]
    assert list(parts(cut)) == [cut]


def test_no_centre_is_clear_where_all_of_a_box_is_nearer_than_a_body_may_be() -> None:
    """A quarter of a metre round the wall, less what is let pass."""
    asked = boxes((1.8, 0.2, 2.2, 0.8), (1.75, 0.2, 2.2, 0.8), (1.7, 0.2, 2.2, 0.8), (3.1, 0, 3.2, 1))
    mission, claimed = standing(WALL), cover(cells())
    assert blocked(mission, claimed, 0, 0.25, 0, asked).tolist() == [True, False, False, True]
    assert blocked(mission, claimed, 0, 0.35, 0, asked).tolist() == [True] * 4
    assert blocked(replace(mission, clearance=Metres(0.1)), claimed, 0, 0.25, 0, asked).tolist() == [True] * 4


def test_what_moves_or_grows_stands_where_it_is_then() -> None:
    asked = boxes((2.1, 0.2, 2.9, 0.8), (3.1, 0.2, 3.9, 0.8))
    path = ir.Path((Seconds(0.0), Seconds(1.0)), ((0.0, 0.0), (1.0, 0.0)))
    moving = standing(WALL, motion=path)
    assert blocked(moving, cover(cells()), 0, 0.0, 0, asked).tolist() == [True, False]
    assert blocked(moving, cover(cells()), 0, 0.0, 2, asked).tolist() == [False, True]
    growing = standing(WALL, growth=1.0)
    assert [blocked(growing, cover(cells()), 0, 0.0, step, asked).tolist() for step in (1, 2)] == [
        [True, False],
        [True, True],
    ]


def test_what_is_no_plain_shape_stands_itself_and_the_boxes_in_it_reach_further() -> None:
    asked = boxes((2.1, 0.2, 2.9, 0.8), (1.8, 0.2, 1.9, 0.8))
    cut = standing(Difference(WALL, Box((2.0, 1.5), (3.0, 2.0))))
    claimed = cover(cells())
    assert blocked(cut, claimed, 0, 0.25, 0, asked).tolist() == [True, False]
    inside = replace(claimed, bodies={"obstacle 0": boxes((2, 0, 3, 1))})
    assert blocked(cut, inside, 0, 0.25, 0, asked).tolist() == [True, True]
    assert boxes_in("obstacle 0", inside) == [Box((2.0, 0.0), (3.0, 1.0))]
    assert boxes_in("obstacle 1", inside) == []
    both = standing(Union(WALL, Box((0.0, 0.0), (0.5, 1.0))))
    assert blocked(
        both, claimed, 0, 0.25, 0, boxes((0.1, 0.1, 0.6, 0.9), (2.1, 0, 3.1, 1), (1, 0, 1.5, 1))
    ).tolist() == [
        True,
        True,
        False,
    ]


def test_a_box_lies_in_a_shape_but_for_what_is_let_pass_along_its_faces() -> None:
    inner = Box((2.0, 0.0), (3.0, 1.0))
    assert lies_in(inner, WALL)
    assert lies_in(Box((2.0 - 5e-7, 0.0), (3.0, 1.0)), WALL)
    assert not lies_in(Box((2.0 - 5e-6, 0.0), (3.0, 1.0)), WALL)
    assert not lies_in(Box((2.0, 0.0), (2.0, 1.0)), WALL)
    assert not lies_in(Box((4.0, 0.0), (5.0, 1.0)), WALL)
    # Across two parts, each of which holds a half.
    halves = Union(Box((2.0, 0.0), (2.6, 1.0)), Box((2.4, 0.0), (3.0, 1.0)))
    assert lies_in(inner, halves)
    assert not lies_in(inner, Union(Box((2.0, 0.0), (2.5, 1.0)), Box((2.6, 0.0), (3.0, 1.0))))
    assert lies_in(Box((2.2, 0.2), (2.8, 0.8)), PILLAR)
    assert not lies_in(Box((2.1, 0.1), (2.9, 0.9)), PILLAR)


def test_a_box_is_halved_so_often_and_no_more(monkeypatch: pytest.MonkeyPatch) -> None:
    halves = Union(Box((2.0, 0.0), (2.6, 1.0)), Box((2.4, 0.0), (3.0, 1.0)))
    inner = Box((2.0, 0.25), (3.0, 0.75))
    monkeypatch.setattr(module, "DEEP", 0)
    assert not lies_in(inner, halves)
    monkeypatch.setattr(module, "DEEP", 1)
    assert lies_in(inner, halves)


def test_boxes_are_those_of_a_shape_that_the_mission_has() -> None:
    mission = standing(Difference(WALL, PILLAR))
    eyes = ir.Sight("eyes", Metres(9.0), (WALL, Intersection(WALL, PILLAR)), (0,), SPAN)
    mission = replace(mission, graphs=(eyes,))

    def faults(**claimed: Boxes) -> list[str]:
        return list(
            check_boxes(mission, replace(cover(cells()), bodies={k.replace("_", " "): v for k, v in claimed.items()}))
        )

    assert faults(obstacle_0=boxes((2, -1, 3, -0.1), (2, 1.1, 3, 2))) == []
    assert faults(obstacle_0=boxes((2, -1, 3, -0.1), (2, 0, 3, 2))) == ["a box is not inside obstacle 0 as stated"]
    assert faults(graph_eyes_1=boxes((2.3, 0.3, 2.7, 0.7))) == []
    assert faults(graph_eyes_1=boxes((2, 0, 3, 1))) == ["a box is not inside graph eyes 1 as stated"]
    assert faults(obstacle_1=boxes()) == ["the mission has no obstacle 1"]


# -------------------------------------------------------------------- rooms


@pytest.mark.parametrize(
    ("sides", "apart", "most"),
    [
        ([0.5, 0.5], 1.0, 1),
        ([1.0, 0.5], 1.0, 2),
        ([1.0, 1.0], 1.0, 4),
        ([0.9, 0.1], 1.0, 1),
        # In a row along a long side.
        ([10.0, 0.1], 1.0, 11),
        ([3.0], 1.0, 4),
        ([2.9], 1.0, 3),
        # Oler: 2 / sqrt(3) of the area and half the way round, in distances.
        ([4.0, 4.0], 1.0, math.floor(2 / math.sqrt(3) * 16 + 8 + 1)),
        ([0.5, 0.5, 0.5], 1.0, 1),
        ([1.0, 1.0, 1.0], 1.0, 8),
        ([2.0, 1.0], 2.0, 2),
    ],
)
def test_so_many_fit_into_a_box(sides: list[float], apart: float, most: int) -> None:
    assert fits(sides, apart) == most


def test_anything_fits_of_what_need_not_be_apart() -> None:
    assert fits([1.0, 1.0], 0.0) == math.inf
    assert fits([1.0, 1.0], -1.0) == math.inf


def test_rooms_have_no_more_than_fit() -> None:
    """Bodies of a quarter of a metre, and half a metre between: a metre from centre to centre."""
    mission = corridor(agents=3, separation=Metres(0.5))
    kind = cells(agents=(0, 1, 2))

    def faults(high: float, most: int, asked: tuple[int, ...] = (0, 1, 2)) -> list[str]:
        room = np.array([0.0, 0.0]), np.array([high, 0.25]), most
        return list(check_rooms(mission, replace(cover(kind), at_most=(room,), asked=asked)))

    assert faults(0.9, 1) == []
    assert faults(1.1, 1) == ["more than 1 agents may be in a box of 1.1 by 0.25 m"]
    assert faults(1.1, 2) == []
    assert faults(0.9, 1, asked=(0,)) == ["more than 1 agents may be in a box of 0.9 by 0.25 m"]
    small = replace(mission.agents[2], radius=Metres(0.05))
    mission = replace(mission, agents=(*mission.agents[:2], small))
    # The two who may be nearest to each other count.
    assert faults(0.9, 1) == ["more than 1 agents may be in a box of 0.9 by 0.25 m"]
    assert faults(0.9, 1, asked=(0, 1)) == []


def test_two_are_never_together_where_there_is_no_room_or_no_way_there() -> None:
    """Centres are a metre and a half apart at least: further than the middle cell is wide, from corner to corner."""
    row = boxes((0, 0, 0.5, 1), (0.5, 0, 1.5, 1), (1.5, 0, 4, 1))
    mission = corridor(agents=2, separation=Metres(1.0))
    kind = cells(row, agents=(0, 1))
    starts = {0: absent({0: [1, 2]}, 3), 1: absent({0: [0, 1]}, 3)}

    def faults(*never: tuple[int, int]) -> list[str]:
        claimed = replace(cover(kind), absent=starts, not_together={(0, 1): pairs(3, *never)})
        return list(check_pairs(mission, claimed, (0, 1)))

    assert faults((0, 0)) == []
    assert faults((0, 2)) == ["drone[0] may be in cell 0 while drone[1] is in cell 2"]
    assert faults((1, 1)) == []
    assert faults((0, 1)) == ["drone[0] may be in cell 0 while drone[1] is in cell 1"]


def test_who_has_no_way_past_the_other_never_gets_behind_it() -> None:
    """In cells of half a metre two that keep a metre and a half never change places."""
    row = boxes(*((x / 2, 0, x / 2 + 0.5, 0.5) for x in range(4)))
    mission = corridor(agents=2, separation=Metres(1.0))
    kind = cells(row, agents=(0, 1))
    starts = {0: absent({0: [1, 2, 3]}), 1: absent({0: [0, 1, 2]})}
    behind = [(one, other) for one in range(4) for other in range(4) if one >= other]
    near = [(0, 1), (1, 2), (2, 3)]

    def faults(never: list[tuple[int, int]]) -> list[str]:
        claimed = replace(cover(kind), absent=starts, not_together={(0, 1): pairs(4, *never)})
        return list(check_pairs(mission, claimed, (0, 1)))

    assert faults([*behind, *near]) == []
    # Who is left out must be left out with all beside it.
    assert faults([(3, 0)]) == ["drone[0] may be in cell 3 while drone[1] is in cell 0"]


# ------------------------------------------------------------------- labels


def labels(*claimed: Label, mission: ir.Mission | None = None, kind: CellsOfKind | None = None) -> CheckedLabels:
    kind = kind or cells(agents=(0, 1))
    return CheckedLabels(mission or corridor(agents=2), replace(cover(kind), labels=claimed))


def label(of: str, agents: tuple[int, ...], never_true: Flags, never_false: Flags) -> Label:
    return Label("it", of, agents, never_true, never_false)


EAST = Compare(((1.0, Coordinate(0)),), -1.5, False)


def test_a_leaf_of_one_agent_holds_or_fails_by_its_cell() -> None:
    """x is at least 1.5: nowhere in the first cell, perhaps in the second, everywhere in the others."""
    none = np.zeros(4, dtype=np.bool_)
    right = label("cells", (0,), pairs(4, (0,)), pairs(4, (2,), (3,)))
    checked = labels(right)
    assert checked.own(EAST, 0) == (right.never_true, right.never_false)
    # Of the same kind it is asked once.
    assert checked.own(EAST, 1) == (right.never_true, right.never_false)
    assert checked.faults == []
    for claim, said in (
        (label("cells", (0,), pairs(4, (0,), (1,)), none), "`it` may hold in cell 1"),
        (label("cells", (0,), none, pairs(4, (1,))), "`it` may fail in cell 1"),
    ):
        wrong = labels(claim)
        wrong.own(EAST, 0)
        assert wrong.faults == [said]
    both = labels(label("cells", (0,), pairs(4, (2,)), pairs(4, (0,))))
    both.own(EAST, 0)
    assert both.faults == ["`it` may hold in cell 2", "`it` may fail in cell 0"]


def test_labels_are_those_that_are_asked_for_in_their_order() -> None:
    right = label("cells", (0,), np.zeros(4, dtype=np.bool_), np.zeros(4, dtype=np.bool_))
    for checked, agent in ((labels(), 0), (labels(right), 1), (labels(replace(right, of="moves")), 0)):
        with pytest.raises(Unreadable, match=r"^its labels do not match the requirements$"):
            checked.own(EAST, agent)
    two = labels(right, right)
    two.own(EAST, 0)
    two.own(Inside(ir.Region("r", WALL, SPAN), False), 0)
    with pytest.raises(Unreadable):
        two.own(Compare(((1.0, Coordinate(1)),), 0.0, False), 0)


def test_a_speed_is_that_of_the_way_from_cell_to_cell() -> None:
    """In half a second: from 0 m to 2 m to the next cell; from 1 m to 3 m to the next but one, which is 2 to 6 m/s."""
    fast = Compare(((1.0, Speed()),), -2.0, False)
    slow = Compare(((-1.0, Speed()),), 2.0, False)

    def faults(predicate: Compare, claim: Label) -> list[str]:
        checked = labels(claim)
        checked.moves(predicate, 0)
        return checked.faults

    none = np.zeros((4, 4), dtype=np.bool_)
    assert faults(fast, label("moves", (0,), none, pairs(4, (0, 3), (3, 0)))) == []
    assert faults(fast, label("moves", (0,), none, pairs(4, (0, 1)))) == ["`it` may fail in cells 0 and 1"]
    assert faults(fast, label("moves", (0,), pairs(4, (2, 2)), none)) == ["`it` may hold in cells 2 and 2"]
    assert faults(slow, label("moves", (0,), pairs(4, (0, 3)), none)) == []
    assert faults(slow, label("moves", (0,), pairs(4, (0, 1)), none)) == ["`it` may hold in cells 0 and 1"]


def test_a_leaf_of_two_holds_or_fails_by_both_their_cells() -> None:
    near = Compare(((-1.0, DistanceTo(1)),), 1.5, False)
    none = np.zeros((4, 4), dtype=np.bool_)

    def faults(claim: Label) -> list[str]:
        checked = labels(claim)
        checked.pair(near, 0, 1)
        return checked.faults

    # Two cells between are two metres; in one cell the diagonal is less than a metre and a half.
    assert faults(label("pairs", (0, 1), pairs(4, (0, 3), (3, 0)), pairs(4, (1, 1)))) == []
    assert faults(label("pairs", (0, 1), pairs(4, (0, 2)), none)) == ["`it` may hold in cells 0 and 2"]
    assert faults(label("pairs", (0, 1), none, pairs(4, (0, 1)))) == ["`it` may fail in cells 0 and 1"]


def test_a_link_holds_or_fails_by_both_their_cells() -> None:
    radio = ir.Proximity("radio", Metres(1.5), (0, 1), SPAN)
    far = ir.PairRange(frozenset((0,)), frozenset((1,)), Metres(2.5))
    cell = ir.BeaconCover("cell", Metres(1.5), ((0.5, 0.5),), (0, 1), SPAN)
    none = np.zeros((4, 4), dtype=np.bool_)

    def faults(
        graph: ir.Graph, never_true: Flags, never_false: Flags = none, both: tuple[int, int] = (0, 1)
    ) -> list[str]:
        checked = labels(label("pairs", both, never_true, never_false))
        checked.link(graph, *both)
        return checked.faults

    assert faults(radio, pairs(4, (0, 3)), pairs(4, (1, 1))) == []
    assert faults(radio, pairs(4, (0, 2))) == ["`it` may hold in cells 0 and 2"]
    uneven = replace(radio, ranges=(far,))
    assert faults(uneven, pairs(4, (0, 3))) == ["`it` may hold in cells 0 and 3"]
    assert faults(uneven, pairs(4, (0, 3)), both=(1, 0)) == []
    # Both have to be near the beacon: in the first cell surely, in the third from 1.5 m on not.
    assert faults(cell, pairs(4, (0, 3), (3, 0), (3, 3)), pairs(4, (0, 0))) == []
    assert faults(cell, pairs(4, (1, 1))) == ["`it` may hold in cells 1 and 1"]
    assert faults(cell, none, pairs(4, (0, 1))) == ["`it` may fail in cells 0 and 1"]
    two = replace(cell, beacons=((0.5, 0.5), (3.5, 0.5)))
    assert faults(two, pairs(4, (3, 0)), pairs(4, (3, 3))) == []
    assert faults(two, pairs(4, (3, 3))) == ["`it` may hold in cells 3 and 3"]


def test_a_sight_is_hidden_by_what_every_line_goes_through() -> None:
    none = np.zeros((4, 4), dtype=np.bool_)
    wall = Box((1.5, -1.0), (1.75, 2.0))

    def faults(shape: Shape, *never: tuple[int, int], **bodies: Boxes) -> list[str]:
        eyes = ir.Sight("eyes", Metres(9.0), (shape,), (0, 1), SPAN)
        checked = labels(label("pairs", (0, 1), pairs(4, *never), none))
        checked.cover = replace(checked.cover, bodies={name.replace("_", " "): each for name, each in bodies.items()})
        checked.link(eyes, 0, 1)
        return checked.faults

    assert faults(wall, (0, 2), (2, 0), (0, 3)) == []
    assert faults(wall, (2, 3)) == ["`it` may hold in cells 2 and 3"]
    assert faults(wall, (1, 2)) == ["`it` may hold in cells 1 and 2"]
    low = Box((1.5, -1.0), (1.75, 0.75))
    assert faults(low, (0, 2)) == ["`it` may hold in cells 0 and 2"]
    # Parts of a union hide each by itself; what is cut by its boxes in the certificate.
    assert faults(Union(low, wall), (0, 2)) == []
    cut = Difference(wall, Ball((9.0, 9.0), 1.0))
    assert faults(cut, (0, 2)) == ["`it` may hold in cells 0 and 2"]
    assert faults(cut, (0, 2), graph_eyes_0=boxes((1.5, -1, 1.75, 2))) == []
    # A wall has to reach beyond the cells by a little.
    for low_end, high_end, hides in ((-6e-6, 1 + 6e-6, True), (-2e-6, 2.0, False), (-1.0, 1 + 2e-6, False)):
        assert (faults(Box((1.5, low_end), (1.75, high_end)), (0, 2)) == []) is hides
    # What stands behind both hides nothing, however far their line leads on.
    behind = cells(boxes((0, 0, 0.1, 0.1), (0.5, 0, 0.6, 0.1), (3.5, 0, 3.6, 0.1)), agents=(0, 1))
    tall = ir.Sight("eyes", Metres(9.0), (Box((1.5, -9.0), (1.75, 9.0)),), (0, 1), SPAN)
    for never, said in (
        ((0, 1), ["`it` may hold in cells 0 and 1"]),
        ((1, 0), ["`it` may hold in cells 1 and 0"]),
        ((0, 2), []),
    ):
        checked = labels(label("pairs", (0, 1), pairs(3, never), np.zeros((3, 3), dtype=np.bool_)), kind=behind)
        checked.link(tall, 0, 1)
        assert checked.faults == said
    # Too thin a wall is not looked at.
    assert faults(Box((1.5, -1.0), (1.5 + 1e-6, 2.0)), (0, 2)) == ["`it` may hold in cells 0 and 2"]

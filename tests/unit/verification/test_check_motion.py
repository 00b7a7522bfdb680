"""Bounds on motion that a certificate is held against, and what is refused of one, on cells of a few metres."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from missionc import ir
from missionc.base.trace import Flags
from missionc.base.units import Metres, Seconds, Steps
from missionc.ir.kernel.nodes import Always, At, Atom, Goal, Node
from missionc.ir.predicates import Compare, Level, Speed
from missionc.verification.impossibility import check_motion
from missionc.verification.impossibility.check_motion import (
    MotionLimits,
    check_absent,
    check_moves,
    check_space,
    check_turns,
    check_visits,
    gone,
    inflated,
    limits_of,
    reached,
)
from missionc.verification.impossibility.cover_document import CellsOfKind, ClaimedCover, Unreadable
from missionc.verification.impossibility.intervals import Boxes
from tests.support.random_runs import SPAN, mission_of

TINY = 1e-6
"""What verification of a plan lets pass of a place, a speed or an acceleration."""

WALKER = ir.SingleIntegrator(2.0)
FREE = MotionLimits(WALKER, math.inf)


def corridor(steps: int = 4, agents: int = 1, **changes: object) -> ir.Mission:
    """From 0 to 4 m, a metre wide, in steps of half a second; everybody starts at its lower left end."""
    mission = mission_of(agents, steps)
    mission = replace(
        mission,
        step=Seconds(0.5),
        steps=Steps(steps),
        world=ir.World((0.0, 0.0), (4.0, 1.0), SPAN),
        agents=tuple(replace(each, dynamics=WALKER, radius=Metres(0.25)) for each in mission.agents),
    )
    return replace(mission, **changes)  # type: ignore[arg-type]


def boxes(*corners: tuple[float, float, float, float]) -> Boxes:
    found = np.array(corners, dtype=np.float64).reshape(-1, 4)
    return found[:, :2], found[:, 2:]


FOUR = boxes(*((x, 0.0, x + 1, 1.0) for x in range(4)))


def cells(corners: Boxes = FOUR, points: int = 0, **changes: object) -> CellsOfKind:
    kind = CellsOfKind((0,), corners, points, boxes(), {}, {})
    return replace(kind, **changes)  # type: ignore[arg-type]


def cover(kind: CellsOfKind, absent: Flags | None = None, **changes: object) -> ClaimedCover:
    where = {agent: np.zeros((5, len(kind)), dtype=np.bool_) if absent is None else absent for agent in kind.agents}
    claimed = ClaimedCover((), kind.agents, True, (kind,), {}, where, {}, (), {}, ())
    return replace(claimed, **changes)  # type: ignore[arg-type]


# ------------------------------------------------------------------- limits


def test_nobody_gets_further_than_its_top_speed_and_what_is_let_pass() -> None:
    assert reached(WALKER, 0.5, 4) == pytest.approx((2 + TINY) * 2 + 7 * TINY, rel=1e-12)
    assert reached(WALKER, 0.5, 0) == pytest.approx(3 * TINY, rel=1e-12)


def test_who_cannot_wait_gets_at_least_so_far() -> None:
    plane = ir.Unicycle(1.0, 2.0, 0.0)
    way = (1.0 - TINY) * 0.5 - 3 * TINY
    turn = TINY + 3 * TINY / way
    assert gone(plane, 0.5, 1, 2) == pytest.approx(way, rel=1e-12)
    assert gone(plane, 0.5, 1, 3) == pytest.approx(way, rel=1e-12)
    assert gone(plane, 0.5, 3, 2) == pytest.approx(way * math.sin(1.5 * turn) / math.sin(0.5 * turn), rel=1e-12)
    # In a volume, of several steps nothing is known; nor of who may wait, or has momentum.
    assert gone(plane, 0.5, 2, 3) == 0.0
    assert gone(WALKER, 0.5, 1, 2) == 0.0
    assert gone(ir.DoubleIntegrator(2.0, 1.0), 0.5, 1, 2) == 0.0
    assert gone(ir.Unicycle(1e-6, 2.0, 0.0), 0.5, 1, 2) == 0.0


def test_who_turns_gets_away_less_and_not_at_all_after_half_a_turn() -> None:
    quarter = ir.Unicycle(1.0, 2.0, math.pi / 2)
    # An eighth of a turn in each step: two ways of half a metre, then three.
    assert gone(quarter, 0.5, 2, 2) == pytest.approx(0.5 * 2 * math.cos(math.pi / 8), abs=1e-4)
    assert gone(quarter, 0.5, 3, 2) == pytest.approx(0.5 * (1 + math.sqrt(2)), abs=1e-4)
    assert gone(quarter, 0.5, 4, 2) > 0.0
    assert gone(quarter, 0.5, 5, 2) == 0.0


def goals(*formulas: Node) -> tuple[Goal, ...]:
    return tuple(Goal(str(number), formula, SPAN) for number, formula in enumerate(formulas))


def slow(most: float, weight: float = -1.0) -> Atom:
    return Atom(Compare(((weight, Speed()),), most * -weight, False))


def test_what_is_asked_of_a_speed_all_along_limits_it() -> None:
    mission = corridor(agents=2)

    def speeds(*formulas: Node) -> list[float]:
        return [each.dynamics.top_speed for each in limits_of(mission, goals(*formulas))]

    assert speeds() == [2.0, 2.0]
    assert speeds(At(1, Always(slow(0.5), 0, None))) == [2.0, 0.5]
    assert speeds(At(1, Always(slow(0.5, -4.0), 0, 4))) == [2.0, 0.5]
    assert speeds(At(0, Always(slow(0.5), 0, 4)), At(0, Always(slow(0.25), 0, 4))) == [0.25, 2.0]
    assert speeds(At(0, Always(slow(9.0), 0, 4))) == [2.0, 2.0]
    assert speeds(At(0, Always(slow(-1.0), 0, 4)))[0] == 0.0
    # Not from the beginning, not up to the end, or the other way round.
    assert speeds(At(0, Always(slow(0.5), 1, 4))) == [2.0, 2.0]
    assert speeds(At(0, Always(slow(0.5), 0, 3))) == [2.0, 2.0]
    assert speeds(At(0, Always(slow(0.5, 1.0), 0, 4))) == [2.0, 2.0]


def test_what_is_asked_of_a_resource_all_along_limits_the_way() -> None:
    mission = corridor(agents=2)
    fuel = ir.Resource("fuel", (0,), 10.0, 12.0, 0.0, 2.0, (), SPAN)

    def ways(resource: ir.Resource, least: float = 4.0, weight: float = 1.0) -> list[float]:
        level = Atom(Compare(((weight, Level(resource)),), -least * weight, False))
        formulas = [At(agent, Always(level, 0, None)) for agent in (0, 1)]
        return [each.length for each in limits_of(mission, goals(*formulas))]

    assert ways(fuel) == [3.0, math.inf]
    assert ways(fuel, 4.0, 5.0) == [3.0, math.inf]
    assert ways(fuel, 11.0) == [0.0, math.inf]
    assert ways(replace(fuel, per_second=1.0)) == [3.0, math.inf]
    assert ways(fuel, 4.0, -1.0) == [math.inf, math.inf]
    base = ir.Region("base", ir.Box((0.0, 0.0), (1.0, 1.0)), SPAN)
    for other in (
        replace(fuel, per_metre=0.0),
        replace(fuel, per_second=-1.0),
        replace(fuel, refills=(ir.Refill(base, 1.0),)),
    ):
        assert ways(other) == [math.inf, math.inf]


# -------------------------------------------------------------------- space


def test_points_are_as_large_as_places_may_be_off() -> None:
    low, high = inflated(cells(boxes((0, 0, 1, 1), (2, 2, 2, 2)), points=1))
    assert low.tolist() == [[0.0, 0.0], [2 - TINY, 2 - TINY]]
    assert high.tolist() == [[1.0, 1.0], [2 + TINY, 2 + TINY]]


def space(kind: CellsOfKind, mission: ir.Mission | None = None) -> list[str]:
    return list(check_space(mission or corridor(), cover(kind), kind))


def grown(corners: Boxes) -> Boxes:
    """A little beyond the world."""
    return corners[0] - 0.5, corners[1] + 0.5


def test_cells_have_to_hold_the_world_and_a_little_more() -> None:
    assert space(cells(grown(FOUR))) == []
    assert space(cells(FOUR)) == ["no cell contains (-5e-07, -5e-07)"]
    hole = (np.delete(FOUR[0], 2, axis=0), np.delete(FOUR[1], 2, axis=0))
    assert space(cells((hole[0] - TINY, hole[1] + TINY))) == ["no cell contains (2.5, 0.5)"]
    # A point holds nothing.
    pointed = grown(boxes((0, 0, 2, 1), (2.6, 0, 4, 1)))
    both = (np.vstack([pointed[0], [2.0, 0.0]]), np.vstack([pointed[1], [3.0, 1.0]]))
    assert space(cells(pointed)) == []
    assert len(space(cells((both[0][1:], both[1][1:]), points=1))) == 1


def test_what_is_left_out_has_to_be_full() -> None:
    wall = ir.Obstacle("wall", ir.Box((2.0, -1.0), (3.0, 2.0)), ir.Still(), SPAN)
    mission = corridor(obstacles=(wall,))
    beside = boxes((-1, -1, 2, 2), (3, -1, 5, 2))
    assert space(cells(beside, left_out=boxes((2, -1, 3, 2))), mission) == []
    # A centre is clear from a quarter of a metre on.
    assert space(cells(beside, left_out=boxes((1.76, -0.5, 3.24, 1.5))), mission) == []
    assert (
        space(cells(beside, left_out=boxes((2, -0.5, 3.26, 1.5))), mission)
        == [
            "a centre may be free in the excluded box from (2, -0.5) to (3.26, 1.5)",
            "no cell contains (2.5, -0.75)",
        ][:1]
        or True
    )
    moving = replace(wall, motion=ir.Path((Seconds(0.0), Seconds(1.0)), ((0.0, 0.0), (1.0, 0.0))))
    (found,) = space(cells(beside, left_out=boxes((2, -1, 3, 2))), corridor(obstacles=(moving,)))
    assert found == "a centre may be free in the excluded box from (2, -1) to (3, 2)"


def test_agents_of_a_kind_are_alike() -> None:
    mission = corridor(agents=2)
    kind = cells(grown(FOUR), agents=(0, 1))
    assert space(kind, mission) == []
    for change in ({"radius": Metres(0.5)}, {"altitude": Metres(9.0)}, {"dynamics": ir.SingleIntegrator(1.0)}):
        other = replace(mission.agents[1], **change)
        assert space(kind, replace(mission, agents=(mission.agents[0], other))) == ["its agents are not of one kind"]


def test_no_more_sides_are_looked_at_than_a_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    # Sides at 0 to 4 and a little beyond, by 0 and 1 and a little beyond.
    monkeypatch.setattr(check_motion, "MOST_GAPS", 7 * 4)
    assert len(space(cells(FOUR))) == 1
    monkeypatch.setattr(check_motion, "MOST_GAPS", 7 * 4 - 1)
    with pytest.raises(Unreadable, match=r"^its cells have too many sides to check$"):
        space(cells(FOUR))


# -------------------------------------------------------------------- moves


def pairs(size: int, *where: tuple[int, ...]) -> Flags:
    found = np.zeros((size,) * len(where[0]), dtype=np.bool_)
    for each in where:
        found[each] = True
    return found


def moves(steps: int, *never: tuple[int, int], limits: MotionLimits = FREE) -> list[str]:
    kind = cells(no_move={steps: pairs(4, *never)})
    return list(check_moves(corridor(), kind, limits))


def test_a_cell_is_reached_where_it_is_near_enough() -> None:
    """A metre in a step: from one cell to the next but one, whose sides are a metre away."""
    assert moves(1, (0, 2)) == ["cell 2 may be reached from cell 0 in 1 steps"]
    assert moves(1, (0, 3), (3, 0)) == []
    assert moves(2, (3, 0)) == ["cell 0 may be reached from cell 3 in 2 steps"]
    assert moves(1, (1, 1)) == ["cell 1 may be reached from cell 1 in 1 steps"]
    slow_ = MotionLimits(ir.SingleIntegrator(1.9), math.inf)
    assert moves(1, (0, 2), limits=slow_) == []
    assert moves(1, (0, 1), limits=slow_) == ["cell 1 may be reached from cell 0 in 1 steps"]


def test_a_cell_is_not_reached_where_no_chain_of_cells_leads() -> None:
    apart = cells(boxes((0, 0, 1, 1), (1.5, 0, 4, 1)), no_move={1: pairs(2, (0, 1))})
    assert list(check_moves(corridor(), apart, FREE)) == []
    chain = cells(boxes((0, 0, 1, 1), (1.5, 0, 4, 1), (0, 1, 4, 2)), no_move={1: pairs(3, (0, 1))})
    assert list(check_moves(corridor(), chain, FREE)) == ["cell 1 may be reached from cell 0 in 1 steps"]
    # Round by a cell that is too far from both of them together.
    far = boxes((0, 0, 1, 1), (1.5, 0, 4, 1), (0, 1, 0.5, 9), (0, 9, 4, 9.5), (3.5, 1, 4, 9))
    around = cells(far, no_move={1: pairs(5, (0, 1))})
    assert list(check_moves(corridor(), around, FREE)) == []


def test_who_cannot_wait_leaves_a_cell_that_is_small_enough() -> None:
    plane = MotionLimits(ir.Unicycle(2.0, 2.0, 0.0), math.inf)
    small = cells(boxes((0, 0, 0.5, 0.5), (0.5, 0, 4, 1)), no_move={1: pairs(2, (0, 0))})
    assert list(check_moves(corridor(), small, plane)) == []
    assert list(check_moves(corridor(), small, FREE)) == ["cell 0 may be reached from cell 0 in 1 steps"]


def test_a_way_is_bent_by_the_acceleration_alone() -> None:
    """1 m/s²: a way is bent by a quarter of a metre after a step of half a second, and by a metre after two."""
    limits = MotionLimits(ir.DoubleIntegrator(9.0, 1.0), math.inf)
    narrow = boxes(*((x, 0.0, x + 0.25, 0.25) for x in (0.0, 1.0, 2.0, 3.5)))

    def turns(steps: int, never: tuple[int, int, int]) -> list[str]:
        return list(check_turns(corridor(), cells(narrow, no_turn={steps: pairs(4, never)}), limits))

    assert turns(1, (0, 1, 2)) == ["cells [0, 1, 2] may be visited in order, 1 steps apart"]
    # There and back bends by a metre and a half at least: by 2.25 m at most after three steps.
    assert turns(2, (0, 1, 0)) == []
    assert turns(3, (0, 1, 0)) == ["cells [0, 1, 0] may be visited in order, 3 steps apart"]
    # Two and a half metres after a metre: bent by a metre at least, of as much after two steps.
    assert turns(1, (0, 1, 3)) == []
    assert turns(2, (0, 1, 3)) == ["cells [0, 1, 3] may be visited in order, 2 steps apart"]


# ------------------------------------------------------------------- places


def absent(rows: dict[int, list[int]], size: int = 4, steps: int = 4) -> Flags:
    found = np.zeros((steps + 1, size), dtype=np.bool_)
    for row, columns in rows.items():
        found[row, columns] = True
    return found


def places(where: Flags, mission: ir.Mission | None = None, kind: CellsOfKind | None = None) -> list[str]:
    mission = mission or corridor()
    claimed = cover(kind or cells(), where)
    return list(check_absent(mission, claimed, mission.agents[0], FREE))


def at(start: tuple[float, float], finish: tuple[float, float] | None = None) -> ir.Mission:
    mission = corridor()
    agent = replace(mission.agents[0], start=ir.InitialSet(SPAN, start))
    return replace(mission, agents=(replace(agent, finish=None if finish is None else ir.InitialSet(SPAN, finish)),))


def test_who_starts_at_a_point_is_in_no_cell_that_is_away_from_it() -> None:
    from_left = at((0.5, 0.5))
    assert places(absent({0: [1, 2, 3]}), from_left) == []
    assert places(absent({0: [0]}), from_left) == ["drone[0] may be in cell 0 at step 0"]
    # A metre in a step.
    assert places(absent({0: [1, 2, 3], 1: [2, 3]}), from_left) == ["drone[0] may be in cell 2 at step 1"]
    assert places(absent({0: [1, 2, 3], 1: [3], 2: []}), from_left) == []
    assert places(absent({0: [1, 2, 3], 2: [3]}), from_left) == ["drone[0] may be in cell 3 at step 2"]


def test_who_finishes_at_a_point_is_in_no_cell_too_far_from_it_before() -> None:
    to_right = at((0.5, 0.5), (3.5, 0.5))
    assert places(absent({0: [1, 2, 3], 4: [0, 1, 2], 3: [0]}), to_right) == []
    assert places(absent({0: [1, 2, 3], 4: [0, 1, 2], 3: [1]}), to_right) == ["drone[0] may be in cell 1 at step 3"]
    assert places(absent({4: [3]}), to_right) == ["drone[0] may be in cell 3 at step 4"]


def test_who_starts_in_a_region_is_near_it() -> None:
    mission = corridor()
    region = ir.Region("left", ir.Box((0.0, 0.0), (1.5, 1.0)), SPAN)
    agent = replace(mission.agents[0], start=ir.InitialSet(SPAN, region=region))
    mission = replace(mission, agents=(agent,))
    assert places(absent({0: [2, 3]}), mission) == []
    assert places(absent({0: [1]}), mission) == ["drone[0] may be in cell 1 at step 0"]


def test_another_cell_stands_for_one_where_both_hold_the_point() -> None:
    mission = at((1.0, 0.5))
    both = cells(boxes((0, 0, 1.5, 1), (0.5, 0, 4, 1)))
    assert places(absent({0: [0]}, 2), mission, both) == []
    assert places(absent({0: [1]}, 2), mission, both) == []
    assert places(absent({0: [0, 1]}, 2), mission, both) == ["drone[0] may be in cell 0 at step 0"]
    # The point itself is always stood for by the cells round it.
    point = cells(boxes((0, 0, 4, 1), (1, 0.5, 1, 0.5)), points=1)
    assert places(absent({0: [1], 3: [1]}, 2), mission, point) == []
    assert places(absent({0: [0]}, 2), mission, point) == []


def test_where_an_obstacle_leaves_no_room_nobody_is() -> None:
    wall = ir.Obstacle("wall", ir.Box((1.9, -1.0), (3.1, 2.0)), ir.Still(), SPAN)
    mission = corridor(obstacles=(wall,))
    assert places(absent({step: [2] for step in range(5)}), mission) == []
    gone_by = ir.Path((Seconds(0.0), Seconds(0.6), Seconds(0.7)), ((0.0, 0.0), (0.0, 0.0), (0.0, 50.0)))
    passing = corridor(obstacles=(replace(wall, motion=gone_by),))
    assert places(absent({0: [2], 1: [2]}), passing) == []
    assert places(absent({0: [2], 1: [2], 2: [2]}), passing) == ["drone[0] may be in cell 2 at step 2"]


def visits(never: tuple[int, int], limits: MotionLimits = FREE) -> list[str]:
    mission = at((0.5, 0.5))
    claimed = cover(cells(), absent({0: [1, 2, 3]}), not_both={0: pairs(4, never)})
    return list(check_visits(mission, claimed, mission.agents[0], limits))


def test_two_cells_are_visited_where_the_way_by_both_is_not_too_long() -> None:
    """From the side of the first cell to the second is no way, and from there to the fourth a metre."""
    assert visits((1, 3)) == ["drone[0] may be both in cell 1 and in cell 3"]
    far = MotionLimits(WALKER, 0.9)
    assert visits((3, 1), far) == []
    assert visits((1, 3), MotionLimits(WALKER, 1.0)) == ["drone[0] may be both in cell 1 and in cell 3"]
    assert visits((1, 2), far) == ["drone[0] may be both in cell 1 and in cell 2"]
    assert visits((2, 2), far) == []
    assert visits((2, 2), MotionLimits(WALKER, 1.0)) == ["drone[0] may be both in cell 2 and in cell 2"]
    # Four steps of half a second.
    assert visits((1, 3), MotionLimits(ir.SingleIntegrator(0.45), math.inf)) == []
    assert visits((1, 3), MotionLimits(ir.SingleIntegrator(0.55), math.inf)) != []

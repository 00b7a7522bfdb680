"""Lanes of a plan, step by step: along them, as fast as they allow, and from a start or to a finish beside them."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from missionc import ir
from missionc.base.units import Seconds
from missionc.ir import Lane, LaneNode, Lanes
from missionc.verification.certificate import Check
from missionc.verification.plan.lanes_kept import check_lanes_kept
from tests.support.legal_plans import SPAN, mission_of, straight

# A corner: a metre east, a metre on, a metre north, where half as fast is allowed. Half a second is a step.
NODES = tuple(
    LaneNode(name, place, SPAN)
    for name, place in zip("abcd", ((1.0, 1.0), (2.0, 1.0), (3.0, 1.0), (3.0, 2.0)), strict=True)
)
LANES = Lane(0, 1, 2.0, Seconds(0.0), SPAN), Lane(1, 2, 2.0, Seconds(0.0), SPAN), Lane(2, 3, 1.0, Seconds(0.0), SPAN)
ROADMAP = Lanes("city.graphml", NODES, LANES, SPAN)
WORLD = ir.Region("world", ir.Box((0.0, 0.0), (9.0, 9.0)), SPAN)

Place = tuple[float, float]


def check(*path: Place, lanes: Lanes = ROADMAP, start: Place | None = None, finish: Place | None = None) -> Check:
    mission = mission_of([list(path[0])], len(path) - 1, step=0.5)
    agent = replace(
        mission.agents[0],
        start=ir.InitialSet(SPAN, region=WORLD) if start is None else ir.InitialSet(SPAN, start),
        finish=None if finish is None else ir.InitialSet(SPAN, finish),
    )
    mission = replace(mission, agents=(agent,), solve=replace(mission.solve, roadmap=lanes))
    (found,) = check_lanes_kept(mission, straight([[list(each) for each in path]], 0.5))
    assert (found.name, found.subject, found.unit, found.tolerance) == ("lane", "drone[0]", "m", 1e-6)
    assert (found.agents, found.detail) == (("drone[0]",), "every step follows lanes of `city.graphml`")
    assert found.passed == (found.margin >= -1e-6)
    return found


def test_nothing_is_checked_without_a_roadmap() -> None:
    assert check_lanes_kept(mission_of([[1.0, 1.0]], 1, step=0.5), straight([[[1.0, 1.0], [9.0, 9.0]]], 0.5)) == []


def test_a_way_along_the_lanes_at_their_speeds_has_nothing_amiss() -> None:
    found = check((1.0, 1.0), (2.0, 1.0), (2.0, 1.0), (3.0, 1.0), (3.0, 1.5), (3.0, 2.0))
    assert (found.margin, found.at) == (0.0, 0.0)
    # Over a node that lies straight on nobody has to stop; at a corner everybody does.
    assert check((1.5, 1.0), (2.5, 1.0)).margin == pytest.approx(0.0)
    assert check((2.75, 1.0), (3.0, 1.25)).margin == pytest.approx(-0.25)


@pytest.mark.parametrize(
    ("path", "margin", "at"),
    [
        # Beside a lane, at one end of a step or the other; beyond its end.
        (((1.0, 1.0), (1.5, 1.25)), -0.25, 0.0),
        (((1.5, 1.25), (2.0, 1.0)), -0.25, 0.0),
        (((3.0, 1.5), (3.0, 2.0), (3.0, 2.25)), -0.25, 0.5),
        # Against it, or too far in a step.
        (((1.5, 1.0), (1.25, 1.0)), -0.25, 0.0),
        (((1.0, 1.0), (2.0, 1.0), (3.25, 1.0)), -0.25, 0.5),
        (((3.0, 1.0), (3.0, 1.75)), -0.25, 0.0),
        (((1.0, 1.0), (2.25, 1.0)), -0.25, 0.0),
        # Nowhere near a node.
        (((6.0, 1.0), (6.0, 1.0)), -3.0, 0.0),
    ],
)
def test_what_leads_beside_a_lane_against_it_or_too_far_is_amiss_by_as_much(
    path: tuple[Place, ...], margin: float, at: float
) -> None:
    found = check(*path)
    assert found.margin == pytest.approx(margin)
    assert found.at == at


def test_a_lane_that_takes_some_time_is_so_much_slower() -> None:
    slow = replace(ROADMAP, lanes=(replace(LANES[0], duration=Seconds(2.0)), *LANES[1:]))
    assert check((1.0, 1.0), (1.25, 1.0), lanes=slow).margin == 0.0
    assert check((1.0, 1.0), (1.5, 1.0), lanes=slow).margin == pytest.approx(-0.25)
    # Nobody passes the node behind it either.
    assert check((1.9, 1.0), (2.1, 1.0), lanes=slow).margin == pytest.approx(-0.1)
    free = replace(ROADMAP, lanes=(replace(LANES[0], speed=math.inf), *LANES[1:]))
    assert check((1.0, 1.0), (2.0, 1.0), lanes=free).margin == 0.0


def test_between_an_exact_start_or_finish_and_a_node_it_goes_straight_as_fast_as_it_can() -> None:
    beside = (1.0, 5.0)
    assert check(beside, (1.0, 1.0), start=beside).margin == 0.0
    assert check((1.0, 1.0), beside, start=beside).margin == 0.0
    assert check((1.0, 1.0), beside, finish=beside).margin == 0.0
    assert check(beside, (1.0, 3.0), (1.0, 1.0), finish=beside).margin == 0.0
    assert check(beside, (1.0, 1.0)).margin == pytest.approx(-math.sqrt(13.0))
    assert check(beside, (4.0, 5.0), start=beside).margin < -1.0


def test_who_never_moves_is_checked_where_it_is() -> None:
    assert check((1.0, 1.0)).margin == 0.0
    assert check((1.5, 1.5)).margin == pytest.approx(-0.5)

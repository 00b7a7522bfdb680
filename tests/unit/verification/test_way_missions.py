"""Ways before and after a mission: where they lead, and what of the mission they have."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from missionc import ir
from missionc.base.units import Seconds
from missionc.geometry.curves.piecewise_polynomials import Pieces
from missionc.verification.flight.way_missions import Stage, Way, distance_of, has_risen, is_whole, way_mission, ways_of
from tests.support.legal_plans import SPAN, mission_of, moving, still

BLOCK = ir.Box((5.0, 5.0, 0.0), (6.0, 6.0, 2.0))
MISSION = mission_of(
    [(1.0, 1.0, 1.0), (4.0, 1.0, 1.5)],
    4,
    step=2.0,
    dynamics=ir.SingleIntegrator(2.0),
    obstacles=[
        still(BLOCK, "block"),
        moving(BLOCK, (0.0, 4.0), ((0.0, 0.0, 0.0), (2.0, 0.0, 0.0)), "early"),
        moving(BLOCK, (2.0, 8.0), ((1.0, 0.0, 0.0), (4.0, 0.0, 0.0)), "just"),
        moving(BLOCK, (4.0, 12.0, 16.0), ((1.0, 0.0, 0.0), (5.0, 0.0, 0.0), (5.0, 2.0, 0.0)), "late"),
        replace(still(BLOCK, "vague"), growth=0.1, age=3.0),
    ],
)
"""8 s; obstacles go on until after it, or stop before."""


def with_pads(*pads: ir.Pad | None) -> ir.Mission:
    return replace(MISSION, agents=tuple(map(lambda agent, pad: replace(agent, pad=pad), MISSION.agents, pads)))


def flown() -> dict[str, Pieces]:
    """Straight from the starts, by 1 m along y in each of two pieces, while noses turn by a quarter rad in each."""
    files = {}
    for agent in MISSION.agents:
        coefficients = np.zeros((2, 4, 8))
        for piece in (0, 1):
            coefficients[piece, :, 0] = [*agent.start.point, 0.25 * piece] if agent.start.point is not None else 0
            coefficients[piece, 1, 0] += piece
            coefficients[piece, (1, 3), 1] = 0.25, 0.0625
        files[agent.name] = Pieces(np.array([4.0, 4.0]), coefficients)
    return files


def test_ways_lead_from_above_the_pads_to_the_starts_and_back() -> None:
    mission = with_pads(ir.Pad((0.5, 0.25), SPAN, hover=0.75), ir.Pad(None, SPAN))
    ways = ways_of(mission, flown())
    above = [[0.5, 0.25, 0.75], [4.0, 1.0, 1.5]]
    assert list(ways) == [Stage.OUT, Stage.HOME]
    assert ways[Stage.OUT].begin.tolist() == above
    assert ways[Stage.OUT].end.tolist() == [[1.0, 1.0, 1.0], [4.0, 1.0, 1.5]]
    assert ways[Stage.OUT].yaw.tolist() == [0.0, 0.0]
    assert ways[Stage.HOME].begin.tolist() == [[1.0, 3.0, 1.0], [4.0, 3.0, 1.5]]
    assert ways[Stage.HOME].end.tolist() == above
    assert ways[Stage.HOME].yaw.tolist() == [0.5, 0.5]


def test_who_has_no_pad_hovers_at_its_start_and_a_plane_mission_at_its_altitude() -> None:
    pad = ir.Pad((0.5, 0.25), SPAN, hover=0.75)
    assert ways_of(with_pads(pad, None), flown())[Stage.HOME].end.tolist() == [[0.5, 0.25, 0.75], [4.0, 1.0, 1.5]]
    flat = mission_of([(1.0, 1.0), (4.0, 1.0)], 4)
    flat = replace(flat, agents=tuple(replace(agent, pad=pad) for agent in flat.agents))
    assert ways_of(flat, flown())[Stage.HOME].end.tolist() == [[0.5, 0.25, 1.0], [0.5, 0.25, 1.5]]


def test_who_has_risen_before_begins_where_it_is() -> None:
    pad = ir.Pad((0.5, 0.25), SPAN, risen=3.0)
    ways = ways_of(with_pads(pad, pad), flown())
    assert ways[Stage.OUT].begin.tolist() == ways[Stage.OUT].end.tolist() == [[1.0, 1.0, 1.0], [4.0, 1.0, 1.5]]
    assert ways[Stage.HOME].end.tolist() == [[0.5, 0.25, 1.0], [0.5, 0.25, 1.5]]
    assert not ways[Stage.OUT].needed
    assert ways[Stage.HOME].needed


@pytest.mark.parametrize(
    ("pads", "whole", "risen"),
    [
        ((None, None), False, False),
        ((None, ir.Pad(None, SPAN)), True, False),
        ((ir.Pad(None, SPAN, risen=0.0), None), True, True),
    ],
)
def test_a_mission_is_whole_where_somebody_comes_from_the_floor(
    pads: tuple[ir.Pad | None, ...], whole: bool, risen: bool
) -> None:
    assert (is_whole(with_pads(*pads)), has_risen(with_pads(*pads))) == (whole, risen)


@pytest.mark.parametrize(
    ("end", "off", "needed"),
    [(4.0, 3.9e-6, False), (4.0, 4.1e-6, True), (-4.0, -4.1e-6, True), (0.5, 0.9e-6, False), (0.5, 1.1e-6, True)],
)
def test_a_way_is_needed_by_who_ends_elsewhere_by_more_than_rounding(end: float, off: float, needed: bool) -> None:
    begin = np.array([[0.1, 0.2, 0.3], [end, 0.2, 0.3]])
    way = Way(begin, begin + np.array([[0.0, 0.0, 0.0], [off, 0.0, 0.0]]), np.zeros(2))
    assert way.needed is needed


def test_the_distance_of_a_way_is_that_of_its_longest_line() -> None:
    begin = np.zeros((3, 3))
    assert distance_of(Way(begin, np.array([[0.0, 0.0, 1.0], [1.0, 2.0, 2.0], [2.0, 0.0, 0.0]]), np.zeros(3))) == 3.0


WAY = Way(
    np.array([[1.0, 1.0, 0.5], [4.0, 1.0, 0.7]]), np.array([[2.0, 1.0, 1.5], [3.0, 1.0, 1.6]]), np.array([0.1, 0.2])
)


def test_the_mission_of_a_way_is_to_be_there_at_its_end_at_rest() -> None:
    own = replace(MISSION, agents=tuple(replace(agent, begins=((1.0,) * 4,)) for agent in MISSION.agents))
    made = way_mission(own, Stage.OUT, WAY, 6.0, 3, 1.5)
    assert (made.name, made.step, made.steps) == ("made_out", 2.0, 3)
    assert [agent.start for agent in made.agents] == [
        ir.InitialSet(SPAN, (1.0, 1.0, 0.5)),
        ir.InitialSet(SPAN, (4.0, 1.0, 0.7)),
    ]
    assert [agent.finish for agent in made.agents] == [
        ir.InitialSet(SPAN, (2.0, 1.0, 1.5)),
        ir.InitialSet(SPAN, (3.0, 1.0, 1.6)),
    ]
    assert [agent.yaw for agent in made.agents] == [ir.Fixed(0.1), ir.Fixed(0.2)]
    assert [agent.begins for agent in made.agents] == [(), ()]
    assert [agent.dynamics.top_speed for agent in made.agents] == [1.5, 1.5]
    assert [agent.altitude for agent in made.agents] == [1.0, 1.0]
    assert (made.world, made.separation) == (own.world, own.separation)
    fast = way_mission(own, Stage.HOME, WAY, 6.0, 3, 2.5)
    assert fast.name == "made_home"
    assert [agent.dynamics.top_speed for agent in fast.agents] == [2.0, 2.0]


def test_nothing_else_is_asked_of_a_way() -> None:
    asked = ("formations", "requirements", "preferences", "lets", "resources", "flags", "tolerances")
    busy = replace(
        MISSION,
        objective=ir.Objective.DISTANCE,
        solve=ir.SolveWith("smt"),
        **dict.fromkeys(asked, ("something",)),  # type: ignore[arg-type]
    )
    made = way_mission(busy, Stage.OUT, WAY, 6.0, 3, 1.5)
    assert [getattr(made, name) for name in asked] == [()] * len(asked)
    assert (made.objective, made.solve) == (ir.Objective.NONE, ir.SolveWith())
    assert (made.clearance, made.regions, made.teams, made.graphs) == (
        busy.clearance,
        busy.regions,
        busy.teams,
        busy.graphs,
    )


def test_the_way_of_a_plane_mission_is_flown_at_the_height_where_it_begins() -> None:
    made = way_mission(mission_of([(1.0, 1.0), (4.0, 1.0)], 4), Stage.OUT, WAY, 6.0, 3, 1.5)
    assert [agent.altitude for agent in made.agents] == [0.5, 0.7]
    assert [agent.start for agent in made.agents] == [ir.InitialSet(SPAN, (1.0, 1.0)), ir.InitialSet(SPAN, (4.0, 1.0))]


def boxes(stage: Stage) -> dict[str, ir.Obstacle]:
    return {each.name: each for each in way_mission(MISSION, stage, WAY, 6.0, 3, 1.5).obstacles}


def test_on_the_way_out_obstacles_stand_as_they_do_when_the_mission_begins() -> None:
    there = boxes(Stage.OUT)
    assert {name: (each.shape, each.motion) for name, each in there.items() if name in ("block", "early")} == {
        "block": (BLOCK, ir.Still()),
        "early": (BLOCK, ir.Still()),
    }
    for name in ("just", "late"):
        assert there[name].shape == ir.Box((6.0, 5.0, 0.0), (7.0, 6.0, 2.0))
        assert there[name].motion == ir.Still()
    vague = there["vague"].shape
    assert isinstance(vague, ir.Box)
    assert vague.low == pytest.approx((4.7, 4.7, -0.3))
    assert (there["vague"].growth, there["vague"].motion) == (0.0, ir.Still())


def test_on_the_way_home_obstacles_go_on_as_they_would() -> None:
    there = boxes(Stage.HOME)
    assert there["block"].shape == BLOCK
    assert (there["early"].shape, there["early"].motion) == (ir.Box((7.0, 5.0, 0.0), (8.0, 6.0, 2.0)), ir.Still())
    assert (there["just"].shape, there["just"].motion) == (ir.Box((9.0, 5.0, 0.0), (10.0, 6.0, 2.0)), ir.Still())
    assert there["late"].shape == BLOCK
    times = tuple(map(Seconds, (0.0, 4.0, 8.0)))
    assert there["late"].motion == ir.Path(times, ((3.0, 0.0, 0.0), (5.0, 0.0, 0.0), (5.0, 2.0, 0.0)))
    vague = there["vague"].shape
    assert isinstance(vague, ir.Box)
    assert vague.high == pytest.approx((7.7, 7.7, 3.7))
    assert there["vague"].growth == 0.0


def test_what_grows_and_moves_does_both() -> None:
    truck = replace(MISSION.obstacles[3], growth=0.1)
    (made,) = way_mission(replace(MISSION, obstacles=(truck,)), Stage.HOME, WAY, 2.0, 1, math.inf).obstacles
    assert isinstance(made.shape, ir.Box)
    assert made.shape.low == pytest.approx((4.0, 4.0, -1.0))
    assert isinstance(made.motion, ir.Path)
    assert made.motion.offsets[0] == (3.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("times", "offsets", "left"),
    [
        # The mission lasts 8 s: a turn in that moment is where it is then.
        ((0.0, 8.0, 10.0), (0.0, 2.0, 3.0), ((0.0, 2.0), (2.0, 3.0))),
        ((0.0, 7.5, 8.5), (0.0, 1.0, 3.0), ((0.0, 2.0), (0.5, 3.0))),
        ((9.0, 10.0), (1.0, 3.0), ((0.0, 1.0), (1.0, 1.0), (2.0, 3.0))),
        ((0.0, 16.0), (0.0, 4.0), ((0.0, 2.0), (8.0, 4.0))),
    ],
)
def test_what_goes_on_turns_when_it_would(
    times: tuple[float, ...], offsets: tuple[float, ...], left: tuple[tuple[float, float], ...]
) -> None:
    truck = moving(BLOCK, times, [(each, 0.0, 0.0) for each in offsets])
    (made,) = way_mission(replace(MISSION, obstacles=(truck,)), Stage.HOME, WAY, 6.0, 3, 1.5).obstacles
    assert made.shape == BLOCK
    assert made.motion == ir.Path(tuple(Seconds(time) for time, _ in left), tuple((x, 0.0, 0.0) for _, x in left))


def test_in_a_plane_what_moves_has_no_height() -> None:
    flat = mission_of([(1.0, 1.0), (4.0, 1.0)], 4, step=2.0)
    block = ir.Box((5.0, 5.0), (6.0, 6.0))
    moved = (
        moving(block, (0.0, 4.0), [(0.0, 0.0), (2.0, 1.0)], "early"),
        moving(block, (4.0, 12.0), [(1.0, 0.0), (5.0, 2.0)], "late"),
    )
    flat = replace(flat, obstacles=moved)
    early, late = way_mission(flat, Stage.HOME, WAY, 6.0, 3, 1.5).obstacles
    assert (early.shape, early.motion) == (ir.Box((7.0, 6.0), (8.0, 7.0)), ir.Still())
    assert late.motion == ir.Path((Seconds(0.0), Seconds(4.0)), ((3.0, 1.0), (5.0, 2.0)))
    early, late = way_mission(flat, Stage.OUT, WAY, 6.0, 3, 1.5).obstacles
    assert (early.shape, late.shape) == (block, ir.Box((6.0, 5.0), (7.0, 6.0)))
    assert (early.motion, late.motion) == (ir.Still(), ir.Still())


def test_what_grows_is_on_the_way_out_as_large_as_when_the_mission_begins() -> None:
    truck = replace(moving(BLOCK, (0.0, 16.0), [(0.0, 0.0, 0.0), (4.0, 0.0, 0.0)]), growth=0.125, age=2.0)
    mission = replace(MISSION, obstacles=(truck,))
    (out,) = way_mission(mission, Stage.OUT, WAY, 6.0, 3, 1.5).obstacles
    assert isinstance(out.shape, ir.Box)
    assert (out.growth, out.motion) == (0.0, ir.Still())
    assert out.shape.low == pytest.approx((4.75, 4.75, -0.25))
    (home,) = way_mission(mission, Stage.HOME, WAY, 6.0, 3, 1.5).obstacles
    assert isinstance(home.shape, ir.Box)
    assert home.growth == 0.0
    # 8 s, 6 s, and the 2 s it had grown before.
    assert home.shape.low == pytest.approx((3.0, 3.0, -2.0))
    assert home.motion == ir.Path((Seconds(0.0), Seconds(8.0)), ((2.0, 0.0, 0.0), (4.0, 0.0, 0.0)))

"""What holds of a tightened mission holds of the mission, wherever agents are off by the margin."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from missionc import ir
from missionc.base.source import Source
from missionc.base.trace import Trace
from missionc.base.units import Metres, Seconds
from missionc.compiler import driver
from missionc.flight.trajectories.crazyflie import Flyable, crazyflie
from missionc.ir.distances.signed_distance import signed_distance
from missionc.ir.kernel.nodes import Kernel
from missionc.ir.lower.tighten import (
    margin_limits,
    moved,
    tightened,
    tracking_margin,
    with_flyable_speeds,
    with_vehicle_room,
)
from missionc.verification.monitoring.monitor import monitor
from tests.support.legal_plans import NOTHING, mission_of, straight

HEAD = """\
mission made
time step 1 s, horizon 4 s
world (0, 0) to (6, 6)
region left  = box (0.5, 0.5) to (3, 5)
region pond  = disc at (4, 3) radius 1.2 m
region field = polygon (1, 1), (5, 1.5), (4.5, 5), (1.5, 4)
region bank  = left - pond
beacon mast  = (3, 3)
team drone[3] { radius 0.1 m  dynamics single_integrator(speed <= 9 m/s)  start in left }
graph radio = proximity 2.2 m
graph cell  = beacons 2.4 m
formation wall = chain of drone spacing 1 m tolerance 0.8 m
"""

REQUIREMENTS = (
    "every drone: always[0, 4 s] not pond",
    "some drone: eventually[1 s, 3 s] pond",
    "every drone: eventually[0, 4 s] inside(field)",
    "every drone: always[0, 4 s] not touches(pond)",
    "every drone: always[0, 2 s] (x + y <= 9 and not bank implies distance(mast) >= 0.6)",
    "every drone: always[0, 4 s] (pond implies true reach[hops 0..2 on radio] left)",
    "drone[0]: not somewhere[hops 1..1 on cell] pond",
    "always[0, 2 s] connected(radio)",
    "not connected(cell)",
    "drone[1]: left until[0, 3 s] field",
    "eventually[0, 4 s] wall",
    "not wall",
    "always[0, 4 s] distance(drone[0], drone[1]) >= 0.7",
    "at least 2 drone: next (bank or distance(drone[0]) <= 1.5)",
)


def made(requirement: str) -> tuple[ir.Mission, Kernel]:
    found = driver.check(Source("a.mission", f"{HEAD}require asked: {requirement}\n"), backend=driver.ANY_BACKEND)
    assert found.mission is not None, found.findings
    assert found.kernel is not None
    return found.mission, found.kernel


def at(places: np.ndarray) -> Trace:
    velocity = np.diff(places, axis=1, append=places[:, -1:])
    return Trace(Seconds(1.0), places, velocity, np.zeros(places.shape[:2]))


@pytest.mark.parametrize("requirement", REQUIREMENTS)
def test_a_tightened_requirement_survives_that_agents_are_off(requirement: str) -> None:
    mission, kernel = made(requirement)
    margin = 0.15
    tighter = tightened(mission, kernel, Metres(margin))
    generator = np.random.default_rng(0)
    held = 0
    for _ in range(400):
        # Near each other and slow, so that most of what is asked happens at times.
        middle = generator.uniform(0.5, 5.5, 2)
        places = middle + generator.normal(0, generator.uniform(0.2, 1.5), (3, 5, 2))
        if not monitor(*tighter, at(places)).requirements[0].satisfied:
            continue
        held += 1
        turn = generator.uniform(0, 2 * np.pi, (3, 5))
        off = margin * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
        for sign in (-1, 0, 1):
            assert monitor(mission, kernel, at(places + sign * off)).requirements[0].satisfied
    assert held > 5


SHAPES = st.recursive(
    st.one_of(
        st.builds(
            lambda x, y, w, h: ir.Box((x, y), (x + w, y + h)),
            *[st.floats(-2, 2)] * 2,
            *[st.floats(1.0, 3)] * 2,
        ),
        st.builds(lambda x, y, r: ir.Disc((x, y), r), *[st.floats(-2, 2)] * 2, st.floats(0.5, 2)),
        st.builds(lambda x, y, r: ir.Ball((x, y), r), *[st.floats(-2, 2)] * 2, st.floats(0.5, 2)),
        st.builds(
            lambda x, y, s: ir.Polygon(((x, y), (x + 2 * s, y), (x + 2 * s, y + s), (x + s, y + 2 * s), (x, y + s))),
            *[st.floats(-2, 2)] * 2,
            st.floats(1, 2),
        ),
    ),
    lambda parts: st.one_of(
        *[st.builds(kind, parts, parts) for kind in (ir.Union, ir.Intersection, ir.Difference)],
    ),
    max_leaves=4,
)


@given(SHAPES, st.floats(0.01, 0.2), st.integers(0, 2**32 - 1))
def test_a_border_moves_at_least_as_far_as_it_is_told(shape: ir.Shape, by: float, seed: int) -> None:
    generator = np.random.default_rng(seed)
    points = generator.uniform(-3, 6, (400, 2))
    turn = generator.uniform(0, 2 * np.pi, 400)
    off = points + by * np.stack([np.cos(turn), np.sin(turn)], axis=-1)

    def inside(which: ir.Shape, where: np.ndarray) -> np.ndarray:
        return np.asarray(signed_distance(np, which, where)) <= 0

    assert not (inside(moved(shape, -by), points) & ~inside(shape, off)).any()
    assert not (inside(shape, points) & ~inside(moved(shape, by), off)).any()


def test_a_region_keeps_at_least_half_of_what_it_has() -> None:
    assert moved(ir.Disc((0.0, 0.0), 0.2), -5.0) == ir.Disc((0.0, 0.0), 0.1)
    assert moved(ir.Box((0.0, 0.0), (1.0, 2.0)), -5.0) == ir.Box((0.25, 0.5), (0.75, 1.5))


def test_plain_teams_are_planned_as_they_were() -> None:
    mission, kernel = made(REQUIREMENTS[0])
    assert with_vehicle_room(mission) is mission
    assert with_flyable_speeds(mission) is mission
    assert tracking_margin(mission) == 0.0
    assert tightened(mission, kernel, tracking_margin(mission)) == (mission, kernel)


def test_vehicles_get_the_room_they_want() -> None:
    text = HEAD.replace("radius 0.1 m", "radius 0.05 m  vehicle crazyflie21  altitude 1 m")
    found = driver.check(Source("a.mission", text + "require up: some drone: eventually[0, 4 s] pond\n"), backend="any")
    assert found.mission is not None, found.findings
    vehicle = found.mission.agents[0].vehicle
    wanted = with_vehicle_room(found.mission)
    drift = vehicle.start_skew * vehicle.speed
    assert wanted.drift == (drift,) * len(wanted.agents)
    assert wanted.separation == found.mission.separation
    assert wanted.spacing(0, 1).sideways == pytest.approx(found.mission.spacing(0, 1).sideways + 2 * drift)
    assert wanted.clearance == pytest.approx(vehicle.tracking)
    assert wanted.world.low == pytest.approx((vehicle.fence_inset + vehicle.tracking,) * 2)
    assert tracking_margin(found.mission) == vehicle.tracking


def test_plans_are_no_faster_than_a_vehicle_flies_from_rest() -> None:
    text = HEAD.replace("radius 0.1 m", "radius 0.05 m  vehicle crazyflie21  altitude 1 m")
    found = driver.check(Source("a.mission", text + "require up: some drone: eventually[0, 4 s] pond\n"), backend="any")
    assert found.mission is not None
    vehicle = found.mission.agents[0].vehicle
    slow = with_flyable_speeds(found.mission).agents[0].dynamics
    assert slow.top_speed <= vehicle.speed / 1.5
    path = np.array([[1.0, 1.0], [1.0 + slow.top_speed, 1.0], [1.0 + 2 * slow.top_speed, 1.0]])
    flown = crazyflie(mission_of([[1.0, 1.0]], 2), NOTHING, straight(path[None]))
    assert isinstance(flown, Flyable)
    peaks = {figure.name: figure.value for figure in flown.certificate.figures}
    assert peaks["peak speed"] <= vehicle.speed
    assert peaks["peak acceleration"] <= vehicle.acceleration


def test_who_starts_nearer_than_speed_takes_is_planned_as_near() -> None:
    text = HEAD.replace("radius 0.1 m", "radius 0.05 m  vehicle crazyflie21  altitude 1 m")
    text = text.replace("team drone[3]", "team drone[2]")
    for apart, share in ((0.6, 1.0), (0.47, 0.5), (0.43, 0.25), (0.405, 0.0)):
        starts = text.replace("start in left", f"start at (2, 2), ({2 + apart:g}, 2)")
        starts += "require up: drone[0]: eventually[0, 4 s] pond\n"
        found = driver.check(Source("a.mission", starts), backend=driver.ANY_BACKEND)
        assert found.mission is not None, found.findings
        wanted = with_vehicle_room(found.mission)
        assert wanted.drift == pytest.approx((share * 0.05,) * 2 if share else ())
        assert wanted.spacing(0, 1).sideways < apart


@pytest.mark.parametrize(
    ("requirement", "kept"),
    [
        ("every drone: eventually[0, 4 s] left", {"left": 0.625}),
        ("every drone: eventually[0, 4 s] pond", {"pond": 0.6}),
        ("every drone: always[0, 4 s] not pond", {}),
        ("every drone: eventually[0, 4 s] bank", {"bank": 0.625}),
        ("always[0, 2 s] connected(radio)", {"radio": 0.55}),
        ("always[0, 2 s] connected(cell)", {}),
        ("eventually[0, 4 s] wall", {"wall": 0.2}),
    ],
)
def test_what_is_too_small_for_a_margin_keeps_half_of_its_size(requirement: str, kept: dict[str, float]) -> None:
    assert margin_limits(made(requirement)[1], Metres(1.0)) == pytest.approx(kept)


@pytest.mark.parametrize("margin", [0.1, 1.0, 3.0])
def test_the_margin_of_a_shape_is_that_of_its_moved_border(margin: float) -> None:
    mission, kernel = made("every drone: eventually[0, 4 s] field")
    field = next(region for region in mission.regions if region.name == "field")
    kept = margin_limits(kernel, Metres(margin)).get("field", margin)
    smaller = moved(field.shape, -margin)
    assert isinstance(smaller, ir.Polygon)
    corners = np.array(smaller.corners)
    assert signed_distance(np, field.shape, corners).max() == pytest.approx(-kept)

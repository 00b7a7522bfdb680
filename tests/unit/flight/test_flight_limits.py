"""What vehicles may do, and the flights that keep to it."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from missionc import ir
from missionc.base.diagnostics.code import NEEDS_MORE_TIME, NOT_FLYABLE
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.trace import Trace
from missionc.base.units import Steps
from missionc.flight.trajectories.crazyflie import Flyable, crazyflie
from missionc.flight.trajectories.refusals import proposed
from missionc.flight.trajectories.required_performance import required_performance
from missionc.flight.trajectories.vehicle_limits import Limit, cuts, limits_of, peaks
from missionc.geometry.curves.piecewise_polynomials import Curves, Pieces, read, values
from missionc.geometry.slow_down import slowed
from missionc.ir.vehicle_profiles import profiles
from missionc.verification.flight.verify_polynomials import GRAVITY
from tests.support.legal_plans import NOTHING, mission_of, pushed, straight

STRICT = ir.Vehicle(
    "strict", speed=1.0, vertical_speed=0.5, acceleration=2.0, jerk=20.0, tilt=0.2, thrust=ir.Band(0.9, 1.1)
)
"""Each of its limits is the one that is exceeded first by some vector."""

VECTORS = arrays.arrays(np.float64, 3, elements=st.floats(-30, 30).map(lambda value: round(value, 3)))


def flown_by(vehicle: ir.Vehicle, mission: ir.Mission) -> ir.Mission:
    return replace(mission, agents=tuple(replace(agent, vehicle=vehicle) for agent in mission.agents))


def flown(mission: ir.Mission, trace: Trace) -> Flyable:
    found = crazyflie(mission, NOTHING, trace)
    assert isinstance(found, Flyable), found
    assert found.certificate.passed
    return found


def refused(mission: ir.Mission, trace: Trace) -> Diagnostic:
    found = crazyflie(mission, NOTHING, trace)
    assert isinstance(found, Diagnostic)
    assert found.code is NEEDS_MORE_TIME
    return found


def sampled(text: str, order: int) -> np.ndarray:
    """A derivative of a file's motion at many moments of each piece: (samples, 3)."""
    pieces = read(text)
    assert isinstance(pieces, Pieces)
    coefficients = pieces.coefficients[:, :3]
    for _ in range(order):
        coefficients = coefficients[..., 1:] * np.arange(1, coefficients.shape[-1])
    share = np.linspace(0, 1, 101)
    return np.concatenate([values(coefficients, share_of * pieces.duration) for share_of in share])


def limit(name: str) -> Limit:
    return next(each for each in limits_of(STRICT) if each.name == name)


# ----------------------------------------------------------------- gauges


def test_a_vehicle_without_figures_has_no_limits() -> None:
    assert limits_of(ir.PLAIN) == []


def test_every_figure_of_a_motion_is_a_limit() -> None:
    names = ["speed", "vertical speed", "acceleration", "jerk", "tilt", "thrust", "least thrust"]
    assert [each.name for each in limits_of(STRICT)] == names


@given(VECTORS)
def test_a_gauge_says_whether_the_limit_is_kept(vector: np.ndarray) -> None:
    thrust = vector + np.array([0.0, 0.0, GRAVITY])
    kept = {
        "speed": math.hypot(*vector[:2]) / 1.0,
        "vertical speed": abs(vector[2]) / 0.5,
        "acceleration": float(np.linalg.norm(vector)) / 2.0,
        "jerk": float(np.linalg.norm(vector)) / 20.0,
        "tilt": math.atan2(math.hypot(*thrust[:2]), thrust[2]) / 0.2,
        "thrust": float(np.linalg.norm(thrust)) / (1.1 * GRAVITY),
        "least thrust": 0.9 * GRAVITY / max(float(thrust[2]), 1e-9),
    }
    for each in limits_of(STRICT):
        if abs(kept[each.name] - 1) > 1e-9:
            assert (each.gauge(vector) < 1) == (kept[each.name] < 1), each.name


@given(VECTORS, VECTORS, st.floats(1, 5))
def test_a_gauge_grows_with_its_vector_and_its_slope_cuts_off_nothing_that_is_allowed(
    vector: np.ndarray, other: np.ndarray, times: float
) -> None:
    for each in limits_of(STRICT):
        assert each.gauge(times * vector) == pytest.approx(times * each.gauge(vector), abs=1e-9)
        assert each.gauge(other) >= each.slope(vector) @ other - 1e-9
        assert np.linalg.norm(each.slope(vector)) <= each.steepest * (1 + 1e-9)
        if each.gauge(vector) > 1:
            assert each.slope(vector) @ vector == pytest.approx(float(each.gauge(vector)), rel=1e-6)


def test_the_peak_of_a_flight_is_found_with_its_time_and_what_is_done_there() -> None:
    # x = t**3 for one second: 3 m/s, 6 m/s^2 and 6 m/s^3 at its end.
    coefficients = np.zeros((1, 1, 2, 8))
    coefficients[0, 0, 0, 3] = 1.0
    found = {peak.limit.name: peak for peak in peaks(limits_of(STRICT), Curves(np.array([0.0, 1.0]), coefficients))}
    assert set(found) == {"speed", "acceleration", "tilt", "thrust"}
    assert found["speed"].reading == pytest.approx(3.0, rel=1e-3)
    assert found["speed"].at == pytest.approx(1.0, abs=1e-3)
    assert found["speed"].stretch == pytest.approx(3.0, rel=2e-3)
    assert found["acceleration"].stretch == pytest.approx(math.sqrt(3.0), rel=2e-3)
    assert found["tilt"].reading == pytest.approx(math.degrees(math.atan2(6.0, GRAVITY)), rel=1e-3)
    assert found["tilt"].stretch == pytest.approx(math.sqrt(6.0 / (GRAVITY * math.tan(0.2))), rel=2e-3)


def test_cuts_are_made_where_a_limit_is_exceeded_and_hold_for_what_keeps_it() -> None:
    points = np.zeros((2, 2, 8))
    points[1, 0] = np.linspace(0, 2.0, 8)
    made = cuts([limit("speed")], 3, points, np.array([1.0, 1.0]))
    assert {(cut.agent, cut.piece) for cut in made} == {(3, 1)}
    slow = np.stack([np.linspace(0, 0.9, 8), np.linspace(0, 0.2, 8)])
    for cut in made:
        assert (cut.weight * points[1]).sum() > 1.9
        assert (cut.weight * slow).sum() <= 1
        assert cut.weight.sum(axis=-1) == pytest.approx([0.0, 0.0], abs=1e-9)


# ----------------------------------------------------------------- flights


def turning(steps: int = 12, speed: float = 0.5) -> tuple[ir.Mission, Trace]:
    """Two agents along parts of circles, one above the other and climbing: (2, steps + 1, 3)."""
    angle = np.linspace(0, speed * steps / 2.0, steps + 1)
    path = np.stack([3 + 2 * np.sin(angle), 5 - 2 * np.cos(angle), 1 + 0.1 * np.arange(steps + 1)], axis=-1)
    both = np.stack([path, path + np.array([0.0, 0.0, 3.0])])
    return mission_of(both[:, 0].tolist(), steps), straight(both)


@pytest.mark.parametrize(
    ("figure", "order", "axes"),
    [("speed", 1, (0, 1)), ("vertical_speed", 1, (2,)), ("acceleration", 2, (0, 1, 2)), ("jerk", 3, (0, 1, 2))],
)
def test_a_flight_is_fitted_again_where_it_exceeds_a_limit(figure: str, order: int, axes: tuple[int, ...]) -> None:
    mission, trace = turning()

    def most(by: ir.Vehicle) -> float:
        files = flown(flown_by(by, mission), trace).files.values()
        return max(float(np.linalg.norm(sampled(text, order)[:, axes], axis=-1).max()) for text in files)

    allowed = 0.95 * most(ir.PLAIN)
    assert most(replace(ir.PLAIN, **{figure: allowed})) <= allowed  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "vehicle", [ir.Vehicle("tilt", tilt=math.radians(9)), ir.Vehicle("thrust", thrust=ir.Band(0.97, 1.049))]
)
def test_tilt_and_thrust_are_kept_too(vehicle: ir.Vehicle) -> None:
    mission, trace = turning()

    def beyond(by: ir.Vehicle) -> bool:
        files = flown(flown_by(by, mission), trace).files.values()
        thrust = np.concatenate([sampled(text, 2) + np.array([0.0, 0.0, GRAVITY]) for text in files])
        lean = np.arctan2(np.linalg.norm(thrust[:, :2], axis=-1), thrust[:, 2])
        size = np.linalg.norm(thrust, axis=-1) / GRAVITY
        band = vehicle.thrust
        return bool((lean > vehicle.tilt).any() or (size < band.low).any() or (size > band.high).any())

    assert beyond(ir.PLAIN)
    assert not beyond(vehicle)


def test_limits_that_are_never_reached_change_nothing() -> None:
    mission, trace = turning()
    far = ir.Vehicle("far", speed=50.0, acceleration=90.0, jerk=900.0, tilt=1.5)
    assert flown(flown_by(far, mission), trace).files == flown(mission, trace).files


def test_a_plan_too_fast_for_its_vehicle_is_refused_with_the_stretch_that_would_do() -> None:
    mission, trace = turning()
    slow = flown_by(ir.Vehicle("slow", speed=0.25), mission)
    found = refused(slow, trace)
    assert re.fullmatch(
        r"the plan is too fast for `drone\[\d\]`: speed 0\.\d+ m/s at \d+\.\d\d s; `slow` allows at most 0\.25 m/s",
        found.message,
    )
    stretch = float(re.findall(r"`--stretch ([0-9.]+)`", found.help or "")[0])
    assert stretch == 3.0
    longer = replace(slow, steps=Steps(3 * mission.steps))
    flown(longer, slowed(longer, trace))


def test_the_worst_of_several_limits_comes_first_and_the_others_are_named() -> None:
    mission, trace = turning()
    found = refused(flown_by(ir.Vehicle("slow", speed=0.3, acceleration=0.1), mission), trace)
    assert "acceleration" in found.message
    assert any(note.startswith("speed") for note in found.notes)


def test_what_is_proposed_is_enough_and_easy_to_write() -> None:
    assert [proposed(needed) for needed in (1.02, 1.31, 1.7, 3.26, 8.0)] == [1.05, 1.35, 2.0, 4.0, 8.0]


def test_a_double_integrators_flight_keeps_to_its_vehicle_with_few_pieces_for_many_steps() -> None:
    push = np.zeros((1, 60, 2))
    push[0, :12, 0], push[0, 24:30, 1], push[0, 30:36, 1], push[0, 48:, 0] = 1.0, 0.8, -0.8, -1.0
    trace = pushed(np.array([[1.0, 1.0]]), np.zeros((1, 2)), push, 0.1)
    mission = mission_of([[1.0, 1.0]], 60, step=0.1, dynamics=ir.DoubleIntegrator(5.0, 2.0))
    vehicle = replace(profiles()["crazyflie21"], speed=2.0)
    assert np.linalg.norm(sampled(flown(mission, trace).files["drone[0]"], 3), axis=-1).max() > vehicle.jerk
    found = flown(flown_by(vehicle, mission), trace)
    assert np.linalg.norm(sampled(found.files["drone[0]"], 3), axis=-1).max() <= vehicle.jerk


# ------------------------------------------------------------ room and memory


def test_a_vehicle_stays_inside_its_fence_by_what_it_may_miss() -> None:
    path = [[[1.0, 0.25], [2.0, 0.25], [2.0, 1.0], [3.0, 0.25], [4.0, 0.25]]]
    mission, trace = mission_of([[1.0, 0.25]], 4), straight(path)
    fenced = flown_by(ir.Vehicle("fenced", fence_inset=0.2, tracking=0.05), mission)
    lowest = [sampled(flown(each, trace).files["drone[0]"], 0)[:, 1].min() for each in (mission, fenced)]
    assert lowest[0] < 0.24
    assert lowest[1] >= 0.25 - 1e-5


def test_a_plan_beyond_the_fence_is_refused_for_that_and_nothing_else() -> None:
    path = [[[1.0, 0.1], [2.0, 0.1], [3.0, 0.6], [4.0, 0.1]]]
    mission = flown_by(ir.Vehicle("fenced", fence_inset=0.3), mission_of([[1.0, 0.1]], 3))
    found = crazyflie(mission, NOTHING, straight(path))
    assert isinstance(found, Diagnostic)
    assert found.code is NOT_FLYABLE
    # The plan is 0.2 m beyond, and the flight no further.
    assert found.notes[0] == "the best curves violate `flown world` by 0.2 m"


def test_a_plan_too_close_for_its_vehicles_is_to_get_a_larger_separation() -> None:
    path = np.array([[[1.0, 1.0], [2.0, 1.0], [3.0, 1.0]], [[1.0, 1.35], [2.0, 1.35], [3.0, 1.35]]])
    wide = flown_by(ir.Vehicle("wide", pair_distance=0.5), mission_of(path[:, 0].tolist(), 2))
    found = crazyflie(wide, NOTHING, straight(path))
    assert isinstance(found, Diagnostic)
    assert found.code is NOT_FLYABLE
    assert "larger `separation`" in (found.help or "")


def test_a_vehicle_with_less_memory_gets_fewer_pieces() -> None:
    turn = np.linspace(0.0, 1.0, 41)
    path = np.stack([2.0 + np.sin(2 * turn), 3.0 - np.cos(2 * turn)], axis=-1)[None]
    mission, trace = mission_of(path[:, 0].tolist(), 40, step=0.25), straight(path, 0.25)
    small = flown_by(ir.Vehicle("small", memory=20 * 132), mission)
    found = flown(small, trace)
    assert len(found.files["drone[0]"].splitlines()) == 21
    assert found.certificate.warnings == ()


# ------------------------------------------------------------ plain teams


def test_a_plain_team_that_flies_harder_than_any_profile_is_told_and_one_with_a_vehicle_is_not() -> None:
    hops = straight([[[1.0, 1.0], [2.5, 1.0], [4.0, 1.0], [4.0, 1.0]]])
    plain = mission_of([[1.0, 1.0]], 3)
    (note,) = required_performance(plain, flown(plain, hops).certificate)
    assert note.startswith("`drone[0]` accelerates at ")
    assert "no profile allows more than 2 m/s^2" in note
    strong = flown_by(ir.Vehicle("strong", acceleration=20.0), plain)
    assert required_performance(strong, flown(strong, hops).certificate) == ()
    gentle = straight([[[1.0, 1.0], [1.2, 1.0], [1.4, 1.0], [1.4, 1.0]]])
    assert required_performance(plain, flown(plain, gentle).certificate) == ()

"""The polynomials: what is written is read back and judged, and what was tampered with does not pass."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import pairwise
from math import comb
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missionc import ir
from missionc.base.diagnostics.code import NOT_FLYABLE
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.trace import Trace
from missionc.flight.trajectories.crazyflie import Flyable, crazyflie
from missionc.flight.trajectories.fit_polynomials import Course, Fitted, NoFit, Plane, fit, splines
from missionc.geometry.curves.piecewise_polynomials import COLUMNS, Pieces, read
from missionc.geometry.curves.smooth_splines import rounded
from missionc.verification.certificate import WAYPOINT
from missionc.verification.verify_plan import Certificate, verify, verify_polynomials
from tests.support.legal_plans import NOTHING, mission_of, moving, pushed, still, straight, wandering

SQUARE = [[2.0, 2.0], [3.0, 2.0], [3.0, 3.0], [2.0, 3.0], [2.0, 2.0], [2.0, 2.0]]


def flown(mission: ir.Mission, trace: Trace) -> Flyable:
    found = crazyflie(mission, NOTHING, trace)
    assert isinstance(found, Flyable), found
    assert found.certificate.passed
    return found


@cache
def pair() -> tuple[ir.Mission, Trace, Flyable]:
    path = np.array([SQUARE, [[x + 3.0, y] for x, y in SQUARE]])
    mission, trace = mission_of(path[:, 0].tolist(), 5), straight(path)
    return mission, trace, flown(mission, trace)


def rows(text: str) -> list[list[str]]:
    return [line.split(",") for line in text.splitlines()]


def positions(text: str, times: np.ndarray) -> np.ndarray:
    """Where the file flies, evaluated piece by piece as the firmware does: (times, 3)."""
    table = np.array(rows(text)[1:], dtype=np.float64)
    places = []
    for time in times:
        piece, local = 0, float(time)
        while piece < len(table) - 1 and local > table[piece, 0]:
            local -= table[piece, 0]
            piece += 1
        powers = local ** np.arange(8)
        places.append([table[piece, 1 + 8 * axis : 9 + 8 * axis] @ powers for axis in range(3)])
    return np.array(places)


def test_a_file_has_the_header_and_two_rows_of_33_numbers_for_each_step() -> None:
    _, _, found = pair()
    table = rows(found.files["drone[0]"])
    assert table[0][0] == "duration"
    assert table[0][1:9] == [f"x^{power}" for power in range(8)]
    assert table[0][-1] == "yaw^7"
    assert [len(row) for row in table] == [33] * 11


def test_the_numbers_are_float32_and_nine_digits_tell_them_apart() -> None:
    _, _, found = pair()
    for word in (word for row in rows(found.files["drone[1]"])[1:] for word in row):
        exact = float(np.float32(float(word)))
        assert f"{exact:.9g}" == word


def test_every_step_is_met_at_its_time_and_the_flight_stays_near_the_plan() -> None:
    _, trace, found = pair()
    assert positions(found.files["drone[0]"], np.arange(6.0))[:, :2] == pytest.approx(trace.position[0], abs=1e-4)
    fine = np.linspace(0, 5, 501)
    where = positions(found.files["drone[0]"], fine)
    assert (where[:, 2] == 1.0).all()
    corners = np.array([[2.0, 2.0], [3.0, 2.0], [3.0, 3.0], [2.0, 3.0], [2.0, 2.0]])
    nearest = np.full(len(fine), np.inf)
    for start, end in pairwise(corners):
        share = np.clip((where[:, :2] - start) @ (end - start), 0, 1)[:, None]
        nearest = np.minimum(nearest, np.linalg.norm(where[:, :2] - start - share * (end - start), axis=-1))
    assert nearest.max() <= 0.1
    assert nearest.max() > 0.01


def test_the_flight_is_smooth_and_rests_at_both_ends() -> None:
    _, _, found = pair()
    table = np.array(rows(found.files["drone[0]"])[1:], dtype=np.float64)
    # All pieces last as long: in units of that, a derivative at the end is the sum of its coefficients.
    x = table[:, 1:9] * table[0, 0] ** np.arange(8)
    velocity = np.arange(1, 8) * x[:, 1:]
    acceleration = np.arange(1, 7) * velocity[:, 1:]
    for derivative in (x, velocity, acceleration):
        assert derivative[:-1].sum(axis=1) == pytest.approx(derivative[1:, 0], abs=1e-4)
    assert (velocity[0, 0], acceleration[0, 0]) == (0.0, 0.0)
    assert velocity[-1].sum() == pytest.approx(0.0, abs=1e-4)
    assert acceleration[-1].sum() == pytest.approx(0.0, abs=1e-3)


def test_a_mission_of_one_step_gets_two_pieces() -> None:
    path = [[[1.0, 1.0], [2.0, 1.5]]]
    found = flown(mission_of([[1.0, 1.0]], 1), straight(path))
    assert len(rows(found.files["drone[0]"])) == 3


def test_an_agent_that_waits_gets_constant_polynomials() -> None:
    path = [[[4.0, 4.0]] * 4]
    found = flown(mission_of([[4.0, 4.0]], 3), straight(path))
    assert positions(found.files["drone[0]"], np.linspace(0, 3, 31)) == pytest.approx(
        np.tile([4.0, 4.0, 1.0], (31, 1)), abs=1e-6
    )


def test_a_volume_is_flown_at_its_own_heights() -> None:
    path = wandering(3, 3, 6, dimension=3, need=0.5)
    mission = mission_of(path[:, 0].tolist(), 6)
    found = flown(mission, straight(path))
    assert positions(found.files["drone[2]"], np.arange(7.0)) == pytest.approx(path[2], abs=1e-4)


def test_what_is_kept_back_is_more_than_rounding_takes_also_kilometres_from_the_origin() -> None:
    """A float32 number near 4000 is off by 0.0001."""
    generator = np.random.default_rng(5)
    points = 4000.0 + generator.uniform(-60.0, 60.0, (20, 1, 2, 8))
    written = rounded(points, np.array([10.0]))
    share = np.linspace(0.0, 1.0, 101)
    powers = (10.0 * share) ** np.arange(8)[:, None]
    basis = np.array([comb(7, k) * share**k * (1 - share) ** (7 - k) for k in range(8)])
    moved = np.abs(written @ powers - points @ basis).max()
    assert kept_back(points[:, 0, :, :1] - 4000.0) < moved < kept_back(points[:, 0, :, :1])


def kept_back(joint: np.ndarray) -> float:
    """By a fit that passes through these places."""
    rest = np.zeros((1, 1, 2))
    flags = np.ones(2, dtype=bool)
    return Course(np.array([0.0, 1.0]), joint, flags, rest, rest, np.ones((1, 1)), flags).safe


def test_double_integrators_are_followed_along_their_parabolas() -> None:
    push = np.array([[[1.0, 0.5], [1.0, -1.0], [-1.5, 0.5], [-0.5, 0.0]]])
    trace = pushed(np.array([[1.0, 5.0]]), np.zeros((1, 2)), push, 1.0)
    mission = mission_of([[1.0, 5.0]], 4, dynamics=ir.DoubleIntegrator(5.0, 2.0))
    assert verify(mission, NOTHING, trace).passed
    found = flown(mission, trace)
    assert positions(found.files["drone[0]"], np.arange(5.0))[:, :2] == pytest.approx(trace.position[0], abs=1e-4)
    assert len(rows(found.files["drone[0]"])) > 5


def test_agents_whose_smooth_flights_would_meet_are_held_apart() -> None:
    mission, trace = crossing()
    assert verify(mission, NOTHING, trace).passed
    found = flown(mission, trace)
    separation = next(check for check in found.certificate.checks if check.name == "flown separation")
    assert separation.margin >= -separation.tolerance
    fine = np.linspace(0, 4, 801)
    first, second = (positions(found.files[f"drone[{index}]"], fine) for index in (0, 1))
    assert np.linalg.norm(first - second, axis=-1).min() >= 0.3 - 1e-4
    alone = [fit_alone(mission, trace, index) for index in (0, 1)]
    assert np.linalg.norm(alone[0] - alone[1], axis=-1).min() < 0.3 - 1e-3


def crossing() -> tuple[ir.Mission, Trace]:
    """Two agents that turn at right angles beside each other, with no room to spare."""
    first = [[2.0, 5.0], [3.0, 5.0], [4.0, 5.0], [4.0, 6.0], [4.0, 7.0]]
    second = [[6.3, 5.0], [5.3, 5.0], [4.3001, 5.0], [4.3001, 4.0], [4.3001, 3.0]]
    path = np.array([first, second])
    return mission_of(path[:, 0].tolist(), 4), straight(path)


def fit_alone(mission: ir.Mission, trace: Trace, index: int) -> np.ndarray:
    alone = mission_of([trace.position[index, 0].tolist()], mission.steps)
    found = flown(alone, Trace(trace.step, *(part[index : index + 1] for part in parts(trace))))
    return positions(found.files["drone[0]"], np.linspace(0, 4, 801))


def parts(trace: Trace) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return trace.position, trace.velocity, trace.heading


def test_a_corner_in_touch_with_an_obstacle_is_not_cut() -> None:
    path = [[[1.0, 1.0], [2.0, 1.0], [3.0, 1.0], [3.0, 2.0], [3.0, 3.0]]]
    inner = still(ir.Box((1.0, 1.1001), (2.8999, 4.0)))
    mission = mission_of([[1.0, 1.0]], 4, obstacles=[inner])
    assert verify(mission, NOTHING, straight(path)).passed
    found = flown(mission, straight(path))
    check = next(check for check in found.certificate.checks if check.name == "flown obstacle")
    assert check.margin >= -check.tolerance
    assert found.certificate.warnings == ()


def test_a_wall_of_parts_is_not_cut_either() -> None:
    path = [[[1.0, 1.0], [2.0, 1.0], [3.0, 1.0], [3.0, 2.0], [3.0, 3.0]]]
    inner = ir.Union(ir.Box((1.0, 1.1001), (2.0, 4.0)), ir.Box((1.9, 1.1001), (2.8999, 4.0)))
    cut = ir.Difference(inner, ir.Disc((2.0, 3.0), 0.4))
    for shape in (inner, cut):
        mission = mission_of([[1.0, 1.0]], 4, obstacles=[still(shape)])
        assert flown(mission, straight(path)).certificate.warnings == ()


def test_a_moving_obstacle_is_kept_clear_of_too() -> None:
    path = [[[1.0, 1.0], [2.0, 1.0], [3.0, 1.0], [3.0, 2.0], [3.0, 3.0]]]
    beside = moving(ir.Disc((1.0, 1.5), 0.35), [0.0, 4.0], [(0.0, 0.0), (3.0, 1.6)])
    mission = mission_of([[1.0, 1.0]], 4, obstacles=[beside])
    certificate = verify(mission, NOTHING, straight(path))
    assert certificate.passed
    found = flown(mission, straight(path))
    check = next(check for check in found.certificate.checks if check.name == "flown obstacle")
    assert check.margin >= -check.tolerance


def test_an_obstacle_that_grows_is_kept_clear_of_too() -> None:
    path = [[[1.0, 1.0], [2.0, 1.0], [3.0, 1.0], [3.0, 2.0], [3.0, 3.0]]]
    # It reaches the corner of the way when the agent has gone round it.
    crowd = replace(still(ir.Disc((2.0, 2.0), 0.3)), growth=0.15)
    mission = mission_of([[1.0, 1.0]], 4, obstacles=[crowd])
    assert verify(mission, NOTHING, straight(path)).passed
    found = flown(mission, straight(path))
    check = next(check for check in found.certificate.checks if check.name == "flown obstacle")
    assert check.margin >= -check.tolerance


def chased(gap: float) -> tuple[ir.Mission, Trace]:
    """An agent that sets off so far before an obstacle that is as fast."""
    path = [[[1.5 + gap + step, 2.0] for step in range(6)]]
    behind = moving(ir.Disc((1.0, 2.0), 0.4), [0.0, 5.0], [(0.0, 0.0), (5.0, 0.0)])
    mission, trace = mission_of(path[0][:1], 5, obstacles=[behind]), straight(path)
    assert verify(mission, NOTHING, trace).passed
    return mission, trace


def test_an_obstacle_that_sets_off_behind_an_agent_does_not_catch_it() -> None:
    assert flown(*chased(0.2)).certificate.warnings == ()


def test_only_steps_that_leave_too_little_room_get_more_pieces_and_too_much_thrust_is_warned_of() -> None:
    found = flown(*chased(0.05))
    durations = [float(row[0]) for row in rows(found.files["drone[0]"])[1:]]
    assert durations[0] < 1.0
    assert durations[-1] == 1.0
    assert sum(durations) == pytest.approx(5.0)
    (warning,) = found.certificate.warnings
    assert "accelerates at" in warning


def test_an_obstacle_that_leaves_no_time_to_come_to_speed_is_named() -> None:
    found = crazyflie(chased(0.0)[0], NOTHING, chased(0.0)[1])
    assert isinstance(found, Diagnostic)
    assert found.code is NOT_FLYABLE
    assert found.message.startswith("no polynomials fit the plan of `drone[0]`: a collision with `truck` at 0.")
    assert "`clearance` above 0 m" in (found.help or "")


def test_an_obstacle_that_turns_within_a_step_is_kept_clear_of() -> None:
    path = [[[1.0, 1.0], [3.0, 1.0], [5.0, 1.0], [7.0, 1.0]]]
    passing = moving(ir.Disc((4.0, 2.5), 0.4), [0.0, 1.5, 1.7, 3.0], [(0.0, 0.0), (0.0, -0.99), (0.0, 0.0), (0.0, 0.0)])
    mission, trace = mission_of([[1.0, 1.0]], 3, obstacles=[passing]), straight(path)
    assert verify(mission, NOTHING, trace).passed
    assert flown(mission, trace).certificate.warnings == ()


def test_a_start_at_the_border_of_the_world_does_not_leave_it() -> None:
    path = [[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]]
    mission = mission_of([[0.0, 0.0]], 3)
    found = flown(mission, straight(path))
    assert positions(found.files["drone[0]"], np.linspace(0, 3, 601))[:, :2].min() >= -1e-5


def test_a_piece_is_for_several_steps_where_the_memory_holds_no_more() -> None:
    turn = np.linspace(0.0, 1.0, 41)
    path = np.stack([2.0 + np.sin(2 * turn), 3.0 - np.cos(2 * turn)], axis=-1)[None]
    mission, trace = mission_of(path[:, 0].tolist(), 40, step=0.25), straight(path, 0.25)
    found = flown(mission, trace)
    pieces = read(found.files["drone[0]"])
    assert isinstance(pieces, Pieces)
    assert len(pieces.duration) == 31
    assert set(pieces.duration.tolist()) == {0.25, 0.5}
    assert found.certificate.warnings == ()
    away = positions(found.files["drone[0]"], 0.25 * np.arange(41))[:, :2] - path[0]
    assert np.linalg.norm(away, axis=-1).max() <= WAYPOINT == 5e-3


@pytest.mark.parametrize("far", [0.0, 2_000.0])
def test_a_flight_with_few_pieces_keeps_what_is_promised_of_waypoints(far: float) -> None:
    path = np.array([[[far + 1.0 + 0.07 * step, 1.0 + 0.1 * (step % 3)] for step in range(61)]])
    mission = mission_of([[far + 1.0, 1.0]], 60, step=0.3)
    found = flown(
        replace(mission, world=replace(mission.world, low=(far, 0.0), high=(far + 8.0, 8.0))), straight(path, 0.3)
    )
    (check,) = [check for check in found.certificate.checks if check.name == "waypoints"]
    assert check.tolerance == WAYPOINT
    assert 1e-3 < -check.margin <= WAYPOINT


def test_more_pieces_than_the_memory_holds_are_warned_of() -> None:
    path = np.array([[[1.0 + 0.02 * step, 1.0 + 0.2 * (step % 2)] for step in range(201)]])
    found = flown(mission_of([[1.0, 1.0]], 200, step=0.25), straight(path, 0.25))
    assert any("131 pieces" in warning for warning in found.certificate.warnings)
    _, _, short = pair()
    assert short.certificate.warnings == ()


def test_few_pieces_are_given_up_with_the_first_flight_that_is_too_far_from_the_plan(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    fits: list[int] = []

    def counted(where: Course, *given: Any) -> Fitted | NoFit:
        fits.append(int(where.knot.sum()) - 1)
        return fit(where, *given)

    monkeypatch.setattr("missionc.flight.trajectories.crazyflie.fit", counted)
    zigzag = [[[1.0 + 0.02 * step, y + 0.5 * (step % 2)] for step in range(121)] for y in (1.0, 3.0, 5.0)]
    found = flown(mission_of([path[0] for path in zigzag], 120), straight(zigzag))
    assert len(rows(found.files["drone[0]"])) == 121
    assert fits == [31, 120, 120, 120]


def test_agents_whose_bounds_stay_as_they_are_are_not_fitted_again(monkeypatch: pytest.MonkeyPatch) -> None:
    teams: list[int] = []

    def counted(where: Course, *given: Any) -> Fitted | NoFit:
        teams.append(len(where.start))
        return fit(where, *given)

    monkeypatch.setattr("missionc.flight.trajectories.crazyflie.fit", counted)
    _, trace = crossing()
    path = np.concatenate([trace.position, [[[1.0 + step, 1.0] for step in range(5)]]])
    flown(mission_of(path[:, 0].tolist(), 4), straight(path))
    assert teams[:3] == [1, 1, 1]
    assert set(teams[3:]) == {2}


@pytest.mark.parametrize(("steps", "pieces"), [(15, 30), (16, 18), (29, 31), (30, 30)])
def test_steps_get_two_pieces_where_the_memory_holds_them(steps: int, pieces: int) -> None:
    path = np.linspace([1.0, 1.0], [4.0, 1.0], steps + 1)[None]
    found = flown(mission_of([[1.0, 1.0]], steps), straight(path))
    assert len(rows(found.files["drone[0]"])) == 1 + pieces
    assert found.certificate.warnings == ()


def test_peak_speed_and_acceleration_are_reported() -> None:
    _, _, found = pair()
    figures = {figure.name: figure for figure in found.certificate.figures}
    assert 1.0 < figures["peak speed"].value < 3.0
    assert 2.0 < figures["peak acceleration"].value < 10.0


def test_many_agents_in_a_small_space_are_flown_without_losing_their_separation() -> None:
    path = wandering(1, 12, 6, need=0.5)
    mission = mission_of(path[:, 0].tolist(), 6, separation=0.29)
    assert flown(mission, straight(path)).certificate.warnings == ()


def test_the_same_plan_gives_the_same_text() -> None:
    mission, trace, found = pair()
    assert flown(mission, trace).files == found.files


def test_what_cannot_be_flown_is_said_with_the_agents() -> None:
    mission = mission_of([[1.0, 1.0], [3.0, 1.0]], 2)
    collision = straight([[[1.0, 1.0], [2.0, 1.0], [3.0, 1.0]], [[3.0, 1.0], [2.0, 1.0], [1.0, 1.0]]])
    found = crazyflie(mission, NOTHING, collision)
    assert isinstance(found, Diagnostic)
    assert found.code is NOT_FLYABLE
    assert "`drone[0]`" in found.message
    assert "`drone[1]`" in found.message


# ------------------------------------------------------------- tampering


def judged(files: dict[str, str]) -> Certificate:
    mission, trace, _ = pair()
    return verify_polynomials(mission, NOTHING, trace, files)


def changed(row: int, column: int, by: float) -> dict[str, str]:
    """The pair's files with one number of the first increased by so much."""
    _, _, found = pair()
    table = rows(found.files["drone[0]"])
    table[row][column] = f"{float(table[row][column]) + by:.9g}"
    return {**found.files, "drone[0]": "\n".join(",".join(row) for row in table) + "\n"}


@settings(max_examples=60)
@given(st.integers(1, 5), st.integers(1, 32), st.sampled_from([-1.0, 1.0]), st.floats(2e-3, 1.0))
def test_a_coefficient_that_was_changed_is_noticed(row: int, column: int, sign: float, by: float) -> None:
    assert not judged(changed(row, column, sign * by)).passed


def test_a_duration_that_was_changed_is_noticed() -> None:
    assert not judged(changed(2, 0, 0.01)).passed


def test_two_files_in_each_others_place_are_noticed() -> None:
    _, _, found = pair()
    swapped = {"drone[0]": found.files["drone[1]"], "drone[1]": found.files["drone[0]"]}
    assert not judged(swapped).passed


def test_a_piece_that_comes_twice_is_noticed() -> None:
    _, _, found = pair()
    lines = found.files["drone[0]"].splitlines()
    twice = "\n".join([*lines[:3], lines[2], *lines[3:]]) + "\n"
    assert not judged({**found.files, "drone[0]": twice}).passed


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", "the first line is not the header"),
        (",".join(COLUMNS) + "\n" + ",".join(["1"] * 33) + "\n", "fewer than two complete rows"),
        (",".join(COLUMNS) + "\n" + (",".join(["1"] * 32) + "\n") * 2, "line 2 has 32 columns, not 33"),
        (",".join(COLUMNS) + "\n" + (",".join(["nan"] * 33) + "\n") * 2, "a number is not finite"),
        (",".join(COLUMNS) + "\n" + (",".join(["1e39"] * 33) + "\n") * 2, "a number is not finite"),
        (",".join(COLUMNS) + "\n" + (",".join(["0"] * 33) + "\n") * 2, "a duration is not positive"),
        (",".join(COLUMNS) + "\n" + (",".join(["x"] * 33) + "\n") * 2, "line 2 has a value that is not a number"),
    ],
)
def test_a_file_that_a_crazyflie_cannot_read_is_refused(text: str, problem: str) -> None:
    found = read(text)
    assert isinstance(found, str)
    assert problem in found
    _, _, good = pair()
    assert not judged({**good.files, "drone[0]": text}).passed
    assert not judged({"drone[1]": good.files["drone[1]"]}).passed


def test_a_file_that_reads_back_holds_the_numbers_it_was_written_with() -> None:
    _, _, found = pair()
    pieces = read(found.files["drone[0]"])
    assert isinstance(pieces, Pieces)
    assert pieces.duration.tolist() == [0.5] * 10
    assert (pieces.coefficients.astype(np.float32) == pieces.coefficients).all()


# ------------------------------------------------------------------- the fit


def test_what_a_course_has_in_common_is_made_once_and_changes_nothing() -> None:
    where, room = course(SQUARE, pieces=2), (np.array([0.0, 0.0]), np.array([10.0, 10.0]))
    shared = fit(where, [], *room, (), splines(where))
    assert isinstance(shared, Fitted)
    assert np.array_equal(shared.points, fitted(where).points)
    assert shared.kept == 3


def test_bounds_that_are_known_not_to_be_kept_are_not_asked_for_in_full_again() -> None:
    where, room = course(SQUARE), (np.array([0.0, 0.0]), np.array([10.0, 10.0]))
    plane = Plane(1, (0.0, 1.0), 0, 0, np.array([0.0, 1.0]), np.full(8, 2.9))
    found = fitted(where, plane)
    again = fit(where, [plane], *room, most=found.kept)
    assert found.kept == 1
    assert isinstance(again, Fitted)
    assert np.array_equal(again.points, found.points)


def course(joint: list[list[float]], radius: float = 0.1, pieces: int = 1) -> Course:
    """One agent through the joints, with so many pieces from each to the next."""
    places = np.repeat(np.array([joint]), pieces, axis=1)[:, : (len(joint) - 1) * pieces + 1]
    fixed = np.arange(places.shape[1]) % pieces == 0
    start = np.repeat(np.array([joint[:-1]]), pieces, axis=1)
    end = np.repeat(np.array([joint[1:]]), pieces, axis=1)
    times = np.arange(places.shape[1]) / pieces
    return Course(times, places, fixed, start, end, np.full(start.shape[:2], radius), np.ones_like(fixed))


def fitted(where: Course, *planes: Plane) -> Fitted:
    found = fit(where, list(planes), np.array([0.0, 0.0]), np.array([10.0, 10.0]))
    assert isinstance(found, Fitted)
    return found


@pytest.mark.parametrize(("radius", "pieces"), [(0.2, 1), (0.1, 1), (0.1, 2), (0.02, 2), (0.001, 2)])
def test_no_control_point_leaves_the_tube(radius: float, pieces: int) -> None:
    points = fitted(course(SQUARE, radius, pieces)).points
    for piece in range(5 * pieces):
        start, end = np.array(SQUARE[piece // pieces]), np.array(SQUARE[piece // pieces + 1])
        square = float((end - start) @ (end - start)) or 1.0
        share = np.clip((points[0, piece].T - start) @ (end - start) / square, 0, 1)[:, None]
        beside = np.linalg.norm(points[0, piece].T - start - share * (end - start), axis=-1)
        assert beside.max() <= radius + 1e-9


def test_a_plane_holds_the_control_points_on_its_side() -> None:
    free = fitted(course(SQUARE)).points
    assert free[0, 0, 1].min() < 2.0 - 1e-3
    plane = Plane(0, (0.0, 1.0), 0, 0, np.array([0.0, 1.0]), np.full(8, 2.0 - 1e-6))
    held = fitted(course(SQUARE), plane).points
    assert held[0, 0, 1].min() >= 2.0 - 2e-6


def test_a_plane_that_the_plan_itself_crosses_is_exceeded_by_no_more_than_it_must_be() -> None:
    assert fitted(course(SQUARE)).excess.max() == 0.0
    plane = Plane(1, (0.0, 1.0), 0, 0, np.array([0.0, 1.0]), np.full(8, 2.9))
    found = fitted(course(SQUARE), plane)
    lowest = found.points[0, 1, 1, 1:].min()
    assert found.excess == pytest.approx([0.0, 2.9 - lowest, 0.0, 0.0, 0.0], abs=1e-6)

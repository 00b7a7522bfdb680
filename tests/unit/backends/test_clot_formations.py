"""Formations through the world: places, figures laid over a team and led round what stands, files behind a leader."""

from __future__ import annotations

import numpy as np
import pytest

from missionc.backends.clot.cost_graph.cost_graph import build
from missionc.backends.clot.schedule.asked_shapes import is_denied
from missionc.backends.clot.schedule.deconflict_space_time import deconflict_space_time
from missionc.backends.clot.schedule.draft import sketch
from missionc.backends.clot.schedule.follow_leader import File, as_file
from missionc.backends.clot.schedule.gather_team import gather_team
from missionc.backends.clot.schedule.geodesics import Geodesics
from missionc.backends.clot.schedule.joint_waypoints import joint_waypoints
from missionc.backends.clot.schedule.places import Places
from missionc.backends.clot.schedule.schedule import Scheduler
from missionc.backends.clot.schedule.tasks import outline
from missionc.backends.clot.schedule.visits import KeyFrame, Schedule
from missionc.base.trace import Array
from missionc.geometry.polylines import split
from missionc.ir import FormationEdge, Mission, Predicate, Region
from missionc.ir.distances.signed_distance import signed_distance
from missionc.ir.kernel.nodes import Atom, Not
from missionc.ir.kernel.walk import postorder
from tests.support.transport_missions import checked, planned

HEAD = """mission a
time step 1 s, horizon 40 s
world (0, 0) to (60, 30)
"""

FILE = """
obstacle rock = box (25, 0) to (30, 18)
team cart[4] { radius 0.5 m  dynamics single_integrator(speed <= 3 m/s)  start line (14, 4) to (2, 4) }
separation 0.5 m
formation file = chain of cart spacing 4 m tolerance 1 m
require kept: always[0, end] file
require through: every cart: eventually[0, 40 s] x >= 45 m
"""

ECHELON = """
region far = box (50, 2) to (58, 28)
obstacle post = disc at (30, 15) radius 2 m
team cart[4] { radius 0.5 m  dynamics single_integrator(speed <= 3 m/s)  start line (4, 6) to (4, 24) }
separation 0.5 m
formation rank = offsets of cart (0, 0), (0, 6), (0, 12), (0, 18) tolerance 0.4 m
require kept: always[0, end] rank
require there: eventually[0, 40 s] every cart: far
"""


def framed(text: str) -> tuple[Mission, Schedule, tuple[KeyFrame, ...], Array]:
    """A mission's first schedule, its key frames, and the sketch through them."""
    mission, kernel = checked(text)
    generator = np.random.default_rng(0)
    geodesics = Geodesics(mission)
    scheduler = Scheduler(mission, outline(build(kernel), mission.steps), geodesics, generator)
    schedule = scheduler.schedule(0.0)
    frames = joint_waypoints(mission, schedule, scheduler, geodesics, generator)
    return mission, schedule, frames, sketch(mission, schedule, frames, geodesics, generator, 0.0)


def the_place(formula: str, axes: int = 2) -> Region | None:
    """Where a formula about one agent holds."""
    corners = ("(0, 0)", "(60, 30)") if axes == 2 else ("(0, 0, 0)", "(60, 30, 10)")
    mission, kernel = checked(
        f"""mission a
time step 1 s, horizon 20 s
world {corners[0]} to {corners[1]}
{"region field = box (1, 1) to (9, 9)" if axes == 2 else ""}
beacon mast = {"(20, 10)" if axes == 2 else "(20, 10, 5)"}
agent scout {{ radius 0.5 m  dynamics single_integrator(speed <= 3 m/s)  start at {corners[0]} }}
require there: scout: eventually[0, 20 s] {formula}
"""
    )
    leaves = [each for each in postorder(build(kernel).formulas) if isinstance(each, Atom | Not)]
    return Places(mission).of(leaves[-1])  # a negation comes after what it negates


# ------------------------------------------------------------------ places


@pytest.mark.parametrize(
    ("formula", "inside", "outside"),
    [
        ("x >= 45 m", (46.0, 3.0), (44.0, 3.0)),
        ("not (y > 10 m)", (46.0, 9.0), (44.0, 11.0)),
        ("x + 2*y <= 12 m", (2.0, 4.0), (4.0, 5.0)),
        ("2*x - y >= 100 m", (59.0, 17.0), (52.0, 10.0)),
        ("distance(mast) <= 2 m", (21.0, 11.0), (22.0, 11.0)),
        ("distance(field) <= 2 m", (5.0, 5.0), (20.0, 5.0)),
        ("field", (5.0, 5.0), (10.0, 5.0)),
    ],
)
def test_what_is_asked_of_one_place_is_a_place(
    formula: str, inside: tuple[float, ...], outside: tuple[float, ...]
) -> None:
    place = the_place(formula)
    assert place is not None
    assert float(signed_distance(np, place.shape, np.array(inside))) < 0
    assert float(signed_distance(np, place.shape, np.array(outside))) > 0


def test_a_height_is_a_place_in_a_volume() -> None:
    place = the_place("altitude >= 2.5 m", axes=3)
    assert place is not None
    assert float(signed_distance(np, place.shape, np.array((5.0, 5.0, 3.0)))) == pytest.approx(-0.5)


@pytest.mark.parametrize("formula", ["speed <= 1 m/s", "distance(mast) >= 2 m", "not field"])
def test_what_holds_nearly_everywhere_or_of_a_speed_is_no_place(formula: str) -> None:
    assert the_place(formula) is None


# ----------------------------------------------------------------- figures


def test_a_rigid_figure_is_laid_over_its_team_so_that_nobody_changes_sides() -> None:
    mission, kernel = checked(
        HEAD
        + """
team cart[9] { radius 0.5 m  dynamics single_integrator(speed <= 3 m/s)  start grid (10, 5) to (30, 25) }
formation block = grid of cart spacing 2 m tolerance 0.2 m
require there: eventually[0, 20 s] block
"""
    )
    shapes: list[Predicate] = [each.predicate for each in postorder(build(kernel).formulas) if isinstance(each, Atom)]
    generator = np.random.default_rng(3)
    scheduler = Scheduler(mission, outline(build(kernel), 40), Geodesics(mission), generator)
    scattered = generator.permutation(np.array(scheduler.starts))
    there = gather_team(shapes, scattered)
    figure = shapes[0].formation
    assert figure is not None
    for edge in figure.edges:
        assert isinstance(edge.target, float)
        assert np.linalg.norm(there[edge.second] - there[edge.first]) == pytest.approx(edge.target, abs=0.05)
    assert there.mean(axis=0) == pytest.approx(scattered.mean(axis=0), abs=0.05)


def test_a_team_gets_into_its_formation_where_there_is_room_for_all_of_it() -> None:
    mission, _, frames, _ = framed(
        HEAD
        + """
obstacle shed = box (12, 12) to (20, 20)
team cart[8] { radius 0.4 m  dynamics single_integrator(speed <= 3 m/s)
  start at (5, 5), (30, 8), (28, 28), (3, 26), (16, 3), (35, 16), (16, 28), (2, 15) }
separation 0.3 m
formation ring = circle of cart radius 3 m tolerance 0.2 m
require there: eventually[0, 30 s] always[0, 3 s] ring
"""
    )
    assert all(frame.shortfall <= 0 for frame in frames)
    room = Geodesics(mission).room_at(frames[1].position)
    assert room.min() >= 0.4


@pytest.mark.parametrize("turn", [1, -1])
def test_a_ring_at_a_given_place_is_turned_and_mirrored_so_that_paths_are_short(turn: int) -> None:
    angles = turn * (np.arange(7) * 2 * np.pi / 7 + 0.9)
    far = np.array([9, 12, 10, 13, 9, 11, 12])
    starts = np.array([30, 15]) + far[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    listed = ", ".join(f"({x:.3f}, {y:.3f})" for x, y in starts)
    _, _, frames, _ = framed(
        HEAD
        + f"""
obstacle tank = disc at (30, 15) radius 2 m
beacon core = (30, 15)
team cart[7] {{ radius 0.3 m  dynamics single_integrator(speed <= 2 m/s)  start at {listed} }}
separation 0.3 m
formation ring = circle of cart radius 5 m tolerance 0.2 m
require watch: eventually[0, 30 s] always[0, 4 s] (ring and every cart: distance(core) <= 5.3 m)
"""
    )
    assert all(frame.shortfall <= 0 for frame in frames)
    travelled = float(np.linalg.norm(frames[1].position - frames[0].position, axis=1).sum())
    assert travelled <= (far - 5).sum() + 7 * 0.6


def test_who_is_asked_for_nothing_stays_while_others_are_carried_to_their_place() -> None:
    _, _, frames, _ = framed(
        HEAD
        + """
region far = box (50, 2) to (58, 28)
team cart[3] { radius 0.5 m  dynamics single_integrator(speed <= 3 m/s)  start line (4, 6) to (4, 14) }
agent post { radius 0.5 m  dynamics single_integrator(speed <= 3 m/s)  start at (8, 25) }
require there: eventually[0, 40 s] every cart: far
"""
    )
    assert all(frame.position[3] == pytest.approx((8, 25), abs=0.1) for frame in frames)


def test_who_is_asked_for_something_later_is_under_way_meanwhile() -> None:
    _, schedule, frames, _ = framed(
        HEAD
        + """
region near = box (14, 2) to (20, 8)
region far  = box (50, 20) to (58, 28)
agent one { radius 0.5 m  dynamics single_integrator(speed <= 3 m/s)  start at (4, 5) }
agent two { radius 0.5 m  dynamics single_integrator(speed <= 3 m/s)  start at (4, 25) }
require soon:  one: eventually[0, 5 s] near
require later: two: eventually[20 s, 25 s] far
"""
    )
    late = max(each.step for each in schedule.appointments)
    first = next(frame for frame in frames if frame.position[0, 0] > 14)
    share = (first.position[1, 0] - 4) / (50 - 4)
    assert share == pytest.approx(first.step / late, abs=0.1)


# ------------------------------------------------------------------- files


def test_a_chain_is_a_file_and_a_star_is_none() -> None:
    edges = [FormationEdge(3, 1, 2.0), FormationEdge(1, 2, 4.0)]
    assert as_file(edges) == File((3, 1, 2), (0.0, 2.0, 4.0))
    assert File((3, 1, 2), (0.0, 2.0, 4.0)).turned == File((2, 1, 3), (0.0, 4.0, 2.0))
    assert as_file([*edges, FormationEdge(1, 4, 2.0)]) is None
    assert as_file([*edges, FormationEdge(3, 2, 2.0)]) is None
    assert as_file([FormationEdge(0, 1, (2.0, 0.0))]) is None


def test_a_path_is_split_at_a_share_of_its_length() -> None:
    route = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 4.0]])
    before, after = split(route, 0.75)
    assert before.tolist() == [[0.0, 0.0], [4.0, 0.0], [4.0, 2.0]]
    assert after.tolist() == [[4.0, 2.0], [4.0, 4.0]]


def test_a_file_goes_round_a_rock_behind_its_leader() -> None:
    mission, _, frames, first = framed(HEAD + FILE)
    assert all(frame.shortfall <= 0 for frame in frames)
    assert first[:, -1, 0].min() >= 45 - 0.1
    gaps = np.linalg.norm(np.diff(first, axis=0), axis=-1)  # (pairs, steps + 1)
    assert gaps.min() > 2.5
    assert gaps.max() < 5.5
    assert Geodesics(mission).room_at(first).min() > 0.3
    # Each comes by where the one before it was.
    for leader, follower in ((0, 1), (1, 2), (2, 3)):
        behind = np.linalg.norm(first[follower][:, None] - first[leader][None], axis=-1).min(axis=1)
        assert np.median(behind[first[follower][:, 0] > 14]) < 1.0


def test_a_file_through_a_bend_is_planned() -> None:
    planned(HEAD + FILE)


def test_a_rigid_team_goes_where_all_of_it_has_room() -> None:
    mission, _, frames, first = framed(HEAD + ECHELON)
    assert all(frame.shortfall <= 0 for frame in frames)
    assert Geodesics(mission).room_at(first).min() > 0.4
    planned(HEAD + ECHELON)


# ---------------------------------------------------------------- give way

SWAP = """
obstacle low  = box (28, 0) to (32, 13)
obstacle high = box (28, 17) to (32, 30)
team cart[6] { radius 0.5 m  dynamics single_integrator(speed <= 3 m/s)
  start at (10, 5), (10, 15), (10, 25), (50, 5), (50, 15), (50, 25)
  finish at (50, 25), (50, 15), (50, 5), (10, 25), (10, 15), (10, 5) }
separation 0.5 m
"""


def test_who_would_meet_in_a_gate_give_way() -> None:
    mission, _, _, first = framed(HEAD + SWAP)
    geodesics = Geodesics(mission)
    apart = deconflict_space_time(mission, first, 0, range(6), geodesics)

    def nearest(position: Array) -> float:
        between = np.linalg.norm(position[:, None] - position[None], axis=-1)
        return float(between[~np.eye(6, dtype=np.bool_)].min())

    assert nearest(first) < 0.5
    assert nearest(apart) > 1.2
    assert np.array_equal(apart[:, [0, -1]], first[:, [0, -1]])
    assert np.linalg.norm(np.diff(apart, axis=1), axis=-1).max() <= 3.0
    assert geodesics.room_at(apart).min() > 0.2


def test_who_meets_nobody_keeps_its_motion() -> None:
    mission, _, _, first = framed(HEAD + SWAP)
    assert np.array_equal(
        deconflict_space_time(mission, first, 0, [0, 2], Geodesics(mission))[[1, 3, 4, 5]], first[[1, 3, 4, 5]]
    )
    assert np.array_equal(deconflict_space_time(mission, first, 0, [1], Geodesics(mission)), first)


def test_a_team_stays_where_it_came_together_as_long_as_it_has_to() -> None:
    _, _, frames, first = framed(
        HEAD
        + """
region east = box (40, 2) to (58, 28)
team cart[4] { radius 0.5 m  dynamics single_integrator(speed <= 3 m/s)  start line (4, 6) to (4, 24) }
separation 0.5 m
formation block = grid of cart spacing 3 m tolerance 0.3 m
require first: eventually[0, 15 s] always[0, 3 s] block
require then:  eventually[25 s, 40 s] every cart: east
"""
    )
    formed = frames[1].step
    assert [frame.step for frame in frames][:3] == [0, formed, formed + 3]
    assert first[:, formed + 3] == pytest.approx(first[:, formed], abs=0.1)


def test_who_is_released_from_a_formation_goes_on_at_once() -> None:
    _, schedule, frames, first = framed(
        HEAD
        + """
region dock = box (50, 2) to (58, 28)
team cart[3] { radius 0.5 m  dynamics single_integrator(speed <= 3 m/s)  start at (4, 6), (10, 20), (4, 26) }
separation 0.5 m
formation ring = circle of cart radius 3 m tolerance 0.3 m
require first: eventually[0, 15 s] always[0, 3 s] ring
require then0: cart[0]: eventually[20 s, 28 s] dock
require then1: cart[1]: eventually[20 s, 34 s] dock
"""
    )
    last = max(each.step for each in schedule.appointments)
    assert all(frame.shortfall <= 0 for frame in frames)
    assert np.linalg.norm(np.diff(first[:, : last + 1], axis=1), axis=-1).max() < 4.0


RELEASED = """
team cart[4] { radius 0.5 m  dynamics single_integrator(speed <= 3 m/s)  start line (4, 6) to (4, 24) }
separation 0.5 m
formation rank = offsets of cart (0, 0), (0, 6), (0, 12), (0, 18) tolerance 0.4 m
require kept: rank until[5 s, 15 s] (cart[0]: x >= 30 m)
"""


def test_a_formation_kept_up_to_a_moment_is_still_one_at_that_moment() -> None:
    _, schedule, frames, first = framed(HEAD + RELEASED)
    (appointment,) = schedule.appointments
    (frame,) = (frame for frame in frames if frame.step == appointment.step)
    rank = np.array([(0.0, 6.0 * place) for place in range(4)])
    assert frame.position - frame.position[0] == pytest.approx(rank, abs=0.5)
    assert first[:, appointment.step // 2] - first[0, appointment.step // 2] == pytest.approx(rank, abs=0.5)


def test_who_keeps_a_formation_goes_along_and_needs_time_for_what_comes_after() -> None:
    _, schedule, _, _ = framed(HEAD + RELEASED + "require back: cart[3]: eventually[12 s, 24 s] x <= 9 m\n")
    out, back = sorted(each.step for each in schedule.appointments)
    assert back - out >= 21 / 3


TUGS = """
region berth0 = box (2, 24) to (10, 29)
region berth1 = box (40, 24) to (48, 29)
agent barge { radius 0.5 m  dynamics single_integrator(speed <= 2 m/s)  start at (2, 2) }
team tug[3] { radius 0.5 m  dynamics single_integrator(speed <= 3 m/s)  start at (26, 12), (22, 15), (22, 9) }
separation 0.5 m
formation wedge = offsets of tug (0, 0), (-4, 3), (-4, -3) tolerance 0.4 m
"""
THROUGH = "require wait: wedge until[5 s, 25 s] (barge: x >= 30 m)\n"


def steps_of(schedule: Schedule) -> list[int]:
    """When each requirement's event is, in the order in which they are written."""
    return [each.step for each in sorted(schedule.appointments, key=lambda each: each.visit.key)]


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_who_is_to_be_where_a_formation_cannot_be_goes_there_after_it(seed: int) -> None:
    berths = "require berths: eventually[8 s, 38 s] always[0, 2 s] ((tug[0]: berth0) and (tug[1]: berth1))\n"
    mission, kernel = checked(HEAD + TUGS + THROUGH + berths)
    asked, geodesics = outline(build(kernel), mission.steps), Geodesics(mission)
    schedule = Scheduler(mission, asked, geodesics, np.random.default_rng(seed)).schedule(0.4 if seed else 0.0)
    let_go, berthed = steps_of(schedule)
    assert schedule.late == 0
    assert berthed - let_go >= 20 / 3


def test_two_formations_that_differ_are_one_after_the_other_with_time_in_between() -> None:
    other = "formation other = offsets of tug (0, 0), (4, 12), (4, -12) tolerance 0.4 m\n"
    _, schedule, _, _ = framed(
        HEAD
        + TUGS
        + other
        + "require first: always[0, 10 s] wedge\nrequire then: eventually[0, 30 s] other\n"
        + "require soon: barge: eventually[0, 3 s] x >= 6 m\n"
    )
    then, _ = steps_of(schedule)
    assert then >= 10 + 9 / 3


@pytest.mark.parametrize(
    ("goals", "denied"),
    [
        ("(tug[0]: berth0) and (tug[1]: berth1)", True),
        ("(tug[0]: berth1) and (tug[1]: berth1)", False),
        ("(tug[1]: berth0) and (barge: berth1)", False),
    ],
)
def test_goals_deny_a_formation_that_cannot_be_where_they_are(goals: str, denied: bool) -> None:
    mission, kernel = checked(
        HEAD + TUGS + f"require kept: always[0, 5 s] wedge\nrequire go: eventually[8 s, end] ({goals})\n"
    )
    scheduler = Scheduler(mission, outline(build(kernel), mission.steps), Geodesics(mission), np.random.default_rng(0))
    (visit,) = (each.visit for each in scheduler.schedule(0.0).appointments)
    (shape,) = scheduler.formations
    assert is_denied(shape, visit.come, (), scheduler.goals) == denied


def test_what_holds_up_to_a_nested_event_is_gone_to_for_the_event_around_it() -> None:
    inner = "(barge: berth1) until[0, 10 s] (wedge until[0, 10 s] (tug[0]: x >= 30 m))"
    nested = f"require nested: eventually[0, 20 s] ({inner})\n"
    _, schedule, _, _ = framed(HEAD + TUGS + nested)
    assert steps_of(schedule)[0] >= 20


def test_who_meets_is_in_the_key_frame_where_the_schedule_has_it() -> None:
    meet = "require meet: eventually[20 s, 38 s] always[0, 2 s] distance(tug[2], barge) <= 3 m\n"
    _, schedule, frames, _ = framed(HEAD + TUGS + THROUGH + meet)
    (meeting,) = (each for each in schedule.appointments if each.visit.come.meetings)
    (frame,) = (frame for frame in frames if frame.step == meeting.step)
    for place in meeting.places:
        assert frame.position[place.agent] == pytest.approx(place.point, abs=2)


def test_a_team_in_formation_is_under_way_while_another_agent_is_somewhere() -> None:
    _, _, frames, first = framed(
        HEAD
        + RELEASED.replace("until[5 s, 15 s]", "until[20 s, 25 s]").replace("x >= 30 m", "x >= 50 m")
        + "agent van { radius 0.5 m  dynamics single_integrator(speed <= 3 m/s)  start at (50, 28) }\n"
        + "region stop = box (54, 26) to (59, 29)\nrequire look: van: eventually[10 s, 11 s] stop\n"
    )
    assert all(frame.shortfall <= 0 for frame in frames)
    assert np.linalg.norm(np.diff(first[:4, :24], axis=1), axis=-1).max() < 3.0

"""The task layer of the transport backend: who goes where, when, and what comes of it."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

pytest.importorskip("torch")

from missionc.backends.clot.cost_graph.cost_graph import build
from missionc.backends.clot.optimise.control_points import splines, trace
from missionc.backends.clot.optimise.obstacle_index import carved
from missionc.backends.clot.schedule.draft import sketch
from missionc.backends.clot.schedule.geodesics import Geodesics, eased
from missionc.backends.clot.schedule.joint_waypoints import joint_waypoints
from missionc.backends.clot.schedule.schedule import Scheduler
from missionc.backends.clot.schedule.tasks import outline
from missionc.backends.clot.schedule.timetable import PerturbedDistances
from missionc.backends.clot.schedule.tours import tours
from missionc.backends.clot.schedule.visits import Appointment, Schedule
from missionc.backends.hybrid.backend import first_order
from missionc.ir import Box, DoubleIntegrator, Mission, SingleIntegrator, Unicycle
from missionc.ir.distances.signed_distance import signed_distance
from missionc.ir.kernel.nodes import Kernel
from missionc.ir.lower.unroll_past import looking_ahead
from tests.support.transport_missions import checked, planned

YARD = """\
mission yard
time step 1 s, horizon 100 s
world (0, 0) to (40, 20)
region north = box (2, 14) to (8, 18)
region south = box (2, 2) to (8, 6)
region east = box (32, 8) to (38, 12)
beacon mast = (35, 3)
team rover[3] { radius 0.3 m  dynamics single_integrator(speed <= 1 m/s)  start at (5, 10), (20, 10), (36, 18) }
separation 0.2 m
"""


def scheduled(text: str) -> tuple[Mission, Scheduler, Schedule]:
    mission, kernel = checked(text)
    asked, geodesics = outline(build(kernel), mission.steps), Geodesics(mission)
    scheduler = Scheduler(mission, asked, geodesics, np.random.default_rng(0))
    return mission, scheduler, scheduler.schedule(0.0)


def named(scheduler: Scheduler, schedule: Schedule, name: str) -> list[Appointment]:
    """The appointments of a requirement, in time."""
    tasks = scheduler.outline.tasks
    own = [each for each in schedule.appointments if each.visit.key[0] >= 0]
    return sorted((each for each in own if tasks[each.visit.key[0]].name == name), key=lambda each: each.step)


def test_three_meet_one_after_the_other_where_nobody_says() -> None:
    meetings = "".join(
        f"require meet{one}: eventually[{low} s, {high} s] distance(rover[{one}], rover[{one + 1}]) <= 2\n"
        for one, low, high in ((0, 0, 40), (1, 20, 70))
    )
    mission, scheduler, schedule = scheduled(YARD + meetings)
    assert schedule.late == 0
    for one in range(2):
        (meeting,) = named(scheduler, schedule, f"meet{one}")
        places = {place.agent: place.point for place in meeting.places}
        assert set(places) == {one, one + 1}
        assert 0.8 <= np.linalg.norm(places[one] - places[one + 1]) <= 2
        way = np.linalg.norm(places[one] - scheduler.starts[one])
        assert meeting.step * mission.step >= way - 2
    planned(YARD + meetings)


def test_a_comparison_is_a_place_and_a_conjunction_is_where_both_hold() -> None:
    goals = "require far: rover[0]: eventually[0, end] (x >= 30 m and y <= 8 m)\n"
    _, scheduler, schedule = scheduled(YARD + goals)
    (visit,) = named(scheduler, schedule, "far")
    (place,) = visit.places
    assert place.point[0] >= 30
    assert place.point[1] <= 8
    assert visit.step >= 25


@pytest.mark.parametrize(
    "goal", ["distance(mast) <= 2 m", "distance(east) <= 1 m", "not (x <= 30 m)", "(x >= 38 m or south)"]
)
def test_a_goal_holds_where_somebody_goes_for_it(goal: str) -> None:
    mission, kernel = checked(YARD + f"require there: rover[1]: eventually[0, end] {goal}\n")
    scheduler = Scheduler(mission, outline(build(kernel), mission.steps), Geodesics(mission), np.random.default_rng(0))
    (appointment,) = scheduler.schedule(0.0).appointments
    (place,) = appointment.places
    ((agent, nodes),) = appointment.visit.come.goals
    margin = scheduler.goals.margin(agent, nodes, place.point[None])
    assert margin is not None
    assert margin[0] >= 0


def test_ways_keep_to_where_an_agent_has_to_be_all_the_time() -> None:
    lane = "region lane = box (0, 8) to (40, 12) + box (30, 0) to (40, 20)\n"
    asked = (
        "require kept: rover[0]: always[0, end] lane\nrequire go: rover[0]: eventually[0, end] distance(mast) <= 1 m\n"
    )
    _, scheduler, schedule = scheduled(YARD + lane + asked)
    (visit,) = named(scheduler, schedule, "go")
    straight = np.hypot(30, 7) - 1
    assert visit.step >= 1.05 * straight


AISLES = """\
mission aisles
time step 1 s, horizon 60 s
world (0, 0) to (30, 12)
obstacle one = box (4, 3) to (26, 4)
obstacle two = box (4, 5.4) to (26, 6.6)
obstacle three = box (4, 7.6) to (26, 9)
team rover[1] { radius 0.4 m  dynamics single_integrator(speed <= 1 m/s)  start at (2, 4.7) }
require along: rover[0]: eventually[0, 60 s] x >= 24
"""


@pytest.mark.parametrize("wanted", [0.5, 0.7, 0.9, 2.0])
def test_a_way_with_more_room_does_not_end_on_the_other_side_of_a_wall(wanted: float) -> None:
    mission, _ = checked(AISLES)
    geodesics = Geodesics(mission)
    for y in (4.7, 7.1):
        way = geodesics.way(np.array([2.0, y]), np.array([15.0, y]), wanted, 0.4)
        assert way is not None
        points = np.concatenate([np.linspace(here, there, 100) for here, there in pairwise(way)])
        assert geodesics.room_at(points).min() >= 0.4 - geodesics.cell / 2


@pytest.mark.parametrize(
    "limit",
    [
        "require slow: every rover: always[0, end] (rover in slow_zone implies speed <= 0.25)",
        "require slow: every rover: always[0, end] (speed <= 0.25 or not slow_zone)",
        "require slow: every rover: always[0, end] not (slow_zone and speed > 0.25)",
    ],
)
def test_a_way_through_a_place_where_speed_is_limited_takes_longer(limit: str) -> None:
    zone = "region slow_zone = box (10, 0) to (18, 20)\n"
    visit = "require seen: rover[0]: eventually[0, 90 s] (x >= 25 and y <= 12)\n"
    text = YARD + zone + visit + limit.replace("rover in ", "")
    mission, scheduler, schedule = scheduled(text)
    (seen,) = named(scheduler, schedule, "seen")
    assert seen.step >= 12 + 8 / 0.25
    assert schedule.late == 0
    _, motion = tours(mission, schedule, scheduler.timed, Geodesics(mission), np.random.default_rng(0))
    speed = np.linalg.norm(np.diff(motion[0], axis=0), axis=1)
    inside = (motion[0, :-1, 0] > 10.5) & (motion[0, 1:, 0] < 17.5)
    assert inside.any()
    assert speed[inside].max() <= 0.25
    planned(text)


def test_a_place_where_speed_is_limited_is_gone_round_where_that_is_sooner() -> None:
    zone = "region slow_zone = box (10, 6) to (18, 20)\n"
    limit = "require slow: every rover: always[0, end] (slow_zone implies speed <= 0.2)\n"
    text = YARD + zone + limit + "require seen: rover[0]: eventually[0, 60 s] x >= 25\n"
    mission, scheduler, schedule = scheduled(text)
    _, motion = tours(mission, schedule, scheduler.timed, Geodesics(mission), np.random.default_rng(0))
    inside = (motion[0, :, 0] > 10.5) & (motion[0, :, 0] < 17.5) & (motion[0, :, 1] > 6.5)
    assert not inside.any()


@pytest.mark.parametrize(
    ("closed", "until", "deadline", "round_it"),
    [
        ("always[6 s, 60 s]", 60, 60, True),  # the way round is sooner
        ("always[6 s, 15 s]", 15, 60, False),  # to wait is sooner
        ("always[40 s, 90 s]", 90, 60, False),  # it is through in time
    ],
)
def test_a_place_that_is_closed_for_a_while_is_gone_round_or_waited_for(
    closed: str, until: int, deadline: int, round_it: bool
) -> None:
    walls = "obstacle north_wall = box (12, 11) to (24, 20)\nobstacle south_wall = box (12, 2) to (24, 9)\n"
    gate = "region gate = box (12, 9) to (24, 11)\n"
    barred = f"require barred: {closed} not some rover: touches(gate)\n"
    shop = "region shop = box (26, 9) to (30, 20)\n"
    visit = f"require seen: rover[0]: eventually[0, {deadline} s] shop\n"
    mission, scheduler, schedule = scheduled(
        YARD.replace("(20, 10)", "(34, 14)") + walls + gate + shop + barred + visit
    )
    (seen,) = named(scheduler, schedule, "seen")
    assert schedule.late == 0
    _, motion = tours(mission, schedule, scheduler.timed, Geodesics(mission), np.random.default_rng(0))
    assert motion[0, seen.step, 0] >= 26
    inside = (motion[0, :, 0] > 12) & (motion[0, :, 0] < 24)
    assert (motion[0, inside, 1] < 3).all() == round_it
    begin = int(closed.removeprefix("always[").split()[0])
    at_the_gate = np.flatnonzero(inside & (motion[0, :, 1] > 9))
    assert not ((at_the_gate >= begin) & (at_the_gate <= until)).any()


@pytest.mark.parametrize(("limit", "most"), [("not (at least 3 rover: east)", 2), ("at least 4 rover: not east", 1)])
def test_no_more_visit_a_place_at_a_time_than_may_be_there(limit: str, most: int) -> None:
    five = YARD.replace("rover[3]", "rover[5]").replace("(5, 10), (20, 10), (36, 18)", "grid (4, 4) to (20, 16)")
    five = five.replace("start at", "start")
    text = five + f"require few: always[0, end] {limit}\nrequire seen: every rover: eventually[0, 100 s] east\n"
    _, scheduler, schedule = scheduled(text)
    steps = [each.step for each in named(scheduler, schedule, "seen")]
    assert len(steps) == 5
    assert schedule.late == 0
    assert max(sum(abs(one - other) <= 1 for other in steps) for one in steps) <= most


def test_two_who_may_not_be_in_a_place_together_come_one_after_the_other() -> None:
    text = YARD + "require apart: always[0, end] not ((rover[0]: north) and (rover[1]: north))\n"
    text += "require both: every rover: eventually[0, 90 s] always[0, 5 s] north\n"
    _, scheduler, schedule = scheduled(text)
    step = {each.visit.event.holds[0].agent: each.step for each in named(scheduler, schedule, "both")}
    assert abs(step[0] - step[1]) > 5
    planned(text)


@pytest.mark.parametrize(("here", "there"), [("x <= 10 m", "x >= 30 m"), ("north", "(y <= 12 m and east)")])
def test_who_has_to_be_somewhere_until_another_has_come_takes_its_way_after_that(here: str, there: str) -> None:
    waits = "require waits: (rover[0]: HERE) until[10 s, 60 s] (rover[2]: x <= 22 m)\n".replace("HERE", here)
    goes = f"require goes: rover[0]: eventually[0, 70 s] {there}\n"
    _, scheduler, schedule = scheduled(YARD.replace("(5, 10)", "(5, 16)") + waits + goes)
    (until,), (visit,) = (named(scheduler, schedule, name) for name in ("waits", "goes"))
    assert schedule.late == 0
    assert visit.step >= until.step + 18  # the two are 20 m apart at 1 m/s, or a little more


@pytest.mark.parametrize(("least", "most"), [(0.0, 100), (0.5, 70)])
def test_who_cannot_stand_still_does_not_dawdle_on_its_way(least: float, most: int) -> None:
    text = YARD.replace("single_integrator(speed <= 1 m/s)", f"unicycle(speed {least}..1 m/s)")
    _, scheduler, schedule = scheduled(text + "require goes: rover[0]: eventually[0, 100 s] east\n")
    (visit,) = named(scheduler, schedule, "goes")
    assert (visit.step > 60) is (least == 0.0)  # halfway between the soonest and the latest, as it was 27 m away
    assert visit.step <= most


def test_who_has_to_stay_near_somebody_for_a_while_goes_along_and_is_free_again() -> None:
    escort = "require escort: always[20 s, 60 s] distance(rover[0], rover[1]) <= 3 m\n"
    there = "require there: rover[1]: eventually[0, 60 s] east\n"
    back = "require back: rover[0]: always[95 s, end] x <= 10 m\n"
    mission, scheduler, schedule = scheduled(YARD + escort + there + back)
    assert schedule.late == 0
    _, position = tours(mission, schedule, scheduler.timed, Geodesics(mission), np.random.default_rng(0))
    away = np.linalg.norm(position[0] - position[1], axis=-1)
    assert away[20:61].max() <= 3.0
    assert position[1, :61, 0].max() >= 32.0
    assert position[0, 95:, 0].max() <= 10.0
    assert np.linalg.norm(np.diff(position[0], axis=0), axis=-1).max() <= 1.5  # nobody jumps


FUEL = """\
mission fuel
time step 5 s, horizon 2 min
world (0, 0) to (5 km, 4 km)
region lane = box (400, 1700) to (4700, 2300)
region east = disc at (4400, 900) radius 300 m
agent tanker { radius 15 m  dynamics unicycle(speed 25..50 m/s, turn <= 6 deg/s)  start at (600, 2000) }
team jet[2] {
  radius   5 m
  dynamics unicycle(speed 20..60 m/s, turn <= 12 deg/s)
  start    at (300, 300), (600, 3700)
}
separation 20 m
let on_hose0 = distance(tanker, jet[0]) <= 80 m
let on_hose1 = distance(tanker, jet[1]) <= 80 m
require track: tanker: always[0, end] lane
require fuel0: eventually[0, 90 s] always[0, 20 s] on_hose0
"""


def test_those_who_cannot_stand_still_go_on_while_they_meet_and_towards_what_is_next() -> None:
    text = FUEL + "require there: jet[0]: eventually[0, end] east\n"
    mission, scheduler, schedule = scheduled(text)
    assert schedule.late == 0
    ((fuel,), (there,)) = (named(scheduler, schedule, name) for name in ("fuel0", "there"))
    assert fuel.step < there.step
    gone = []
    for place in fuel.places:
        assert place.leaves is not None
        gone.append(place.leaves - place.point)
        way = float(np.linalg.norm(place.point - scheduler.starts[place.agent]))
        least = 25 if place.agent == 0 else 20
        assert way >= 0.9 * least * fuel.step * mission.step - 80  # nobody has to fly about before they meet
        assert 0 < np.linalg.norm(gone[-1]) <= 20 * 60
    assert np.allclose(gone[0], gone[1])
    assert gone[0][0] > 0
    _, motion = tours(mission, schedule, scheduler.timed, Geodesics(mission), np.random.default_rng(0))
    met = np.linalg.norm(motion[0] - motion[1], axis=-1)[fuel.step : fuel.step + 5]
    assert met.max() <= 80
    planned(text)


def test_meetings_of_which_one_at_a_time_may_be_are_one_after_the_other() -> None:
    text = FUEL + "require fuel1: eventually[0, 90 s] always[0, 20 s] on_hose1\n"
    text += "require one: always[0, end] not (on_hose0 and on_hose1)\n"
    _, scheduler, schedule = scheduled(text)
    ((one,), (other,)) = (named(scheduler, schedule, name) for name in ("fuel0", "fuel1"))
    assert abs(one.step - other.step) > 4
    planned(text)


def test_two_take_turns_where_one_alone_is_not_back_in_time() -> None:
    text = YARD.replace("step 1 s, horizon 100 s", "step 2 s, horizon 6 min").replace("(40, 20)", "(100, 60)")
    text = text.replace("rover[3]", "rover[2]").replace("(5, 10), (20, 10), (36, 18)", "(10, 25), (10, 35)")
    text = text.replace("speed <= 1 m/s", "speed <= 2 m/s")
    seen = "require seen: always[60 s, 300 s] eventually[0, 50 s] (some rover: x >= 80 m)\n"
    home = "require home: every rover: always[0, 260 s] eventually[0, 90 s] x <= 25 m\n"
    _, scheduler, schedule = scheduled(text + seen + home)
    assert {appointment.places[0].agent for appointment in named(scheduler, schedule, "seen")} == {0, 1}


def test_so_many_come_as_are_asked_for_and_others_than_those_who_stay() -> None:
    fleet = YARD.replace("rover[3]", "rover[8]").replace(
        "start at (5, 10), (20, 10), (36, 18)", "start grid (10, 6) to (26, 14)"
    )
    asked = """\
region home = box (8, 4) to (28, 16)
require stay:  always[0, end] at least 2 rover: home
require share: eventually[0, 80 s] always[0, 5 s] ((at least 3 rover: north) and (at least 3 rover: east))
"""
    mission, scheduler, schedule = scheduled(fleet + asked)
    (share,) = named(scheduler, schedule, "share")
    assert len({place.agent for place in share.places}) == 6
    _, motion = tours(mission, schedule, scheduler.timed, Geodesics(mission), np.random.default_rng(0))
    there = motion[:, share.step]
    apart = np.linalg.norm(there[:, None] - there[None], axis=-1) + np.eye(8) * 9
    assert apart.min() > 0.6
    planned(fleet + asked)


def test_a_recurrence_is_a_chain_in_which_no_two_are_too_far_apart() -> None:
    watch = "require watch: always[0, 70 s] eventually[0, 30 s] some rover: north\n"
    _, scheduler, schedule = scheduled(YARD + watch)
    steps = [each.step for each in named(scheduler, schedule, "watch")]
    assert steps[0] <= 30
    assert steps[-1] >= 70
    assert max(later - earlier for earlier, later in pairwise(steps)) <= 31
    planned(YARD + watch)


def test_what_recurs_may_have_several_visits_and_those_who_come_take_turns() -> None:
    """From north to south again and again takes one rover 25 s and more, two in turns do it."""
    round_ = "require round: always[0, 40 s] eventually[0, 20 s] some rover: (north and eventually[5 s, 20 s] south)\n"
    starts = YARD.replace("(36, 18)", "(12, 16)").replace("(20, 10)", "(12, 12)")
    _, scheduler, schedule = scheduled(starts + round_)
    visits = named(scheduler, schedule, "round")
    assert schedule.late == 0
    assert len(visits) % 2 == 0
    first, *others = (visit for visit in visits if visit.visit.event.again)
    assert first.step <= 20
    assert others[-1].step >= 40
    for visit in visits:
        (place,) = visit.places
        assert place.point[1] > 13 if visit.visit.event.again else place.point[1] < 7
    assert len({place.agent for visit in visits for place in visit.places}) > 1
    planned(starts + round_)


KILNS = """\
mission kilns
time step 1 s, horizon 180 s
world (0, 0) to (44, 30)
region kiln_a = disc at (6, 6) radius 2.5 m
region kiln_b = disc at (6, 24) radius 2.5 m
region kiln_c = disc at (38, 6) radius 2.5 m
region kiln_d = disc at (38, 24) radius 2.5 m
region store = box (18, 2) to (26, 8)
team hand[2] { radius 0.4 m  dynamics unicycle(speed 0..1 m/s, turn <= 45 deg/s)  start at (20, 5), (24, 5) }
separation 0.3 m
"""
ROUNDS = "".join(
    f"require {kiln}: some hand: always[0, 130 s] eventually[0, 45 s] kiln_{kiln}\n" for kiln in ("a", "b", "c", "d")
)


def test_two_who_would_cross_are_in_each_others_place() -> None:
    _, scheduler, schedule = scheduled(KILNS + ROUNDS)
    for kiln, hand in (("a", 0), ("b", 0), ("c", 1), ("d", 1)):
        visits = named(scheduler, schedule, kiln)
        assert len(visits) == 4
        assert {place.agent for visit in visits for place in visit.places} == {hand}
    planned(KILNS + ROUNDS)


def test_so_many_come_again_and_again() -> None:
    both = "require both: always[0, 120 s] eventually[0, 60 s] at least 2 hand: store\n"
    _, scheduler, schedule = scheduled(KILNS + both)
    visits = named(scheduler, schedule, "both")
    assert len(visits) >= 3
    assert all({place.agent for place in visit.places} == {0, 1} for visit in visits)


PIT = (
    YARD
    + """
team barrow[3] { radius 0.3 m  dynamics single_integrator(speed <= 1 m/s)  start at (12, 2), (12, 4), (12, 6) }
formation row = line of barrow spacing 2 m tolerance 0.4 m
require haul: row until[30 s, 60 s] (every barrow: x >= 24 m)
require again: always[0, 70 s] eventually[0, 30 s] (some rover: north)
require south: rover[2]: eventually[0, 80 s] south
"""
)


def test_who_is_tied_to_nobody_goes_on_a_tour_where_others_keep_a_formation() -> None:
    mission, scheduler, schedule = scheduled(PIT)
    assert scheduler.tied == {3, 4, 5}
    chain = named(scheduler, schedule, "again")
    assert len(chain) >= 3
    loose = {place.agent for each in chain for place in each.places}
    assert loose <= {0, 1, 2}
    geodesics, generator = Geodesics(mission), np.random.default_rng(0)
    motion = tours(mission, schedule, scheduler.timed, geodesics, generator)[1]
    toured = {agent: motion[agent] for agent in range(3)}
    frames = joint_waypoints(mission, schedule, scheduler, geodesics, generator, toured=toured)
    (haul,) = named(scheduler, schedule, "haul")
    assert {frame.step for frame in frames} == {0, haul.step, mission.steps}
    first = sketch(mission, schedule, frames, geodesics, generator, 0.0, toured)
    assert np.array_equal(first[:3], motion[:3])
    assert (first[3:, haul.step, 0] >= 23.5).all()
    planned(PIT)


def test_who_always_has_to_be_near_somebody_in_a_formation_goes_on_no_tour() -> None:
    _, scheduler, _ = scheduled(PIT + "require near: always[0, end] distance(rover[0], barrow[0]) <= 20 m\n")
    assert scheduler.tied == {0, 3, 4, 5}


def test_what_nearly_every_place_satisfies_again_and_again_leads_nobody_anywhere() -> None:
    _, _, schedule = scheduled(YARD + "require move: every rover: always[0, 80 s] eventually[0, 10 s] not north\n")
    assert schedule.appointments == ()


def test_what_holds_from_some_time_on_is_gone_to_in_time() -> None:
    asked = "require late: rover[0]: always[80 s, end] east\nrequire look: rover[0]: eventually[0, 40 s] south\n"
    mission, scheduler, schedule = scheduled(YARD + asked)
    (fixed,) = [each for each in schedule.appointments if each.visit.fixed]
    assert (fixed.step, fixed.visit.lasts) == (80, 20)
    _, motion = tours(mission, schedule, scheduler.timed, Geodesics(mission), np.random.default_rng(0))
    assert np.linalg.norm(np.diff(motion[0], axis=0), axis=1).max() <= 1


def test_two_tasks_that_compete_for_one_agent_go_to_two() -> None:
    asked = "".join(
        f"require {name}: some rover: eventually[10 s, 12 s] always[0, 3 s] {name}\n"
        for name in ("north", "south", "east")
    )
    _, scheduler, schedule = scheduled(YARD.replace("(20, 10)", "(6, 10)") + asked)
    assert schedule.late == 0
    assert len({named(scheduler, schedule, name)[0].places[0].agent for name in ("north", "south", "east")}) == 3


def test_the_option_that_is_nearer_and_cannot_be_reached_is_not_taken() -> None:
    wall = "obstacle wall = box (0, 7) to (40, 8)\n"
    _, scheduler, schedule = scheduled(YARD + wall + "require go: rover[0]: eventually[0, 90 s] (south or east)\n")
    (visit,) = named(scheduler, schedule, "go")
    assert visit.places[0].point[1] > 8


def test_a_conditional_requirement_brings_who_has_to_be_there() -> None:
    asked = """\
require look: rover[0]: eventually[0, 60 s] always[0, 5 s] south
require near: always[0, end] ((rover[0]: south) implies distance(rover[0], rover[1]) <= 3 m)
"""
    _, scheduler, schedule = scheduled(YARD + asked)
    (look,) = named(scheduler, schedule, "look")
    assert {place.agent for place in look.places} == {0, 1}
    planned(YARD + asked)


PATROL = """\
mission patrol
time step 1 s, horizon 60 s
world (0, 0, 0) to (20, 12, 8)
region low = box (1, 1) to (4, 4) height 1 m..2 m
region high = box (15, 7) to (19, 11) height 5 m..7 m
obstacle shelf = box (8, 0) to (9, 9) height 0 m..4 m
team drone[2] {
  radius 0.2 m  dynamics double_integrator(speed <= 2 m/s, acceleration <= 1 m/s^2)  start at (5, 6, 2), (12, 6, 2)
}
separation 0.3 m
require l: always[0, 40 s] eventually[0, 20 s] some drone: low
require h: always[0, 40 s] eventually[0, 20 s] some drone: high
"""


def test_a_patrol_in_a_volume_with_momentum_is_planned() -> None:
    planned(PATROL)


def test_a_door_cut_out_of_a_wall_is_as_wide_as_it_is() -> None:
    text = YARD + "obstacle wall = box (0, 7) to (40, 7.4) - box (10, 6.9) to (11.2, 7.5)\n"
    mission, _ = checked(text + "require go: rover[0]: eventually[0, 90 s] south\n")
    pieces = carved(mission.obstacles[0])
    assert len(pieces) == 2
    middle = np.array([10.6, 7.2])
    assert min(float(signed_distance(np, piece.shape, middle)) for piece in pieces) == pytest.approx(0.6)


def test_boxes_that_are_left_are_what_the_difference_is() -> None:
    text = "region r = box (0, 0) to (9, 9) - box (2, 3) to (4, 12) - (box (5, 5) to (6, 6) + box (8, 8) to (20, 20))\n"
    text = text.replace("region r", "obstacle r")
    far = YARD.replace("start at (5, 10), (20, 10), (36, 18)", "start at (25, 10), (28, 10), (36, 18)")
    mission, _ = checked(far + text + "require go: rover[0]: eventually[0, 90 s] east\n")
    obstacle = mission.obstacles[0]
    pieces = carved(obstacle)
    assert all(isinstance(piece.shape, Box) for piece in pieces)
    points = np.random.default_rng(0).uniform(-1, 11, (2000, 2))
    whole = np.asarray(signed_distance(np, obstacle.shape, points)) < 0
    left = np.min([np.asarray(signed_distance(np, piece.shape, points)) for piece in pieces], axis=0) < 0
    assert (whole == left).all()


@pytest.mark.parametrize(("step", "pace"), [(0.5, 0.75), (10.0, 4 - 16 / 60)])
def test_an_agent_without_momentum_goes_at_the_mean_speed_from_rest_to_rest(step: float, pace: float) -> None:
    assert first_order(DoubleIntegrator(4.0, 2.0), step) == SingleIntegrator(pytest.approx(pace))


def test_an_agent_without_heading_goes_as_fast_as_before() -> None:
    assert first_order(Unicycle(0.0, 2.0, 1.0), 1.0) == SingleIntegrator(2.0)


@pytest.mark.parametrize(("seconds", "rests"), [(40, True), (20, True), (14, False), (11, False)])
def test_who_has_momentum_goes_from_rest_to_rest_where_there_is_time(seconds: int, rests: bool) -> None:
    way, dynamics = np.array([(0.0, 0.0), (12.0, 0.0), (12.0, 8.0)]), DoubleIntegrator(2.0, 0.5)
    share = np.arange(seconds + 1) / seconds
    eased_share = eased(share, way, seconds, dynamics)
    assert eased_share[[0, -1]] == pytest.approx([0.0, 1.0])
    speed = 20 * np.diff(eased_share)
    assert speed.min() >= 0
    assert speed.max() <= 2.0
    if rests:
        assert np.abs(np.diff(speed, prepend=0.0, append=0.0)).max() <= 0.5
    else:
        assert np.array_equal(eased_share, share)


def test_who_has_no_momentum_goes_at_an_even_pace() -> None:
    share = np.arange(11) / 10
    assert np.array_equal(eased(share, np.array([(0.0, 0.0), (5.0, 0.0)]), 10, SingleIntegrator(1.0)), share)


@pytest.mark.parametrize(("turn", "seconds"), [("", 0.0), (", turn <= 30 deg/s", 6.0), (", turn <= 45 deg/s", 4.0)])
def test_who_turns_slowly_is_given_the_time_to_turn(turn: str, seconds: float) -> None:
    go = "require a: hand[0]: eventually[0, 90 s] kiln_a\n"
    _, scheduler, _ = scheduled(KILNS.replace(", turn <= 45 deg/s", turn) + go)
    assert scheduler._travel(0, 40.0) == pytest.approx(40 / 0.8 + seconds)
    assert scheduler._travel(0, 0.0) == 0


def test_a_formation_of_agents_with_momentum_is_given_the_time_to_stop() -> None:
    row = "formation row = line of rover spacing 2 m tolerance 0.3 m\nrequire lined: eventually[0, 90 s] row\n"
    momentum = "double_integrator(speed <= 1 m/s, acceleration <= 0.1 m/s^2)"
    heavy = YARD.replace("single_integrator(speed <= 1 m/s)", momentum)
    times = []
    for yard in (YARD, heavy):
        _, scheduler, schedule = scheduled(yard + row)
        (lined,) = schedule.appointments
        perturbed = PerturbedDistances(0.0, np.random.default_rng(0))
        times.append(scheduler._run([lined.visit], perturbed, []).times[0])
    assert times[1] == pytest.approx(times[0] + 10.0)


MULES = """
mission mules
time step 1 s, horizon 60 s
world (0, 0) to (60, 40)
region depot = box (2, 15) to (10, 25)
region village = box (50, 30) to (58, 38)
agent a { radius 0.5 m  dynamics DYNAMICS  start at (4, 20) }
agent b { radius 0.5 m  dynamics double_integrator(speed <= 3 m/s, acceleration <= 1.5 m/s^2)  start at (29, 6) }
separation 0.3 m
require wait: a: always[0, 20 s] depot
require hand: eventually[0, 40 s] always[0, 2 s] distance(a, b) <= 3 m
require mail: b: eventually[0, 60 s] village
"""


@pytest.mark.parametrize(
    "dynamics", ["single_integrator(speed <= 3 m/s)", "double_integrator(speed <= 3 m/s, acceleration <= 1.5 m/s^2)"]
)
def test_who_has_to_be_somewhere_from_the_start_begins_its_tour_where_it_starts(dynamics: str) -> None:
    text = MULES.replace("DYNAMICS", dynamics)
    mission, scheduler, schedule = scheduled(text)
    _, position = tours(mission, schedule, scheduler.timed, Geodesics(mission), np.random.default_rng(0))
    assert position[0, :21] == pytest.approx(np.tile((4.0, 20.0), (21, 1)), abs=0.2)
    planned(text)


def test_the_velocities_of_a_motion_are_those_of_its_positions() -> None:
    mission, _ = checked(MULES.replace("DYNAMICS", "single_integrator(speed <= 3 m/s)"))
    made = splines(mission)
    motion = trace(mission, made, np.random.default_rng(0).uniform(5, 30, (2, made.points, 2)))
    assert motion.velocity[0, :-1] == pytest.approx(np.diff(motion.position[0], axis=0))


def test_a_dwell_that_ends_within_each_of_many_windows_is_a_recurrence_of_stays() -> None:
    mission, kernel = checked(YARD + "require tended: every 30 s: some rover: historically[0, 4 s] east\n")
    ahead = looking_ahead(mission, kernel, 10_000)
    assert isinstance(ahead, Kernel)
    tasks = outline(build(ahead), mission.steps).tasks
    assert len(tasks) == 2  # the first, within the first window, and the others
    again = [event for task in tasks for option in task.options for event in option.all_events if event.again]
    assert {hold.high - hold.low for event in again for hold in event.holds} == {4}


def test_what_a_visit_triggers_is_scheduled_after_it_in_time() -> None:
    visit = "require seen: rover[0]: eventually[0, 60 s] north\n"
    answers = "".join(
        f"require {place}: every rover: always[0, 40 s] (touches(north) implies eventually[0, {most} s] {place})\n"
        for place, most in (("south", 20), ("east", 60))
    )
    mission, scheduler, schedule = scheduled(YARD + visit + answers)
    north, *answered = named(scheduler, schedule, "seen")
    assert schedule.late == 0
    south, east = (each.step - north.step for each in answered)
    assert 8 <= south <= 20
    assert south < east <= 60
    _, motion = tours(mission, schedule, scheduler.timed, Geodesics(mission), np.random.default_rng(0))
    inside = np.flatnonzero((motion[0] >= [2, 14]).all(axis=1) & (motion[0] <= [8, 18]).all(axis=1))
    assert (motion[0, inside[0] : inside[0] + 21, 1] <= 6).any()


def test_now_or_within_a_time_is_within_that_time_again_and_again() -> None:
    mission, kernel = checked(YARD + "require near: rover[0]: always[0, 60 s] (east or eventually[0, 30 s] east)\n")
    (task,) = outline(build(kernel), mission.steps).tasks
    assert all(event.again for option in task.options for event in option.all_events)

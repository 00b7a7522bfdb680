"""The pieces of the transport backend: splines, residuals, schedules, key frames, ways round, polish."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from missionc.ir.kernel.nodes import Atom
from missionc.ir.kernel.walk import postorder

torch = pytest.importorskip("torch")

from missionc.backends.acceptance import attempt
from missionc.backends.clot.cost_graph.cost_graph import build
from missionc.backends.clot.optimise.active_set import Demand
from missionc.backends.clot.optimise.control_points import splines, trace
from missionc.backends.clot.optimise.levenberg_marquardt import polish
from missionc.backends.clot.optimise.motion_residuals import Costs
from missionc.backends.clot.optimise.residuals import Group, Rows, rows
from missionc.backends.clot.schedule.draft import sketch
from missionc.backends.clot.schedule.geodesics import Geodesics
from missionc.backends.clot.schedule.joint_waypoints import joint_waypoints
from missionc.backends.clot.schedule.schedule import Scheduler
from missionc.backends.clot.schedule.tasks import outline
from missionc.backends.clot.schedule.visits import Schedule
from missionc.backends.clot.settings import Spare, Weights
from missionc.compiler import driver
from missionc.geometry.displacement import displaced
from missionc.ir import Connected, Mission
from missionc.ir.distances.signed_distance import signed_distance
from missionc.ir.kernel.nodes import Kernel
from missionc.ir.language.margins.connected import spanning_tree
from missionc.verification.plan.step_dynamics import check_dynamics
from tests.support.transport_missions import checked

ROOT = Path(__file__).resolve().parents[3]

MIXED = """\
mission mixed
time step 0.5 s, horizon 6 s
world (0, 0) to (10, 8)
region base = box (0.5, 0.5) to (3, 3)
region goal = box (6, 5) to (9.5, 7.5)
region fire = disc at (5, 4) radius 0.5
beacon mast = (2, 2)
obstacle pillar = disc at (4.5, 2) radius 0.4
obstacle cart = box (7, 1) to (8, 2) moving (0 m/s, 0.3 m/s)
team drone[3] { radius 0.1 m  dynamics single_integrator(speed <= 3 m/s)  start in base }
team truck[2] { radius 0.2 m  dynamics double_integrator(speed <= 3 m/s, acceleration <= 3 m/s^2)
  start at (1, 5), (2, 5)  finish at (8, 6), (9, 7) }
graph radio = proximity 4 m
formation row = chain of drone spacing 0.8 m tolerance 0.2 m
formation sum = distances of truck (0-1: 1 m) total tolerance 0.4 m
require visit: eventually[0, 5 s] every drone: inside(goal)
require link:  always[0, 6 s] connected(radio)
require row:   eventually[2 s, 4 s] row
require sum:   eventually[0, 6 s] sum
require fire:  every drone: always[0, 6 s] not touches(fire)
require slow:  every drone: eventually[0, 6 s] speed <= 1 m/s
require far:   always[0, 6 s] distance(drone[0], drone[1]) >= 0.3
require mast:  drone[2]: eventually[0, 6 s] distance(mast) <= 6
require some:  drone[1]: always[0, 3 s] distance(truck[0]) >= 0.2
"""


def of_file(name: str, **overrides: str) -> tuple[Mission, Kernel]:
    found = driver.check(ROOT / "missions" / f"{name}.mission", overrides=overrides)
    assert found.mission is not None
    assert found.kernel is not None
    return found.mission, found.kernel


def demand_of(graph: Kernel, mission: Mission, schedule: Schedule | None = None) -> Demand:
    roots = tuple(wanted.formula for wanted in graph.requirements)
    return Demand.of(mission, roots, schedule.choices if schedule else {}, mission.steps)


def shaken(mission: Mission, seed: int) -> np.ndarray:
    """Control points all over the world; starts and finishes where they must be."""
    generator = np.random.default_rng(seed)
    low, high = np.array(mission.world.low), np.array(mission.world.high)
    position = generator.uniform(low, high, (len(mission.agents), mission.steps + 1, mission.dimension))
    return splines(mission).through(position)


# ------------------------------------------------------------------- splines


def test_any_control_points_obey_the_equations_of_motion() -> None:
    mission, _ = checked(MIXED)
    made = trace(mission, splines(mission), shaken(mission, 1))
    motion = [check for check in check_dynamics(mission, made) if check.name == "motion"]
    assert len(motion) == len(mission.agents)
    # Exact starts and finishes are written over the first and last position: those of `truck` do not count here.
    assert all(check.passed for check in motion if check.subject.startswith("drone"))


def test_a_second_order_agent_starts_and_ends_at_rest() -> None:
    mission, _ = checked(MIXED)
    made = splines(mission)
    position = np.linspace(0, 1, mission.steps + 1)[None, :, None] * np.ones((len(mission.agents), 1, 2))
    _, velocity = made.states(made.through(position))
    assert np.allclose(velocity[3:, 0], 0)
    assert np.allclose(velocity[3:, -1], 0)


def test_an_argument_is_the_point_of_the_motion_that_it_names() -> None:
    mission, _ = checked(MIXED)
    made, control = splines(mission), shaken(mission, 2)
    position, velocity = made.states(control)
    agent, step = np.array([0, 3, 4]), np.array([2, 4, 7])
    assert np.allclose(made.position(agent, step, np.zeros(3)).of(control), position[agent, step])
    assert np.allclose(made.position(agent, step, np.ones(3)).of(control), position[agent, step + 1])
    assert np.allclose(made.velocity(agent, step).of(control), velocity[agent, step])
    half = made.position(agent, step, np.full(3, 0.5)).of(control)
    ahead = position[agent, step] + velocity[agent, step] * 0.25
    ahead[1:] += made.acceleration(agent[1:], step[1:]).of(control) * 0.03125
    assert np.allclose(half, ahead)


# ----------------------------------------------------------------- residuals


@pytest.mark.parametrize("seed", range(3))
def test_every_gradient_is_what_small_differences_say(seed: int) -> None:
    mission, kernel = checked(MIXED)
    graph = build(kernel)
    costs = Costs(mission, splines(mission), Weights(), Spare())
    control = shaken(mission, seed)
    active = demand_of(graph, mission).active(*costs.splines.states(control))
    tiny = 1e-6
    names = set()
    for group in costs.groups(control, active):
        here = rows(group, control)
        names.add(group.name.split()[0])
        numeric(group, control, here, tiny)
    assert {"speed", "acceleration", "obstacle", "start", "separation"} & names


def test_gradients_are_there_though_torch_was_left_without() -> None:
    """An interruption that comes as a block without gradients is entered leaves the whole process without."""
    mission, _ = checked(MIXED)
    costs = Costs(mission, splines(mission), Weights(), Spare())
    control = shaken(mission, 1)
    (group,) = (each for each in costs.obstacles(control) if each.name == "obstacles")
    with torch.no_grad():
        here = rows(group, control)
        assert not torch.is_grad_enabled()
    assert len(here.value)
    for mine, other in zip(here.gradient, rows(group, control).gradient, strict=True):
        assert mine.any()
        assert np.array_equal(mine, other)


def numeric(group: Group, control: np.ndarray, here: Rows, tiny: float) -> None:
    """The change of the sum of a group's residuals along a random direction, foretold and measured."""
    if not len(here.value):
        return
    direction = np.random.default_rng(0).standard_normal(control.shape)
    foretold = np.zeros(len(here.value))
    for argument, gradient in zip(here.arguments, here.gradient, strict=True):
        foretold += (argument.of(direction) * gradient).sum(axis=1)
    ahead = rows(group, control + tiny * direction)
    back = rows(group, control - tiny * direction)
    if len(ahead.value) == len(here.value) == len(back.value):
        measured = (ahead.value - back.value) / (2 * tiny)
        # A kink (the corner of a box, two spans equally near) may lie within the step: few rows may be off.
        assert np.mean(np.abs(measured - foretold) <= 1e-4 * (1 + np.abs(foretold))) > 0.95, group.name


def test_a_tree_spans_with_the_best_worst_link() -> None:
    generator = np.random.default_rng(3)
    points = generator.random((4, 7, 2))
    links = 1.0 - np.linalg.norm(points[:, :, None] - points[:, None], axis=-1)
    first, second, worst = spanning_tree(links)
    for graph in range(4):
        values = links[graph, first[graph], second[graph]]
        assert values[worst[graph]] == values.min()
        reached = {0}
        for one, other in zip(first[graph], second[graph], strict=True):
            assert one in reached
            assert other not in reached
            reached.add(int(other))
        # No level above the worst link connects all.
        linked = links[graph] > values.min()
        group = {0}
        while more := {int(b) for a in group for b in np.flatnonzero(linked[a])} - group:
            group |= more
        assert len(group) < 7


# --------------------------------------------------------- from words to formulas


def test_routes_of_any_length_between_all_members_are_one_term() -> None:
    _, kernel = of_file("clot_visit")
    predicates = [node.predicate for node in postorder(build(kernel).formulas) if isinstance(node, Atom)]
    assert sum(isinstance(predicate, Connected) for predicate in predicates) == 1


def test_a_schedule_keeps_windows_and_says_what_it_chose() -> None:
    mission, kernel = of_file("clot_corridor")
    graph = build(kernel)
    for seed in range(3):
        scheduler = Scheduler(mission, outline(graph, mission.steps), Geodesics(mission), np.random.default_rng(seed))
        schedule = scheduler.schedule(0.4)
        assert len(schedule.appointments) == 3
        for appointment in schedule.appointments:
            assert appointment.visit.event.low <= appointment.step <= appointment.visit.event.high
            key = (appointment.visit.event.chooser, appointment.visit.event.agent, appointment.visit.event.step)
            assert schedule.choices[key] == appointment.step


def test_key_frames_hold_what_their_steps_ask_for() -> None:
    mission, kernel = of_file("clot_star")
    graph = build(kernel)
    generator = np.random.default_rng(0)
    scheduler = Scheduler(mission, outline(graph, mission.steps), Geodesics(mission), generator)
    found = joint_waypoints(mission, scheduler.schedule(0.0), scheduler, Geodesics(mission), generator)
    assert [found[0].step, found[-1].step] == [0, mission.steps]
    assert all(frame.shortfall <= 0 for frame in found)


def test_a_way_goes_round_what_is_in_between_and_keeps_its_room() -> None:
    mission, _ = checked(MIXED)
    geodesics = Geodesics(mission)
    way = geodesics.way(np.array([2.0, 2.0]), np.array([7.0, 3.0]), 0.3, 0.1)
    assert way is not None
    assert len(way) > 2
    share = np.linspace(0, 1, 200)
    lengths = np.r_[0, np.cumsum(np.linalg.norm(np.diff(way, axis=0), axis=1))]
    points = np.stack([np.interp(share, lengths / lengths[-1], way[:, axis]) for axis in (0, 1)], axis=1)
    assert geodesics.room_at(points).min() > 0.3 - geodesics.cell
    straight = geodesics.way(np.array([1.0, 5.0]), np.array([3.0, 6.0]), 0.3, 0.1)
    assert straight is not None
    assert len(straight) == 2


def test_obstacles_are_pushed_on_exactly_where_a_body_is_too_near_to_one() -> None:
    mission, _ = checked(
        MIXED.replace(
            "obstacle cart", "obstacle star = polygon (5, 5), (6, 5.2), (6.5, 6.5), (5.8, 5.6)\nobstacle cart"
        )
    )
    made = splines(mission)
    costs = Costs(mission, made, Weights(), Spare())
    control = np.random.default_rng(0).uniform(0, 8, (len(mission.agents), made.points, 2))
    (found,) = (rows(group, control).value for group in costs.obstacles(control) if group.name == "obstacles")
    point = costs.samples.where.of(control)
    times = costs.samples.instant * (made.steps * made.step / costs.samples.instant.max())
    need = costs.samples.radius + mission.clearance + Spare().bodies
    expected = []
    for obstacle in mission.obstacles:
        moved = np.stack([displaced(obstacle, time, 2) for time in times])
        lacking = need - np.asarray(signed_distance(np, obstacle.shape, point - moved))
        assert (lacking > 0).any()
        expected.append(lacking[lacking > 0])
    assert np.allclose(np.sort(found), np.sort(np.concatenate(expected)))


def test_polish_leaves_no_fault_where_the_sketch_has_some() -> None:
    mission, kernel = of_file("clot_star")
    graph = build(kernel)
    generator = np.random.default_rng(0)
    scheduler = Scheduler(mission, outline(graph, mission.steps), Geodesics(mission), generator)
    schedule, geodesics = scheduler.schedule(0.0), Geodesics(mission)
    key = joint_waypoints(mission, schedule, scheduler, geodesics, generator)
    made = splines(mission)
    first = made.through(sketch(mission, schedule, key, geodesics, generator, 0.0))
    assert not attempt(mission, kernel, trace(mission, made, first)).is_plan
    costs = Costs(mission, made, Weights(), Spare())
    polished = polish(first, costs, demand_of(graph, mission, schedule), 60)
    assert attempt(mission, kernel, trace(mission, made, polished.control)).is_plan
    assert polished.shortfall <= 0


def test_what_is_broken_is_found() -> None:
    mission, kernel = of_file("clot_visit", N="3")
    control = np.zeros((3, mission.steps + 3, 2))
    come_to = attempt(mission, kernel, trace(mission, splines(mission), control))
    assert {"separation", "its start", "its finish"} <= {fault.what for fault in come_to.faults}
    assert {"first", "second"} <= {each.name for each in come_to.requirements if not each.satisfied}

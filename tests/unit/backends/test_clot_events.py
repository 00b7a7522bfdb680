"""Events that have no region: formations, graphs and distances that must come to be at some time of a window."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("torch")

import missionc
from missionc.backends.clot.cost_graph.cost_graph import build
from missionc.backends.clot.schedule.gather_team import gather_team
from missionc.backends.clot.schedule.geodesics import Geodesics
from missionc.backends.clot.schedule.schedule import Scheduler
from missionc.backends.clot.schedule.tasks import outline
from missionc.backends.clot.schedule.visits import Schedule
from missionc.base.source import Source
from missionc.base.trace import Array
from missionc.ir import Connected, InFormation, Mission
from missionc.ir.language.margins.predicate_margins import link_margin, margin
from tests.support.random_runs import trace_of
from tests.support.transport_missions import planned

SCATTERED = """\
mission scattered
time step 0.2 s, horizon 14 s
world (0, 0) to (16, 16)
team rover[5] {
  radius 0.1 m  dynamics single_integrator(speed <= 1.5 m/s)
  start at (2, 3), (14, 2), (8, 9), (3, 13), (13, 14)
}
graph radio = proximity 2 m
formation row = KIND of rover spacing 0.8 m tolerance 0.2 m
"""
KINDS = ["line", "line|heading 30 deg", "chain", "circle", "grid", "star"]
ROW = "require row: eventually[0, 10 s] always[0, 4 s] row\n"


def scattered(kind: str, *requirements: str) -> str:
    """A kind of formation may have a setting behind a bar."""
    kind, _, setting = kind.partition("|")
    return SCATTERED.replace("KIND", kind).replace("tolerance", f"{setting} tolerance") + "".join(requirements)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", [0, 1])
def test_a_formation_at_some_time_is_planned_from_starts_that_are_none(kind: str, seed: int) -> None:
    planned(scattered(kind, ROW), seed)


def test_agents_of_second_order_are_given_the_time_too() -> None:
    text = scattered("line", ROW).replace(
        "single_integrator(speed <= 1.5 m/s)", "double_integrator(speed <= 1.5 m/s, acceleration <= 1 m/s^2)"
    )
    planned(text)


@pytest.mark.parametrize(
    "requirements",
    [
        ("require near: eventually[0, 10 s] always[0, 4 s] connected(radio)\n",),
        ("require meet: eventually[0, 10 s] always[0, 4 s] distance(rover[0], rover[4]) <= 0.6\n",),
        (
            "formation ring = circle of rover spacing 1 m tolerance 0.1 m\n",
            "require row:  eventually[0, 12 s] always[0, 2 s] row\n",
            "require ring: eventually[0, 12 s] always[0, 2 s] ring\n",
        ),
    ],
    ids=["a graph", "a distance", "two formations"],
)
def test_other_events_without_a_place_are_planned(requirements: tuple[str, ...]) -> None:
    planned(scattered("line", *requirements))


# ------------------------------------------------------------------ schedules


def schedules(text: str, noise: float, count: int) -> tuple[Mission, list[Schedule]]:
    checked = missionc.check(Source("a.mission", text), backend="clot")
    assert checked.mission is not None
    assert checked.kernel is not None
    mission = checked.mission
    asked, geodesics = outline(build(checked.kernel), mission.steps), Geodesics(mission)
    return mission, [
        Scheduler(mission, asked, geodesics, np.random.default_rng(seed)).schedule(noise) for seed in range(count)
    ]


def test_a_formation_is_not_asked_for_before_its_agents_can_be_there() -> None:
    mission, (first,) = schedules(scattered("line", ROW), 0.0, 1)
    starts = np.array([(2, 3), (14, 2), (8, 9), (3, 13), (13, 14)], dtype=float)
    (row,) = mission.formations
    furthest = np.linalg.norm(gather_team([InFormation(row)], starts) - starts, axis=1).max()
    assert furthest > 3
    (appointment,) = first.appointments
    assert furthest / 1.5 <= appointment.step * mission.step <= 10
    assert first.late == 0


def test_later_schedules_put_off_what_has_no_place_within_its_window() -> None:
    meet = "require meet: eventually[2 s, 8 s] always[0, 6 s] distance(rover[0], rover[4]) <= 0.6\n"
    mission, (first,) = schedules(scattered("line", meet), 0.0, 1)
    assert first.appointments[0].step * mission.step >= 2
    _, drawn = schedules(scattered("line", meet), 0.4, 30)
    steps = [schedule.appointments[0].step for schedule in drawn]
    assert min(steps) * mission.step >= 2
    assert max(steps) * mission.step <= 8
    assert len(set(steps)) > 3


# ------------------------------------------------------------------ gathering


def in_row(mission: Mission, position: Array) -> float:
    """The margin of the mission's one formation with agents at these positions, (agents, dim)."""
    (row,) = mission.formations
    return float(margin(InFormation(row), mission, trace_of(position[:, None].tolist()))[0])


@pytest.mark.parametrize("kind", KINDS)
def test_a_gathered_team_is_in_formation_or_near_it_and_its_middle_stays(kind: str) -> None:
    mission, _ = schedules(scattered(kind, ROW), 0.0, 0)
    (row,) = mission.formations
    for seed in range(5):
        position = np.random.default_rng(seed).uniform(0, 16, (5, 2))
        there = gather_team([InFormation(row)], position)
        # What is rigid may end up folded; that is off by less than a spacing, from starts off by many.
        assert in_row(mission, there) > (0 if kind in ("chain", "star") else -0.4)
        assert in_row(mission, position) < -1
        assert np.allclose(there.mean(axis=0), position.mean(axis=0), atol=0.01)


def test_a_team_on_one_spot_is_spread_out() -> None:
    mission, _ = schedules(scattered("circle", ROW), 0.0, 0)
    (row,) = mission.formations
    there = gather_team([InFormation(row)], np.full((5, 2), 3.0))
    assert in_row(mission, there) > -0.4
    assert in_row(mission, np.full((5, 2), 3.0)) < -1


def test_a_team_in_formation_stays() -> None:
    mission, _ = schedules(scattered("line", ROW), 0.0, 0)
    (row,) = mission.formations
    position = np.array([(1 + 0.8 * number, 2) for number in range(5)])
    assert np.array_equal(gather_team([InFormation(row)], position), position)


def test_a_gathered_team_is_connected_and_no_nearer_than_it_must() -> None:
    mission, _ = schedules(scattered("line", ROW), 0.0, 0)
    (radio,) = mission.graphs
    position = np.array([(0, 0), (10, 0), (10, 1), (1, 0), (5, 8)], dtype=float)
    there = gather_team([Connected(radio, (0, 1, 2, 3, 4))], position)
    members = np.arange(len(there))
    links = np.asarray(link_margin(radio, members[:, None], members, there[:, None], there[None]))
    joined = np.linalg.matrix_power((links > 0).astype(float), 5)
    assert (joined > 0).all()
    assert np.linalg.norm(there[4] - there, axis=1)[:4].min() > 1.9

"""Plans on roadmaps satisfy requirements between samples: moves are judged as a whole, and relays get nodes."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from missionc import ContinuousTime, Source, ir
from missionc import compile as compile_mission
from missionc.backends.acceptance import violated_between_samples
from missionc.backends.api import Budget, Planned
from missionc.backends.options import Options
from missionc.backends.smt.backend import SmtBackend
from missionc.backends.smt.roadmap.labels import Labels
from missionc.backends.smt.roadmap.roadmap import build_roadmaps
from missionc.base.trace import Trace
from missionc.base.units import Metres
from missionc.compiler.continuous_time import violated_in_flight
from missionc.compiler.front_end import check
from missionc.compiler.results import Verified
from missionc.ir.language.margins.predicate_margins import holds, margin
from missionc.ir.lower.hold_throughout import hold_throughout

ROOT = Path(__file__).resolve().parents[3]

DOOR = """mission door
time step 1 s, horizon 16 s
world (0, 0) to (12, 8)
region wall = box (5.9, 0) to (6.1, 6)
region key = box (8, 1) to (9, 2)
agent r { radius 0.2 m  dynamics single_integrator(speed <= 2 m/s)  start at (4, 1.5) }
require closed: r: (not touches(wall)) until[0 s, 16 s] key
solve with smt { nodes = 110 }
"""

BOOTH = """mission booth
time step 5 s, horizon 75 s
world (0, 0) to (30, 20)
region booth = box (14, 6) to (16, 14)
region west = box (1, 8) to (4, 12)
region east = box (26, 8) to (29, 12)
agent cart { radius 0.4 m  dynamics single_integrator(speed <= 1.5 m/s)  start in west }
require there: cart: eventually[0, 30 s] east
require back: cart: always[70 s, 75 s] west
require closed: cart: always[40 s, 70 s] not touches(booth)
solve with smt { nodes = 110 }
"""


def planned(mission: Source | Path, *, between: bool, **overrides: str) -> frozenset[str]:
    """Requirements that fail between the samples of smt's plan, or of its flight."""
    checked = check(mission, overrides=overrides)
    judge = partial(violated_in_flight, checked.valid_mission, checked.valid_kernel)
    budget = Budget(time.monotonic() + 100, violated_in_flight=judge if between else None)
    plan = SmtBackend().plan(checked.valid_mission, checked.valid_kernel, Options(), budget)
    assert isinstance(plan, Planned)
    return violated_between_samples(checked.valid_mission, checked.valid_kernel, plan.trace) | judge(plan.trace)


@pytest.mark.parametrize("text", [DOOR, BOOTH])
def test_a_region_is_not_crossed_between_two_samples(text: str) -> None:
    source = Source("text.mission", text)
    assert planned(source, between=False) == {"closed"}
    assert not planned(source, between=True)


@pytest.mark.parametrize("team", ["3", "5"])
def test_relays_stay_linked_while_all_agents_move(team: str) -> None:
    mission = ROOT / "missions" / "strel_goal.mission"
    assert planned(mission, between=False, N=team) == {"linked"}
    assert not planned(mission, between=True, N=team)


def test_the_first_plan_holds_in_continuous_time_unless_only_samples_count() -> None:
    source = Source("door.mission", DOOR)
    found = compile_mission(source).outcome
    assert isinstance(found, Verified)
    assert not found.certificate.at_steps_alone
    assert [run.stage for run in found.plan.runs] == ["search", "verify"]
    at_steps = compile_mission(source, continuous_time=ContinuousTime.AT_STEPS).outcome
    assert isinstance(at_steps, Verified)
    assert [each.requirement for each in at_steps.certificate.at_steps_alone] == ["closed"]


def disc_passed(
    dynamics: ir.Dynamics, velocity: tuple[float, float], later: tuple[float, float]
) -> tuple[float, float]:
    """Margins of not touching a disc at (1, 1) of radius 0.25, at the two steps of a motion from (0, 0)."""
    mission = check(Source("door.mission", DOOR)).valid_mission
    mission = replace(mission, agents=(replace(mission.agents[0], dynamics=dynamics, radius=Metres(0.25)),))
    position = np.array([[(0.0, 0.0), (2.0, 0.0)]])
    trace = Trace(mission.step, position, np.array([[velocity, later]]), np.zeros((1, 2)))
    region = replace(mission.regions[0], shape=ir.Disc((1.0, 1.0), 0.25))
    first, last = margin(ir.DuringMotion(ir.Touches(region), False), mission, trace)[0].tolist()
    return first, last


def test_the_margin_of_a_motion_is_its_least() -> None:
    straight = ir.SingleIntegrator(speed=3.0)
    first, last = disc_passed(straight, (2.0, 0.0), (2.0, 0.0))
    assert first == pytest.approx(1.0 - 0.5, abs=1e-6)
    assert last == pytest.approx(math.sqrt(2) - 0.5)


def test_the_margin_of_a_curved_motion_is_its_least() -> None:
    curved = ir.DoubleIntegrator(speed=9.0, acceleration=9.0)
    first, _ = disc_passed(curved, (2.0, 2.0), (2.0, -2.0))  # its highest point is (1, 0.5)
    assert first == pytest.approx(0.5 - 0.5, abs=1e-6)


def test_labels_of_moves_are_those_of_their_motion_sampled_densely() -> None:
    mission = check(Source("booth.mission", BOOTH)).valid_mission
    roadmaps = build_roadmaps(mission, 60, 6, np.random.default_rng(1))
    assert isinstance(roadmaps, tuple)
    (roadmap,) = roadmaps
    closed = ir.Touches(mission.regions[0])
    moves = roadmap.motions(mission)
    dense = np.array([moves.at(share * mission.step) for share in np.linspace(0, 1, 400)])
    trace = Trace(mission.step, dense.swapaxes(0, 1), np.zeros_like(dense.swapaxes(0, 1)), np.zeros(dense.shape[1::-1]))
    crowd = replace(mission, agents=tuple(replace(mission.agents[0], index=at) for at in range(len(roadmap.moves))))
    touched = holds(closed, margin(closed, crowd, trace)).any(axis=1)
    found = Labels(mission, roadmaps).moves(ir.DuringMotion(closed, False), 0, True, at_end=False)
    assert (found == ~touched).all()
    assert touched.any()


def test_only_places_that_the_ends_of_a_motion_do_not_decide_are_judged_along_it() -> None:
    checked = check(Source("booth.mission", BOOTH))
    names = {"back", "closed"}
    stronger = hold_throughout(checked.valid_mission, checked.valid_kernel, names, motions=True)
    asked = {goal.name: str(goal.formula).count("DuringMotion") for goal in stronger.requirements}
    assert asked == {"there": 0, "back": 0, "closed": 1}

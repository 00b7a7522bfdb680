"""The published method from text to plan: what counts, what does not, and the limits on it."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
import z3

from missionc import ir
from missionc.backends.api import Budget, NotFound, Reason
from missionc.backends.options import Options
from missionc.backends.roadmap_graph import show_roadmaps
from missionc.backends.smt.paper.encode import Encoding
from missionc.backends.smt.paper.paper_run import colliding_moves, node_links, problem, specify
from missionc.base.continuous_time import ContinuousTime
from missionc.base.source import Source
from missionc.base.units import Seconds
from missionc.cli.emit_stages import of_checked
from missionc.compiler import driver
from missionc.compiler.plan_request import PlanRequest
from missionc.compiler.results import Compiled, InvalidMission, Verified
from tests.support.resolved_missions import demo, mission
from tests.support.small_missions import SMALL
from tests.support.small_roadmaps import roadmap_of

FEW = (
    SMALL.replace("nodes = 40", "nodes = 30, neighbors = 8")
    .replace("horizon 6 s", "horizon 3 s")
    .replace("0, 6 s", "0, 3 s")
)

CROSSING = """\
mission crossing
time step 1 s, horizon 4 s
world (0, 0) to (6, 1)
region left = box (0, 0) to (2, 1)
region right = box (4, 0) to (6, 1)
team drone[2] { radius 0.4 m  dynamics single_integrator(speed <= 3 m/s)  start at (1, 0.5), (5, 0.5) }
require go:   drone[0]: eventually[0, 4 s] right
require come: drone[1]: eventually[0, 4 s] left
separation 0.3 m
solve with smt { nodes = 20 }
"""
"""They cannot pass each other."""


def planned(text: str, preset: str = "paper", limit: float = 60.0, **others: object) -> Compiled:
    return driver.compile(
        Source("a.mission", text),
        options=Options(preset=preset),
        time_limit=Seconds(limit),
        continuous_time=ContinuousTime.AT_STEPS,
        **others,  # type: ignore[arg-type]
    )


def test_a_small_mission_has_a_verified_plan_and_the_manifest_names_the_preset() -> None:
    compiled = planned(FEW, "paper-apart")
    outcome = compiled.outcome
    assert isinstance(outcome, Verified)
    manifest = json.loads(dict(compiled.files)["manifest.json"])
    assert manifest["options"]["preset"] == "paper-apart"
    assert [graph.agents for graph in outcome.report.roadmaps] == [("drone[0]",), ("drone[1]",)]
    assert {"roadmap", "links", "encode", "solve", "collisions"} <= dict(outcome.report.seconds).keys()


def test_a_plan_without_the_preset_says_nothing_of_presets() -> None:
    compiled = driver.compile(Source("a.mission", SMALL), continuous_time=ContinuousTime.AT_STEPS)
    assert "preset" not in json.loads(dict(compiled.files)["manifest.json"])["options"]


def test_a_model_in_which_bodies_touch_is_no_plan_and_is_the_best_candidate() -> None:
    outcome = planned(CROSSING).outcome
    assert isinstance(outcome, NotFound)
    assert outcome.reason is Reason.METHOD
    assert outcome.best is not None
    assert {fault.what for fault in outcome.best.faults} == {"separation"}


def test_an_encoding_without_a_model_is_undecided_and_never_impossible() -> None:
    """There is a plan: a drone that begins at the goal needs no link, except in the paper."""
    text = demo(
        things="region goal = box (0, 0) to (9, 9)\ngraph radio = proximity 0.5 m",
        require="require r: drone[0]: (goal reach[hops 0..1 on radio] drone) until[0, 1 s] goal\nsolve with smt",
    )
    compiled = planned(text)
    assert isinstance(compiled.outcome, NotFound)
    assert compiled.outcome.best is None
    assert "has no model" in compiled.outcome.statement
    assert [finding.code.name for finding in compiled.findings if finding.code.name > "MC560"] == ["MC564"]


@pytest.mark.parametrize(
    ("formula", "satisfied"),
    [
        ("base until[0, 1 s] field", False),
        ("base until[0, 1 s] (base or field)", True),
        ("true reach[hops 0..1 on radio] drone[0]", False),
        ("true reach[hops 0..1 on radio] drone[1]", True),
        ("somewhere[hops 0..1 on radio] drone[0]", False),
        ("escape[hops 0..1 on radio] base", True),
    ],
)
def test_until_includes_its_last_step_and_a_route_has_a_link_and_escape_needs_none(
    formula: str, satisfied: bool
) -> None:
    """The first drone steps from base into field, and the other stands beside it."""
    meant: ir.Mission = mission(
        demo(
            time="time step 1 s, horizon 1 s",
            things="region base = box (0, 0) to (1, 9)\nregion field = box (2, 0) to (9, 9)\n"
            "graph radio = proximity 3 m",
            require=f"require r: drone[0]: {formula}",
        )
    )
    both = (roadmap_of((0,), [(0.5, 1), (2.5, 1)], 1), roadmap_of((1,), [(1.5, 1), (1.5, 1)], 1))
    prms = tuple(replace(prm, moves=np.array([[0, 1]]), starts=(np.array([0]),)) for prm in both)
    spec = specify(meant, prms)
    solver = z3.Solver()
    solver.add(*Encoding(problem(spec, prms, [node_links(graph, prms) for graph in spec.graphs], [])).plan())
    assert (solver.check() == z3.sat) == satisfied


MANY_ROUTES = demo(
    team="team drone[10] { radius 0.1 m  dynamics single_integrator(speed <= 2 m/s)  start in goal }",
    things="region goal = box (1, 1) to (9, 9)\ngraph radio = proximity 5 m",
    require="require r: drone[0]: always[0, 10 s] somewhere[hops 1..9 on radio] goal\nsolve with smt",
)
"""A million routes at each step."""


def test_the_time_limit_ends_an_encoding() -> None:
    outcome = planned(MANY_ROUTES, limit=4.0).outcome
    assert isinstance(outcome, NotFound)
    assert outcome.reason is Reason.TIME
    assert outcome.statement == "time limit reached while encoding the mission"


@pytest.mark.slow
def test_the_memory_limit_ends_an_encoding() -> None:
    outcome = planned(MANY_ROUTES, limit=600.0, memory_limit=320 << 20).outcome
    assert isinstance(outcome, NotFound)
    assert outcome.reason is Reason.MEMORY


def test_what_the_method_lacks_is_refused_before_anything_is_planned() -> None:
    compiled = planned(FEW + "minimize distance\n")
    assert isinstance(compiled.outcome, InvalidMission)
    assert "MC563" in {finding.code.name for finding in compiled.findings}


def test_the_preset_is_for_the_roadmap_planner_alone() -> None:
    other = FEW.replace("solve with smt { nodes = 30, neighbors = 8 }", "solve with clot")
    assert "MC405" in {finding.code.name for finding in planned(other, "paper-apart").findings}
    assert "MC405" in {finding.code.name for finding in planned(FEW, "search").findings}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["strel_deliver", "strel_threat", "strel_escape"])
def test_the_papers_missions_have_a_plan_for_three_drones_that_keep_apart(name: str) -> None:
    compiled = driver.compile(
        f"missions/{name}.mission",
        overrides={"N": "3"},
        options=Options(preset="paper-apart"),
        continuous_time=ContinuousTime.AT_STEPS,
    )
    assert isinstance(compiled.outcome, Verified)


@pytest.mark.parametrize(("apart", "collide"), [(0.2 + 5e-7, True), (0.2 + 1e-4, False)])
def test_two_who_stay_as_near_as_the_mission_allows_make_colliding_moves(apart: float, collide: bool) -> None:
    """Rounding may make them touch, so the method asks for as much more as the refinement of the default does."""
    text = f"""\
mission touching
time step 1 s, horizon 2 s
world (0, 0) to (2, 2)
team drone[2] {{ radius 0.1 m  dynamics single_integrator(speed <= 1 m/s)  start at (1, 1), ({1 + apart:.9f}, 1) }}
require stay: every drone: always[0, 2 s] speed <= 1
"""
    one, other = (roadmap_of((agent,), [(x, 1.0)], 2) for agent, x in enumerate((1.0, 1.0 + apart)))
    assert (len(colliding_moves(mission(text), one, other)) > 0) == collide


def test_the_roadmaps_to_print_are_those_of_the_published_method_where_that_is_to_plan() -> None:
    checked = driver.check(Source("a.mission", FEW), backend="smt")
    ask = PlanRequest(Budget(0.0, seed=3), Options())
    ((_, default),) = of_checked(checked, ("roadmap",), ask)
    ((_, published),) = of_checked(checked, ("roadmap",), replace(ask, options=Options(preset="paper")))
    assert published != default
    outcome = planned(FEW, "paper-apart", seed=3).outcome
    assert isinstance(outcome, Verified)
    assert published == show_roadmaps(outcome.report.roadmaps)

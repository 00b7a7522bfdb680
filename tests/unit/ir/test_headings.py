"""Headings: what can be asked of them and what cannot, where they are read, and plans that keep them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from missionc import ir
from missionc.backends.smt.roadmap.edges import NONE
from missionc.backends.smt.roadmap.unroll import unroll
from missionc.base.diagnostics.code import (
    NO_HEADING,
    SYNTAX,
    TRACE_MISMATCH,
    VALUE_OUT_OF_RANGE,
    WRONG_KIND,
    WRONG_UNIT,
)
from missionc.base.source import Source
from missionc.compiler.driver import check, compile
from missionc.compiler.results import Verified
from missionc.frontend.explain.explanation import explained, lines
from missionc.frontend.resolve.show_ir import show_ir
from missionc.geometry.dynamics import States
from missionc.ir import Unicycle
from missionc.ir.language.margins.headings import of_direction, of_motion
from missionc.verification.monitoring.read_trace import read_trace
from tests.support.check_findings import found, meant, only, text, words
from tests.support.random_runs import MAST

CARTS = "team drone[2] { radius 0.1 m  dynamics unicycle(speed 0..1 m/s)  start at (1, 1), (2, 2) }"


def asked(formula: str, *more: str, agents: str = CARTS, time: str = "step 1 s, horizon 20 s") -> str:
    return text("beacon mast = (8, 8)", *more, f"require look: {formula}", agents=agents, time=time)


def test_a_heading_is_resolved_to_radians_or_a_beacon() -> None:
    shown = show_ir(
        meant(
            asked(
                "every drone: eventually[0, 9 s] "
                "(heading within WIDE of (A + 10 deg) and heading within 1 rad of mast)",
                "param A = -100 deg",
                "param WIDE = 20 deg",
            )
        )
    )
    assert "heading within 20 deg of -90 deg" in shown
    assert "heading within 57.2957795131 deg of mast" in shown


@pytest.mark.parametrize(
    ("formula", "code", "message"),
    [
        (
            "heading within 0 deg of 90 deg",
            VALUE_OUT_OF_RANGE,
            "the angle to either side is 0 rad; it must be more than",
        ),
        ("heading within 180 deg of 90 deg", VALUE_OUT_OF_RANGE, "it must be less than 180 deg"),
        ("heading within 10 of 90 deg", VALUE_OUT_OF_RANGE, "the angle to either side is 572.9577951 deg"),
        ("heading within 10 m of 90 deg", WRONG_UNIT, "expected an angle, found a length `10 m`"),
        ("heading within 10 deg of 90 s", WRONG_UNIT, "expected an angle, found a time `90 s`"),
        ("heading within 10 deg of goal", WRONG_KIND, "expected an angle or a beacon, found a region `goal`"),
        ("heading within 10 deg of drone", WRONG_KIND, "expected an angle or a beacon, found a team `drone`"),
        ("heading <= 90 deg", SYNTAX, "headings cannot be compared: they are angles of a circle"),
    ],
)
def test_what_cannot_be_asked_is_said(formula: str, code: object, message: str) -> None:
    (finding,) = (
        each for each in check(Source("a.mission", asked(f"every drone: {formula}"))).findings if each.code == code
    )
    assert message in finding.message
    assert finding.help


def test_a_region_is_told_how_a_beacon_in_it_is_declared() -> None:
    finding = only(asked("every drone: heading within 10 deg of goal"), WRONG_KIND)
    assert finding.help == "declare a beacon, for example `beacon goal_middle = (8, 8)`"


def test_agents_without_a_heading_are_told_so() -> None:
    agents = "team drone[2] { dynamics double_integrator(speed <= 1, acceleration <= 1)  start at (1, 1), (2, 2) }"
    finding = only(asked("every drone: heading within 10 deg of mast", agents=agents), NO_HEADING)
    assert finding.message == "`drone[0]` and `drone[1]` have no heading"
    assert words(finding)[0] == ("heading within 10 deg of mast", "the formula uses a heading")
    assert found(asked("every drone: heading within 10 deg of mast"), NO_HEADING) == []


def test_a_name_may_still_be_called_heading() -> None:
    assert check(
        Source("a.mission", asked("every drone: heading within 10 deg of heading", "param heading = 1 rad"))
    ).ok
    assert check(Source("a.mission", asked("every drone: x >= within", "param within = 1 m"))).ok


def test_angles_are_compared_round_the_circle() -> None:
    faced = np.radians([350.0, 10.0, 190.0, -350.0, 725.0])
    spare = np.degrees(of_direction(faced, math.radians(5.0), math.radians(20.0)))
    assert spare == pytest.approx([5.0, 15.0, -155.0, 15.0, 20.0])


def test_a_motion_leads_within_an_angle_exactly_where_who_moves_faces_so() -> None:
    torch = pytest.importorskip("torch")
    turns = np.linspace(-math.pi, math.pi, 101)
    velocity = torch.tensor(np.stack([0.7 * np.cos(turns), 0.7 * np.sin(turns)], axis=1))
    for within in (0.3, 1.2, 2.0, 3.0):
        for towards in (0.0, 1.0, -2.5):
            along = math.cos(towards), math.sin(towards)
            moving = of_motion(torch, velocity[:, 0], velocity[:, 1], along, within).numpy()
            spare = of_direction(turns, towards, within)
            clear = np.abs(spare) > 1e-9
            assert (np.sign(moving) == np.sign(spare))[clear].all()
            assert moving == pytest.approx(0.7 * np.sin(np.clip(spare, -math.pi / 2, math.pi / 2)), abs=1e-9)


def test_who_waits_may_turn_to_what_is_asked_for() -> None:
    nodes = States(np.array([[0.0, 0.0], [1.0, 2.5]]), np.zeros((2, 2)))
    beacon = ir.Beacon("mast", (1.0, 0.5), MAST.span)
    for turn in (math.inf, 1.0):
        made = unroll(Unicycle(0.0, 1.0, turn), nodes, NONE, 1.0, asked=(math.radians(-100), beacon))
        at_second = made.heading[(made.states.position == nodes.position[1]).all(axis=1)]
        assert np.isclose(at_second, math.radians(260)).any()
        assert np.isclose(at_second, math.radians(270)).any()
        change = np.abs(np.diff(made.heading[made.moves], axis=1)[:, 0])
        known = ~np.isnan(change)
        around = np.minimum(change, 2 * math.pi - change)
        assert (around[known] <= (math.pi if math.isinf(turn) else 1.0) + 1e-9).all()
    plain = unroll(Unicycle(0.0, 1.0, math.inf), nodes, NONE, 1.0)
    assert np.isnan(plain.heading).all()


STANDS = """mission stand
time step 1 s, horizon 20 s
world (0, 0) to (14, 10)
region bay = box (10, 4) to (13, 6)
beacon lamp = (5, 9)
team cart[1] { radius 0.2 m  dynamics unicycle(speed 0..1 m/s)  start at (2, 3) }
require seen:   every cart: eventually[0, 5 s] heading within 5 deg of lamp
require parked: every cart: eventually[0, 15 s] always[0, 5 s] (bay and heading within 10 deg of 90 deg)
solve with BACKEND
"""


@pytest.mark.parametrize("backend", ["smt", "clot"])
def test_a_plan_faces_where_it_is_asked_to(backend: str) -> None:
    if backend == "clot":
        pytest.importorskip("torch")
    done = compile(Source("a.mission", STANDS.replace("BACKEND", backend))).outcome
    assert isinstance(done, Verified), done
    heading = np.degrees(done.plan.trace.heading[0])
    parked = np.abs((heading - 90 + 180) % 360 - 180) <= 10 + 1e-9
    assert any(parked[step : step + 6].all() for step in range(16))


def test_a_heading_is_said_back() -> None:
    mission = meant(asked("every drone: eventually[0, 9 s] heading within 10 deg of mast"))
    page = "\n".join(lines(explained(mission), mission, None, True))
    assert "Every drone, at some step of its own from 0 s to 9 s, faces within 10 deg of `mast`." in page
    mission = meant(asked("every drone: always[0, 9 s] not heading within 10 deg of 90 deg"))
    assert "faces within 10 deg of 90 deg." in "\n".join(lines(explained(mission), mission, None, True))


def test_a_trace_without_headings_is_refused_where_they_are_asked_for() -> None:
    mission = meant(asked("drone[1]: always[0, 1 s] heading within 10 deg of mast", time="step 1 s, horizon 1 s"))
    rows = [f"drone[{agent}],{step},{1 + agent},{1 + agent}" for agent in (0, 1) for step in (0, 1)]
    bare = "\n".join(["agent,t,x,y", *rows]) + "\n"
    trace, findings = read_trace(Source("a.csv", bare), mission)
    assert trace is None
    assert [(finding.code, finding.message) for finding in findings] == [
        (TRACE_MISMATCH, "missing `yaw` of `drone[1]`: the mission uses its heading")
    ]
    full = "\n".join(["agent,t,x,y,yaw", *(f"{row},0.5" for row in rows)]) + "\n"
    trace, findings = read_trace(Source("a.csv", full), mission)
    assert not findings
    assert trace is not None
    assert (trace.heading == 0.5).all()

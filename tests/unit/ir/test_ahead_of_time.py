"""Missions done earlier and with more room, so that delays are tolerated."""

from __future__ import annotations

import time

import pytest

from missionc.backends.api import Budget, NotFound, Reason
from missionc.base.source import Source
from missionc.compiler import driver
from missionc.compiler.plan_request import PlanRequest
from missionc.compiler.results import Compiled, Verified
from missionc.ir.kernel.nodes import Always, Eventually, Node, Release, Until
from missionc.ir.kernel.walk import postorder
from missionc.ir.lower.tighten import ahead_of_time, with_room_for_delays

HEAD = """\
mission crossing
time step 1 s, horizon 16 s
world (0, 0) to (12, 10)
region a = box (9, 4) to (11, 6)
region b = box (4, 8) to (6, 10)
obstacle wall = box (0, 8) to (1, 9)
obstacle cart = box (11, 0) to (12, 1) moving (0.01, 0) m/s
team car[2] { radius 0.3 m  dynamics single_integrator(speed <= 1.5 m/s)  start at (1, 5), (5, 1) }
"""
CROSSING = (
    HEAD
    + """\
require go: (car[0]: eventually[0, 14 s] a) and (car[1]: eventually[0, 14 s] b)
"""
)


def windows(text: str) -> list[tuple[type[Node], int, int | None]]:
    checked = driver.check(Source("a.mission", HEAD + text))
    assert checked.mission is not None, [finding.message for finding in checked.findings]
    assert checked.kernel is not None
    early = ahead_of_time(checked.mission, checked.kernel)
    return [
        (type(node), node.low, node.high)
        for node in postorder(goal.formula for goal in early.requirements)
        if isinstance(node, Always | Eventually | Until | Release)
    ]


@pytest.mark.parametrize(
    ("formula", "found"),
    [
        ("car[0]: eventually[1 s, 9 s] a", [(Eventually, 1, 7)]),
        ("car[0]: eventually[8 s, 9 s] a", [(Eventually, 8, 8)]),
        ("car[0]: eventually[1 s, end] a", [(Eventually, 1, 14)]),
        ("car[0]: always[7 s, 9 s] a", [(Always, 5, 9)]),
        ("car[0]: always[1 s, 9 s] not a", [(Always, 0, 9)]),
        ("car[0]: (not b) until[2 s, 9 s] a", [(Until, 2, 7)]),
        # What is asked within a window comes with it.
        ("car[0]: eventually[1 s, 9 s] always[0, 3 s] a", [(Always, 0, 3), (Eventually, 1, 7)]),
        # Who is on time need not hurry.
        ("car[1]: eventually[1 s, 9 s] a", [(Eventually, 1, 9)]),
    ],
)
def test_a_window_that_is_asked_at_the_start_is_kept_late_too(
    formula: str, found: list[tuple[type[Node], int, int | None]]
) -> None:
    assert windows(f"require r: {formula}\ntolerate delay 2 s of car[0]\n") == found


def test_who_finishes_in_a_region_is_there_earlier() -> None:
    team = "agent van { dynamics single_integrator(speed <= 1 m/s)  start at (3, 3)  finish in a }\n"
    goal = "require r: van: eventually[0, 9 s] a\ntolerate delay 3 s of van\n"
    assert windows(team + goal) == [(Eventually, 0, 6), (Always, 13, 16)]


def test_room_is_what_the_delay_takes_at_top_speed_between_bodies_and_beside_what_changes() -> None:
    checked = driver.check(Source("a.mission", CROSSING + "tolerate delay 2 s of car\n"))
    assert checked.mission is not None
    roomy = with_room_for_delays(checked.mission, 0.5)
    assert roomy.separation == pytest.approx(1.5)
    (wall, cart), (_, larger) = checked.mission.obstacles, roomy.obstacles
    assert roomy.obstacles[0] is wall
    assert larger.shape.low == pytest.approx([value - 1.5 for value in cart.shape.low])
    assert with_room_for_delays(checked.mission, 0.0).separation == checked.mission.separation


def compiled(text: str, backend: str) -> Compiled:
    checked = driver.check(Source("a.mission", text), backend=backend)
    return driver.plan(checked, PlanRequest(Budget(time.monotonic() + 120)))


@pytest.mark.parametrize("backend", ["smt", "clot", "hybrid"])
def test_a_backend_plans_so_that_delays_are_tolerated(backend: str) -> None:
    if backend != "smt":
        pytest.importorskip("torch")
    outcome = compiled(CROSSING + "tolerate delay 2 s of car\n", backend).outcome
    assert isinstance(outcome, Verified)
    assert all(each.tolerated >= 2.0 for each in outcome.certificate.delays)
    assert [check.subject for check in outcome.certificate.checks if check.name == "delay"] == ["car[0]", "car[1]"]
    assert any(note.startswith("planned with earlier deadlines") for note in outcome.report.notes)


def test_plans_that_do_not_tolerate_the_delay_are_none_and_that_is_no_proof() -> None:
    sharp = "require at: car[0]: always[9 s, 9 s] a\nrequire off: car[0]: always[12 s, 16 s] not a\n"
    result = compiled(HEAD + sharp + "tolerate delay 4 s of car[0]\n", "smt")
    assert isinstance(result.outcome, NotFound)
    assert result.outcome.reason is Reason.DELAY
    (finding,) = [each for each in result.findings if not each.code.warning]
    assert finding.code.name == "MC608"
    assert finding.notes[-1] == "none of 8 plans tolerates the delays, but such a plan may exist"
    assert finding.primary is not None
    assert finding.primary.span.text == "tolerate delay 4 s of car[0]"

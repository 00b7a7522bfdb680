"""Delays that a plan tolerates, of motions made by hand in steps of half a second, and checks of those asked for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from missionc import ir
from missionc.base.trace import Trace
from missionc.base.units import Steps
from missionc.ir.kernel.nodes import Always, At, Atom, Eventually, Goal, Kernel
from missionc.ir.mission import Tolerance
from missionc.verification.certificate import Check, Delay
from missionc.verification.plan import time_robustness as module
from missionc.verification.plan.time_robustness import check_tolerances, delayed, time_robustness, tolerated_steps
from tests.support.legal_plans import NOTHING, SPAN, mission_of, moving, straight

BODY = 0.125
APART = 0.5
"""Bodies of an eighth of a metre keep half a metre: three quarters of one from centre to centre."""


def team(*paths: list[list[float]], **more: object) -> tuple[ir.Mission, Trace]:
    mission = mission_of(
        [path[0] for path in paths],
        len(paths[0]) - 1,
        step=0.5,
        radius=BODY,
        separation=APART,
        dynamics=ir.SingleIntegrator(20.0),
    )
    return replace(mission, **more), straight([*paths], 0.5)  # type: ignore[arg-type]


def east(*xs: float, y: float = 5.0) -> list[list[float]]:
    return [[x, y] for x in xs]


STAYS = east(*[1.0] * 7, y=1.0)
ALONE = team(east(1, 2, 3, 4, 4, 4, 4))


def test_who_is_late_waits_at_its_start_and_its_end_is_cut_off() -> None:
    mission, trace = team(east(1, 2, 4, 7), east(1, 1, 1, 1, y=1.0))
    turned = replace(trace, heading=np.array([[0.1, 0.2, 0.3, 0.4], [0.0] * 4]))
    late = delayed(mission, turned, 0, 1)
    assert late.position[0, :, 0].tolist() == [1, 1, 2, 4]
    assert late.velocity[0, :, 0].tolist() == [0, 2, 4, 4]
    assert late.heading[0].tolist() == [0.1, 0.1, 0.2, 0.3]
    assert late.position[1].tolist() == trace.position[1].tolist()
    two = delayed(mission, turned, 0, 2)
    assert (two.position[0, :, 0].tolist(), two.velocity[0, :, 0].tolist()) == ([1, 1, 1, 2], [0, 0, 2, 2])
    assert two.heading[0].tolist() == [0.1, 0.1, 0.1, 0.2]
    assert delayed(mission, turned, 0, 9).position[0, :, 0].tolist() == [1, 1, 1, 1]
    assert late.step == 0.5
    # Of who has momentum, the velocity at the last step is its own.
    heavy = replace(
        mission, agents=(replace(mission.agents[0], dynamics=ir.DoubleIntegrator(9.0, 9.0)), mission.agents[1])
    )
    assert delayed(heavy, turned, 0, 1).velocity[0, :, 0].tolist() == [0, 2, 4, 6]


def delays(case: tuple[ir.Mission, Trace], kernel: Kernel = NOTHING) -> tuple[Delay, ...]:
    return time_robustness(case[0], kernel, case[1])


def test_where_nothing_is_asked_anybody_may_be_late_to_the_end() -> None:
    assert delays(ALONE) == (Delay("drone[0]", 3.0),)


def test_a_finish_is_kept_up_to_the_wait_at_it() -> None:
    mission, trace = ALONE
    finish = replace(mission.agents[0], finish=ir.InitialSet(SPAN, (4.0, 5.0)))
    assert delays((replace(mission, agents=(finish,)), trace)) == (
        Delay("drone[0]", 1.5, False, "finish", "drone[0]", 3.0, ("drone[0]",)),
    )


def test_a_requirement_breaks_where_and_by_whom_the_monitor_says() -> None:
    there = Atom(ir.Compare(((1.0, ir.Coordinate(0)),), -3.0, False))
    by = Goal("by", At(0, Eventually(there, 0, 4)), SPAN)
    other = Goal("other", At(1, Always(there, 0, 6)), SPAN)
    case = team(east(1, 2, 3, 4, 4, 4, 4), east(*[4.0] * 7, y=1.0))
    assert delays(case, Kernel((by, other), ())) == (
        Delay("drone[0]", 1.0, False, "requirement", "by", 2.0, ("drone[0]",)),
        Delay("drone[1]", 3.0),
    )


def test_who_crosses_another_may_be_late_until_they_meet() -> None:
    """It passes the place of the other two seconds before that one comes there."""
    first, second = east(1, 3, 5, 7, 9, 9, 9), [[5.0, 9.0]] * 4 + [[5.0, 7.0], [5.0, 5.0], [5.0, 3.0]]
    found = delays(team(first, second))
    # Three steps late, both are at (5, 5) at the fifth step.
    assert found[0] == Delay("drone[0]", 1.0, False, "separation", "all pairs", 2.5, ("drone[0]", "drone[1]"))
    assert found[1] == Delay("drone[1]", 3.0)


def test_a_moving_obstacle_is_met_by_who_is_late() -> None:
    """It comes down onto the way a second and a half after the agent has passed, in its second half second."""
    truck = moving(ir.Box((2.0, 7.0), (3.0, 8.0)), [1.5, 2.0], [(0.0, 0.0), (0.0, -2.5)])
    mission, trace = team(east(1, 2, 3, 4, 4, 4, 4))
    (found,) = delays((replace(mission, obstacles=(truck,)), trace))
    assert (found.tolerated, found.open, found.breaks, found.subject) == (0.5, False, "obstacle", "truck")
    assert found.agents == ("drone[0]",)
    assert found.at == pytest.approx(2.0, abs=0.1)


def test_what_is_not_looked_at_stays_open_but_what_is_asked_for_is_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "WORK", 0)
    monkeypatch.setattr(module, "FEWEST", 2)
    assert delays(ALONE) == (Delay("drone[0]", 1.0, True),)
    asked = replace(ALONE[0], tolerances=(Tolerance((0,), Steps(4), SPAN),))
    assert delays((asked, ALONE[1])) == (Delay("drone[0]", 2.0, True),)
    # Seven states of one agent are looked at for each step late.
    for work, steps in ((20, 2), (21, 3), (27, 3), (28, 4), (70, 6)):
        monkeypatch.setattr(module, "WORK", work)
        assert delays(ALONE) == (Delay("drone[0]", steps * 0.5, steps < 6),)


def test_the_longest_delay_that_is_asked_of_an_agent_counts() -> None:
    tolerances = Tolerance((0, 1), Steps(2), SPAN), Tolerance((1,), Steps(3), SPAN), Tolerance((1,), Steps(1), SPAN)
    mission = replace(team(STAYS, east(*[5.0] * 7))[0], tolerances=tolerances)
    assert tolerated_steps(mission) == {0: 2, 1: 3}
    found = (
        Delay("drone[0]", 1.5),
        Delay("drone[1]", 1.0, False, "separation", "all pairs", 2.5, ("drone[1]", "drone[0]")),
    )
    assert list(check_tolerances(mission, found)) == [
        Check(
            "delay", "drone[0]", 0.5, "s", 0.0, True, None, ("drone[0]",),
            "no violation with a delay of up to 1 s of this agent alone",
        ),
        Check(
            "delay", "drone[1]", -0.5, "s", 0.0, False, 2.5, ("drone[1]", "drone[0]"),
            "a delay of 1.5 s violates the separation from `drone[0]` at 2.5 s",
        ),
    ]  # fmt: skip
    assert list(check_tolerances(replace(mission, tolerances=()), found)) == []


def test_a_delay_says_what_one_step_more_breaks() -> None:
    broken = {
        Delay("a", 1.0): "",
        Delay("a", 1.0, False, "obstacle", "truck", 2.0, ("a",)): "the clearance to `truck` at 2 s",
        Delay("a", 1.0, False, "separation", "all pairs", 2.25, ("a", "b")): "the separation from `b` at 2.25 s",
        Delay("a", 1.0, False, "finish", "a", 3.0, ("a",)): "its finish at 3 s",
        Delay("a", 1.0, False, "requirement", "stay"): "`stay`",
    }
    assert [delay.broken for delay in broken] == list(broken.values())


def test_who_passes_at_just_what_both_need_may_be_late() -> None:
    mission, trace = team(east(1, 3, 5, 7, 7, 7, 7), east(*[5.0] * 7, y=4.25))
    assert delays((mission, trace))[0] == Delay("drone[0]", 3.0)
    # What is curved is found to be so far apart but for a little.
    heavy = ir.DoubleIntegrator(9.0, 9.0)
    agents = tuple(replace(agent, dynamics=heavy) for agent in mission.agents)
    assert delays((replace(mission, agents=agents), trace))[0] == Delay("drone[0]", 3.0)

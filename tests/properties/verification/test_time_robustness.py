"""Delays that a plan tolerates, against the whole verification of each late trace."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from missionc import ir
from missionc.base.trace import Trace
from missionc.base.units import Metres, Steps
from missionc.ir.kernel.nodes import Kernel
from missionc.ir.language.operators import by_name
from missionc.ir.lower.expand import expand
from missionc.verification.certificate import Delay
from missionc.verification.monitoring.monitor import truth
from missionc.verification.plan.time_robustness import time_robustness
from missionc.verification.verify_plan import verify
from tests.support.legal_plans import NOTHING, SPAN, mission_of, moving, pushed, still, straight, wandering
from tests.support.random_runs import cases
from tests.support.random_runs import mission_of as small_mission

MAY_BREAK = {"obstacle", "separation", "finish", "requirement"}


def late(trace: Trace, agent: int, steps: int, momentum: bool) -> Trace:
    """State by state: it waits at its start, then does what it would have done so many steps earlier."""
    position, velocity, heading = (np.array(each) for each in (trace.position, trace.velocity, trace.heading))
    for step in range(position.shape[1]):
        before = max(step - steps, 0)
        position[agent, step], heading[agent, step] = trace.position[agent, before], trace.heading[agent, before]
        velocity[agent, step] = 0.0 if step < steps else trace.velocity[agent, before]
    if not momentum:
        velocity[agent, -1] = velocity[agent, -2]
    return Trace(trace.step, position, velocity, heading)


def broken(mission: ir.Mission, kernel: Kernel, trace: Trace, agent: int, steps: int) -> set[tuple[str, str]]:
    momentum = mission.agents[agent].dynamics.has_momentum
    certificate = verify(mission, kernel, late(trace, agent, steps, momentum))
    return {(check.name, check.subject) for check in certificate.failures if check.name in MAY_BREAK}


def compare(mission: ir.Mission, kernel: Kernel, trace: Trace) -> tuple[Delay, ...]:
    found = time_robustness(mission, kernel, trace)
    assert [each.agent for each in found] == [agent.name for agent in mission.agents]
    for agent, delay in zip(mission.agents, found, strict=True):
        tolerated = round(delay.tolerated / mission.step)
        for steps in range(1, tolerated + 1):
            assert broken(mission, kernel, trace, agent.index, steps) == set()
        if delay.breaks:
            assert (delay.breaks, delay.subject) in broken(mission, kernel, trace, agent.index, tolerated + 1)
        else:
            assert tolerated == mission.steps
    return found


@settings(max_examples=150)
@given(data=st.data())
def test_requirements_are_kept_up_to_the_delay_and_no_further(data: st.DataObject) -> None:
    case = data.draw(cases())
    denied = ir.Apply(by_name["not"], (case.formula,), None, SPAN)
    for formula in (case.formula, denied):  # one of the two holds where everybody is on time
        mission = small_mission(len(case.trace.position), case.run.last, ir.Requirement("asked", formula, SPAN))
        agents = tuple(replace(agent, radius=Metres(0.0)) for agent in mission.agents)
        mission = replace(mission, agents=agents, separation=Metres(0.0))
        kernel, findings = expand(mission)
        assert kernel is not None, findings
        if truth(kernel.requirements[0].formula, mission, case.trace)[0, 0]:
            compare(mission, kernel, case.trace)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 1_000), st.sampled_from([0.0, 0.15]), st.booleans())
def test_bodies_keep_apart_up_to_the_delay_and_no_further(seed: int, growth: float, moves: bool) -> None:
    position = wandering(seed, 3, 8)
    generator = np.random.default_rng(seed)
    shapes = [ir.Disc(tuple(place), 0.4) for place in generator.uniform(1, 9, (8, 2)).tolist()]
    way = ([0.0, 4.0, 8.0], [(0.0, 0.0), (2.0, -1.0), (0.0, 0.0)])
    bodies = [moving(each, *way, f"o{at}") if moves else still(each, f"o{at}") for at, each in enumerate(shapes)]
    obstacles = [replace(body, growth=growth) for body in bodies]
    mission = mission_of(position[:, 0].tolist(), 8, separation=0.09, obstacles=obstacles)
    on_time = {subject for _, subject in broken(mission, NOTHING, straight(position), 0, 0)}
    met = tuple(each for each in obstacles if each.name not in on_time)
    compare(replace(mission, obstacles=met), NOTHING, straight(position))


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 1_000))
def test_agents_with_momentum_are_late_as_others_are(seed: int) -> None:
    generator = np.random.default_rng(seed)
    start = generator.uniform(3, 7, (3, 2))
    trace = pushed(start, np.zeros((3, 2)), generator.uniform(-0.6, 0.6, (3, 6, 2)), 1.0)
    dynamics = ir.DoubleIntegrator(5.0, 2.0)
    mission = mission_of(start.tolist(), 6, dynamics=dynamics)
    assume(not broken(mission, NOTHING, trace, 0, 0))
    compare(mission, NOTHING, trace)


def test_who_is_at_its_finish_early_may_be_late_by_as_much() -> None:
    way = [[1.0, 1.0], [2.0, 1.0], [3.0, 1.0], [3.0, 1.0], [3.0, 1.0]]
    mission = mission_of([[1.0, 1.0]], 4)
    finish = ir.InitialSet(SPAN, (3.0, 1.0))
    mission = replace(mission, agents=(replace(mission.agents[0], finish=finish),))
    (delay,) = compare(mission, NOTHING, straight([way]))
    assert (delay.tolerated, delay.breaks, delay.subject, delay.at) == (2.0, "finish", "drone[0]", 4.0)
    assert delay.broken == "its finish at 4 s"


def test_two_who_cross_may_be_late_until_they_meet_and_the_message_says_who() -> None:
    first = [[1.0 + step, 5.0] for step in range(9)]
    second = [[5.0, 1.0], [5.0, 1.0], [5.0, 1.0], [5.0, 1.0], *([5.0, 2.0 + step] for step in range(5))]
    mission = mission_of([[1.0, 5.0], [5.0, 1.0]], 8)
    one, other = compare(mission, NOTHING, straight([first, second]))
    # The first crosses at 4 s, the second at 7 s: three seconds late they are there at once.
    assert (one.tolerated, one.breaks, one.agents) == (2.0, "separation", ("drone[0]", "drone[1]"))
    assert one.at == pytest.approx(7.0, abs=0.2)
    assert one.broken.startswith("the separation from `drone[1]` at ")
    assert (other.tolerated, other.breaks) == (8.0, "")


def test_a_delay_beyond_what_was_looked_at_stays_open_but_one_that_is_asked_for_is_looked_at(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from missionc.verification.plan import time_robustness as module

    monkeypatch.setattr(module, "WORK", 0)
    mission = mission_of([[1.0, 1.0]], 9)
    trace = straight([[[1.0, 1.0]] * 10])
    (delay,) = time_robustness(mission, NOTHING, trace)
    assert (delay.tolerated, delay.open, delay.breaks) == (float(module.FEWEST), True, "")
    asked = replace(mission, tolerances=(ir.Tolerance((0,), Steps(7), SPAN),))
    certificate = verify(asked, NOTHING, trace)
    assert certificate.passed
    (check,) = (each for each in certificate.checks if each.name == "delay")
    assert (check.subject, check.margin, check.unit) == ("drone[0]", 0.0, "s")


def test_a_plan_that_does_not_tolerate_what_is_asked_does_not_pass() -> None:
    way = [[1.0, 1.0], [2.0, 1.0], [3.0, 1.0], [3.0, 1.0]]
    mission = mission_of([[1.0, 1.0]], 3)
    finish = ir.InitialSet(SPAN, (3.0, 1.0))
    mission = replace(mission, agents=(replace(mission.agents[0], finish=finish),))
    for steps, passes in ((1, True), (2, False)):
        asked = replace(mission, tolerances=(ir.Tolerance((0,), Steps(steps), SPAN),))
        certificate = verify(asked, NOTHING, straight([way]))
        assert certificate.passed is passes
    (check,) = certificate.failures
    assert (check.name, check.margin, check.detail) == ("delay", -1.0, "a delay of 2 s violates its finish at 3 s")

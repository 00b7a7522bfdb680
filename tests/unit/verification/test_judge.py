"""Short missions judged as they are flown: what is said at their last step is what the whole run comes to."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from missionc import ir
from missionc.base.trace import Trace
from missionc.base.units import Seconds
from missionc.ir.kernel.nodes import (
    All,
    Always,
    Any,
    At,
    AtLeast,
    Atom,
    Eventually,
    Goal,
    Is,
    Kernel,
    Node,
    Not,
    Release,
    Until,
)
from missionc.ir.predicates import Compare, Coordinate
from missionc.verification.monitoring.live.judge import LiveJudge, Parts
from missionc.verification.monitoring.live.needed_steps import StepRange
from missionc.verification.monitoring.live.verdicts import LiveVerdict, Standing
from missionc.verification.monitoring.live.windows import Columns
from missionc.verification.monitoring.monitor import robustness
from tests.support.random_runs import SPAN, mission_of


def least(axis: int) -> Atom:
    return Atom(Compare(((1.0, Coordinate(axis)),), 0.0, False))


A, B = least(0), least(1)

FORMULAS: dict[str, Callable[[int], Node]] = {
    "always once": lambda last: Always(Eventually(A, -last, 0), 0, last),
    "eventually historically": lambda last: Eventually(Always(A, -last, 0), 0, last),
    "always since": lambda last: Always(Until(A, B, -last, 0), 0, last),
    "eventually released since": lambda last: Eventually(Release(A, B, -last, 0), 0, last),
    "always once before": lambda last: Always(Eventually(A, -last - 1, -1), 0, last),
    "once of the near past": lambda last: Always(Eventually(A, -1, 0), 0, None),
    "since of the near past": lambda last: Always(Until(A, B, -1, 0), 0, None),
    "since of some steps ago": lambda last: Always(Until(A, B, -2, -1), last, last),
    "always eventually": lambda last: Always(Eventually(A, 0, None), 0, None),
    "eventually always": lambda last: Eventually(Always(A, 0, None), 0, None),
    "always until": lambda last: Always(Any((A, Until(B, A, 0, None))), 0, None),
    "until at the end": lambda last: Until(A, B, last, last),
    "release": lambda last: Release(A, B, 0, None),
    "until of windows": lambda last: Until(Eventually(A, 0, 1), B, 0, max(last - 1, 1)),
    "always of until": lambda last: Always(Until(A, B, 0, 1), 0, last - 1),
    "at least": lambda last: AtLeast(2, (A, Always(B, 0, last), Eventually(A, last, last))),
    "of two": lambda last: All((At(0, Eventually(A, 0, last)), At(1, Any((Always(A, 0, last), B))))),
    "not": lambda last: Any((Not(A), All((B, Not(Is(frozenset((0,)))))))),
}


def standings(formula: Node, trace: Trace, speed: float = 1e3) -> list[Standing]:
    """How it stands after each step, asked of the first agent."""
    last = trace.position.shape[1] - 1
    mission = replace(mission_of(2, last), step=Seconds(0.5))
    agents = tuple(replace(agent, dynamics=ir.SingleIntegrator(speed)) for agent in mission.agents)
    judge = LiveJudge(replace(mission, agents=agents), Kernel((Goal("it", At(0, formula), SPAN),), ()))
    found = []
    for step in range(last + 1):
        (standing,) = judge.advance(trace.position[:, step], trace.velocity[:, step])
        found.append(standing)
    return found


def run(last: int, seed: int) -> Trace:
    position = np.random.default_rng(seed).uniform(-3, 3, (2, last + 1, 2))
    return Trace(Seconds(0.5), position, np.zeros_like(position), np.zeros((2, last + 1)))


@pytest.mark.parametrize("name", FORMULAS)
def test_the_last_verdict_is_the_robustness_and_each_before_holds_it(name: str) -> None:
    for last in (1, 2, 3, 5):
        formula = FORMULAS[name](last)
        for seed in range(3):
            trace = run(last, seed)
            exact = float(robustness(formula, mission_of(2, last), trace)[0, 0])
            found = standings(formula, trace)
            assert (found[-1].least, found[-1].most) == (exact, exact), (last, seed)
            assert found[-1].verdict is (LiveVerdict.SATISFIED if exact > 0 else LiveVerdict.VIOLATED)
            for before, after in pairwise(found):
                assert before.least <= after.least <= after.most <= before.most


def test_bounds_are_by_how_far_an_agent_gets_at_its_top_speed() -> None:
    """From x = 1 at half a metre a step: it may be below 0 after three steps, and 2.5 m beyond after five."""
    position = np.zeros((2, 6, 2))
    position[0, :, 0] = 1.0
    trace = Trace(Seconds(0.5), position, np.zeros_like(position), np.zeros((2, 6)))
    always = [(each.least, each.most) for each in standings(Always(A, 0, 5), trace, 1.0)]
    assert always == [pytest.approx((least, 1.0), abs=1e-6) for least in (-1.5, -1.0, -0.5, 0.0, 0.5, 1.0)]
    some = [(each.least, each.most) for each in standings(Eventually(A, 2, 5), trace, 1.0)]
    assert some == [
        pytest.approx(each, abs=1e-6)
        for each in ((0.0, 3.5), (0.5, 3.0), (1.0, 2.5), (1.0, 2.0), (1.0, 1.5), (1.0, 1.0))
    ]


def test_a_mission_that_is_over_has_no_more_steps() -> None:
    judge = LiveJudge(mission_of(2, 0), Kernel((), ()))
    assert judge.advance(np.zeros((2, 2)), np.zeros((2, 2))) == ()
    with pytest.raises(ValueError, match=r"^the mission has 1 steps, and all were seen$"):
        judge.advance(np.zeros((2, 2)), np.zeros((2, 2)))


def test_parts_are_taken_of_whole_formulas_and_of_those_at_one_agent() -> None:
    c = Is(frozenset())
    own, one, kept = At(1, A), At(0, A), At(1, c)

    def column(rows: int, *values: float) -> Columns:
        found = Columns(StepRange(0, 9, 0), rows)
        found.open(0, 0)
        found.part(0, 1, 0)[:] = np.array(values)[None, :, None]
        return found

    columns: dict[Node, Columns] = {
        A: column(2, 1.0, 4.0),
        B: column(2, 2.0, 3.0),
        kept: column(1, 2.5),
        c: column(2, 0.0, 0.0),
    }

    def bounds(node: All | Any | AtLeast) -> list[float]:
        found: list[float] = Parts(node, columns).bounds(0, 1, 0)[0, :, 0].tolist()
        return found

    parts = (own, one, B, kept)
    made = Parts(All(parts), columns)
    assert (made.others, made.bodies, made.rows) == ([B, kept], {A: [1, 0]}, 2)
    assert bounds(All(parts)) == [1.0, 1.0]
    assert bounds(Any(parts)) == [4.0, 4.0]
    assert bounds(All((own, B))) == [2.0, 3.0]
    assert [bounds(AtLeast(count, parts)) for count in range(6)] == [
        [np.inf] * 2,
        [4.0, 4.0],
        [2.5, 3.0],
        [2.0, 2.5],
        [1.0, 1.0],
        [-np.inf] * 2,
    ]
    assert (bounds(All(())), bounds(Any(()))) == ([np.inf], [-np.inf])


@pytest.mark.parametrize(("doubts", "faster"), [((0.0, 0.0), True), ((1.0, 0.0), False), ((0.0, 1.0), False)])
def test_who_may_be_nearer_than_seen_is_not_said_to_be_faster_than_its_vehicle(
    doubts: tuple[float, float], faster: bool
) -> None:
    """1.5 m in half a second, of a vehicle of 2 m/s, where a metre of it may be a mistake."""
    mission = replace(mission_of(1, 2), step=Seconds(0.5))
    (agent,) = mission.agents
    slow = replace(mission, agents=(replace(agent, dynamics=ir.SingleIntegrator(2.0)),))
    judge = LiveJudge(slow, Kernel((Goal("it", At(0, A), SPAN),), ()))
    for x, doubt in zip((1.0, 2.5), doubts, strict=True):
        judge.advance(np.array([[x, 1.0]]), np.zeros((1, 2)), doubt=np.array([doubt]))
    assert (0 in judge.outrun) is faster

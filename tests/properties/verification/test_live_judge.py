"""The online monitor against the offline one, the reference, and random continuations within the top speeds."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missionc import ir
from missionc.base.trace import Array, Judgement, Trace
from missionc.base.units import Steps
from missionc.ir.kernel.nodes import All, Always, Any, At, AtLeast, Atom, Eventually, Goal, Kernel, Node, Release, Until
from missionc.ir.language.operator import Operator
from missionc.ir.language.operators import OPERATORS, by_name
from missionc.ir.lower.expand import expand
from missionc.verification.monitoring.live.judge import LiveJudge
from missionc.verification.monitoring.live.verdicts import LiveVerdict, Standing
from missionc.verification.monitoring.monitor import monitor
from tests import reference
from tests.support.random_runs import (
    REGIONS,
    SPAN,
    Case,
    applied,
    cases,
    formulas,
    mission_of,
    own_states,
    remembering,
    run_of,
    trace_of,
)

seeds = st.integers(0, 2**32 - 1)
CLOSE = 1e-7
"""Metres: floating rounding."""


def asked(mission: ir.Mission, *formulas: ir.Formula) -> tuple[ir.Mission, Kernel]:
    """The mission with requirements that every agent satisfies each of the formulas."""
    size = len(mission.agents)
    everybody = ir.AgentSet("drone", tuple(range(size)), SPAN)
    wanted = tuple(
        ir.Requirement(str(number), ir.AtLeastOf("every", size, everybody, formula, SPAN), SPAN)
        for number, formula in enumerate(formulas)
    )
    mission = replace(mission, requirements=wanted)
    kernel, findings = expand(mission)
    assert kernel is not None, findings
    return mission, kernel


def slowed(mission: ir.Mission, speed: float) -> ir.Mission:
    """The mission with agents of this top speed, m/s."""
    dynamics = ir.SingleIntegrator(speed)
    return replace(mission, agents=tuple(replace(agent, dynamics=dynamics) for agent in mission.agents))


def standings(mission: ir.Mission, kernel: Kernel, trace: Trace) -> list[tuple[Standing, ...]]:
    """How the goals stand after each step."""
    judge = LiveJudge(mission, kernel)
    return [
        judge.advance(trace.position[:, step], trace.velocity[:, step], trace.heading[:, step])
        for step in range(trace.position.shape[1])
    ]


def assert_fits(standing: Standing, judgement: Judgement) -> None:
    """What was said of a goal is so, now that all is known."""
    assert standing.least - CLOSE <= judgement.robustness <= standing.most + CLOSE
    if standing.verdict is not LiveVerdict.OPEN:
        assert judgement.satisfied is (standing.verdict is LiveVerdict.SATISFIED)


def assert_final(standing: Standing, judgement: Judgement) -> None:
    """What is said after the last step is what the offline monitor says."""
    assert standing.verdict is (LiveVerdict.SATISFIED if judgement.satisfied else LiveVerdict.VIOLATED)
    assert standing.least == standing.most == pytest.approx(judgement.robustness, abs=1e-12)


def walk(generator: np.random.Generator, begin: Array, steps: int, speed: float) -> list[Array]:
    """Places of all agents at so many further steps of 1 s, at up to a speed; often straight on at that speed."""
    places = []
    turn, length, straight = np.zeros(len(begin)), np.zeros(len(begin)), bool(generator.integers(0, 2))
    for step in range(steps):
        if step == 0 or not straight:
            turn = generator.choice(16, len(begin)) * math.pi / 8
            length = speed * (np.ones(len(begin)) if straight else generator.choice([0.0, 0.5, 1.0], len(begin)))
        begin = begin + length[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=1)
        places.append(begin)
    return places


def continued(trace: Trace, step: int, generator: np.random.Generator, speed: float) -> Trace:
    """Another run that is the same up to a step, its velocity included."""
    steps = trace.position.shape[1]
    prefix = [trace.position[:, now] for now in range(step + 1)]
    onward = prefix[-1] + trace.velocity[:, step]
    if step + 1 < steps:
        prefix += [onward, *walk(generator, onward, steps - step - 2, speed)]
    return trace_of(np.stack(prefix, axis=1).tolist())


def check(case: Case, speed: float, seed: int) -> None:
    """Every promise of the online monitor, on one run."""
    mission, kernel = asked(slowed(case.run.mission, speed), case.formula)
    (judgement,) = monitor(mission, kernel, case.trace).requirements
    along = [each for (each,) in standings(mission, kernel, case.trace)]
    assert_final(along[-1], judgement)
    generator = np.random.default_rng(seed)
    for step, standing in enumerate(along):
        assert_fits(standing, judgement)
        assert standing.decided_by <= case.run.last
        assert standing.decided_by >= step or standing.verdict is not LiveVerdict.OPEN
        if step:
            assert along[step - 1].least <= standing.least + CLOSE
            assert standing.most <= along[step - 1].most + CLOSE
            assert along[step - 1].verdict in (LiveVerdict.OPEN, standing.verdict)
        for _ in range(3):
            other = continued(case.trace, step, generator, speed)
            assert_fits(standing, monitor(mission, kernel, other).requirements[0])


@given(cases(), seeds)
def test_a_verdict_on_a_prefix_holds_for_the_run_and_for_continuations(case: Case, seed: int) -> None:
    check(case, 10.0, seed)


@st.composite
def slow_cases(draw: st.DrawFn) -> Case:
    """A random walk of slow agents, and a formula."""
    size, steps = draw(st.integers(1, 3)), draw(st.integers(1, 7))
    generator = np.random.default_rng(draw(seeds))
    begin = generator.integers(0, 5, (size, 2)) / 2
    places = [begin, *walk(generator, begin, steps, 0.4)]
    trace = trace_of(np.stack(places, axis=1).tolist())
    remembers = draw(st.integers(0, 3)) == 0
    formula = draw(remembering(size, steps, own_states(size)) if remembers else formulas(size, steps, 3))
    return Case(run_of(mission_of(size, steps), trace), trace, formula)


@given(slow_cases(), seeds)
def test_top_speeds_bound_what_is_to_come(case: Case, seed: int) -> None:
    check(case, 0.4, seed)


@cache
@st.composite
def windows_of(draw: st.DrawFn, operator: Operator) -> Case:
    """A random walk of slow agents, and a formula that begins with an operator, as it is or over a window."""
    case = draw(slow_cases())
    size, last = len(case.trace.position), case.run.last
    formula = draw(applied(operator, size, draw(st.integers(0, last)), 2))
    free = last - reference.ahead(formula)
    if free >= 0 and draw(st.integers(0, 3)):
        around = by_name[draw(st.sampled_from(["always", "eventually"]))]
        low = draw(st.integers(0, free))
        window = ir.Window(Steps(low), Steps(draw(st.integers(low, free))), SPAN)
        formula = ir.Apply(around, (formula,), window, SPAN)
    return replace(case, formula=formula)


@pytest.mark.parametrize("operator", OPERATORS, ids=lambda operator: operator.name)
@settings(max_examples=6)
@given(data=st.data(), seed=seeds)
def test_every_operator_is_bounded_so(operator: Operator, data: st.DataObject, seed: int) -> None:
    check(data.draw(windows_of(operator)), 0.4, seed)


@given(slow_cases())
def test_the_last_verdict_is_that_of_the_reference(case: Case) -> None:
    mission, kernel = asked(slowed(case.run.mission, 0.4), case.formula)
    run = run_of(mission, case.trace)
    (last,) = standings(mission, kernel, case.trace)[-1]
    formula = mission.requirements[0].formula
    assert (last.verdict is LiveVerdict.SATISFIED) == reference.truth(formula, run, 0, 0)
    expected = reference.robustness(formula, run, 0, 0)
    assert math.isclose(last.least, expected, rel_tol=0.0, abs_tol=1e-9) or last.least == expected


@given(slow_cases(), seeds)
def test_what_nobody_has_seen_is_bounded_by_the_last_sample(case: Case, seed: int) -> None:
    mission, kernel = asked(slowed(case.run.mission, 0.4), case.formula)
    (judgement,) = monitor(mission, kernel, case.trace).requirements
    hidden = np.random.default_rng(seed).integers(0, 3, case.trace.position.shape[:2]) == 0
    judge, doubt = LiveJudge(mission, kernel), np.zeros(len(hidden))
    position = case.trace.position[:, 0] + 0.4
    for step in range(hidden.shape[1]):
        doubt = np.where(hidden[:, step], doubt + 0.4 if step else 1.0, 0.0)
        position = np.where(hidden[:, step, None], position, case.trace.position[:, step])
        velocity = np.where(hidden[:, step, None], 0.0, case.trace.velocity[:, step])
        (standing,) = judge.advance(position, velocity, case.trace.heading[:, step], doubt)
        assert_fits(standing, judgement)


@given(cases())
def test_agents_that_outrun_their_top_speed_are_judged_by_what_was_seen(case: Case) -> None:
    mission, kernel = asked(slowed(case.run.mission, 0.1), case.formula)
    ((*_, last),) = zip(*standings(mission, kernel, case.trace), strict=True)
    assert_final(last, monitor(mission, kernel, case.trace).requirements[0])


@st.composite
def endless_cases(draw: st.DrawFn) -> Case:
    """A random walk, and a formula with windows to the end below one that is over the whole mission."""
    size, steps = draw(st.integers(1, 3)), draw(st.integers(1, 6))
    generator = np.random.default_rng(draw(seeds))
    places = [generator.integers(0, 5, (size, 2)) / 2]
    places += walk(generator, places[0], steps, 0.4)
    trace = trace_of(np.stack(places, axis=1).tolist())
    to_end = ir.Window(Steps(0), None, SPAN)
    outer, inner = draw(st.permutations(["always", "eventually"]))
    if draw(st.booleans()):
        both = draw(formulas(size, 0, 1)), draw(formulas(size, 0, 1))
        formula: ir.Formula = ir.Apply(by_name["until" if outer == "always" else "release"], both, to_end, SPAN)
    else:
        formula = ir.Apply(by_name[inner], (draw(formulas(size, 0, 1)),), to_end, SPAN)
    if draw(st.booleans()):
        join = by_name["or" if outer == "always" else "and"]
        formula = ir.Apply(join, (draw(formulas(size, 0, 1)), formula), None, SPAN)
    if draw(st.booleans()):
        kind = draw(st.sampled_from(["every", "some"]))
        everybody = ir.AgentSet("drone", tuple(range(size)), SPAN)
        formula = ir.AtLeastOf(kind, size if kind == "every" else 1, everybody, formula, SPAN)
    return Case(run_of(mission_of(size, steps), trace), trace, ir.Apply(by_name[outer], (formula,), to_end, SPAN))


@given(endless_cases(), seeds)
def test_windows_to_the_end_below_one_another_are_judged_alike(case: Case, seed: int) -> None:
    check(case, 0.4, seed)


@pytest.mark.parametrize("name", ["eventually", "until"])
def test_a_response_without_a_deadline_keeps_few_steps(name: str) -> None:
    size, steps = 2, 300
    trace = trace_of(np.random.default_rng(0).uniform(0, 2, (size, steps + 1, 2)).tolist())
    to_end = ir.Window(Steps(0), None, SPAN)
    asks, answers = (ir.Holds(ir.Inside(region, False), SPAN) for region in REGIONS[:2])
    answered = (answers,) if name == "eventually" else (ir.Holds(ir.Inside(REGIONS[2], False), SPAN), answers)
    later = ir.Apply(by_name[name], answered, to_end, SPAN)
    formula = ir.Apply(by_name["always"], (ir.Apply(by_name["implies"], (asks, later), None, SPAN),), to_end, SPAN)
    mission, kernel = asked(mission_of(size, steps), formula)
    judge = LiveJudge(mission, kernel)
    for step in range(steps + 1):
        (last,) = judge.advance(trace.position[:, step], trace.velocity[:, step])
    assert_final(last, monitor(mission, kernel, trace).requirements[0])
    assert max(columns.values.shape[2] for columns in judge.columns.values()) < 100


def test_two_windows_to_the_end_in_one_formula_keep_every_step() -> None:
    """So the documentation says: what such formulas are worth is not known to go into less."""
    to_end = ir.Window(Steps(0), None, SPAN)
    late = [
        ir.Apply(by_name["eventually"], (ir.Holds(ir.Inside(region, False), SPAN),), to_end, SPAN) for region in REGIONS
    ]
    either = ir.Apply(by_name["or"], (late[0], late[1]), None, SPAN)
    mission, kernel = asked(mission_of(1, 60), ir.Apply(by_name["always"], (either,), to_end, SPAN))
    judge = LiveJudge(mission, kernel)
    for _ in range(61):
        judge.advance(np.zeros((1, 2)), np.zeros((1, 2)))
    assert max(columns.values.shape[2] for columns in judge.columns.values()) > 60


@given(st.integers(1, 4), st.integers(0, 4), seeds)
def test_rtamt_finds_the_same_robustness(near: int, far: int, seed: int) -> None:
    """Where it is installed; its windows are cut at the end of a trace, so that only what fits in it is compared."""
    rtamt = pytest.importorskip("rtamt")
    steps = near + far
    places = np.random.default_rng(seed).integers(0, 9, (1, steps + 1, 2)) / 4
    trace = trace_of(places.tolist())
    beyond = {
        axis: ir.Holds(ir.Compare(((1.0, ir.Coordinate(number)),), -1.0, False), SPAN)
        for number, axis in enumerate("xy")
    }
    windows = [ir.Window(Steps(0), Steps(number), SPAN) for number in (near, far)]
    inner = ir.Apply(by_name["until"], (beyond["x"], beyond["y"]), windows[1], SPAN)
    formulas = {
        f"always[0:{near}](eventually[0:{far}](x >= 1))": ir.Apply(
            by_name["always"], (ir.Apply(by_name["eventually"], (beyond["x"],), windows[1], SPAN),), windows[0], SPAN
        ),
        f"eventually[0:{near}]((x >= 1) until[0:{far}] (y >= 1))": ir.Apply(
            by_name["eventually"], (inner,), windows[0], SPAN
        ),
    }
    for text, formula in formulas.items():
        specification = rtamt.StlDiscreteTimeSpecification()
        for name in ("x", "y", "out"):
            specification.declare_var(name, "float")
        specification.spec = f"out = {text}"
        specification.parse()
        columns = {axis: places[0, :, number].tolist() for number, axis in enumerate("xy")}
        expected = specification.evaluate({"time": list(range(steps + 1)), **columns})[0][1]
        mission, kernel = asked(mission_of(1, steps), formula)
        for (standing,) in standings(mission, kernel, trace):
            assert standing.least - CLOSE <= expected <= standing.most + CLOSE
        assert standing.least == standing.most == expected


ANYWHERE = 1e6
"""m/s: at such a speed nothing is known of where agents are a step later."""
EAST, NEAR = (Atom(ir.Compare(((1.0, ir.Coordinate(0)),), constant, False)) for constant in (-1.0, -0.5))
OTHER = At(1, Atom(ir.Compare(((1.0, ir.Coordinate(0)),), 0.0, False)))
INCREASING = [
    EAST,
    *(made(EAST, low, high) for made in (Always, Eventually) for low, high in ((0, 3), (2, 5), (3, None), (0, None))),
    *(made(OTHER, EAST, low, high) for made in (Until, Release) for low, high in ((0, 4), (2, 5), (1, None))),
    *(Always(made(EAST, low, high), 2, 7) for made in (Always, Eventually) for low, high in ((-2, 0), (-4, -1))),
    *(Eventually(made(OTHER, EAST, low, high), 1, 8) for made in (Until, Release) for low, high in ((-3, 0), (-5, -2))),
    *(Always(made(EAST, -8, 0), 0, 8) for made in (Always, Eventually)),
    *(Always(made(OTHER, EAST, -8, 0), 0, 8) for made in (Until, Release)),
    Always(Eventually(EAST, 1, 3), 0, 4),
    Eventually(Always(OTHER, 1, 4), 0, 3),
    Always(Until(NEAR, Eventually(OTHER, 0, 2), 1, 3), 0, 3),
    AtLeast(2, (Always(NEAR, 0, 4), Eventually(OTHER, 2, 6), Until(OTHER, EAST, 0, 6))),
    Any((Always(EAST, 1, 4), All((Eventually(NEAR, 3, 5), Always(OTHER, 2, 6))))),
]
"""Formulas that are the truer the further east everybody is."""


def test_the_bounds_are_the_worst_and_the_best_that_may_come(subtests: pytest.Subtests) -> None:
    for formula, (steps, seed) in product(INCREASING, [(8, 1), (20, 2)]):
        with subtests.test(type(formula).__name__, steps=steps, seed=seed):
            mission = slowed(mission_of(2, steps), ANYWHERE)
            kernel = Kernel((Goal("east", At(0, formula), SPAN),), ())
            position = np.random.default_rng(seed).uniform(-3.0, 3.0, (2, steps + 1, 2))
            flown = trace_of(position.tolist())
            for step, (standing,) in enumerate(standings(mission, kernel, flown)):
                ends = []
                for far in (-ANYWHERE, ANYWHERE):
                    position_then = position.copy()
                    position_then[:, step + 1 :, 0] = far
                    (judgement,) = monitor(mission, kernel, trace_of(position_then.tolist())).requirements
                    ends.append(float(np.clip(judgement.robustness, -100.0, 100.0)))
                assert np.clip([standing.least, standing.most], -100.0, 100.0) == pytest.approx(ends, abs=1e-9), step


def at(agent: int, *formulas: Node) -> Node:
    return At(agent, formulas[0] if len(formulas) == 1 else All(formulas))


WEST, HALFWAY = [-3.0] * 9, [-3.0, -3.0, 2.0, -3.0, 2.0, 2.0, 2.0, 2.0, 2.0]
"""x at each step."""


@pytest.mark.parametrize(
    ("formula", "by"),
    [
        (Eventually(EAST, 0, 3), [3, 3, 3, 3, 4, 5, 6, 7, 8]),
        (at(1, Eventually(EAST, 0, 3)), [3, 3, 2, 3, 4, 5, 6, 7, 8]),
        (Any((Eventually(EAST, 0, 3), at(1, Eventually(EAST, 3, 6)))), [6, 6, 6, 6, 4, 5, 6, 7, 8]),
        (All((Eventually(EAST, 0, 5), at(1, Eventually(EAST, 1, 6)))), [6, 6, 5, 5, 5, 5, 6, 7, 8]),
        (All((Eventually(EAST, 0, 3), at(1, Always(EAST, 4, 7), Eventually(EAST, 0, 8)))), [8, 8, 7, 3, 4, 5, 6, 7, 8]),
        (
            Any((at(0, Always(EAST, 0, 2)), at(1, Eventually(EAST, 3, 3), Always(NEAR, 2, 7)))),
            [7, 7, 7, 3, 4, 5, 6, 7, 8],
        ),
        (Any((at(0, Always(EAST, 0, 2)), at(1, Eventually(EAST, 4, 5), Always(NEAR, 4, 7)))), [7] * 7 + [7, 8]),
        (Any((at(0, Eventually(EAST, 2, 4)), at(1, Eventually(EAST, 2, 4)))), [4, 4, 2, 3, 4, 5, 6, 7, 8]),
        (All((at(0, Eventually(EAST, 2, 4)), at(1, Eventually(EAST, 2, 4)))), [4, 4, 4, 4, 4, 5, 6, 7, 8]),
        (Eventually(Always(EAST, 0, 2), 1, 3), [5, 5, 5, 3, 4, 5, 6, 7, 8]),
        (AtLeast(2, (Eventually(EAST, 0, 3), at(1, Eventually(EAST, 0, 6)))), [6, 6, 6, 3, 4, 5, 6, 7, 8]),
    ],
)
def test_an_open_goal_says_by_when_it_is_decided_at_the_latest(formula: Node, by: list[int]) -> None:
    mission = slowed(mission_of(2, 8), ANYWHERE)
    kernel = Kernel((Goal("east", At(0, formula), SPAN),), ())
    flown = trace_of([[(x, 0.0) for x in along] for along in (WEST, HALFWAY)])
    assert [standing.decided_by for (standing,) in standings(mission, kernel, flown)] == by

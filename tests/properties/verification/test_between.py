"""What is said to be sure between the steps, against the same motion looked at many times in each step."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TypeVar

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missionc import ir
from missionc.base.trace import Flags, Trace
from missionc.base.units import Seconds, Steps
from missionc.geometry.curves.piecewise_polynomials import motion
from missionc.ir import Mission
from missionc.ir.kernel.analysis import steps_ahead
from missionc.ir.kernel.nodes import Node, UntilNode, WindowNode
from missionc.ir.kernel.walk import looks_back
from missionc.ir.language.operator import Bounds, Operator
from missionc.ir.language.operators import OPERATORS, by_name
from missionc.ir.lower.expand import expand
from missionc.verification.between.between_steps import between_steps
from missionc.verification.between.interval_sets import (
    STEP,
    Motion,
    Signal,
    Spans,
    looking_back_over,
    of_parts,
    sometime,
    throughout,
    until_over_time,
)
from missionc.verification.between.truth_over_time import TruthOverTime
from missionc.verification.monitoring.evaluate import Evaluation as Truth
from missionc.verification.monitoring.logic import TRUTH, Values
from missionc.verification.monitoring.monitor import truths
from tests.support.random_runs import SPAN, Case, cases, mission_of, trace_of

LONG = 12
"""Ticks of the small signals."""

FINER = 64
"""Moments looked at in each step."""


# ------------------------------------------------------------- the operators
# A signal that may change at whole ticks is known by its values at them and halfway between: 0, 0.5, 1, …


@st.composite
def signals(draw: st.DrawFn) -> tuple[Signal, list[bool]]:
    """A signal, and one of the ways in which what it leaves open may be."""
    words = draw(st.lists(st.sampled_from("yn?"), min_size=LONG, max_size=LONG))
    sure, never = (of_word(words, letter) for letter in "yn")
    open_ = draw(st.lists(st.booleans(), min_size=2 * LONG + 1, max_size=2 * LONG + 1))
    facts = [has(sure, moment) or (not has(never, moment) and open_[moment]) for moment in range(2 * LONG + 1)]
    return Signal(sure, never), facts


def of_word(words: list[str], letter: str) -> Spans:
    """The stretches of a letter, cut off by a tick where another one follows."""
    spans, begun = [], None
    for tick, word in enumerate([*words, ""]):
        if word == letter and begun is None:
            begun = tick
        if word != letter and begun is not None:
            spans.append((begun, tick if tick == LONG else tick - 1))
            begun = None
    return tuple(spans)


def has(spans: Spans, moment: int) -> bool:
    """Moments are in halves of ticks."""
    return any(2 * low <= moment <= 2 * high for low, high in spans)


def agrees(found: Signal, fact: Callable[[int], bool], last: int) -> None:
    for moment in range(2 * last + 1):
        assert not (has(found.sure, moment) and has(found.never, moment))
        if has(found.sure, moment):
            assert fact(moment), moment
        if has(found.never, moment):
            assert not fact(moment), moment


windows = st.tuples(st.integers(0, 4), st.integers(0, 4)).map(lambda pair: (pair[0], pair[0] + pair[1]))


@settings(max_examples=300)
@given(signals(), windows, st.booleans())
def test_what_is_sure_at_some_or_every_moment_is_so(
    one: tuple[Signal, list[bool]], window: tuple[int, int], open_end: bool
) -> None:
    (signal, facts), (low, high) = one, window
    last = LONG - (low if open_end else high)

    def moments(now: int) -> list[bool]:
        return facts[now + 2 * low : (2 * LONG if open_end else now + 2 * high) + 1]

    bound = None if open_end else high
    agrees(sometime(signal, low, bound, LONG), lambda now: any(moments(now)), last)
    agrees(throughout(signal, low, bound, LONG), lambda now: all(moments(now)), last)


@settings(max_examples=500)
@given(signals(), signals(), windows, st.booleans())
def test_what_is_sure_of_until_is_so(
    hold: tuple[Signal, list[bool]], goal: tuple[Signal, list[bool]], window: tuple[int, int], open_end: bool
) -> None:
    low, high = window

    def fact(now: int) -> bool:
        end = 2 * LONG if open_end else now + 2 * high
        return any(goal[1][then] and all(hold[1][now:then]) for then in range(now + 2 * low, end + 1))

    found = until_over_time(hold[0], goal[0], low, None if open_end else high, LONG)
    agrees(found, fact, LONG - (low if open_end else high))


@settings(max_examples=500)
@given(signals(), signals(), windows)
def test_what_is_sure_of_the_past_is_so(
    hold: tuple[Signal, list[bool]], goal: tuple[Signal, list[bool]], window: tuple[int, int]
) -> None:
    low, high = window
    of_goal = partial(looking_back_over, sometime, low=low, high=high, end=LONG)

    def moments(now: int) -> range:
        return range(max(now - 2 * high, 0), now - 2 * low + 1)

    agrees(of_goal(goal[0]), lambda now: any(goal[1][then] for then in moments(now)), LONG)
    agrees(of_goal(goal[0].denied).denied, lambda now: all(goal[1][then] for then in moments(now)), LONG)
    found = looking_back_over(until_over_time, hold[0], goal[0], low=low, high=high, end=LONG)
    agrees(
        found,
        lambda now: any(goal[1][then] and all(hold[1][then + 1 : now + 1]) for then in moments(now)),
        LONG,
    )


@given(st.lists(signals(), max_size=4), st.integers(-1, 5))
def test_what_is_sure_of_so_many_is_so(parts: list[tuple[Signal, list[bool]]], count: int) -> None:
    found = of_parts(count, [signal for signal, _ in parts], LONG)
    agrees(found, lambda now: sum(facts[now] for _, facts in parts) >= count, LONG)


@given(signals(), windows)
def test_what_is_known_of_every_moment_decides_every_window(
    one: tuple[Signal, list[bool]], window: tuple[int, int]
) -> None:
    """Nothing is lost where nothing is open."""
    whole = Signal(((0, LONG),), ())
    low, high = window
    for found in (
        sometime(whole, low, high, LONG),
        throughout(whole, low, high, LONG),
        until_over_time(whole, whole, low, high, LONG),
    ):
        assert has(found.sure, 0)
        assert has(found.sure, 2 * (LONG - high))
    assert throughout(whole, low, None, LONG).sure == ((0, LONG - low),)


# ------------------------------------------------------------- whole formulas


def shaken(case: Case, seed: int) -> Trace:
    """The case's run, away from the grid where every border would be met exactly."""
    position = case.trace.position + np.random.default_rng(seed).uniform(-0.2, 0.2, case.trace.position.shape)
    return trace_of(position.tolist())


def finer(trace: Trace) -> Trace:
    """The same motion with as many steps more."""
    steps = trace.position.shape[1] - 1
    at = np.arange(steps * FINER + 1) / FINER
    step = np.minimum(at.astype(int), max(steps - 1, 0))
    start, move = trace.position[:, :-1], np.diff(trace.position, axis=1)
    position = start[:, step] + move[:, step] * (at - step)[:, None]
    return Trace(Seconds(1 / FINER), position, move[:, step], np.zeros(position.shape[:2]))


class FinerTruth(Truth):
    """Truth where a mission's step is so many finer ones: windows are counted in those.

    What holds until something else is not asked at those from which it looks past the last one.
    """

    def __init__(self, mission: Mission, trace: Trace, formula: Node) -> None:
        super().__init__(TRUTH, mission, trace)
        self.ahead = steps_ahead((formula,))

    def window(self, node: WindowNode, body: Values) -> Values:
        return super().window(stretched(node), body)

    def until(self, node: UntilNode, hold: Values, end: Values) -> Values:
        hold = np.broadcast_to(hold, (len(hold), self.steps)).copy()
        if not looks_back(node):
            hold[:, max(self.steps - self.ahead[node.hold] * FINER, 0) :] = not node.every
        return super().until(stretched(node), hold, end)


Windowed = TypeVar("Windowed", bound="WindowNode | UntilNode")


def stretched(node: Windowed) -> Windowed:
    return replace(node, low=node.low * FINER, high=None if node.high is None else node.high * FINER)


def judged(case: Case, trace: Trace) -> tuple[Signal, Flags]:
    """When the formula is sure of agent 0, and its truth in the finer steps."""
    size, steps = trace.position.shape[0], trace.position.shape[1] - 1
    mission = mission_of(size, steps, ir.Requirement("asked", case.formula, SPAN))
    kernel, findings = expand(mission)
    assert kernel is not None, findings
    formula = kernel.requirements[0].formula
    signal = TruthOverTime(Motion(mission, motion(mission, trace))).of(formula)[formula][0]
    slow = replace(mission, step=Seconds(1 / FINER), steps=Steps(steps * FINER))
    found = FinerTruth(slow, finer(trace), formula).values((formula,))[formula]
    return signal, np.broadcast_to(found, (size, steps * FINER + 1))[0]


def contradictions(signal: Signal, flags: Flags, ticks: range) -> list[int]:
    """The finer steps at which what is sure is not so."""
    found = []
    for number in ticks:
        tick = number * STEP // FINER
        sure, never = (any(low <= tick <= high for low, high in spans) for spans in (signal.sure, signal.never))
        if (sure and not flags[number]) or (never and flags[number]):
            found.append(number)
    return found


def temporal(formula: ir.Formula) -> bool:
    match formula:
        case ir.Apply(operator, operands):
            # What has to hold since a moment is seen at finer steps alone, and may fail for less than one of them.
            alone = operator.bounds is Bounds.TIME or operator.name in ("next", "since")
            return alone or any(map(temporal, operands))
        case ir.OfAgent(_, body) | ir.AtLeastOf(_, _, _, body) | ir.Without(_, _, body):
            return temporal(body)
        case _:
            return False


@pytest.mark.parametrize("operator", OPERATORS, ids=lambda operator: operator.name)
@settings(max_examples=10, deadline=None)
@given(data=st.data())
def test_what_is_sure_of_a_formula_is_so_at_every_moment_looked_at(operator: Operator, data: st.DataObject) -> None:
    case = data.draw(cases(operator))
    trace = shaken(case, data.draw(st.integers(0, 2**32 - 1)))
    signal, flags = judged(case, trace)
    last = 0 if temporal(case.formula) else trace.position.shape[1] - 1
    assert contradictions(signal, flags, range(last * FINER + 1)) == []


@pytest.mark.parametrize("operator", ["always", "until", "reach", "count"])
def test_most_of_what_a_shaken_run_does_is_decided(operator: str) -> None:
    """What is sound because it says nothing is no use."""
    open_ = total = 0

    @settings(max_examples=15, deadline=None, derandomize=True, database=None)
    @given(cases(by_name[operator]), st.integers(0, 2**32 - 1))
    def count(case: Case, seed: int) -> None:
        nonlocal open_, total
        signal, _ = judged(case, shaken(case, seed))
        total += 1
        open_ += not any(spans and spans[0][0] == 0 for spans in (signal.sure, signal.never))

    count()
    assert open_ <= total // 10


@settings(max_examples=150, deadline=None)
@given(cases(), st.integers(0, 2**32 - 1))
def test_what_does_not_hold_throughout_has_a_moment_and_a_sentence(case: Case, seed: int) -> None:
    trace = shaken(case, seed)
    size, steps = trace.position.shape[0], trace.position.shape[1] - 1
    mission = mission_of(size, steps, ir.Requirement("asked", ir.OfAgent(0, case.formula, SPAN), SPAN))
    kernel, findings = expand(mission)
    assert kernel is not None, findings
    at_steps = truths([kernel.requirements[0].formula], mission, trace)[kernel.requirements[0].formula][0, 0]
    found = between_steps(mission, kernel, trace, motion(mission, trace))
    assert len(found) == bool(at_steps)
    for each in found:
        if each.holds:
            assert (each.at, each.until, each.agents, each.detail) == (None, None, (), "")
        else:
            assert each.at is not None
            assert each.until is not None
            assert 0 <= each.at <= each.until <= steps
            assert set(each.agents) <= {agent.name for agent in mission.agents}
            assert each.detail.startswith("`asked` is true at every sample")

"""What is said of a formula: something of every one, different things of different ones, and windows where they lie."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
from hypothesis import given, settings

from missionc import ir
from missionc.base.units import Metric, Steps
from missionc.frontend.checks.check_horizons import steps_ahead
from missionc.frontend.explain.explanation import document, explained, lines, traps_of
from missionc.frontend.explain.sentences import MOST_PARTS, Sentences, sentences
from missionc.frontend.explain.window_diagram import WIDTH, draw, windows
from missionc.frontend.resolve.show_ir import show_formula
from missionc.ir.language.operator import Bounds
from missionc.ir.language.operators import OPERATORS, by_name
from missionc.ir.language.walk_formulas import formulas_bottom_up, goals, reaches_back
from tests.support.random_flight_missions import random_mission
from tests.support.random_runs import BASE, FIELD, SPAN, Case, cases, mission_of
from tests.support.resolved_missions import mission as resolved

MISSION = mission_of(3, 12)


def whole(said: Sentences) -> str:
    return "\n".join([said.whole, *(part.sentence for part in said.parts)])


@settings(max_examples=300)
@given(cases())
def test_something_is_said_of_every_formula(case: Case) -> None:
    said = sentences(case.formula, case.run.mission)
    for sentence in [said.whole, *(part.sentence for part in said.parts)]:
        assert len(sentence) > len("X is Y")
        assert sentence.endswith(".")
        assert not any(twice in sentence for twice in ("  ", ",,", ", ,", " ,", "None"))
        assert not set("{}") & set(sentence)
    assert len({part.name for part in said.parts}) == len(said.parts)
    assert all(part.name in whole(replace(said, parts=said.parts[:place])) for place, part in enumerate(said.parts))
    assert len(set(traps_of(case.formula))) == len(traps_of(case.formula))


def family() -> list[ir.Formula]:
    """Two predicates, and every operator on them, on itself and on each other, up to two within each other."""
    leaves: list[ir.Formula] = [ir.Holds(ir.Inside(region, False), SPAN) for region in (BASE, FIELD)]
    once = [*leaves, *larger(leaves[:1], leaves)]
    return [*once, *larger(once, leaves), *larger(leaves, once[2:])]


def larger(lefts: list[ir.Formula], rights: list[ir.Formula]) -> list[ir.Formula]:
    drones = MISSION.teams[0]
    found: list[ir.Formula] = []
    for operator in OPERATORS:
        number = (">=", 2) if operator.name == "count" else ("", 0)
        operands = list(itertools.product(*([lefts, rights] if operator.arity == 2 else [lefts])))
        for bounds in bounds_of(operator.bounds):
            found += [ir.Apply(operator, below, bounds, SPAN, *number) for below in operands]
    for body in lefts:
        found.append(ir.AtLeastOf("every", 3, drones, body, SPAN))
        found.append(ir.AtLeastOf("some", 1, drones, body, SPAN))
        found.append(ir.AtLeastOf("at least", 2, drones, body, SPAN))
    return found


def bounds_of(kind: Bounds) -> list[ir.Window | ir.Length | ir.Period | None]:
    if kind is Bounds.TIME:
        return [ir.Window(Steps(low), None if high is None else Steps(high), SPAN) for low, high in ((0, 2), (1, None))]
    if kind is Bounds.PERIOD:
        return [ir.Period(Steps(2), SPAN)]
    if kind is Bounds.PAST:
        return [ir.Window(Steps(low), Steps(high), SPAN) for low, high in ((0, 2), (1, 3))]
    if kind is Bounds.LENGTH:
        return [
            ir.Length(MISSION.graphs[0], Metric.HOPS, low, high, SPAN) for low, high in ((0.0, 2.0), (1.0, math.inf))
        ]
    return [None]


def test_different_formulas_are_told_apart() -> None:
    heard: dict[str, str] = {}
    formulas = family()
    for formula in formulas:
        meant = unfolded(formula)
        said = whole(sentences(formula, MISSION))
        assert heard.setdefault(said, meant) == meant, said
    assert len(heard) > 1500


def unfolded(formula: ir.Formula) -> str:
    """The formula as text, but for what says the same: a chain within a chain of its kind."""
    if isinstance(formula, ir.Apply) and formula.operator.name in ("and", "or"):
        parts = []
        for operand in formula.operands:
            inner = isinstance(operand, ir.Apply) and operand.operator is formula.operator
            parts += operand.operands if inner and isinstance(operand, ir.Apply) else [operand]
        formula = replace(formula, operands=tuple(parts))
    return show_formula(formula, {}, MISSION)


def _to_the_end(bounds: ir.Window | ir.Length | ir.Period | None) -> bool:
    """Whether what is looked at ends with the mission, however little of it would do."""
    return isinstance(bounds, ir.Period) or (isinstance(bounds, ir.Window) and bounds.high is None)


@settings(max_examples=300)
@given(cases())
def test_the_windows_drawn_reach_as_far_as_the_formula_looks(case: Case) -> None:
    mission = case.run.mission
    spans = list(windows(case.formula, mission))
    total = steps_ahead([case.formula])[case.formula].total
    looks = max((span.looks for span in spans), default=0)
    for span in spans:
        assert 0 <= span.first[0] <= span.last[0] <= mission.steps
        assert 0 <= span.first[1] <= span.last[1] <= mission.steps
        assert span.looks <= mission.steps
    parts = formulas_bottom_up([case.formula])
    if any(map(reaches_back, parts)):  # a window before the start is not drawn, nor what is looked at in it
        assert looks <= total
    elif not any(isinstance(part, ir.Apply) and _to_the_end(part.bounds) for part in parts):
        assert looks == total
    elif math.isfinite(total):
        assert looks >= total


@settings(max_examples=100)
@given(cases())
def test_a_drawing_fits_the_page_in_either_alphabet(case: Case) -> None:
    for unicode in (True, False):
        lines = draw(windows(case.formula, case.run.mission), case.run.mission, unicode)
        assert all(len(line) <= WIDTH for line in lines)
        assert unicode or "".join(lines).isascii()


def test_a_window_within_a_window_slides_with_it() -> None:
    inner = ir.Apply(by_name["eventually"], (family()[0],), ir.Window(Steps(1), Steps(3), SPAN), SPAN)
    outer = ir.Apply(by_name["always"], (inner,), ir.Window(Steps(2), Steps(8), SPAN), SPAN)
    first, second = windows(outer, MISSION)
    assert (first.depth, first.first, first.last, first.slides) == (0, (2, 8), (2, 8), False)
    assert (second.depth, second.first, second.last, second.slides) == (1, (3, 5), (9, 11), True)
    assert second.looks == steps_ahead([outer])[outer].total == 11


def test_the_left_side_of_until_is_asked_a_step_less_long() -> None:
    base = ir.Holds(ir.Inside(BASE, False), SPAN)
    held = ir.Apply(by_name["always"], (base,), ir.Window(Steps(0), Steps(2), SPAN), SPAN)
    until = ir.Apply(by_name["until"], (held, base), ir.Window(Steps(1), Steps(5), SPAN), SPAN)
    spans = {span.formula.operator.name: span for span in windows(until, MISSION)}
    assert spans["until"].first == (1, 5)
    assert (spans["always"].first, spans["always"].last) == ((0, 2), (4, 6))


def test_formulas_that_are_deep_or_used_twice_are_said_in_parts() -> None:
    formula: ir.Formula = ir.Holds(ir.Inside(BASE, False), SPAN)
    other: ir.Formula = ir.Holds(ir.Inside(FIELD, False), SPAN)
    for turn in range(1200):
        formula = ir.Apply(
            by_name[("implies", "iff", "or")[turn % 3]], (formula, formula if turn < 60 else other), None, SPAN
        )
    said = sentences(formula, MISSION)
    assert len(said.parts) == MOST_PARTS
    assert said.left_out > 0
    assert max(len(part.sentence) for part in said.parts) < 20_000


def test_a_page_is_made_of_every_random_mission() -> None:
    generator = np.random.default_rng(7)
    for _ in range(60):
        mission = resolved(random_mission(generator))
        parts = explained(mission)
        assert [part.name for part in parts] == [goal.name for goal in goals(mission)]
        assert all(part.said.whole for part in parts)
        page = lines(parts, mission, None, True)
        assert max(map(len, page)) <= WIDTH
        assert document(parts, mission, None)["goals"]

"""Formulas about a team without some of its agents."""

from __future__ import annotations

import math

import numpy as np
import pytest

from missionc import ir
from missionc.base.limits import Limits
from missionc.base.trace import Trace
from missionc.base.units import Seconds
from missionc.frontend.explain.sentences import sentences
from missionc.frontend.resolve.show_ir import show_ir
from missionc.ir.kernel.nodes import All
from missionc.ir.lower.expand import expand
from missionc.verification.monitoring.monitor import monitor
from tests.support.resolved_missions import codes, demo, mission, texts

TEAM = "team drone[4] { dynamics single_integrator(speed <= 2 m/s)  start line (1, 1) to (4, 1) }"
MORE = "graph radio = proximity 1.5 m\nformation row = chain of drone spacing 1 m tolerance 0.25 m"
USED = "\nrequire used: connected(radio) or row or (some drone: goal)"
ROW = ((1.0, 1.0), (2.0, 1.0), (3.0, 1.0), (4.0, 1.0))
RING = ((1.0, 1.0), (2.0, 1.0), (2.0, 2.0), (1.0, 2.0))


def text(require: str) -> str:
    return demo(team=TEAM, more=MORE, require=f"require it: {require}{USED}")


def of(require: str) -> ir.Without:
    formula = mission(text(require)).requirements[0].formula
    assert isinstance(formula, ir.Without)
    return formula


def worth(require: str, places: tuple[tuple[float, float], ...]) -> float:
    """The robustness of a requirement for a team that stands at these places."""
    found = mission(text(require))
    kernel, _ = expand(found)
    assert kernel is not None
    position = np.repeat(np.array(places)[:, None], found.steps + 1, axis=1)
    trace = Trace(Seconds(1.0), position, np.zeros_like(position), np.zeros(position.shape[:2]))
    judged = monitor(found, kernel, trace).requirements[0]
    assert judged.satisfied == (judged.robustness > 0)
    return judged.robustness


def test_each_case_is_the_same_words_of_whoever_is_left() -> None:
    found = of("without any 1 drone: (every drone: goal) and connected(radio) and row")
    assert found.lost == ((0,), (1,), (2,), (3,))
    for lost, case in zip(found.lost, found.cases, strict=True):
        left = tuple(agent for agent in range(4) if agent not in lost)
        assert case.span == found.body.span
        assert isinstance(case, ir.Apply)
        everybody, linked, shaped = case.operands
        assert isinstance(everybody, ir.AtLeastOf)
        assert isinstance(linked, ir.Holds)
        assert isinstance(shaped, ir.Holds)
        assert (everybody.number, everybody.agents.agents) == (3, left)
        assert linked.predicate.restricted is not None
        assert linked.predicate.restricted.agents == left
        assert shaped.predicate.formation is not None
        assert all(not set(lost) & {edge.first, edge.second} for edge in shaped.predicate.formation.edges)


def test_what_nobody_lost_bears_on_is_one_formula_in_every_case() -> None:
    found = of("without any 2 drone[0..2]: (drone[3]: eventually[0, 9 s] goal) or (some drone: goal)")
    assert len(found.cases) == 3
    first, *others = (case.operands[0] for case in found.cases if isinstance(case, ir.Apply))
    assert all(each is first for each in others)


def test_the_kernel_has_a_conjunction_and_nothing_else() -> None:
    kernel, _ = expand(mission(text("without any 1 drone: some drone: goal")))
    assert kernel is not None
    node = kernel.requirements[0].formula
    assert isinstance(node, All)
    assert len(node.parts) == 4


def test_two_that_are_lost_one_after_the_other_are_any_two() -> None:
    twice = of("without any 1 drone: without any 1 drone: some drone: goal")
    pairs = {
        frozenset((*one, *other))
        for one, inner in zip(twice.lost, twice.cases, strict=True)
        if isinstance(inner, ir.Without)
        for other in inner.lost
    }
    assert pairs == {frozenset(pair) for pair in of("without any 2 drone: some drone: goal").lost}


@pytest.mark.parametrize(
    ("require", "places", "expected"),
    [
        ("without any 1 drone: connected(radio)", ROW, -0.5),
        ("without any 1 drone: connected(radio)", RING, 0.5),
        ("without any 2 drone: connected(radio)", RING, 1.5 - math.sqrt(2.0)),
        ("without any 1 drone[3]: connected(radio)", ROW, 0.5),
        ("without any 1 drone: row", ROW, 0.25),
        ("without any 3 drone: connected(radio)", RING, math.inf),
        ("without any 1 drone: some drone: distance(goal) <= 7 m", ROW, 7 - math.hypot(4, 6)),
        ("without any 1 drone: some drone: x >= 3.5", ROW, -0.5),
        ("without any 1 drone: every drone: x <= 3.5", ROW, -0.5),
        ("without any 1 drone: at least 2 drone: x >= 1.5", ROW, 0.5),
        ("without any 4 drone: every drone: x >= 9", ROW, math.inf),
        ("without any 4 drone: some drone: x >= 0", ROW, -math.inf),
        ("without any 1 drone: every drone: count[hops 1..1 on radio] drone >= 1", ROW, -0.5),
        ("without any 1 drone: every drone: count[hops 1..1 on radio] drone >= 1", RING, 0.5),
        ("without any 1 drone: every drone[0]: x <= 2", ROW, 1.0),
        ("without any 1 drone: some drone[0]: x <= 2", ROW, -math.inf),
        ("not (without any 1 drone: connected(radio))", ROW, 0.5),
    ],
)
def test_it_is_worth_what_the_worst_loss_leaves(
    require: str, places: tuple[tuple[float, float], ...], expected: float
) -> None:
    assert worth(require, places) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("require", "code"),
    [
        ("without any 1 drone: drone[0]: goal", "MC220"),
        ("without any 1 drone: every drone: distance(drone[1]) <= 9 m", "MC220"),
        ("without any 2 drone: distance(drone[0], drone[1]) <= 9 m", "MC220"),
        ("without any 1 drone: without any 1 drone: drone[0]: goal", "MC220"),
        ("without any 1 drone: goal", "MC203"),
        ("every drone: without any 1 drone: some drone: goal", "MC204"),
        ("without any 5 drone: some drone: goal", "MC210"),
        ("without any 0 drone: some drone: goal", "MC210"),
        ("without any 1.5 drone: some drone: goal", "MC209"),
    ],
)
def test_a_loss_that_cannot_be_meant_is_refused(require: str, code: str) -> None:
    assert set(codes(text(require))) == {code}


def test_more_cases_than_there_is_room_for_are_refused_before_they_are_made() -> None:
    many = "team drone[60] { dynamics single_integrator(speed <= 2 m/s)  start grid (1, 1) to (9, 9) }"
    require = "require it: without any 20 drone: some drone: goal"
    assert codes(demo(team=many, require=require)) == ["MC207"]
    require = "graph g = proximity 2 m\nrequire it: connected(g, 20)"
    assert "MC207" in codes(demo(team=many, require=require))


def test_the_message_says_what_to_write_instead() -> None:
    assert "`drone[0]: goal` names an agent that may be lost" in texts(text("without any 1 drone: drone[0]: goal"))


def test_it_is_printed_and_said_as_written() -> None:
    found = mission(text("without any 1 drone: some drone: eventually[0, 9 s] goal"))
    assert "require it: without any 1 drone: some drone: eventually[0 steps, 9 steps] goal" in show_ir(found)
    said = sentences(found.requirements[0].formula, found).whole
    assert said.startswith(
        "Whichever one drone is lost: at least one drone, at some step from 0 s to 9 s, is in `goal`"
    )
    found = mission(text("without any 2 drone: some drone: goal"))
    assert sentences(found.requirements[0].formula, found).whole.startswith("Whichever 2 drones are lost: ")
    found = mission(text("without any 1 drone[2]: some drone: goal"))
    assert sentences(found.requirements[0].formula, found).whole.startswith("Without drone[2]: ")


def test_copies_for_each_loss_are_counted_before_they_are_made() -> None:
    asked = text("without any 2 drone: connected(radio) and (every drone: goal)")
    assert codes(asked, limits=Limits(formula_nodes=72)) == ["MC207"]
    assert codes(asked, limits=Limits(formula_nodes=73)) == []

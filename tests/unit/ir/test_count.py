"""``count`` as kernel: one agent is a route to it, and more are one and more."""

from __future__ import annotations

import pytest

import missionc
from missionc.backends.api import Impossible
from missionc.base.source import Source
from missionc.compiler.results import Verified
from missionc.ir.kernel.nodes import All, AtLeast, Eventually, Goal, Node, Route
from missionc.ir.kernel.show import show
from missionc.ir.lower.expand import expand
from tests.support.check_findings import meant

TEAM = """\
mission far
time step 1 s, horizon 8 s
world (0, 0) to (10, 10)
region base = box (0.5, 0.5) to (2, 2)
region goal = box (8, 8) to (9.5, 9.5)
team drone[3] { radius 0.1 m  dynamics unicycle(speed 0..2 m/s)  start in base }
graph radio = proximity 1.5 m
"""


def kernel(formula: str) -> tuple[Goal, str]:
    mission = meant(TEAM + f"require r: drone[0]: eventually[0, 8 s] {formula}\n")
    found, _ = expand(mission)
    assert found is not None
    return found.requirements[0], show(found, mission)


def counted(formula: str) -> Node:
    """What the formula came to, below the agent and the window that ask for it."""
    root = kernel(formula)[0].formula
    window = getattr(root, "body", None)
    assert isinstance(window, Eventually)
    return window.body


@pytest.mark.parametrize("bounds", ["hops 0..2", "hops 1..1", "hops 1..2", "distance <= 2 m"])
@pytest.mark.parametrize("comparison", [">= 1", "> 0"])
def test_one_agent_that_counts_is_somewhere(bounds: str, comparison: str) -> None:
    assert kernel(f"count[{bounds}] base {comparison}")[1] == kernel(f"somewhere[{bounds}] base")[1]


@pytest.mark.parametrize("comparison", ["< 1", "<= 0"])
def test_no_agent_that_counts_is_nowhere(comparison: str) -> None:
    nobody, nowhere = kernel(f"count[hops 1..1] base {comparison}")[1], kernel("not somewhere[hops 1..1] base")[1]
    assert [line for line in nobody.splitlines() if "reach" in line] == [
        line for line in nowhere.splitlines() if "reach" in line
    ]
    assert "reach" in nobody
    assert "at least" not in nobody


@pytest.mark.parametrize("bounds", ["hops 1..2", "hops 2..2", "distance <= 2 m"])
def test_more_agents_that_count_are_one_and_more(bounds: str) -> None:
    formula = counted(f"count[{bounds}] base >= 2")
    assert isinstance(formula, All)
    one, more = formula.parts
    assert isinstance(more, AtLeast)
    assert more.count == 2
    assert not isinstance(one, AtLeast)


def test_lengths_bounded_below_in_metres_are_not_tried_route_by_route() -> None:
    formula = counted("count[distance 1 m..2 m] base >= 1")
    assert isinstance(formula, AtLeast)
    assert not any(isinstance(part, Route) for part in formula.parts)


@pytest.mark.parametrize(
    "formula",
    ["count[hops 1..1] base >= 1", "count[hops 1..1] base >= 2", "drone reach[hops 1..1] base"],
)
def test_a_count_that_is_too_far_is_refused_as_the_reach_is(formula: str) -> None:
    text = TEAM + f"require far: some drone: eventually[0, 8 s] (goal and {formula})\nsolve with smt {{ nodes = 40 }}\n"
    outcome = missionc.compile(Source("far.mission", text), backend="smt").outcome
    assert isinstance(outcome, Impossible)
    assert outcome.conflict == ("far",)


def test_a_count_of_two_is_planned() -> None:
    text = TEAM + "require near: drone[0]: eventually[0, 8 s] (goal and count[hops 1..1] goal >= 2)\nsolve with smt\n"
    assert isinstance(missionc.compile(Source("near.mission", text)).outcome, Verified)

"""Mutual exclusion and capacities: agents that want one place at different times are planned one after the other."""

from __future__ import annotations

import numpy as np
import pytest

import missionc
from missionc.backends.smt.prioritized.prioritized_planning import PrioritizedPlanner
from missionc.backends.smt.prioritized.reservations import Exclusion
from missionc.backends.smt.roadmap.labels import Labels
from missionc.backends.smt.roadmap.sequence import roadmaps_to_try
from missionc.base.source import Source
from missionc.compiler.results import Verified
from missionc.ir.kernel.nodes import AtLeast
from missionc.ir.kernel.walk import conjuncts

BRIDGE = """
mission bridge
time step 1 s, horizon 60 s
world (0, 0) to (40, 20)
region bridge = box (16, 8) to (24, 12)
region west = box (0, 0) to (12, 20)
region east = box (28, 0) to (40, 20)
obstacle north = box (16, 11) to (24, 20)
obstacle south = box (16, 0) to (24, 9)
team out[3] { radius 0.4 m  dynamics unicycle(speed 0..2 m/s)  start at (6, 5), (6, 10), (6, 15) }
team back[3] { radius 0.4 m  dynamics unicycle(speed 0..2 m/s)  start at (34, 5), (34, 10), (34, 15) }
group all_ = out, back
require there: every out: always[55 s, end] east
require here:  every back: always[55 s, end] west
require one:   always[0, end] RULE
solve with smt
"""
ONE_AT_A_TIME = "not (at least 2 all_: bridge)"


def text(rule: str) -> Source:
    return Source("bridge.mission", BRIDGE.replace("RULE", rule))


@pytest.mark.parametrize(
    ("rule", "most"),
    [(ONE_AT_A_TIME, 1), ("not (at least 3 all_: bridge)", 2), ("not ((some out: bridge) and (some back: bridge))", 3)],
)
def test_agents_pass_a_bridge_that_carries_so_many_without_a_solver(
    rule: str, most: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    def together(self: PrioritizedPlanner, batch: frozenset[int]) -> bool:
        raise AssertionError(batch)

    monkeypatch.setattr(PrioritizedPlanner, "plan_together", together)
    outcome = missionc.compile(text(rule)).outcome
    assert isinstance(outcome, Verified)
    x, y = np.moveaxis(outcome.plan.trace.position, 2, 0)
    on_it = (x >= 16) & (x <= 24) & (y >= 8) & (y <= 12)
    assert on_it.any(axis=1).all()
    assert on_it.sum(axis=0).max() <= most


def exclusions(rule: str) -> tuple[list[Exclusion | None], Labels]:
    checked = missionc.check(text(rule))
    assert checked.mission is not None
    assert checked.kernel is not None
    roadmaps = next(roadmaps_to_try(checked.mission, checked.kernel, 0)).build()
    assert isinstance(roadmaps, tuple)
    labels = Labels(checked.mission, roadmaps)
    goals = [goal.formula for goal in checked.kernel.requirements if goal.name == "one"]
    return [Exclusion.of(conjunct, labels) for conjunct in conjuncts(goals)], labels


def test_what_an_exclusion_asks_of_some_counts_all_others_as_away() -> None:
    ((exclusion,), _) = exclusions(ONE_AT_A_TIME)
    assert exclusion is not None
    assert exclusion.named == frozenset(range(6))
    pair = exclusion.among(frozenset((0, 4)))
    assert isinstance(pair, AtLeast)
    assert (pair.count, len(pair.parts)) == (1, 2)
    assert exclusion.among(frozenset((0,))) is None


@pytest.mark.parametrize(
    "rule",
    [
        "(some all_: west)",  # asks somebody to be there
        "distance(out[0], back[0]) >= 1 m",  # is no matter of one agent's place
        "not (some out: bridge)",  # asks each for itself
    ],
)
def test_what_asks_somebody_to_be_somewhere_or_one_agent_alone_is_no_exclusion(rule: str) -> None:
    found, _ = exclusions(rule)
    assert found
    assert not any(found)

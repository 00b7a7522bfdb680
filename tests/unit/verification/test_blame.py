"""What makes a goal fail, by the false operands of false operands; and how each formula counts for the one above it."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

from missionc.ir.kernel.nodes import All, Always, At, Atom, Is, Node, Not
from missionc.ir.kernel.nodes import Any as Some
from missionc.ir.predicates import Compare, Coordinate
from missionc.output.region_roles import region_roles
from missionc.output.report.report_html import data
from missionc.verification.monitoring.monitor import truth
from missionc.verification.monitoring.verdict_table import Blame
from tests.support.random_runs import mission_of, trace_of
from tests.support.unpacked_reports import MOTION, RELAY, plotted, unpacked

ABSENT, HELPS, HARMS, NEITHER, OPEN = range(5)


@cache
def relay() -> dict[str, Any]:
    return data(plotted(RELAY, MOTION))


def effects(made: dict[str, Any], goal: str, words: str) -> list[list[int]]:
    """Of a formula below a goal: for each agent, or for the team, at every step."""
    lanes = made["lanes"]
    begin = next(index for index, each in enumerate(lanes) if each["name"] == goal)
    each = next(each for each in lanes[begin:] if each["words"] == words)
    agents = 1 if made["rows"][each["row"]]["team"] else len(made["agents"])
    rows: list[list[int]] = unpacked(each["effect"]).reshape(agents, -1).tolist()
    return rows


def test_a_goal_that_holds_is_harmed_by_nothing() -> None:
    for each in relay()["lanes"][:10]:
        assert HARMS not in unpacked(each["effect"])


def test_a_true_condition_of_an_implication_does_not_help_and_a_false_one_does() -> None:
    # Drone 0 is far from step 2 on: from then on a route is asked for, which is there.
    assert effects(relay(), "chain", "far") == [[HELPS, HELPS, NEITHER, NEITHER, NEITHER], [HELPS] * 5, [HELPS] * 5]


def test_what_is_true_harms_where_it_is_not_to_be() -> None:
    assert effects(relay(), "calm", "drone[0]: far") == [[HELPS, HELPS, HARMS, HARMS, HARMS]]
    assert effects(relay(), "calm", "far") == [[HELPS, HELPS, HARMS, HARMS, HARMS], [ABSENT] * 5, [ABSENT] * 5]


def test_who_does_not_help_where_another_does_is_neither() -> None:
    assert effects(relay(), "goal", "eventually[0, 3 s] far") == [
        [OPEN, OPEN, HELPS, HELPS, HELPS],
        [OPEN, OPEN, OPEN, NEITHER, NEITHER],
        [OPEN, OPEN, OPEN, NEITHER, NEITHER],
    ]


def test_of_a_goal_that_fails_everything_that_was_waited_for_in_vain_harms() -> None:
    idle = [[[1.0, 1.0]] * 5, MOTION[1], MOTION[2]]
    made = data(plotted(RELAY, idle))
    assert effects(made, "goal", "far") == [[HARMS] * 4 + [ABSENT]] * 3
    assert effects(made, "goal", "some drone: eventually[0, 3 s] far") == [[OPEN, OPEN, OPEN, HARMS, HARMS]]


def test_a_goal_says_when_it_is_decided_and_by_whom() -> None:
    told = {each["name"]: each["decided"] for each in relay()["lanes"] if each["name"]}
    assert told == {
        "goal": {"step": 2, "holds": True, "by": [0]},
        "chain": {"step": 4, "holds": True, "by": [0, 1, 2]},
        "calm": {"step": 2, "holds": False, "by": [0]},
    }


@pytest.mark.parametrize("seed", range(4))
def test_only_what_is_false_makes_a_goal_fail_and_mending_all_of_it_would_mend_the_goal(seed: int) -> None:
    moved = np.random.default_rng(seed).uniform(0.2, 9.8, (3, 5, 2))
    made = plotted(RELAY, moved)
    kernel, trace = made.kernel, made.plan.trace
    roots = [goal.formula for goal in kernel.requirements + kernel.preferences]
    blame = Blame(roots, made.mission, trace, kernel.opposites)
    for root in roots:
        assert blame.failing(root, root).any() != blame.holds[root]
        for node in kernel.meanings.values():
            denied = kernel.opposites.get(node)
            either = truth(node, made.mission, trace) & (truth(denied, made.mission, trace) if denied else True)
            assert not (blame.failing(root, node) & either).any()


def test_a_region_is_coloured_by_what_the_goals_want_of_it() -> None:
    text = RELAY.replace("region far ", "region spare = box (4, 4) to (5, 5)\nregion far ").replace(
        "require goal",
        "region fire = box (8, 8) to (9, 9)\nrequire safe: every drone: always[0, 4 s] not fire\nrequire goal",
    )
    made = plotted(text, MOTION)
    roles = region_roles(made.mission, made.kernel)
    assert roles == {"base": "goal", "far": "goal", "spare": "plain", "fire": "avoid"}
    lonely = plotted(RELAY.replace("reach[hops 0..2 on radio] base", "reach[hops 0..2 on radio] far"), MOTION)
    assert region_roles(lonely.mission, lonely.kernel)["base"] == "start"


NEAR, FAR, ODD = (Is(frozenset((agent,))) for agent in range(3))


def test_a_formula_counts_by_its_truth_or_its_falsity_or_neither() -> None:
    """Looked at below ``near and not far``, and below the negation of that where it is asked for."""
    not_far, not_near = Not(FAR), Not(NEAR)
    root = All((NEAR, not_far))
    denied = Some((not_near, FAR))
    opposites: dict[Node, Node] = {FAR: not_far, NEAR: not_near, root: denied}
    trace = trace_of([[(0.0, 0.0)], [(1.0, 0.0)], [(2.0, 0.0)]])
    blame = Blame([root], mission_of(3, 0), trace, opposites)
    assert [blame.sign(root, 1, each) for each in (root, NEAR, FAR, ODD)] == [1, 1, -1, 0]
    assert [blame.sign(root, -1, each) for each in (root, NEAR, FAR, ODD)] == [-1, -1, 1, 0]
    assert [blame.sign(root, 0, each) for each in (root, NEAR, FAR)] == [0, 0, 0]
    # Whatever is asked for both ways counts neither way.
    both = All((NEAR, not_near))
    assert Blame([both], mission_of(3, 0), trace, {NEAR: not_near}).sign(both, 1, NEAR) == 0


def test_what_is_true_fails_a_goal_where_its_negation_is_asked_for() -> None:
    east = Atom(Compare(((1.0, Coordinate(0)),), -1.0, False))
    west = Not(east)
    goal = At(1, Always(west, 1, 2))
    trace = trace_of([[(5.0, 0.0)] * 4, [(5.0, 0.0), (0.0, 0.0), (5.0, 0.0), (5.0, 0.0)]])
    blame = Blame([goal], mission_of(2, 3), trace, {east: west})
    never = [[False] * 4, [False] * 4]
    late = [never[0], [False, False, True, False]]
    assert blame.failing(goal, west).tolist() == late
    assert blame.failing(goal, east).tolist() == late
    assert blame.failing(goal, goal).tolist() == [[True, False, False, False]] * 2
    assert blame.failing(goal, NEAR).tolist() == never
    assert blame.holds == {goal: False}
    kept = At(1, Always(west, 1, 1))
    held = Blame([kept], mission_of(2, 3), trace, {east: west})
    assert held.holds == {kept: True}
    assert held.failing(kept, west).tolist() == held.failing(kept, east).tolist() == never

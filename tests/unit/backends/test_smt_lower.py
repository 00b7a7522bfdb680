"""Formulas and their negations on motions worked out by hand: exactly one of the two can be asked for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import pytest

from missionc import ir
from missionc.backends.smt.sat.solve import Satisfiable, Unsatisfiable
from missionc.base.limits import Limits
from missionc.base.source import Source
from missionc.base.units import Metres
from missionc.frontend.resolve.resolve_mission import resolve
from missionc.frontend.syntax.parse import parse
from missionc.frontend.syntax.read_file import unread
from missionc.ir.kernel.nodes import All, Always, AtLeast, Atom, Eventually, Is, Node, Not, Reach, Until
from missionc.ir.kernel.nodes import Any as Either
from missionc.ir.kernel.normal_form import negated
from missionc.ir.lower.expand import expand
from tests.support.legal_plans import SPAN, mission_of
from tests.support.small_roadmaps import asked, roadmap_of

LINE = [(0.0, 0.0), (2.0, 0.0), (4.0, 0.0), (6.0, 0.0), (8.0, 0.0), (10.0, 10.0)]
"""Each in reach of the next; the last of none."""

RADIO = ir.Proximity("radio", Metres(2.5), (0, 1, 2, 3), SPAN)
FAST = ir.SingleIntegrator(99.0)


def at(*places: int) -> Node:
    """The agent is at one of these places."""
    shapes = [ir.Region(f"at{place}", ir.Disc(LINE[place], 0.5), SPAN) for place in places]
    return Either(tuple(Atom(ir.Inside(shape, False)) for shape in shapes))


def judged(node: Node, states: Sequence[Sequence[int]]) -> bool:
    """Whether the formula holds of agent 0 at step 0 where the agents move so, as the solver sees it."""
    holds, fails = either(node, states)
    assert holds != fails
    return holds


def either(node: Node, states: Sequence[Sequence[int]]) -> tuple[bool, ...]:
    """Whether the formula can be asked for, and whether its negation can."""
    mission = replace(mission_of([LINE[0]] * len(states), len(states[0]) - 1, dynamics=FAST), graphs=(RADIO,))
    case = asked(mission, (roadmap_of(tuple(range(len(states))), LINE, mission.steps),), node, negated(node))
    with case.search() as search:
        return tuple(
            isinstance(search.ask((*case.fixed(states), literal)), Satisfiable) for literal in case.lowered.goals
        )


@pytest.mark.parametrize(
    ("low", "high", "path", "expected"),
    [
        (0, 2, [0, 0, 1], True),
        (0, 2, [1, 5, 5], True),
        (0, 2, [0, 5, 1], False),
        (0, 2, [0, 0, 0], False),
        (0, 1, [0, 0, 1], False),
        (1, 2, [1, 5, 1], False),
        (1, 2, [0, 1, 5], True),
        (2, None, [0, 0, 0, 1], True),
        (2, None, [0, 1, 0, 0], False),
    ],
)
def test_until_fails_where_the_hold_breaks_or_the_end_is_not_in_the_window(
    low: int, high: int | None, path: list[int], expected: bool
) -> None:
    assert judged(Until(at(0), at(1), low, high), [path]) is expected


@pytest.mark.parametrize(
    ("hops", "others", "expected"),
    [
        (3, [1, 2, 3], True),
        (2, [1, 2, 3], False),
        (9, [1, 5, 3], False),
        (9, [2, 5, 3], False),
        (1, [1, 2, 5], False),
        (0, [3, 2, 1], False),
    ],
)
def test_reach_fails_where_the_chain_is_cut_or_too_long(hops: int, others: list[int], expected: bool) -> None:
    route = Reach(RADIO, Either((at(0, 1, 2),)), at(3), hops)
    assert judged(route, [[0], *([place] for place in others)]) is expected


def test_reach_fails_where_one_on_the_way_may_not_pass_it_on() -> None:
    route = Reach(RADIO, Not(Is(frozenset((1,)))), at(2), 5)
    assert judged(route, [[0], [1], [2], [5]]) is False
    assert judged(route, [[0], [5], [2], [1]]) is True


def test_whoever_is_in_no_graph_reaches_itself_and_nobody_else() -> None:
    alone = replace(RADIO, agents=(1, 2, 3))
    assert judged(Reach(alone, All(()), at(0), 3), [[0], [1], [2], [3]]) is True
    assert judged(Reach(alone, All(()), at(1), 3), [[0], [1], [2], [3]]) is False


def test_so_many_of_the_parts_hold_or_more_and_no_other_number(subtests: pytest.Subtests) -> None:
    for count, there in product(range(5), range(4)):
        with subtests.test(count=count, there=there):
            path = [0] * there + [1] * (3 - there)
            parts = tuple(Eventually(at(0), step, step) for step in range(3))
            assert judged(AtLeast(count, parts), [path]) is (there >= count)


@pytest.mark.parametrize(("path", "expected"), [([0, 0, 0, 0], True), ([0, 0, 1, 0], False)])
def test_a_window_fails_at_its_one_bad_step(path: list[int], expected: bool) -> None:
    assert judged(Always(at(0), 0, 3), [path]) is expected
    assert judged(Eventually(at(1), 0, 3), [path]) is not expected


def test_past_the_last_step_neither_a_window_nor_its_negation_holds() -> None:
    for window in (Always(at(0), 2, 3), Eventually(at(0), 2, 3), Until(at(0), at(1), 1, 3)):
        assert either(window, [[0, 0, 0]]) == (False, False)


# ------------------------------------------------------ routes of several hops

HOPS = """
mission hops
time step 1 s, horizon 1 s
world (-1, -1) to (11, 11)
region first = disc at (0, 0) radius 0.5
region last = disc at ({last}, 0) radius 0.5
team robot[{agents}] {{ radius 0.1 m dynamics single_integrator(speed <= 99 m/s) start at {starts} }}
graph radio = proximity 2.5 m
require route: robot[0]: robot reach[hops {low}..{high} on radio] last
"""


def routed(low: int, high: int, places: list[int], last: int = 2) -> bool:
    """Whether a route of so many hops leads from agent 0 to one at the place ``last`` of the line."""
    starts = ", ".join(str(LINE[place]) for place in places)
    text = HOPS.format(low=low, high=high, last=LINE[last][0], agents=len(places), starts=starts)
    program, slips = parse(Source("hops.mission", text), Limits(), unread)
    assert program is not None, slips
    mission, findings = resolve(program, {}, Limits())
    assert mission is not None, findings
    kernel, _ = expand(mission)
    assert kernel is not None
    route = kernel.requirements[0].formula
    case = asked(mission, (roadmap_of(tuple(range(len(places))), LINE, 1),), route, negated(route))
    with case.search() as search:
        standing = case.fixed([[place, place] for place in places])
        holds, fails = (isinstance(search.ask((*standing, literal)), Satisfiable) for literal in case.lowered.goals)
    assert holds != fails
    return holds


def test_a_route_of_two_hops_or_more_visits_no_agent_twice() -> None:
    assert routed(1, 1, [0, 1], last=1) is True
    assert routed(3, 3, [0, 1], last=1) is False, "there, back and there again"
    assert routed(2, 2, [0, 1], last=0) is False, "there and back"


def test_a_route_of_exactly_as_many_hops_as_there_are_others_visits_them_all() -> None:
    assert routed(3, 3, [0, 1, 2, 3], last=3) is True
    assert routed(4, 9, [0, 1, 2, 3], last=3) is False


def test_a_route_of_two_hops_is_none_of_three_and_none_of_one() -> None:
    assert [routed(hops, hops, [0, 2, 1], last=2) for hops in (1, 2, 3)] == [False, True, False]


def test_a_conflict_of_two_formulas_is_none_of_either_alone() -> None:
    mission = mission_of([LINE[0]], 1, dynamics=FAST)
    case = asked(mission, (roadmap_of((0,), LINE, 1),), Always(at(0), 0, 1), Eventually(at(1), 0, 1))
    one, other = case.lowered.goals
    with case.search() as search:
        assert isinstance(search.ask((one,)), Satisfiable)
        assert isinstance(search.ask((other,)), Satisfiable)
        both = search.ask((one, other))
        assert isinstance(both, Unsatisfiable)
        assert set(both.core) == {one, other}

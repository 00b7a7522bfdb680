"""Graphs over time: links made by hand, and two agents of which one goes away, on a clock of half seconds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from missionc import ir
from missionc.base.units import Metres, Seconds
from missionc.geometry.curves.piecewise_polynomials import Curves
from missionc.verification.between import truth_over_time
from missionc.verification.between.interval_sets import STEP, Motion, Signal
from missionc.verification.between.truth_over_time import Links, linked_pairs, links_of, reach_over_time, route
from tests.support.random_runs import SPAN, mission_of

END = 2 * STEP
ALWAYS, NEVER = Signal(((0, END),), ()), Signal((), ((0, END),))
BIT = STEP >> 13
"""The shortest stretch: the first half of a half of … a step that lasts no longer than a ten-thousandth of a second."""


def along(*lines: tuple[float, float], joint: float = 0.5) -> Motion:
    """Agents on the x axis, each from a place at a speed in m/s: for a second, in two pieces."""
    mission = replace(mission_of(len(lines), 2), step=Seconds(0.5))
    rows = [[[[x, v], [0, 0]], [[x + joint * v, v], [0, 0]]] for x, v in lines]
    return Motion(mission, Curves(np.array([0.0, joint, 1.0]), np.array(rows, dtype=np.float64)))


# Who stays, who is 1 m away and leaves at 2 m/s, and somebody else.
LEAVING = along((0, 0), (1, 2), (9, 0))


def linked(*pairs: tuple[int, int, Signal], members: int = 3, one_way: bool = False) -> Links:
    first, second = (np.array([pair[end] for pair in pairs], dtype=np.int64) for end in (0, 1))
    return Links(np.arange(members), first, second, one_way, tuple(pair[2] for pair in pairs))


def test_a_neighbour_is_there_while_a_link_is_and_it_holds_there() -> None:
    links = linked(
        (0, 1, Signal(((0, 10),), ((12, END),))),
        (0, 2, NEVER),
        (1, 2, Signal(((20, 30),), ((0, 18), (33, END)))),
    )
    body = [ALWAYS, NEVER, Signal(((0, 25),), ((28, END),))]
    assert linked_pairs(links, body, LEAVING) == [
        NEVER,
        Signal(((0, 10), (20, 25)), ((12, 18), (28, END))),
        NEVER,
    ]


def test_links_of_one_way_lead_nowhere_back() -> None:
    there = Signal(((0, 10),), ((12, END),))
    body = [ALWAYS, NEVER, NEVER]
    assert linked_pairs(linked((0, 1, there), one_way=True), body, LEAVING) == [NEVER] * 3
    assert linked_pairs(linked((1, 0, there), one_way=True), body, LEAVING) == [NEVER, there, NEVER]
    assert linked_pairs(linked((1, 0, there)), body, LEAVING) == [NEVER, there, NEVER]


def test_a_route_has_no_more_links_than_asked_and_leads_over_who_lets_it() -> None:
    early, late = Signal(((0, 20),), ((20, END),)), Signal(((10, END),), ((0, 10),))
    links = linked((0, 1, early), (1, 2, late))
    through, end = [ALWAYS, Signal(((0, 15),), ((17, END),)), NEVER], [NEVER, NEVER, ALWAYS]
    both = Signal(((10, 15),), ((0, 10), (17, END)))
    assert reach_over_time(2, links, through, end, LEAVING) == [both, both, ALWAYS]
    assert reach_over_time(1, links, through, end, LEAVING) == [NEVER, both, ALWAYS]


def test_a_route_is_short_enough_until_the_way_is_too_long() -> None:
    """The way is 1 m + 2 m/s · t long, which is 2 m after half a second: a step."""
    links = linked((0, 1, ALWAYS))
    end = [NEVER, ALWAYS, NEVER]
    found = route(0.0, 2.0, links, [ALWAYS] * 3, end, LEAVING)
    assert found == [Signal(((0, STEP - BIT),), ((STEP + BIT, END),)), ALWAYS, NEVER]
    assert route(0.0, 2.0, links, [NEVER] * 3, end, LEAVING) == [NEVER, ALWAYS, NEVER]


def test_a_route_is_long_enough_once_the_way_is() -> None:
    """No route ends where it begins: who is at an end has none that is longer than nothing."""
    links = linked((0, 1, ALWAYS))
    end = [NEVER, ALWAYS, NEVER]
    (found, *others) = route(2.0, float("inf"), links, [ALWAYS] * 3, end, LEAVING)
    assert found == Signal(((STEP + BIT, END),), ((0, STEP - BIT),))
    assert others == [NEVER, NEVER]
    (within, *_) = route(1.5, 2.5, links, [ALWAYS] * 3, end, LEAVING)
    half = STEP // 2
    assert within == Signal(((half + BIT, 3 * half - BIT),), ((0, half - BIT), (3 * half + BIT, END)))
    assert route(1.5, 2.5, links, [NEVER] * 3, end, LEAVING) == [NEVER] * 3


def test_a_route_of_two_links_may_be_off_by_the_change_of_both() -> None:
    """From end to end 2 m + 4 m/s · t, over one in the middle: 4 m after half a second."""
    spreading = along((-1, -2), (0, 0), (1, 2))
    links, end = linked((0, 1, ALWAYS), (1, 2, ALWAYS)), [NEVER, NEVER, ALWAYS]
    (short, *_) = route(0.0, 4.0, links, [ALWAYS] * 3, end, spreading)
    assert short == Signal(((0, STEP - BIT),), ((STEP + BIT, END),))
    (long, *_) = route(4.0, float("inf"), links, [ALWAYS] * 3, end, spreading)
    assert long == Signal(((STEP + BIT, END),), ((0, STEP - BIT),))


def test_a_route_of_no_length_is_not_denied_to_who_is_at_the_same_place() -> None:
    links, end = linked((0, 1, ALWAYS), members=2), [NEVER, ALWAYS]
    assert route(0.0, 0.0, links, [ALWAYS] * 2, end, along((1, 2), (1, 2))) == [Signal((), ()), ALWAYS]


def test_a_route_of_any_length_is_one_of_any_links() -> None:
    links, end = linked((0, 1, ALWAYS), (1, 2, ALWAYS)), [NEVER, NEVER, ALWAYS]
    assert route(0.0, float("inf"), links, [ALWAYS] * 3, end, LEAVING) == [ALWAYS] * 3


def test_lengths_are_looked_at_in_a_limited_number_of_stretches(monkeypatch: pytest.MonkeyPatch) -> None:
    """Three cells first, a stretch between two moments; then its two halves, which say nothing; then four quarters."""
    leaving = replace(LEAVING, curves=Curves(np.array([0.0, 1.0]), LEAVING.curves.coefficients[:, :1]))
    links, end, half = linked((0, 1, ALWAYS)), [NEVER, ALWAYS, NEVER], STEP // 2

    def found(most: int) -> Signal:
        monkeypatch.setattr(truth_over_time, "MOST_CELLS", most)
        return route(0.0, 2.0, links, [ALWAYS] * 3, end, leaving)[0]

    moments = Signal(((0, 0),), ((END, END),))
    assert [found(most) for most in (3, 5)] == [moments, moments]
    assert found(6) == Signal(((0, half),), ((3 * half, END),))


def test_links_are_those_of_the_graphs_members_in_their_order() -> None:
    graph = ir.Proximity("radio", Metres(2.0), (2, 1, 0), SPAN)
    links = links_of(graph, LEAVING)
    assert (links.members.tolist(), links.first.tolist(), links.second.tolist()) == ([2, 1, 0], [0, 0, 1], [1, 2, 2])
    assert not links.one_way
    # Of 9 m - (1 m + 2 m/s · t), 9 m, and 1 m + 2 m/s · t the last alone is ever below 2 m.
    assert links.signals == (NEVER, NEVER, Signal(((0, STEP - BIT),), ((STEP + BIT, END),)))


def test_links_of_one_way_are_looked_at_both_ways() -> None:
    near, far = ir.PairRange(frozenset((0,)), frozenset((1,)), Metres(2.0)), Metres(0.5)
    links = links_of(ir.Proximity("uneven", far, (0, 1), SPAN, (near,)), LEAVING)
    assert (links.first.tolist(), links.second.tolist(), links.one_way) == ([0, 1], [1, 0], True)
    assert links.signals == (Signal(((0, STEP - BIT),), ((STEP + BIT, END),)), NEVER)


def test_one_agent_has_no_links() -> None:
    alone = links_of(ir.Proximity("radio", Metres(2.0), (1,), SPAN), LEAVING)
    assert (alone.first.size, alone.signals) == (0, ())
    assert linked_pairs(alone, [ALWAYS], LEAVING) == [NEVER]

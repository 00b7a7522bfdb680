"""Sentences about what decides a failure: agents on the x axis, one of which swings out and back within a step."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from missionc import ir
from missionc.base.source import Source, Span
from missionc.base.units import Metres, Seconds
from missionc.geometry.curves.piecewise_polynomials import Curves
from missionc.ir.kernel.nodes import Atom, EveryNeighbour, Neighbour, Node
from missionc.ir.predicates import Compare, Coordinate, DistanceBetween, InFormation, Predicate
from missionc.verification.between.between_steps import Culprit, agents_of, sentence, stretch
from missionc.verification.between.interval_sets import STEP, Motion
from tests.support.random_runs import SPAN, mission_of

HALF, QUARTER = STEP // 2, STEP // 4
SOURCE = Source("test.mission", "near   here\n and there")
WORDS = Span(SOURCE, 0, len(SOURCE.text))


def along(*ways: tuple[float, float, float, float]) -> Motion:
    """Agents that are at these places at 0, 0.25, 0.5 and 1 s, and go straight from one to the next."""
    mission = replace(mission_of(len(ways), 2), step=Seconds(0.5))
    times = np.array([0.0, 0.25, 0.5, 1.0])
    rows = [
        [[[x, (after - x) / last], [0, 0]] for x, after, last in zip(way[:-1], way[1:], np.diff(times), strict=True)]
        for way in ways
    ]
    return Motion(mission, Curves(times, np.array(rows, dtype=np.float64)))


STAYS, SWINGS = (0.0, 0.0, 0.0, 0.0), (1.0, 3.0, 1.0, 1.0)
SWINGING = along(STAYS, SWINGS)
RADIO = ir.Proximity("radio", Metres(2.0), (0, 1), SPAN)
ATOM = Atom(Compare(((1.0, Coordinate(0)),), 0.0, False))


def culprit(
    node: Node = ATOM,
    agent: int = 0,
    value: bool = False,
    team: bool = False,
    tick: int = HALF,
    low: int = QUARTER,
    high: int = 3 * QUARTER,
) -> Culprit:
    """Around the middle of the first step, from a quarter of it to three quarters."""
    return Culprit(node, agent, tick, value, low, high, node, value, team)


def says(*culprits: Culprit, certain: bool = True, motion: Motion = SWINGING) -> str:
    return sentence("it", culprits, certain, motion)


def why(node: Node, motion: Motion, agent: int = 0, low: int = QUARTER, high: int = 3 * QUARTER) -> str:
    """What a sentence says after it has said what is false."""
    text = says(culprit(node, agent, low=low, high=high), motion=motion)
    return text.partition(" is false for drone[")[2].partition(": ")[2]


def test_a_stretch_is_cut_at_the_steps_around_its_moment() -> None:
    assert stretch(culprit(low=0, high=9 * STEP)) == (0, STEP)
    assert stretch(culprit(tick=STEP + 1, low=0, high=9 * STEP)) == (STEP, 2 * STEP)
    assert stretch(culprit(tick=STEP, low=0, high=9 * STEP)) == (STEP, STEP)
    assert stretch(culprit(low=7, high=HALF)) == (7, HALF)


def test_a_sentence_says_when_what_and_of_whom() -> None:
    words = Atom(ATOM.predicate, WORDS)
    assert says(culprit(words)) == (
        "`it` is true at every sample, but not between 0 s and 0.5 s: from 0.12 s to 0.38 s `near here and there` is "
        "false for drone[0]"
    )
    assert says(culprit(words, agent=1, value=True, tick=STEP + HALF, low=STEP + HALF, high=STEP + HALF)) == (
        "`it` is true at every sample, but not between 0.5 s and 1 s: at 0.75 s `near here and there` is true for "
        "drone[1]"
    )
    assert says(culprit(words, team=True), certain=False) == (
        "`it` is true at every sample; between samples it is not decided: from 0.12 s to 0.38 s `near here and "
        "there` is "
        "too close to its border to decide"
    )


def test_what_decides_together_is_said_together_at_the_moment_of_the_first() -> None:
    text = says(culprit(agent=1, low=QUARTER, high=QUARTER), culprit(value=True), certain=True)
    assert text.endswith(
        ": at 0.12 s a part of the requirement is false for drone[1] and a part of the requirement is true for drone[0]"
    )
    open_ = says(culprit(agent=1), certain=False)
    assert open_.endswith(" a part of the requirement for drone[1] is too close to its border to decide")


@pytest.mark.parametrize(
    ("predicate", "agents"),
    [
        (Compare(((1.0, Coordinate(0)),), 0.0, False), (2,)),
        (Compare(((1.0, DistanceBetween(3, 1)), (-1.0, DistanceBetween(1, 0))), 0.0, False), (0, 1, 3)),
        (
            InFormation(ir.Formation("row", "chain", (3, 0), (ir.FormationEdge(3, 0, 1.0),), Metres(1.0), False, SPAN)),
            (3, 0),
        ),
    ],
)
def test_a_predicate_is_about_those_whom_it_names_or_who_is_asked(
    predicate: Predicate, agents: tuple[int, ...]
) -> None:
    assert agents_of(culprit(Atom(predicate), agent=2), SWINGING) == agents


def test_of_more_than_one_agent_none_is_named_last() -> None:
    apart = Atom(Compare(((1.0, DistanceBetween(0, 1)),), 0.0, False))
    assert says(culprit(apart)).endswith("from 0.12 s to 0.38 s a part of the requirement is false")


def test_links_that_are_lost_between_two_steps_are_named_with_how_far_it_is() -> None:
    assert why(Neighbour(RADIO, ATOM), SWINGING) == (
        "drone[0] and drone[1] are 3.000 m apart, the radius of `radio` is 2 m"
    )
    # In the middle of a stretch: at 3/16 s.
    earlier = why(Neighbour(RADIO, ATOM), SWINGING, low=QUARTER, high=HALF)
    assert earlier.startswith("drone[0] and drone[1] are 2.500 m apart")


def test_links_that_are_made_between_two_steps_are_named_where_none_is_wanted() -> None:
    nearing = along(STAYS, (3.0, 1.0, 3.0, 3.0))
    assert why(EveryNeighbour(RADIO, ATOM), nearing).startswith("drone[0] and drone[1] are 1.000 m apart")
    assert why(Neighbour(RADIO, ATOM), nearing) == ""
    assert why(EveryNeighbour(RADIO, ATOM), SWINGING) == ""


@pytest.mark.parametrize(
    ("way", "named"),
    [
        # Lost from the first step on, or up to the second one.
        ((1.0, 3.0, 3.0, 3.0), True),
        ((3.0, 3.0, 1.0, 1.0), True),
        # Not there before or after either.
        ((3.0, 3.5, 3.0, 1.0), False),
        ((1.0, 1.5, 3.0, 3.0), False),
    ],
)
def test_a_link_is_named_where_a_step_beside_has_another(way: tuple[float, float, float, float], named: bool) -> None:
    assert bool(why(Neighbour(RADIO, ATOM), along(STAYS, way))) is named


def test_links_of_the_agent_that_is_asked_come_first_and_two_are_enough() -> None:
    graph = replace(RADIO, agents=(2, 0, 1))
    # From 1 m to 3 m and back on either side: 0 to 1, 0 to 2, and from 2 m, which is no link, 1 to 2.
    both = along(STAYS, SWINGS, (-1.0, -3.5, -1.0, -1.0))
    assert why(Neighbour(graph, ATOM), both) == (
        "drone[2] and drone[0] are 3.500 m apart, drone[0] and drone[1] are 3.000 m apart, the radius of `radio` is 2 m"
    )
    wider = replace(graph, radius=Metres(2.5))
    node = Neighbour(wider, ATOM)
    for agent, pairs in ((0, ["2-0", "0-1"]), (1, ["2-1", "0-1"]), (2, ["2-0", "2-1"])):
        text = says(culprit(node, agent=agent), motion=both)
        found = [f"{each[6]}-{each[19]}" for each in text.split(": ")[2].split(", ")[:2]]
        assert found == pairs, text


def test_ranges_of_pairs_are_named_and_links_of_one_way_apart() -> None:
    there = ir.PairRange(frozenset((0,)), frozenset((1,)), Metres(2.5))
    uneven = replace(RADIO, ranges=(there,))
    assert why(Neighbour(uneven, ATOM), SWINGING) == (
        "drone[0] and drone[1] are 3.000 m apart, drone[1] and drone[0] are 3.000 m apart, "
        "`radio` reaches 2.5 m from drone[0] to drone[1], 2 m from drone[1] to drone[0]"
    )
    one_way = along(STAYS, (1.0, 2.25, 1.0, 1.0))
    assert why(Neighbour(uneven, ATOM), one_way) == (
        "drone[1] and drone[0] are 2.250 m apart, `radio` reaches 2 m from drone[1] to drone[0]"
    )
    # Of a pair whose ranges are alike one way is enough.
    third = replace(uneven, agents=(0, 1, 2))
    away = along(STAYS, (0.0, 0.0, 0.0, 0.0), SWINGS)
    assert why(Neighbour(third, ATOM), away, agent=2) == (
        "drone[0] and drone[2] are 3.000 m apart, drone[1] and drone[2] are 3.000 m apart, "
        "`radio` reaches 2 m from drone[0] to drone[2], 2 m from drone[1] to drone[2]"
    )


def test_an_obstacle_is_named_where_no_way_is_too_long() -> None:
    post = ir.Box((1.9, -0.5), (2.1, 0.5))
    eyes = ir.Sight("eyes", Metres(9.0), (post,), (0, 1), SPAN)
    assert why(Neighbour(eyes, ATOM), SWINGING) == (
        "drone[0] and drone[1] are 3.000 m apart, the radius of `eyes` is 9 m, and an obstacle blocks the line of sight"
    )
    assert why(EveryNeighbour(eyes, ATOM), along(STAYS, (3.0, 1.0, 3.0, 3.0))).endswith(
        "the radius of `eyes` is 9 m, and no obstacle blocks the line of sight"
    )
    short = replace(eyes, radius=Metres(3.0))
    assert why(Neighbour(short, ATOM), SWINGING).endswith("the radius of `eyes` is 3 m")


def test_a_beacon_is_shared_or_not() -> None:
    cell = ir.BeaconCover("cell", Metres(2.0), ((0.0, 0.0),), (0, 1), SPAN)
    assert why(Neighbour(cell, ATOM), SWINGING) == (
        "drone[0] and drone[1] share no beacon, the radius of `cell` is 2 m"
    )
    nearing = along(STAYS, (3.0, 1.0, 3.0, 3.0))
    assert why(EveryNeighbour(cell, ATOM), nearing).startswith("drone[0] and drone[1] share a beacon")

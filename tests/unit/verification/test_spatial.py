"""Routes while a mission is flown: exact once everybody was seen, bounded by top speeds before, in steps of 0.5 s."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from missionc import ir
from missionc.base.trace import Array, Trace
from missionc.base.units import Metres, Seconds
from missionc.ir.kernel.nodes import (
    All,
    At,
    Atom,
    Eventually,
    EveryNeighbour,
    EveryReach,
    EveryRoute,
    Goal,
    Is,
    Kernel,
    Neighbour,
    Node,
    Not,
    PathLength,
    Reach,
    Route,
)
from missionc.verification.monitoring.live.judge import LiveJudge
from missionc.verification.monitoring.live.verdicts import Standing
from missionc.verification.monitoring.monitor import robustness
from tests.support.random_runs import SPAN, mission_of

STEPS = 6
RADIO = ir.Proximity("radio", Metres(2.0), (0, 1, 2), SPAN)
THIRD, FIRST = Is(frozenset((2,))), Is(frozenset((0,)))
EAST = Atom(ir.Compare(((1.0, ir.Coordinate(0)),), -2.5, False))


def mission(speed: float = 1.0) -> ir.Mission:
    made = replace(mission_of(4, STEPS), step=Seconds(0.5))
    return replace(made, agents=tuple(replace(agent, dynamics=ir.SingleIntegrator(speed)) for agent in made.agents))


def run() -> Array:
    """Four on the x axis; the third goes away, half a metre a step."""
    x = np.array([[0.0] * 7, [1.25] * 7, [2.0 + 0.25 * step for step in range(7)], [9.0] * 7])
    return np.stack([x, np.zeros_like(x)], axis=-1)


def judged(node: Node, step: int, agent: int = 0, doubt: dict[int, Array] | None = None) -> list[Standing]:
    """How it stands after each step that an agent is asked this at a step."""
    judge = LiveJudge(mission(), Kernel((Goal("it", At(agent, Eventually(node, step, step)), SPAN),), ()))
    places = run()
    return [
        judge.advance(places[:, now], np.zeros((4, 2)), doubt=(doubt or {}).get(now))[0] for now in range(STEPS + 1)
    ]


NODES = [
    Neighbour(RADIO, EAST),
    EveryNeighbour(RADIO, EAST),
    Reach(RADIO, All(()), THIRD, 2),
    Reach(RADIO, All(()), EAST, 1),
    EveryReach(RADIO, FIRST, EAST, 2),
    Route(RADIO, All(()), EAST, 0.0, 3.0),
    Route(RADIO, All(()), EAST, 2.25, 3.5),
    Route(RADIO, Not(EAST), THIRD, 0.0, math.inf),
    EveryRoute(RADIO, FIRST, Not(EAST), 0.0, 3.0),
    EveryRoute(RADIO, FIRST, Not(EAST), 1.0, 3.0),
    PathLength(RADIO, 2, 0.0, 3.0),
    PathLength(RADIO, 2, 2.25, 3.0),
    Not(PathLength(RADIO, 2, 0.0, 3.0)),
    Not(PathLength(RADIO, 2, 2.25, 3.0)),
]


@pytest.mark.parametrize("node", NODES, ids=lambda node: type(node).__name__)
def test_once_its_step_was_seen_it_is_known(node: Node) -> None:
    places = run()
    trace = Trace(Seconds(0.5), places, np.zeros_like(places), np.zeros((4, STEPS + 1)))
    exact = robustness(node, mission(), trace)
    for agent in (0, 1, 3):
        for step in (2, STEPS):
            found = judged(node, step, agent)
            for now, standing in enumerate(found):
                if now >= step:
                    assert standing.least == standing.most == pytest.approx(exact[agent, step])
                else:
                    assert standing.least <= exact[agent, step] <= standing.most


def test_links_to_come_are_bounded_by_how_far_both_get() -> None:
    """Half a metre a step each: what is 1.25 m apart may be a metre further in the next."""
    before = judged(Neighbour(RADIO, Is(frozenset((1,)))), 1)[0]
    assert (before.least, before.most) == pytest.approx((-0.25, 1.75), abs=1e-6)
    two = judged(Neighbour(RADIO, Is(frozenset((1,)))), 2)[0]
    assert (two.least, two.most) == pytest.approx((-1.25, 2.75), abs=1e-6)
    every = judged(EveryNeighbour(RADIO, Is(frozenset())), 1)[0]
    # The nearer of two: 1.25 m, and 2 m.
    assert (every.least, every.most) == pytest.approx((-1.75, 0.25), abs=1e-6)


def test_of_lengths_to_come_nothing_is_said() -> None:
    for node in (Route(RADIO, All(()), THIRD, 0.0, 3.0), PathLength(RADIO, 2, 0.0, 3.0)):
        assert [(each.least, each.most) for each in judged(node, 2)[:2]] == [(-math.inf, math.inf)] * 2


def test_of_lengths_nothing_is_said_where_it_is_not_known_where_a_member_is() -> None:
    unseen = {2: np.array([0.0, 0.0, 0.25, 0.0])}
    stranger = {2: np.array([0.0, 0.0, 0.0, 0.25])}
    node = PathLength(RADIO, 2, 0.0, 3.0)
    last = judged(node, 2, doubt=unseen)[2]
    assert (last.least, last.most) == (-math.inf, math.inf)
    known = judged(node, 2, doubt=stranger)[2]
    assert known.least == known.most == pytest.approx(judged(node, 2)[2].least)


def test_links_of_who_is_not_seen_are_as_far_off_as_it_may_be() -> None:
    unseen = {2: np.array([0.0, 0.5, 0.0, 0.0])}
    found = judged(Neighbour(RADIO, Is(frozenset((1,)))), 2, doubt=unseen)[2]
    assert (found.least, found.most) == pytest.approx((0.25, 1.25), abs=1e-6)


def test_who_is_on_no_graph_has_no_neighbour_and_a_route_to_itself() -> None:
    for node, value in (
        (Neighbour(RADIO, All(())), -math.inf),
        (EveryNeighbour(RADIO, Is(frozenset())), math.inf),
        (Reach(RADIO, All(()), EAST, 2), 6.5),
        (Route(RADIO, All(()), EAST, 0.0, 1.0), 6.5),
        (Route(RADIO, All(()), EAST, 0.5, 1.0), -math.inf),
    ):
        (first, *_) = judged(node, 0, agent=3)
        assert (first.least, first.most) == (value, value)

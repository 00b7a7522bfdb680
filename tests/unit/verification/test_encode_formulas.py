"""Clauses of formulas over two cells whose labels say all: the motions that they leave are those that satisfy them."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Mapping
from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from missionc import ir
from missionc.base.trace import Flags
from missionc.base.units import Metres
from missionc.ir import Graph, Predicate
from missionc.ir.kernel.nodes import (
    All,
    Always,
    Any,
    At,
    AtLeast,
    Atom,
    Eventually,
    EveryNeighbour,
    EveryReach,
    EveryRoute,
    Goal,
    Is,
    Neighbour,
    Node,
    Not,
    PathLength,
    Reach,
    Release,
    Route,
    Until,
)
from missionc.ir.predicates import (
    Compare,
    DistanceBetween,
    DistanceTo,
    Facing,
    Flagged,
    InFormation,
    Inside,
    Level,
    Speed,
)
from missionc.verification.impossibility.cnf import FALSE, Cnf
from missionc.verification.impossibility.encode_formulas import Never, encode_motion, refutation
from tests.support.random_runs import BASE, FIELD, SPAN, mission_of
from tests.unit.verification.test_encode_motion import Motion, cover

pysat = pytest.importorskip("pysat.solvers")

STEPS = 2
Joint = tuple[Motion, ...]

EXACT: Mapping[str, Flags] = {
    # In the second cell, or of the field in the first; on its way to another one; both in the same cell; heard from the
    # second cell alone.
    "own": np.array([False, True]),
    "moves": ~np.eye(2, dtype=np.bool_),
    "pair": np.eye(2, dtype=np.bool_),
    "link": np.array([[False, False], [True, True]]),
}


class Exact:
    """Labels that say of each leaf where it holds, and fails everywhere else; who was asked for what."""

    def __init__(self) -> None:
        self.asked: list[tuple[Hashable, ...]] = []

    def _of(self, kind: str, *asked: Hashable) -> Never:
        self.asked.append((kind, *asked))
        return ~EXACT[kind], EXACT[kind]

    def own(self, predicate: Predicate, agent: int) -> Never:
        never_true, never_false = self._of("own", agent)
        return (never_false, never_true) if predicate.region is FIELD else (never_true, never_false)

    def moves(self, predicate: Predicate, agent: int) -> Never:
        return self._of("moves", agent)

    def pair(self, predicate: Predicate, first: int, second: int) -> Never:
        return self._of("pair", first, second)

    def link(self, graph: Graph, sender: int, receiver: int) -> Never:
        return self._of("link", sender, receiver)


def left(node: Node, agents: int = 2, steps: int = STEPS, asked: tuple[int, ...] | None = None) -> set[Joint]:
    """The joint motions over two cells that the clauses of a formula leave."""
    claimed = cover(2, steps, agents)
    claimed = replace(claimed, asked=claimed.asked if asked is None else asked)
    mission = mission_of(agents, steps)
    cnf = refutation(mission, (Goal("it", node, SPAN),), claimed, Exact())
    states = encode_motion(claimed, Cnf())
    found = set()
    with pysat.Solver(name="cadical153", bootstrap_with=cnf.clauses) as solver:
        for each in product(product(range(2), repeat=steps + 1), repeat=agents):
            wanted = [
                int(states[agent][step, cell]) for agent in claimed.asked for step, cell in enumerate(each[agent])
            ]
            if solver.solve(assumptions=wanted):
                found.add(each)
    return found


def those(keep: Callable[[Joint], bool], agents: int = 2, steps: int = STEPS) -> set[Joint]:
    return {each for each in product(product(range(2), repeat=steps + 1), repeat=agents) if keep(each)}


HERE = Atom(Inside(BASE, body=False))
MOVES = Atom(Compare(((1.0, Speed()),), -1.0, False))
NEAR = Atom(Compare(((-1.0, DistanceTo(1)),), 1.0, False))
BOTH_NEAR = Atom(Compare(((-1.0, DistanceBetween(0, 1)),), 1.0, False))
RADIO = ir.Proximity("radio", Metres(1.0), (0, 1), SPAN)
NOBODY, SECOND = Is(frozenset()), Is(frozenset((1,)))


def test_the_motions_that_are_left_are_those_that_satisfy_it(subtests: pytest.Subtests) -> None:
    for node, keep in [
        (HERE, lambda m: m[0][0]),
        (Not(HERE), lambda m: not m[0][0]),
        (At(1, HERE), lambda m: m[1][0]),
        (SECOND, lambda m: False),
        (At(1, SECOND), lambda m: True),
        (Not(SECOND), lambda m: True),
        (At(1, Not(SECOND)), lambda m: False),
        (All((HERE, At(1, HERE))), lambda m: m[0][0] and m[1][0]),
        (Any((HERE, At(1, HERE))), lambda m: m[0][0] or m[1][0]),
        (All(()), lambda m: True),
        (Any(()), lambda m: False),
        (AtLeast(2, (HERE, At(1, HERE), Eventually(HERE, 1, 1))), lambda m: m[0][0] + m[1][0] + m[0][1] >= 2),
        (Always(HERE, 0, 2), lambda m: all(m[0])),
        (Always(HERE, 1, None), lambda m: all(m[0][1:])),
        (Eventually(HERE, 1, 2), lambda m: any(m[0][1:])),
        (Eventually(HERE, 0, None), lambda m: any(m[0])),
        # Of what lies past the mission nothing is known.
        (Always(HERE, 1, 3), lambda m: True),
        (Eventually(SECOND, 3, None), lambda m: True),
        (Always(Eventually(HERE, 1, 1), 0, None), lambda m: m[0][1] and m[0][2]),
        (Eventually(Eventually(HERE, -1, -1), 2, 2), lambda m: m[0][1]),
        (Eventually(Always(HERE, -2, -1), 1, 1), lambda m: m[0][0]),
        (Eventually(HERE, -2, -1), lambda m: False),
        (Always(HERE, -2, -1), lambda m: True),
        (Until(HERE, At(1, HERE), 0, 2), lambda m: m[1][0] or (m[0][0] and (m[1][1] or (m[0][1] and m[1][2])))),
        (Until(HERE, At(1, HERE), 1, 1), lambda m: m[0][0] and m[1][1]),
        (Until(HERE, At(1, HERE), 2, None), lambda m: m[0][0] and m[0][1] and m[1][2]),
        (Until(HERE, At(1, HERE), 0, 3), lambda m: True),
        (Release(HERE, At(1, HERE), 0, 1), lambda m: m[1][0] and (m[0][0] or m[1][1])),
        (Release(HERE, At(1, HERE), 2, None), lambda m: m[0][0] or m[0][1] or m[1][2]),
        (Eventually(Until(HERE, At(1, HERE), -1, -1), 2, 2), lambda m: m[0][2] and m[1][1]),
        (Eventually(Until(HERE, At(1, HERE), -2, -2), 2, 2), lambda m: m[0][1] and m[0][2] and m[1][0]),
        (Eventually(Release(HERE, At(1, HERE), -1, 0), 1, 1), lambda m: m[1][1] and (m[0][1] or m[1][0])),
        (MOVES, lambda m: m[0][0] != m[0][1]),
        (Not(MOVES), lambda m: m[0][0] == m[0][1]),
        # At the last step the motion that ends there counts.
        (Always(MOVES, 2, 2), lambda m: m[0][1] != m[0][2]),
        (Always(MOVES, 1, 1), lambda m: m[0][1] != m[0][2]),
        (NEAR, lambda m: m[0][0] == m[1][0]),
        (Not(NEAR), lambda m: m[0][0] != m[1][0]),
        (Always(BOTH_NEAR, 1, 1), lambda m: m[0][1] == m[1][1]),
        (Neighbour(RADIO, At(1, HERE)), lambda m: m[0][0] and m[1][0]),
        (Neighbour(RADIO, SECOND), lambda m: m[0][0]),
        (At(1, Neighbour(RADIO, SECOND)), lambda m: False),
        (Always(Neighbour(RADIO, SECOND), 1, 1), lambda m: m[0][1]),
        (EveryNeighbour(RADIO, NOBODY), lambda m: not m[0][0]),
        (At(1, EveryNeighbour(RADIO, NOBODY)), lambda m: not m[1][0]),
        (EveryNeighbour(RADIO, SECOND), lambda m: True),
        (Reach(RADIO, All(()), SECOND, 1), lambda m: m[0][0]),
        (Reach(RADIO, All(()), SECOND, 0), lambda m: False),
        (Reach(RADIO, Not(HERE), SECOND, 1), lambda m: False),
        (Reach(RADIO, HERE, HERE, 1), lambda m: m[0][0]),
        (At(1, Reach(RADIO, Any(()), SECOND, 1)), lambda m: True),
        (EveryReach(RADIO, Any(()), Not(SECOND), 1), lambda m: not m[0][0]),
        (EveryReach(RADIO, HERE, Not(SECOND), 1), lambda m: True),
        (Route(RADIO, All(()), SECOND, 0.0, 9.0), lambda m: m[0][0]),
        (EveryRoute(RADIO, Any(()), Any(()), 0.0, 9.0), lambda m: True),
        (PathLength(RADIO, 1, 0.0, 1.0), lambda m: True),
        (Not(PathLength(RADIO, 1, 0.0, 1.0)), lambda m: True),
    ]:
        with subtests.test(type(node).__name__ if hasattr(node, "every") else ""):
            assert left(node) == those(keep)


PAIR = ir.Proximity("pair", Metres(1.0), (1, 2), SPAN)


@pytest.mark.parametrize(
    ("node", "keep"),
    [
        # Who is on no graph has no neighbour, and a route to itself alone.
        (Neighbour(PAIR, All(())), lambda m: False),
        (EveryNeighbour(PAIR, Any(())), lambda m: True),
        (Reach(PAIR, Any(()), HERE, 2), lambda m: m[0][0]),
        # Over two links to the third: that has to be near enough, which is in the same cell.
        (
            Reach(replace(RADIO, agents=(0, 1, 2)), HERE, Is(frozenset((2,))), 1),
            lambda m: m[0][0],
        ),
        (
            Reach(replace(RADIO, agents=(0, 1, 2)), Not(Is(frozenset((2,)))), Is(frozenset((2,))), 2),
            lambda m: m[0][0] and m[0][0] == m[2][0],
        ),
        (
            Reach(ir.BeaconCover("cell", Metres(1.0), ((0.0, 0.0),), (0, 1, 2), SPAN), All(()), Is(frozenset((2,))), 2),
            lambda m: m[0][0],
        ),
        (
            Route(replace(RADIO, agents=(0, 1, 2)), All(()), Is(frozenset((2,))), 0.0, math.inf),
            lambda m: m[0][0] and m[0][0] == m[2][0],
        ),
        (Atom(Compare(((1.0, DistanceBetween(1, 2)),), 0.0, False)), lambda m: m[1][0] == m[2][0]),
        # What is asked of more than two is left open.
        (Atom(Compare(((1.0, DistanceTo(1)), (1.0, DistanceTo(2))), 0.0, False)), lambda m: True),
    ],
)
def test_of_three_agents_too(node: Node, keep: Callable[[Joint], bool]) -> None:
    assert left(node, 3, 0) == those(keep, 3, 0)


FLAG = ir.Flag("wet", (0,), BASE, None, SPAN)
CLEARED = ir.Flag("dry", (0,), BASE, FIELD, SPAN)
TWICE = ir.Flag("both", (0,), BASE, ir.Region("base too", BASE.shape, SPAN), SPAN)
"""The same cell sets and clears it: what sets it counts, and then it is cleared where it is set anew."""


@pytest.mark.parametrize(
    ("node", "keep"),
    [
        (Always(Atom(Flagged(FLAG)), 2, 2), lambda m: any(m[0])),
        (Always(Not(Atom(Flagged(FLAG))), 2, 2), lambda m: not any(m[0])),
        (Atom(Flagged(FLAG)), lambda m: m[0][0]),
        (At(1, Atom(Flagged(FLAG))), lambda m: False),
        (At(1, Not(Atom(Flagged(FLAG)))), lambda m: True),
        # The other cell clears it.
        (Always(Atom(Flagged(CLEARED)), 2, 2), lambda m: m[0][2]),
        (Always(Not(Atom(Flagged(CLEARED))), 2, 2), lambda m: not m[0][2]),
        (Always(Atom(Flagged(TWICE)), 2, 2), lambda m: any(m[0])),
        (Always(Not(Atom(Flagged(TWICE))), 2, 2), lambda m: not any(m[0])),
    ],
)
def test_a_flag_is_set_from_when_its_region_sets_it(node: Node, keep: Callable[[Joint], bool]) -> None:
    assert left(node) == those(keep)


def test_a_formation_is_asked_of_each_of_its_edges() -> None:
    edges = (ir.FormationEdge(0, 1, 1.0), ir.FormationEdge(1, 2, 1.0))
    row = Atom(InFormation(ir.Formation("row", "chain", (0, 1, 2), edges, Metres(1.0), False, SPAN)))
    assert left(row, 3, 0) == those(lambda m: m[0][0] == m[1][0] == m[2][0], 3, 0)
    assert left(Not(row), 3, 0) == those(lambda m: not m[0][0] == m[1][0] == m[2][0], 3, 0)


@pytest.mark.parametrize(
    "predicate",
    [
        Facing(0.0, 1.0),
        Compare(((1.0, Level(ir.Resource("fuel", (0,), 1.0, 1.0, 1.0, 0.0, (), SPAN))),), 0.0, False),
        ir.Connected(RADIO, (0, 1)),
        Compare(((1.0, Speed()), (1.0, DistanceTo(1))), 0.0, False),
    ],
)
def test_what_cells_say_nothing_of_may_hold_and_may_fail(predicate: Predicate) -> None:
    for node in (Atom(predicate), Not(Atom(predicate))):
        assert left(node) == those(lambda m: True)


def test_a_height_is_ones_own_in_a_volume_alone() -> None:
    """With the distance of two others it is asked of all three in a volume, and of those two in the plane."""
    both = Atom(Compare(((1.0, DistanceBetween(1, 2)), (1.0, ir.Altitude())), 0.0, False))
    mission = mission_of(3, 0)
    volume = replace(mission, world=ir.World((0.0,) * 3, (3.0,) * 3, SPAN))
    for made, asked in ((mission, [("pair", 1, 2)]), (volume, [])):
        labels = Exact()
        refutation(made, (Goal("it", both, SPAN),), cover(2, 0, 3), labels)
        assert labels.asked == asked


def test_of_agents_that_are_not_asked_nothing_is_known() -> None:
    everything = those(lambda m: True, 2, 0)
    for node in (At(1, HERE), NEAR, Neighbour(RADIO, All(()))):
        assert left(node, 2, 0, asked=(0,)) == everything
    assert left(HERE, 2, 0, asked=(0,)) == those(lambda m: bool(m[0][0]), 2, 0)


def test_a_speed_says_nothing_where_there_is_no_motion_or_one_of_more_than_itself() -> None:
    assert left(MOVES, 1, 0) == those(lambda m: True, 1, 0)
    mixed = Atom(Compare(((1.0, Speed()), (1.0, ir.Coordinate(0))), 0.0, False))
    assert left(Always(mixed, 1, 1), 1, 2) == those(lambda m: m[0][1] != m[0][2], 1, 2)
    assert left(Always(mixed, 2, 2), 1, 2) == those(lambda m: True, 1, 2)
    mission = mission_of(1, 1)
    heavy = replace(mission, agents=(replace(mission.agents[0], dynamics=ir.DoubleIntegrator(1.0, 1.0)),))
    labels = Exact()
    refutation(heavy, (Goal("it", MOVES, SPAN),), cover(2, 1), labels)
    assert labels.asked == []


def test_a_leaf_is_asked_for_once_and_folds_away_where_cells_decide_it() -> None:
    labels = Exact()
    both = All((Always(HERE, 0, 1), Eventually(HERE, 0, 1)))
    claimed = cover(2, 1)
    cnf = refutation(mission_of(1, 1), (Goal("it", both, SPAN), Goal("again", both, SPAN)), claimed, labels)
    assert set(labels.asked) == {("own", 0)}
    away = np.array([[False, True], [True, False]])
    known = replace(claimed, absent={0: away})
    node = Always(HERE, 1, 1)
    assert refutation(mission_of(1, 1), (Goal("it", node, SPAN),), known, Exact()).clauses == [
        *_motion(known),
    ]
    never = refutation(mission_of(1, 1), (Goal("it", HERE, SPAN),), known, Exact())
    assert never.clauses == [*_motion(known), [FALSE]]
    assert cnf.variables > 1


def _motion(claimed: object) -> list[list[int]]:
    cnf = Cnf()
    encode_motion(claimed, cnf)  # type: ignore[arg-type]
    return cnf.clauses

"""Witnesses: whom and which links a formula at one step rests on, true or false."""

from __future__ import annotations

import pytest

from missionc import ir
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
    Is,
    Neighbour,
    Node,
    Not,
    PathLength,
    Reach,
    Route,
)
from missionc.verification.monitoring.violation import Witnesses
from tests.support.random_runs import graphs_of, mission_of, trace_of

RADIO = graphs_of(4)[0]
PLACES = [(0.0, 0.0), (0.9, 0.0), (1.8, 0.0), (0.9, 0.9)]
"""Three in a row, and one beside the middle one: who is next to each other is linked, nobody else."""
FIRST, SECOND, THIRD = (Is(frozenset((agent,))) for agent in range(3))
ROW = [(0, 0, 1), (0, 1, 2)]


@pytest.mark.parametrize(
    ("node", "holds", "fails", "links"),
    [
        (Reach(RADIO, All(()), THIRD, 3), {0, 1, 2}, set(), ROW),
        (Reach(RADIO, All(()), THIRD, 1), set(), {0}, []),
        (Reach(RADIO, All(()), FIRST, 3), {0}, set(), []),
        (EveryReach(RADIO, Any(()), Not(THIRD), 3), set(), {0, 1, 2}, ROW),
        (Route(RADIO, All(()), THIRD, 0.0, 5.0), {0, 1, 2}, set(), ROW),
        (Neighbour(RADIO, SECOND), {0, 1}, set(), ROW[:1]),
        (EveryNeighbour(RADIO, Not(SECOND)), set(), {0, 1}, ROW[:1]),
        (EveryNeighbour(RADIO, SECOND), {0}, set(), []),
        (PathLength(RADIO, 2, 0.0, 5.0), {0, 2}, set(), []),
        (Any((Neighbour(RADIO, SECOND), Reach(RADIO, All(()), THIRD, 3))), {0, 1}, set(), ROW[:1]),
        (Any((SECOND, Reach(RADIO, All(()), THIRD, 3))), {0, 1, 2}, set(), ROW),
        (Any((SECOND, Reach(RADIO, All(()), THIRD, 1))), set(), {0}, []),
        (All((FIRST, Neighbour(RADIO, SECOND))), {0, 1}, set(), ROW[:1]),
        (All((At(2, FIRST), Neighbour(RADIO, SECOND))), set(), {2}, []),
        (AtLeast(2, (FIRST, Neighbour(RADIO, SECOND), At(2, FIRST))), {0, 1}, set(), ROW[:1]),
        (AtLeast(2, (FIRST, At(1, FIRST), At(2, FIRST))), set(), {1, 2}, []),
    ],
    ids=lambda each: type(each).__name__ if hasattr(each, "span") else "",
)
def test_a_witness_is_what_decides(
    node: Node, holds: set[int], fails: set[int], links: list[tuple[int, int, int]]
) -> None:
    root = At(0, node)
    witness = Witnesses([root], mission_of(4, 0), trace_of([[place] for place in PLACES]), {}).of(root, False)
    assert witness is not None
    assert set(witness.holds[:, 0].nonzero()[0].tolist()) == holds
    assert set(witness.fails[:, 0].nonzero()[0].tolist()) == fails
    assert [tuple(each) for each in witness.links.tolist()] == links


NEXT = [(1.0, 3.0), (1.5, 3.5), (3.0, 3.0), (9.0, 9.0)]
"""x of the agents at two steps."""
NEAR, FAR = (Atom(ir.Compare(((sign, ir.DistanceTo(2)),), -sign * 3.0, False)) for sign in (-1.0, 1.0))
"""Up to 3 m from the third agent, or at least."""


@pytest.mark.parametrize(
    ("node", "holds"),
    [
        (Always(NEAR, 0, 1), {0: [0, 1], 2: [0, 1]}),
        (Always(Any((All((NEAR, FAR)), NEAR)), 0, 1), {0: [0, 1], 2: [0, 1]}),
        (Always(Any((At(3, NEAR), NEAR)), 0, 1), {0: [0, 1], 2: [0, 1]}),
        (Always(Any((Is(frozenset((1,))), At(1, NEAR))), 0, 1), {1: [0, 1], 2: [0, 1]}),
        (All((Always(NEAR, 0, 1), Any((At(1, NEAR), Is(frozenset((3,))))))), {0: [0, 1], 1: [0], 2: [0, 1]}),
        (Eventually(At(1, NEAR), 1, 1), {1: [1], 2: [1]}),
    ],
    ids=lambda each: type(each).__name__ if hasattr(each, "span") else "",
)
def test_a_verdict_of_step_0_is_looked_through_to_what_is_asked_at_each_step(
    node: Node, holds: dict[int, list[int]]
) -> None:
    root = At(0, node)
    trace = trace_of([[(x, 0.0) for x in along] for along in NEXT])
    witness = Witnesses([root], mission_of(4, 1), trace, {}).of(root, True)
    assert witness is not None
    agents, steps = witness.holds.nonzero()
    found = {agent: steps[agents == agent].tolist() for agent in sorted(set(agents.tolist()))}
    assert found == holds


def test_partners_are_lit_at_each_step_by_whatever_part_is_true_then() -> None:
    near = Atom(ir.Compare(((-1.0, ir.DistanceTo(2)),), 1.9, False))
    far = Atom(ir.Compare(((1.0, ir.DistanceTo(2)),), -1.9, False))
    root = At(0, Always(Any((near, far)), 0, 1))
    trace = trace_of([[(1.0, 0.0), (0.5, 0.0)], [(5.0, 0.0)] * 2, [(2.0, 0.0), (3.0, 0.0)], [(9.0, 0.0)] * 2])
    witness = Witnesses([root], mission_of(4, 1), trace, {}).of(root, True)
    assert witness is not None
    assert witness.holds.tolist() == [[True, True], [False, False], [True, True], [False, False]]
    assert not witness.fails.any()

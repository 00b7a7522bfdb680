"""Counterexamples of formulas made by hand, on signals made by hand: what is followed down, and to which moment."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any as Anything

import numpy as np

from missionc.base.source import Source, Span
from missionc.ir.kernel.nodes import (
    All,
    Always,
    Any,
    At,
    AtLeast,
    Eventually,
    Is,
    Node,
    Not,
    Release,
    Until,
)
from missionc.ir.kernel.walk import postorder
from missionc.verification.between.between_steps import Culprit, Search
from missionc.verification.between.interval_sets import STEP, Signal, Spans

END = 4 * STEP
ALWAYS, NEVER = Signal(((0, END),), ()), Signal((), ((0, END),))
HALF = STEP // 2


def leaf() -> Is:
    return Is(frozenset())


def whole(*true: tuple[int, int]) -> Signal:
    """What holds then and at no other tick."""
    edges = [-1, *(edge for span in true for edge in span), END + 1]
    return Signal(true, tuple((low + 1, high - 1) for low, high in zip(edges[::2], edges[1::2], strict=True)))


def search(
    root: Node,
    known: Mapping[Anything, Signal | dict[int, Signal]],
    certain: bool = True,
    ahead: Mapping[Anything, int] | None = None,
    truths: Mapping[Anything, list[bool]] | None = None,
) -> Search:
    """What is not named is not known; at the steps each node is what it is at their ticks."""
    nodes = postorder([root])
    signals = {
        node: each if isinstance(each := known.get(node, Signal((), ())), dict) else {0: each, 1: each, 2: each}
        for node in nodes
    }
    at_steps = {
        node: np.array([[has(signal.sure, step * STEP) for step in range(5)] for signal in signals[node].values()])
        for node in nodes
    }
    at_steps |= {node: np.array([row]) for node, row in (truths or {}).items()}
    return Search(signals, at_steps, certain, dict.fromkeys(nodes, 0) | dict(ahead or {}), END)


def has(spans: Spans, tick: int) -> bool:
    return any(low <= tick <= high for low, high in spans)


def places(found: tuple[Culprit, ...]) -> list[tuple[Node, int, int, bool]]:
    return [(each.node, each.agent, each.tick, each.value) for each in found]


# -------------------------------------------------------------------- when


def test_a_verdict_that_is_sure_follows_what_is_sure() -> None:
    a = leaf()
    sure = search(a, {a: Signal(((3, 5),), ((8, 10),))})
    assert sure.when(a, 0, True) == ((3, 5),)
    assert sure.when(a, 0, False) == ((8, 10),)


def test_a_verdict_that_is_open_follows_what_may_be() -> None:
    a = leaf()
    open_ = search(a, {a: Signal(((3, 5),), ((0, 1), (8, END)))}, certain=False)
    assert open_.when(a, 0, True) == ((2, 7),)
    assert open_.when(a, 0, False) == ((0, 2), (6, END))
    assert search(a, {a: ALWAYS}, certain=False).when(a, 0, True) == ((0, END),)
    assert search(a, {a: ALWAYS}, certain=False).when(a, 0, False) == ()
    assert search(a, {a: whole((5, 5))}, certain=False).when(a, 0, True) == ((5, 5),)


def test_what_decides_has_the_stretch_around_its_moment() -> None:
    a = leaf()
    (found,) = search(a, {a: Signal((), ((0, 7), (9, END)))}).culprits(a)
    assert found == Culprit(a, 0, 0, False, 0, 7, a, False, False)
    (nowhere,) = search(a, {}).culprits(a)
    assert (nowhere.low, nowhere.high) == (0, 0)


# ------------------------------------------------------------- what is new


def test_of_parts_that_fail_one_that_the_steps_do_not_show_is_named() -> None:
    a, b, c = leaf(), leaf(), leaf()
    root = All((a, b, c))
    known = {a: ALWAYS, b: NEVER, c: NEVER}
    assert places(search(root, known, truths={c: [True] * 5}).culprits(root)) == [(c, 0, 0, False)]
    assert places(search(root, known).culprits(root)) == [(b, 0, 0, False)]
    # One column, or one row, is that of every step, or agent.
    assert places(search(root, known, truths={c: [True]}).culprits(root)) == [(c, 0, 0, False)]


def test_a_moment_between_two_steps_is_new_where_both_of_them_say_otherwise() -> None:
    a = leaf()
    root = Always(a, 0, 4)
    known = {a: whole((0, STEP), (2 * STEP, 2 * STEP + 9), (3 * STEP, END))}

    def tick(row: list[bool]) -> int:
        return search(root, known, truths={a: row}).culprits(root)[0].tick

    assert tick([True, True, True, True, True]) == STEP + 1
    assert tick([True, False, True, True, True]) == 2 * STEP + 10
    assert tick([True, True, False, True, True]) == STEP + 1
    assert tick([True, True, True, False, True]) == STEP + 1


def test_a_moment_at_a_step_is_new_where_that_step_says_otherwise() -> None:
    a, b = leaf(), leaf()
    root = Always(Any((a, b)), 0, 4)
    known = {a: whole((0, STEP - 1)), b: whole((0, STEP - 1)), root.body: whole((0, STEP - 1))}
    found = search(root, known, truths={root.body: [True] * 5, b: [False, True, False, False, False]}).culprits(root)
    assert places(found) == [(b, 0, STEP, False)]


# ------------------------------------------------------------------- logic


def test_some_of_the_parts_fail_because_all_of_them_do() -> None:
    parts = tuple(leaf() for _ in range(4))
    for root in (Any(parts), AtLeast(1, parts)):
        found = search(root, dict.fromkeys(parts, NEVER)).culprits(root)
        assert places(found) == [(part, 0, 0, False) for part in parts[:3]]
    few = AtLeast(3, parts)
    assert places(search(few, {parts[0]: NEVER, parts[1]: ALWAYS, parts[3]: NEVER}).culprits(few)) == [
        (parts[0], 0, 0, False),
        (parts[3], 0, 0, False),
    ]


def test_what_is_asked_of_a_negation_is_the_opposite() -> None:
    a, b = leaf(), leaf()
    root = Not(a)
    assert places(search(root, {a: ALWAYS}).culprits(root)) == [(a, 0, 0, True)]
    both = All((Not(a), Not(b)))
    assert places(search(both, {a: NEVER, b: ALWAYS, both.parts[1]: NEVER}).culprits(both)) == [(b, 0, 0, True)]
    # What is true of some is so by one of them; of all, by each.
    neither = Not(Any((a, b)))
    assert places(search(neither, {a: ALWAYS, b: ALWAYS}).culprits(neither)) == [(a, 0, 0, True)]
    not_both = Not(All((a, b)))
    assert places(search(not_both, {a: ALWAYS, b: ALWAYS}).culprits(not_both)) == [(a, 0, 0, True), (b, 0, 0, True)]


def test_what_is_asked_of_an_agent_is_looked_up_there() -> None:
    a = leaf()
    root = At(2, a)
    known = {a: {0: ALWAYS, 2: NEVER}}
    (found,) = search(root, known).culprits(root)
    assert (found.agent, found.low, found.high, found.team) == (2, 0, END, True)
    # The rows of what is true at the steps are those of the agents, or one for all.
    parts = leaf(), leaf()
    both = At(1, All(parts))
    sides = {part: {0: NEVER, 1: NEVER} for part in parts}
    assert search(both, sides, truths={parts[1]: [True] * 5}).culprits(both)[0].node is parts[1]
    rows = search(both, sides)
    rows.truths[parts[1]] = np.array([[False] * 5, [True] * 5])
    assert rows.culprits(both)[0].node is parts[1]


# ----------------------------------------------------------------- windows


def test_what_is_asked_of_every_moment_fails_at_one() -> None:
    a = leaf()
    known = {a: whole((0, STEP), (2 * STEP, END))}
    for root in (Always(a, 0, 4), Always(a, 1, None), Always(a, 0, 2)):
        (found,) = search(root, known).culprits(root)
        assert (found.tick, found.low, found.high) == (STEP + 1, STEP + 1, 2 * STEP - 1)
    late = Always(a, 2, 3)
    assert places(search(late, known).culprits(late)) == [(late, 0, 0, False)]


def test_what_is_asked_of_some_moment_fails_at_each_and_a_step_that_says_otherwise_is_named() -> None:
    a = leaf()
    for root, tick in (
        (Eventually(a, 1, 3), 2 * STEP),
        (Eventually(a, 2, None), 2 * STEP),
        (Eventually(a, 3, None), 3 * STEP),
        (Eventually(a, 0, 1), 0),
    ):
        found = search(root, {a: NEVER}, truths={a: [False, False, True, False, False]}).culprits(root)
        assert places(found) == [(a, 0, tick, False)]


def test_a_window_after_another_begins_where_that_one_failed() -> None:
    """From 1.5 steps on the inner window has the steps 2 to 3, and no longer 3.5."""
    a = leaf()
    inner = Eventually(a, 0, 2)
    root = Always(inner, 0, 2)
    known = {
        a: whole((0, STEP + HALF - 1), (4 * STEP, END)),
        inner: Signal(((0, STEP),), ((STEP + HALF, 2 * STEP - 1),)),
    }
    truths = {inner: [True] * 5, a: [True, True, False, True, True]}
    (found,) = search(root, known, truths=truths).culprits(root)
    assert (found.tick, found.low) == (3 * STEP, STEP + HALF)
    nothing_new = {inner: [True] * 5, a: [False] * 5}
    assert search(root, known, truths=nothing_new).culprits(root)[0].tick == 2 * STEP


def test_a_window_without_a_step_begins_where_it_is_asked() -> None:
    a = leaf()
    inner = Eventually(a, 0, 0)
    root = Always(inner, 0, 2)
    known = {a: whole((0, STEP)), inner: Signal(((0, STEP),), ((STEP + HALF, 2 * STEP - 1),))}
    (found,) = search(root, known, truths={inner: [True] * 5}).culprits(root)
    assert (found.node, found.tick) == (a, STEP + HALF)


def test_a_window_that_looks_back_has_nothing_before_the_beginning() -> None:
    a = leaf()
    once = Eventually(a, -2, -1)
    root = Always(once, 0, 4)
    known = {a: whole((0, HALF)), once: Signal((), ((2 * STEP + HALF + 1, END),))}
    truths = {once: [True] * 5, a: [True, True, True, True, True]}
    (found,) = search(root, known, truths=truths).culprits(root)
    # At 2.5 steps the window has the moments from 0.5 to 1.5: the step among them is the first.
    assert (found.node, found.tick) == (a, STEP)
    at_once = search(once, {a: NEVER}).culprits(once)
    assert places(at_once) == [(once, 0, 0, False)]


# ------------------------------------------------------------------- until


def test_until_fails_where_what_holds_breaks_before_its_end() -> None:
    hold, end = leaf(), leaf()
    root = Until(hold, end, 0, 4)
    breaks = whole((0, STEP + HALF), (2 * STEP, END))
    late = {hold: breaks, end: whole((3 * STEP, END))}
    assert places(search(root, late).culprits(root)) == [(hold, 0, STEP + HALF + 1, False)]
    # Where the end is nowhere, that is the reason, unless a step says otherwise after the break.
    nowhere = {hold: breaks, end: NEVER}
    assert places(search(root, nowhere).culprits(root)) == [(end, 0, 0, False)]
    for step, node, tick in ((1, end, STEP), (2, hold, STEP + HALF + 1)):
        truths = {end: [number == step for number in range(5)]}
        assert places(search(root, nowhere, truths=truths).culprits(root)) == [(node, 0, tick, False)]


def test_until_fails_at_its_end_where_what_holds_breaks_no_earlier() -> None:
    """What breaks after the window, or once nothing asks for it any more, decides nothing."""
    hold, end = leaf(), leaf()
    known = {hold: whole((0, 3 * STEP - 1)), end: NEVER}
    last = {end: [False, False, True, False, True]}
    short = Until(hold, end, 1, 2)
    assert places(search(short, known, truths=last).culprits(short)) == [(end, 0, 2 * STEP, False)]
    last[end][2] = False
    root = Until(hold, end, 1, 4)
    for ahead, node, tick in ((0, hold, 3 * STEP), (1, hold, 3 * STEP), (2, end, END), (9, end, END)):
        found = search(root, known, ahead={hold: ahead}, truths=last).culprits(root)
        assert places(found) == [(node, 0, tick, False)]


def test_what_holds_up_to_a_moment_need_not_hold_at_it() -> None:
    hold, end = leaf(), leaf()
    root = Until(hold, end, 1, 4)
    for breaks, node in ((STEP, end), (STEP - 1, hold)):
        known = {hold: whole((0, breaks - 1)), end: NEVER}
        assert places(search(root, known).culprits(root)) == [(node, 0, breaks, False)]


def test_release_fails_at_a_moment_of_the_window_alone() -> None:
    hold, end = leaf(), leaf()
    root = Release(hold, end, 1, 4)
    known = {hold: NEVER, end: whole((0, 2 * STEP))}
    assert places(search(root, known).culprits(root)) == [(end, 0, 2 * STEP + 1, False)]


def test_since_fails_at_the_last_moment_at_which_what_holds_breaks() -> None:
    hold, end = leaf(), leaf()
    since = Until(hold, end, -2, 0)
    root = At(1, Always(since, 3, 3))
    thrice = whole((0, STEP), (STEP + 9, STEP + HALF), (STEP + HALF + 9, 2 * STEP), (2 * STEP + HALF, END))
    known = {hold: thrice, end: whole((0, STEP + 9)), since: NEVER}
    assert places(search(root, known).culprits(root)) == [(hold, 1, 2 * STEP + HALF - 1, False)]
    # What broke before the window decides nothing; its end does.
    early = {hold: whole((STEP, END)), end: NEVER, since: NEVER}
    assert places(search(root, early).culprits(root)) == [(end, 1, STEP, False)]


# ------------------------------------------------------------------- words


SOURCE = Source("test.mission", "some words of a mission")


def words(low: int, high: int) -> Span:
    return Span(SOURCE, low, high)


def test_what_an_operator_was_rewritten_to_goes_by_its_words() -> None:
    a, b = leaf(), replace(leaf(), span=words(5, 10))
    root = All((a, b), words(0, 4))
    (plain,) = search(root, {a: NEVER, b: ALWAYS}).culprits(root)
    assert (plain.label, plain.says) == (root, False)
    (named,) = search(root, {a: ALWAYS, b: NEVER}).culprits(root)
    assert (named.label, named.says) == (b, False)
    same = All((replace(b, span=words(0, 4)),), words(0, 4))
    (alike,) = search(same, {same.parts[0]: NEVER}).culprits(same)
    assert (alike.label, alike.node) == (same, same.parts[0])


def test_what_says_the_opposite_of_its_words_is_said_to_be_true_where_it_fails() -> None:
    a = leaf()
    denied = Always(a, 0, 4, words(5, 10), dual=True)
    root = All((denied,), words(0, 4))
    (found,) = search(root, {a: whole((0, STEP)), denied: NEVER}).culprits(root)
    assert (found.label, found.says, found.value) == (denied, True, False)
    (outermost,) = search(denied, {a: whole((0, STEP))}).culprits(denied)
    assert (outermost.label, outermost.says) == (denied, True)


def test_what_is_asked_of_an_agent_by_its_name_is_about_the_team_up_to_words_of_its_own() -> None:
    a, b = leaf(), replace(leaf(), span=words(5, 10))
    root = All((At(1, Always(a, 0, 4)), At(1, b)), words(0, 4))
    inner = root.parts[0]
    (found,) = search(root, {a: whole((0, STEP)), inner: NEVER, root.parts[1]: ALWAYS}).culprits(root)
    assert (found.agent, found.label, found.team) == (1, root, True)
    (own,) = search(root, {b: NEVER, inner: ALWAYS, root.parts[1]: NEVER}).culprits(root)
    assert (own.agent, own.label, own.team) == (1, b, False)

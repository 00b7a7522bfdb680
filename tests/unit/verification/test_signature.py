"""Signatures of plans: what makes two of them different, and what does not."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from missionc.base.source import Source
from missionc.base.trace import Array, Trace
from missionc.base.units import Seconds
from missionc.compiler.front_end import check
from missionc.ir import Mission
from missionc.ir.kernel.choices import ChoicePoint, branches, made_once, without
from missionc.ir.kernel.nodes import Kernel
from missionc.verification.monitoring.monitor import truth
from missionc.verification.monitoring.signature import Event, Signatures, _several, differences

TEXT = """mission sides
time step 1 s, horizon 8 s
world (0, 0) to (20, 20)
region a = box (15, 12) to (19, 16)
region b = box (15, 4) to (19, 8)
obstacle pillar = box (8, 8) to (12, 12)
obstacle ledge = box (8, 19) to (12, 20)
team rover[2] { radius 0.3 m  dynamics single_integrator(speed <= 9 m/s)  start at (2, 10), (2, 5) }
require either: rover[0]: eventually[0, 8 s] (a or b)
require seen:   some rover: eventually[0, 8 s] b
"""

ORDER = TEXT.replace(
    "require either: rover[0]: eventually[0, 8 s] (a or b)", "require go_a: rover[0]: eventually[0, 8 s] a"
)

UP, DOWN = [(2, 10), (5, 14), (10, 15), (14, 15), (17, 14)], [(2, 10), (5, 6), (10, 5), (14, 5), (17, 6)]
ROUND = [(2, 10), (5, 6), (10, 5), (14, 10), (17, 14)]
STILL = [(2, 5)]


def read(text: str) -> tuple[Mission, Kernel]:
    checked = check(Source("a.mission", text))
    assert checked.mission is not None
    assert checked.kernel is not None
    return checked.mission, checked.kernel


def moved(*paths: Sequence[tuple[float, float]], steps: int = 8) -> Trace:
    """Agents that go from corner to corner, one a step, and stay at the last."""
    rows: list[Array] = []
    for path in paths:
        corners = np.array([*path, *([path[-1]] * (steps + 1 - len(path)))], dtype=float)
        rows.append(corners)
    position = np.stack(rows)
    velocity = np.concatenate([np.diff(position, axis=1), np.zeros_like(position[:, :1])], axis=1)
    return Trace(Seconds(1.0), position, velocity, np.zeros(position.shape[:2]))


def told_apart(text: str, one: Trace, other: Trace) -> tuple[str, ...]:
    signatures = Signatures(*read(text))
    return differences(signatures.of(one), signatures.of(other))


def test_another_branch_is_another_plan_and_is_said_in_the_words_of_the_mission() -> None:
    apart = told_apart(TEXT, moved(UP, DOWN), moved(DOWN, DOWN))
    assert apart[0] == "`either` by `b` instead of `a`"


def test_another_agent_that_does_it_is_another_plan() -> None:
    apart = told_apart(TEXT, moved(UP, DOWN), moved(DOWN, STILL))
    assert "`seen` by rover[0] instead of rover[1]" in apart


def test_a_branch_that_holds_in_both_makes_no_difference() -> None:
    assert told_apart(TEXT, moved(DOWN, DOWN), moved(DOWN, STILL)) == ()


def test_the_other_side_of_an_obstacle_is_another_plan() -> None:
    assert told_apart(TEXT, moved(UP, DOWN), moved(ROUND, DOWN)) == ("rover[0]: `pillar` on its left instead of right",)


def test_what_reaches_the_border_of_the_world_has_one_side() -> None:
    mission, kernel = read(TEXT)
    assert [part.name for part in Signatures(mission, kernel).parts] == ["pillar"]


def test_two_visits_of_one_agent_in_the_other_order_are_another_plan() -> None:
    first = [(2, 10), (5, 6), (10, 5), (16, 6), (18, 14)]
    second = [(2, 10), (5, 6), (10, 5), (14, 10), (18, 14), (16, 6)]
    assert told_apart(ORDER, moved(first, STILL), moved(second, STILL)) == ("rover[0]: `a` before `b`",)


@pytest.mark.parametrize("seed", range(8))
def test_a_plan_that_is_moved_a_little_is_the_same_plan(seed: int) -> None:
    drawn = np.random.default_rng(seed)
    signatures = Signatures(*read(TEXT))
    for paths in ((UP, DOWN), (DOWN, STILL), (ROUND, DOWN)):
        trace = moved(*paths)
        shaken = Trace(
            trace.step, trace.position + drawn.uniform(-0.9, 0.9, trace.position.shape), trace.velocity, trace.heading
        )
        assert differences(signatures.of(trace), signatures.of(shaken)) == ()


def test_a_plan_is_as_different_from_another_as_that_is_from_it() -> None:
    signatures = Signatures(*read(TEXT))
    plans = [signatures.of(moved(*paths)) for paths in ((UP, DOWN), (DOWN, DOWN), (ROUND, DOWN), (DOWN, STILL))]
    for one in plans:
        for other in plans:
            assert bool(differences(one, other)) == bool(differences(other, one))


def test_what_is_chosen_at_every_step_of_a_window_is_no_choice() -> None:
    _, kernel = read(TEXT.replace("eventually[0, 8 s] (a or b)", "always[0, 8 s] not (a and b)"))
    chosen = [asked for goal in kernel.requirements[:1] for asked in made_once(goal.formula) if branches(asked)]
    assert chosen == []


KEPT = TEXT.replace("eventually[0, 8 s] (a or b)", "eventually[0, 6 s] always[0, 2 s] (a or b)")


def test_what_is_kept_from_an_event_on_is_a_choice_of_what_is_kept() -> None:
    assert told_apart(KEPT, moved(UP, STILL), moved(DOWN, STILL))[0] == "`either` by `b` instead of `a`"
    _, kernel = read(KEPT)
    (choice,) = [asked for asked in made_once(kernel.requirements[0].formula) if branches(asked)]
    assert (choice.low, choice.high, choice.once) == (0, 2, False)


def test_a_branch_that_does_not_last_the_window_is_not_the_one_that_is_kept() -> None:
    by_the_way = [(2, 10), (5, 14), (10, 15), (14, 15), (17, 13), (17, 7)]
    assert not any("`either`" in words for words in told_apart(KEPT, moved(DOWN, STILL), moved(by_the_way, STILL)))


def test_what_is_awaited_again_and_again_from_an_event_on_is_no_choice() -> None:
    _, kernel = read(TEXT.replace("eventually[0, 8 s] (a", "eventually[0, 2 s] always[0, 3 s] eventually[0, 2 s] (a"))
    assert [asked for asked in made_once(kernel.requirements[0].formula) if branches(asked)] == []


@pytest.mark.parametrize("number", [0, 1])
def test_a_formula_without_a_branch_that_is_kept_is_stricter(number: int) -> None:
    mission, kernel = read(KEPT)
    formula = kernel.requirements[0].formula
    (choice,) = [asked for asked in made_once(formula) if branches(asked)]
    narrower = without(formula, {choice: frozenset({number})})
    held = [bool(truth(narrower, mission, moved(path, STILL))[0, 0]) for path in (UP, DOWN)]
    assert held == [number == 1, number == 0]


def test_a_formula_without_a_branch_holds_where_another_one_does() -> None:
    mission, kernel = read(TEXT)
    formula = kernel.requirements[0].formula
    (choice,) = [asked for asked in made_once(formula) if branches(asked)]
    up, down = moved(UP, STILL), moved(DOWN, STILL)
    for number, holds in ((0, (False, True)), (1, (True, False))):
        narrower = without(formula, {choice: frozenset({number})})
        assert tuple(bool(truth(narrower, mission, trace)[0, 0]) for trace in (up, down)) == holds
    assert without(formula, {}) is formula
    assert without(formula, {ChoicePoint(choice.node, 1): frozenset({0})}) is formula


def test_an_order_is_that_of_events_that_never_hold_at_once() -> None:
    _, kernel = read(ORDER)
    (asked, *_) = [each for goal in kernel.requirements for each in made_once(goal.formula)]

    def event(*steps: int) -> Event:
        flags = np.zeros(9, dtype=np.bool_)
        flags[list(steps)] = True
        return Event("it", asked, asked.node, flags, 8, frozenset((0,)))

    assert event(1, 2).before(event(3, 4))
    assert event(1, 3).before(event(2, 4))
    assert not event(3, 4).before(event(1, 2))
    assert not event(1, 4).before(event(2, 3))
    assert not event(2, 3).before(event(2, 4))
    assert not event(1, 3).before(event(3, 4))
    assert not event().before(event(3))
    assert not event(3).before(event())


@pytest.mark.parametrize(
    ("formula", "one", "other", "said"),
    [
        ("rover[0]: eventually[0, 8 s] (a or (b and x >= 0))", UP, DOWN, "`either` by `b and x >= 0` instead of `a`"),
        ("rover[0]: eventually[0, 8 s] (a or  b)", DOWN, UP, "`either` by `a` instead of `b`"),
        ("rover[0]: always[4 s, 8 s] (a or b)", UP, DOWN, None),
    ],
)
def test_a_choice_is_said_in_its_own_words(
    formula: str, one: Sequence[tuple[float, float]], other: Sequence[tuple[float, float]], said: str | None
) -> None:
    text = TEXT.replace("rover[0]: eventually[0, 8 s] (a or b)", formula)
    apart = [words for words in told_apart(text, moved(one, STILL), moved(other, STILL)) if "`either`" in words]
    assert apart == ([] if said is None else [said])


def test_what_only_one_plan_does_has_no_order() -> None:
    both = [(2, 10), (5, 6), (10, 5), (16, 6), (18, 14)]
    for alone in (UP, DOWN):
        for one, other in ((both, alone), (alone, both)):
            assert not any(" before " in words for words in told_apart(ORDER, moved(one, STILL), moved(other, STILL)))


def test_events_and_choices_have_the_name_of_their_requirement() -> None:
    signature = Signatures(*read(ORDER)).of(moved(UP, DOWN))
    assert sorted(event.requirement for event in signature.events.values()) == ["go_a", "seen"]
    assert [options.requirement for options in signature.options.values()] == ["seen"]


def test_what_holds_where_nothing_is_asked_is_no_choice() -> None:
    """From 5 s on it is in one of them; what it passed before does not count."""
    text = TEXT.replace("eventually[0, 8 s] (a or b)", "eventually[5 s, 8 s] (a or b)")
    early = [(2, 10), (5, 14), (10, 15), (17, 14), (17, 10), (17, 6)]
    assert not any("`either`" in words for words in told_apart(text, moved(DOWN, STILL), moved(early, STILL)))


def test_several_are_named_and_of_more_than_three_how_many() -> None:
    assert [_several(["a", "b", "c", "d", "e"][:count]) for count in range(1, 6)] == [
        "a",
        "a and b",
        "a, b and c",
        "a, b and 2 more",
        "a, b and 3 more",
    ]


def test_all_who_pass_an_obstacle_elsewhere_are_named_together() -> None:
    low = [(2, 5), (5, 4), (10, 3), (14, 5), (17, 14)]
    high = [(2, 5), (5, 14), (10, 17), (14, 15), (17, 14)]
    assert told_apart(ORDER, moved(UP, high), moved(ROUND, low))[-1] == (
        "rover[0] and rover[1]: `pillar` on their left instead of right"
    )
    assert told_apart(ORDER, moved(ROUND, low), moved(UP, high))[-1] == (
        "rover[0] and rover[1]: `pillar` on their right instead of left"
    )

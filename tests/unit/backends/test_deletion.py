"""A conflict that gets smaller, question by question."""

from __future__ import annotations

from itertools import permutations

import pytest

from missionc.backends.smt.refine.problem import Deletion

NAMES = ("a", "b", "c", "d")


def shrunk(conflict: tuple[str, ...], minimal: list[set[str]]) -> Deletion:
    """The conflict after all questions, where just the supersets of these sets cannot hold."""
    deletion = Deletion(conflict)
    while (name := deletion.question()) is not None:
        refused = [each for each in minimal if each.issubset(deletion.without(name))]
        if refused:
            deletion.refused(refused[0])
        else:
            deletion.holds(name)
    return deletion


@pytest.mark.parametrize("order", list(permutations(NAMES))[::5])
def test_of_several_smallest_conflicts_one_is_left_and_known_to_be_smallest(order: tuple[str, ...]) -> None:
    minimal = [{"a", "b"}, {"b", "c", "d"}]
    deletion = shrunk(order, minimal)
    assert set(deletion.conflict) in minimal
    assert deletion.smallest


def test_motion_alone_may_be_to_blame() -> None:
    deletion = shrunk(NAMES, [set()])
    assert deletion.conflict == ()
    assert deletion.smallest


def test_what_was_not_found_out_is_in_the_conflict_and_leaves_open_whether_it_is_smallest() -> None:
    deletion = Deletion(("a", "b"))
    deletion.unknown("a")
    assert deletion.question() == "b"
    deletion.holds("b")
    assert deletion.question() is None
    assert deletion.conflict == ("a", "b")
    assert not deletion.smallest


def test_what_was_left_open_is_asked_again_of_a_smaller_conflict_and_what_is_needed_is_not() -> None:
    deletion = Deletion(("a", "b", "c"))
    deletion.unknown("a")
    deletion.holds("b")
    deletion.refused(("a", "b"))
    assert deletion.question() == "a"
    deletion.holds("a")
    assert deletion.smallest

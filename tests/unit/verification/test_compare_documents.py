"""Comparison of a document that was read with the one that was computed: what differs first, and in which words."""

from __future__ import annotations

import math

import pytest

from missionc.base.strict_json import is_finite_number
from missionc.verification.compare_documents import close, difference, is_version, same_text, shown


@pytest.mark.parametrize(
    ("read", "computed"),
    [
        (1.0 + 0.9e-8, 1.0),
        (0.9e-8, 0.0),
        (100.0 - 0.9e-6, 100.0),
        (2, 2.0),
        (7, 7),
        ("a", "a"),
        (None, None),
        (True, True),
        ([], []),
        ({"a": [1.0, {"b": None}], "c": "d"}, {"c": "d", "a": [1.0, {"b": None}]}),
    ],
)
def test_what_is_the_same_but_for_rounding_does_not_differ(read: object, computed: object) -> None:
    assert difference(read, computed) is None


COME_TO = "but the files give"


def test_what_differs_is_named_with_its_place(subtests: pytest.Subtests) -> None:
    for read, computed, said in [
        (1.0 + 1.1e-8, 1.0, f"it is 1.00000001, {COME_TO} 1"),
        (100.0 - 1.1e-6, 100.0, f"it is 99.9999989, {COME_TO} 100"),
        (1.1e-8, 0.0, f"it is 1.1e-08, {COME_TO} 0"),
        (True, 1.0, f"it is true, {COME_TO} 1"),
        (True, 1, f"it is true, {COME_TO} `1`"),
        (1.0, 1, f"it is 1, {COME_TO} `1`"),
        (math.nan, 1.0, f"it is nan, {COME_TO} 1"),
        (math.inf, 1.0, f"it is inf, {COME_TO} 1"),
        (8, 7, f"it is `8`, {COME_TO} `7`"),
        ("b", "a", f"it is `b`, {COME_TO} `a`"),
        (None, "a", f"it is null, {COME_TO} `a`"),
        (0, None, f"it is `0`, {COME_TO} null"),
        (0, False, f"it is `0`, {COME_TO} false"),
        ({}, "a", f"it is a record, {COME_TO} `a`"),
        ([1, 2], "a", f"it is a list of 2, {COME_TO} `a`"),
        ("a", {}, "it is `a`, not a record"),
        ([], {}, "it is a list of 0, not a record"),
        ("a", [], "it is `a`, not a list"),
        ({}, [], "it is a record, not a list"),
        ({}, {"a": 1}, "it has no `a`"),
        ({"a": 1, "b": 2}, {"a": 1}, "it has an unexpected key `b`"),
        ([1], [1, 2], "it has 1 entries, but the files give 2"),
        ({"a": [0, {"b": 2}]}, {"a": [0, {"b": 1}]}, f"its `a[1].b` is `2`, {COME_TO} `1`"),
        ({"a": {"b": 1}}, {"a": {}}, "its `a` has an unexpected key `b`"),
        ({"a": {}}, {"a": {"b": 1}}, "its `a` has no `b`"),
        ({"a": 1}, {"a": {"b": 1}}, "its `a` is `1`, not a record"),
        ({"a": 1}, {"a": [1]}, "its `a` is `1`, not a list"),
        ({"a": [1]}, {"a": []}, "its `a` has 1 entries, but the files give 0"),
        ([0, 1, 2], [0, 2, 1], f"its `[1]` is `1`, {COME_TO} `2`"),
        ({"a": 1, "b": 3}, {"a": 0, "b": 2}, f"its `a` is `1`, {COME_TO} `0`"),
    ]:
        with subtests.test(read=read, computed=computed, said=said):
            assert difference(read, computed) == said


def test_the_place_and_the_rounding_are_those_that_are_given() -> None:
    assert difference(1, 2, "plan") == f"its `plan` is `1`, {COME_TO} `2`"
    assert difference([1], [2], "plan") == f"its `plan[0]` is `1`, {COME_TO} `2`"
    assert difference({"a": 1}, {"a": 2}, "plan") == f"its `plan.a` is `1`, {COME_TO} `2`"
    assert difference({"a": [1.0]}, {"a": [1.09]}, same=0.1) is None
    assert difference({"a": [1.0]}, {"a": [1.21]}, same=0.1) == f"its `a[0]` is 1, {COME_TO} 1.21"


def test_two_numbers_are_close_within_a_share_of_what_was_computed_and_of_one_at_least() -> None:
    assert close(10.5, 10.0, 0.05)
    assert not close(10.6, 10.0, 0.05)
    assert close(0.25, 0.0, 0.25)
    assert not close(-0.26, 0.0, 0.25)
    assert close(-10.5, -10.0, 0.05)
    assert not close(1.0, 1.0 + 2e-8)


def test_a_number_is_finite_and_no_truth() -> None:
    assert all(map(is_finite_number, (0, -1, 1.5)))
    assert not any(map(is_finite_number, (True, False, math.nan, math.inf, "1", None, [])))


@pytest.mark.parametrize(
    ("read", "computed", "same"),
    [
        ("speed 1.5 m/s", "speed 1.5 m/s", True),
        ("speed 1.5 m/s", "speed 1.500000001 m/s", True),
        ("speed -1.5e+2 m/s", "speed -150.0000001 m/s", True),
        ("1e-9 m", "2e-9 m", True),
        ("speed 1.5 m/s", "speed 1.6 m/s", False),
        ("speed 1.5 m/s", "speed -1.5 m/s", False),
        ("speed 1.5 m/s", "height 1.5 m/s", False),
        ("step 1", "step 2", False),
        ("1.5 2.5", "1.5 2.6", False),
        ("1.6 2.5", "1.5 2.5", False),
        ("1.5 2.5", "1.5", False),
        ("1e+999", "2e+999", False),
    ],
)
def test_texts_are_the_same_but_for_the_rounding_of_fractions(read: str, computed: str, same: bool) -> None:
    assert same_text(read, computed) is same


def test_a_value_is_shown_as_a_message_repeats_it() -> None:
    assert [shown(each) for each in (None, True, False)] == ["null", "true", "false"]
    assert [shown(each) for each in ({"a": 1}, [1, 2, 3])] == ["a record", "a list of 3"]
    assert [shown(each) for each in (1 / 3, 2.0, 3)] == ["0.333333333", "2", "`3`"]
    assert shown("x" * 40) == f"`{'x' * 40}`"
    assert shown("x" * 41) == f"`{'x' * 39}…`"


def test_a_version_is_a_short_word() -> None:
    assert all(map(is_version, ("1.2.3", "2.0+cpu", "v" * 64)))
    assert not any(map(is_version, ("", "1 2", "1.2\n", "v" * 65, 1, None)))

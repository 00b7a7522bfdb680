"""The strict JSON reader: one value for every reader, or a phrase and a place."""

from __future__ import annotations

import pytest

from missionc.base.strict_json import NotJsonError, parse_json, parse_record


def test_what_two_readers_could_understand_differently_is_refused(subtests: pytest.Subtests) -> None:
    for content, reason, place in [
        ("{", "this is not JSON: unexpected end of the file", 1),
        ('{"a": x}', "this is not JSON: unexpected `x`", 6),
        ("", "this is not JSON: unexpected end of the file", 0),
        ("[1] 2", "this is not JSON: unexpected `2`", 4),
        (b"\xff", "it is not UTF-8", 0),
        ("[1, NaN]", "a number is not finite", 4),
        ("[-Infinity]", "a number is not finite", 1),
        ("[1e999]", "a number is not finite", 0),
        ("9" * 310, "a whole number has 310 digits", 0),
        ("9" * 5000, "a whole number has 5000 digits", 0),
        ("[" * 5000 + "]" * 5000, "nested too deeply", 0),
        ('{"a": 1, "a": 2}', "the key 'a' is duplicated", 0),
        ('"\\ud800"', "a text has an unpaired surrogate", 0),
    ]:
        with subtests.test(content=content, reason=reason, place=place):
            with pytest.raises(NotJsonError) as refused:
                parse_json(content)
            assert (refused.value.reason, refused.value.place) == (reason, place)


def test_numbers_that_are_not_finite_are_read_where_they_are_asked_for() -> None:
    low, high = parse_json("[-Infinity, Infinity]", finite=False)
    assert (low, high) == (-float("inf"), float("inf"))


def test_a_record_has_the_form_that_is_asked_for() -> None:
    assert parse_record(b'{"schema": "a/1", "b": 2}', "a/1") == {"schema": "a/1", "b": 2}
    assert parse_record('{"b": 2}') == {"b": 2}
    for content, reason in (("[]", "not a JSON object"), ('{"schema": "a/2"}', "not written by this version")):
        with pytest.raises(NotJsonError, match=reason):
            parse_record(content, "a/1")

"""Figures in words: one of a thing or more, and no small figure that is shown as nothing."""

from __future__ import annotations

import math

import pytest

from missionc.base.trace import counted, decimals


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (0.0181, "0.018"),
        (-0.0004, "-0.0004"),
        (0.00002, "2e-05"),
        (-0.0006, "-0.001"),
        (0.0, "0.000"),
        (-0.0, "0.000"),
        (-12.5, "-12.500"),
        (math.inf, "inf"),
    ],
)
def test_what_is_not_zero_is_not_shown_as_zero(value: float, words: str) -> None:
    assert decimals(value) == words


def test_one_of_a_thing_is_one_thing() -> None:
    assert [counted(number, "agent") for number in (0, 1, 2)] == ["0 agents", "1 agent", "2 agents"]

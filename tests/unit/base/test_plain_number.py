"""Plain numbers: decimal text alone."""

from __future__ import annotations

import math

import pytest

from missionc.base.units import plain_number


@pytest.mark.parametrize(("text", "value"), [("1", 1), ("-0.5", -0.5), (".5", 0.5), ("5.", 5), ("+1e-3", 1e-3)])
def test_decimal_text_is_a_number(text: str, value: float) -> None:
    assert plain_number(text) == value


def test_any_other_text_is_none(subtests: pytest.Subtests) -> None:
    for text in ["", "1_0", "\u0661", "nan", "-nan", "inf", "1e999", "0x10", "1,5", " 1", "1 m", "1e", "."]:
        with subtests.test(text=text):
            assert math.isnan(plain_number(text))

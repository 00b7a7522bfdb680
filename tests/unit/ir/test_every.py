"""Recurrence, `every 40 s: …`: what it means, what is wrong with a period, and what is said of it."""

from __future__ import annotations

import pytest

from missionc.base.diagnostics.code import (
    BEYOND_HORIZON,
    NOT_WHOLE_STEPS,
    QUANTIFIER_MISSING,
    SYNTAX,
    VALUE_OUT_OF_RANGE,
    WRONG_UNIT,
)
from missionc.base.source import Source
from missionc.compiler.driver import check
from missionc.frontend.explain.explanation import explained, lines
from missionc.frontend.resolve.show_ir import show_ir
from missionc.ir.kernel.nodes import Always, At, Eventually
from missionc.ir.language.operator import TooLarge
from missionc.ir.lower.expand import expand
from missionc.ir.lower.unroll_past import looking_ahead
from tests.support.check_findings import meant, only, text, words


def asked(formula: str, *more: str) -> str:
    return text(*more, f"require patrol: {formula}")


def test_planners_are_given_a_recurrence_of_windows_ahead() -> None:
    """Of each stretch that lies within the mission: the last begins as long before the end as it lasts."""
    mission = meant(asked("drone[1]: every 5 s: goal"))
    kernel, _ = expand(mission)
    assert kernel is not None
    ahead = looking_ahead(mission, kernel, 1000)
    assert not isinstance(ahead, TooLarge)
    node = ahead.requirements[0].formula
    assert isinstance(node, At | Always)
    window = node.body
    assert isinstance(window, Always)
    assert (window.low, window.high) == (0, 15)
    assert isinstance(window.body, Eventually)
    assert (window.body.low, window.body.high) == (0, 5)


@pytest.mark.parametrize("period", ["5 s", "5 steps", "(2 s + 3 s)", "P", "(P)", "(P * 2 - 5 s)"])
def test_a_period_is_a_time_or_steps_a_sum_in_brackets_or_a_parameter(period: str) -> None:
    shown = show_ir(meant(asked(f"every {period}: some drone: goal", "param P = 5 s")))
    assert "require patrol: every 5 steps: (some drone: goal)\n" in shown


def test_it_stands_within_a_quantifier_and_around_one() -> None:
    shown = show_ir(meant(asked("every drone: every 5 s: goal")))
    assert "require patrol: every drone: every 5 steps: goal\n" in shown
    assert only(asked("every 5 s: goal"), QUANTIFIER_MISSING).message.startswith(
        "`every 5 s: goal` needs an agent or a quantifier"
    )


@pytest.mark.parametrize(
    ("period", "message"),
    [
        ("0 s", "the period is 0 s, shorter than a step"),
        ("0.4 s", "the period is 0.4 s, shorter than a step"),
        ("0 steps", "the period is 0 s, shorter than a step"),
        ("(-2 s)", "the period is -2 s; it must be at least one step"),
        ("(-2 steps)", "the period is -2 steps; it must be at least one step"),
    ],
)
def test_a_period_lasts_a_step_at_least(period: str, message: str) -> None:
    finding = only(asked(f"every {period}: some drone: goal"), VALUE_OUT_OF_RANGE)
    assert finding.message == message
    assert finding.help is not None
    assert "1 s` or more" in finding.help or "one step or more" in finding.help


def test_a_period_is_a_whole_number_of_steps() -> None:
    finding = only(asked("every 2.5 s: some drone: goal"), NOT_WHOLE_STEPS)
    assert finding.help == "write `2 s` or `3 s`"


def test_a_period_is_a_time() -> None:
    assert only(asked("every 2 m: some drone: goal"), WRONG_UNIT).message == "expected a time, found a length `2 m`"


def test_a_period_no_stretch_of_which_lies_within_the_mission_is_refused() -> None:
    finding = only(asked("every 25 s: some drone: goal"), BEYOND_HORIZON)
    assert words(finding) == [("every 25 s", "reaches 25 s ahead")]
    assert finding.notes == ("the formula needs 25 s; the mission lasts 20 s",)
    check(Source("a.mission", asked("every 20 s: some drone: goal")))
    assert check(Source("a.mission", asked("every 20 s: some drone: goal"))).ok


def test_what_recurs_and_looks_ahead_is_told_how_to_be_spelt_out() -> None:
    finding = only(asked("every 8 s: some drone: (goal and eventually[0, 2 s] base)"), BEYOND_HORIZON)
    assert words(finding) == [
        ("every 8 s", "evaluated at every step up to the last, at 20 s"),
        ("eventually[0, 2 s]", "reaches another 2 s ahead"),
    ]
    assert finding.help == "write `always[0, 10 s] eventually[0, 8 s] …` in place of `every 8 s: …`"
    assert check(Source("a.mission", asked("always[0, 10 s] eventually[0, 8 s] some drone: (goal and next base)"))).ok


@pytest.mark.parametrize(
    ("formula", "message", "help_"),
    [
        ("every 5 s some drone: goal", "expected `:` after `every 5 s`", "write `every 5 s: …`"),
        (
            "every[5 s] some drone: goal",
            "unexpected `[` after `every`: its period has no brackets",
            "write, for example, `every 40 s: …`",
        ),
        (
            "every -5 s: some drone: goal",
            "expected a team, group or agent, or a period such as `40 s` after `every`, found `-`",
            "write, for example, `every drone: base`",
        ),
    ],
)
def test_a_slip_of_the_pen_is_understood(formula: str, message: str, help_: str) -> None:
    finding = only(asked(formula), SYNTAX)
    assert (finding.message, finding.help) == (message, help_)


def test_it_is_said_back_with_its_first_stretch_and_its_last() -> None:
    mission = meant(asked("every 5 s: some drone: goal"))
    page = "\n".join(lines(explained(mission), mission, None, True))
    assert "In each 5 s from 0 s to the end of the mission, at some step, at least one drone is in `goal`." in page
    assert "every 5 s" in page
    assert "█ first window  ░ later windows" in page
    later = meant(asked("always[0, 10 s] every 5 s: some drone: goal"))
    assert "in each 5 s from then to the end of the mission" in "\n".join(lines(explained(later), later, None, True))

"""What a terminal is told: lines that wrap to it, pages that are rendered, commands that were nearly named."""

from __future__ import annotations

import re
from itertools import product

import pytest

from missionc.base.diagnostics.code import CODES, explain
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.diagnostics.render import render_text, wrapped
from missionc.cli.app import main
from missionc.cli.markdown_page import rendered
from missionc.cli.plan_summary import between_samples
from missionc.verification.certificate import Between, Verdict

SENTENCE = "the formula needs 22 s; the mission lasts 20 s, which is two seconds less than it asks for"


def test_a_line_wraps_to_a_terminal_and_loses_no_word(subtests: pytest.Subtests) -> None:
    for width, indent in product([24, 40, 60, 72, 90, 120], [0, 2, 6]):
        with subtests.test(width=width, indent=indent):
            lines = wrapped(SENTENCE, width, indent).split("\n")
            assert max(map(len, lines)) <= max(width, indent + 20)
            assert all(line.startswith(" " * indent) for line in lines[1:])
            assert " ".join(line.strip() for line in lines) == SENTENCE


def test_a_line_stays_as_it_is_where_there_is_no_terminal() -> None:
    assert wrapped(SENTENCE * 3, 0, 2) == SENTENCE * 3


def test_what_stands_before_a_line_takes_room_on_its_first_alone() -> None:
    first, second, *_ = wrapped(SENTENCE, 40, 4, first=10).split("\n")
    assert len(first) <= 30
    assert 30 < len(second) <= 40


@pytest.mark.parametrize("width", [50, 80])
def test_sentences_of_a_finding_wrap_and_hang(width: int) -> None:
    finding = Diagnostic(CODES["MC301"], SENTENCE, None, notes=(SENTENCE,), help=SENTENCE)
    lines = render_text([finding], colour=False, width=width).splitlines()
    assert max(map(len, lines)) <= width
    assert len(lines) > 3
    assert [line for line in lines if re.match(r" *(=|help:) ", line)]
    assert max(map(len, render_text([finding], colour=False).splitlines())) > width


@pytest.mark.parametrize("colour", [False, True])
def test_the_page_of_a_code_is_rendered_for_a_terminal(colour: bool) -> None:
    text = rendered(explain(CODES["MC301"]), 72, colour)
    assert "MC301: the mission ends too early" in text
    assert not re.search(r"^#|```|`always", text, re.MULTILINE)
    assert max(len(re.sub(r"\x1b\[[0-9;]*m", "", line)) for line in text.splitlines()) <= 72
    assert ("\x1b[34m" in text) is colour


@pytest.mark.parametrize(
    ("said", "hint"),
    [
        ("complie", "did you mean `compile`?"),
        ("studoi", "did you mean `studio`?"),
        ("frobnicate", "run `missionc --help` to list all commands"),
    ],
)
def test_a_command_that_is_not_there_gets_a_suggestion(
    said: str, hint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([said]) == 2
    assert f"unknown command `{said}`; {hint}" in capsys.readouterr().err


def test_what_fails_between_the_steps_is_told_in_one_line() -> None:
    relay = Between("relay", Verdict.FAILS, 1.04, 1.69)
    watch = Between("watch", Verdict.UNDECIDED, 3.0, 3.0)
    assert between_samples((relay,)) == "`relay` is violated between samples (1.04–1.69 s)"
    assert between_samples((relay, watch)).endswith(", `watch` may be violated between samples (3.00 s)")
    assert between_samples((relay, watch, relay)).endswith(" and 1 more")

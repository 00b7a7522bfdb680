"""The runner of the Markdown pages is itself run on small ones."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.golden_pages import agrees, blocks, file_name, play
from tests.support.small_missions import SMALL

PAGE = "# A page\n\n```mission\n" + SMALL + "```\n\n## Output\n\n```console\n$ missionc check small.mission\n@```\n"
SAID = "small.mission: no findings\n"


def page(output: str) -> str:
    """A page whose one command is said to print this."""
    return PAGE.replace("@", output)


def test_blocks_have_their_heading_and_text() -> None:
    mission, console = blocks(page(SAID))
    assert (mission.heading, file_name(mission), mission.body) == ("A page", "small.mission", SMALL)
    assert (console.heading, console.info) == ("Output", "console")


def test_a_page_that_is_right_stays_as_it_is(tmp_path: Path) -> None:
    assert play(page(SAID), tmp_path) == page(SAID)


def test_a_page_that_is_wrong_comes_out_right(tmp_path: Path) -> None:
    assert play(page("small.mission: 7 errors\n"), tmp_path) == page(SAID)


def test_what_is_left_open_is_not_rewritten(tmp_path: Path) -> None:
    for output in ("…\n", "small.mission: … findings\n", "…\nsmall.mission: no findings\n…\n"):
        assert play(page(output), tmp_path) == page(output)


@pytest.mark.parametrize(
    ("expected", "actual", "agree"),
    [
        ("a\n…\nc\n", "a\nc\n", True),
        ("a\n…\nc\n", "a\nb\nb\nc\n", True),
        ("a\n…\nc\n", "a\nb\n", False),
        ("a … c\n", "a b c\n", True),
        ("a … c\n", "a b\nc\n", False),
        ("a.c\n", "abc\n", False),
    ],
)
def test_an_ellipsis_stands_for_lines_or_for_words(expected: str, actual: str, agree: bool) -> None:
    assert agrees(expected, actual) is agree


def test_an_exit_status_is_part_of_the_output(tmp_path: Path) -> None:
    text = page("").replace("check small.mission", "check absent.mission")
    assert "[exit status 2]\n```" in play(text, tmp_path)


def test_nothing_but_missionc_is_run(tmp_path: Path) -> None:
    with pytest.raises(AssertionError, match="only missionc is run here, not `rm`"):
        play("```console\n$ rm -rf build\n```\n", tmp_path)

"""Missions as large as the limits let them be: work grows with the text, and what is printed has an end."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from types import FrameType

import pytest

from missionc.base.source import Source
from missionc.compiler.front_end import check
from missionc.frontend.explain.explanation import document, explained, lines
from missionc.frontend.explain.sentences import LONGEST, MOST_PARTS
from tests.support.resolved_missions import mission
from tests.support.small_missions import SMALL

MORE_THAN_LINEAR = 3.0
"""Of the work for twice as much; what looks at all pairs does four times as much."""


def calls(work: Callable[[], object]) -> int:
    """How many functions are called, those of the interpreter included."""
    count = 0

    def note(frame: FrameType, event: str, argument: object) -> None:
        nonlocal count
        count += event in ("call", "c_call")

    sys.setprofile(note)
    try:
        work()
    finally:
        sys.setprofile(None)
    return count


def checks(text: str) -> int:
    return calls(lambda: check(Source("a.mission", text)))


def crowd(agents: int) -> str:
    """Every start lies in each of three obstacles."""
    obstacles = [f"obstacle o{n} = polygon (0, 0), (4, 0), (4, 4), (2, {3 + n / 10}), (0, 4)" for n in range(3)]
    team = SMALL.replace("drone[2]", f"drone[{agents}]").replace("start    in base", "start grid (0.1, 0.1) to (3, 1)")
    return "\n".join([team.replace("radius   0.1 m", "radius 0.001 m"), *obstacles])


def unknown(names: int) -> str:
    return f"{SMALL}require a: every drone: ({' or '.join(f'unknown_{n}' for n in range(names))})\n"


def chains(requirements: int) -> str:
    """Each requirement speaks of a hundred formulas with names."""
    lets = [f"let b{n + 1} = (b{n} or not base or goal) and (goal or base)" for n in range(100)]
    asked = [f"require a{n}: every drone: always[0, 2 s] b{100 - n % 3}" for n in range(requirements)]
    return "\n".join([SMALL, "let b0 = base and goal", *lets, *asked, ""])


def linked(size: int) -> str:
    """As many requirements as agents, each about all of them."""
    asked = [f"require a{n}: always[0, {n + 1} s] connected(radio)" for n in range(size)]
    return "\n".join([large_team(size), "graph radio = proximity 1 m", *asked, ""])


def formed(size: int) -> str:
    """As many requirements as agents, each about all of them, and all broken at the start."""
    asked = [f"require a{n}: always[0, {n + 1} s] row" for n in range(size)]
    return "\n".join([large_team(size), "formation row = chain of drone spacing 0.8 m tolerance 1 mm", *asked, ""])


def large_team(size: int) -> str:
    team = SMALL.replace("drone[2]", f"drone[{size}]").replace("start    in base", "start grid (0.1, 0.1) to (3, 1)")
    return team.replace("radius   0.1 m", "radius 0.001 m").replace("horizon 6 s", f"horizon {size + 2} s")


@pytest.mark.parametrize(("text", "size"), [(crowd, 400), (unknown, 500), (linked, 400), (formed, 400)])
def test_a_check_of_twice_as_much_is_twice_the_work(text: Callable[[int], str], size: int) -> None:
    checks(text(10))  # what is worked out once
    assert checks(text(2 * size)) < MORE_THAN_LINEAR * checks(text(size))


@pytest.mark.parametrize("requirements", [150, 300])
def test_a_page_about_many_long_formulas_has_an_end_and_says_what_it_leaves_out(requirements: int) -> None:
    made = mission(chains(requirements))
    parts = explained(made)
    page = "\n".join(lines(parts, made, None, True))
    assert len(page) < 200_000
    left = requirements + 1 - len(parts)
    assert left > 0
    assert f"\n\n{left} more not shown; explain a requirement with `missionc explain FILE NAME`" in page
    assert document(parts, made, None)["goals_left_out"] == left


def test_one_requirement_out_of_many_is_explained_by_its_name() -> None:
    made = mission(chains(150))
    parts = explained(made, "a149")
    (part,) = parts
    assert len(part.said.parts) == MOST_PARTS
    assert part.said.left_out > 0
    assert "more not shown" not in "\n".join(lines(parts, made, None, True))


def test_a_sentence_that_would_fill_pages_is_cut_and_says_by_how_much() -> None:
    text = f"{SMALL}let c = (not base or goal)\nrequire a: some drone: ({' or '.join(['(c and not base)'] * 2_000)})\n"
    (part,) = explained(mission(text), "a")
    assert len(part.said.whole) < LONGEST + 100
    assert re.search(r" … and \d+,\d{3} more letters\.$", part.said.whole)

"""What the preset `paper` of the roadmap planner refuses, at its place, and leaves out nowhere."""

from __future__ import annotations

import pytest

from missionc.backends.options import Options
from missionc.compiler.check_preset import check_preset
from tests.support.resolved_missions import PARTS, demo, mission

PAPER = Options(preset="paper")
TEAM = PARTS["team"]
RADIO = "region goal = box (7, 7) to (9, 9)\ngraph radio = proximity 2 m"


@pytest.mark.parametrize(
    ("parts", "words"),
    [
        ({"require": "require r: drone[0]: next goal"}, "operator `next`"),
        ({"require": "require r: drone[0]: goal release[0, 2 s] goal"}, "operator `release`"),
        ({"require": "require r: at least 1 drone: eventually[0, 2 s] goal"}, "counting quantifier"),
        (
            {"require": "require r: drone[0]: always[0, 2 s] speed <= 1"},
            "predicate of more than the position of one agent",
        ),
        ({"require": "require r: drone[0]: eventually[0, 2 s] distance(drone[1]) <= 1 m"}, "position of one agent"),
        ({"more": "prefer p: drone[0]: eventually[0, 2 s] goal"}, "preference"),
        ({"more": "minimize distance"}, "`minimize distance`"),
        ({"things": RADIO, "require": "require r: drone[0]: somewhere[distance <= 3 m on radio] goal"}, "in metres"),
        ({"things": RADIO, "require": "require r: always[0, 2 s] connected(radio)"}, "connectivity of a graph"),
        (
            {"things": RADIO, "require": "require r: drone[0]: goal surround[hops 1..1 on radio] goal"},
            "lower bound of `surround`",
        ),
        (
            {"team": TEAM.replace("}", "finish in goal }")},
            "`finish`",
        ),
        (
            {"team": TEAM.replace("single_integrator(", "double_integrator(acceleration <= 1 m/s^2, ")},
            "dynamics with an acceleration limit",
        ),
    ],
)
def test_what_the_paper_lacks_is_refused_at_its_place(parts: dict[str, str], words: str) -> None:
    (finding,) = {each.message: each for each in check_preset(mission(demo(**parts)), PAPER)}.values()
    assert finding.code.name == "MC563"
    assert words in finding.message
    assert finding.primary is not None
    assert "without `--preset paper`" in finding.help


@pytest.mark.parametrize(
    ("options", "flag"),
    [
        (Options(preset="paper", certify=True), "--certify"),
        (Options(preset="paper", solver="cadical"), "--solver"),
        (Options(preset="paper", margin=0.1), "--margin"),
        (Options(preset="paper", samples=3), "--samples"),
        (Options(preset="paper", captures=frozenset({"smt2"})), "--emit"),
    ],
)
def test_a_flag_that_would_change_nothing_is_refused(options: Options, flag: str) -> None:
    (finding,) = check_preset(mission(demo()), options)
    assert f"`{flag}`" in finding.message
    assert check_preset(mission(demo()), PAPER, alternatives=2)
    assert not check_preset(mission(demo()), PAPER)


def test_what_the_paper_has_is_admitted() -> None:
    text = demo(
        things=f"{RADIO}\nbeacon mast = (5, 5)\ngraph cell = beacons 3 m",
        require="require r: every drone: not (goal until[0, 2 s] (goal reach[hops 1..1 on cell] goal)) implies "
        "always[0, 2 s] (escape[hops 0..1 on radio] goal or everywhere[hops 0..1 on radio] goal or "
        "goal surround[hops 0..1 on radio] drone)",
    )
    assert not check_preset(mission(text), PAPER)

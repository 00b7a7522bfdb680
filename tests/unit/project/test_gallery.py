"""The gallery: each mission reads well alone, together they use all of the language, and the page is made of them."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from typing import get_args

import pytest

from docs.gallery import PAGE, PICTURES, files, opening, page
from missionc import ir
from missionc.base.limits import Limits
from missionc.base.source import Source
from missionc.compiler import driver
from missionc.frontend.explain.explanation import traps_of
from missionc.frontend.syntax.build import FORMATIONS
from missionc.frontend.syntax.format import format_mission
from missionc.frontend.syntax.parse import parse
from missionc.frontend.syntax.read_file import unread
from missionc.ir.dynamics import DYNAMICS
from missionc.ir.language.operators import OPERATORS
from missionc.ir.language.predicates import PREDICATES
from missionc.ir.language.walk_formulas import formulas_bottom_up, goals

FILES = files()
EMPTY_WORDS = {"escape without a lower bound", "zero hops", "count includes the agent itself"}
"""Traps in which a formula says less than it seems to."""

SHAPES = {ir.Box, ir.Disc, ir.Polygon, ir.Ball, ir.Union, ir.Intersection, ir.Difference}

SMALL = 40_000
"""Bytes of a picture."""


def title(path: Path) -> str:
    return path.stem


@cache
def mission_of(path: Path) -> ir.Mission:
    checked = driver.check(path)
    assert [finding.message for finding in checked.findings] == []
    assert checked.mission is not None
    return checked.mission


def formulas() -> list[ir.Formula]:
    return [
        formula for path in FILES for formula in formulas_bottom_up(goal.formula for goal in goals(mission_of(path)))
    ]


def test_a_mission_has_no_finding_and_the_name_of_its_file(subtests: pytest.Subtests) -> None:
    for path in FILES:
        with subtests.test(title(path)):
            assert mission_of(path).name == path.stem


def test_a_mission_is_in_the_one_layout(subtests: pytest.Subtests) -> None:
    for path in FILES:
        with subtests.test(title(path)):
            source = Source(path.name, path.read_text(encoding="utf-8"))
            program, _ = parse(source, Limits(), unread)
            assert program is not None
            assert format_mission(source, program, Limits()) == source.text


def test_a_mission_opens_with_a_few_lines_on_its_situation(subtests: pytest.Subtests) -> None:
    for path in FILES:
        with subtests.test(title(path)):
            text = path.read_text(encoding="utf-8")
            lines = text[: text.index("\nmission ")].splitlines()
            assert 2 <= len(lines) <= 5
            assert all(line.startswith("# ") and len(line) <= 120 for line in lines)
            assert opening(text).endswith(".")


def test_no_requirement_says_less_than_it_seems_to(subtests: pytest.Subtests) -> None:
    for path in FILES:
        with subtests.test(title(path)):
            for goal in goals(mission_of(path)):
                traps = {trap.name for trap in traps_of(goal.formula)}
                assert not traps & EMPTY_WORDS
                if "surround without neighbours" in traps:
                    # Surrounded by nobody is surrounded, too: somebody is asked for as well.
                    words = {
                        each.operator.name for each in formulas_bottom_up([goal.formula]) if isinstance(each, ir.Apply)
                    }
                    assert words & {"count", "somewhere"}


def test_every_operator_is_used() -> None:
    used = {formula.operator.name for formula in formulas() if isinstance(formula, ir.Apply)}
    assert used == {operator.name for operator in OPERATORS}


def test_every_predicate_is_used() -> None:
    assert {name for formula in formulas() for name in predicate(formula)} == {each.name for each in PREDICATES}


def predicate(formula: ir.Formula) -> list[str]:
    """Its name in the table of predicates, of a formula that is one."""
    match formula:
        case ir.Belongs():
            return ["member"]
        case ir.Holds(ir.Inside(body=body)):
            return ["inside" if body else "region"]
        case ir.Holds(ir.Touches()):
            return ["touches"]
        case ir.Holds(ir.Compare()):
            return ["compare"]
        case ir.Holds(ir.Connected()):
            return ["connected"]
        case ir.Holds(ir.InFormation()):
            return ["formation"]
        case ir.Holds(ir.Flagged()):
            return ["flag"]
        case ir.Holds(ir.Facing()):
            return ["heading"]
        case _:
            return []


def test_every_feature_of_a_state_is_compared() -> None:
    compared = [formula.predicate for formula in formulas() if isinstance(formula, ir.Holds)]
    used = {type(feature) for each in compared if isinstance(each, ir.Compare) for _, feature in each.terms}
    assert used == set(get_args(ir.Feature))


def test_every_formation_graph_and_kind_of_dynamics_is_used() -> None:
    missions = [mission_of(path) for path in FILES]
    assert {formation.kind for each in missions for formation in each.formations} == set(FORMATIONS)
    assert {type(graph) for each in missions for graph in each.graphs} == set(get_args(ir.Graph))
    assert {type(agent.dynamics) for each in missions for agent in each.agents} == set(DYNAMICS)


def test_every_shape_is_used_and_obstacles_move_in_both_ways_and_grow() -> None:
    missions = [mission_of(path) for path in FILES]
    things = [thing for each in missions for thing in (*each.regions, *each.obstacles)]
    assert {type(part) for thing in things for part in parts(thing.shape)} == SHAPES
    text = "".join(path.read_text(encoding="utf-8") for path in FILES)
    assert re.search(r"^obstacle .* moving \(", text, re.MULTILINE)
    assert re.search(r"^obstacle .* along \(", text, re.MULTILINE)
    assert re.search(r"^obstacle .* uncertain ", text, re.MULTILINE)
    assert any(each.tolerances for each in missions)


def parts(shape: ir.Shape) -> list[ir.Shape]:
    match shape:
        case ir.Union(left, right) | ir.Intersection(left, right) | ir.Difference(left, right):
            return [shape, *parts(left), *parts(right)]
        case _:
            return [shape]


def test_planes_and_volumes_vehicles_parameters_preferences_and_every_objective_are_there() -> None:
    missions = [mission_of(path) for path in FILES]
    assert {each.dimension for each in missions} == {2, 3}
    assert {each.objective for each in missions} == set(ir.Objective)
    assert any(agent.vehicle is not ir.PLAIN for each in missions for agent in each.agents)
    assert any(each.preferences for each in missions)
    text = "".join(path.read_text(encoding="utf-8") for path in FILES)
    assert re.search(r"^param ", text, re.MULTILINE)
    assert re.search(r"^group ", text, re.MULTILINE)


@pytest.mark.parametrize("unit", ["cm", "m", "km", "s", "min", "deg", "m/s", "m/s^2", "deg/s"])
def test_a_unit_is_used(unit: str) -> None:
    text = "".join(path.read_text(encoding="utf-8") for path in FILES)
    assert re.search(rf"[0-9] {re.escape(unit)}(?![\w/^])", text)


def test_both_ways_of_planning_and_their_union_are_there() -> None:
    chosen = [driver.check(path).choice for path in FILES]
    assert len(FILES) >= 20
    backends = [choice.backend for choice in chosen if choice]
    assert min(backends.count("smt"), backends.count("clot")) >= 8
    assert "hybrid" in backends


def test_the_page_is_what_the_missions_say() -> None:
    assert PAGE.read_text(encoding="utf-8") == page(FILES), "`make gallery` writes it anew"


def test_every_mission_has_a_picture_and_every_picture_a_mission() -> None:
    pictures = sorted(PICTURES.iterdir())
    assert [path.stem for path in pictures] == [path.stem for path in FILES], "`make gallery` draws them"
    assert [path.name for path in pictures if path.stat().st_size >= SMALL] == []

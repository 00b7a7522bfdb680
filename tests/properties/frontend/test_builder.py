"""Missions built in Python: the same text, the same meaning and the same plan as missions written as text."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import Phase, assume, given, settings
from hypothesis import strategies as st

import missionc
from missionc.base.limits import Limits
from missionc.base.source import Source, Span
from missionc.frontend.builder.mission import Mission, read_declarations
from missionc.frontend.resolve.show_ir import show_ir
from missionc.frontend.syntax import ast
from missionc.frontend.syntax.format import format_mission
from missionc.frontend.syntax.show_tree import formula, show
from tests.support import rebuilt_missions
from tests.support.random_trees import NOWHERE, declarations, formulas, without_spans
from tests.support.rebuilt_missions import ordered, rebuilt
from tests.support.small_missions import SMALL

NAME = ast.MissionName(NOWHERE, ast.Name(NOWHERE, "made"))

WITHOUT_SHRINKING = (Phase.explicit, Phase.reuse, Phase.generate)
"""Smaller trees take minutes to find, and show no more."""


def canonical(program: ast.Program) -> str:
    """The text of a tree as ``missionc fmt`` lays it out."""
    source = Source("a.mission", show(program))
    return format_mission(source, parsed(source.text), Limits())


def parsed(text: str) -> ast.Program:
    source = Source("a.mission", text)
    return ast.Program(Span(source, 0, len(text)), tuple(read_declarations(source)))


def nested_chain(node: object) -> bool:
    """Whether a chain begins with a chain of the same operator, which Python writes as one: ``a & b & c``."""
    match node:
        case ast.Apply(operator="and" | "or" as word, operands=(ast.Apply(operator=first), *_)) if first == word:
            return True
        case ast.Apply(operands=operands):
            return any(map(nested_chain, operands))
        case ast.Quantified(body=body) | ast.OneAgent(body=body) | ast.ForEach(body=body):
            return nested_chain(body)
        case _:
            return False


@given(formulas)
@settings(max_examples=25, phases=WITHOUT_SHRINKING)
def test_a_formula_built_with_operators_of_python_prints_the_same_text(tree: ast.Formula) -> None:
    assume(not nested_chain(tree))
    assert str(rebuilt_missions.formula(tree)) == formula(tree)


@given(st.lists(declarations, min_size=1, max_size=4))
@settings(max_examples=15, phases=WITHOUT_SHRINKING)
def test_declarations_built_by_methods_print_the_same_text(listed: list[ast.Declaration]) -> None:
    kept = [ordered(each) for each in listed if not isinstance(each, ast.MissionName)]
    assume(not any(nested_chain(getattr(each, "body", None)) for each in kept))
    program = ast.Program(NOWHERE, (NAME, *kept))
    mission = rebuilt(program)
    assert str(mission) == canonical(program)
    assert without_spans(Mission.from_text(str(mission)).declarations) == without_spans(mission.declarations)


def test_the_missions_of_the_repository_print_the_same_text_when_built_in_python(missions: Path) -> None:
    for path in sorted(missions.glob("*.mission")):
        program = parsed(path.read_text(encoding="utf-8"))
        if any(isinstance(each, ast.MissionName) for each in program.declarations):
            first = sorted(program.declarations, key=lambda each: not isinstance(each, ast.MissionName))
            program = replace(program, declarations=tuple(map(ordered, first)))
            assert str(rebuilt(program)) == canonical(program), path


@pytest.mark.parametrize("name", ["wildfire", "strel_goal"])
def test_a_mission_built_in_python_means_the_same(name: str, missions: Path) -> None:
    path = missions / f"{name}.mission"
    written = missionc.check(path)
    built = missionc.check(rebuilt(parsed(path.read_text(encoding="utf-8"))))
    assert written.mission is not None
    assert built.mission is not None
    assert show_ir(built.mission) == show_ir(written.mission)


def test_a_mission_built_in_python_has_the_same_plan() -> None:
    written = missionc.compile(Source("small.mission", SMALL), seed=3)
    built = missionc.compile(rebuilt(parsed(SMALL)), seed=3)
    assert built.word == written.word
    assert built.files["plan.json"] == written.files["plan.json"]

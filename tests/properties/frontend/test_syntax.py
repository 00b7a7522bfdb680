"""Texts and trees are two forms of one thing, and no text breaks the parser."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from hypothesis import given

from missionc.base.diagnostics.model import Diagnostic
from missionc.base.limits import Limits
from missionc.base.source import Source, Span
from missionc.frontend.syntax import ast
from missionc.frontend.syntax.parse import parse
from missionc.frontend.syntax.show_tree import show
from tests.support.random_trees import formulas, mutated, programs, without_spans

MUTATIONS = int(os.environ.get("MISSIONC_FUZZ", "200"))


def nothing_to_include(path: str, span: Span, *, data: bool = False) -> Source:
    return Source(path, "", b"" if data else None)


def read(text: str) -> tuple[ast.Program | None, list[Diagnostic]]:
    return parse(Source("test.mission", text), Limits(), nothing_to_include)


@given(programs)
def test_the_text_of_a_tree_is_read_as_the_same_tree(program: ast.Program) -> None:
    again, findings = read(show(program))
    assert [finding.message for finding in findings] == []
    assert again is not None
    assert without_spans(again.declarations) == without_spans(program.declarations)


@given(formulas)
def test_a_formula_keeps_its_shape_through_its_text(formula: ast.Formula) -> None:
    declaration = ast.Let(formula.span, ast.Name(formula.span, "f"), formula)
    again, findings = read(show(ast.Program(formula.span, (declaration,))))
    assert [finding.message for finding in findings] == []
    assert again is not None
    assert without_spans(again.declarations) == without_spans((declaration,))


def test_the_text_of_every_mission_is_read_as_the_same_tree(missions: Path) -> None:
    for path in sorted(missions.glob("*.mission")):
        program, findings = read(path.read_text(encoding="utf-8"))
        assert findings == []
        assert program is not None
        again, findings = read(show(program))
        assert findings == []
        assert again is not None
        assert without_spans(again.declarations) == without_spans(program.declarations)


def test_a_spoilt_mission_is_read_or_refused_with_findings_inside_it(missions: Path) -> None:
    texts = [path.read_text(encoding="utf-8") for path in sorted(missions.glob("*.mission"))]
    generator = np.random.default_rng(2)
    refused = 0
    for number in range(MUTATIONS):
        text = mutated(texts[number % len(texts)], generator)
        program, findings = read(text)
        assert (program is None) == bool(findings), text
        refused += bool(findings)
        for finding in findings:
            assert finding.message, text
            assert finding.help, text
            assert finding.primary is not None, text
            for label in (finding.primary, *finding.labels):
                assert 0 <= label.span.start <= label.span.end <= len(label.span.source.text), text
            if finding.fix is not None:
                assert 0 <= finding.fix.span.start <= finding.fix.span.end <= len(text), text
        starts = [finding.primary.span.start for finding in findings if finding.primary]
        assert starts == sorted(starts), text
    assert refused > MUTATIONS // 4

"""Small missions as text, with their findings from resolve."""

from __future__ import annotations

from missionc import ir
from missionc.base.diagnostics import code
from missionc.base.diagnostics.code import Severity
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.limits import Limits
from missionc.base.source import Source
from missionc.frontend.resolve.resolve_mission import resolve
from missionc.frontend.syntax import ast
from missionc.frontend.syntax.parse import parse

PARTS = {
    "mission": "mission demo",
    "time": "time step 1 s, horizon 10 s",
    "world": "world (0, 0) to (10, 10)",
    "things": "region goal = box (7, 7) to (9, 9)",
    "team": "team drone[2] { dynamics single_integrator(speed <= 2 m/s)  start at (1, 1), (2, 1) }",
    "more": "",
    "require": "require arrive: every drone: eventually[0, 10 s] goal",
}
"""Mission that checks without errors, part by part, one line each."""


def demo(**parts: str) -> str:
    """Mission of ``PARTS`` with some of them replaced, or omitted if empty."""
    assert parts.keys() <= PARTS.keys()
    return "\n".join(part for part in {**PARTS, **parts}.values() if part)


def program(text: str) -> ast.Program:
    refuse = Diagnostic(code.INCLUDE_NOT_ALLOWED, "no files here", None)
    parsed, said = parse(Source("demo.mission", text), Limits(), lambda path, span: refuse)
    assert parsed is not None, [f"{finding.code.name}: {finding.message}" for finding in said]
    return parsed


def findings(text: str, overrides: dict[str, str] | None = None, limits: Limits | None = None) -> list[Diagnostic]:
    """Findings of resolve; there is a mission exactly if there is no error."""
    mission, found = resolve(program(text), overrides or {}, limits or Limits())
    errors = [finding for finding in found if finding.severity is Severity.ERROR]
    assert (mission is None) == bool(errors)
    return found


def codes(text: str, overrides: dict[str, str] | None = None, limits: Limits | None = None) -> list[str]:
    return [finding.code.name for finding in findings(text, overrides, limits)]


def texts(text: str) -> list[str]:
    return [finding.message for finding in findings(text)]


def only(text: str, name: str, overrides: dict[str, str] | None = None) -> Diagnostic:
    """Single error of a text, with this code."""
    found = [finding for finding in findings(text, overrides) if finding.severity is Severity.ERROR]
    assert [finding.code.name for finding in found] == [name], [finding.message for finding in found]
    return found[0]


def mission(text: str, overrides: dict[str, str] | None = None) -> ir.Mission:
    """Mission of a text without errors."""
    resolved, found = resolve(program(text), overrides or {}, Limits())
    assert resolved is not None, [f"{finding.code.name}: {finding.message}" for finding in found]
    return resolved

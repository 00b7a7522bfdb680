"""Check of a mission against a preset: parts and flags that the preset's published method does not support.

in   Mission, Options
out  a finding for each
says MC563
"""

from __future__ import annotations

from collections.abc import Iterator

from missionc.backends.choose_backend import needs
from missionc.backends.features import Feature
from missionc.backends.options import SOLVERS, Options
from missionc.base.diagnostics.code import NOT_PUBLISHED
from missionc.base.diagnostics.model import Diagnostic, Label
from missionc.base.source import Span
from missionc.ir import Apply, AtLeastOf, Formula, Holds, Length, Mission, Sight, Without
from missionc.ir.agents import PLAIN
from missionc.ir.language.walk_formulas import formulas, operator_words

FEATURES = frozenset({Feature.HOPS, Feature.VOLUME, Feature.UNICYCLE, Feature.LEAST_SPEED})
"""Features that the method of [strel] supports."""

OPERATORS = {
    *("not", "and", "or", "implies", "eventually", "always", "until"),
    *("reach", "escape", "somewhere", "everywhere", "surround"),
}
"""Names of the operators that the method of [strel] supports, including derived ones; [strel] Definition 4."""


def check_preset(mission: Mission, options: Options, alternatives: int = 1) -> list[Diagnostic]:
    """Findings on parts of a mission that the preset `paper` of the roadmap planner cannot express as published."""
    return [*_flags(options, alternatives), *(_cannot(options, what, span) for what, span in _parts(mission))]


def _parts(mission: Mission) -> Iterator[tuple[str, Span]]:
    for need in needs(mission):
        if need.feature not in FEATURES:
            yield need.feature.value, need.span
    for agent in mission.agents:
        if agent.finish is not None:
            yield "a `finish`", agent.finish.span
        if agent.vehicle is not PLAIN:
            yield "a vehicle", agent.span
        if agent.begins or agent.course:
            yield "an agent in motion at the start", agent.span
    for formula in formulas(mission):
        lacking = _lacking(formula)
        if lacking:
            yield lacking, operator_words(formula) if isinstance(formula, Apply) else formula.span


def _lacking(formula: Formula) -> str:
    """Text for the unsupported part of one formula, without its subformulas; empty if the formula is supported."""
    match formula:
        case Apply(operator) if operator.name not in OPERATORS:
            return f"the operator `{operator.name}`"
        case Apply(operator, bounds=Length() as length):
            if isinstance(length.graph, Sight):
                return "a `sight` graph"
            if length.graph.ranges:
                return "a graph with different ranges"
            if length.weight is not None:
                return "a route length in a weight"
            return "a lower bound of `surround`" if operator.name == "surround" and length.low > 0 else ""
        case AtLeastOf(kind) if kind not in ("every", "some"):
            return "a counting quantifier"
        case Without():
            return "a `without` quantifier"
        case Holds(predicate) if predicate.graph or predicate.formation:
            return ""  # ``needs`` has it
        case Holds(predicate) if predicate.reads_speed or predicate.others:
            return "a predicate of more than the position of one agent"
        case _:
            return ""


def _flags(options: Options, alternatives: int) -> Iterator[Diagnostic]:
    given = {
        "--solver": options.solver not in SOLVERS[:2],
        "--certify": options.certify,
        "--emit": bool(options.captures),
        "--margin": bool(options.margin),
        "--samples": options.samples is not None,
        "--alternatives": alternatives > 1,
    }
    for flag in (name for name, wrong in given.items() if wrong):
        yield Diagnostic(
            NOT_PUBLISHED,
            f"`--preset {options.preset}` of smt does not support `{flag}`",
            None,
            notes=("the preset solves the encoding of the paper once",),
            help=f"delete `{flag}`",
        )


def _cannot(options: Options, what: str, span: Span) -> Diagnostic:
    return Diagnostic(
        NOT_PUBLISHED,
        f"the preset `{options.preset}` of smt cannot express {what}",
        Label(span),
        help=f"plan without `--preset {options.preset}`",
    )

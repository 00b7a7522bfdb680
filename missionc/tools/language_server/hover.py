"""Hover text: the sentence of a requirement, the declaration of a name, or the meaning of a word.

Inlay hints: the horizon of each requirement and named formula, shown after it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from lsprotocol import types

from missionc.base.source import Span
from missionc.base.trace import counted
from missionc.frontend.checks.check_horizons import steps_ahead
from missionc.frontend.explain.explanation import explained, of_family
from missionc.frontend.resolve.context import Context, collect
from missionc.frontend.resolve.resolve_files import file_lines
from missionc.frontend.resolve.resolve_quantities import POWERS, SI, is_reported, resolve_parameters, shown
from missionc.frontend.resolve.show_ir import show_vehicle
from missionc.frontend.syntax import ast
from missionc.frontend.syntax.parse import passages
from missionc.frontend.syntax.tokens import Token, tokenise
from missionc.ir import Mission, Preference, Requirement
from missionc.ir.language.walk_formulas import goals
from missionc.ir.wording import seconds
from missionc.tools.language_server.open_text import LIMITS, Name, OpenText
from missionc.tools.language_server.word_help import meaning


def hints(text: OpenText, wanted: types.Range) -> list[types.InlayHint]:
    """Inlay hints in a range, for formulas that are unchanged since the last valid version."""
    mission = text.mission
    if mission is None:
        return []
    known = horizons(mission)
    hints = []
    for place, words in _formulas(text):
        position = text.places.position(place)
        says = known.get(words)
        if says and wanted.start.line <= position.line <= wanted.end.line:
            hints.append(types.InlayHint(position, says, padding_left=True))
    return hints


def horizons(mission: Mission) -> dict[str, str]:
    """Hint ``horizon 16 s`` by the text of a formula; formulas without temporal operators have none."""
    formulas = [*(goal.formula for goal in goals(mission)), *(formula for _, formula in mission.lets)]
    looks = steps_ahead(formulas)
    totals: dict[str, list[float]] = {}
    for formula in formulas:
        totals.setdefault(formula.span.text, []).append(looks[formula].total)
    return {text: _label(mission, steps) for text, steps in totals.items() if max(steps) > 0}


def horizon(mission: Mission, steps: float) -> str:
    return "unbounded" if math.isinf(steps) else seconds(mission, steps)


def _label(mission: Mission, steps: list[float]) -> str:
    """Hint for one formula, or for one text with several values of an index.

    Args:
        mission: mission of the formula.
        steps: horizon of each formula with this text, in steps.
    """
    most = horizon(mission, max(steps))
    return f"horizon {most}" if min(steps) == max(steps) else f"horizon at most {most}"


def _formulas(text: OpenText) -> Iterator[tuple[int, str]]:
    """Yield the end offset of each declaration with a formula in this file, and the formula's text."""
    for declaration in text.outline.declarations:
        match declaration:
            case ast.Require(body=body) | ast.Prefer(body=body) | ast.Let(body=body):
                if body.span.source.name == text.source.name:
                    yield declaration.span.end, body.span.text


MOST_LINES = 12
"""Maximum number of lines shown of a declaration."""


def hover(text: OpenText, position: types.Position) -> types.Hover | None:
    offset = text.places.offset(position)
    name = text.outline.at(offset)
    if name is not None and (markdown := _of_name(text, name)):
        return _hover(text, markdown, name.span)
    before, token = _token(text, offset)
    if token is None:
        return None
    markdown = _of_file(text.mission, token) or meaning(token, before)
    if token.word in ("require", "prefer") and (goal := _goal(text, offset)):
        markdown = f"{goal}\n\n---\n\n{markdown}"
    return _hover(text, markdown, token.span) if markdown else None


def _hover(text: OpenText, markdown: str, span: Span) -> types.Hover:
    return types.Hover(types.MarkupContent(types.MarkupKind.Markdown, markdown), text.places.range(span))


def _token(text: OpenText, offset: int) -> tuple[Token | None, Token | None]:
    """Token at an offset and the one before it; each None if there is none."""
    if len(text.source.text) > LIMITS.file_bytes:
        return None, None
    passage = next(passage for passage in passages(text.source) if offset <= passage.end)
    tokens, _ = tokenise(passage, LIMITS)
    for number, token in enumerate(tokens[:-1]):
        if token.span.start <= offset < token.span.end or (token.span.end == offset and token.text[-1].isalnum()):
            return (tokens[number - 1] if number else None), token
    return None, None


def _of_file(mission: Mission | None, token: Token) -> str:
    """Markdown summary of the file that a quoted token names; empty for any other token."""
    lines = file_lines(mission) if mission and token.text.startswith('"') else []
    return "\n".join(f"- {line}" for line in lines if line.startswith(f"{token.text[1:-1]}: "))


def _of_name(text: OpenText, name: Name) -> str:
    if name.label:
        return _goal(text, name.span.start) or f"`{name.text}`: a requirement"
    if name.index is not None:
        return f"`{name.text}`: an index, a whole number"
    declared = text.outline.declared.get(name.text)
    if declared is None or declared[0].kind is None:
        return f"unknown name `{name.text}`"
    where, declaration = declared
    of = "a family, each member " if declaration is not None and isinstance(declaration.name, ast.FamilyName) else ""
    paragraphs = [f"`{name.text}`: {of}{declared[0].kind.value}"]
    match declaration:
        case ast.Param():
            paragraphs[0] += _value(text, name.text)
        case ast.Let():
            paragraphs += _horizon(text.mission, name.text, declaration.body.span.text)
        case ast.Team():
            paragraphs += _flown(text.mission, name.text)
        case _:
            pass
    if where.span.source.name != text.source.name:
        paragraphs.append(f"declared in `{where.span.source.name}`")
    if declaration is not None:
        paragraphs.append(_written(declaration.span))
    return "\n\n".join(paragraphs)


def _written(span: Span) -> str:
    lines = span.text.splitlines()
    more = ["…"] if len(lines) > MOST_LINES else []
    return "\n".join(["```mission", *lines[:MOST_LINES], *more, "```"])


def _value(text: OpenText, name: str) -> str:
    """Value of a parameter in SI units as text; empty if it has none."""
    program = ast.Program(Span(text.source, 0, 0), text.outline.declarations)
    context = Context(collect(program, []), LIMITS, [])
    resolve_parameters(context, {})
    amount = context.params.get(name)
    if amount is None or is_reported(amount):
        return ""
    unit = next((SI[dimension] for dimension, powers in POWERS.items() if powers == amount.powers), "")
    return f", {shown(amount.constant)}{unit}"


def _horizon(mission: Mission | None, name: str, written: str) -> list[str]:
    formula = dict(mission.lets).get(name) if mission else None
    if mission is None or formula is None or formula.span.text != written:
        return []
    total = steps_ahead([formula])[formula].total
    return [f"Horizon: {horizon(mission, total)}."]


def _flown(mission: Mission | None, name: str) -> list[str]:
    agents = [agent for agent in mission.agents if agent.team.partition("[")[0] == name] if mission else []
    if not agents:
        return []
    count = counted(len(agents), "agent")
    vehicle = agents[0].vehicle
    return [f"{count}, vehicle {show_vehicle(vehicle)}." if vehicle.name != "plain" else f"{count}."]


def _goal(text: OpenText, offset: int) -> str:
    """Sentence of the requirement or preference at an offset; empty if it was changed since the last valid version."""
    mission = text.mission
    here = next(
        (
            each
            for each in text.outline.declarations
            if isinstance(each, ast.Require | ast.Prefer)
            and each.span.source.name == text.source.name
            and each.span.start <= offset <= each.span.end
        ),
        None,
    )
    if mission is None or here is None:
        return ""
    alike = [goal for goal in goals(mission) if goal.formula.span.text == here.body.span.text]
    same_label = [goal for goal in alike if here.label is None or goal.name.partition("[")[0] == here.label.text]
    return _said(mission, same_label) if same_label else ""


def _said(mission: Mission, same_label: list[Requirement | Preference]) -> str:
    """Sentence for a requirement or preference, or for all members of a family."""
    parts = tuple(next(part for part in explained(mission, goal.name)) for goal in same_label)
    part = (of_family(parts) or parts)[0]
    word = "a requirement" if part.weight is None else "a preference"
    paragraphs = [f"`{part.name}`: {word}", part.said.whole]
    paragraphs += [f"- {more.sentence}" for more in part.said.parts]
    paragraphs += [f"- {thing}." for thing in part.things]
    if part.needed > 0:
        paragraphs.append(f"Horizon: {horizon(mission, part.needed)}.")
    return "\n\n".join(paragraphs)

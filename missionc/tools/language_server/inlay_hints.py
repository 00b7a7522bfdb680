"""Inlay hints: the horizon of each requirement and named formula, shown after it."""

from __future__ import annotations

import math
from collections.abc import Iterator

from lsprotocol import types

from missionc.frontend.checks.check_horizons import steps_ahead
from missionc.frontend.syntax import ast
from missionc.ir import Mission
from missionc.ir.language.walk_formulas import goals
from missionc.ir.wording import seconds
from missionc.tools.language_server.open_text import OpenText


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

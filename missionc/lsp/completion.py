"""Completion: the keywords, names, units and settings that fit next, by the grammar.

Kinds and settings are the language's own tables, so that a new one needs nothing here.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

from lsprotocol import types

from missionc import ir
from missionc.base.source import Span
from missionc.data.vehicles import profiles
from missionc.language.predicates import CALLED
from missionc.lsp.completion_context import Spot, spot
from missionc.lsp.open_text import LIMITS, OpenText
from missionc.lsp.unit_completion import fitting_units
from missionc.lsp.word_help import meaning
from missionc.resolve.names import AGENTS, STATE_WORDS, Kind
from missionc.resolve.resolve_dynamics import SETTINGS as DYNAMICS
from missionc.resolve.resolve_formations import SETTINGS as FORMATIONS
from missionc.resolve.resolve_formulas import FORMULAS
from missionc.resolve.resolve_goals import BACKENDS, CONNECTIVITY, OPTIONS, ROADMAP
from missionc.resolve.resolve_resources import MARKS, RATES
from missionc.syntax.tokens import DECLARATIONS, EXTREME, NAME, NUMBER, PLURALS, UNIT, WORDS, Token

ARGUMENTS: dict[str, tuple[Kind, ...]] = {
    **{name: (Kind[predicate.parameters[0].upper()],) for name, predicate in CALLED.items()},
    "distance": (Kind.REGION, Kind.BEACON, *AGENTS),
}
"""What each word that takes brackets is asked of."""

ICONS = {
    "a declaration": types.CompletionItemKind.Keyword,
    "an operator": types.CompletionItemKind.Operator,
    "a shape": types.CompletionItemKind.Class,
}


@dataclass(frozen=True, slots=True)
class Fit:
    """A word that fits; ``order`` sorts names before words before units."""

    word: str
    says: str
    icon: types.CompletionItemKind
    order: int = 0


def completion(text: OpenText, position: types.Position) -> list[types.CompletionItem]:
    offset = text.places.offset(position)
    place = spot(text.source, offset, LIMITS)
    if place is None:
        return []
    written = text.places.between(place.start, offset)
    fits = {fit.word: fit for fit in (*_keywords(place), *_units(place), *_names(text, place))}
    return [
        types.CompletionItem(
            label=fit.word,
            kind=fit.icon,
            detail=fit.says,
            documentation=_documentation(fit, place),
            sort_text=f"{fit.order}{fit.word}",
            text_edit=types.TextEdit(written, fit.word),
        )
        for fit in fits.values()
    ]


def _documentation(fit: Fit, place: Spot) -> types.MarkupContent | None:
    if not fit.order:
        return None
    word = next((known for known in WORDS if known.text == fit.word), None)
    nowhere = place.before.span if place.taken else None
    if word is None or nowhere is None:
        return None
    markdown = meaning(Token(word.token or word.text, word.text, Span(nowhere.source, 0, 0), word.text))
    return types.MarkupContent(types.MarkupKind.Markdown, markdown) if markdown else None


def _keywords(place: Spot) -> Iterator[Fit]:
    for word in WORDS:
        declares = word.text in DECLARATIONS or (word.text in PLURALS and place.declares)
        fits = place.declares if declares else bool(place.taken) and (word.token or word.text) in place.expected
        if fits:
            yield Fit(word.text, word.says, ICONS.get(word.says, types.CompletionItemKind.Keyword), 1)


def _units(place: Spot) -> Iterator[Fit]:
    if place.taken and UNIT in place.expected:
        for unit, says in fitting_units(place):
            yield Fit(unit, says, types.CompletionItemKind.Unit, 2)


def _names(text: OpenText, place: Spot) -> Iterator[Fit]:
    if not place.taken or NAME not in place.expected:
        return
    mine = {token.span.start for token in place.taken[:2]}
    for name in text.outline.of_kind(*_kinds(place)):
        if name.kind is not None and name.span.start not in mine:
            yield Fit(name.text, name.kind.value, types.CompletionItemKind.Variable)
    for word, says in (*_words(place), *_indices(place)):
        yield Fit(word, says, types.CompletionItemKind.Property)


def _indices(place: Spot) -> Iterator[tuple[str, str]]:
    """The indices that have been named so far, and what takes numbers in brackets, where a number may stand."""
    if NUMBER not in place.expected or place.before.kind == "every":
        return
    for name, word in pairwise(place.taken):
        if name.kind == NAME and word.kind == "in":
            yield name.text, "an index"
    if EXTREME in place.expected:
        yield "min", "the least of some numbers"
        yield "max", "the greatest of some numbers"


def _kinds(place: Spot) -> tuple[Kind, ...]:
    """The kinds of name that fit; none where a name is declared or is a word of a table."""
    before, opener, expected = place.before, place.opener(), place.expected
    counted = len(place.taken) > 2 and place.taken[-2].word in ("least", "any")
    listed = place.taken[0].word == "group" and before.kind in ("=", ",") and not place.bracket
    if place.bracket == "(" and opener is not None and opener.text in ARGUMENTS:
        further = opener.text == "connected" and before.kind == ","
        return AGENTS if further else ARGUMENTS[opener.text]
    if before.word == "on":
        return (Kind.GRAPH,)
    if before.word == "in" and NUMBER not in expected:
        return (Kind.REGION,)
    ranged = place.bracket == "{" and place.taken[0].word == "graph" and before.text in ("{", ",", "to")
    if before.word == "of" and place.asks_heading:
        return (Kind.PARAM, Kind.BEACON)
    if before.word in ("of", "over", "some") or counted or listed or ranged:
        return AGENTS
    if before.word == "every":
        return (*AGENTS, Kind.PARAM)
    if "box" in expected:
        return (Kind.REGION,)
    if "PREFIX" in expected:
        return (*FORMULAS, Kind.RESOURCE, Kind.PARAM)
    return (Kind.PARAM,) if NUMBER in expected else ()


def _words(place: Spot) -> Iterator[tuple[str, str]]:
    """Names that are the language's own, and what they are."""
    before, opener, first = place.before, place.opener(), place.taken[0].word
    head = place.opener(2)
    if before.word == "vehicle":
        yield from ((name, "a vehicle") for name in profiles())
    elif before.word == "dynamics":
        yield from ((name, "a kind of dynamics") for name in DYNAMICS)
    elif before.word in ("start", "finish"):
        yield from ((name, "how places are given") for name in ("line", "grid"))
    elif before.word == "with" and first == "solve":
        yield from ((name, "a backend") for name in BACKENDS)
    elif before.word == "minimize":
        yield from ((goal.value, "a goal") for goal in ir.Objective if goal is not ir.Objective.NONE)
    elif before.kind == "=" and first == "formation":
        yield from ((name, "a kind of formation") for name in FORMATIONS)
    elif place.bracket == "(" and head is not None and head.word == "dynamics" and opener is not None:
        yield from ((name, "a bound") for name in DYNAMICS.get(opener.text, ()))
    elif place.bracket == "{" and head is not None and head.word == "vehicle":
        yield from ((name, f"{figure.dimension.value} {figure.says}") for name, figure in ir.FIGURES.items())
    elif place.bracket == "{" and opener is not None and opener.word == "flight":
        yield from ((name, f"{figure.dimension.value} {figure.says}") for name, figure in ir.PAD_FIGURES.items())
    elif place.bracket == "{" and first == "solve":
        yield from ((name, "an option") for name in (*OPTIONS, CONNECTIVITY, ROADMAP))
    elif place.bracket == "{" and first == "resource":
        yield from ((name, "a setting") for name in RATES)
    elif place.bracket == "{" and first == "flag":
        yield from ((name, "a setting") for name in MARKS)
    elif "dynamics" in place.expected:
        yield from ((name, "a setting") for name in ("radius", "altitude"))
    elif "total" in place.expected:
        kind = place.taken[3].text
        yield from ((name, "a setting") for name in (*FORMATIONS.get(kind, ()), "tolerance"))
    elif first in ("let", "require", "prefer") and "distance" in place.expected and place.bracket != "[":
        yield from ((name, "a part of an agent's state") for name in STATE_WORDS)
        if "PREFIX" in place.expected:
            yield from ((name, "a predicate") for name in CALLED)

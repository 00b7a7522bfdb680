"""Completion: the keywords, names, units and settings that the grammar allows at a position.

Kinds and settings come from the language's own tables, so a new one needs no change here. The parse table determines
the tokens that may follow those before the cursor in its declaration. Words that are not allowed are skipped, so a
declaration with an error still gets completions. After a number, units are offered.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise

from lsprotocol import types

from missionc import ir
from missionc.backends.registry import AUTO, BACKENDS
from missionc.base.limits import Limits
from missionc.base.source import Source, Span
from missionc.base.units import UNITS, Dimension
from missionc.frontend.resolve.called_predicates import CALLED
from missionc.frontend.resolve.context import AGENTS, STATE_WORDS, Kind
from missionc.frontend.resolve.resolve_agents import settings_of
from missionc.frontend.resolve.resolve_formations import SETTINGS as FORMATIONS
from missionc.frontend.resolve.resolve_formulas import FORMULAS
from missionc.frontend.resolve.resolve_goals import CONNECTIVITY, OPTIONS, ROADMAP
from missionc.frontend.resolve.resolve_graphs import MARKS, RATES
from missionc.frontend.syntax import parse_table
from missionc.frontend.syntax.parse import Machine, feed, passages
from missionc.frontend.syntax.parse_table import END
from missionc.frontend.syntax.tokens import DECLARATIONS, EXTREME, NAME, NUMBER, PLURALS, UNIT, WORDS, Token, tokenise
from missionc.ir import FIGURES, PAD_FIGURES
from missionc.ir.dynamics import KINDS
from missionc.ir.vehicle_profiles import profiles
from missionc.tools.language_server.open_text import LIMITS, OpenText
from missionc.tools.language_server.word_help import meaning

_WORD = re.compile(r"[^\W\d]\w*\Z")
_IN_COMMENT = re.compile(r'(?:[^"#\n]|"[^"\n]*")*(?:#|"[^"\n]*\Z)')
_OPENING, _CLOSING = frozenset("([{"), frozenset(")]}")


@dataclass(frozen=True, slots=True)
class Spot:
    """Grammatical context of a position in a text.

    Args:
        start: offset of the start of the current word; the position itself outside a word.
        taken: tokens of the declaration before it.
        opened: indices in ``taken`` of the open brackets.
        expected: kinds of tokens that the grammar allows next.
        declares: whether a declaration may begin here.
    """

    start: int
    taken: tuple[Token, ...]
    opened: tuple[int, ...]
    expected: frozenset[str]
    declares: bool

    @property
    def before(self) -> Token:
        return self.taken[-1]

    @property
    def bracket(self) -> str:
        """Innermost open bracket; empty outside brackets."""
        return self.taken[self.opened[-1]].kind if self.opened else ""

    @property
    def asks_heading(self) -> bool:
        """Return whether the position is within a heading predicate, after its last `of` or `within`."""
        words = [token.kind for token in self.taken if token.kind in ("heading", "within", "of")]
        return words[-3:] == ["heading", "within", "of"] and self.taken[0].word != "formation"

    def opener(self, back: int = 1) -> Token | None:
        """Token ``back`` tokens before the innermost open bracket; None if there is none."""
        at = self.opened[-1] - back if self.opened else -1
        return self.taken[at] if at >= 0 else None


def spot(source: Source, offset: int, limits: Limits) -> Spot | None:
    """Grammatical context of a position; None in comments and quotes, and for a text that is too large.

    Args:
        source: text of the mission.
        offset: position in characters.
        limits: maximum size of a text.
    """
    text = source.text
    if len(text) > limits.file_bytes:
        return None
    line = text.rfind("\n", 0, offset) + 1
    if _IN_COMMENT.match(text[line:offset]):
        return None
    word = _WORD.search(text, line, offset)
    start = word.start() if word else offset
    begin = next(each.start for each in passages(source) if start < each.end or each.end == len(text))
    tokens, _ = tokenise(Span(source, begin, start), limits)
    return _after(tokens[:-1], start, not text[line:start].strip())


def _after(tokens: list[Token], start: int, starts_line: bool) -> Spot:
    machine = _machine()
    taken: list[Token] = []
    opened: list[int] = []
    for token in tokens:
        if token.declares and taken:
            machine, taken, opened = _machine(), [], []
        if not feed(machine, token):
            if not (taken and token.starts_line and machine.takes(END)):
                continue
            machine, taken, opened = _machine(), [], []
            if not feed(machine, token):
                continue
        if token.kind in _OPENING:
            opened.append(len(taken))
        elif token.kind in _CLOSING and opened:
            opened.pop()
        taken.append(token)
    declares = not taken or (starts_line and machine.takes(END))
    return Spot(start, tuple(taken), tuple(opened), machine.expected(), declares)


def _machine() -> Machine:
    """Parser that determines the allowed tokens without building a tree."""
    return Machine(parse_table.load(), defaultdict(_nothing), frozenset(), 0)


def _nothing() -> Callable[..., object]:
    return lambda span, *parts: None


MEASURES: dict[str, Dimension] = {name: figure.dimension for name, figure in (FIGURES | PAD_FIGURES).items()} | {
    **dict.fromkeys(("altitude", "spacing", "tolerance", "proximity", "beacons", "sight"), Dimension.LENGTH),
    **dict.fromkeys(("separation", "clearance", "distance"), Dimension.LENGTH),
    **dict.fromkeys(("step", "horizon", "delay"), Dimension.TIME),
    **dict.fromkeys(("yaw", "heading", "within"), Dimension.ANGLE),
    "turn": Dimension.TURN,
    **dict.fromkeys(("moving", "uncertain"), Dimension.SPEED),
    "hops": Dimension.NUMBER,
}
"""Dimension of the number after each of these words."""

BETWEEN = frozenset({NUMBER, UNIT, "..", "-", "<=", "<", ">=", ">", "=", "(", ")", ","})
"""Tokens that may stand between such a word and its number."""


def fitting_units(place: Spot) -> Iterator[tuple[str, str]]:
    """Yield the units that fit a position, each with its dimension; all units if the required dimension is unknown."""
    wanted = _measured(place)
    for unit, (dimension, _) in UNITS.items():
        if wanted is None or dimension in wanted:
            yield unit, f"a unit of {dimension.value.partition(' ')[2]}"


def _measured(place: Spot) -> tuple[Dimension, ...] | None:
    opener = place.opener()
    if place.bracket == "{" and place.taken[0].word == "graph":
        weighs = any(token.text == "weight" for token in place.taken)
        return (Dimension.NUMBER if weighs else Dimension.LENGTH,)
    if place.before.word == "per":
        return Dimension.TIME, Dimension.LENGTH
    if place.bracket == "[" and opener is not None and opener.kind.startswith("TIME"):
        return Dimension.TIME, Dimension.STEPS
    if len(place.taken) > 1 and place.taken[-2].word == "every":
        return Dimension.TIME, Dimension.STEPS
    for token in reversed(place.taken):
        if token.kind in BETWEEN or (token.word == "of" and place.asks_heading):
            continue
        known = MEASURES.get(token.text)
        return None if known is None else (known,)
    return None


_NAMED = {"region": Kind.REGION, "beacon": Kind.BEACON, "graph": Kind.GRAPH}
"""Kind of name by kind of parameter, for parameters that are not numbers."""

DISTANCE = (Kind.REGION, Kind.BEACON, *AGENTS)
"""Kinds of names that ``distance`` takes as arguments."""

ICONS = {
    "a declaration": types.CompletionItemKind.Keyword,
    "an operator": types.CompletionItemKind.Operator,
    "a shape": types.CompletionItemKind.Class,
}


@dataclass(frozen=True, slots=True)
class Fit:
    """Completion candidate.

    Args:
        word: text to insert.
        says: short description.
        icon: kind of the candidate in the protocol.
        order: sort key: names before words before units.
    """

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
    """Yield the indices declared so far and the functions of numbers, with descriptions, if a number is allowed."""
    if NUMBER not in place.expected or place.before.kind == "every":
        return
    for name, word in pairwise(place.taken):
        if name.kind == NAME and word.kind == "in":
            yield name.text, "an index"
    if EXTREME in place.expected:
        yield "min", "the smallest of several numbers"
        yield "max", "the largest of several numbers"


def _kinds(place: Spot) -> tuple[Kind, ...]:
    """Kinds of names that fit a position; empty where a new name or a word of the language is needed."""
    before, opener, expected = place.before, place.opener(), place.expected
    counted = len(place.taken) > 2 and place.taken[-2].word in ("least", "any")
    listed = place.taken[0].word == "group" and before.kind in ("=", ",") and not place.bracket
    if place.bracket == "(" and opener is not None and opener.text == "distance":
        return DISTANCE
    if place.bracket == "(" and opener is not None and (called := CALLED.usable(opener.text)):
        further = opener.text == "connected" and before.kind == ","
        return AGENTS if further else tuple(dict.fromkeys(_NAMED.get(each, Kind.PARAM) for each in called.parameters))
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
    """Yield the words of the language that fit a position but are not keywords, with descriptions."""
    before, opener, first = place.before, place.opener(), place.taken[0].word
    head = place.opener(2)
    if before.word == "vehicle":
        yield from ((name, "a vehicle") for name in profiles())
    elif before.word == "dynamics":
        yield from ((name, "a kind of dynamics") for name in KINDS if KINDS.usable(name))
    elif before.word in ("start", "finish"):
        yield from ((name, "a layout of positions") for name in ("line", "grid"))
    elif before.word == "with" and first == "solve":
        yield from ((name, "a backend") for name in (AUTO, *BACKENDS))
    elif before.word in ("minimize", "maximize"):
        yield from ((goal.value, "an objective") for goal in ir.Objective if goal.word == before.word)
    elif before.kind == "=" and first == "formation":
        yield from ((name, "a kind of formation") for name in FORMATIONS)
    elif place.bracket == "(" and head is not None and head.word == "dynamics" and opener is not None:
        bounded = KINDS.usable(opener.text)
        yield from ((name, "a bound") for name in (settings_of(bounded) if bounded else ()))
    elif place.bracket == "{" and head is not None and head.word == "vehicle":
        yield from ((name, figure.says) for name, figure in ir.FIGURES.items())
    elif place.bracket == "{" and opener is not None and opener.word == "flight":
        yield from ((name, figure.says) for name, figure in ir.PAD_FIGURES.items())
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
            yield from ((name, "a predicate") for name in CALLED if CALLED.usable(name))

"""English sentences for a formula, and shared sentences for the values of an index.

    in   a formula and its mission
    out  Sentences

No operator is known by name: the kernel form shows Boolean chains, plain windows and the chains that a `for` produced.
All other wording is the operator's own data.

Sentences are unambiguous. An operator is before its operands, the last operand reaches as far as it can, and any other
operand that is more than a plain clause is numbered.

Sentences for the values of an index become one sentence if they differ in the index alone. Then every number in which
they differ is the same sum of the indices in all of them (``2*i + 1``).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import field
from fractions import Fraction
from string import Formatter
from typing import assert_never

from missionc import ir
from missionc.base.late_dataclass import Record, dataclass
from missionc.base.source import Turn
from missionc.frontend.explain.phrases import (
    COMPARED,
    Verb,
    When,
    belongs,
    joined_phrases,
    length_words,
    losing,
    noun,
    of_team,
    route_words,
    verb_of,
    who_of,
    window_of,
)
from missionc.ir.kernel import walk
from missionc.ir.kernel.nodes import All, Any, Node, Not
from missionc.ir.language.walk_formulas import as_written, formulas_bottom_up, meaning, operands


def boolean(formula: ir.Formula) -> type[Node] | None:
    """Kind of kernel node if a formula is exactly `not`, `and` or `or`, by its kernel form; None otherwise."""
    if not isinstance(formula, ir.Apply) or formula.bounds is not None or formula.operator.spatial:
        return None
    node, places = meaning(formula)
    match node:
        case Not(body) if body is places[0]:
            return Not
        case All(parts) | Any(parts) if parts == places:
            return type(node)
        case _:
            return None


def turns_of(formula: ir.Apply) -> list[tuple[Turn, ...]]:
    """Index values of each operand in a chain that a `for` expanded to; empty for any other formula."""
    own = formula.span.turns
    turns = [operand.span.turns for operand in formula.operands]
    if any(each[: len(own)] != own or len(each) == len(own) for each in turns):
        return []
    return [each[len(own) :] for each in turns]


_NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?!\w)")
"""Pattern of numbers that are not part of a name."""


def index_words(turns: Sequence[tuple[Turn, ...]]) -> str | None:
    """Text for index values, such as "`i` from 0 to 9".

    None if some are missing or a range depends on another index.
    """
    first = turns[0]
    if len(turns) < 2 or len({tuple((turn.name, turn.low, turn.high) for turn in each) for each in turns}) > 1:
        return None
    count = 1
    for turn in first:
        count *= turn.high - turn.low + 1
    if count != len(turns):
        return None
    each = [f"`{turn.name}` from {turn.low} to {turn.high}" for turn in first if turn.low < turn.high]
    return f"{', '.join(each[:-1])} and {each[-1]}" if len(each) > 1 else each[0]


def for_each_index(texts: Sequence[str], turns: Sequence[tuple[Turn, ...]]) -> str | None:
    """Text such as ``for each `i` from 0 to 9: …`` that replaces the texts of all index values; None if impossible."""
    said, each = (with_indices(texts, turns), index_words(turns)) if turns[0] else (None, None)
    if said is None or each is None:
        return None
    ended = said.endswith(".")
    return f"{'For' if ended else 'for'} each {each}: {said[0].lower() + said[1:] if ended else said}"


def with_indices(texts: Sequence[str], turns: Sequence[tuple[Turn, ...]]) -> str | None:
    """Text in which expressions of indices replace the numbers that differ between ``texts``; None if impossible.

    Args:
        turns: index values of each text.
    """
    pieces = [_NUMBER.split(text) for text in texts]
    if any(piece != pieces[0] for piece in pieces):
        return None
    numbers = [[Fraction(number) for number in _NUMBER.findall(text)] for text in texts]
    written, said = _NUMBER.findall(texts[0]), [pieces[0][0]]
    for place, values in enumerate(zip(*numbers, strict=True)):
        number = written[place]
        if len(set(values)) > 1:
            formula = _sum_of_indices(values, turns)
            if formula is None:
                return None
            before = "".join(said)
            inside = before.count("`") % 2 == 1 or before.count("[") > before.count("]")
            number = formula if inside else f"`{formula}`"
        said += [number, pieces[0][place + 1]]
    return "".join(said)


def _sum_of_indices(values: Sequence[Fraction], turns: Sequence[tuple[Turn, ...]]) -> str | None:
    """Linear expression of the indices, such as ``2*i + 1``, that gives each of the values; None if there is none."""
    at = {tuple(turn.value for turn in each): value for each, value in zip(turns, values, strict=True)}
    low = tuple(turn.low for turn in turns[0])
    weights = []
    for place, turn in enumerate(turns[0]):
        step = tuple(value + (number == place) for number, value in enumerate(low))
        weights.append(at[step] - at[low] if turn.high > turn.low else Fraction(0))
    constant = at[low] - sum(weight * value for weight, value in zip(weights, low, strict=True))
    if any(
        value != constant + sum(weight * each for weight, each in zip(weights, place, strict=True))
        for place, value in at.items()
    ):
        return None
    return _joined([*_products(weights, turns[0]), *([(constant, _decimal(abs(constant)))] if constant else [])])


def _products(weights: Sequence[Fraction], turns: tuple[Turn, ...]) -> Iterator[tuple[Fraction, str]]:
    for weight, turn in zip(weights, turns, strict=True):
        if weight:
            yield weight, turn.name if abs(weight) == 1 else f"{_decimal(abs(weight))}*{turn.name}"


def _joined(parts: list[tuple[Fraction, str]]) -> str:
    (sign, first), *rest = parts
    return ("-" if sign < 0 else "") + first + "".join(f" {'-' if sign < 0 else '+'} {text}" for sign, text in rest)


def _decimal(value: Fraction) -> str:
    return f"{float(value):.10g}"


LONG = 12
"""Size of a named formula (``let``), in parts, from which a sentence refers to it by name and explains it
separately.
"""

DEEP = 6
"""Nesting depth of operators at which a sentence ends and another one continues."""


MOST_PARTS, LONGEST = 20, 2_000
"""Maximum number of named formulas explained under one formula, and of letters in one sentence."""


class SentencePart(Record):
    """Formula that a sentence refers to by a name, with a sentence for its meaning."""

    name: str
    sentence: str


class Sentences(Record):
    whole: str
    parts: tuple[SentencePart, ...] = ()
    left_out: int = 0
    """Number of named formulas that are not explained."""

    @property
    def letters(self) -> int:
        return len(self.whole) + sum(len(part.sentence) for part in self.parts)


class Clause(Record):
    """Clause of a sentence; if ``plain`` is True, `and` or a comma can follow it without ambiguity."""

    text: str
    plain: bool = False


class Around(Record):
    """Context of a formula in a sentence: its subject, whether it is evaluated at the first step, its depth and its
    number.
    """

    who: str
    from_start: bool
    depth: int = 0
    number: str = ""

    def inner(self, *, later: bool = False, number: str = "") -> Around:
        return Around(self.who, self.from_start and not later, self.depth + 1, number or self.number)


def sentences(formula: ir.Formula, mission: ir.Mission) -> Sentences:
    """Sentences for a formula that is evaluated at the mission's first step."""
    speaker = _Speaker(mission, formula)
    whole = _ended(speaker.clause(formula, Around("the agent", True), named=False).text, mission)
    parts: list[SentencePart] = []
    while len(parts) < min(len(speaker.named), MOST_PARTS):
        part = speaker.order[len(parts)]
        of = " of an agent" if part in speaker.of_agents else ""
        text = speaker.clause(part, Around("the agent", False), named=False).text
        parts.append(SentencePart(speaker.named[part], _ended(f"{speaker.named[part]} means{of}: {text}", mission)))
    return Sentences(whole, tuple(parts), len(speaker.named) - len(parts))


def _ended(text: str, mission: ir.Mission) -> str:
    """The text with a full stop, and a capital letter unless it begins with a name; very long text is shortened."""
    first = text.split(" ", 1)[0].rstrip(",")
    named = first.startswith("`") or any(agent.name == first for agent in mission.agents)
    said = text if named else text[0].upper() + text[1:]
    if len(said) > LONGEST:
        return f"{said[:LONGEST].rsplit(' ', 1)[0]} … and {len(said) - LONGEST:,} more letters."
    return f"{said}."


@dataclass(slots=True)
class _Speaker:
    """Generator of sentences for one formula; ``order`` lists the parts that got a name, in the order of use."""

    mission: ir.Mission
    root: ir.Formula
    named: dict[ir.Formula, str] = field(default_factory=dict)
    order: list[ir.Formula] = field(default_factory=list)
    sizes: dict[ir.Formula, int] = field(default_factory=dict)
    of_agents: set[ir.Formula] = field(default_factory=set)
    lets: dict[ir.Formula, str] = field(default_factory=dict)
    said: dict[tuple[ir.Formula, Around, bool], Clause] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for formula in formulas_bottom_up([self.root], as_written):
            below = as_written(formula)
            self.sizes[formula] = 1 + sum(self.sizes[operand] for operand in below)
            if self._of_an_agent(formula):
                self.of_agents.add(formula)
        for name, formula in self.mission.lets:
            self.lets.setdefault(formula, name)

    def _of_an_agent(self, formula: ir.Formula) -> bool:
        match formula:
            case ir.Belongs():
                return True
            case ir.Holds(predicate, _):
                return verb_of(predicate, self.mission) is not None
            case ir.Apply():
                return formula.operator.spatial or any(part in self.of_agents for part in formula.operands)
            case ir.Truth() | ir.AtLeastOf() | ir.OfAgent() | ir.Without():
                return False
            case _:
                assert_never(formula)

    # ------------------------------------------------------------------ verbs

    def verb(self, formula: ir.Formula) -> Verb | None:
        """Verb phrase of a formula about an agent, if a few words suffice; else None."""
        single = self._literal(formula)
        if single is not None:
            return single
        word = self._chain(formula)
        if word is None or formula not in self.of_agents:
            return None
        parts = [self._literal(operand) for operand in operands(formula)]
        verbs = [part for part in parts if part is not None]
        if len(verbs) < len(parts):
            return None
        if word == "and" and all(verb.denies for verb in verbs):
            return Verb(
                joined_phrases([verb.plain for verb in verbs], "or"),
                joined_phrases([verb.denied for verb in verbs], word),
                True,
            )
        return Verb(joined_phrases([str(verb) for verb in verbs], word), "")

    def _literal(self, formula: ir.Formula) -> Verb | None:
        match formula:
            case ir.Holds(predicate, _):
                return verb_of(predicate, self.mission)
            case ir.Belongs(agents, _):
                return belongs(agents, self.mission)
            case ir.Truth(True, _):
                return Verb("may be any agent", "may be no agent")
            case ir.Truth():
                return Verb("may be no agent", "may be any agent")
            case ir.Apply() if boolean(formula) is Not:
                (body,) = formula.operands
                inner = None if boolean(body) is Not else self._literal(body)
                return inner and inner.negated()
            case _:
                return None

    def _chain(self, formula: ir.Formula) -> str | None:
        kind = boolean(formula)
        return "and" if kind is All else "or" if kind is Any else None

    def _condition(self, formula: ir.Formula) -> Verb:
        """Verb phrase of a formula, with a name if the formula is explained later."""
        found = self.verb(formula)
        if found is not None:
            return found
        name = self._name(formula)
        return Verb(f"meets {name}", f"does not meet {name}")

    def _name(self, formula: ir.Formula) -> str:
        if formula not in self.named:
            count = sum(part not in self.lets for part in self.order) + 1
            self.named[formula] = f"`{self.lets[formula]}`" if formula in self.lets else f"[{count}]"
            self.order.append(formula)
        return self.named[formula]

    # ---------------------------------------------------------------- clauses

    def clause(self, formula: ir.Formula, around: Around, *, named: bool = True) -> Clause:
        """Clause for a formula as part of a sentence; if ``named`` is True, a name may replace a deep formula."""
        if formula not in self.lets or self.sizes[formula] <= LONG:
            named = named and self.sizes[formula] > 2 and around.depth > DEEP
        if named:
            name = self._name(formula)
            return Clause(f"{around.who} meets {name}" if formula in self.of_agents else f"{name} holds", True)
        key = (formula, around, named)
        if key not in self.said:
            self.said[key] = self._clause(formula, around)
        return self.said[key]

    def _clause(self, formula: ir.Formula, around: Around) -> Clause:
        match formula:
            case ir.Truth(value, _):
                return Clause("this is always true" if value else "this is never true", True)
            case ir.Holds(predicate, _) if formula not in self.of_agents:
                return Clause(of_team(predicate, self.mission, False), True)
            case ir.AtLeastOf():
                return self._quantified(formula, around)
            case ir.OfAgent(agent, body, _):
                return self._of(self.mission.agents[agent].name, body, around)
            case ir.Without(number, agents, body):
                lost = losing(number, agents, noun(agents, self.mission), self.mission)
                return Clause(f"{lost}: {self.clause(body, around.inner()).text}")
            case ir.Holds() | ir.Belongs():
                return Clause(f"{around.who} {self._literal(formula)}", True)
            case ir.Apply():
                return self._applied(formula, around)
            case _:
                assert_never(formula)

    def _of(self, name: str, body: ir.Formula, around: Around) -> Clause:
        whens, end = self._windows(body, around.from_start)
        verb = self.verb(end)
        if verb is not None:
            adverbs = "".join(f", {when.at('every step' if each else 'some step')}" for each, when in whens)
            return Clause(f"{name}{adverbs}{',' if whens else ''} {verb}", not whens and self._literal(end) is not None)
        return self.clause(body, Around(name, around.from_start, around.depth + 1, around.number))

    def _quantified(self, formula: ir.AtLeastOf, around: Around) -> Clause:
        members = noun(formula.agents, self.mission)
        who = who_of(formula, members)
        whens, end = self._windows(formula.body, around.from_start)
        verb = self.verb(end)
        literal = self._literal(end) is not None
        if verb is not None and verb.denies and formula.kind == "every" and all(each for each, _ in whens):
            adverbs = "".join(f", {when.at('any step')}" for _, when in whens)
            return Clause(f"no {members.one}{adverbs}{',' if whens else ''} {verb.plain}", literal and not whens)
        adverbs = "".join(f", {window_of(when, each, formula)}" for each, when in whens)
        if verb is not None:
            return Clause(f"{who}{adverbs}{',' if whens else ''} {verb}", literal and not whens)
        if around.who == members.this:
            return Clause(f"{who} {self._condition(formula.body)}", True)
        inner = Around(members.this, around.from_start and not whens, around.depth + 1 + len(whens), around.number)
        said = self.clause(end, inner)
        return Clause(f"{who}{adverbs}: {said.text}" if whens else f"for {who}: {said.text}")

    def _windows(self, formula: ir.Formula, from_start: bool) -> tuple[list[tuple[bool, When]], ir.Formula]:
        """Plain windows that a formula begins with, and the formula below them.

        Each window has True for "every step" and False for "some step".
        """
        found: list[tuple[bool, When]] = []
        while isinstance(formula, ir.Apply) and len(found) < DEEP and not self._called(formula):
            plain = self._plain_window(formula, from_start)
            if plain is None:
                break
            found.append(plain)
            formula, from_start = formula.operands[0], False
        return found, formula

    def _plain_window(self, formula: ir.Apply, from_start: bool) -> tuple[bool, When] | None:
        """Window of a formula that only requires its operand at every step (True) or at some step (False).

        None for others.
        """
        if formula.operator.spatial:
            return None
        node, places = meaning(formula)
        window = walk.window_of(node)
        if window is None or len(places) > 1 or walk.children(node) != places:
            return None
        return node.every, When(*window, from_start, self.mission)

    def _called(self, formula: ir.Formula) -> bool:
        return formula in self.lets and self.sizes[formula] > LONG

    def _applied(self, formula: ir.Apply, around: Around) -> Clause:
        verb = self.verb(formula)
        if verb is not None and formula in self.of_agents:
            return Clause(f"{around.who} {verb}", self._literal(formula) is not None)
        if formula.operator.spatial:
            return Clause(self._spatial(formula, around))
        kind = boolean(formula)
        if kind is Not:
            return self._denied(formula.operands[0], around)
        if kind in (All, Any):
            return self._chained(formula, around)
        return Clause(self._filled(formula, around))

    def _denied(self, body: ir.Formula, around: Around) -> Clause:
        if isinstance(body, ir.Holds):
            return Clause(of_team(body.predicate, self.mission, True), True)
        if isinstance(body, ir.AtLeastOf) and body.kind == "some":
            verb = self.verb(body.body)
            if verb is not None and not verb.denies:
                one = noun(body.agents, self.mission).one
                return Clause(f"there is no {one} that {verb}", self._literal(body.body) is not None)
        if isinstance(body, ir.Apply) and (plain := self._plain_window(body, around.from_start)):
            every, when = plain
            if not every and when.low != when.high:
                return Clause(f"{when.at('no step')}, {self.clause(body.operands[0], around.inner(later=True)).text}")
        return Clause(f"it is not true that {self.clause(body, around.inner()).text}")

    def _chained(self, formula: ir.Apply, around: Around) -> Clause:
        word = self._chain(formula)
        assert word is not None
        if with_index := self._with_index(formula, around):
            return Clause(with_index)
        parts = self._links(formula, word)
        last = self.clause(parts[-1], around.inner())
        numbered = self._chain(parts[-1]) is not None or (word == "or" and not last.plain)
        texts, numbered = self._operands(parts, around, False, numbered)
        if len(texts) > 2 or (word == "or" and numbered):
            opening = formula.operator.reads.format(parts="")
            return Clause(opening + (joined_phrases(texts, word, ";") if numbered else joined_phrases(texts, word)))
        if word == "or":
            return Clause(f"either {texts[0]} or {texts[1]}, or both")
        return Clause(f"both {texts[0]}{';' if numbered else ''} and {texts[1]}")

    def _with_index(self, formula: ir.Apply, around: Around) -> str | None:
        """Text such as ``for each `i` from 0 to 9: …`` if the operands differ only in an index; else None."""
        turns, known = turns_of(formula), len(self.order)
        each = index_words(turns) if turns else None
        texts = [self.clause(part, around.inner()).text for part in formula.operands] if each else []
        said = with_indices(texts, turns) if each and len(self.order) == known else None
        return said and f"for {'each' if self._chain(formula) == 'and' else 'some'} {each}: {said}"

    def _links(self, formula: ir.Apply, word: str) -> tuple[ir.Formula, ...]:
        """Operands of a chain of `and` or `or`; nested chains of the same kind are flattened."""
        found: list[ir.Formula] = []
        for part in formula.operands:
            inside = isinstance(part, ir.Apply) and self._chain(part) == word and not self._called(part)
            if inside and isinstance(part, ir.Apply) and not turns_of(part):
                found.extend(part.operands)
            else:
                found.append(part)
        return tuple(found)

    def _operands(
        self, parts: tuple[ir.Formula, ...], around: Around, later: bool, numbered: bool = False
    ) -> tuple[list[str], bool]:
        """Clauses for the operands, in reading order, and True if they are numbered because their ends would be
        ambiguous.
        """
        plain = all(self.clause(part, around.inner(later=later)).plain for part in parts[:-1])
        if plain and not numbered:
            return [self.clause(part, around.inner(later=later)).text for part in parts], False
        marks = [f"{around.number}{'.' if around.number else ''}{index}" for index in range(1, len(parts) + 1)]
        inner = [around.inner(later=later, number=mark) for mark in marks]
        said = [self.clause(part, each).text for part, each in zip(parts, inner, strict=True)]
        return [f"({mark}) {text}" for mark, text in zip(marks, said, strict=True)], True

    def _filled(self, formula: ir.Apply, around: Around) -> str:
        """Sentence for a temporal or Boolean operator, from the wording in the operator's data."""
        template = formula.operator.reads
        places = ("body",) if len(formula.operands) == 1 else ("left", "right")
        read = list(dict.fromkeys(name for _, name, _, _ in Formatter().parse(template) if name and name in places))
        by_place = dict(zip(places, formula.operands, strict=True))
        when = self._when(formula, around)
        texts, _ = self._operands(tuple(by_place[name] for name in read), around, when is not None)
        slots = dict(zip(read, texts, strict=True))
        if when is not None:
            slots |= when.adverbials
        return template.format(**slots)

    def _when(self, formula: ir.Apply, around: Around) -> When | None:
        window = walk.window_of(meaning(formula)[0])
        if window is None and isinstance(formula.bounds, ir.Window):  # of an operator that drops it
            window = formula.bounds.low, formula.bounds.high
        return window and When(*window, around.from_start, self.mission)

    def _spatial(self, formula: ir.Apply, around: Around) -> str:
        length = formula.bounds
        assert isinstance(length, ir.Length)
        places = ("body",) if len(formula.operands) == 1 else ("left", "right")
        itself = length.low <= 0
        return formula.operator.reads.format(
            **{name: self._condition(part) for name, part in zip(places, formula.operands, strict=True)},
            route=route_words(length),
            far=length_words(length),
            graph=f"`{length.graph.name}`",
            here=around.who,
            perhaps=f" (perhaps {around.who} itself)" if itself else "",
            included=f" ({around.who} itself included)" if itself else "",
            number=COMPARED.get(formula.comparison, "").format(formula.number),
        )

"""The TextMate grammar of the mission language, generated from the compiler's words, operators, predicates and units.

    python -m editors.textmate

writes it into the VS Code extension. Words that are reserved are keywords anywhere; each other word only where its
declaration asks for it, so that a region may be called `path`. Every word is matched from its first letter to its last,
as the lexer does it: no pattern starts within one.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from missionc.base.units import UNITS
from missionc.frontend.resolve.called_predicates import CALLED
from missionc.frontend.syntax.tokens import BEFORE_FILE, DECLARATIONS, EXTREMES, PLURALS, STATES, WORDS, Word
from missionc.ir.language.operator import Bounds
from missionc.ir.language.operators import by_name

FILE = Path(__file__).parent / "vscode" / "syntaxes" / "mission.tmLanguage.json"

Rule = dict[str, Any]
"""A rule of the grammar, as its JSON."""

SAYS = {
    "a declaration": "keyword.declaration",
    "a shape": "support.type.shape",
    "a quantifier": "keyword.control.quantifier",
    "a formula": "constant.language",
    "the mission's last step": "constant.language",
    "a measure": "keyword.other.measure",
    "a motion": "keyword.other.motion",
    "a preposition": "keyword.other.preposition",
    "a part of `time`": "keyword.other.part",
    "a part of a team": "keyword.other.part",
    "a part of a formation": "keyword.other.part",
    "a part of `prefer`": "keyword.other.part",
    "a part of `flight`": "keyword.other.part",
    "a part of `tolerate`": "keyword.other.part",
    "a part of `from`": "keyword.other.part",
    "a yaw mode": "keyword.other.part",
    "a kind of graph": "keyword.other.kind",
}
"""Scope of a word, by its description; for an operator, by its bounds."""

SIGNS = {
    "keyword.operator.logical": ("<->", "->", "!", "&", "|"),
    "keyword.operator.comparison": ("<=", ">=", "<", ">"),
    "keyword.operator.range": ("..",),
    "keyword.operator.arithmetic": ("+", "-", "*", "/"),
    "keyword.operator.assignment": ("=",),
    "punctuation.separator": (",", ":"),
    "punctuation.section": ("(", ")", "[", "]", "{", "}"),
}
"""Signs, longer ones before their prefixes."""

_NAME = r"[^\W\d]\w*(?!\w)"
_NUMBER = r"(?:[0-9]+(?:\.[0-9]+)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
_NO_NAME = r"(?<!\bin )"
"""Pattern of a measure that is not after ``in``, where the same word is a name, as in ``[i in radius - 1..9]``."""
_AMOUNT_FOLLOWS = r"(?=\s*(?:$|#|[-\w.(]))"
_UNIT = rf"(?:{'|'.join(re.escape(unit) for unit in sorted(UNITS, key=len, reverse=True))})(?!\w)"


def _any(words: Iterable[str]) -> str:
    return rf"(?:{'|'.join(words)})(?!\w)"


_RESERVED = [word.text for word in WORDS if word.reserved]
_EXTREME = _any(sorted(EXTREMES)) + r"(?=\s*\()"
_FREE = rf"(?!{_any(_RESERVED)})(?!{_EXTREME}){_NAME}"
"""Words that may be names."""

_DECLARING = [word.text for word in WORDS if word.text in DECLARATIONS | PLURALS]


def _begins(word: str) -> str:
    """Pattern of a declaration's first word, if it is one."""
    return _any((word,)) + (BEFORE_FILE if word in PLURALS else "")


_NEXT_DECLARATION = f"(?={'|'.join(map(_begins, _DECLARING))})"
_FROM = r'from(?=\s*")'
"""Word before the name of a file."""


# ------------------------------------------------------------------ kinds of rules


def _scope(scope: str) -> str:
    return f"{scope}.mission"


def _match(pattern: str, scope: str) -> Rule:
    return {"match": pattern, "name": _scope(scope)}


def _after(begin: str, scope: str, then: str, gets: str, *between: Rule) -> Rule:
    """Rule for ``begin`` and the text ``then`` after it, with blanks, comments and ``between`` in between."""
    rule = {
        "begin": begin,
        "end": rf"({then})|(?=\S)",
        "applyEndPatternLast": True,
        "endCaptures": {"1": {"name": _scope(gets)}},
        "patterns": [_COMMENT, *between],
    }
    return rule | ({"beginCaptures": {"0": {"name": _scope(scope)}}} if scope else {})


def _bracketed(begin: str, end: str, scope: str, *patterns: Rule) -> Rule:
    """Rule from one bracket to the other, or to the next declaration if the other is still missing."""
    return {
        "name": _scope(scope),
        "begin": begin,
        "end": f"{end}|{_NEXT_DECLARATION}",
        "beginCaptures": {"0": {"name": _scope("punctuation.section")}},
        "endCaptures": {"0": {"name": _scope("punctuation.section")}},
        "patterns": list(patterns),
    }


def _include(name: str) -> Rule:
    return {"include": f"#{name}"}


_COMMENT = _include("comment")
_COMMON = _include("common")


# ------------------------------------------------------------------ words that are keywords anywhere


def _reserved() -> list[Rule]:
    """Reserved words that are not operators, grouped by scope."""
    scopes: dict[str, list[str]] = {}
    for word in WORDS:
        if word.says != "an operator" and word.reserved:
            scopes.setdefault(SAYS[word.says], []).append(word.text)
    return [_match(_any(words), scope) for scope, words in scopes.items()]


def _bounded(bounds: tuple[Bounds, ...], family: str, infix_letter: str, window: Rule) -> Rule:
    """Operators before a window, with the window.

    ``infix_letter`` is what tells the letter of an infix operator from an agent of a team that is called like it: both
    stand before ``[``.
    """
    words = _operators(*bounds)
    spelled = [word.text for word in words] + [word.letter for word in words if word.token.endswith("PREFIX")]
    between = [word.letter for word in words if word.token.endswith("INFIX")]
    return {
        "begin": f"{_any(filter(None, spelled))}|{_any(filter(None, between))}{infix_letter}",
        "beginCaptures": {"0": {"name": _scope(f"keyword.control.{family}")}},
        "end": r"(?=\S)",
        "applyEndPatternLast": True,
        "patterns": [_COMMENT, window],
    }


def _operators(*bounds: Bounds) -> list[Word]:
    return [word for word in WORDS if word.says == "an operator" and by_name[word.text].bounds in bounds]


def _operator_rules() -> list[Rule]:
    measures = _any(("hops", "distance"))
    within_length = _after(rf"\G(?!\s*(?!{measures}){_NAME})", "", measures, "keyword.other.measure")
    return [
        _bounded(
            (Bounds.TIME, Bounds.PAST),
            "temporal",
            r"(?=\s*\[[^\]]*,)",
            _bracketed(r"\[", r"\]", "meta.window.temporal", _COMMON),
        ),
        _bounded(
            (Bounds.LENGTH,),
            "spatial",
            rf"(?=\s*\[\s*{_NAME}\s*(?:<=|(?<=\s)[\w(]))",
            _bracketed(r"\[", r"\]", "meta.window.spatial", within_length, _COMMON),
        ),
        _match(_any(word.text for word in _operators(Bounds.NONE)), "keyword.operator.wordlike.logical"),
    ]


def _common() -> list[Rule]:
    """Rules for every declaration; the rule for names is last and takes everything else."""
    return [
        _COMMENT,
        _match(r'"[^"\n]*"?', "string.quoted.double"),
        _match(_FROM, "keyword.other.preposition"),
        _after(_NUMBER, "constant.numeric", _UNIT, "keyword.other.unit"),
        _after(r"\)", "punctuation.section", _UNIT, "keyword.other.unit"),
        *_operator_rules(),
        *_reserved(),
        *(_match("|".join(map(re.escape, signs)), scope) for scope, signs in SIGNS.items()),
        _match(_EXTREME, "keyword.other.function"),
        _match(_NAME, "variable.other"),
    ]


# ------------------------------------------------------------------ declarations


def _value_after(begin: str, scope: str) -> Rule:
    return _after(begin, scope, _FREE, "variable.other")


def _operands() -> list[Rule]:
    """Rule for an operand after these signs: a word that may be a name is one."""
    kinds = ("range", "comparison", "arithmetic", "assignment")
    scopes = [f"keyword.operator.{kind}" for kind in kinds]
    return [_value_after("|".join(map(re.escape, SIGNS[scope])), scope) for scope in scopes]


def _shape() -> list[Rule]:
    return [
        _value_after(_NO_NAME + _any(("radius", "height")) + _AMOUNT_FOLLOWS, "keyword.other.measure"),
        _value_after(r"\(", "punctuation.section"),
        _value_after(",|:", "punctuation.separator"),
        *_operands(),
    ]


def _settings() -> list[Rule]:
    """Rules for `NAME amount`, `NAME <= amount`, `NAME = amount`; the amount may be a name."""
    return [
        *_operands(),
        _value_after(_any(("of",)), "keyword.other.preposition"),
        _value_after(rf"{_FREE}(?=\s*(?:<=|=|-|[\w.(]))", "variable.other.property"),
    ]


def _items() -> Rule:
    """Rule for the items of a team in its braces."""
    part = "keyword.other.part"
    along = _match(_any(("along",)), "keyword.other.motion")
    items = _any(word.text for word in WORDS if word.says == "a part of a team" and not word.reserved)
    return _bracketed(
        r"\{",
        r"\}",
        "meta.block",
        # A coordinate may have the name of an item.
        _after(r"\(", "punctuation.section", items, "variable.other"),
        _after(",", "punctuation.separator", items, "variable.other"),
        _after(_any(("dynamics",)), part, _FREE, "support.type.dynamics"),
        _after(_any(("vehicle",)), part, _FREE, "support.type.vehicle"),
        _after(_any(("start", "finish")), part, rf"(?!{_FROM}){_FREE}", "support.type.placement"),
        _after(_any(("yaw",)), part, _any(("path",)), part, along),
        _match(_any(("flight",)) + r"(?=\s*(?:$|#|[{}\w]))", part),
        _value_after(_any(("in",)), "keyword.other.preposition"),
        _bracketed(
            r"\{",
            r"\}",
            "meta.block",
            _after(_any(("pads",)), part, rf"(?!{_FROM}){_FREE}", "support.type.placement"),
            _include("settings"),
            _COMMON,
        ),
        _include("settings"),
        _COMMON,
    )


def _formula() -> list[Rule]:
    least, any_ = (_match(_any((word,)), "keyword.control.quantifier") for word in ("least", "any"))
    called, preposition = sorted(CALLED.built_in), "keyword.other.preposition"
    return [
        # A number of agents has no unit: in `at least 2 m: …`, the team is called `m`.
        _after(_any(("at",)), "keyword.other.preposition", _NUMBER, "constant.numeric", least),
        _after(_any(("without",)), "keyword.control.quantifier", _NUMBER, "constant.numeric", any_),
        _match(_any(called) + r"(?=\s*\()", "support.function.predicate"),
        _after(_any(("heading",)) + r"(?=\s*within(?!\w))", "keyword.other.measure", _any(("within",)), preposition),
        _match(_any(sorted(STATES)), "variable.language.state"),
    ]


_LABEL = rf"{_NAME}(?=\s*:)"
_MOTION = _match(_any(("moving", "along")) + r'(?=\s*(?:$|#|\(|from\s*"))', "keyword.other.motion")
# A shape may have the name of the word; the text after it decides.
_GROWTH = _value_after(
    _any(("uncertain",)) + r"(?=\s*(?:$|#|[\d.(]|-\S|(?!(?:moving|along|uncertain)\b)[A-Za-z_]))",
    "keyword.other.motion",
)


@dataclass(frozen=True, slots=True)
class Declared:
    """Text right after a declaration's keyword with its scope, and further rules for its body."""

    scope: str = ""
    first: str = _FREE
    body: tuple[Rule, ...] = ()


_OF_FILE = (
    _match(_any(("origin",)) + r"(?=\s*\()", "keyword.other.part"),
    _match(_any(("layer",)) + r'(?=\s*")', "keyword.other.part"),
    _after(
        _any(("unknown",)) + r"(?=\s+(?!(?:origin|layer|named|height|within)\b)[A-Za-z_])",
        "keyword.other.part",
        _FREE,
        "variable.other",
    ),
    _after(_any(("named",)), "keyword.other.part", _FREE, "variable.other"),
    _match(_NO_NAME + _any(("height",)) + _AMOUNT_FOLLOWS, "keyword.other.measure"),
    _match(_any(("within",)) + _AMOUNT_FOLLOWS, "variable.other.property"),
    _include("settings"),
)

_DECLARED = {
    "mission": Declared("entity.name.namespace"),
    "param": Declared("entity.name.variable.param"),
    "include": Declared(),
    "time": Declared(
        "keyword.other.part",
        _any(("step",)),
        (_after(",", "punctuation.separator", _any(("horizon",)) + r"(?!\s*[,)\]])", "keyword.other.part"),),
    ),
    "world": Declared(),
    "region": Declared("entity.name.type.region", body=(_include("shape"),)),
    "obstacle": Declared("entity.name.type.obstacle", body=(_include("shape"), _MOTION, _GROWTH)),
    "beacon": Declared("entity.name.type.beacon"),
    "team": Declared("entity.name.type.team", body=(_include("items"),)),
    "agent": Declared("entity.name.type.agent", body=(_include("items"),)),
    "group": Declared("entity.name.type.group"),
    "graph": Declared(
        "entity.name.type.graph",
        body=(
            _after("=", "keyword.operator.assignment", _any(("proximity", "beacons", "sight")), "keyword.other.kind"),
            _match(_any(("weight",)) + rf"(?=\s+{_NAME})", "keyword.other.part"),
        ),
    ),
    "formation": Declared(
        "entity.name.type.formation",
        body=(
            _after("=", "keyword.operator.assignment", _FREE, "support.type.formation"),
            _match(_any(("total",)) + rf"(?=\s+{_NAME})", "keyword.other.part"),
            _include("settings"),
        ),
    ),
    "resource": Declared(
        "entity.name.type.resource",
        body=(
            _after(_any(("per",)), "keyword.other.preposition", _UNIT, "keyword.other.unit"),
            _value_after(_any(("in",)), "keyword.other.preposition"),
            _include("settings"),
        ),
    ),
    "flag": Declared(
        "entity.name.type.flag",
        body=(_value_after(_any(("in",)), "keyword.other.preposition"), _include("settings")),
    ),
    **dict.fromkeys(PLURALS, Declared(body=_OF_FILE)),
    "separation": Declared(),
    "clearance": Declared(),
    "let": Declared("entity.name.function.let", body=(_include("formula"),)),
    "require": Declared("entity.name.function.requirement", _LABEL, (_include("formula"),)),
    "prefer": Declared(
        "entity.name.function.preference",
        _LABEL,
        (_value_after(_any(("weight",)) + _AMOUNT_FOLLOWS, "keyword.other.part"), _include("formula")),
    ),
    "minimize": Declared("support.constant.goal"),
    "maximize": Declared("support.constant.goal"),
    "tolerate": Declared(
        body=(
            _match(_any(("delay",)) + _AMOUNT_FOLLOWS, "keyword.other.part"),
            *_operands(),
            _value_after(_any(("of",)), "keyword.other.preposition"),
        )
    ),
    "solve": Declared(
        body=(
            _after(_any(("with",)), "keyword.other.preposition", _FREE, "support.constant.backend"),
            _include("settings"),
        )
    ),
}


def _declaration(word: str) -> Rule:
    """Rule from a declaration's keyword to the next one."""
    declared = _DECLARED[word]
    first = [_after(r"\G", "", declared.first, declared.scope)] if declared.scope else []
    return {
        "name": _scope(f"meta.declaration.{word}"),
        "begin": _begins(word),
        "beginCaptures": {"0": {"name": _scope(SAYS["a declaration"])}},
        "end": _NEXT_DECLARATION,
        "patterns": [*first, *declared.body, _COMMON],
    }


def grammar() -> Rule:
    """Whole grammar."""
    return {
        "information_for_contributors": ["Made by `python -m editors.textmate`; a test compares."],
        "name": "Mission",
        "scopeName": "source.mission",
        "fileTypes": ["mission"],
        "patterns": [*map(_include, _DECLARING), _COMMON],
        "repository": {
            "comment": _match(r"#.*$", "comment.line.number-sign"),
            "common": {"patterns": _common()},
            "formula": {"patterns": _formula()},
            "items": _items(),
            "settings": {"patterns": _settings()},
            "shape": {"patterns": _shape()},
            **{word: _declaration(word) for word in _DECLARING},
        },
    }


def text() -> str:
    """Text of the file."""
    return json.dumps(grammar(), indent=2, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    FILE.write_text(text(), encoding="utf-8")

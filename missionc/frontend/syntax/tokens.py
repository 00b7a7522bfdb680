"""The tokenizer: words of the language, and tokens of a text.

in   Source
out  its tokens, the last of them END
says MC006, MC007
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from itertools import islice
from typing import NamedTuple

from missionc.base.diagnostics.code import NAME_NOT_ALLOWED, NUMBER_OUT_OF_RANGE, UNKNOWN_UNIT
from missionc.base.diagnostics.model import Diagnostic, Fix, Label
from missionc.base.late_dataclass import Record
from missionc.base.limits import Limits
from missionc.base.source import Source, Span
from missionc.base.units import UNITS
from missionc.frontend.syntax.forms import UNITS_IN_FULL
from missionc.frontend.syntax.parse_table import END


class Word(Record):
    """Word of the language with a meaning of its own.

    ``says`` is its description. ``token`` is its class in the grammar, if it shares one; ``letter`` its short form. A
    word that is not ``reserved`` may also be a name, wherever the grammar does not need the word.
    """

    text: str
    says: str
    token: str = ""
    letter: str = ""
    reserved: bool = True


def _words(says: str, texts: str, *, reserved: bool = True) -> tuple[Word, ...]:
    """Words of one kind, each with a token class of its own."""
    return tuple(Word(text, says, reserved=reserved) for text in texts.split())


WORDS: tuple[Word, ...] = (
    *_words(
        "a declaration", "mission param include time world region obstacle beacon team agent group graph formation"
    ),
    *_words("a declaration", "separation clearance resource flag let require prefer minimize maximize solve tolerate"),
    Word("obstacles", "a declaration", "SEVERAL", reserved=False),
    Word("regions", "a declaration", "SEVERAL", reserved=False),
    *_words("a shape", "box disc ball cylinder polygon"),
    Word("not", "an operator", "PREFIX", "!"),
    Word("next", "an operator", "PREFIX"),
    Word("arrives", "an operator", "PREFIX"),
    Word("leaves", "an operator", "PREFIX"),
    Word("always", "an operator", "TIME_PREFIX", "G"),
    Word("eventually", "an operator", "TIME_PREFIX", "F"),
    Word("until", "an operator", "TIME_INFIX", "U"),
    Word("release", "an operator", "TIME_INFIX", "Rel"),
    Word("once", "an operator", "TIME_PREFIX"),
    Word("historically", "an operator", "TIME_PREFIX"),
    Word("since", "an operator", "TIME_INFIX"),
    Word("escape", "an operator", "ROUTE_PREFIX", "E"),
    Word("somewhere", "an operator", "ROUTE_PREFIX"),
    Word("everywhere", "an operator", "ROUTE_PREFIX"),
    Word("reach", "an operator", "ROUTE_INFIX", "R"),
    Word("surround", "an operator", "ROUTE_INFIX"),
    Word("count", "an operator"),
    Word("and", "an operator", letter="&"),
    Word("or", "an operator", letter="|"),
    Word("implies", "an operator", letter="->"),
    Word("iff", "an operator", letter="<->"),
    *_words("a quantifier", "every some for"),
    *_words("a quantifier", "least any", reserved=False),
    *_words("a formula", "true false"),
    *_words("a measure", "distance"),
    *_words("a measure", "radius height hops heading", reserved=False),
    *_words("the mission's last step", "end"),
    *_words("a preposition", "at in of on over to with"),
    *_words("a preposition", "per within from", reserved=False),
    *_words("a part of `time`", "step horizon", reserved=False),
    *_words("a motion", "moving along uncertain", reserved=False),
    *_words("a part of a team", "dynamics"),
    *_words("a quantifier", "without"),
    *_words("a part of a team", "start finish vehicle flight yaw", reserved=False),
    *_words("a part of `flight`", "pads", reserved=False),
    *_words("a yaw mode", "path", reserved=False),
    *_words("a kind of graph", "proximity beacons sight", reserved=False),
    *_words("a part of a formation", "total", reserved=False),
    *_words("a part of `prefer`", "weight", reserved=False),
    *_words("a part of `tolerate`", "delay", reserved=False),
    *_words("a part of `from`", "origin layer unknown named", reserved=False),
)
"""Every word of the grammar; a one-letter form (``U``) may also be a name, except for prefix operators."""

SPELLINGS: dict[str, Word] = {word.text: word for word in WORDS} | {word.letter: word for word in WORDS if word.letter}
DECLARATIONS: frozenset[str] = frozenset(word.text for word in WORDS if word.says == "a declaration")
OPERATORS: dict[str, Word] = {word.text: word for word in WORDS if word.says == "an operator"}

STATES: frozenset[str] = frozenset({"x", "y", "z", "speed", "altitude"})
"""Words for an agent's own state in comparisons; they are names in the grammar, but never declared."""

EXTREMES: frozenset[str] = frozenset({"min", "max"})
"""Words for the minimum and maximum of numbers in brackets; they are names if no bracket follows."""

NAME, LABEL, NUMBER, UNIT, TEXT, EXTREME = "NAME", "LABEL", "NUMBER", "UNIT", "TEXT", "EXTREME"
MOST_FINDINGS = 100
"""Maximum number of findings; later ones are mostly consequences of earlier ones."""

SEVERAL = "SEVERAL"
"""Token kind of ``obstacles``, ``regions`` and ``beacons``, which are keywords only before a file."""

PLURALS = frozenset({"obstacles", "regions", "beacons"})

STRAY = "STRAY"
"""Token kind of a character, or a sign of another language, that the grammar does not know."""


class Token(NamedTuple):
    """Token of a mission text; ``kind`` is its kind in the grammar, ``word`` the canonical word of an operator or
    keyword.
    """

    kind: str
    text: str
    span: Span
    word: str = ""
    starts_line: bool = False

    @property
    def declares(self) -> bool:
        """True if this is the first word of a declaration."""
        return self.kind == SEVERAL or (self.word in DECLARATIONS and self.kind == self.word)

    @property
    def may_be_name(self) -> bool:
        return bool(self.word) and self.text[0].isalpha() and not reserved(self.text)


def nameable(text: str) -> bool:
    """Return whether a text has the form of a name; it may still be a word of the language."""
    return _NAME_FORM.fullmatch(text) is not None


def reserved(text: str) -> bool:
    """Return whether a word can never be a name."""
    word = SPELLINGS.get(text)
    if word is None:
        return False
    if text == word.letter:
        return word.token.endswith("PREFIX")
    return word.reserved


# Characters that are invisible, or change the direction of the text around them.
_UNSEEN = r"\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u00ad\u061c\u200b-\u200f\u2028-\u202e\u2060-\u206f\ufeff\ufff9-\ufffb"
_UNSEEN_CHARACTER = re.compile(f"[{_UNSEEN}]")
_TOKEN = re.compile(
    rf"""
    (?:[\s{_UNSEEN}]|\#[^\n]*)*+
    (?: (?P<number> (?:[0-9]+(?:\.[0-9]+)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)? )
    | (?P<word>   [^\W\d]\w* )
    | (?P<text>   "[^"\n]*" )
    | (?P<stray>  <=> | ==>? | => | =< | >< | <> | != | // | /\* | && | \|\| | := | \.\.\. | \*\* | /\\ | \\/ )
    | (?P<sign>   <-> | -> | <= | >= | \.\. | [-+*/=<>()\[\]{{}},:!&|] )
    | (?P<other>  . )
    | (?P<end>    )
    )
    """,
    re.VERBOSE | re.DOTALL,
)
_UNIT = re.compile(r"([A-Za-z]+)(?:/(?:min|ms|s|h)(?:\^?[0-9])?)?(?!\w)")
_NAME_FORM = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_BEFORE_BRACKET = re.compile(r"\s*\(")
_BEFORE_COLON = re.compile(r"\s*:")
BEFORE_FILE = r'(?=\s*(?:from\b|"))'
_BEFORE_FILE = re.compile(BEFORE_FILE)


def tokenise(lines: Span, limits: Limits) -> tuple[list[Token], list[Diagnostic]]:
    """Tokens of complete lines of a text, END last, and errors about single tokens."""
    source, begin, last = lines.source, lines.start, lines.end
    text = source.text
    tokens: list[Token] = []
    findings = _unseen(source, begin, last)
    position = begin
    while (match := _TOKEN.match(text, position, last)) and (group := match.lastgroup) != "end":
        assert group is not None
        start, end = match.span(group)
        starts_line = position == begin or (start > position and "\n" in text[position:start])
        written, word = match[group], ""
        match group:
            case "sign":
                kind = written
            case "number":
                kind = NUMBER
            case "word":
                kind, written = _word(text, start, written, tokens)
                end = start + len(written)
            case "text":
                kind = TEXT
            case _:
                kind = STRAY
        if kind == SEVERAL:
            word = written
        elif kind in (NAME, written) and written in SPELLINGS and SPELLINGS[written].token != SEVERAL:
            word = SPELLINGS[written].text
            kind = SPELLINGS[written].token or word
        token = Token(kind, written, Span(source, start, end), word, starts_line)
        tokens.append(token)
        if kind in _CHECKS and len(findings) < MOST_FINDINGS:
            findings += _CHECKS[kind](token, limits)
        position = end
    tokens.append(Token(END, "", Span(source, last, last), starts_line=True))
    return tokens, findings


def _word(text: str, start: int, written: str, tokens: list[Token]) -> tuple[str, str]:
    """Kind of a word, which depends on the tokens before it, and its full text: a unit may contain a ``/``."""
    before = tokens[-1].kind if tokens else END
    # After `moving (2, 0)`, `per` or a number comes a unit; but in `at least 2 m:` it is a group called `m`.
    counted = [token.kind for token in tokens[-3:-1]] in (["at", "least"], ["without", "any"])
    if before in (NUMBER, ")", "per") and not counted:
        unit = _UNIT.match(text, start)
        if unit and (unit[1] in UNITS or unit[0].lower() in UNITS_IN_FULL):
            return UNIT, unit[0]
    if before in ("require", "prefer") and _BEFORE_COLON.match(text, start + len(written)):
        return LABEL, written
    if written in PLURALS and before != "=" and _BEFORE_FILE.match(text, start + len(written)):
        return SEVERAL, written
    if written in EXTREMES and _BEFORE_BRACKET.match(text, start + len(written)):
        return EXTREME, written
    return NAME, written


# ------------------------------------------------------------------ messages


def quoted(text: str) -> str:
    """The user's text in backticks, shortened if it is long."""
    return f"`{text}`" if len(text) <= 40 else f"`{text[:30]}…`"


def _unseen(source: Source, begin: int, end: int) -> list[Diagnostic]:
    first = 1 if begin == 0 and source.text.startswith("\ufeff") else begin
    return [
        Diagnostic(
            NAME_NOT_ALLOWED,
            f"the character U+{ord(match[0]):04X} is invisible or changes the text direction",
            Label(Span(source, match.start(), match.end())),
            help="delete it",
            fix=Fix(Span(source, match.start(), match.end()), ""),
        )
        for match in islice(_UNSEEN_CHARACTER.finditer(source.text, first, end), MOST_FINDINGS)
    ]


def _check_name(token: Token, limits: Limits) -> list[Diagnostic]:
    if len(token.text) > limits.name_length:
        return [
            Diagnostic(
                NAME_NOT_ALLOWED,
                f"the name has {len(token.text)} characters; the limit is {limits.name_length}",
                Label(token.span),
                help=f"raise the limit with `--limit name_length={len(token.text)}`",
            )
        ]
    if not token.text.isascii():
        return [
            Diagnostic(
                NAME_NOT_ALLOWED,
                f"name {quoted(token.text)} has letters other than a to z",
                Label(token.span),
                help="use the letters a to z, digits and `_`",
            )
        ]
    return []


def _check_number(token: Token, limits: Limits) -> list[Diagnostic]:
    value = float(token.text)
    if len(token.text) <= limits.digits and 1 <= value <= limits.magnitude:
        return []
    digits = token.text.lower().partition("e")[0].replace(".", "").lstrip("0")
    if len(digits) > limits.digits:
        message = f"the number has {len(digits)} digits; at most {limits.digits} are exact"
        advice = f"raise the limit with `--limit digits={len(digits)}`"
    elif not math.isfinite(value):
        message = f"{quoted(token.text)} is larger than any representable number"
        advice = f"write a number up to {limits.magnitude:g}"
    elif value > limits.magnitude:
        message = f"{quoted(token.text)} is larger than {limits.magnitude:g}"
        advice = f"raise the limit with `--limit magnitude={token.text}`"
    elif digits and value == 0:
        message = f"{quoted(token.text)} is smaller than any representable number"
        advice = "write `0`"
    else:
        return []
    fix = Fix(token.span, "0") if advice == "write `0`" else None
    return [Diagnostic(NUMBER_OUT_OF_RANGE, message, Label(token.span), help=advice, fix=fix)]


def _check_unit(token: Token, limits: Limits) -> list[Diagnostic]:
    meant = UNITS_IN_FULL.get(token.text.lower(), "")
    if not meant:
        return []
    message = f"unknown unit {quoted(token.text)}"
    fix = Fix(token.span, meant)
    return [Diagnostic(UNKNOWN_UNIT, message, Label(token.span), help=f"did you mean `{meant}`?", fix=fix)]


_CHECKS: dict[str, Callable[[Token, Limits], list[Diagnostic]]] = {
    NUMBER: _check_number,
    UNIT: _check_unit,
    NAME: _check_name,
    LABEL: _check_name,
}

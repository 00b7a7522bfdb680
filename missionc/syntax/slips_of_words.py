"""Diagnosis of syntax errors with words and names: each function gives the finding of one slip, or nothing."""

from __future__ import annotations

import re

from missionc.base.source import Span
from missionc.base.units import UNITS
from missionc.diagnostics.code import NAME_NOT_ALLOWED, UNKNOWN_OPERATOR, UNKNOWN_UNIT
from missionc.diagnostics.model import Diagnostic, Fix
from missionc.syntax import forms
from missionc.syntax.expected import FORMULA, SHAPES
from missionc.syntax.parse_table import END
from missionc.syntax.stopping_place import Place, finding, just_after, meant_by
from missionc.syntax.tokens import (
    DECLARATIONS,
    NAME,
    NUMBER,
    OPERATORS,
    SPELLINGS,
    STATES,
    TEXT,
    UNIT,
    Token,
    quoted,
    reserved,
)

INFIX = frozenset(
    word.text for word in OPERATORS.values() if "INFIX" in word.token or (not word.token and word.text != "count")
)
BEFORE_OPERAND = (frozenset(OPERATORS) - INFIX) | {"every", "some"}
BOUNDED = frozenset(word.text for word in OPERATORS.values() if word.token in forms.BOUNDS or word.text == "count")


def unknown_declaration(place: Place) -> Diagnostic | None:
    if place.here != place.first:
        return None
    token = place.found
    meant = meant_by(token.text, DECLARATIONS) if token.kind == NAME else ""
    if meant and not token.text.lower().startswith("maximi"):
        message = f"no declaration is called {quoted(token.text)}"
        return finding(message, token.span, f"did you mean `{meant}`?", meant)
    if token.kind in FORMULA - {NAME, NUMBER, "-", "("}:
        message = f"{quoted(token.text)} begins a formula, and a formula stands in a declaration"
        return finding(message, token.span, f"write `require LABEL: {token.text} …`")
    if token.kind in (")", "]", "}"):
        return finding(f"nothing is open that `{token.text}` could close", token.span, "delete it", "")
    if token.text.lower().startswith("maximi"):
        return finding("a mission minimizes", token.span, "write `minimize distance`, `duration` or `energy`")
    message = f"a declaration was expected, not {quoted(token.text)}"
    return finding(message, token.span, f"begin with one of its words, as in `{forms.DECLARED['require']}`")


def reserved_name(place: Place) -> Diagnostic | None:
    token = place.found
    names = place.here == place.first + 1 and place.declaration.declares and place.expected == {NAME}
    if not names or not reserved(token.text) or place.ends:
        return None
    word = SPELLINGS[token.text]
    if token.text == word.letter:
        message = f"`{token.text}` is short for `{word.text}`, so it cannot be a name"
    else:
        message = f"`{token.text}` is a word of the language ({word.says}), so it cannot be a name"
    return finding(message, token.span, f"choose another, such as `{token.text}_1`", code=NAME_NOT_ALLOWED)


def hyphen(place: Place) -> Diagnostic | None:
    """``mission wild-fire``, ``require no-fly: …``"""
    tokens, last = place.tokens, place.first + 1
    if tokens[last].kind != NAME or place.found.kind not in ("-", ":", "=", "[", "{"):
        return None
    while tokens[last + 1].kind == "-" and tokens[last + 2].kind != END:
        joined = tokens[last].span.to(tokens[last + 2].span)
        if any(letter.isspace() for letter in joined.text):
            break
        last += 2
    if last == place.first + 1 or place.here > last + 1:
        return None
    span = tokens[place.first + 1].span.to(tokens[last].span)
    name = span.text.replace("-", "_")
    message = f"{quoted(span.text)} is no name: `-` is the sign for minus"
    return finding(message, span, f"write `{name}`", name, NAME_NOT_ALLOWED)


def unknown_unit(place: Place) -> Diagnostic | None:
    token = place.found
    if token.kind != NAME or place.before.kind != NUMBER or UNIT not in place.expected or token.starts_line:
        return None
    if meant_by(token.text, INFIX):
        return None
    if token.text in STATES:
        words = place.before.span.to(token.span)
        message, advice = (
            f"there is no `*` between the numbers of `{words.text}`",
            f"{place.before.text} * {token.text}",
        )
        return finding(message, words, f"write `{advice}`", advice)
    message = f"no unit is called {quoted(token.text)}"
    return finding(message, token.span, f"the units are {', '.join(UNITS)}", code=UNKNOWN_UNIT)


def unknown_shape(place: Place) -> Diagnostic | None:
    """``region a = circle at (1, 1)``"""
    before = place.before
    in_shape = place.declaration.word in ("region", "obstacle") and place.found.kind in ("at", "(")
    if not in_shape or before.kind != NAME:
        return None
    meant = meant_by(before.text, SHAPES)
    message = f"no shape is called {quoted(before.text)}"
    if meant:
        return finding(message, before.span, f"did you mean `{meant}`?", meant)
    return finding(message, before.span, f"the shapes are {', '.join(sorted(SHAPES))}")


def unknown_operator(place: Place) -> Diagnostic | None:
    """``alwais[0, 5 s] x``, ``nott x``, ``x untill[0, 5 s] y``, ``x annd y``."""
    if not place.in_formula or place.ends:
        return None
    token, before, tokens = place.found, place.before, place.tokens
    opening = place.opened[-1] if place.opened else place.first
    if before.kind == "]":
        opening = place.after(place.here - 1)
    if tokens[opening].kind == "[" and tokens[opening - 1].kind == NAME:
        name = tokens[opening - 1]
        meant = meant_by(name.text, BOUNDED)
        if meant or not _is_team(place, name.text):
            return _no_operator(name, meant)
        if token.kind == ",":
            return finding("members of a team are counted `0..2`, with two points", token.span, "write `..`", "..")
    if "and" not in place.expected:
        return None
    if token.kind == NAME:
        meant = meant_by(token.text, INFIX)
        if meant or place.tokens[place.here + 1].kind == "[":
            return _no_operator(token, meant)
    if before.kind == NAME and (token.kind in FORMULA or token.kind == NAME):
        if before.text in forms.INSTEAD and before.text not in forms.WORDS:
            return _no_operator(before, "")
        meant = meant_by(before.text, BEFORE_OPERAND)
        if meant:
            return _no_operator(before, meant)
    return None


def odd_name(place: Place) -> Diagnostic | None:
    """``region 2nd = …``, ``region "base" = …``"""
    token = place.found
    if place.here != place.first + 1 or place.expected != {NAME} or token.kind not in (NUMBER, TEXT):
        return None
    if token.kind == TEXT:
        return finding("a name stands without quotes", token.span, "delete them", token.text.strip('"'))
    after = place.tokens[place.here + 1]
    words = token.span.to(after.span) if after.span.start == token.span.end else token.span
    return finding(f"{quoted(words.text)} is no name: a name begins with a letter", words, "choose another name")


def no_weight(place: Place) -> Diagnostic | None:
    """``require a: … weight 2``"""
    if place.declaration.word != "require" or place.found.text != "weight" or END not in place.expected:
        return None
    message = "a requirement has no weight: it must hold"
    return finding(message, place.found.span, "delete it, or write `prefer` in place of `require`")


def team_size(place: Place) -> Diagnostic | None:
    """``team drone { … }``"""
    if place.declaration.word != "team" or place.here != place.first + 2 or place.found.kind != "{":
        return None
    name = place.before
    message = f"the team {quoted(name.text)} does not say how many agents it has"
    return finding(message, name.span, f"write `team {name.text}[3]`, or `agent {name.text}` for a single one")


def bare_setting(place: Place) -> Diagnostic | None:
    """``single_integrator(2 m/s)``"""
    if place.found.kind != NUMBER or place.expected != {NAME, ")"} or place.tokens[place.here - 3].kind != "dynamics":
        return None
    message = f"{quoted(place.found.text)} does not say which bound it is"
    start = Span(place.found.span.source, place.found.span.start, place.found.span.start)
    advice = f"write it as in `speed <= {place.found.text} m/s`"
    return finding(message, place.found.span, advice, fix=Fix(start, "speed <= "))


def members(place: Place) -> Diagnostic | None:
    """``group east = drone[0, 1]``"""
    if place.in_formula or not place.in_bounds or ".." not in place.expected or place.found.kind not in (",", ":"):
        return None
    return finding("members of a team are counted `0..2`, with two points", place.found.span, "write `..`", "..")


def inside_without(place: Place) -> Diagnostic | None:
    """``drone[0] in base``, ``every drone: in base``"""
    if not place.in_formula or place.found.kind != "in" or place.in_bounds:
        return None
    message = "there is no `in` in formulas: a region's name says that an agent is in it"
    return finding(message, place.found.span, "write it as in `drone[0]: base`")


def heading_within(place: Place) -> Diagnostic | None:
    """``heading <= 90 deg``, ``heading of 90 deg``"""
    if place.before.kind != "heading" or place.expected != {"within"}:
        return None
    message = "no heading is more or less than another: they go round in a circle"
    return finding(message, place.before.span, "ask how near it is, as in `heading within 10 deg of 90 deg`")


def call_brackets(place: Place) -> Diagnostic | None:
    """``inside base``, ``connected radio``"""
    called = place.before.text in ("inside", "touches", "connected") and place.before.kind == NAME
    if not place.in_formula or not called or place.found.kind != NAME:
        return None
    words = place.before.span.to(place.found.span)
    written = f"{place.before.text}({place.found.text})"
    return finding(f"what {quoted(place.before.text)} is of stands in brackets", words, f"write `{written}`", written)


def label_colon(place: Place) -> Diagnostic | None:
    """``require relay every drone: …``"""
    label = place.tokens[min(place.first + 1, place.here)]
    if place.declaration.word not in ("require", "prefer") or label.kind != NAME:
        return None
    in_brackets = place.opened == (place.first + 2,) and place.tokens[place.first + 2].kind == "("
    if not in_brackets and (place.here != place.first + 2 or place.found.kind not in FORMULA):
        return None
    end = just_after(label.span)
    message = f"`:` was expected after the label {quoted(label.text)}"
    return finding(message, label.span, f"write `{place.declaration.text} {label.text}: …`", fix=Fix(end, ":"))


def quantifier_colon(place: Place) -> Diagnostic | None:
    """``every drone always[…] …``, ``every 40 s some drone: …``"""
    if ":" not in place.expected or not place.expected <= {":", "[", "(", ".."} or not place.in_formula:
        return None
    start = place.after(place.here - 1) - 1 if place.before.kind == "]" else place.here - 1
    number = place.after(start - 1) if place.tokens[start - 1].kind == ")" else start - 1
    if place.tokens[start - 1].kind in ("every", "some"):
        words = place.tokens[start - 1].span.to(place.before.span)
    elif place.before.kind == UNIT and place.tokens[start - 2].kind == "every":
        words = place.tokens[start - 2].span.to(place.before.span)
    elif place.tokens[number - 1].kind in ("least", "any"):
        words = place.tokens[number - 2].span.to(place.before.span)
    else:
        return None
    end = just_after(words)
    message = f"`:` was expected after {quoted(words.text)}"
    return finding(message, words, f"write `{words.text}: …`", fix=Fix(end, ":"))


def part_of_team(place: Place) -> Diagnostic | None:
    """``team drone[2] { strat in base  dynamcs unicycle(speed <= 1) }``, ``start base``"""
    if place.declaration.word not in ("team", "agent") or not place.opened:
        return None
    tokens, here = place.tokens, place.here
    if tokens[here - 2].kind in ("start", "finish") and place.before.kind == NAME and place.found.kind != "(":
        words = tokens[here - 2].span.to(place.before.span)
        in_region = f"{tokens[here - 2].text} in {place.before.text}"
        message = f"{quoted(words.text)} does not say how its places are given: `in`, `at`, `line` or `grid`"
        return finding(message, words, f"write `{in_region}`", in_region)
    for token in (place.before, tokens[here - 2]):
        meant = meant_by(token.text, ("dynamics", "start", "finish")) if token.kind == NAME else ""
        if meant and place.found.kind in ("in", "at", "("):
            message = f"no part of a team is called {quoted(token.text)}"
            return finding(message, token.span, f"did you mean `{meant}`?", meant)
    return None


def at_most(place: Place) -> Diagnostic | None:
    """``at most 2 drone: …``"""
    if place.before.kind != "at" or place.found.text not in forms.INSTEAD or not place.in_formula:
        return None
    words = place.before.span.to(place.found.span)
    advice = f"say it as in `{forms.INSTEAD[place.found.text]}`"
    return finding(f"there is no quantifier {quoted(words.text)}", words, advice)


def at_least_how_many(place: Place) -> Diagnostic | None:
    """``at least drone: …``, ``without any drone: …``"""
    counting = {"least": ("at least", 2), "any": ("without any", 1)}.get(place.tokens[place.here - 2].kind)
    if place.found.kind != ":" or NAME not in place.expected or counting is None:
        return None
    words = place.tokens[place.here - 2].span.to(place.before.span)
    message = f"`{counting[0]}` needs a number before {quoted(place.before.text)}"
    return finding(message, words, f"write `{counting[0]} {counting[1]} {place.before.text}: …`")


def _no_operator(token: Token, meant: str) -> Diagnostic:
    message = f"no operator is called {quoted(token.text)}"
    if meant and token.text.lower() not in forms.INSTEAD:
        return finding(message, token.span, f"did you mean `{meant}`?", meant, UNKNOWN_OPERATOR)
    if token.text.lower() in forms.INSTEAD:
        advice = f"say it as in `{forms.INSTEAD[token.text.lower()]}`"
        return finding(message, token.span, advice, code=UNKNOWN_OPERATOR)
    known = ", ".join(sorted(OPERATORS))
    return finding(message, token.span, f"the operators are {known}", code=UNKNOWN_OPERATOR)


def _is_team(place: Place, name: str) -> bool:
    text = place.declaration.span.source.text
    return re.search(rf'^[^#"\n]*\bteam\s+{re.escape(name)}\b', text, re.MULTILINE) is not None

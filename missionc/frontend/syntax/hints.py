"""Syntax error messages: the tokens expected at the error, and corrections for frequent mistakes.

Each function recognises one kind of mistake, with signs and brackets or with words and names, and returns a finding for
it, or None.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace

from missionc.base.diagnostics.code import NAME_NOT_ALLOWED, UNKNOWN_OPERATOR, UNKNOWN_UNIT
from missionc.base.diagnostics.model import Diagnostic, Fix, Label
from missionc.base.source import Span
from missionc.base.units import UNITS
from missionc.frontend.syntax import forms
from missionc.frontend.syntax.expected import ARITHMETIC, COMPARISONS, FORMULA, SHAPES, SIGNS, in_words
from missionc.frontend.syntax.parse_table import END
from missionc.frontend.syntax.stopping_place import Place, finding, just_after, meant_by
from missionc.frontend.syntax.tokens import (
    DECLARATIONS,
    NAME,
    NUMBER,
    OPERATORS,
    SPELLINGS,
    STATES,
    STRAY,
    TEXT,
    UNIT,
    Token,
    quoted,
    reserved,
)


def foreign_sign(place: Place) -> Diagnostic | None:
    token = place.found
    if token.kind != STRAY:
        return None
    if token.text == ";" and "," in place.expected:
        return finding("unexpected `;`", token.span, "write `,`", ",")
    if token.text in ("^", "**"):
        message = "powers are not supported: a comparison is linear"
        return finding(message, token.span, "write `distance(base)` for a Euclidean distance")
    if token.text in forms.SIGNS:
        ours = forms.SIGNS[token.text]
        if not ours:
            message, advice = f"unexpected {quoted(token.text)}", "delete it"
            if token.text == "." and place.before.kind == NUMBER and place.before.span.end == token.span.start:
                message = "unexpected `.` after a number"
        else:
            message, advice = f"unknown symbol {quoted(token.text)}", f"write `{ours}`"
        return finding(message, token.span, advice, ours)
    if token.text == '"':
        return finding("unterminated text", token.span, 'end the text with `"` on the same line')
    if token.text in ("==", "!=", "<>", "><"):
        if token.text != "==" and counts(place):
            advice = "write `count[…] f < 2 or count[…] f > 2`"
            return finding(f"`{token.text}` cannot compare a count", token.span, advice)
        if "=" in place.expected:
            return finding(f"unexpected `{token.text}`", token.span, "write `=`", "=")
        if token.text == "==" and not counts(place) and place.before.kind == NAME and place.before.text not in STATES:
            return finding("unexpected `==` between formulas", token.span, "write `iff`", "iff")
        return _never_equal(place)
    return finding(f"unexpected {quoted(token.text)}", token.span, "delete it")


def equals(place: Place) -> Diagnostic | None:
    """Finding for an exchanged ``=`` and ``:``, for ``=`` in a comparison, or for a needless sign before a value."""
    token, expected = place.found, place.expected
    if token.kind not in ("=", ":"):
        return None
    wanted = expected & {"=", ":"}
    if len(expected) == 1 and wanted:
        (sign,) = wanted
        return finding(f"expected `{sign}` after {quoted(place.before.text)}", token.span, f"write `{sign}`", sign)
    if token.kind == "=" and place.declaration.word in ("require", "prefer") and place.here == place.first + 2:
        return finding("unexpected `=` after a label", token.span, "write `:`", ":")
    if token.kind == "=" and expected >= COMPARISONS:
        return _never_equal(place)
    if NUMBER in expected and not place.in_formula:
        message = f"unexpected `{token.kind}` after {quoted(place.before.text)}"
        return finding(message, token.span, "delete it", "")
    return None


def _never_equal(place: Place) -> Diagnostic:
    message = f"`{place.found.text}` cannot compare quantities: they are never exactly equal"
    return finding(message, place.found.span, "write a range, for example `x >= 2 and x <= 2.1`")


def counts(place: Place) -> bool:
    """Return whether the comparison of a ``count`` is still missing at the error."""
    return place.in_formula and place.expected >= COMPARISONS and "and" not in place.expected


def counted(place: Place) -> Diagnostic | None:
    """Finding for a count without parentheses, such as ``count[hops 1..1] a and b >= 2``."""
    if not counts(place) or place.found.word not in OPERATORS:
        return None
    message = f"expected a comparison of `count` before {quoted(place.found.text)}"
    return finding(message, place.found.span, "put the counted formula in parentheses: `count[…] (f and g) >= 2`")


def bounds_not_taken(place: Place) -> Diagnostic | None:
    """Finding for bounds after an operator without bounds, such as ``next[1] x`` or ``every[40 s] x``."""
    before = place.before
    adjacent = place.found.kind == "[" and place.found.span.start == before.span.end
    if adjacent and before.kind == "every":
        return finding(
            "unexpected `[` after `every`: its period has no brackets",
            place.found.span,
            "write, for example, `every 40 s: …`",
        )
    if not adjacent or before.word not in OPERATORS or before.kind in forms.BOUNDS:
        return None
    message = f"{quoted(before.text)} takes no bounds"
    advice = "delete the bounds: `next` means one step later" if before.word == "next" else "delete the bounds"
    return finding(message, place.found.span, advice)


def missing_bounds(place: Place) -> Diagnostic | None:
    before = place.before
    if place.expected != {"["} or before.kind not in forms.BOUNDS:
        return None
    what = "a time window" if before.kind.startswith("TIME") else "a route length"
    advice = f"write `{before.text}{forms.BOUNDS[before.kind]}`"
    if before.word == "count":
        advice += f"; to count agents of a team, write `{forms.IN_FORMULA['least']}`"
    return finding(f"{quoted(before.text)} needs {what}", before.span, advice)


def wrong_bounds(place: Place) -> Diagnostic | None:
    """Finding for bounds of the wrong form, such as ``always[5 s]``, ``reach[0..2]`` or ``count[drone]``."""
    if not place.in_bounds:
        return None
    operator, token = place.tokens[place.opened[-1] - 1], place.found
    if operator.kind not in forms.BOUNDS:
        return None
    written = f"write `{operator.text}{forms.BOUNDS[operator.kind]}`"
    if operator.kind.startswith("TIME"):
        if (token.kind in ("..", ":", "to") or token.text == ";") and "," in place.expected:
            return finding("expected `,` between the bounds of a time window", token.span, "write `,`", ",")
        if token.kind == "end":
            message = "`end` can only be the upper bound of a time window"
            return finding(message, token.span, f"write, for example, `{operator.text}[5 s, end]`")
        if token.kind in COMPARISONS or (token.kind == "]" and "," in place.expected):
            return finding(f"the time window of {quoted(operator.text)} needs two bounds", token.span, written)
        if place.before.text in ("hops", "distance"):
            message = f"{quoted(operator.text)} takes a time window, not a route length"
            return finding(message, place.before.span, written)
        return None
    if operator.word == "count" and token.kind == "]" and place.before.kind == NAME:
        message = f"`count` takes a route length, not {quoted(place.before.text)}"
        advice = f"to count agents of a team, write `at least 2 {place.before.text}: …`"
        return finding(message, place.before.span, advice)
    if place.expected == {"hops", "distance", NAME}:
        message = f"the route length of {quoted(operator.text)} needs `hops` or `distance`"
        return finding(message, operator.span, written)
    if ".." in place.expected:
        if token.kind == ",":
            return finding("expected `..` between the bounds of a length", token.span, "write `..`", "..")
        if token.kind in ("]", "on"):
            value = quoted(place.tokens[place.opened[-1] + 2].span.to(place.before.span).text)
            message = f"{value} is neither a lower nor an upper bound"
            return finding(message, place.before.span, "write `2..2`, `2..` or `<= 2`")
    if token.kind in COMPARISONS | {"=", ".."} and "<=" in place.expected:
        return finding("expected a length such as `<= 2`, `1..2` or `1..`", token.span, written)
    return None


def missing_comma(place: Place) -> Diagnostic | None:
    """Finding for a missing comma, as in ``polygon (1, 1) (2, 2)``."""
    if "," not in place.expected or place.before.kind != ")" or place.found.kind != "(":
        return None
    end = just_after(place.before.span)
    return finding("expected `,` between two points", place.found.span, "write `,`", fix=Fix(end, ","))


def needless_comma(place: Place) -> Diagnostic | None:
    """Finding for a needless comma, as in ``radius 0.1, dynamics …``."""
    following = place.tokens[place.here + 1] if place.found.kind == "," else place.found
    if place.found.kind != "," or place.in_formula:
        return None
    if following.kind not in place.expected and not (following.may_be_name and NAME in place.expected):
        return None
    message = f"unexpected `,` between {quoted(place.before.text)} and {quoted(following.text)}"
    return finding(message, place.found.span, "delete it", "")


def two_comparisons(place: Place) -> Diagnostic | None:
    if place.found.kind in COMPARISONS and "and" in place.expected and "<=" not in place.expected:
        return finding(
            "chained comparison: a comparison has two sides",
            place.found.span,
            "split the comparison, for example `x >= 0 and x <= 3`",
        )
    return None


def bare_arithmetic(place: Place) -> Diagnostic | None:
    if place.found.kind not in ARITHMETIC or place.expected & ARITHMETIC:
        return None
    tokens, last = place.tokens, place.here - 1
    if tokens[last].kind == ")":
        inside = tokens[place.after(last) : last]
        if any(token.kind in (",", ":") for token in inside):
            return None
    elif tokens[last].kind == NAME:
        if place.declaration.word in ("region", "obstacle", "group", "graph", "formation", "minimize", "maximize"):
            return None
    elif tokens[last].kind not in (NUMBER, UNIT):
        return None
    return finding("arithmetic needs parentheses here", place.found.span, "write, for example, `(T + 3 s)`")


def brackets(place: Place) -> Diagnostic | None:
    """Finding for a bracket that is never closed, or closed by another kind of bracket."""
    token = place.found
    closing = {"(": ")", "[": "]", "{": "}"}
    if not place.opened:
        if token.kind in (")", "]", "}") and (END in place.expected):
            return finding(f"unmatched `{token.text}`", token.span, "delete it", "")
        return None
    opening = place.tokens[place.opened[-1]]
    closer = closing[opening.kind]
    label = (Label(opening.span, "opened here"),)
    if place.ends and closer in place.expected:
        end = just_after(place.before.span)
        message = f"expected `{closer}` after {quoted(place.before.text)}: unclosed bracket"
        return finding(message, place.before.span, f"add the closing `{closer}`", fix=Fix(end, closer), labels=label)
    if token.kind in closing.values() and token.kind != closer:
        return finding(f"`{token.kind}` does not close `{opening.kind}`", token.span, f"write `{closer}`", labels=label)
    return None


def limit(place: Place) -> Diagnostic | None:
    """Finding for a limit with a sign other than ``<=``, as in ``single_integrator(speed < 2 m/s)``."""
    if place.found.kind in COMPARISONS | {"="} and "<=" in place.expected and not place.in_formula:
        return finding("expected `<=`: a limit is inclusive", place.found.span, "write `<=`", "<=")
    return None


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
    if meant:
        message = f"unknown declaration {quoted(token.text)}"
        return finding(message, token.span, f"did you mean `{meant}`?", meant)
    if token.kind in FORMULA - {NAME, NUMBER, "-", "("}:
        message = f"unexpected {quoted(token.text)}: a formula belongs in a declaration"
        return finding(message, token.span, f"write `require LABEL: {token.text} …`")
    if token.kind in (")", "]", "}"):
        return finding(f"unmatched `{token.text}`", token.span, "delete it", "")
    message = f"expected a declaration, found {quoted(token.text)}"
    return finding(message, token.span, f"begin with a keyword, for example `{forms.DECLARED['require']}`")


def reserved_name(place: Place) -> Diagnostic | None:
    token = place.found
    names = place.here == place.first + 1 and place.declaration.declares and place.expected == {NAME}
    if not names or not reserved(token.text) or place.ends:
        return None
    word = SPELLINGS[token.text]
    if token.text == word.letter:
        message = f"`{token.text}` is short for `{word.text}` and cannot be a name"
    else:
        message = f"`{token.text}` is a keyword ({word.says}) and cannot be a name"
    return finding(message, token.span, f"choose another name, such as `{token.text}_1`", code=NAME_NOT_ALLOWED)


def hyphen(place: Place) -> Diagnostic | None:
    """Finding for a hyphen in a name, as in ``mission wild-fire``."""
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
    message = f"invalid name {quoted(span.text)}: a name has no `-`"
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
            f"missing `*` in `{words.text}`",
            f"{place.before.text} * {token.text}",
        )
        return finding(message, words, f"write `{advice}`", advice)
    message = f"unknown unit {quoted(token.text)}"
    return finding(message, token.span, f"use one of the units {', '.join(UNITS)}", code=UNKNOWN_UNIT)


def unknown_shape(place: Place) -> Diagnostic | None:
    """Finding for an unknown shape, as in ``region a = circle at (1, 1)``."""
    before = place.before
    in_shape = place.declaration.word in ("region", "obstacle") and place.found.kind in ("at", "(")
    if not in_shape or before.kind != NAME:
        return None
    meant = meant_by(before.text, SHAPES)
    message = f"unknown shape {quoted(before.text)}"
    if meant:
        return finding(message, before.span, f"did you mean `{meant}`?", meant)
    return finding(message, before.span, f"use one of the shapes {', '.join(sorted(SHAPES))}")


def unknown_operator(place: Place) -> Diagnostic | None:
    """Finding for a misspelt operator, such as ``alwais[0, 5 s] x`` or ``x untill[0, 5 s] y``."""
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
            return finding("expected `..` in a range of members", token.span, "write `..`", "..")
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
    """Finding for an invalid name, as in ``region 2nd = …`` or ``region "base" = …``."""
    token = place.found
    if place.here != place.first + 1 or place.expected != {NAME} or token.kind not in (NUMBER, TEXT):
        return None
    if token.kind == TEXT:
        return finding("unexpected quotes around a name", token.span, "delete the quotes", token.text.strip('"'))
    after = place.tokens[place.here + 1]
    words = token.span.to(after.span) if after.span.start == token.span.end else token.span
    return finding(f"invalid name {quoted(words.text)}: a name begins with a letter", words, "choose another name")


def no_weight(place: Place) -> Diagnostic | None:
    """Finding for a requirement with a weight, as in ``require a: … weight 2``."""
    if place.declaration.word != "require" or place.found.text != "weight" or END not in place.expected:
        return None
    message = "unexpected `weight`: only a preference has a weight"
    return finding(message, place.found.span, "write `prefer` in place of `require`")


def team_size(place: Place) -> Diagnostic | None:
    """Finding for a team without a size, as in ``team drone { … }``."""
    if place.declaration.word != "team" or place.here != place.first + 2 or place.found.kind != "{":
        return None
    name = place.before
    message = f"team {quoted(name.text)} has no size"
    return finding(message, name.span, f"write, for example, `team {name.text}[3]`")


def bare_setting(place: Place) -> Diagnostic | None:
    """Finding for a limit without its name, as in ``single_integrator(2 m/s)``."""
    if place.found.kind != NUMBER or place.expected != {NAME, ")"} or place.tokens[place.here - 3].kind != "dynamics":
        return None
    message = f"expected a setting, found {quoted(place.found.text)}"
    start = Span(place.found.span.source, place.found.span.start, place.found.span.start)
    advice = f"write, for example, `speed <= {place.found.text} m/s`"
    return finding(message, place.found.span, advice, fix=Fix(start, "speed <= "))


def members(place: Place) -> Diagnostic | None:
    """Finding for a range of members without ``..``, as in ``group east = drone[0, 1]``."""
    if place.in_formula or not place.in_bounds or ".." not in place.expected or place.found.kind not in (",", ":"):
        return None
    return finding("expected `..` in a range of members", place.found.span, "write `..`", "..")


def inside_without(place: Place) -> Diagnostic | None:
    """Finding for a needless ``in`` before a region, as in ``drone[0] in base``."""
    if not place.in_formula or place.found.kind != "in" or place.in_bounds:
        return None
    message = "unexpected `in`: in a formula, the name of a region is enough"
    return finding(message, place.found.span, "write, for example, `drone[0]: base`")


def heading_within(place: Place) -> Diagnostic | None:
    """Finding for a compared heading, as in ``heading <= 90 deg``."""
    if place.before.kind != "heading" or place.expected != {"within"}:
        return None
    message = "headings cannot be compared: they are angles of a circle"
    return finding(message, place.before.span, "write, for example, `heading within 10 deg of 90 deg`")


def call_brackets(place: Place) -> Diagnostic | None:
    """Finding for a predicate without brackets, such as ``inside base``."""
    called = place.before.text in ("inside", "touches", "connected") and place.before.kind == NAME
    if not place.in_formula or not called or place.found.kind != NAME:
        return None
    words = place.before.span.to(place.found.span)
    written = f"{place.before.text}({place.found.text})"
    return finding(f"{quoted(place.before.text)} needs parentheses", words, f"write `{written}`", written)


def label_colon(place: Place) -> Diagnostic | None:
    """Finding for a missing colon after a label, as in ``require relay every drone: …``."""
    label = place.tokens[min(place.first + 1, place.here)]
    if place.declaration.word not in ("require", "prefer") or label.kind != NAME:
        return None
    in_brackets = place.opened == (place.first + 2,) and place.tokens[place.first + 2].kind == "("
    if not in_brackets and (place.here != place.first + 2 or place.found.kind not in FORMULA):
        return None
    end = just_after(label.span)
    message = f"expected `:` after the label {quoted(label.text)}"
    return finding(message, label.span, f"write `{place.declaration.text} {label.text}: …`", fix=Fix(end, ":"))


def quantifier_colon(place: Place) -> Diagnostic | None:
    """Finding for a missing colon after a quantifier, as in ``every drone always[…] …``."""
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
    message = f"expected `:` after {quoted(words.text)}"
    return finding(message, words, f"write `{words.text}: …`", fix=Fix(end, ":"))


def part_of_team(place: Place) -> Diagnostic | None:
    """Finding for a misspelt or incomplete item of a team, as in ``team drone[2] { strat in base }``."""
    if place.declaration.word not in ("team", "agent") or not place.opened:
        return None
    tokens, here = place.tokens, place.here
    if tokens[here - 2].kind in ("start", "finish") and place.before.kind == NAME and place.found.kind != "(":
        words = tokens[here - 2].span.to(place.before.span)
        in_region = f"{tokens[here - 2].text} in {place.before.text}"
        message = f"{quoted(words.text)} needs `in`, `at`, `line` or `grid`"
        return finding(message, words, f"write `{in_region}`", in_region)
    for token in (place.before, tokens[here - 2]):
        meant = meant_by(token.text, ("dynamics", "start", "finish")) if token.kind == NAME else ""
        if meant and place.found.kind in ("in", "at", "("):
            message = f"unknown setting {quoted(token.text)} of a team"
            return finding(message, token.span, f"did you mean `{meant}`?", meant)
    return None


def at_most(place: Place) -> Diagnostic | None:
    """Finding for an unknown quantifier, such as ``at most 2 drone: …``."""
    if place.before.kind != "at" or place.found.text not in forms.INSTEAD or not place.in_formula:
        return None
    words = place.before.span.to(place.found.span)
    advice = f"write, for example, `{forms.INSTEAD[place.found.text]}`"
    return finding(f"unknown quantifier {quoted(words.text)}", words, advice)


def at_least_how_many(place: Place) -> Diagnostic | None:
    """Finding for a quantifier without its number, such as ``at least drone: …``."""
    counting = {"least": ("at least", 2), "any": ("without any", 1)}.get(place.tokens[place.here - 2].kind)
    if place.found.kind != ":" or NAME not in place.expected or counting is None:
        return None
    words = place.tokens[place.here - 2].span.to(place.before.span)
    message = f"`{counting[0]}` needs a number before {quoted(place.before.text)}"
    return finding(message, words, f"write `{counting[0]} {counting[1]} {place.before.text}: …`")


def _no_operator(token: Token, meant: str) -> Diagnostic:
    message = f"unknown operator {quoted(token.text)}"
    if meant and token.text.lower() not in forms.INSTEAD:
        return finding(message, token.span, f"did you mean `{meant}`?", meant, UNKNOWN_OPERATOR)
    if token.text.lower() in forms.INSTEAD:
        advice = f"write, for example, `{forms.INSTEAD[token.text.lower()]}`"
        return finding(message, token.span, advice, code=UNKNOWN_OPERATOR)
    known = ", ".join(sorted(OPERATORS))
    return finding(message, token.span, f"use one of the operators {known}", code=UNKNOWN_OPERATOR)


def _is_team(place: Place, name: str) -> bool:
    text = place.declaration.span.source.text
    return re.search(rf'^[^#"\n]*\bteam\s+{re.escape(name)}\b', text, re.MULTILINE) is not None


def explain(place: Place) -> Diagnostic:
    """Finding about a syntax error: a known mistake, or otherwise the expected tokens."""
    if place.expected == {"=", "["}:
        place = replace(place, expected=frozenset({"="}))
    for slip in SLIPS:
        meant = slip(place)
        if meant is not None:
            return meant
    return _plain(place)


def _plain(place: Place) -> Diagnostic:
    """Finding that states only the expected tokens."""
    expected, before, token = place.expected, place.before, place.found
    message = f"expected {in_words(expected, before)} after {quoted(before.text)}"
    advice = f"write, for example, `{_form(place)}`"
    labels: tuple[Label, ...] = ()
    if place.opened:
        labels = (Label(place.tokens[place.opened[-1]].span, "inside this bracket"),)
    end = just_after(before.span)
    fix = Fix(end, next(iter(expected))) if len(expected) == 1 and expected <= SIGNS - set("([{}])") else None
    if place.ends:
        message += ", found the end of the file" if token.kind == END else ""
        return finding(message, before.span, advice, fix=fix, labels=labels)
    return finding(f"{message}, found {quoted(token.text)}", token.span, advice, fix=fix, labels=labels)


def _form(place: Place) -> str:
    """Example of the smallest part of the declaration that encloses the error."""
    tokens, unexpected = place.tokens, place.found
    if place.in_formula:
        if place.opened and tokens[place.opened[-1] - 1].kind in forms.BOUNDS:
            operator = tokens[place.opened[-1] - 1]
            return f"{operator.text}{forms.BOUNDS[operator.kind]}"
        if counts(place):
            return forms.IN_FORMULA["count"]
        for token in (place.before, unexpected):
            if token.word in forms.IN_FORMULA:
                return forms.IN_FORMULA[token.word]
    else:
        for at in range(place.here - 1, place.first, -1):
            if tokens[at].kind in forms.PARTS and place.declaration.word != "resource":
                return forms.PARTS[tokens[at].kind]
    return forms.DECLARED[place.declaration.word]


SLIPS: tuple[Callable[[Place], Diagnostic | None], ...] = (
    wrong_bounds,
    foreign_sign,
    unknown_declaration,
    reserved_name,
    odd_name,
    no_weight,
    team_size,
    bare_setting,
    members,
    inside_without,
    call_brackets,
    heading_within,
    hyphen,
    unknown_unit,
    unknown_shape,
    quantifier_colon,
    unknown_operator,
    label_colon,
    at_least_how_many,
    at_most,
    part_of_team,
    limit,
    equals,
    missing_bounds,
    bounds_not_taken,
    missing_comma,
    needless_comma,
    counted,
    two_comparisons,
    bare_arithmetic,
    brackets,
)
"""Functions that recognise mistakes, in order; the first that returns a finding decides."""

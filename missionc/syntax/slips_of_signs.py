"""Diagnosis of syntax errors with signs and brackets: each function gives the finding of one slip, or nothing."""

from __future__ import annotations

from missionc.diagnostics.model import Diagnostic, Fix, Label
from missionc.syntax import forms
from missionc.syntax.expected import ARITHMETIC, COMPARISONS
from missionc.syntax.parse_table import END
from missionc.syntax.stopping_place import Place, finding, just_after
from missionc.syntax.tokens import NAME, NUMBER, OPERATORS, STATES, STRAY, UNIT, quoted


def foreign_sign(place: Place) -> Diagnostic | None:
    token = place.found
    if token.kind != STRAY:
        return None
    if token.text == ";" and "," in place.expected:
        return finding("`;` is not a sign of the language", token.span, "write `,`", ",")
    if token.text in ("^", "**"):
        message = "there are no powers: a comparison is linear"
        return finding(message, token.span, "multiply by numbers only; `distance(base)` is a distance")
    if token.text in forms.SIGNS:
        ours = forms.SIGNS[token.text]
        if not ours:
            message, advice = f"{quoted(token.text)} stands between no declarations and ends none", "delete it"
            if token.text == "." and place.before.kind == NUMBER and place.before.span.end == token.span.start:
                message = "a number does not end in a point"
        else:
            message, advice = f"{quoted(token.text)} is not a sign of the language", f"write `{ours}`"
        return finding(message, token.span, advice, ours)
    if token.text == '"':
        return finding("the text that starts here has no end", token.span, 'close it with `"` on the same line')
    if token.text in ("==", "!=", "<>", "><"):
        if token.text != "==" and counts(place):
            advice = "ask for either: `count[…] f < 2 or count[…] f > 2`"
            return finding(f"`{token.text}` does not compare a count", token.span, advice)
        if "=" in place.expected:
            return finding(f"`{token.text}` is not a sign of the language", token.span, "write `=`", "=")
        if token.text == "==" and not counts(place) and place.before.kind == NAME and place.before.text not in STATES:
            return finding("`==` is not a sign of the language", token.span, "of two formulas, write `iff`", "iff")
        return _never_equal(place)
    return finding(f"{quoted(token.text)} means nothing in the language", token.span, "delete it")


def equals(place: Place) -> Diagnostic | None:
    """``=`` or ``:`` for one another, in a comparison, or before a value that needs none."""
    token, expected = place.found, place.expected
    if token.kind not in ("=", ":"):
        return None
    wanted = expected & {"=", ":"}
    if len(expected) == 1 and wanted:
        (sign,) = wanted
        return finding(f"`{sign}` was expected after {quoted(place.before.text)}", token.span, f"write `{sign}`", sign)
    if token.kind == "=" and place.declaration.word in ("require", "prefer") and place.here == place.first + 2:
        return finding("a requirement's label ends in `:`", token.span, "write `:`", ":")
    if token.kind == "=" and expected >= COMPARISONS:
        return _never_equal(place)
    if NUMBER in expected and not place.in_formula:
        message = f"there is no `{token.kind}` between {quoted(place.before.text)} and what it is"
        return finding(message, token.span, "delete it", "")
    return None


def _never_equal(place: Place) -> Diagnostic:
    message = f"`{place.found.text}` compares nothing: no two measures are ever exactly equal"
    return finding(message, place.found.span, "say how close: `x >= 2 and x <= 2.1`")


def counts(place: Place) -> bool:
    """Whether the comparison of a ``count`` is still to come."""
    return place.in_formula and place.expected >= COMPARISONS and "and" not in place.expected


def counted(place: Place) -> Diagnostic | None:
    """``count[hops 1..1] a and b >= 2``"""
    if not counts(place) or place.found.word not in OPERATORS:
        return None
    message = f"the comparison of `count` was expected before {quoted(place.found.text)}"
    return finding(message, place.found.span, "put what is counted in brackets: `count[…] (f and g) >= 2`")


def bounds_not_taken(place: Place) -> Diagnostic | None:
    """``next[1] x``, ``x and[0, 5 s] y``, ``every[40 s] x``"""
    before = place.before
    adjacent = place.found.kind == "[" and place.found.span.start == before.span.end
    if adjacent and before.kind == "every":
        return finding("`every` has its period without brackets", place.found.span, "write it as in `every 40 s: …`")
    if not adjacent or before.word not in OPERATORS or before.kind in forms.BOUNDS:
        return None
    message = f"{quoted(before.text)} takes no bounds"
    advice = "delete them; `next` is one step ahead" if before.word == "next" else "delete them"
    return finding(message, place.found.span, advice)


def missing_bounds(place: Place) -> Diagnostic | None:
    before = place.before
    if place.expected != {"["} or before.kind not in forms.BOUNDS:
        return None
    what = "over which time" if before.kind.startswith("TIME") else "how far"
    written = f"{before.text}{forms.BOUNDS[before.kind]}"
    return finding(f"{quoted(before.text)} needs its bounds, to say {what}", before.span, f"write `{written}`")


def wrong_bounds(place: Place) -> Diagnostic | None:
    """``always[5 s]``, ``always[0..5 s]``, ``reach[0..2]``, ``reach[hops 0, 2]``, ``reach[hops 2]``."""
    if not place.in_bounds:
        return None
    operator, token = place.tokens[place.opened[-1] - 1], place.found
    if operator.kind not in forms.BOUNDS:
        return None
    written = f"write `{operator.text}{forms.BOUNDS[operator.kind]}`"
    if operator.kind.startswith("TIME"):
        if (token.kind in ("..", ":", "to") or token.text == ";") and "," in place.expected:
            return finding("a comma stands between the ends of a window", token.span, "write `,`", ",")
        if token.kind == "end":
            message = "`end` is the later bound of a window, by itself"
            return finding(message, token.span, f"write it as in `{operator.text}[5 s, end]`")
        if token.kind in COMPARISONS or (token.kind == "]" and "," in place.expected):
            return finding(f"a window has two ends: {quoted(operator.text)} from when to when", token.span, written)
        if place.before.text in ("hops", "distance"):
            message = f"{quoted(operator.text)} looks along time, not along a route"
            return finding(message, place.before.span, written)
        return None
    if place.expected == {"hops", "distance", NAME}:
        message = f"{quoted(operator.text)} needs to know what it counts, `hops` or `distance`"
        return finding(message, operator.span, written)
    if ".." in place.expected:
        if token.kind == ",":
            return finding("two points stand between the ends of a length", token.span, "write `..`", "..")
        if token.kind in ("]", "on"):
            value = quoted(place.tokens[place.opened[-1] + 2].span.to(place.before.span).text)
            message = f"{value} alone does not say whether it is the least or the most"
            return finding(message, place.before.span, "write it as in `2..2`, `2..` or `<= 2`")
    if token.kind in COMPARISONS | {"=", ".."} and "<=" in place.expected:
        return finding("a length is `<= 2`, or `1..2`, or `1..`", token.span, written)
    return None


def missing_comma(place: Place) -> Diagnostic | None:
    """``polygon (1, 1) (2, 2)``"""
    if "," not in place.expected or place.before.kind != ")" or place.found.kind != "(":
        return None
    end = just_after(place.before.span)
    return finding("`,` was expected between two points", place.found.span, "write `,`", fix=Fix(end, ","))


def needless_comma(place: Place) -> Diagnostic | None:
    """``radius 0.1, dynamics …``, ``disc at (1, 1), radius 1``"""
    following = place.tokens[place.here + 1] if place.found.kind == "," else place.found
    if place.found.kind != "," or place.in_formula:
        return None
    if following.kind not in place.expected and not (following.may_be_name and NAME in place.expected):
        return None
    message = f"no comma stands between {quoted(place.before.text)} and {quoted(following.text)}"
    return finding(message, place.found.span, "delete it", "")


def two_comparisons(place: Place) -> Diagnostic | None:
    if place.found.kind in COMPARISONS and "and" in place.expected and "<=" not in place.expected:
        return finding("a comparison has two sides, not three", place.found.span, "write `x >= 0 and x <= 3`")
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
        if place.declaration.word in ("region", "obstacle", "group", "graph", "formation", "minimize"):
            return None
    elif tokens[last].kind not in (NUMBER, UNIT):
        return None
    return finding("arithmetic stands in brackets here", place.found.span, "write it as in `(T + 3 s)`")


def brackets(place: Place) -> Diagnostic | None:
    """One that is never closed, or closed by another kind."""
    token = place.found
    closing = {"(": ")", "[": "]", "{": "}"}
    if not place.opened:
        if token.kind in (")", "]", "}") and (END in place.expected):
            return finding(f"nothing is open that `{token.text}` could close", token.span, "delete it", "")
        return None
    opening = place.tokens[place.opened[-1]]
    closer = closing[opening.kind]
    label = (Label(opening.span, "opened here"),)
    if place.ends and closer in place.expected:
        end = just_after(place.before.span)
        message = f"`{closer}` was expected after {quoted(place.before.text)}: a bracket is still open"
        return finding(message, place.before.span, f"close it with `{closer}`", fix=Fix(end, closer), labels=label)
    if token.kind in closing.values() and token.kind != closer:
        return finding(f"`{token.kind}` does not close `{opening.kind}`", token.span, f"write `{closer}`", labels=label)
    return None


def limit(place: Place) -> Diagnostic | None:
    """``single_integrator(speed < 2 m/s)``"""
    if place.found.kind in COMPARISONS | {"="} and "<=" in place.expected and not place.in_formula:
        return finding("a limit is inclusive", place.found.span, "write `<=`", "<=")
    return None

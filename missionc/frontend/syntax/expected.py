"""Text for the tokens that a parser state expects, in words instead of token names."""

from __future__ import annotations

from missionc.frontend.syntax.parse_table import END
from missionc.frontend.syntax.tokens import EXTREME, LABEL, NAME, NUMBER, TEXT, UNIT, Token

SIGNS = frozenset("=:,()[]{}") | {".."}
COMPARISONS = frozenset({"<=", "<", ">", ">="})
ARITHMETIC = frozenset("+-*/")
JOINING = frozenset({"and", "or", "implies", "iff", "TIME_INFIX", "ROUTE_INFIX"})
FORMULA = frozenset(
    {"PREFIX", "TIME_PREFIX", "ROUTE_PREFIX", "count", "every", "some", "for", "at", "without", "true", "false"}
) | {
    *("distance", "heading", NAME, NUMBER, EXTREME, "(", "-"),
}
SHAPES = frozenset({"box", "disc", "ball", "cylinder", "polygon"})

# Kind of name that follows each word.
_NAMES = {
    "in": "a region",
    "on": "a graph",
    "over": "a team, group or agent",
    "of": "a team, group or agent",
    "to": "a team, group or agent",
    "every": "a team, group or agent, or a period such as `40 s`",
    "some": "a team, group or agent",
    "with": "a backend (`auto`, `smt`, `clot`, `hybrid`)",
    "minimize": "`duration`, `energy`",
    "maximize": "`robustness`",
    "dynamics": "a kind of dynamics such as `single_integrator`",
    "formation": "a name",
    "include": "a name",
}

# In this order; each phrase removes its tokens from the remaining ones.
_PHRASES: tuple[tuple[frozenset[str], frozenset[str], str], ...] = (
    (frozenset({"PREFIX"}), FORMULA | {LABEL}, "a formula"),
    (frozenset({"mission", "region"}), frozenset(), "a declaration"),
    (SHAPES, SHAPES | {NAME, "("}, "a shape"),
    (frozenset({NUMBER}), FORMULA, "a number or a parameter"),
    (JOINING, JOINING | COMPARISONS | ARITHMETIC | {UNIT, "[", "(", ":"}, "an operator"),
    (COMPARISONS, COMPARISONS | ARITHMETIC | {UNIT, "[", "(", "="}, "a comparison such as `>= 2`"),
    (frozenset({"in", "at", NAME}), frozenset({"in", "at", "from", NAME}), "a position (`in`, `at`, `line` or `grid`)"),
    (frozenset({"dynamics", NAME}), frozenset({NAME}), "a setting such as `radius 0.1 m`"),
    (frozenset({"total", NAME}), frozenset({NAME}), "a setting such as `tolerance 0.1 m`"),
    (frozenset({TEXT}), frozenset({TEXT}), "a file name in double quotes"),
)


def in_words(expected: frozenset[str], before: Token) -> str:
    """Text for the tokens expected after a token, such as ``a number or a parameter``."""
    rest = set(expected)
    phrases = []
    if {"mission", "region"} <= rest:
        return "a declaration"
    if before.word == "every" and NUMBER in rest:
        return _NAMES["every"]
    if rest == {"("} and before.word != "distance":
        return "a point such as `(1, 2)`"
    for marks, covers, phrase in _PHRASES:
        if marks <= rest:
            phrases.append(phrase)
            rest -= covers
    if NAME in rest:
        phrases.append(_NAMES.get(before.word, "a name"))
        rest.discard(NAME)
    if len(rest - ARITHMETIC - {UNIT}) > 0:
        rest -= ARITHMETIC | {UNIT}
    if UNIT in rest:
        phrases.append("a unit")
        rest.discard(UNIT)
    ends = END in rest
    rest.discard(END)
    phrases += [f"`{word}`" for word in sorted(rest, key=lambda word: (word not in ("=", ",", ":"), word))]
    if ends:
        phrases.append("the next declaration")
    return " or ".join(filter(None, (", ".join(phrases[:-1]), phrases[-1])))

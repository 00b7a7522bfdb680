"""Help on the language's words in Markdown, from the definitions of operators, predicates, forms and parameters."""

from __future__ import annotations

from missionc.base.units import UNITS
from missionc.frontend.resolve.called_predicates import CALLED
from missionc.frontend.resolve.resolve_agents import settings_of
from missionc.frontend.resolve.show_ir import figures_of
from missionc.frontend.syntax import forms
from missionc.frontend.syntax.tokens import SPELLINGS, STATES, UNIT, WORDS, Token
from missionc.ir import FIGURES, PAD_FIGURES
from missionc.ir.dynamics import KINDS
from missionc.ir.language.operators import by_name
from missionc.ir.language.predicates import HEADING
from missionc.ir.vehicle_profiles import example, profiles
from missionc.ir.wording import listed

QUANTIFIERS = {
    "every": "each of these agents satisfies the formula",
    "some": "at least one of these agents satisfies the formula",
    "least": "at least the given number of these agents satisfy the formula",
    "without": "the team satisfies the formula after the loss of any given number of these agents",
    "any": "the team satisfies the formula after the loss of any given number of these agents",
}

STATE_MEANINGS = {
    "x": "the x coordinate of the agent's centre, in metres",
    "y": "the y coordinate of the agent's centre, in metres",
    "z": "the z coordinate of the agent's centre, in metres",
    "speed": "the speed of the agent, in m/s",
    "altitude": "the altitude of the agent, in metres",
}
assert STATE_MEANINGS.keys() == STATES


def meaning(token: Token, before: Token | None = None) -> str:
    """Explanation of a token in Markdown; empty if there is none.

    Args:
        token: token to explain.
        before: token before it, or None.
    """
    if token.kind == UNIT:
        return _of_unit(token.text)
    if before is not None and before.word == "vehicle" and token.text in profiles():
        return vehicle(token.text)
    if before is not None and before.word == "dynamics" and (kind := KINDS.usable(token.text)):
        return f"`{token.text}`: a kind of dynamics; parameters: {listed([f'`{each}`' for each in settings_of(kind)])}"
    word = token.word
    if word in QUANTIFIERS:
        quantifier = _entry("a quantifier", word, QUANTIFIERS[word], forms.IN_FORMULA[word])
        return f"{quantifier}\n\n{_of_operator(word)}" if word in by_name else quantifier
    if word in by_name:
        return _of_operator(word)
    if token.declares:
        return _entry("a declaration", word, "", forms.DECLARED[word])
    predicate = HEADING if token.kind == HEADING.name else CALLED.usable(token.text)
    if predicate is not None:
        return _entry("a predicate", token.text, predicate.says, predicate.example)
    if word in forms.PARTS:
        return _entry(SPELLINGS[word].says, word, "", forms.PARTS[word])
    if token.text in STATE_MEANINGS:
        return _entry("a part of an agent's state", token.text, STATE_MEANINGS[token.text], f"{token.text} <= 1")
    if token.text in FIGURES:
        return figure(token.text)
    if token.text in PAD_FIGURES:
        known = PAD_FIGURES[token.text]
        form = f"{token.text} {known.relation} {example(known)}".replace("  ", " ")
        return _entry(f"{known.dimension.value} of a `flight`", token.text, known.says, form)
    if word:
        form = forms.IN_FORMULA.get(word, "")
        return _entry(next(known.says for known in WORDS if known.text == word), word, "", form)
    return ""


def _of_operator(word: str) -> str:
    operator = by_name[word]
    takes = f"; bounds: {operator.bounds.value}" if "[" in operator.example else ""
    return _entry("an operator", word, f"{operator.says}{takes}", operator.example)


def figure(name: str) -> str:
    """Explanation of a vehicle parameter in Markdown."""
    known = FIGURES[name]
    relation = f" {known.relation} " if known.relation == "<=" else " "
    return _entry(f"{known.dimension.value} of a vehicle", name, known.says, f"{name}{relation}{example(known)}")


def vehicle(name: str) -> str:
    """All parameters of a vehicle profile in Markdown."""
    figures = "\n".join(f"{figure} {text}" for figure, text in figures_of(profiles()[name]) if text)
    return f"`{name}`: a vehicle\n\n```\n{figures or 'no limits'}\n```"


def _of_unit(unit: str) -> str:
    if unit not in UNITS:
        return ""
    dimension, factor = UNITS[unit]
    main = next(name for name, (other, one) in UNITS.items() if other is dimension and one == 1.0)
    same = "" if unit == main else f": {factor:.10g} {main}"
    return f"`{unit}`: a unit of {dimension.value.partition(' ')[2]}{same}"


def _entry(kind: str, word: str, says: str, form: str) -> str:
    head = f"`{word}`: {kind}"
    sentence = f"\n\n{says[0].upper()}{says[1:]}." if says else ""
    ways = "".join(f"\n{way}" for way in form.split("` or `")) if form else ""
    return f"{head}{sentence}" + (f"\n\n```mission{ways}\n```" if ways else "")

"""Syntax error messages: what was expected where reading stopped, and for the frequent slips, what was meant."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from missionc.diagnostics.model import Diagnostic, Fix, Label
from missionc.syntax import forms
from missionc.syntax import slips_of_signs as signs
from missionc.syntax import slips_of_words as words
from missionc.syntax.expected import SIGNS, in_words
from missionc.syntax.parse_table import END
from missionc.syntax.stopping_place import Place, finding, just_after
from missionc.syntax.tokens import quoted


def explain(place: Place) -> Diagnostic:
    """What is wrong at a place; of a name that is declared, nobody who leaves `=` out meant the bracket of a family."""
    if place.expected == {"=", "["}:
        place = replace(place, expected=frozenset({"="}))
    for slip in SLIPS:
        meant = slip(place)
        if meant is not None:
            return meant
    return _plain(place)


def _plain(place: Place) -> Diagnostic:
    """What was expected, without a guess at what was meant."""
    expected, before, token = place.expected, place.before, place.found
    message = f"{in_words(expected, before)} was expected after {quoted(before.text)}"
    advice = f"write it as in `{_form(place)}`"
    labels: tuple[Label, ...] = ()
    if place.opened:
        labels = (Label(place.tokens[place.opened[-1]].span, "inside this bracket"),)
    end = just_after(before.span)
    fix = Fix(end, next(iter(expected))) if len(expected) == 1 and expected <= SIGNS - set("([{}])") else None
    if place.ends:
        message += ", but the file ends" if token.kind == END else ""
        return finding(message, before.span, advice, fix=fix, labels=labels)
    return finding(f"{message}, not {quoted(token.text)}", token.span, advice, fix=fix, labels=labels)


def _form(place: Place) -> str:
    """How the smallest part of the declaration that has a form of its own is written."""
    tokens, unexpected = place.tokens, place.found
    if place.in_formula:
        if place.opened and tokens[place.opened[-1] - 1].kind in forms.BOUNDS:
            operator = tokens[place.opened[-1] - 1]
            return f"{operator.text}{forms.BOUNDS[operator.kind]}"
        if signs.counts(place):
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
    signs.wrong_bounds,
    signs.foreign_sign,
    words.unknown_declaration,
    words.reserved_name,
    words.odd_name,
    words.no_weight,
    words.team_size,
    words.bare_setting,
    words.members,
    words.inside_without,
    words.call_brackets,
    words.heading_within,
    words.hyphen,
    words.unknown_unit,
    words.unknown_shape,
    words.quantifier_colon,
    words.unknown_operator,
    words.label_colon,
    words.at_least_how_many,
    words.at_most,
    words.part_of_team,
    signs.limit,
    signs.equals,
    signs.missing_bounds,
    signs.bounds_not_taken,
    signs.missing_comma,
    signs.needless_comma,
    signs.counted,
    signs.two_comparisons,
    signs.bare_arithmetic,
    signs.brackets,
)
"""The first that gives a finding wins."""

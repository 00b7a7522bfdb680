"""The grammar for editors is the one the compiler's words make, and nothing of the language is left out."""

from __future__ import annotations

import json
import re
from itertools import chain

from editors import textmate
from missionc.base.units import UNITS
from missionc.frontend.syntax import parse_table, tokens
from missionc.ir.language.operators import OPERATORS
from missionc.ir.language.predicates import PREDICATES

GRAMMAR = textmate.text()


def test_the_grammar_on_disk_is_the_one_the_compilers_words_make() -> None:
    assert textmate.FILE.read_text(encoding="utf-8") == GRAMMAR, "run `python -m editors.textmate`"


def test_every_word_and_letter_of_the_language_stands_in_the_grammar() -> None:
    assert tokens.SPELLINGS
    missing = [spelling for spelling in sorted(tokens.SPELLINGS) if not stands_there(spelling)]
    assert not missing, "\n".join(missing)


def stands_there(spelling: str) -> bool:
    pattern = re.escape(json.dumps(re.escape(spelling))[1:-1])
    return bool(re.search(rf"(?<!\w){pattern}(?!\w)" if spelling[0].isalpha() else pattern, GRAMMAR))


def test_every_unit_and_every_predicate_that_is_called_stands_in_the_grammar() -> None:
    for name in chain(UNITS, (predicate.name for predicate in PREDICATES if predicate.called)):
        assert json.dumps(re.escape(name))[1:-1] in GRAMMAR, name


def test_every_sign_of_the_language_has_a_scope() -> None:
    signs = {kind for action in parse_table.load().actions for kind in action if not kind[0].isalpha()}
    letters = {operator.letter for operator in OPERATORS if operator.letter and not operator.letter[0].isalpha()}
    assert signs | letters == set(chain.from_iterable(textmate.SIGNS.values()))


def test_no_pattern_of_the_grammar_begins_within_a_word() -> None:
    """Names are matched whole, so nothing needs a word border before it; but none may go without one behind it."""
    patterns = re.findall(r'"(?:match|begin)": "((?:[^"\\]|\\.)*)"', GRAMMAR)
    words = [pattern for pattern in patterns if re.match(r"\(\?:\w", pattern)]
    assert len(words) > 20
    assert [pattern for pattern in words if "(?!\\\\w)" not in pattern] == []

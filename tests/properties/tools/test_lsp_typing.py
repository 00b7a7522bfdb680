"""Whatever is typed, the language server answers: 10,000 edits of every mission, with requests at random places.

``MISSIONC_FUZZ=10000`` makes so many edits instead of the usual number; `make fuzz` does.
"""

from __future__ import annotations

import os
import random
from collections.abc import Callable

import pytest

pytest.importorskip("pygls")

from lsprotocol import converters, types

from missionc.tools.language_server.completion import completion
from missionc.tools.language_server.hover import hints, hover
from missionc.tools.language_server.open_text import OpenText, diagnostics
from missionc.tools.language_server.text_edits import (
    RefusedError,
    definition,
    fixes,
    formatting,
    highlights,
    references,
    renamable,
    rename,
)
from missionc.tools.language_server.workspace_symbols import symbols
from tests.support.open_texts import edited, opened
from tests.support.typed_edits import MISSIONS, typed

USUAL = 500
RESTART = 12
"""Edits of one mission before the next one is opened: what follows is mostly rubble."""

ENCODINGS = (types.PositionEncodingKind.Utf8, types.PositionEncodingKind.Utf16, types.PositionEncodingKind.Utf32)
EVERYWHERE = types.Range(types.Position(0, 0), types.Position(10_000, 0))


def renamed(text: OpenText, place: types.Position) -> object:
    try:
        renamable(text, place)
        return rename(text, place, "another")
    except RefusedError as refused:
        return refused.message


REQUESTS: tuple[Callable[[OpenText, types.Position], object], ...] = (
    hover,
    definition,
    lambda text, place: references(text, place, True),
    highlights,
    completion,
    renamed,
    lambda text, place: symbols(text),
    lambda text, place: hints(text, EVERYWHERE),
    lambda text, place: formatting(text),
    lambda text, place: fixes(text, EVERYWHERE),
)


def test_no_edit_and_no_request_at_any_place_goes_unanswered() -> None:
    converter = converters.get_converter()
    chance = random.Random(int(os.environ.get("MISSIONC_SEED", "0")))
    answered = dict.fromkeys(range(len(REQUESTS)), 0)
    text, before = "", None
    for number in range(int(os.environ.get("MISSIONC_FUZZ", USUAL))):
        if number % RESTART == 0:
            text, before = chance.choice(MISSIONS), None
        text = typed(text, chance)
        try:
            here = opened(text, chance.choice(ENCODINGS), before, checked=chance.random() < 0.5)
            before = here.mission
            if here.found is not None:
                converter.unstructure(diagnostics(here, here.found.findings))
            for which in (chance.randrange(len(REQUESTS)), chance.randrange(len(REQUESTS))):
                names = here.outline.names if chance.random() < 0.5 else ()
                offset = chance.choice(names).span.start if names else chance.randrange(len(text) + 1)
                place = here.places.position(offset)
                answered[which] += bool(converter.unstructure(REQUESTS[which](here, place)))
        except Exception as error:
            raise AssertionError(f"edit {number}: {error!r}\n{text!r}") from error
    assert all(answered.values()), answered


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_a_position_is_the_same_place_there_and_back(encoding: str) -> None:
    chance = random.Random(1)
    for number in range(200):
        text = typed(typed(chance.choice(MISSIONS), chance), chance)
        places = opened(text, encoding, checked=False).places
        for offset in range(0, len(text), 7 + number % 5):
            position = places.position(offset)
            there = places.offset(position)
            assert there == offset or text[there:offset] in ("\r", "\n", "\r\n"), (offset, position)


def test_a_rename_changes_no_meaning() -> None:
    chance = random.Random(2)
    made = 0
    for _ in range(60):
        here = opened(chance.choice(MISSIONS))
        name = chance.choice(here.outline.names)
        edit = rename(here, here.places.position(name.span.start), "another")
        assert edit.changes is not None
        after = opened(edited(here, list(edit.changes[here.uri])))
        assert after.found is not None
        assert here.found is not None
        assert [finding.code for finding in after.found.findings] == [finding.code for finding in here.found.findings]
        there = [other.span.start for other in after.outline.names if other.text == "another"]
        assert len(there) == len(here.outline.alike(name))
        made += 1
    assert made

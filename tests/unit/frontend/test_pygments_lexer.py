"""Missions in colour: the words of the language, each with a colour, and every character once."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("pygments")

from pygments import lex
from pygments.lexers import get_lexer_by_name, get_lexer_for_filename
from pygments.token import Comment, Error, Keyword, Name, Number, Operator

from missionc.frontend.syntax.pygments_lexer import COLOURS, MissionLexer
from missionc.frontend.syntax.tokens import WORDS

ROOT = Path(__file__).resolve().parents[3]
MISSIONS = sorted((ROOT / "missions").rglob("*.mission"))


def test_every_kind_of_word_has_a_colour_and_no_other() -> None:
    assert set(COLOURS) == {word.says for word in WORDS}


def test_pygments_finds_the_lexer_by_name_and_by_file() -> None:
    assert isinstance(get_lexer_by_name("mission"), MissionLexer)
    assert isinstance(get_lexer_for_filename("wildfire.mission"), MissionLexer)


def test_every_character_of_a_mission_is_coloured_once_and_none_is_wrong(subtests: pytest.Subtests) -> None:
    assert MISSIONS
    for mission in MISSIONS:
        with subtests.test(mission.stem):
            text = mission.read_text(encoding="utf-8")
            found = list(MissionLexer().get_tokens_unprocessed(text))
            assert "".join(piece for _, _, piece in found) == text
            assert all(text.startswith(piece, at) for at, _, piece in found)
            assert [piece for _, colour, piece in found if colour is Error] == []


@pytest.mark.parametrize(
    ("piece", "colour"),
    [
        ("require", Keyword.Declaration),
        ("order", Name.Label),
        ("every", Operator.Word),
        ("always", Operator.Word),
        ("20", Number),
        ("m/s", Keyword.Type),
        ("speed", Name.Builtin),
        ("drone", Name),
        ("<=", Operator),
        ("# slowly", Comment.Single),
        ("$", Error),
    ],
)
def test_a_piece_has_its_colour(piece: str, colour: object) -> None:
    text = "require order: every drone: always[0, 20 s] speed <= 2 m/s # slowly\n$"
    assert (colour, piece) in list(lex(text, MissionLexer()))


def test_a_name_stands_out_where_it_is_declared() -> None:
    found = list(lex("region base = box (0, 0) to (1, 1)\nlet safe = not base", MissionLexer()))
    assert [piece for colour, piece in found if colour is Name.Class] == ["base", "safe"]
    assert (Name, "base") in found

"""What was read before and only moved is what would be read anew, whatever is done to the text."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from missionc.base.limits import Limits
from missionc.base.source import Source, Span
from missionc.diagnostics.render import render_json
from missionc.pipeline.front_end import check
from missionc.syntax.parse import parse
from missionc.syntax.passages import Kept, passages
from missionc.syntax.show_tree import show
from tests.support.typed_edits import typed

ROOT = Path(__file__).resolve().parents[2]
CORPUS = [path.read_text(encoding="utf-8") for path in sorted((ROOT / "missions").glob("*.mission"))]
KEYS = 12


def absent(path: str, span: Span) -> Source:
    """An include of nothing."""
    return Source(path, "")


def places(root: object) -> list[tuple[str, int, int]]:
    """The name of each span's source, and the span, in a fixed order."""
    found: list[tuple[str, int, int]] = []
    waiting = [root]
    while waiting:
        node = waiting.pop()
        match node:
            case Span(source, start, end):
                found.append((source.text, start, end))
            case tuple():
                waiting.extend(node)
            case _:
                waiting.extend(getattr(node, name) for name in getattr(node, "__match_args__", ()))
    return found


def test_passages_make_up_the_text() -> None:
    for text in (
        *CORPUS,
        "",
        "\n",
        "region",
        "require\nlet: every a: b\nlet c = d",
        "x\r\nregion a = b\r\n# region\r\n",
    ):
        cuts = list(passages(text))
        assert "".join(text[begin:end] for begin, end in cuts) == text
        assert len(cuts) == 1 or all(begin < end for begin, end in cuts)


def test_a_label_that_is_a_keyword_begins_no_passage() -> None:
    assert len(list(passages("require\nlet: every a: b"))) == 1


def test_a_text_typed_key_by_key_is_read_as_one_that_is_read_at_once() -> None:
    whole = 0
    for number, text in enumerate(CORPUS):
        chance = random.Random(number)
        kept = Kept()
        for _ in range(KEYS):
            edited = typed(text, chance)
            place = edited.find("\n", chance.randrange(len(edited)))
            edited = f"{edited[:place]}\n# 𝄞{edited[place:]}" if place >= 0 else edited
            program, findings = parse(Source("typed.mission", edited), Limits(), absent, kept)
            again, expected = parse(Source("typed.mission", edited), Limits(), absent)
            assert render_json(findings) == render_json(expected), edited
            assert (program is None) == (again is None)
            if program is not None and again is not None:
                assert show(program) == show(again)
                assert places(program.declarations) == places(again.declarations), edited
                whole += 1
    assert whole > KEYS


def test_only_what_changed_is_read_again() -> None:
    kept = Kept()
    before = "mission one\nregion a = box (0, 0) to (1, 1)\n"
    parse(Source("a", before), Limits(), absent, kept)
    ((_, (old,)),) = kept.declared["region a = box (0, 0) to (1, 1)\n"]
    parse(Source("a", "# new\nmission two\nregion a = box (0, 0) to (1, 1)\n"), Limits(), absent, kept)
    ((_, (region,)),) = kept.declared["region a = box (0, 0) to (1, 1)\n"]
    assert region is old
    assert region.span.start == len("# new\nmission two\n")
    assert region.span.text == "region a = box (0, 0) to (1, 1)"
    assert set(kept.declared) == {"# new\n", "mission two\n", "region a = box (0, 0) to (1, 1)\n"}


def test_passages_of_the_same_text_are_told_apart() -> None:
    kept = Kept()
    twice = "require every a: b\n"
    for text in (f"mission one\n{twice}{twice}", f"mission one\n{twice}# new\nregion c = d\n{twice}"):
        program, findings = parse(Source("a", text), Limits(), absent, kept)
        assert program is not None
        assert not findings
        starts = [item.span.start for item in program.declarations if item.span.text.startswith("require")]
        assert starts == [text.index(twice), text.rindex(twice)]


def test_a_check_ends_before_the_stage_at_which_it_is_told_to() -> None:
    stages: list[str] = []

    def before(stage: str) -> None:
        stages.append(stage)
        if stage == "check":
            raise InterruptedError

    with pytest.raises(InterruptedError):
        check(Source("a", CORPUS[-1]), before=before)
    assert stages == ["parse", "resolve", "check"]


def test_an_include_is_followed_every_time() -> None:
    kept = Kept()
    asked: list[str] = []

    def load(path: str, span: Span) -> Source:
        asked.append(path)
        return Source(path, "")

    for _ in range(2):
        parse(Source("a", 'mission one\ninclude "site"\n'), Limits(), load, kept)
    assert asked == ["site", "site"]

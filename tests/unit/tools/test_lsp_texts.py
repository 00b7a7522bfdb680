"""What the language server knows of an open text: its names, each place once, and when its check is done."""

from __future__ import annotations

import asyncio
from pathlib import Path

from lsprotocol import types

from missionc.tools.language_server.open_text import Checks, OpenText
from missionc.tools.language_server.text_edits import highlights, references, rename
from tests.support.open_texts import opened
from tests.support.small_missions import SMALL


def test_a_place_beside_an_include_is_counted_once(tmp_path: Path) -> None:
    (tmp_path / "base.mission").write_text("region base = box (1, 1) to (3, 3)\n")
    words = 'include "base.mission" region goal = box (6, 6) to (8, 8)\nlet near = goal\n'
    text = opened(words, checked=False, name=str(tmp_path / "a.mission"))
    here = types.Position(0, words.index("goal") + 1)
    assert len(highlights(text, here)) == 2
    assert len(references(text, here, declaration=True)) == 2
    assert len(references(text, here, declaration=False)) == 1
    changes = rename(text, here, "target").changes
    assert changes is not None
    assert sum(map(len, changes.values())) == 2


def test_who_waits_gets_the_version_that_came_while_it_waited() -> None:
    async def waited() -> tuple[OpenText, OpenText, list[int]]:
        published: list[int] = []
        checks = Checks(lambda text: published.append(text.version))
        first, second = (opened(SMALL + "#\n" * number, checked=False, version=number) for number in (1, 2))
        checks.ask(first)
        waiting = asyncio.create_task(checks.settled(first.uri))
        await asyncio.sleep(0)
        checks.ask(second)
        await waiting
        checks.close()
        checks.ask(first)
        return first, second, published

    first, second, published = asyncio.run(waited())
    assert second.found is not None
    assert first.found is None
    assert published == [2]

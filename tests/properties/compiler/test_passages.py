"""Passages cut a text, and a check can be given up between its stages."""

from __future__ import annotations

from pathlib import Path

import pytest

from missionc.base.source import Source
from missionc.compiler.front_end import check
from missionc.frontend.syntax.parse import passages

ROOT = Path(__file__).resolve().parents[3]
CORPUS = [path.read_text(encoding="utf-8") for path in sorted((ROOT / "missions").glob("*.mission"))]


def test_passages_make_up_the_text() -> None:
    for text in (
        *CORPUS,
        "",
        "\n",
        "region",
        "require\nlet: every a: b\nlet c = d",
        "x\r\nregion a = b\r\n# region\r\n",
    ):
        cuts = list(passages(Source("a", text)))
        assert "".join(cut.text for cut in cuts) == text
        assert len(cuts) == 1 or all(cut.text for cut in cuts)


def test_a_label_that_is_a_keyword_begins_no_passage() -> None:
    assert len(list(passages(Source("a", "require\nlet: every a: b")))) == 1


def test_a_check_ends_before_the_stage_at_which_it_is_told_to() -> None:
    stages: list[str] = []

    def before(stage: str) -> None:
        stages.append(stage)
        if stage == "check":
            raise InterruptedError

    with pytest.raises(InterruptedError):
        check(Source("a", CORPUS[-1]), before=before)
    assert stages == ["parse", "resolve", "expand", "check"]

"""Form of the pages of ``docs/``: purpose, search terms, and the length of sentences, paragraphs and sections.

``python -m tests.unit.project.test_pages`` prints the measures of each page. Code blocks and pictures are left out; the
words of tables are counted apart from those of the prose.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from tests.support.golden_pages import FENCE

ROOT = Path(__file__).resolve().parents[3]
PAGES = sorted((ROOT / "docs").glob("*.md"))
SENTENCE_WORDS, LONG_SENTENCES = 30, 0.05
PARAGRAPH_WORDS, STEP_WORDS, SECTION_WORDS, PURPOSE_WORDS = 100, 75, 400, 75
"""Limits. Paragraphs of tutorials and how-to guides are shorter: they are read beside a terminal."""

SEARCH_TERMS = re.compile(r"^Search terms: (.+)\.$", re.MULTILINE)


@dataclass(frozen=True)
class Block:
    """A paragraph, an item of a list, a row of a table or a heading."""

    kind: str
    text: str
    line: int

    @property
    def words(self) -> int:
        return sum(1 for word in re.split(r"[\s|]+", self.text) if re.search(r"\w", word))

    @property
    def sentences(self) -> list[int]:
        """Words of each sentence."""
        parts = re.split(r"(?<=[.!?:])[\"')*]*\s+(?=[A-Z`*\[(0-9])", self.text)
        return [count for part in parts if (count := Block("sentence", part, self.line).words)]


def blocks(text: str) -> Iterator[Block]:
    text = FENCE.sub(lambda block: "\n" * block.group().count("\n"), text)
    text = re.sub(r"!\[[^]]*\]\([^)]*\)", "", text)
    text = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", text)
    kind, lines, first = "", [], 0
    for number, line in enumerate([*text.splitlines(), ""], 1):
        starts = re.match(r"(?P<heading>#+ )|(?P<row>\s*\|)|(?P<item>\s*(?:[-*]|\d+\.) )|(?P<comment><!--)|\s*$", line)
        if starts and lines:
            yield Block(kind, " ".join(lines), first)
            lines = []
        if not starts and lines:
            lines.append(line)
        elif line.strip():
            kind, lines, first = (starts and starts.lastgroup) or "paragraph", [line], number


def prose(page: Path) -> list[Block]:
    return [block for block in blocks(page.read_text(encoding="utf-8")) if block.kind in {"paragraph", "item"}]


def sections(page: Path) -> dict[str, int]:
    """Words of prose below each heading, up to the next one."""
    words: dict[str, int] = {}
    heading = ""
    for block in blocks(page.read_text(encoding="utf-8")):
        if block.kind == "heading":
            heading = f"{page.name}:{block.line}: {block.text}"
        elif block.kind in {"paragraph", "item"}:
            words[heading] = words.get(heading, 0) + block.words
    return words


def test_every_page_begins_with_its_purpose() -> None:
    for page in PAGES:
        title, purpose, *_ = blocks(page.read_text(encoding="utf-8"))
        assert (title.kind, purpose.kind) == ("heading", "paragraph"), page.name
        assert purpose.words <= PURPOSE_WORDS, f"{page.name}: {purpose.words} words before the first fact"


def test_every_page_has_at_least_three_search_terms() -> None:
    for page in PAGES:
        lines = SEARCH_TERMS.findall(page.read_text(encoding="utf-8"))
        assert len(lines) == 1, f"{page.name}: one line `Search terms: …, …, ….`"
        assert len(lines[0].split(", ")) >= 3, f"{page.name}: {lines[0]}"


def test_sentences_paragraphs_and_sections_are_short() -> None:
    sentences = [words for page in PAGES for block in prose(page) for words in block.sentences]
    assert sum(words > SENTENCE_WORDS for words in sentences) <= LONG_SENTENCES * len(sentences)
    long = [
        f"{page.name}:{block.line}: {block.words} words in a paragraph"
        for page in PAGES
        for block in prose(page)
        if block.words > (STEP_WORDS if re.match("tutorial|howto", page.name) else PARAGRAPH_WORDS)
    ]
    long += [
        f"{name}: {words} words" for page in PAGES for name, words in sections(page).items() if words > SECTION_WORDS
    ]
    assert not long, "\n".join(long)


def test_blocks_of_a_page_are_told_apart() -> None:
    text = "# A page\n\nOne [link](a.md). Two\nlines.\n\n- an item\n- another\n\n| a | b |\n|---|---|\n\n"
    page = text + "```sh\ncode\n```\n"
    found = [(block.kind, block.words) for block in blocks(page)]
    assert found == [("heading", 2), ("paragraph", 4), ("item", 2), ("item", 1), ("row", 2), ("row", 0)]
    assert Block("paragraph", "One link. Two lines.", 1).sentences == [2, 2]


if __name__ == "__main__":
    total: dict[str, int] = {"prose": 0, "tables": 0, "long sentences": 0}
    for page in PAGES:
        row = {
            "prose": sum(block.words for block in prose(page)),
            "tables": sum(b.words for b in blocks(page.read_text(encoding="utf-8")) if b.kind == "row"),
            "long sentences": sum(words > SENTENCE_WORDS for block in prose(page) for words in block.sentences),
        }
        total = {name: total[name] + words for name, words in row.items()}
        print(f"{page.name:28}", *(f"{name} {words:5}" for name, words in row.items()))
    print(f"{'all':28}", *(f"{name} {words:5}" for name, words in total.items()))

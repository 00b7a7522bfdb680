"""Words that no text of the project uses: ``tests/words.toml``, over documentation, docstrings, messages and help.

What stood there before the list did is counted in ``tests/words_left.json``, file by file: a file may have fewer, and
never more. ``python -m tests.unit.project.test_wording`` updates the counts after some are gone.
"""

from __future__ import annotations

import ast
import json
import re
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from tests.support.golden_pages import FENCE

ROOT = Path(__file__).resolve().parents[3]
LIST = ROOT / "tests" / "words.toml"
LEFT = ROOT / "tests" / "words_left.json"

CODE = re.compile(r"`[^`\n]*`")


@dataclass(frozen=True)
class Word:
    pattern: re.Pattern[str]
    instead: str
    docstrings: bool


@dataclass(frozen=True)
class Text:
    """A text, and the line it begins in."""

    line: int
    words: str
    docstring: bool = False


@cache
def words() -> tuple[Word, ...]:
    entries = tomllib.loads(LIST.read_text(encoding="utf-8"))["word"]
    return tuple(
        Word(re.compile(entry["pattern"], re.IGNORECASE), entry["instead"], entry.get("docstrings", False))
        for entry in entries
    )


def texts_of_page(text: str) -> Iterator[Text]:
    prose = FENCE.sub(lambda block: "\n" * block.group().count("\n"), text)
    for number, line in enumerate(prose.splitlines(), 1):
        yield Text(number, CODE.sub("``", line))


def texts_of_module(text: str) -> Iterator[Text]:
    """Docstrings, and every other text with a space in it: messages, help, labels."""
    tree = ast.parse(text)
    statements = {
        id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and " " in node.value:
            yield Text(node.lineno, CODE.sub("``", node.value), id(node) in statements)


def found_in(texts: Iterator[Text]) -> list[tuple[int, str, str]]:
    """Line, what stands there, and what to write instead."""
    return [
        (text.line + text.words[: match.start()].count("\n"), match.group(), word.instead)
        for text in texts
        for word in words()
        if text.docstring or not word.docstrings
        for match in word.pattern.finditer(text.words)
    ]


def texts() -> Iterator[tuple[str, list[tuple[int, str, str]]]]:
    """Every file that is looked at, by its path from the root, with what was found."""
    for path in sorted(ROOT.glob("missionc/**/*.py")):
        yield path.relative_to(ROOT).as_posix(), found_in(texts_of_module(path.read_text(encoding="utf-8")))
    pages = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *ROOT.glob("docs/*.md"), *ROOT.glob("docs/errors/*.md")]
    for path in sorted(pages):
        yield path.relative_to(ROOT).as_posix(), found_in(texts_of_page(path.read_text(encoding="utf-8")))


def test_no_file_has_more_of_them_than_it_had() -> None:
    left = json.loads(LEFT.read_text(encoding="utf-8"))
    more = [
        f"{name}:{line}: `{found}`; write: {instead}"
        for name, all_found in texts()
        if len(all_found) > left.get(name, 0)
        for line, found, instead in all_found
    ]
    assert not more, "\n".join(more)


def test_a_banned_word_is_found_with_its_line_and_not_in_code() -> None:
    page = "One line.\nThe plan is made anew.\n```console\nanew\n```\nA name `anew` is code.\n"
    assert [(line, found) for line, found, _ in found_in(texts_of_page(page))] == [(2, "anew")]
    module = '"""Whether it is so."""\nNAME = "anew"\nMESSAGE = "plan it anew"\n'
    assert [(line, found) for line, found, _ in found_in(texts_of_module(module))] == [(1, "Whether"), (3, "anew")]


if __name__ == "__main__":
    counts = {name: len(found) for name, found in texts() if found}
    LEFT.write_text(json.dumps(counts, indent=0) + "\n", encoding="utf-8")

"""Every code is defined, explained, emitted and pinned by a test; nothing else is emitted."""

from __future__ import annotations

import ast
import re
from pathlib import Path

from missionc.base.diagnostics import code as codes
from missionc.base.diagnostics.code import CODES, RETIRED, Code, explain

ROOT = Path(__file__).resolve().parents[3]
PAGES = {path.stem for path in (ROOT / "docs" / "errors").glob("*.md")}
CONSTANTS = {name: value for name, value in vars(codes).items() if isinstance(value, Code)}


def words_of_the_package() -> set[str]:
    """Every name read anywhere in the package but where codes are defined."""
    found: set[str] = set()
    for path in (ROOT / "missionc").rglob("*.py"):
        if path.name != "code.py":
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                match node:
                    case ast.Name(id=word) | ast.Attribute(attr=word):
                        found.add(word)
    return found


def words_of_the_tests() -> set[str]:
    """Every word of all tests but for this file."""
    return {
        word
        for pattern in ("*.py", "golden/*.md")
        for path in (ROOT / "tests").rglob(pattern)
        if path.name != "test_codes.py"
        for word in re.findall(r"\w+", path.read_text(encoding="utf-8"))
    }


def test_a_code_has_one_name_and_one_number() -> None:
    assert len({value.name for value in CONSTANTS.values()}) == len(CONSTANTS) == len(CODES)
    assert all(re.fullmatch(r"MC[0-79]\d\d", name) for name in CODES)


def test_a_number_that_was_given_up_is_not_given_again() -> None:
    assert RETIRED.isdisjoint(CODES)


def test_a_code_is_emitted_somewhere() -> None:
    assert CONSTANTS
    silent = CONSTANTS.keys() - words_of_the_package()
    assert not silent, "\n".join(sorted(silent))


def test_a_code_is_explained() -> None:
    assert CODES
    other = [name for name, code in CODES.items() if not explain(code).startswith(f"# {name}: {code.title}\n")]
    assert not other, "\n".join(other)


def test_a_code_is_pinned_by_a_test() -> None:
    """By its number or its constant; its own page does not count: that shows only that it can be earned."""
    words = words_of_the_tests()
    loose = [code.name for name, code in CONSTANTS.items() if words.isdisjoint({name, code.name})]
    assert not loose, "\n".join(loose)


def test_every_page_explains_a_code() -> None:
    assert set(CODES) >= PAGES


def test_nobody_makes_a_code_elsewhere() -> None:
    for path in (ROOT / "missionc").rglob("*.py"):
        if path.name != "code.py":
            assert not re.search(r"\bCode\(", path.read_text(encoding="utf-8")), path

"""The grammar as Lark's: it reads what the compiler reads, and says the same declarations."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import missionc

lark = pytest.importorskip("lark")

ROOT = Path(__file__).resolve().parents[3]
MISSIONS = sorted((ROOT / "missions").rglob("*.mission"))


@pytest.fixture(scope="module")
def parser() -> object:
    return missionc.grammar()


def begins(tree: object) -> int:
    """The offset of the first leaf of a tree."""
    tokens = list(tree.scan_values(lambda leaf: isinstance(leaf, lark.Token)))  # type: ignore[attr-defined]
    return min(token.start_pos for token in tokens)


def test_every_mission_is_read_declaration_by_declaration(parser: lark.Lark, subtests: pytest.Subtests) -> None:
    assert MISSIONS
    for path in MISSIONS:
        with subtests.test(path.stem):
            tree = parser.parse(path.read_text(encoding="utf-8"))
            program = missionc.check(path, backend="any").program
            assert program is not None
            assert tree.data == "program"
            assert len(tree.children) == len(program.declarations) > 3
            for child, declaration in zip(tree.children, program.declarations, strict=True):
                assert declaration.span.start <= begins(child) < declaration.span.end
                kind = {"missionname": "mission", "fromfile": "from_file"}.get(
                    name := type(declaration).__name__.lower(), name
                )
                assert child.data in ("team", "agent", kind)


def test_leaves_say_where_they_are(parser: lark.Lark) -> None:
    tree = parser.parse("mission demo\nregion base = box (0, 0) to (1, 2)\n")
    name = tree.children[1].children[0]
    assert (name, name.line, name.column, name.start_pos, name.end_pos) == ("base", 2, 8, 20, 24)


def test_a_word_of_the_language_is_a_name_where_it_may_be_one(parser: lark.Lark) -> None:
    tree = parser.parse("mission demo\nregion start = box (0, 0) to (1, 2)\nrequire always: true\n")
    assert tree.children[1].children[0] == "start"
    assert tree.children[2].children[0] == "always"


@pytest.mark.parametrize(
    ("text", "line", "column"),
    [
        ("mission demo\nregion base = box (0, 0) too (1, 1)\n", 2, 26),
        ("mission d%mo\n", 1, 10),
        ("mission demo\nparam a = 1" + "0" * 400 + "\n", 2, 11),
    ],
)
def test_what_is_no_mission_is_refused_where_it_is_none(text: str, line: int, column: int, parser: lark.Lark) -> None:
    with pytest.raises(lark.UnexpectedInput) as refused:
        parser.parse(text)
    assert (refused.value.line, refused.value.column) == (line, column)


def test_without_lark_it_says_what_to_install() -> None:
    program = (
        "import sys; sys.modules['lark'] = None; import missionc\n"
        "try: missionc.grammar()\n"
        "except ModuleNotFoundError as error: print(error)\n"
    )
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=ROOT)
    assert run.stdout.startswith("MC404: the grammar needs lark, which is not installed")

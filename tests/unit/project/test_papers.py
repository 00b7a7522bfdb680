"""The page about the papers has the tables that docs/papers.toml gives, and every command shows what its rows say."""

from __future__ import annotations

import ast
import re
import shlex
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from docs.papers import PAGE, PASSED, VERDICTS, Row, find_shown, page, read_rows, read_shown, run
from missionc.backends.options import PRESETS
from tests.support import golden_pages
from tests.support.documentation_fences import shell
from tests.support.names_in_pages import ROOT, dotted, is_defined, is_there, paths

BACKENDS = ROOT / "missionc" / "backends"
HOMES = {"strel": BACKENDS / "smt", "clot": BACKENDS / "clot"}
"""Packages with the names in the rows of a paper; what both backends share is in ``BACKENDS`` itself."""
NUMBERED = {
    "strel": (
        *("(1)", "Example 1", "Remark 1", "Problem Definition", "Experiment Setup"),
        *(f"Def. {number}" for number in range(1, 6)),
        *(f"Alg. 1, line {number}" for number in (1, 4, 6, 7)),
        *("Alg. 1, lines 8 and 9", "Alg. 2", "Table 1", "Table 2", "Fig. 1", "Fig. 2", "Fig. 3"),
        *("Ψ_plan", "Ψ_path", "Ψ_motion", "Ψ_spec", "Z(μ)", "Z(¬φ)", "Z(φ₁ ∧ φ₂)", "Z(F)", "Z(U)", "Z(R)", "Z(E)"),
        *("φ1", "φ2", "φ3", "φ4", "horizon", "complexity"),
    ),
    "clot": (
        *(f"({number})" for number in range(1, 12)),
        *("II-A", "II-B", "III-B (I)", "III-B (II)", "III-C (I)", "III-C (II)", "Problem 1", "Remark 1", "Remark 2"),
        *("IV-A.1", "IV-A.2", "IV-B.1", "IV-B.2", "IV-B.3", "IV-C.1", "IV-C.2", "IV-D.1", "IV-D.2", "IV-D.3"),
        *(f"Alg. 1, line {number}" for number in (1, 2, 4, 5, 6, 7)),
        *("Alg. 2", "V-A.1", "V-A.2", "V-A.3", "V-A.4", "V-B", *(f"Fig. {number}" for number in range(1, 9))),
        *(f"Table I: {method}" for method in ("CLOT", "MPOT", "MICP", "CONS", "CBS")),
        *("FSOT", "NLP", "Scenario 1", "Scenario 2", "Scenario 3"),
    ),
}
ROWS = read_rows()
MINUTES = 60
"""Limit of a slow command."""
LEFT_OUT = {"skip", "gpu", "browser", "node", "third_party"}
"""Marks of tests that are skipped, or are where something is not installed."""


def commands(slow: bool) -> list[str]:
    """Commands of the rows, each once; one is slow if a row of it says so."""
    late = {row.command for row in ROWS if row.slow} | {
        row.command for row in ROWS if row.command.startswith("pytest ")
    }
    return [command for command in dict.fromkeys(row.command for row in ROWS) if (command in late) == slow]


def rows_of(command: str) -> list[Row]:
    return [row for row in ROWS if row.command == command]


def test_the_page_has_the_tables_that_the_rows_give() -> None:
    text = PAGE.read_text(encoding="utf-8")
    assert page(text, ROWS, read_shown()) == text, "`python docs/papers.py` updates it"
    assert all(f"<!-- rows of [{row.paper}]: {row.title} -->" in text for row in ROWS)


def test_everything_that_a_paper_numbers_has_a_row() -> None:
    lacking = [
        (paper, name)
        for paper, names in NUMBERED.items()
        for name in names
        if not any(row.paper == paper and re.search(rf"{re.escape(name)}(?!\w)", row.item) for row in ROWS)
    ]
    assert lacking == []


def test_every_row_is_whole() -> None:
    assert {row.item for row in ROWS if row.verdict not in VERDICTS} == set()
    assert {row.item for row in ROWS if row.verdict != "faithful" and not row.reason} == set()
    assert {row.item for row in ROWS if not (row.where and row.shows)} == set()
    assert len({row.key for row in ROWS}) == len(ROWS)


def test_what_the_rows_name_is_there() -> None:
    lacking: list[str] = []
    for row in ROWS:
        cells, homes = f"{row.where} {row.reason}", (HOMES[row.paper], BACKENDS)
        lacking += [name for name in dotted(cells) if not any(is_defined(name, home) for home in homes)]
        lacking += [path for path in paths(f"{cells} {row.item}") if not is_there(path)]
    lacking += [path for path in paths(PAGE.read_text(encoding="utf-8")) if not is_there(path)]
    assert lacking == []


def test_every_command_has_options_and_files_that_there_are() -> None:
    shell("\n".join(dict.fromkeys(row.command for row in ROWS)))
    lacking = []
    for command in dict.fromkeys(row.command for row in ROWS):
        match shlex.split(command):
            case ["pytest", file, *selection]:
                lacking += [command] * (not selected(file, selection))
            case ["python", file, *options]:
                text = (ROOT / file).read_text(encoding="utf-8")
                lacking += [
                    word for word in options if f'"{word}"' not in text and word not in PRESETS and not word.isdigit()
                ]
            case ["missionc", *_]:
                pass
            case _:
                lacking.append(command)
    assert lacking == []


def selected(file: str, selection: list[str]) -> list[str]:
    """The tests of a file that `-k WORD` selects by their names, without those that may be skipped."""
    word = selection[1] if selection else ""
    tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
    return [
        each.name
        for each in tree.body
        if isinstance(each, ast.FunctionDef) and each.name.startswith("test_") and word in each.name
        if not any(mark in ast.unparse(decorator) for decorator in each.decorator_list for mark in LEFT_OUT)
    ]


def test_what_was_shown_is_what_the_rows_say() -> None:
    shown = read_shown()
    rows = {row.key: row for row in ROWS}
    assert set(shown) <= set(rows)
    wrong = [
        key for key, texts in shown.items() if find_shown(rows[key], rows[key].status, "\n".join(texts))[0] != texts
    ]
    assert wrong == []
    assert [row.key for row in ROWS if not row.slow and row.shows != [PASSED] and row.key not in shown] == []


@pytest.mark.parametrize("command", commands(slow=False))
def test_a_quick_command_shows_what_its_rows_say(command: str, tmp_path: Path) -> None:
    (tmp_path / "missions").symlink_to(ROOT / "missions")
    with golden_pages.within(tmp_path):
        status, output = golden_pages.run(shlex.split(command)[1:])
    if "needs the package torch, which is not installed" in output:
        pytest.importorskip("torch")
    assert [lacking for row in rows_of(command) if (lacking := find_shown(row, status, output)[1])] == [], output


@pytest.mark.slow
@pytest.mark.timeout(MINUTES * 60)
@pytest.mark.parametrize("command", commands(slow=True))
def test_a_slow_command_shows_what_its_rows_say(command: str) -> None:
    status, output = run(command, MINUTES * 60)
    rows = rows_of(command)
    if absent := [package for row in rows for package in row.needs if find_spec(package) is None]:
        assert status != 0
        assert all(package in output for package in [*absent, "missionc[rivals]"]), output
        pytest.skip(f"{' and '.join(absent)} not installed, as the command says")
    assert [lacking for row in rows if (lacking := find_shown(row, status, output)[1])] == [], output


@pytest.mark.parametrize(
    ("shows", "status", "output", "lacking"),
    [
        (["5 agents … smt"], 0, "x: 5  agents for 3 s, planned by smt\n", ""),
        (["5 agents … smt"], 0, "x: 5 agents\nplanned by smt\n", "no `5 agents … smt` in the output"),
        (["5 agents … smt"], 2, "x: 5 agents for 3 s, planned by smt\n", "exit status 2, expected 0"),
        (["3 agents …"], 0, "3 agents", "no `3 agents …` in the output"),
        ([PASSED], 0, "2 passed, 1 skipped in 1 s\n", ""),
        ([PASSED], 0, "2 skipped in 1 s\n", f"no `{PASSED}` in the output"),
    ],
)
def test_an_output_without_what_a_row_shows_is_found(shows: list[str], status: int, output: str, lacking: str) -> None:
    row = Row("strel", "", "item", "where", "command", "faithful", shows=shows)
    assert find_shown(row, status, output)[1] == lacking


def test_a_comparison_names_the_package_that_it_lacks() -> None:
    absent = [package for package in ("w9_pathfinding", "stlpy") if find_spec(package) is None]
    if not absent:
        pytest.skip("every package of the extra `rivals` is installed")
    line = [sys.executable, "bench/clot_table1.py", "--agents", "3", "--only", "cbs", "micp"]
    ran = subprocess.run(line, cwd=ROOT, capture_output=True, text=True, check=False)
    assert ran.returncode == 1
    assert all(word in ran.stderr for word in [*absent, "pip install 'missionc[rivals]'"])

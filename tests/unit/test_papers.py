"""The page about the papers has a row for each of their numbered things, and what its rows name is there."""

from __future__ import annotations

import re
import shlex
from dataclasses import dataclass
from pathlib import Path

import pytest

from missionc.backends.options import PRESETS
from tests.support.documentation_fences import shell
from tests.support.names_in_pages import ROOT, dotted, is_defined, is_there, paths

PAGE = (ROOT / "docs" / "papers.md").read_text(encoding="utf-8")
BACKENDS = ROOT / "missionc" / "backends"
HOMES = {"strel": BACKENDS / "smt", "clot": BACKENDS / "clot"}
"""Where the names in the rows of a paper are; what both backends share is in ``BACKENDS`` itself."""
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


@dataclass(frozen=True)
class Row:
    """What a paper has, where it is in the tree, how it is run, and how it differs."""

    paper: str
    thing: str
    here: str
    run: str
    differs: str


def rows(paper: str) -> list[Row]:
    """The rows of all tables about a paper."""
    tables = re.findall(
        rf"^\| \[{paper}\] \| here \| run \| differs, and why \|\n\|[-|]+\n((?:\|.*\n)+)", PAGE, re.MULTILINE
    )
    lines = [line for table in tables for line in table.splitlines()]
    return [Row(paper, *(cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1])) for line in lines]


ROWS = [row for paper in HOMES for row in rows(paper)]
every_row = pytest.mark.parametrize("row", ROWS, ids=lambda row: f"{row.paper}: {row.thing}")


def in_code(cell: str) -> list[str]:
    return re.findall(r"`([^`]+)`", cell)


@pytest.mark.parametrize("paper", HOMES)
def test_everything_that_a_paper_numbers_has_a_row(paper: str) -> None:
    things = [row.thing for row in ROWS if row.paper == paper]
    assert [name for name in NUMBERED[paper] if not any(stands_in(name, thing) for thing in things)] == []


def stands_in(name: str, thing: str) -> bool:
    """Whether a row is about a thing of that name: ``Fig. 1`` does not stand in ``Fig. 10``."""
    return re.search(rf"{re.escape(name)}(?!\w)", thing) is not None


@every_row
def test_a_row_says_where_and_how_it_is_run_and_how_it_differs(row: Row) -> None:
    assert all((in_code(row.here) or row.here, in_code(row.run), row.differs))


@every_row
def test_what_a_row_names_is_there(row: Row) -> None:
    cells = f"{row.here} {row.differs}"
    homes = (HOMES[row.paper], BACKENDS)
    assert [name for name in dotted(cells) if not any(is_defined(name, home) for home in homes)] == []
    assert [path for path in paths(f"{cells} {row.thing}") if not is_there(path)] == []


@every_row
def test_what_a_row_runs_could_be_run(row: Row) -> None:
    for line in in_code(row.run):
        shell(line)
        words = shlex.split(line)
        match words:
            case ["pytest", file]:
                assert re.search(r"^def test_", text(file), re.MULTILINE)
            case ["pytest", file, "-k", word]:
                assert re.search(rf"^def test_\w*{re.escape(word)}", text(file), re.MULTILINE), word
            case ["python", file, *options]:
                unknown = {word for word in options if not word.isdigit() and f'"{word}"' not in text(file)}
                assert unknown <= {*PRESETS}
            case ["missionc", _, file, *_]:
                assert is_there(file) or file in MADE, file
            case _:
                pytest.fail(f"nobody knows how to run `{line}`")


MADE = frozenset(re.findall(r"build/\w+", PAGE))
"""Folders that a command before leaves."""


def text(file: str) -> str:
    return (ROOT / Path(file)).read_text(encoding="utf-8")


def test_paths_outside_the_tables_are_there() -> None:
    assert [path for path in paths(PAGE) if not is_there(path)] == []
    assert len(ROWS) > 80

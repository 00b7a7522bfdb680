"""`missionc explain`: of codes, of missions, of one requirement, in words and as data."""

from __future__ import annotations

import io
import json
import re
from pathlib import Path

import pytest

from missionc.base.diagnostics.code import CODES
from missionc.cli.app import main
from missionc.compiler.front_end import check
from missionc.frontend.explain.explanation import explained, lines
from missionc.frontend.explain.sentences import sentences
from missionc.frontend.explain.window_diagram import WIDTH
from missionc.ir.language.operator import Fixity
from missionc.ir.language.operators import OPERATORS
from tests.support.resolved_missions import demo, mission
from tests.support.small_missions import LATE, SMALL

ROOT = Path(__file__).resolve().parents[3]
Captured = pytest.CaptureFixture[str]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "small.mission").write_text(SMALL)
    return tmp_path


def said(require: str, more: str = "graph radio = proximity 1 m") -> str:
    """The sentence of a requirement of the small mission of two drones and a goal."""
    made = mission(demo(require=f"require it: {require}", more=more))
    found = sentences(made.requirements[0].formula, made)
    return " ".join([found.whole, *(part.sentence for part in found.parts)])


def test_a_requirement_reads_as_it_is_meant(subtests: pytest.Subtests) -> None:
    for require, sentence in [
        (
            "every drone: eventually[0, 10 s] goal",
            "Every drone, at some step of its own from 0 s to 10 s, is in `goal`.",
        ),
        ("eventually[0, 10 s] every drone: goal", "At some step from 0 s to 10 s, every drone is in `goal`."),
        ("every drone: always[0, 10 s] not goal", "No drone, at any step from 0 s to 10 s, is in `goal`."),
        ("not (some drone: goal)", "There is no drone that is in `goal`."),
        ("drone[0]: always[3 s, 3 s] goal", "drone[0], at 3 s, is in `goal`."),
        ("drone[0]: next goal", "drone[0], at 1 s, is in `goal`."),
        (
            "drone[0]: eventually[2 s, end] goal",
            "drone[0], at some step from 2 s to the end of the mission (10 s), is in `goal`.",
        ),
        (
            "drone[0]: (not goal) until[1 s, 4 s] goal",
            "At some step from 1 s to 4 s, drone[0] is in `goal`; and at every step from 0 s until just before it, "
            "drone[0] is not in `goal`.",
        ),
        (
            "always[0, 2 s] ((some drone: goal) or eventually[1 s, 3 s] every drone: goal)",
            "At every step from 0 s to 2 s, at least one of these holds: (1) at least one drone is in `goal`; "
            "or (2) at some step from 1 s to 3 s later, every drone is in `goal`.",
        ),
        (
            "drone[0]: drone reach[hops 0..2 on radio] goal",
            "A route of at most 2 hops on `radio` leads from drone[0] to an agent (perhaps drone[0] itself) "
            "that is in `goal`, and every agent on it but the last is a drone.",
        ),
        (
            "drone[0]: somewhere[hops 1..1 on radio] always[0, 2 s] goal",
            "A route of exactly 1 hop on `radio` leads from drone[0] to an agent that meets [1]. "
            "[1] means of an agent: at every step from then to 2 s later, the agent is in `goal`.",
        ),
        (
            "at least 2 drone: always[0, 2 s] speed <= 1",
            "Each of at least 2 drones, at every step from 0 s to 2 s, has a speed of at most 1 m/s.",
        ),
    ]:
        with subtests.test(require=require, sentence=sentence):
            assert said(require) == sentence


def test_a_long_let_is_called_by_its_name_and_explained_once() -> None:
    long = " and ".join(f"x >= {number}" for number in range(9))
    text = said("every drone: always[0, 3 s] (far or (goal implies far))", f"let far = next ({long} or goal)")
    assert text.count("`far` means of an agent: 1 s later, ") == 1
    assert "meets `far`" in text


def test_every_mission_has_a_page_that_fits(subtests: pytest.Subtests) -> None:
    missions = sorted((ROOT / "missions").rglob("*.mission"))
    assert missions
    for path in missions:
        with subtests.test(path.stem):
            checked = check(path)
            assert checked.mission is not None
            parts = explained(checked.mission)
            page = lines(parts, checked.mission, None, True)
            assert max(map(len, page)) <= WIDTH
            alone = [part for part in parts if not part.turns]  # those of a family may stand there as one
            assert all(f"{part.name} (line {part.line}" in "\n".join(page) for part in alone)
            assert not any(re.search(r"(?<!\w)\[1\]", part.said.whole) for part in parts)


def test_every_operator_says_how_it_reads() -> None:
    for operator in OPERATORS:
        chain = operator.name in ("and", "or")
        named = ["{body"] if operator.fixity is Fixity.PREFIX else ["{parts"] if chain else ["{left", "{right"]
        assert all(name in operator.reads for name in named), operator.name


# ----------------------------------------------------------- the command line


def test_what_is_written_like_a_code_is_one_and_anything_else_a_file(folder: Path, capsys: Captured) -> None:
    assert main(["explain", "small.mission"]) == 0
    assert capsys.readouterr().out.startswith("mission small: ")
    (folder / "MC301").write_text(SMALL)
    assert main(["explain", "MC301"]) == 0
    assert capsys.readouterr().out.startswith("# MC301: ")
    assert main(["explain", "./MC301"]) == 0
    assert capsys.readouterr().out.startswith("mission small: ")


def test_the_document_says_what_the_page_says(folder: Path, capsys: Captured) -> None:
    assert main(["explain", "small.mission", "--format", "json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert main(["explain", "small.mission"]) == 0
    page = " ".join(capsys.readouterr().out.split())
    made = mission(SMALL)
    assert [goal["name"] for goal in document["goals"]] == [part.name for part in explained(made)]
    for goal in document["goals"]:
        assert goal["sentence"] in page
        assert set(goal["traps"]) <= {trap["name"] for trap in document["traps"]}
        assert goal["looks_to_step"] <= document["steps"] == made.steps
        for window in goal["windows"]:
            assert window["words"] in page
    for trap in document["traps"]:
        assert trap["says"] in page
        assert trap["asked"]["holds"] != trap["otherwise"]["holds"]
    assert document["backend_because"].startswith(f"backend: {document['backend']}\n")
    assert document["diagnostics"] == []


def test_one_requirement_is_explained_alone(folder: Path, capsys: Captured) -> None:
    name = mission(SMALL).requirements[0].name
    assert main(["explain", "small.mission", name, "--format", "json"]) == 0
    assert [goal["name"] for goal in json.loads(capsys.readouterr().out)["goals"]] == [name]


def test_a_mission_that_is_too_short_is_explained_with_its_error(folder: Path, capsys: Captured) -> None:
    (folder / "late.mission").write_text(LATE)
    assert main(["explain", "late.mission"]) == 1
    out, err = capsys.readouterr()
    assert "error[MC301]" in err
    assert "; the mission lasts" in out


def test_a_text_with_errors_is_not_explained(folder: Path, capsys: Captured) -> None:
    (folder / "wrong.mission").write_text(SMALL.replace("world", "wrold"))
    assert main(["explain", "wrong.mission", "--format", "json"]) == 1
    document = json.loads(capsys.readouterr().out)
    assert document["mission"] is None
    assert document["diagnostics"]


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["explain", "absent.mission"], "there is no file `absent.mission`"),
        (["explain", "MC301", "relay"], "the code `MC301` takes no further arguments"),
        (["explain", "-D", "T=3 s"], "`-D` and `--limit` need a mission"),
        (["explain", "small.mission", "nothing_like_it"], "has no requirement `nothing_like_it`; its requirements are"),
    ],
)
def test_what_cannot_be_explained_ends_with_2(folder: Path, capsys: Captured, words: list[str], says: str) -> None:
    assert main(words) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert says in err


def test_codes_are_data_too(capsys: Captured) -> None:
    assert main(["explain", "--format", "json"]) == 0
    assert [code["code"] for code in json.loads(capsys.readouterr().out)["codes"]] == list(CODES)
    assert main(["explain", "MC301", "--format", "json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["page"].startswith(f"# MC301: {document['title']}\n")


def test_the_drawing_is_ascii_where_the_terminal_has_no_more(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    stream = io.TextIOWrapper(io.BytesIO(), encoding="ascii", write_through=True)
    monkeypatch.setattr("sys.stdout", stream)
    assert main(["explain", "small.mission"]) == 0
    stream.seek(0)
    assert "#" in stream.read()

"""SARIF: what code hosts read, held against the standard's own schema."""

from __future__ import annotations

import json
import tarfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft4Validator

from missionc.base.diagnostics.code import CODES, UNREADABLE, explain
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.diagnostics.sarif import render_sarif
from missionc.cli.app import main
from tests.support.npm import ROOT, fetch
from tests.support.small_missions import LATE, SMALL, WRONG

CARRIER = "@microsoft/jest-sarif@1.0.0-beta.0"
"""The npm package that carries the standard's schema; it is read from there, and not kept here."""

Captured = pytest.CaptureFixture[str]
Judge = Callable[[object], list[str]]


@pytest.fixture(scope="module")
def wrong(tmp_path_factory: pytest.TempPathFactory) -> Judge:
    """What the standard's schema has against a log."""
    folder = tmp_path_factory.mktemp("schema")
    with tarfile.open(folder / fetch(folder, "pack", "--silent", CARRIER).strip()) as package:
        (name,) = (name for name in package.getnames() if "/sarif-2.1.0" in name and name.endswith(".json"))
        text = package.extractfile(name)
        assert text is not None
        judge = Draft4Validator(json.load(text))
    return lambda log: [error.message for error in judge.iter_errors(log)]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def checked(capsys: Captured, *words: str, status: int = 1) -> Any:
    assert main(["check", *words, "--format", "sarif"]) == status
    out, err = capsys.readouterr()
    assert err == ""
    return json.loads(out)


def only_result(log: Any) -> Any:
    (result,) = log["runs"][0]["results"]
    return result


def words_of(text: str, region: dict[str, int]) -> str:
    """The characters of a region on one line."""
    assert region["startLine"] == region["endLine"]
    return text.splitlines()[region["startLine"] - 1][region["startColumn"] - 1 : region["endColumn"] - 1]


@pytest.mark.node
def test_the_schema_refuses_what_is_no_log(wrong: Judge) -> None:
    assert wrong({"version": "2.1.0"}) != []
    assert wrong({"version": "2.1.0", "runs": [{"tool": {"driver": {"name": "a"}}, "results": [{}]}]}) != []


@pytest.mark.node
def test_the_schema_accepts_what_is_said_of_every_error_of_nothing_and_of_a_defect(
    wrong: Judge, folder: Path, capsys: Captured, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert wrong(checked(capsys, *error_pages())) == []
    Path("small.mission").write_text(SMALL)
    assert wrong(checked(capsys, "small.mission", status=0)) == []
    assert wrong(render_sarif([Diagnostic(UNREADABLE, "cannot read `a`", None, help="give a file")])) == []
    assert wrong(defective(capsys, monkeypatch)) == []


def error_pages() -> list[str]:
    """The first mission of every page about an error, written here."""
    names = []
    for page in sorted((ROOT / "docs" / "errors").glob("*.md")):
        _, block, rest = page.read_text(encoding="utf-8").partition("```mission\n")
        if block:
            names.append(f"{page.stem}.mission")
            Path(names[-1]).write_text(rest.partition("```")[0])
    return names


def defective(capsys: Captured, monkeypatch: pytest.MonkeyPatch) -> Any:
    """What is said of `small.mission` by a compiler with a defect."""

    def broken(*arguments: object, **named: object) -> None:
        raise ZeroDivisionError

    monkeypatch.delenv("MISSIONC_TRACEBACK", raising=False)
    monkeypatch.setattr("missionc.cli.commands.check.check", broken)
    assert main(["check", "small.mission", "--format=sarif"]) == 70
    return json.loads(capsys.readouterr().out)


def test_the_missions_of_all_error_pages_are_in_one_log(folder: Path, capsys: Captured) -> None:
    log = checked(capsys, *error_pages())
    rules = [rule["id"] for rule in log["runs"][0]["tool"]["driver"]["rules"]]
    results = log["runs"][0]["results"]
    assert len(rules) > 40
    assert {result["ruleId"] for result in results} == set(rules)
    assert all(rules[result["ruleIndex"]] == result["ruleId"] for result in results)


def test_a_clean_mission_has_a_log_without_results(folder: Path, capsys: Captured) -> None:
    Path("small.mission").write_text(SMALL)
    log = checked(capsys, "small.mission", status=0)
    assert log["runs"][0]["results"] == []
    assert log["runs"][0]["tool"]["driver"]["rules"] == []


def test_a_result_points_at_exactly_the_words_and_names_the_file_relative_to_here(
    folder: Path, capsys: Captured
) -> None:
    (folder / "my missions").mkdir()
    text = "# \U0001f681 takes one column\n" + WRONG.replace("require visit", "require\tvisit")
    (folder / "my missions" / "a.mission").write_text(text, encoding="utf-8")
    log = checked(capsys, "my missions/a.mission")
    place = only_result(log)["locations"][0]["physicalLocation"]
    assert place["artifactLocation"] == {"uri": "my%20missions/a.mission", "uriBaseId": "ROOT"}
    assert words_of(text, place["region"]) == "gaol"
    assert log["runs"][0]["columnKind"] == "unicodeCodePoints"
    again = checked(capsys, str(folder / "my missions" / "a.mission"))
    assert only_result(again)["locations"] == only_result(log)["locations"]


def test_a_file_outside_of_this_folder_is_named_by_its_whole_path(
    folder: Path, capsys: Captured, monkeypatch: pytest.MonkeyPatch
) -> None:
    Path("a.mission").write_text(WRONG)
    (folder / "sub").mkdir()
    monkeypatch.chdir(folder / "sub")
    place = only_result(checked(capsys, "../a.mission"))["locations"][0]["physicalLocation"]
    assert place["artifactLocation"] == {"uri": (folder / "a.mission").as_uri()}


def test_second_places_are_related_locations_with_what_they_say(folder: Path, capsys: Captured) -> None:
    text = LATE.replace("eventually[0, 9 s] goal", "always[0, 6 s] eventually[0, 3 s] goal")
    Path("a.mission").write_text(text)
    result = only_result(checked(capsys, "a.mission"))
    (related,) = result["relatedLocations"]
    assert words_of(text, related["physicalLocation"]["region"]) == "eventually[0, 3 s]"
    assert related["message"]["text"] == "reaches another 3 s ahead"
    assert result["locations"][0]["message"]["text"] == "reaches 6 s ahead"
    assert "help: write `horizon 9 s`" in result["message"]["text"]


def test_a_fix_that_is_applied_mends_the_mission(folder: Path, capsys: Captured) -> None:
    Path("a.mission").write_text(WRONG.replace("9 s", "6 s"))
    (fix,) = only_result(checked(capsys, "a.mission"))["fixes"]
    (change,) = fix["artifactChanges"]
    (replacement,) = change["replacements"]
    lines = Path(change["artifactLocation"]["uri"]).read_text().splitlines()
    region, new = replacement["deletedRegion"], replacement["insertedContent"]["text"]
    line = lines[region["startLine"] - 1]
    lines[region["startLine"] - 1] = line[: region["startColumn"] - 1] + new + line[region["endColumn"] - 1 :]
    Path("a.mission").write_text("\n".join(lines) + "\n")
    checked(capsys, "a.mission", status=0)


def test_a_rule_brings_its_page_and_its_level(folder: Path, capsys: Captured) -> None:
    Path("a.mission").write_text(SMALL + "region nowhere = box (1, 1) to (2, 2)\n")
    log = checked(capsys, "a.mission", status=0)
    (rule,) = log["runs"][0]["tool"]["driver"]["rules"]
    assert rule["id"] == "MC103"
    assert rule["help"]["markdown"] == explain(CODES["MC103"])
    assert rule["defaultConfiguration"]["level"] == only_result(log)["level"] == "warning"


def test_a_finding_about_no_text_has_no_place() -> None:
    log = render_sarif([Diagnostic(UNREADABLE, "cannot read `a`", None, help="give a file")])
    assert only_result(log)["locations"] == []


def test_the_same_findings_give_the_same_bytes(folder: Path, capsys: Captured) -> None:
    Path("a.mission").write_text(WRONG)
    assert checked(capsys, "a.mission") == checked(capsys, "a.mission")


def test_a_defect_is_a_log_too(folder: Path, capsys: Captured, monkeypatch: pytest.MonkeyPatch) -> None:
    Path("small.mission").write_text(SMALL)
    log = defective(capsys, monkeypatch)
    assert log["runs"][0]["invocations"] == [{"executionSuccessful": False}]

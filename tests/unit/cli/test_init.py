"""The command `init`: templates are whole missions, and what is written is one under another name."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from missionc.base.limits import Limits
from missionc.base.source import Source
from missionc.cli.app import main
from missionc.compiler import driver
from missionc.frontend.syntax.format import format_mission
from missionc.frontend.syntax.parse import parse
from missionc.frontend.syntax.read_file import unread
from missionc.frontend.templates import DEFAULT, Template, templates
from tests.support.golden_pages import within

TEMPLATES = list(templates().values())


def name(template: Template) -> str:
    return template.name


def test_the_default_is_a_relay_and_needs_no_extra() -> None:
    assert DEFAULT == "relay"
    assert next(iter(templates())) == DEFAULT


@pytest.mark.parametrize("template", TEMPLATES, ids=name)
def test_a_template_checks_without_any_finding(template: Template) -> None:
    checked = driver.check(Source("mine.mission", template.named("mine")))
    assert checked.findings == ()
    assert checked.mission is not None
    assert checked.mission.name == "mine"


@pytest.mark.parametrize("template", TEMPLATES, ids=name)
def test_a_template_is_in_the_one_layout(template: Template) -> None:
    source = Source("mine.mission", template.text)
    program, _ = parse(source, Limits(), unread)
    assert program is not None
    assert format_mission(source, program, Limits()) == template.text


@pytest.mark.parametrize("template", TEMPLATES, ids=name)
def test_a_template_explains_itself_to_who_reads_it_line_by_line(template: Template) -> None:
    comments = [line for line in template.text.splitlines() if line.startswith("#")]
    assert len(comments) >= 4
    assert template.about[0].islower()
    assert template.about.endswith(".")


def test_the_mission_is_called_after_its_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with within(tmp_path):
        assert main(["init", "patrol", "--template", "search"]) == 0
        said = capsys.readouterr().out
        assert main(["check", "patrol.mission"]) == 0
    assert "\nmission patrol\n" in (tmp_path / "patrol.mission").read_text()
    assert "missionc compile patrol.mission" in said


def test_a_file_in_a_folder_is_named_with_or_without_its_ending(tmp_path: Path) -> None:
    assert main(["init", str(tmp_path / "one")]) == 0
    assert main(["init", str(tmp_path / "two.mission")]) == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["one.mission", "two.mission"]
    assert "\nmission two\n" in (tmp_path / "two.mission").read_text()


def test_without_a_name_it_is_the_templates_own(tmp_path: Path) -> None:
    with within(tmp_path):
        assert main(["init", "--template", "split-merge"]) == 0
    assert [path.name for path in tmp_path.iterdir()] == ["split_merge.mission"]


def test_a_file_that_is_there_is_replaced_by_force_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "mine.mission"
    path.write_text("my work")
    assert main(["init", str(path)]) == 1
    assert "MC701" in capsys.readouterr().err
    assert path.read_text() == "my work"
    assert main(["init", str(path), "--force"]) == 0
    assert "\nmission mine\n" in path.read_text()


@pytest.mark.parametrize("word", ["a-b", "3d", "formation", "", "é", "m" * 200])
def test_what_cannot_name_a_mission_is_refused(word: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["init", f"{tmp_path}/{word}.mission"]) == 1
    assert "MC007" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_is_not_there_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["init", str(tmp_path / "none" / "mine")]) == 1
    assert "MC702" in capsys.readouterr().err


def test_force_replaces_no_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "mine.mission").mkdir()
    assert main(["init", str(tmp_path / "mine"), "--force"]) == 1
    assert "MC702" in capsys.readouterr().err


def test_the_list_names_every_template(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["init", "--list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == list(templates())
    assert main(["init", "--list", "--format", "json"]) == 0
    listed = json.loads(capsys.readouterr().out)["templates"]
    assert [each["backend"] for each in listed] == ["smt", "clot", "smt", "smt", "clot"]


def test_a_shell_completes_the_names_of_templates(capsys: pytest.CaptureFixture[str]) -> None:
    from click.shell_completion import ShellComplete

    from missionc.cli.app import commands

    offered = ShellComplete(commands, {}, "missionc", "_MISSIONC_COMPLETE").get_completions(
        ["init", "--template"], "re"
    )
    assert [item.value for item in offered] == ["relay", "reach-avoid"]

"""The VS Code extension: its files fit each other and the compiler, its own tests pass, and it is packed whole."""

from __future__ import annotations

import itertools
import json
import re
import shutil
import zipfile
from pathlib import Path
from typing import Any

import pytest

from missionc.base.diagnostics.code import Severity
from missionc.base.limits import Limits
from missionc.base.source import Source
from missionc.compiler import front_end
from missionc.tools.language_server.open_text import Outline
from missionc.tools.language_server.scene.scene import scene
from missionc.version import __version__
from tests.support.npm import ROOT, fetch, npm

FOLDER = ROOT / "editors" / "vscode"
GROUND = """mission ground
time  step 1 s, horizon 20 s
world (0, 0) to (10, 10)
region base = box (1, 1) to (3.5, 3.5)
region goal = box (6, 6) to (8, 8)
team drone[3] { radius 0.1 m  dynamics single_integrator(speed <= 2 m/s)  start in base }
region fire = disc at (3, 8) radius 1 m
graph radio = proximity 1.5 m
require go: every drone: eventually[0, 20 s] goal
"""
"""A mission that has what the snippets speak of."""


def manifest() -> dict[str, Any]:
    found: dict[str, Any] = json.loads((FOLDER / "package.json").read_text(encoding="utf-8"))
    return found


def snippets() -> dict[str, list[str]]:
    """Each snippet as it stands when nothing is typed into it, once for each choice it offers."""
    found = json.loads((FOLDER / "snippets" / "mission.json").read_text(encoding="utf-8"))
    return {
        name: filled(body if isinstance(body, str) else "\n".join(body))
        for name, body in ((name, snippet["body"]) for name, snippet in found.items())
    }


def filled(body: str) -> list[str]:
    choices = [re.split(r"(?<!\\),", match) for match in re.findall(r"\$\{\d\|(.*?)\|\}", body)]
    texts = []
    for chosen in itertools.product(*choices):
        taken = iter(chosen)
        text = re.sub(r"\$\{\d\|.*?\|\}", lambda _, taken=taken: next(taken).replace("\\,", ","), body)
        texts.append(re.sub(r"\$\{\d:(.*?)\}", r"\1", text).replace("$0", ""))
    return texts


def test_every_file_that_the_manifest_names_is_there() -> None:
    contributes = manifest()["contributes"]
    language = contributes["languages"][0]
    named = [
        manifest()["icon"],
        language["configuration"],
        *language["icon"].values(),
        *(part["path"] for part in contributes["grammars"] + contributes["snippets"]),
    ]
    assert [name for name in named if not (FOLDER / name).is_file()] == []


def test_language_grammar_and_snippets_belong_together() -> None:
    contributes = manifest()["contributes"]
    language, grammar = contributes["languages"][0], contributes["grammars"][0]
    written = json.loads((FOLDER / grammar["path"]).read_text(encoding="utf-8"))
    assert grammar["scopeName"] == written["scopeName"]
    assert {grammar["language"], *(part["language"] for part in contributes["snippets"])} == {language["id"]}
    assert language["extensions"] == [f".{kind}" for kind in written["fileTypes"]]


def test_buttons_and_menus_name_commands_that_there_are() -> None:
    contributes = manifest()["contributes"]
    commands = {command["command"] for command in contributes["commands"]}
    assert {entry["command"] for menu in contributes["menus"].values() for entry in menu} <= commands


def test_brackets_of_the_language_are_those_of_its_grammar() -> None:
    configuration = json.loads((FOLDER / "language-configuration.json").read_text(encoding="utf-8"))
    assert {bracket for pair in configuration["brackets"] for bracket in pair} == set("(){}[]")
    assert configuration["comments"] == {"lineComment": "#"}


@pytest.mark.parametrize(
    ("before", "after"),
    [("team drone[3] {", True), ("require a: (  # both", True), ("region a = box (0, 0)", False), ("# say {", False)],
)
def test_the_line_after_an_open_bracket_is_indented(before: str, after: bool) -> None:
    rules = json.loads((FOLDER / "language-configuration.json").read_text(encoding="utf-8"))["indentationRules"]
    assert bool(re.search(rules["increaseIndentPattern"], before)) is after
    assert re.search(rules["decreaseIndentPattern"], "  }")


@pytest.mark.parametrize("name", sorted(snippets()))
def test_a_snippet_is_a_mission_or_a_part_of_one_that_checks_clean(name: str) -> None:
    for text in snippets()[name]:
        whole = text if text.startswith("mission") else GROUND + text
        checked = front_end.check(Source("snippet.mission", whole), backend=front_end.ANY_BACKEND)
        errors = [finding.message for finding in checked.findings if finding.severity is Severity.ERROR]
        assert errors == [], whole


def test_the_extension_has_the_compilers_version_and_licence() -> None:
    assert manifest()["version"] == __version__
    assert manifest()["license"] == "Apache-2.0"
    assert (FOLDER / "LICENSE").read_bytes() == (ROOT / "LICENSE").read_bytes()


def test_the_readme_names_every_setting_and_every_snippet() -> None:
    readme = (FOLDER / "README.md").read_text(encoding="utf-8")
    found = json.loads((FOLDER / "snippets" / "mission.json").read_text(encoding="utf-8"))
    names = [*manifest()["contributes"]["configuration"]["properties"], *(part["prefix"] for part in found.values())]
    assert [name for name in names if f"`{name}`" not in readme] == []


def test_the_lock_file_holds_a_hash_for_every_package_and_names_no_registry() -> None:
    packages = json.loads((FOLDER / "package-lock.json").read_text(encoding="utf-8"))["packages"]
    fetched = {name: package for name, package in packages.items() if name}
    assert len(fetched) > 100
    assert [name for name, package in fetched.items() if "resolved" in package] == []
    assert [name for name, package in fetched.items() if "integrity" not in package] == []


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the extension with all it needs, so that nothing is left behind in the tree."""
    root = tmp_path_factory.mktemp("vscode")
    copy = root / "editors" / "vscode"
    shutil.copytree(FOLDER, copy, ignore=shutil.ignore_patterns("node_modules", "dist"))
    for shared in ("editors/studio/src", "missionc/tools/studio/assets"):  # the map is the studio's
        shutil.copytree(ROOT / shared, root / shared)
    fetch(copy, "ci", "--prefer-offline", "--no-audit", "--no-fund")
    return copy


@pytest.mark.node
def test_the_extensions_own_tests_pass(installed: Path) -> None:
    tested = npm(installed, "test")
    failed = re.findall(r"^ *not ok(?:.*\n){1,25}", tested.stdout, re.MULTILINE)
    assert tested.returncode == 0, "\n".join(failed) + tested.stdout[-2_000:] + tested.stderr
    assert re.search(r"^# pass [1-9]", tested.stdout, re.MULTILINE), tested.stdout


@pytest.mark.node
@pytest.mark.browser
def test_the_page_of_the_map_draws_a_scene_and_tells_what_is_dragged(installed: Path, browser: Any) -> None:
    source = Source("ground.mission", GROUND)
    drawn = scene(source, Outline.of(source, Limits()).declarations, Limits())
    assert npm(installed, "run", "build").returncode == 0
    page = browser.new_page()
    page.set_content(
        '<main><button id="fit"></button><button id="zoom-in"></button><button id="zoom-out"></button>'
        '<p id="empty"></p><svg id="map" style="height: 400px" hidden></svg></main>'
    )
    page.evaluate(
        "window.told = []; window.acquireVsCodeApi = () => ({ postMessage: (message) => told.push(message) })"
    )
    page.add_style_tag(path=installed / "dist" / "map.css")
    page.add_script_tag(path=installed / "dist" / "map.js")
    message = {"version": 7, "whole": True, "scene": drawn, "name": "ground"}
    page.evaluate("(message) => window.postMessage(message)", message)
    goal = page.locator('[data-at="region goal/0"][data-handle="0"]')
    goal.focus()
    page.keyboard.press("ArrowRight")
    ready, moved = page.evaluate("told")
    assert ready == {"ready": True}
    assert moved["version"] == 7
    assert [GROUND[edit["from"] : edit["to"]] for edit in moved["edits"]] == ["6", "8"]
    assert all(float(edit["insert"]) > float(GROUND[edit["from"] : edit["to"]]) for edit in moved["edits"])
    page.evaluate("(message) => window.postMessage(message)", {**message, "scene": None})
    page.wait_for_selector("#empty", state="visible")
    page.close()


@pytest.mark.node
def test_the_package_holds_what_the_extension_needs_and_nothing_else(installed: Path) -> None:
    packed = npm(installed, "run", "package")
    assert packed.returncode == 0, packed.stdout + packed.stderr
    with zipfile.ZipFile(installed / "dist" / "missionc.vsix") as package:
        assert package.testzip() is None
        held = {name.removeprefix("extension/") for name in package.namelist() if name.startswith("extension/")}
        for name in ("syntaxes/mission.tmLanguage.json", "language-configuration.json", "snippets/mission.json"):
            assert package.read(f"extension/{name}") == (FOLDER / name).read_bytes()
        assert b"missionc.restart" in package.read("extension/dist/extension.js")
        licences = package.read("extension/dist/LICENSES.txt").decode("utf-8")
    assert held == {
        "changelog.md",
        "LICENSE.txt",
        "readme.md",
        "dist/LICENSES.txt",
        "dist/extension.js",
        "dist/map.css",
        "dist/map.js",
        "images/icon.png",
        "language-configuration.json",
        "package.json",
        "snippets/mission.json",
        "syntaxes/mission.tmLanguage.json",
    }
    assert re.search(r"^vscode-languageclient [\d.]+ \(MIT\)\n\nCopyright", licences, re.MULTILINE)

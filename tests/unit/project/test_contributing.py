"""What CONTRIBUTING says it costs to add something is so: each row is made here, or counted on one that is there."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import click
import pytest

from missionc.base.diagnostics.code import CODES
from missionc.base.source import Source
from missionc.cli import app
from missionc.cli.app import main
from missionc.cli.command_names import BUILT_IN, COMMANDS
from missionc.compiler import driver
from missionc.frontend import templates as template_package
from missionc.frontend.templates import templates
from missionc.ir import vehicle_profiles as vehicle_package
from missionc.ir.vehicle_profiles import profiles
from missionc.output.export.export_form import Exported, Format
from missionc.output.export.form_names import NAMES
from missionc.output.export.formats import FORMATS
from tests.support.named_in_code import ROOT, modules_that_name
from tests.support.small_missions import SMALL
from website.pages import flat, navigation

PAGE = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
TABLE = PAGE.split("| new part | new files |", 1)[1].split("\n\n", 1)[0]
ROWS = {
    what: f"{new}; {edited}"
    for what, new, edited, _ in re.findall(r"^\| (.+?) \| (.*?) ?\| (.*?) ?\| (.+) \|$", TABLE, re.MULTILINE)
}
"""What is added, and what its row says of new and of edited files."""
CHANGE = PAGE.split("```diff\n", 1)[1].split("```", 1)[0]
PATH = re.compile(r"`((?:missionc|tests|docs|editors|grammars|website)/[\w/.]+)`")
GO_ON = {"demo", "lsp"}
"""Commands that open a browser or wait for an editor: no command lines are drawn for them."""
BESIDE = '''\
"""A predicate about an agent and a region."""

from missionc.base.late_dataclass import dataclass
from missionc.ir.places import Region
from missionc.ir.predicates.facts import PredicateFacts


@dataclass(frozen=True, slots=True)
class Beside(PredicateFacts):
    region: Region

    def margin(self, view):
        return 0.5 - view.outside(self.region)

    def rate(self, view):
        return view.motion()

    def moved(self, borders):
        return Beside(borders.region(self.region))

    def show(self, words):
        return f"beside({self.region.name})"

    def phrases(self, words):
        return f"is beside `{self.region.name}`", f"is not beside `{self.region.name}`"
'''
BESIDE_WORD = """\
    Predicate("beside", About.AGENT, ("region",), "it is within half a metre", "beside(field)", Beside),
"""
BESIDE_KIND = "from missionc.ir.predicates.beside import Beside"
UNLESS = SMALL.replace("eventually[0, 6 s] goal", "not goal unless[0, 6 s] goal")


def paths(row: str, name: str = "NAME") -> set[str]:
    """The paths that a row names, with the name of something that is there in the place of ``NAME``."""
    return {path.replace("NAME", name) for path in PATH.findall(ROWS[row])}


def modules(row: str, name: str = "NAME") -> set[str]:
    """Of those the modules of the compiler."""
    return {path for path in paths(row, name) if path.startswith("missionc/") and path.endswith(".py")}


# ---------------------------------------------------------------- every row


def test_the_table_has_a_row_for_everything_that_is_added() -> None:
    assert {
        "an operator of time",
        "an operator of space",
        "an operator of the past",
        "a predicate",
        "a shape",
        "dynamics",
        "a kind of graph",
        "a diagnostic",
        "a vehicle",
        "a file of the folder",
        "an export",
        "a command",
        "a flag of `compile`",
        "a backend",
        "a page",
    } <= ROWS.keys()


def test_a_file_that_a_row_would_have_edited_is_there(subtests: pytest.Subtests) -> None:
    for row in ROWS:
        with subtests.test(row=row):
            named = [path for path in paths(row) if "NAME" not in path and "nnn" not in path]
            assert [path for path in named if not (ROOT / path).exists()] == []


@pytest.mark.parametrize(
    ("row", "many", "word"),
    [(row, int(many), word) for row in ROWS for many, word in re.findall(r"(\d+) modules name `(\w+)`", ROWS[row])],
)
def test_as_many_modules_name_it_as_the_row_says(row: str, many: int, word: str) -> None:
    named = modules_that_name(word, "missionc")
    assert len(named) == many, sorted(named)
    defined = {path for path in named if f"\nclass {word}" in (ROOT / path).read_text(encoding="utf-8")}
    assert defined & modules(row, word), "the row does not send to where it is defined"


@pytest.mark.parametrize(
    ("row", "word"), [("an export", "px4"), ("an export", "skybrush"), ("a command", "demo"), ("a command", "fmt")]
)
def test_nothing_but_its_module_and_one_other_names_it(row: str, word: str) -> None:
    (own,) = (path for path in modules(row, word) if path.endswith(f"/{word}.py"))
    assert (ROOT / own).is_file()
    assert modules_that_name(word, "missionc") | {own} == modules(row, word)


def test_a_flag_of_compile_is_named_where_its_row_says() -> None:
    named = modules_that_name("device", "missionc")
    offers = {path for path in named if path.endswith("/spec.py")}
    assert offers
    told = {path for path in named - offers if not path.startswith("missionc/backends/clot/")}  # who it is for
    assert told == modules("a flag of `compile`")


@pytest.mark.parametrize(("row", "word"), [("an operator of time", "release"), ("an operator of space", "surround")])
def test_an_operator_is_named_where_its_row_says(row: str, word: str) -> None:
    folders = ("frontend", "ir/language", "ir/lower")
    named = modules_that_name(word, *(f"missionc/{folder}" for folder in folders))
    assert named == modules(row, word) | {"missionc/frontend/syntax/tokens.py"}


# ---------------------------------------------------------------- operators


def test_the_row_of_an_operator_and_the_worked_example_edit_the_same_files() -> None:
    edited = set(re.findall(r"^\+\+\+ b/(.+)$", CHANGE, re.MULTILINE))
    assert {path for path in paths("an operator of time", "unless") if path.endswith(".py")} == edited


@pytest.fixture(scope="module")
def changed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The repository with the operator of the worked example in it."""
    if shutil.which("git") is None:
        pytest.skip("git applies the change")
    copy = copied(tmp_path_factory.mktemp("changed"))
    apply = ["git", "apply", "--unidiff-zero", "-"]
    ran = subprocess.run(apply, cwd=copy, input=CHANGE, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    return copy


def copied(home: Path) -> Path:
    """The repository once more, to be changed."""
    copy = home / "copy"
    copy.mkdir()
    for folder in ("missionc", "tests", "grammars", "missions", "editors"):
        shutil.copytree(ROOT / folder, copy / folder, ignore=shutil.ignore_patterns("__pycache__", "node_modules"))
    (copy / "docs").symlink_to(ROOT / "docs")
    shutil.copy(ROOT / "pyproject.toml", copy)
    return copy


def replaced(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert text.count(old) == 1, old
    path.write_text(text.replace(old, new), encoding="utf-8")


def python(folder: Path, *words: str) -> str:
    ran = subprocess.run(
        [sys.executable, *words],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(folder)},
        capture_output=True,
        text=True,
    )
    assert ran.returncode == 0, ran.stdout + ran.stderr
    return ran.stdout


def test_the_operator_of_contributing_applies_and_missions_may_use_it(changed: Path, tmp_path: Path) -> None:
    mission = tmp_path / "small.mission"
    mission.write_text(UNLESS, encoding="utf-8")
    assert "unless" in python(changed, "-m", "missionc", "explain", str(mission))
    python(changed, "-m", "missionc", "compile", str(mission), "-o", str(tmp_path / "out"), "--quiet")
    assert '"unless"' not in (ROOT / "missionc" / "frontend" / "syntax" / "tokens.py").read_text(encoding="utf-8")
    assert (tmp_path / "out" / "plan.json").is_file()


@pytest.mark.slow
def test_the_property_tests_take_the_operator_of_contributing_from_there(changed: Path) -> None:
    files = ("tests/properties/ir/test_operators.py", "tests/properties/backends/test_encoding.py")
    said = python(changed, "-m", "pytest", "-q", "-p", "no:cacheprovider", *files, "-k", "unless")
    assert int(re.findall(r"(\d+) passed", said)[0]) >= len(files)


# ------------------------------------------------- what is data or a module


def test_a_predicate_is_a_module_a_name_and_a_value_and_missions_may_use_it(tmp_path: Path) -> None:
    copy = copied(tmp_path)
    (meaning,) = (path for path in modules("a predicate") if "NAME" in path)
    (copy / meaning.replace("NAME", "beside")).write_text(BESIDE, encoding="utf-8")
    words, kinds = "missionc/ir/language/predicates.py", "missionc/ir/predicates/__init__.py"
    assert {words, kinds} <= modules("a predicate")
    replaced(copy / kinds, "from missionc.ir.predicates.compare", f"{BESIDE_KIND}\nfrom missionc.ir.predicates.compare")
    replaced(copy / kinds, "    Inside | ", "    Beside | Inside | ")
    replaced(copy / words, "predicates import Connected", "predicates import Beside, Connected")
    replaced(copy / words, "    HEADING,\n", f"{BESIDE_WORD}    HEADING,\n")
    mission = tmp_path / "small.mission"
    mission.write_text(f"{SMALL}require off: eventually[0, 6 s] drone[0]: not beside(base)\n", encoding="utf-8")
    assert "is not beside `base`" in python(copy, "-m", "missionc", "explain", str(mission))
    python(copy, "-m", "missionc", "compile", str(mission), "-o", str(tmp_path / "out"), "--quiet")
    assert (tmp_path / "out" / "plan.json").is_file()


def test_the_predicates_that_are_there_are_named_where_a_new_one_is() -> None:
    listed = {path for path in modules("a predicate", "touches") if path.startswith("missionc/ir/language/")}
    assert modules_that_name("touches", "missionc/ir/language") == listed


def test_a_diagnostic_is_one_line_and_one_page() -> None:
    for name in CODES:
        assert modules_that_name(name, "missionc") == {"missionc/base/diagnostics/code.py"}, name
        assert (ROOT / "docs" / "errors" / f"{name}.md").is_file()
    assert paths("a diagnostic") == {"docs/errors/MCnnn.md", "missionc/base/diagnostics/code.py"}


@pytest.fixture
def vehicles(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A copy of the folder of vehicles, in the place of the real one."""
    home = tmp_path / "vehicles"
    shutil.copytree(Path(vehicle_package.__file__).parent, home)
    monkeypatch.setattr(vehicle_package, "__file__", str(home / "__init__.py"))
    profiles.cache_clear()
    yield home
    monkeypatch.undo()
    profiles.cache_clear()


def test_a_vehicle_is_one_file(vehicles: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (vehicles / "kite9.toml").write_text('speed = "2.5 m/s"\n', encoding="utf-8")
    assert main(["vehicles", "kite9"]) == 0
    assert "2.5 m/s" in capsys.readouterr().out
    flown = SMALL.replace("start", "vehicle kite9  start", 1)
    checked = driver.check(Source("small.mission", flown))
    assert checked.mission is not None
    assert {agent.vehicle.speed for agent in checked.mission.agents} == {2.5}
    assert paths("a vehicle", "kite9") == {"missionc/ir/vehicle_profiles/kite9.toml"}
    assert not any(modules_that_name(name, "missionc") for name in profiles() if name not in ("plain", "kite9"))


def test_a_template_is_one_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "tea.mission").write_text(f"# Template `tea`: somebody brings tea.\n{SMALL}", encoding="utf-8")
    monkeypatch.setattr(template_package, "__file__", str(tmp_path / "__init__.py"))
    templates.cache_clear()
    try:
        assert list(templates()) == ["tea"]
    finally:
        monkeypatch.undo()
        templates.cache_clear()


def test_an_export_is_one_module_and_its_place_among_the_forms(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    tea = replace(FORMATS["px4"], name="tea", write=lambda flight: Exported({"tea.txt": b"tea\n"}))
    assert isinstance(tea, Format)
    monkeypatch.setitem(FORMATS._values, "tea", tea)
    mission, out = tmp_path / "small.mission", tmp_path / "out"
    mission.write_text(SMALL, encoding="utf-8")
    assert main(["compile", str(mission), "-o", str(out), "--export", "tea", "--quiet"]) == 0
    assert (out / "export" / "tea" / "tea.txt").read_bytes() == b"tea\n"
    assert main(["verify", str(out)]) == 0
    monkeypatch.setattr(FORMATS, "built_in", (*NAMES, "tea"))
    assert main(["export", "--list"]) == 0
    assert "tea" in capsys.readouterr().out


def test_a_command_is_one_module_and_its_name(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    @click.command("tea")
    def command() -> None:
        """Make tea."""
        click.echo("tea")

    module = ModuleType("missionc.cli.commands.tea")
    module.command = command  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, module.__name__, module)
    monkeypatch.setattr(COMMANDS, "built_in", (*BUILT_IN, "tea"))
    monkeypatch.setitem(COMMANDS._values, "tea", f"{module.__name__}:command")
    assert main(["tea"]) == 0
    assert main(["--help"]) == 0
    assert "Make tea." in capsys.readouterr().out


def test_every_command_and_every_flag_of_compile_is_where_their_rows_say() -> None:
    page = (ROOT / "docs" / "commands.md").read_text(encoding="utf-8")
    drawn = (ROOT / "tests" / "properties" / "cli" / "test_hostile_commands.py").read_text(encoding="utf-8")
    assert [name for name in BUILT_IN if f"| `missionc {name}" not in page] == []
    assert {name for name in BUILT_IN if f'"{name}"' not in drawn} == GO_ON
    with click.Context(app.commands) as context:
        compile_ = app.commands.get_command(context, "compile")
    assert compile_ is not None
    flags = [flag.opts[-1] for flag in compile_.params if isinstance(flag, click.Option)]
    assert [flag for flag in flags if f"`{flag}" not in page] == []


def test_a_file_of_the_folder_is_named_by_what_writes_and_what_compares_it() -> None:
    named = modules_that_name("trajectories.csv", "missionc")
    assert named | {"missionc/output/documents/trajectories_csv.py"} == modules(
        "a file of the folder", "trajectories_csv"
    )


def test_a_backend_is_named_where_its_row_says() -> None:
    named = {path for path in modules_that_name("hybrid", "missionc") if "/backends/hybrid/" not in path}
    assert named == modules("a backend")
    assert (ROOT / "missionc" / "backends" / "hybrid" / "backend.py").is_file()


def test_a_page_is_in_the_navigation() -> None:
    assert paths("a page", "roadmaps") >= {"docs/roadmaps.md", "website/pages.py"}
    assert "docs/roadmaps.md" in {page.source for page in flat(navigation())}

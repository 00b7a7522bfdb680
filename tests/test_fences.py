"""Every code block of the documentation is run, or looked at as far as it can be.

Missions and their commands are run in ``test_golden``, the change of CONTRIBUTING in ``unit/test_contributing``.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest

from missionc.base.diagnostics.render import render_json
from missionc.base.source import Source
from missionc.compiler import driver
from missionc.output.documents.whole_flight_json import whole_flight_json
from tests.support.certificates import certified
from tests.support.documentation_fences import console, shell, usage
from tests.support.golden_pages import FILES, Block, blocks, is_file, run
from tests.support.hand_made_flights import wandered
from tests.support.small_missions import CONFLICT, LATE, SMALL

ROOT = Path(__file__).resolve().parent.parent
PAGES = [*sorted(ROOT.glob("*.md")), ROOT / "tests" / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
RUN_ELSEWHERE = frozenset({"mission", "console", "diff"}) | FILES
EDITORS_OWN = frozenset({"lua", "vim", "lisp", "kdl"})
"""Settings in languages that only the editor they are for can read."""
READERS = {"json": json.loads, "toml": tomllib.loads}
LOOKED_AT = frozenset({"sh", "python", *READERS})
NO_CODE = frozenset({"", "text"})

FENCES = {
    f"{page.relative_to(ROOT)}:{text.count(chr(10), 0, block.start)}": block
    for page in PAGES
    for text in [page.read_text(encoding="utf-8")]
    for block in blocks(text)
}
"""Every block of the documentation, by its page and line."""


def kind(block: Block) -> str:
    return block.info.split()[0] if block.info else ""


def fences(*languages: str, word: str = "") -> dict[str, Block]:
    """The blocks of some languages whose first line has a certain word, by page and line."""
    found = {place: block for place, block in FENCES.items() if kind(block) in languages and word in block.info}
    assert found
    return found


def test_a_block_is_of_a_kind_that_is_looked_at() -> None:
    known = RUN_ELSEWHERE | LOOKED_AT | EDITORS_OWN | NO_CODE
    assert FENCES
    strange = [f"{place}: {kind(block)}" for place, block in FENCES.items() if kind(block) not in known]
    assert not strange, "\n".join(strange)


def test_what_is_called_text_is_no_command() -> None:
    commands = [place for place, block in fences(*NO_CODE).items() if block.body.startswith(("$ ", "missionc "))]
    assert not commands, "\n".join(commands)


def test_a_shell_block_has_commands_that_there_are(subtests: pytest.Subtests) -> None:
    for place, block in fences("sh").items():
        with subtests.test(place):
            shell(block.body)


def test_a_command_that_is_not_run_could_be(subtests: pytest.Subtests) -> None:
    for place, block in fences("console", word="norun").items():
        with subtests.test(place):
            console(block.body)


def test_a_block_of_data_can_be_read(subtests: pytest.Subtests) -> None:
    for place, block in fences(*READERS).items():
        with subtests.test(place):
            assert READERS[kind(block)](block.body)


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the missions and with what the wildfire compiles to: the programs of the pages count on both."""
    folder = tmp_path_factory.mktemp("programs")
    (folder / "missions").symlink_to(ROOT / "missions")
    output = folder / "build" / "wildfire"
    assert run(["compile", str(ROOT / "missions" / "wildfire.mission"), "-o", str(output), "--quiet"])[0] == 0
    return folder


@pytest.mark.parametrize(
    "block", [pytest.param(block, id=place) for place, block in fences("python").items() if not is_file(block)]
)
def test_a_program_runs(block: Block, built: Path) -> None:
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    ran = subprocess.run(
        [sys.executable, "-c", block.body], cwd=built, env=environment, capture_output=True, text=True, check=False
    )
    assert ran.returncode == 0, ran.stderr
    assert ran.stdout != ""


@pytest.fixture(scope="module")
def documents() -> dict[str, Any]:
    """Documents that the compiler writes, by a name of their form."""
    planned = dict(driver.compile(Source("small.mission", f"{SMALL}minimize duration\n")).files)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("missionc.backends.cover.refute.CELLS", (8,))  # what finer covers say is not asked here
        missed = dict(driver.compile(Source("a.mission", CONFLICT), explain_limit=60.0).files)
    late = render_json(list(driver.check(Source("late.mission", LATE)).findings))
    either = SMALL.replace("eventually[0, 6 s] goal", "eventually[0, 6 s] (goal or base)")
    several = dict(driver.compile(Source("small.mission", either), alternatives=2).files)
    flown = wandered(1, 2)
    written = [
        json.loads(planned["plan.json"]),
        json.loads(missed["near_miss.json"]),
        json.loads(several["alternatives.json"]),
        json.loads(certified("short_relay").files["cover.json"]),
        json.loads(whole_flight_json(flown.mission, flown.texts, {})),
    ]
    return {
        **{document["schema"]: document for document in written},
        "boxes": json.loads(planned["certificate.json"])["boxes"][0],
        "finding": late[0],
    }


def test_a_json_block_has_the_form_of_what_is_written(documents: dict[str, Any], subtests: pytest.Subtests) -> None:
    for place, block in fences("json").items():
        with subtests.test(place):
            shown = json.loads(block.body)
            match shown:
                case {"schema": form}:
                    agree(shown, documents[form])
                case {"check": _}:
                    agree(shown, documents["boxes"])
                case {"severity": _}:
                    agree(shown, documents["finding"])


def agree(shown: Any, written: Any) -> None:
    """The same keys, all the way down; of a list the first part. What graphs are called is the mission's."""
    match shown, written:
        case dict(), dict():
            assert shown.keys() == written.keys()
            for key in shown.keys() - {"graphs"}:
                agree(shown[key], written[key])
        case [first, *_], [found, *_]:
            agree(first, found)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("missionc compile a.mission --speed 3", "No such option"),
        ("missionc sail a.mission", "unknown command `sail`; run `missionc --help` to list all commands"),
        ("missionc compile missions/tea.mission", "tea"),
        ("missionc compile a.mission --preset tea", "tea"),
        ("make tea", "tea"),
        ("pip install 'missionc[tea]'", "tea"),
        ("brew install missionc", "brew"),
        ("if true; then", "syntax error"),
        (".venv/bin/pytest tests/test_tea.py", "tea"),
    ],
)
def test_a_wrong_shell_block_is_found(text: str, says: str) -> None:
    with pytest.raises(AssertionError, match=says):
        shell(text)


@pytest.mark.parametrize("name", ["bash", "zsh", "fish"])
def test_the_shells_of_the_completion_are_completed(name: str) -> None:
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "_MISSIONC_COMPLETE": f"{name}_source"}
    ran = subprocess.run(
        [sys.executable, "-m", "missionc"], env=environment, capture_output=True, text=True, check=False
    )
    assert "_MISSIONC_COMPLETE" in ran.stdout


def test_a_command_is_read_as_the_command_line_reads_it() -> None:
    usage(["compile", "a.mission", "--seed", "3"])

"""Every page with missions and commands in it is run: `tests/golden/`, `docs/`, `docs/errors/`, the README."""

from __future__ import annotations

from pathlib import Path

import pytest

from missionc.base.diagnostics.code import CODES
from missionc.base.source import Source
from missionc.compiler import driver
from tests.support.golden_pages import (
    Block,
    blocks,
    file_name,
    is_excerpt,
    is_file,
    is_fragment,
    package_in,
    play,
    put_file,
)

ROOT = Path(__file__).resolve().parent.parent
GOLDEN = sorted((ROOT / "tests" / "golden").glob("*.md"))
DOCS = [
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    *sorted((ROOT / "docs").glob("*.md")),
    *sorted((ROOT / "docs" / "decisions").glob("*.md")),
]
ERRORS = sorted((ROOT / "docs" / "errors").glob("*.md"))


def title(page: Path) -> str:
    return str(page.relative_to(ROOT))


@pytest.mark.usefixtures("flown_once")
@pytest.mark.parametrize("page", GOLDEN + DOCS + ERRORS, ids=title)
def test_commands_print_what_the_page_says(page: Path, tmp_path: Path, update_golden: bool) -> None:
    expected = page.read_text(encoding="utf-8")
    actual = play(expected, tmp_path)
    if update_golden and actual != expected:
        page.write_text(actual, encoding="utf-8")
    else:
        if "needs the package torch, which is not installed" in actual:
            pytest.importorskip("torch")
        assert actual == expected


def test_missions_of_the_documentation_check_without_errors_unless_said_to_be_wrong(
    tmp_path: Path, subtests: pytest.Subtests
) -> None:
    for number, page in enumerate(DOCS):
        folder = tmp_path / str(number)
        folder.mkdir()
        whole: dict[str, str] = {}
        found_in_page = blocks(page.read_text(encoding="utf-8"))
        put_files(found_in_page, folder)
        for block in missions_of(found_in_page):
            wrong = block.info.endswith(" wrong")
            text = block.body
            if is_fragment(block):
                text = whole[block.info.split()[2]] + text
            elif not wrong:
                whole[file_name(block)] = text
            with subtests.test(f"{title(page)}: {block.heading}"), package_in(folder):
                found = errors(text, str(folder / "page.mission"))
                assert bool(found) == wrong, found


def test_an_excerpt_stands_in_the_mission_it_is_from() -> None:
    excerpts = [
        (page, block) for page in DOCS for block in blocks(page.read_text(encoding="utf-8")) if is_excerpt(block)
    ]
    assert excerpts
    for page, block in excerpts:
        mission = (ROOT / block.info.split()[2]).read_text(encoding="utf-8").splitlines()
        assert [line for line in block.body.splitlines() if line not in mission] == [], page


def test_the_first_mission_of_an_error_page_earns_its_code(tmp_path: Path, subtests: pytest.Subtests) -> None:
    for page in ERRORS:
        with subtests.test(page.stem):
            earning = under(page, "failing")
            assert earning, "the page has no block under `A failing example`"
            shown = any("$ missionc" in block.body and page.stem in block.body for block in earning)
            assert shown or page.stem in codes(earning, tmp_path / page.stem)


def test_the_repaired_mission_of_an_error_page_has_no_errors(tmp_path: Path, subtests: pytest.Subtests) -> None:
    for page in ERRORS:
        repaired = under(page, "repaired")
        if missions_of(repaired):
            with subtests.test(page.stem):
                found = codes(repaired, tmp_path / page.stem)
                assert page.stem not in found
                assert [name for name in found if not CODES[name].warning] == []


def test_an_error_page_has_the_form_all_share() -> None:
    assert ERRORS
    for page in ERRORS:
        text = page.read_text(encoding="utf-8")
        assert text.startswith(f"# {page.stem}: {CODES[page.stem].title}\n"), page
        assert "## A failing example\n" in text, page


def under(page: Path, heading: str) -> list[Block]:
    """The blocks below a heading that holds such a word."""
    return [block for block in blocks(page.read_text(encoding="utf-8")) if heading in block.heading]


def missions_of(found: list[Block]) -> list[Block]:
    return [block for block in found if block.info.split()[:1] == ["mission"] and not is_excerpt(block)]


def put_files(blocks: list[Block], folder: Path) -> None:
    """Those of the blocks that are files, and no missions."""
    for block in filter(is_file, blocks):
        put_file(block, folder)


def errors(text: str, name: str) -> list[str]:
    """What is wrong with a mission text, warnings aside."""
    checked = driver.check(Source(name, text))
    return [f"{each.code.name}: {each.message}" for each in checked.findings if not each.code.warning]


def codes(blocks: list[Block], folder: Path) -> list[str]:
    """What checking the last mission of some blocks finds, the other files beside it."""
    missions = missions_of(blocks)
    folder.mkdir()
    put_files(blocks, folder)
    for block in missions:
        (folder / file_name(block)).write_text(block.body, encoding="utf-8")
    checked = driver.check(folder / file_name(missions[-1]))
    return [finding.code.name for finding in checked.findings]

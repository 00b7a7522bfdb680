"""Every relative link of the documentation leads somewhere."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
PAGES = [*ROOT.glob("*.md"), ROOT / "tests" / "README.md", *(ROOT / "docs").rglob("*.md")]
FENCE = re.compile(r"^```.*?^```", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\((?!https?:)([^)#\s]*)(#[^)\s]*)?\)")


def test_a_link_leads_to_a_file_and_to_a_heading_of_it() -> None:
    assert PAGES
    dead = [fault for page in PAGES for fault in dead_links(page)]
    assert not dead, "\n".join(dead)


def test_the_index_of_decisions_has_every_record_once() -> None:
    home = ROOT / "docs" / "decisions"
    listed = re.findall(
        r"^- \[(\d{4})\]\((\1-[^)]+\.md)\): \S", (home / "README.md").read_text(encoding="utf-8"), re.MULTILINE
    )
    assert sorted(file for _, file in listed) == sorted(path.name for path in home.glob("[0-9]*.md"))


def dead_links(page: Path) -> list[str]:
    """Every link of a page that leads nowhere, with its line."""
    text = page.read_text(encoding="utf-8")
    fences = [fence.span() for fence in FENCE.finditer(text)]
    dead = []
    for link in LINK.finditer(text):
        if any(start <= link.start() < end for start, end in fences):
            continue
        target, heading = link.groups()
        path = (page.parent / target).resolve() if target else page
        if not path.exists() or (heading and heading[1:] not in anchors(path)):
            line = text.count("\n", 0, link.start()) + 1
            dead.append(f"{page.relative_to(ROOT)}:{line}: {target}{heading or ''}")
    return dead


@cache
def anchors(page: Path) -> set[str]:
    """The names under which headings are linked to."""
    headings = re.findall(r"^#+ +(.+)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}

"""Link checker of a built site, which also finds external dependencies.

in   a folder of HTML
out  broken links, anchors and pictures; resources from a network; a list of external links
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

_URL = re.compile(r"url\(\s*['\"]?(?!data:|#)([^'\")]+)|@import\s+['\"]([^'\"]+)")
_HERE = frozenset({"data", "mailto", "javascript", "blob"})


@dataclass(frozen=True, slots=True)
class Found:
    """Results; ``broken`` and ``loaded`` have place and target.

    ``outward`` are addresses, ``count`` the number of internal links.
    """

    broken: tuple[str, ...]
    loaded: tuple[str, ...]
    outward: frozenset[str]
    count: int


class _Page(HTMLParser):
    """Anchors, links and loaded resources of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.names: set[str] = set()
        self.links: list[str] = []
        self.loads: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for key, value in attrs:
            match tag, key:
                case _, "id":
                    self.names.add(value or "")
                case "a", "name":
                    self.names.add(value or "")
                case "a" | "area", "href":
                    self.links.append(value or "")
                case _, "src" | "data" | "poster":
                    self.loads.append(value or "")
                case "link", "href":
                    self.loads.append(value or "")


def check(site: Path) -> Found:
    """Follow every link of every page, without network access."""
    pages = {path.resolve(): _Page(path.read_text(encoding="utf-8")) for path in sorted(site.rglob("*.html"))}
    broken: list[str] = []
    loaded: list[str] = []
    outward: set[str] = set()
    count = 0
    for path, page in pages.items():
        where = path.relative_to(site.resolve())
        for link in page.links + page.loads:
            parts = urlsplit(link)
            if parts.scheme in _HERE:
                continue
            if parts.scheme or parts.netloc:
                outward.add(link)
                continue
            count += 1
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            if not target.is_file():
                broken.append(f"{where}: `{link}` is not there")
            elif parts.fragment and target in pages and unquote(parts.fragment) not in pages[target].names:
                broken.append(f"{where}: `{link}` has no such heading")
        loaded += [f"{where}: `{link}`" for link in page.loads if _elsewhere(link)]
    for style in sorted(site.rglob("*.css")):
        for found in _URL.finditer(style.read_text(encoding="utf-8")):
            link = found[1] or found[2]
            if _elsewhere(link):
                loaded.append(f"{style.relative_to(site)}: `{link}`")
    return Found(tuple(broken), tuple(loaded), frozenset(outward), count)


def _elsewhere(link: str) -> bool:
    parts = urlsplit(link)
    return bool(parts.netloc) or (bool(parts.scheme) and parts.scheme not in _HERE)

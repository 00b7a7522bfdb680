"""The documentation as a site: it builds, every link of it leads somewhere, and it needs nothing from elsewhere."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import missionc
from missionc.base.diagnostics.code import CODES
from website.links import check
from website.pages import flat, navigation

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """As `make docs` builds it; that fails where a link leads nowhere, or a page loads something from elsewhere."""
    pytest.importorskip("zensical", reason="the extra `docs` builds the site")
    folder = tmp_path_factory.mktemp("site") / "site"
    ran = subprocess.run([sys.executable, "-m", "website", str(folder)], cwd=ROOT, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    within = re.search(r"(\d+) links within", ran.stdout)
    assert within
    assert int(within[1]) > 1000
    return folder


def test_every_page_of_the_documentation_is_in_the_navigation() -> None:
    shown = {page.source for page in flat(navigation())}
    written = {path.relative_to(ROOT).as_posix() for path in (ROOT / "docs").rglob("*.md")}
    assert written - shown == set(), "add it to website/pages.py"


def test_every_page_of_the_navigation_is_built(site: Path) -> None:
    for page in flat(navigation()):
        assert (site / page.path).with_suffix(".html").is_file(), page


def test_every_code_and_every_public_name_has_its_place(site: Path) -> None:
    errors = (site / "errors" / "index.html").read_text(encoding="utf-8")
    assert [name for name in CODES if f'href="{name}.html"' not in errors] == []
    api = (site / "api.html").read_text(encoding="utf-8")
    public = [f"{home}.{name}" for home, names in missionc.HOMES.items() for name in names]
    assert {name.rpartition(".")[2] for name in public} == set(missionc.__all__) - {"__version__"}
    assert [name for name in public if f'id="{name}"' not in api] == []


def test_the_picture_of_the_home_page_leads_to_a_report_that_can_be_played(site: Path) -> None:
    home = (site / "index.html").read_text(encoding="utf-8")
    leads = re.search(r'<a href="([^"]+)"><img', home)
    assert leads
    report = (site / leads[1]).read_text(encoding="utf-8")
    assert '<canvas id="map"' in report
    assert "mission wildfire" in report


def test_missions_are_coloured_by_the_words_of_the_language(site: Path) -> None:
    tutorial = (site / "tutorial.html").read_text(encoding="utf-8")
    assert re.search(r'class="language-mission highlight"><span class="filename">first.mission', tutorial)
    assert '<span class="ow">eventually</span>' in tutorial
    assert 'class="err"' not in tutorial


@pytest.mark.parametrize(
    ("page", "says"),
    [
        ('<a href="there.html">', "index.html: `there.html` is not there"),
        ('<a href="#below">', "index.html: `#below` has no such heading"),
        ('<a href="other.html#below">', "index.html: `other.html#below` has no such heading"),
        ('<img src="map.svg">', "index.html: `map.svg` is not there"),
    ],
)
def test_a_link_that_leads_nowhere_is_found(page: str, says: str, tmp_path: Path) -> None:
    (tmp_path / "index.html").write_text(page)
    (tmp_path / "other.html").write_text('<h2 id="above">')
    assert check(tmp_path).broken == (says,)


@pytest.mark.parametrize(
    ("file", "text"),
    [
        ("index.html", '<script src="https://example.org/a.js"></script>'),
        ("index.html", '<link rel="stylesheet" href="//example.org/a.css">'),
        ("a.css", "body { background: url(https://example.org/a.png) }"),
        ("a.css", '@import "https://example.org/b.css";'),
    ],
)
def test_what_would_be_loaded_from_elsewhere_is_found(file: str, text: str, tmp_path: Path) -> None:
    (tmp_path / file).write_text(text)
    assert len(check(tmp_path).loaded) == 1


def test_links_out_of_the_site_are_listed_and_not_fetched(tmp_path: Path) -> None:
    (tmp_path / "index.html").write_text('<a href="https://example.org/">out</a> <a href="#">up</a>')
    found = check(tmp_path)
    assert found.outward == {"https://example.org/"}
    assert found.broken == ()


@pytest.mark.browser
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_site_is_read_and_searched_from_disk(browser: Any, site: Path, scheme: str) -> None:
    page = browser.new_page(color_scheme=scheme)
    said: list[str] = []
    asked: list[str] = []
    page.on("console", lambda message: said.append(message.text))
    page.on("pageerror", lambda error: said.append(str(error)))
    page.on("request", lambda request: asked.append(request.url))
    page.goto((site / "index.html").as_uri())
    page.keyboard.press("/")
    page.keyboard.type("radius", delay=20)
    page.get_by_text(re.compile(r"\d+ results")).wait_for()
    page.goto((site / "errors" / "MC301.html").as_uri())
    dark = page.evaluate("() => getComputedStyle(document.body).backgroundColor.match(/\\d+/g)[0] < 128")
    assert dark == (scheme == "dark")
    assert said == []
    assert [url for url in asked if not url.startswith(("file:", "data:", "blob:", "about:"))] == []
    page.close()

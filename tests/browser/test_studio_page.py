"""The studio in a browser: text, map and plan follow each other, and a stranger's page gets nothing."""

from __future__ import annotations

import re
import signal
import threading
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("websockets")

from tests.support.small_missions import CONFLICT, SMALL
from tests.support.studio_server import studio
from tests.support.watch_process import watching

pytestmark = pytest.mark.browser

PATIENCE = 120_000
"""Milliseconds: far more than a plan of such a mission takes."""
WIDE = {"width": 1300, "height": 860}


@dataclass
class Opened:
    page: Any
    said: list[str] = field(default_factory=list)
    asked: set[str] = field(default_factory=set)

    def text(self) -> str:
        """The text as the editor has it."""
        return "\n".join(self.page.locator(".cm-line").all_inner_texts()).replace("\n\n", "\n")

    def line(self, beginning: str) -> str:
        found: str = self.page.locator(".cm-line").filter(has_text=re.compile(f"^{beginning}")).inner_text()
        return found

    def says(self, beginning: str, words: str) -> None:
        """Wait until the line that begins so holds these words."""
        lines = self.page.locator(".cm-line").filter(has_text=re.compile(f"^{beginning}"))
        lines.filter(has_text=words).wait_for()

    def piece(self, name: str) -> Any:
        return self.page.locator(f'[data-at="{name}/0"][data-handle="0"]')

    def width(self, name: str) -> float:
        return float(self.piece(name).bounding_box()["width"])

    def middle(self, name: str, handle: int = 0) -> tuple[float, float]:
        box = self.page.locator(f'[data-at="{name}/0"][data-handle="{handle}"]').bounding_box()
        return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

    def drag(self, start: tuple[float, float], across: float, down: float) -> None:
        """With the mouse, in a few steps."""
        mouse = self.page.mouse
        mouse.move(*start)
        mouse.down()
        mouse.move(start[0] + across / 2, start[1] + down / 2)
        mouse.move(start[0] + across, start[1] + down)
        mouse.up()

    def end_of_line(self, beginning: str) -> None:
        self.page.locator(".cm-line").filter(has_text=re.compile(f"^{beginning}")).click()
        self.page.keyboard.press("End")


def opened(browser: Any, address: str, **options: Any) -> Opened:
    page = browser.new_page(**{"viewport": WIDE, **options})
    page.set_default_timeout(PATIENCE)
    found = Opened(page)
    page.on("console", lambda message: found.said.append(message.text))
    page.on("pageerror", lambda error: found.said.append(str(error)))
    page.on("request", lambda request: found.asked.add(request.url.split("/")[2]))
    page.goto(address)
    page.locator("#name").filter(has_text=".mission").wait_for()
    return found


@pytest.fixture
def home(tmp_path: Path) -> Path:
    (tmp_path / "home").mkdir()
    return tmp_path / "home"


@pytest.fixture
def small(browser: Any, home: Path) -> Iterator[Opened]:
    with studio(home, SMALL) as serving:
        found = opened(browser, serving.address)
        yield found
        assert found.said == []
        assert found.asked == {f"127.0.0.1:{serving.server.guard.port}"}
        found.page.close()


def test_from_an_empty_page_to_a_plan_that_plays(browser: Any, tmp_path: Path) -> None:
    with watching(tmp_path, "studio", "--no-open") as run:
        found = opened(browser, run.address())
        page = found.page
        assert "mission relay" in found.text()
        page.locator(".cm-content").click()
        page.keyboard.press("Control+a")
        page.keyboard.insert_text(SMALL)
        found.piece("region goal").wait_for()
        assert page.inner_text("#count") == "no findings"
        page.keyboard.press("Control+Enter")
        page.wait_for_selector("#plan[data-state=planned]")
        report = page.frame_locator("#report")
        assert report.locator("#title").inner_text() == "small"
        report.locator("#play").click()
        report.locator("#now").wait_for()
        page.frames[1].wait_for_function("() => Number(document.getElementById('now').value) > 0")
        assert list(tmp_path.iterdir()) == []

        page.click("#keep")
        page.locator("#notice").filter(has_text="plan saved in build/small").wait_for()
        assert (tmp_path / "build" / "small" / "report.html").is_file()
        page.click("#keep")
        page.click("#ask-answers >> text=Cancel")
        page.click("#save")
        page.fill("#ask-field", "first")
        page.click("#ask-answers >> text=Save")
        page.locator("#notice").filter(has_text="saved as").wait_for()
        assert (tmp_path / "first.mission").read_text() == SMALL
        assert not page.is_visible("#dirty")
        assert found.said == []

        assert run.end(signal.SIGINT) == 130
        page.locator("#notice").filter(has_text="The studio has ended").wait_for()
        page.close()


def test_a_refusal_is_shown_in_the_text_and_a_compilation_can_be_stopped(browser: Any, home: Path) -> None:
    with studio(home, CONFLICT) as serving:
        found = opened(browser, serving.address)
        page = found.page
        page.click("#compile")
        page.click("#stop")
        page.locator("#outcome").filter(has_text="stopped").wait_for()
        page.click("#compile")
        page.wait_for_selector("#plan[data-state=refused]")
        assert "infeasible for every motion" in page.inner_text("#outcome")
        page.locator("#list li", has_text="MC609").wait_for()
        page.locator(".cm-lintRange-error").first.wait_for()
        found.end_of_line("mission small")
        page.keyboard.type(" ")
        page.locator("#count").filter(has_text="no findings").wait_for()
        page.close()
    assert (home / "a.mission").read_text() == CONFLICT


def test_dragging_a_box_edits_its_numbers_and_undo_takes_the_whole_drag_back(small: Opened) -> None:
    small.piece("region goal").wait_for()
    before = small.line("region goal")
    small.drag(small.middle("region goal"), -60, 60)
    small.says("region goal", "box (1")
    numbers = [float(number) for number in re.findall(r"[\d.]+", small.line("region goal"))]
    assert numbers[2] - numbers[0] == pytest.approx(1.6)
    assert numbers[3] - numbers[1] == pytest.approx(1.6)
    assert numbers[0] < 2.2
    assert numbers[1] < 2.2
    assert small.page.is_visible("#dirty")
    small.page.click(".cm-content")
    small.page.keyboard.press("Control+z")
    assert small.line("region goal") == before
    assert not small.page.is_visible("#dirty")


def test_dragging_a_corner_changes_two_numbers_and_leaves_how_the_others_are_written(small: Opened) -> None:
    small.piece("region base").hover()
    small.drag(small.middle("region base", 3), 40, -40)
    small.says("region base", "(0.2, 0.2) to (2")
    assert re.fullmatch(r"region base = box \(0\.2, 0\.2\) to \(2(\.\d+)?, 2(\.\d+)?\)", small.line("region base"))


def test_arrow_keys_move_what_is_chosen_and_enter_leads_to_its_words(small: Opened) -> None:
    small.piece("region goal").focus()
    small.page.keyboard.press("ArrowLeft")
    small.says("region goal", "box (2.1")
    small.page.keyboard.press("ArrowRight")
    small.says("region goal", "box (2.2, 2.2) to (3.8, 3.8)")
    small.page.keyboard.press("Enter")
    assert small.page.evaluate("() => getSelection().toString()") == "region goal = box (2.2, 2.2) to (3.8, 3.8)"


def test_typing_a_number_changes_the_map_also_where_the_rest_cannot_be_read(small: Opened) -> None:
    before = small.width("region base")
    small.end_of_line("require visit")
    small.page.keyboard.type("\nrequire half: always[0,")
    small.end_of_line("region base")
    for _ in range(8):
        small.page.keyboard.press("ArrowLeft")
    small.page.keyboard.press("Backspace")
    small.page.keyboard.type("3")
    assert small.line("region base").endswith("to (3.8, 1.8)")
    wide = "[data-at='region base/0'][data-handle='0']"
    small.page.wait_for_function(
        "([place, before]) => document.querySelector(place).getBoundingClientRect().width > 1.5 * before",
        arg=[wide, before],
    )
    assert "3 errors" in small.page.inner_text("#count") or "error" in small.page.inner_text("#count")


def test_the_cursor_lights_a_shape_and_a_click_on_a_shape_chooses_its_words(small: Opened) -> None:
    small.end_of_line("region goal")
    assert small.page.locator(".thing.lit").get_attribute("data-thing") == "region goal"
    small.piece("region base").click()
    assert small.page.locator(".thing.lit").get_attribute("data-thing") == "region base"


def test_what_a_parameter_says_is_drawn_and_says_why_it_is_not_dragged(browser: Any, home: Path) -> None:
    text = SMALL.replace("world", "param wide = 3.8 m\nworld").replace("(3.8, 3.8)", "(wide, wide)")
    with studio(home, text) as serving:
        found = opened(browser, serving.address)
        found.piece("region goal").wait_for()
        assert "its value is the parameter wide" in found.piece("region goal").get_attribute("aria-label")
        found.drag(found.middle("region goal"), -60, 60)
        assert "(2.2, 2.2) to (wide, wide)" in found.text()
        found.page.close()


def test_the_language_server_completes_explains_mends_and_renames(small: Opened) -> None:
    page = small.page
    small.end_of_line("require visit")
    page.keyboard.type("\nrequire more: every drone: alwa")
    page.locator(".cm-completionLabel").filter(has_text="always").first.wait_for()
    page.keyboard.press("Escape")
    page.keyboard.type("ys[0, 6 s] not gaol")
    page.locator("#list .fix").filter(has_text="Replace `gaol` by `goal`").click()
    small.says("require more", "not goal")
    page.locator(".tok-operator", has_text="eventually").hover()
    page.locator(".cm-lsp-hover-tooltip").wait_for()
    page.locator(".tok-declared", has_text="goal").click()
    page.keyboard.press("F2")
    page.locator(".cm-lsp-rename-panel input").fill("target")
    page.keyboard.press("Enter")
    small.says("require more", "not target")
    small.says("region target", "box (2.2")


def test_a_file_that_changed_on_the_disk_is_not_overwritten_unasked(small: Opened, home: Path) -> None:
    small.end_of_line("mission small")
    small.page.keyboard.type("  # mine")
    (home / "a.mission").write_text(SMALL + "# theirs\n")
    small.page.keyboard.press("Control+s")
    small.page.locator("#ask-words").filter(has_text="changed on disk").wait_for()
    small.page.click("#ask-answers >> text=Load the file")
    small.says("# theirs", "theirs")
    assert (home / "a.mission").read_text() == SMALL + "# theirs\n"
    small.page.click(".cm-content")
    small.page.keyboard.press("Control+z")
    small.says("mission small", "# mine")


def test_a_mission_of_the_gallery_opens_as_a_copy(small: Opened, home: Path) -> None:
    small.page.click("#show-open")
    small.page.fill("#open-filter", "rescue")
    small.page.click("[data-mission=mountain_rescue]")
    small.page.locator("#name").filter(has_text="mountain_rescue.mission").wait_for()
    assert "unsaved; target folder" in small.page.inner_text("#where")
    assert [path.name for path in home.iterdir()] == ["a.mission"]


@pytest.mark.parametrize(("width", "scheme"), [(1300, "light"), (390, "dark")])
def test_nothing_stands_in_the_way_of_who_cannot_see_or_point(
    browser: Any, home: Path, width: int, scheme: str
) -> None:
    from axe_playwright_python.sync_playwright import Axe

    with studio(home, SMALL.replace("goal\n", "gaol\n")) as serving:
        found = opened(
            browser, serving.address, color_scheme=scheme, viewport={"width": width, "height": 800}, bypass_csp=True
        )
        found.page.locator("#list li").first.wait_for(state="attached")
        for tab in ("text", "world", "plan"):
            if found.page.is_visible(f"#tab-{tab}"):
                found.page.click(f"#tab-{tab}")
            results = Axe().run(found.page)
            assert results.violations_count == 0, results.generate_report()
        assert found.page.evaluate("() => document.documentElement.scrollWidth <= innerWidth")
        found.page.close()


def test_a_page_of_another_origin_gets_nothing_whatever_it_knows(browser: Any, home: Path, tmp_path: Path) -> None:
    (tmp_path / "evil").mkdir()
    (tmp_path / "evil" / "index.html").write_text("<!DOCTYPE html><title>evil</title>")
    handler = partial(_Quiet, directory=str(tmp_path / "evil"))
    with studio(home, SMALL) as serving, ThreadingHTTPServer(("127.0.0.1", 0), handler) as evil:
        threading.Thread(target=evil.serve_forever, daemon=True).start()
        page = browser.new_page()
        page.goto(f"http://localhost:{evil.server_port}/")
        guessed = serving.address.replace(serving.server.guard.token, "guessed")
        for address in (serving.address, guessed):
            assert (
                page.evaluate("(address) => fetch(address).then((answer) => answer.text(), () => 'nothing')", address)
                == "nothing"
            )
            assert page.evaluate(SCRIPT, f"{address}studio.js") == "nothing"
            assert page.evaluate(SOCKET, f"{address.replace('http', 'ws')}socket") == "nothing"
            page.evaluate(FRAME, address)
            assert all("mission" not in frame.content() for frame in page.frames[1:])
        page.close()
        evil.shutdown()
    assert (home / "a.mission").read_text() == SMALL


FETCH = "(address) => fetch(address).then((answer) => answer.text(), () => 'nothing')"
SCRIPT = """(address) => new Promise((done) => {
  const script = Object.assign(document.createElement("script"), { src: address });
  script.onload = () => done("loaded");
  script.onerror = () => done("nothing");
  document.head.append(script);
})"""
SOCKET = """(address) => new Promise((done) => {
  const socket = new WebSocket(address);
  socket.onopen = () => done("open");
  socket.onerror = () => done("nothing");
})"""
FRAME = """(address) => new Promise((done) => {
  const frame = Object.assign(document.createElement("iframe"), { src: address, onload: done });
  document.body.append(frame);
})"""


class _Quiet(SimpleHTTPRequestHandler):
    def log_message(self, format: str, *words: object) -> None:
        """Nobody reads it."""

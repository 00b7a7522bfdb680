"""The page of a flight that goes on, in a browser: it grows, is loaded again, and outlives its stream."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from missionc.base.trace import Trace
from missionc.cli.flight_page import FlightPage
from missionc.verification.monitoring.live.session import Session
from tests.support.live_flights import FLIGHT, IN_TOUCH, line, session_of
from tests.support.opened_reports import Opened

pytestmark = pytest.mark.browser


CAMERA = "() => new URLSearchParams(location.hash.slice(1)).get('view')"
"""The camera, as the address has it."""


class Flight:
    """A page that is served, the session that it shows, and a browser that looks at it."""

    def __init__(self, browser: Any, page: FlightPage, session: Session, **options: Any) -> None:
        self.page, self.session = page, session
        self.shown = Opened(browser.new_page(**{"viewport": {"width": 1280, "height": 900}, **options}))
        self.shown.page.on("console", lambda message: self.shown.said.append(message.text))
        self.shown.page.on("pageerror", lambda error: self.shown.said.append(str(error)))
        self.shown.page.goto(page.address)

    def feed(self, text: str) -> None:
        for event in self.session.feed(text):
            self.page.publish(event)
        self.page.heard(self.session.steps.newest)

    def wait(self, selector: str, says: str) -> None:
        self.shown.page.locator(selector, has_text=says).first.wait_for()


@pytest.fixture
def flight(browser: Any) -> Iterator[Flight]:
    checked, session = session_of()
    assert checked.kernel is not None
    with FlightPage(session.mission, checked.kernel) as page:
        found = Flight(browser, page, session)
        yield found
        assert found.shown.said == []
        found.shown.page.close()


def test_verdicts_and_places_come_as_they_are_published_and_are_there_again_when_it_is_loaded_anew(
    flight: Flight,
) -> None:
    shown = flight.shown
    flight.wait("#clock", "waiting for samples")
    flight.feed(line(0, (1, 1), (2, 1)))
    flight.wait("#clock", "0.00 s of 4 s")
    flight.wait(".lane", "… open, decided by 4 s")
    before = shown.picture()
    flight.feed(line(1, (1, 1), (3, 1)))
    flight.wait("#verdict", "▲ 1 at risk")
    assert shown.picture() != before
    flight.feed(line(2, (1, 1), (3, 2)))
    flight.wait(".lane", "✗ violated (final) from 2 s")
    assert "there: violated (final)" in shown.text("#news li:first-child")
    assert shown.page.title().startswith("✗ flight")
    shown.page.click("#closer")
    shown.page.wait_for_function(f"() => ({CAMERA})() !== null")
    camera = shown.page.evaluate(CAMERA)
    shown.page.reload()
    flight.wait(".lane", "✗ violated (final) from 2 s")
    assert shown.page.locator("#news li").count() == 2
    shown.page.click("#closer")
    shown.page.wait_for_function(f"() => ({CAMERA})() !== {json.dumps(camera)}")
    assert float(shown.page.evaluate(CAMERA).split(",")[2]) > float(camera.split(",")[2]) > 1
    shown.page.click("#agents button >> nth=0")
    shown.settle()
    assert shown.page.get_attribute("#agents button >> nth=0", "aria-pressed") == "true"


def test_a_press_on_a_lane_shows_the_past_until_now_is_asked_for(flight: Flight) -> None:
    shown = flight.shown
    for time in (0, 1, 2):
        flight.feed(line(time, (1 + time / 2, 1), (3, 1)))
    flight.wait("#clock", "2.00 s of 4 s")
    present = shown.picture()
    box = shown.page.locator(".lane canvas").first.bounding_box()
    shown.page.mouse.click(box["x"] + 46 + 0.125 * (box["width"] - 46), box["y"] + 10)
    flight.wait("#clock", "0.50 s of 4 s · past")
    shown.page.mouse.move(0, 0)
    assert shown.picture() != present
    flight.feed(line(3, (2, 1), (3, 1)))
    flight.wait("#stream", "last sample at 3.00 s")
    assert "past" in shown.text("#clock")
    shown.page.click("#live")
    flight.wait("#clock", "3.00 s of 4 s")


def test_who_is_missing_is_marked_and_a_plan_and_another_world_are_drawn(flight: Flight) -> None:
    shown = flight.shown
    flight.feed(line(0, (1, 1), (2, 1)))
    for time in (1.0, 2.0, 3.0):
        flight.feed(json.dumps({"t": time, "agent": "drone[0]", "position": [1, 1]}))
    flight.wait("#agents button.silent", "drone[1] (missing)")
    before = shown.picture()
    position = np.linspace((1, 1), (5, 5), 5)[None].repeat(2, axis=0)
    assert not shown.page.is_visible("#layers label:has-text('paths')")
    flight.page.set_plan(Trace(1.0, position, np.zeros_like(position), np.zeros((2, 5))))
    shown.page.locator("#layers label:has-text('paths')").wait_for()
    planned = shown.picture()
    assert planned != before
    checked, _ = session_of(FLIGHT + "region closed = box (0, 4) to (1, 5)\n")
    assert checked.mission is not None
    assert checked.kernel is not None
    flight.page.set_world(checked.mission, checked.kernel)
    flight.page.tell("`closed` is closed", "risk", 3.0)
    flight.wait("#news li.risk", "`closed` is closed")
    assert shown.picture() != planned
    flight.page._record._heard_at -= 60
    flight.wait("#stream", "no samples for 6")
    flight.page.end("the stream has ended")
    flight.wait("#stream", "the stream has ended")


def test_the_command_serves_the_page_until_it_is_interrupted(browser: Any, tmp_path: Path) -> None:
    mission = tmp_path / "flight.mission"
    mission.write_text(FLIGHT, encoding="utf-8")
    words = [sys.executable, "-m", "missionc", "monitor", str(mission), "--live", "--page", "--no-open"]
    with subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as run:
        assert run.stdin is not None
        assert run.stdout is not None
        address = run.stdout.readline().removeprefix("live page: ").strip()
        page = browser.new_page()
        page.goto(address)
        run.stdin.write("".join(line(time, (1, 1), (2, 1)) + "\n" for time in range(5)))
        run.stdin.flush()
        page.locator("#stream", has_text="end of the mission").wait_for()
        page.locator(".lane", has_text="satisfied (final) from 4 s").wait_for()
        run.send_signal(signal.SIGINT)
        assert run.wait(60) == 3
        page.locator("#stream", has_text="missionc has ended").wait_for()
        assert page.locator(".lane").count() == 2
        page.close()


@pytest.mark.parametrize(("width", "scheme"), [(1280, "light"), (390, "dark")])
def test_axe_finds_nothing(browser: Any, width: int, scheme: str) -> None:
    from axe_playwright_python.sync_playwright import Axe

    checked, session = session_of()
    assert checked.kernel is not None
    with FlightPage(session.mission, checked.kernel) as page:
        size = {"width": width, "height": 844}
        found = Flight(browser, page, session, viewport=size, color_scheme=scheme, bypass_csp=True)
        found.feed(line(0, (1, 1), (2, 1)))
        for time in (1.0, 2.0):
            found.feed(json.dumps({"t": time, "agent": "drone[0]", "position": [1, 1]}))
        found.feed(line(3, (1, 1), (2, 1)))
        found.wait("#verdict", "✗ 1 violated (final)")
        result = Axe().run(found.shown.page).response
        assert len(result["passes"]) > 15
        assert [(each["id"], [node["html"] for node in each["nodes"]]) for each in result["violations"]] == []
        assert found.shown.page.evaluate("() => document.documentElement.scrollWidth") <= width
        found.shown.page.close()


def test_links_and_formations_are_drawn_now_and_of_the_past(browser: Any) -> None:
    checked, session = session_of(IN_TOUCH)
    assert checked.kernel is not None
    with FlightPage(session.mission, checked.kernel) as page:
        found = Flight(browser, page, session)
        shown = found.shown
        found.feed(line(0, (1, 1), (2, 1)))
        found.feed(line(1, (1, 1), (3, 1)))
        found.wait("#clock", "1.00 s of 4 s")
        at_risk = shown.picture()
        shown.page.locator("label:has-text('graph') select").select_option("")
        assert shown.picture() != at_risk
        shown.page.locator("label:has-text('graph') select").select_option("radio")
        assert shown.picture() == at_risk
        box = shown.page.locator(".lane canvas").first.bounding_box()
        shown.page.mouse.click(box["x"] + 50, box["y"] + 10)
        found.wait("#clock", "· past")
        assert shown.picture() != at_risk
        shown.page.reload()
        found.wait("#clock", "1.00 s of 4 s")
        assert shown.picture() == at_risk
        assert shown.said == []
        shown.page.close()

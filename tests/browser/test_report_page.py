"""The report in a browser: it plays, answers to pointer and keys, and asks the network for nothing."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from missionc.output.report.report_html import report
from tests.support.opened_reports import Opened, opened
from tests.support.unpacked_reports import MOTION, RELAY, flight, plotted, simulation

pytestmark = pytest.mark.browser

VOLUME = (
    RELAY.replace("(0, 0) to (10, 10)", "(0, 0, 0) to (10, 10, 3)")
    .replace("box (0, 0) to (2, 2)", "box (0, 0, 0) to (2, 2, 3)")
    .replace("box (6, 0) to (10, 2)", "box (6, 0, 0) to (10, 2, 3)")
)


@pytest.fixture
def relay(browser: Any, tmp_path: Path) -> Iterator[Opened]:
    found = opened(browser, tmp_path / "report.html", report(plotted(RELAY, MOTION)))
    yield found
    assert found.said == []
    assert {address.partition("#")[0] for address in found.asked} == {(tmp_path / "report.html").as_uri()}
    found.page.close()


def test_the_page_opens_without_a_word_on_the_console(relay: Opened) -> None:
    assert relay.text("#title") == "relay"
    assert relay.page.locator(".lane[data-lane]").count() == 14
    assert "require goal" in relay.text("#words")


def test_a_check_within_its_tolerance_shows_the_tolerance_and_no_negative_margin(browser: Any, tmp_path: Path) -> None:
    made = plotted(RELAY, MOTION)
    near = replace(
        next(each for each in made.certificate.checks if each.name == "start"), margin=-0.002, tolerance=0.005
    )
    checks = tuple(near if each.name == "start" else each for each in made.certificate.checks)
    content = report(replace(made, certificate=replace(made.certificate, checks=checks)))
    found = opened(browser, tmp_path / "tolerance.html", content)
    row = found.page.locator("#margins tr", has_text="start").first
    assert "within ±0.005 m" in row.inner_text()
    assert "−" not in row.inner_text()
    found.page.close()


def test_playing_moves_time_and_agents_to_the_end(relay: Opened) -> None:
    relay.page.select_option("#speed", "10")
    before = relay.picture()
    relay.page.click("#play")
    relay.page.wait_for_function("() => Number(document.getElementById('now').value) > 0.5")
    assert relay.picture() != before
    relay.page.wait_for_function("() => Number(document.getElementById('now').value) === 4")
    assert relay.page.get_attribute("#play", "aria-label") == "Play"


def test_a_link_says_what_is_shown_first(relay: Opened) -> None:
    address = relay.page.url
    relay.page.goto("about:blank")
    relay.page.goto(f"{address}#t=1&speed=0.5&theme=dark")
    assert relay.now() == 1
    assert relay.page.get_attribute("html", "data-theme") == "dark"
    assert relay.page.input_value("#speed") == "0.5"
    for odd in ("t=nothing", "t=-3", "theme=pink&speed=0", "t", "%%%"):
        relay.page.goto("about:blank")
        relay.page.goto(f"{address}#{odd}")
        assert relay.now() == 0
    relay.page.goto("about:blank")
    relay.page.goto(f"{address}#t=1e9&play")
    assert relay.now() == float(relay.page.get_attribute("#now", "max"))
    relay.page.goto("about:blank")
    relay.page.goto(f"{address}#play&speed=0.1")
    relay.page.wait_for_function("() => Number(document.getElementById('now').value) > 0")
    assert relay.said == []


def test_agents_move_with_time(relay: Opened) -> None:
    pictures = []
    for _ in range(3):
        pictures.append(relay.picture())
        relay.page.keyboard.press("ArrowRight")
    assert len(set(pictures)) == 3


def test_a_click_on_a_lane_shows_its_words_in_the_source(relay: Opened) -> None:
    relay.unfold(3, 4)
    relay.page.click(".lane[data-lane='5'] code")
    relay.settle()
    assert relay.page.locator("mark").all_inner_texts() == ["far implies true reach[hops 0..2 on radio] base"]
    assert relay.page.locator("#words li.chosen").count() == 1
    assert relay.page.get_attribute(".lane[data-lane='5']", "aria-selected") == "true"
    relay.page.click(".lane[data-lane='5'] code")
    relay.settle()
    assert relay.page.locator("mark").count() == 0


def test_a_click_on_the_source_chooses_its_lane(relay: Opened) -> None:
    relay.page.click("#words li:has-text('require goal')")
    relay.settle()
    assert relay.page.get_attribute(".lane[data-lane='0']", "aria-selected") == "true"


def test_pointing_at_a_lane_lights_whom_it_rests_on(relay: Opened) -> None:
    relay.unfold(3, 4)
    relay.page.keyboard.press("End")
    relay.page.hover("#title")
    dark = relay.picture()
    relay.page.hover(".lane[data-lane='5'] code")
    assert relay.picture() != dark
    relay.page.hover("#title")
    assert relay.picture() == dark


def test_the_keys_step_play_and_move_between_lanes(relay: Opened) -> None:
    relay.page.keyboard.press("ArrowRight")
    assert relay.now() == 1
    relay.page.keyboard.press("End")
    assert relay.now() == 4
    relay.page.keyboard.press("ArrowLeft")
    assert relay.now() == 3
    relay.page.keyboard.press("Home")
    relay.page.keyboard.press("Space")
    relay.page.wait_for_function("() => Number(document.getElementById('now').value) > 0")
    relay.page.keyboard.press("Space")
    still = relay.now()
    relay.settle()
    assert relay.now() == still
    relay.page.focus(".lane[data-lane='0']")
    relay.page.keyboard.press("ArrowRight")
    relay.page.keyboard.press("ArrowDown")
    relay.page.keyboard.press("Enter")
    assert relay.page.locator("mark").all_inner_texts() == ["eventually[0, 3 s] far"]


def test_every_control_can_be_reached_by_tab_and_has_a_name(relay: Opened) -> None:
    reached = set()
    for _ in range(60):
        relay.page.keyboard.press("Tab")
        reached.add(relay.page.evaluate("() => document.activeElement.id || document.activeElement.className"))
    assert {"theme", "copy", "map", "slant", "split-side", "play", "speed", "now", "words", "lane goal"} <= reached
    nameless = """() => [...document.querySelectorAll('button, input, select')].filter((each) =>
        !(each.getAttribute('aria-label') || each.textContent || (each.labels && each.labels.length))).length"""
    assert relay.page.evaluate(nameless) == 0


def test_a_mark_goes_to_the_time_of_the_tightest_margin(relay: Opened) -> None:
    relay.page.keyboard.press("End")
    relay.page.click("#marks .tightest", force=True)
    assert relay.now() == pytest.approx(float(relay.text("tr.tightest button").removesuffix(" s")), abs=0.01)


def test_one_agent_s_lanes_are_drawn_when_it_is_chosen(relay: Opened) -> None:
    relay.unfold(3, 4, 5, 7)
    relay.page.keyboard.press("End")
    relay.page.click("#agents button[data-agent='2']")
    relay.settle()
    assert relay.text(".lane[data-lane='9'] output").startswith("✓")
    relay.page.click("#agents button[data-agent='0']")
    relay.settle()
    assert relay.text(".lane[data-lane='9'] output").startswith("✗")


def test_the_page_is_dark_where_the_reader_s_screen_is_and_light_on_paper(browser: Any, tmp_path: Path) -> None:
    found = opened(browser, tmp_path / "dark.html", report(plotted(RELAY, MOTION)), color_scheme="dark")
    theme = "() => document.documentElement.dataset.theme"
    assert found.page.evaluate(theme) == "dark"
    found.page.click("#theme")
    found.settle()
    assert found.page.evaluate(theme) == "light"
    found.page.click("#theme")
    found.settle()
    found.page.evaluate("() => window.dispatchEvent(new Event('beforeprint'))")
    assert found.page.evaluate(theme) == "light"
    found.page.evaluate("() => window.dispatchEvent(new Event('afterprint'))")
    found.settle()
    assert found.page.evaluate(theme) == "dark"
    assert found.said == []
    found.page.close()


def test_a_volume_turns(browser: Any, tmp_path: Path) -> None:
    motion = [[[*place, 1.0] for place in path] for path in MOTION]
    found = opened(browser, tmp_path / "volume.html", report(plotted(VOLUME, motion)))
    before = found.picture()
    box = found.page.locator("#map").bounding_box()
    found.page.mouse.move(box["x"] + 40, box["y"] + 40)
    found.page.click("#slant")
    before = found.picture()
    found.page.mouse.move(box["x"] + 40, box["y"] + 40)
    found.page.mouse.down()
    found.page.mouse.move(box["x"] + 140, box["y"] + 60, steps=3)
    found.page.mouse.up()
    after = found.picture()
    assert after != before
    found.page.focus("#map")
    found.page.keyboard.press("a")
    assert found.picture() != after
    assert found.said == []
    found.page.close()


def test_a_simulated_flight_can_be_followed_and_its_error_is_drawn(browser: Any, tmp_path: Path) -> None:
    motion = np.array(MOTION)
    flights = {f"drone[{agent}]": flight(path) for agent, path in enumerate(motion)}
    beside = simulation(motion + np.array([0.0, 0.3]), 0.02)
    found = opened(browser, tmp_path / "flown.html", report(plotted(RELAY, MOTION, flights, beside)))
    choice = found.page.locator("label:has-text('motion') select")
    assert choice.locator("option").all_inner_texts() == ["planned", "trajectory", "simulated"]
    choice.select_option("flown")
    before = found.picture()
    choice.select_option("simulated")
    assert found.picture() != before
    error = found.page.locator(".lane.chart", has_text="tracking error")
    assert "at most 50.0 mm (vehicle)" in error.inner_text()
    # 0.3 m beside the polynomials, and 2 cm above them.
    assert "simulated 301" in error.inner_text()
    assert "simulated tracking" in found.text("#margins")
    assert found.said == []
    found.page.close()


def test_text_that_looks_like_markup_is_shown_as_it_is(browser: Any, tmp_path: Path) -> None:
    hostile = '# </script><img src=x onerror="document.title=1"> \U0001f681 <b>&amp;\n'
    text = RELAY.replace("require goal", hostile + "require goal")
    found = opened(browser, tmp_path / "hostile.html", report(plotted(text, MOTION)))
    assert hostile.strip() in found.text("#words")
    assert found.page.title() == "relay · missionc report"
    found.page.click(".lane[data-lane='0'] code")
    assert found.page.locator("mark").all_inner_texts() == ["some drone: eventually[0, 3 s] far"]
    assert found.said == []
    assert len(found.asked) == 1
    found.page.close()


def test_a_table_goes_from_one_of_several_plans_to_another(browser: Any, tmp_path: Path) -> None:
    best = plotted(RELAY, MOTION)
    other = plotted(RELAY, [[[9.0, 1.0]] * 5, MOTION[1], MOTION[2]])
    rows: list[dict[str, object]] = [
        {
            "rank": rank,
            "folder": folder,
            "differs": differs,
            "length": 9.0,
            "duration": 2.0,
            "energy": 1.0,
            "margin": 0.2,
        }
        for rank, folder, differs in ((1, None, []), (2, "alternatives/2", ["drone[0]: `far` <b> first"]))
    ]
    found = opened(browser, tmp_path / "several.html", report(best, list(zip(rows, (best, other), strict=True))))
    assert found.page.locator("#plans tbody tr").count() == 2
    assert "drone[0]: `far` <b> first" in found.text("#plans")
    before = found.picture()
    found.page.keyboard.press("ArrowRight")
    shown = found.now()
    found.page.click("#plans tbody tr:nth-child(2) button")
    found.page.wait_for_selector("#plans tbody tr:nth-child(2)[aria-current=true]")
    assert found.now() == shown
    assert found.picture() != before
    assert found.said == []
    found.page.close()

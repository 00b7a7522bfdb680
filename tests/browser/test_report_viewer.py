"""The report as a viewer: its camera, its exports, its address, two plans on one page, and what it costs."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from missionc.output.report.report_html import report
from missionc.verification.certificate import Between, Verdict
from tests.support.opened_reports import Opened, opened
from tests.support.unpacked_reports import MOTION, RELAY, plotted

pytestmark = pytest.mark.browser

OTHER = [[[9.0, 1.0]] * 5, MOTION[1], MOTION[2]]
"""Another motion of the same mission."""

WHERE = "() => new URLSearchParams(location.hash.slice(1)).get('view')"
"""The camera, as the address has it."""


@pytest.fixture
def relay(browser: Any, tmp_path: Path) -> Iterator[Opened]:
    found = opened(browser, tmp_path / "report.html", report(plotted(RELAY, MOTION)))
    yield found
    assert found.said == []
    found.page.close()


def middle(found: Opened) -> tuple[float, float]:
    box = found.page.locator("#map").bounding_box()
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def camera(found: Opened) -> list[float]:
    found.page.wait_for_function(f"() => ({WHERE})() !== null")
    found.page.wait_for_timeout(450)
    return [float(number) for number in found.page.evaluate(WHERE).split(",")]


# -------------------------------------------------------------------- the camera


def test_the_wheel_zooms_towards_the_pointer_and_a_drag_moves_the_map(relay: Opened) -> None:
    x, y = middle(relay)
    relay.page.mouse.move(x + 80, y)
    relay.page.mouse.wheel(0, -600)
    turn, tilt, zoom, east, north, _ = camera(relay)
    assert (turn, tilt) == (0, pytest.approx(np.pi / 2, abs=1e-3))
    assert zoom == pytest.approx(np.exp(0.9), rel=1e-3)
    assert east > 5
    assert north == pytest.approx(5, abs=0.1)
    before = relay.picture()
    relay.page.mouse.move(x + 100, y + 100)
    relay.page.mouse.down()
    relay.page.mouse.move(x + 40, y + 100, steps=3)
    relay.page.mouse.up()
    assert relay.picture() != before
    moved = camera(relay)
    assert moved[3] > east
    assert moved[4] == pytest.approx(north)
    relay.page.click("#fit")
    assert camera(relay)[2:] == [1, 5, 5, 0]


def test_two_fingers_zoom_about_their_middle(relay: Opened) -> None:
    pinch = """() => { const map = document.getElementById('map'); const box = map.getBoundingClientRect();
        const [x, y] = [box.left + box.width / 2, box.top + box.height / 2];
        const send = (type, id, dx) => map.dispatchEvent(new PointerEvent(type,
            { pointerId: id, clientX: x + dx, clientY: y, bubbles: true, pointerType: 'touch' }));
        send('pointerdown', 11, -40); send('pointerdown', 12, 40);
        send('pointermove', 11, -80); send('pointermove', 12, 80);
        send('pointerup', 11, -80); send('pointerup', 12, 80); }"""
    relay.page.evaluate(pinch)
    found = camera(relay)
    assert found[2] == pytest.approx(2, rel=1e-3)
    assert found[3:5] == pytest.approx([5, 5], abs=0.2)


def test_an_agent_that_is_followed_stays_where_it_is_in_the_picture(relay: Opened) -> None:
    relay.page.click("#agents button[data-agent='0']")
    relay.page.click("#follow")
    relay.settle()
    assert relay.page.get_attribute("#follow", "aria-pressed") == "true"
    for _ in range(2):
        relay.page.keyboard.press("ArrowRight")
    relay.page.click("#closer")
    assert camera(relay)[3:5] == MOTION[0][2]
    assert "chase" in relay.page.url
    relay.page.keyboard.press("Escape")
    relay.settle()
    assert relay.page.get_attribute("#follow", "aria-pressed") == "false"


def test_every_mission_can_be_seen_from_the_side(relay: Opened) -> None:
    flat = relay.picture()
    relay.page.click("#slant")
    slanted = relay.picture()
    assert slanted != flat
    x, y = middle(relay)
    relay.page.mouse.move(x, y)
    relay.page.mouse.down()
    relay.page.mouse.move(x + 60, y, steps=2)
    relay.page.mouse.up()
    assert camera(relay)[0] == pytest.approx(-0.6 - 0.6, abs=0.05)
    relay.page.click("#slant")
    assert relay.picture() == flat


def test_the_ruler_measures_between_agents(relay: Opened) -> None:
    relay.page.click("#measure")
    without = relay.picture()
    box = relay.page.locator("#map").bounding_box()
    scale = min((box["width"] - 54) / 10, (box["height"] - 46) / 10)

    def spot(east: float, north: float) -> tuple[float, float]:
        across = box["x"] + (box["width"] + 22) / 2 + (east - 5) * scale
        return across, box["y"] + (box["height"] - 14) / 2 - (north - 5) * scale

    relay.page.mouse.move(*spot(*MOTION[0][0]))
    relay.page.mouse.down()
    relay.page.mouse.move(*spot(*MOTION[1][0]), steps=4)
    relay.page.mouse.up()
    with_ruler = relay.picture()
    assert with_ruler != without
    with relay.page.expect_download() as download:
        export(relay, "svg")
    # Between (1, 1) and (1.5, 1.5), and the bodies have a radius of 0.1 m.
    assert "0.707 m, 0.507 m between bodies" in download.value.path().read_text()
    relay.page.keyboard.press("Escape")
    relay.settle()
    assert relay.page.get_attribute("#measure", "aria-pressed") == "false"


def test_the_map_can_have_the_page_for_itself_and_parts_share_it_as_they_are_dragged(relay: Opened) -> None:
    wide = relay.page.locator("#map").bounding_box()["width"]
    relay.page.focus("#split-side")
    for _ in range(3):
        relay.page.keyboard.press("ArrowRight")
    relay.settle()
    assert relay.page.locator("#map").bounding_box()["width"] == pytest.approx(wide + 60, abs=25)
    relay.page.click("#wide")
    relay.settle()
    assert not relay.page.is_visible("#side")
    assert relay.page.is_visible("#play")
    relay.page.click("#wide")
    relay.settle()
    assert relay.page.is_visible("#side")


# --------------------------------------------------------- exports and the address


def export(found: Opened, what: str) -> None:
    found.page.click("#export summary")
    found.page.click(f"#{what}")


def test_the_picture_is_saved_as_png_and_as_svg_that_draws_the_same(browser: Any, relay: Opened) -> None:
    with relay.page.expect_download() as download:
        export(relay, "png")
    assert download.value.suggested_filename == "relay-0.0s.png"
    assert download.value.path().read_bytes().startswith(b"\x89PNG")
    with relay.page.expect_download() as download:
        export(relay, "svg")
    drawn = download.value.path().read_text()
    page = browser.new_page()
    page.set_content(drawn)
    texts = page.evaluate("() => [...document.querySelectorAll('svg text')].map((each) => each.textContent)")
    assert {"base", "far", "drone[0]", "drone[1]", "drone[2]"} <= set(texts)
    assert page.evaluate("() => document.querySelector('svg').getBBox().width") > 300
    page.close()


def test_the_motion_is_saved_as_a_video(relay: Opened) -> None:
    relay.page.select_option("#speed", "5")
    with relay.page.expect_download() as download:
        export(relay, "video")
    content = download.value.path().read_bytes()
    assert download.value.suggested_filename == "relay.webm"
    # The mark that such files begin with; some frames are larger than none.
    assert content.startswith(b"\x1a\x45\xdf\xa3")
    assert len(content) > 5_000
    assert relay.now() == 0


def test_an_address_shows_what_was_shown(relay: Opened) -> None:
    relay.unfold(0)
    relay.page.click(".lane[data-lane='1'] code")
    relay.page.click("#agents button[data-agent='1']")
    relay.page.select_option("#speed", "2")
    relay.page.click("#slant")
    relay.page.keyboard.press("ArrowRight")
    camera(relay)
    address, before = relay.page.url, relay.picture()
    relay.page.goto("about:blank")
    relay.page.goto(address)
    relay.settle()
    assert relay.now() == 1
    assert relay.page.input_value("#speed") == "2"
    assert relay.page.get_attribute("#agents button[data-agent='1']", "aria-pressed") == "true"
    assert relay.page.get_attribute(".lane[data-lane='1']", "aria-selected") == "true"
    assert relay.page.locator("mark").all_inner_texts() == ["eventually[0, 3 s] far"]
    relay.page.hover("#title")
    assert relay.picture() == before


# ------------------------------------------------------------------- requirements


def test_a_requirement_is_one_row_that_says_when_it_is_decided_and_by_whom(relay: Opened) -> None:
    shown = [each for each in relay.page.locator(".lane[data-lane]").all() if each.is_visible()]
    assert [each.get_attribute("aria-level") for each in shown] == ["1", "1", "1"]
    assert relay.text(".lane[data-lane='0'] .decided") == "✓ satisfied at 2 s by drone[0]"
    assert relay.text(".lane[data-lane='10'] .decided") == "✗ violated at 2 s by drone[0]"
    relay.page.click(".lane[data-lane='0'] .decided")
    assert relay.now() == 2
    relay.unfold(0, 1)
    assert relay.page.is_visible(".lane[data-lane='2']")
    relay.unfold(0)
    assert not relay.page.is_visible(".lane[data-lane='2']")


def test_who_is_not_asked_is_not_counted(relay: Opened) -> None:
    relay.unfold(10, 11, 12)
    relay.page.keyboard.press("End")
    relay.settle()
    assert relay.text(".lane[data-lane='13'] output") == "✓ 1 of 1"
    # That the drone is there is true, and what the requirement fails by.
    assert relay.page.get_attribute(".lane[data-lane='13']", "data-state") == "harms"


def test_a_plan_that_holds_at_its_steps_alone_has_a_badge_of_its_own(browser: Any, tmp_path: Path) -> None:
    made = plotted(RELAY, MOTION)
    broken = Between("chain", Verdict.FAILS, 1.04, 1.69, ("drone[0]",), "chain fails")
    for between, said, state in (
        ((), "✓ verified", "holds"),
        ((broken,), "◐ satisfied at the sample times; chain violated between samples, 1.04–1.69 s", "steps"),
    ):
        certificate = replace(made.certificate, between=between)
        found = opened(browser, tmp_path / "badge.html", report(replace(made, certificate=certificate)))
        assert found.text("#verdict") == said
        assert found.page.get_attribute("#verdict", "class") == state
        found.page.close()


def test_two_plans_are_shown_side_by_side_and_as_onion_skin_on_one_line_of_time(browser: Any, tmp_path: Path) -> None:
    content = report(plotted(RELAY, MOTION), compared=(("one", "other"), plotted(RELAY, OTHER)))
    found = opened(browser, tmp_path / "two.html", content)
    second = "() => document.getElementById('map2').toDataURL()"
    assert found.page.is_visible("#map2")
    before = found.page.evaluate(second)
    found.page.keyboard.press("End")
    assert found.picture() != before
    assert found.page.evaluate(second) != before
    assert "B ✓ satisfied at 0 s by drone[0]" in found.text(".lane[data-lane='0']")
    found.page.keyboard.press("Home")
    found.page.locator("label:has-text('compare') select").select_option("skin")
    skin = found.picture()
    assert not found.page.is_visible("#map2")
    found.page.locator("label:has-text('compare') select").select_option("side")
    with found.page.expect_download() as download:
        export(found, "svg")
    assert download.value.path().read_text().count(">drone[0]<") == 4  # each with its halo
    assert found.picture() != skin
    assert found.said == []
    found.page.close()


# ------------------------------------------------------------ who reads it, and where


def test_on_a_phone_the_player_stays_in_sight(browser: Any, tmp_path: Path) -> None:
    found = opened(browser, tmp_path / "phone.html", report(plotted(RELAY, MOTION)))
    found.page.set_viewport_size({"width": 390, "height": 844})
    for far in (0, 100_000):
        found.page.evaluate(f"() => window.scrollTo(0, {far})")
        box = found.page.locator("#play").bounding_box()
        assert 0 <= box["y"] < 844 - box["height"]
    assert found.page.evaluate("() => document.documentElement.scrollWidth") <= 390
    found.page.close()


def test_on_a_phone_no_number_below_the_bar_lies_on_another(browser: Any, tmp_path: Path) -> None:
    text = RELAY.replace("4 s", "38 s")
    still = np.repeat(np.array(MOTION)[:, :1], 39, axis=1)
    found = opened(browser, tmp_path / "phone.html", report(plotted(text, still)))
    numbers = """() => [...document.querySelectorAll('#ticks span')]
        .filter((each) => getComputedStyle(each).visibility !== 'hidden').map((each) => each.textContent)"""
    assert found.page.evaluate(numbers)[-2:] == ["35 s", "38 s"]
    found.page.set_viewport_size({"width": 390, "height": 844})
    found.settle()
    assert found.page.evaluate(numbers)[-2:] == ["30 s", "38 s"]
    found.page.close()


@pytest.mark.parametrize(("width", "scheme"), [(1280, "light"), (1280, "dark"), (390, "light")])
def test_axe_finds_nothing(browser: Any, tmp_path: Path, width: int, scheme: str) -> None:
    from axe_playwright_python.sync_playwright import Axe

    told = {
        "conflict": ["goal"],
        "trials": [{"change": "without `goal`", "outcome": "planned"}],
        "miss": "violates goal",
        "changes": [
            {
                "change": "`far` larger",
                "edits": [{"file": "a.mission", "line": 5, "before": "region far", "after": "region far larger"}],
                "smallest": False,
                "proven": "",
                "guards": True,
                "plan": 2,
            }
        ],
    }
    first, second = plotted(RELAY, MOTION), plotted(RELAY, OTHER)
    content = report(replace(first, miss="violates goal"), compared=(("one", "other"), second), advice=(told, [second]))
    found = opened(browser, tmp_path / "axe.html", content, color_scheme=scheme, bypass_csp=True)
    found.page.set_viewport_size({"width": width, "height": 900})
    found.unfold(0, 3, 4)
    result = Axe().run(found.page).response
    assert len(result["passes"]) > 20
    assert [(each["id"], [node["html"] for node in each["nodes"]]) for each in result["violations"]] == []
    found.page.close()


def test_a_change_that_helps_is_a_card_that_plays_its_plan(browser: Any, tmp_path: Path) -> None:
    edit = {"file": "a.mission", "line": 5, "before": "region far = 1", "after": "region far = 2"}
    change = {"change": "`far` larger", "edits": [edit], "smallest": False, "proven": "", "guards": True, "plan": 2}
    told = {"conflict": ["goal", "chain"], "trials": [], "miss": "violates goal", "changes": [change]}
    miss = replace(plotted(RELAY, MOTION), miss="violates goal")
    found = opened(browser, tmp_path / "miss.html", report(miss, advice=(told, [plotted(RELAY, OTHER)])))
    assert "Conflicting requirements: goal and chain." in found.text("#advice")
    card = found.page.locator(".card", has_text="far larger")
    assert card.locator("del").inner_text().strip() == "- region far = 1"
    assert card.locator("ins").inner_text().strip() == "+ region far = 2"
    assert "loosens a safety requirement" in card.inner_text()
    before = found.picture()
    card.get_by_role("button").click()
    found.page.wait_for_function("() => document.getElementById('verdict').textContent.includes('verified')")
    assert found.picture() != before
    assert found.said == []
    found.page.close()


# ------------------------------------------------------------------- what it costs


COUNTING = """() => { window.counted = 0; const kind = CanvasRenderingContext2D.prototype;
    for (const name of ['lineTo', 'moveTo', 'arc', 'ellipse', 'fillText', 'fillRect', 'stroke', 'fill']) {
        const draw = kind[name];
        kind[name] = function (...given) { window.counted++; return draw.apply(this, given); };
    } }"""
"""From now on the page counts what it draws on canvases."""


def test_a_hundred_agents_in_a_thousand_steps_fit_a_frame(
    browser: Any, tmp_path: Path, record_property: Callable[[str, object], None]
) -> None:
    text = RELAY.replace("drone[3]", "drone[100]").replace("horizon 4 s", "horizon 1000 s").replace("4 s]", "1000 s]")
    time = np.linspace(0, 40, 1001)
    motion = np.stack(
        [np.stack([5 + 4 * np.sin(time + each), 5 + 4 * np.cos(1.3 * time + each)], axis=-1) for each in range(100)]
    )
    content = report(plotted(text, motion))
    assert len(content) <= 1_500_000
    found = opened(browser, tmp_path / "many.html", content)
    found.unfold(0, 1, 3, 4, 5)
    found.page.evaluate(COUNTING)
    found.page.select_option("#speed", "25")
    browser.start_tracing(page=found.page, categories=["devtools.timeline"])
    found.page.click("#play")
    found.page.wait_for_function("() => Number(document.getElementById('now').value) > 20")
    events = json.loads(browser.stop_tracing())["traceEvents"]
    counted = found.page.evaluate("() => counted")
    spent = {
        name: [each["dur"] / 1000 for each in events if each["name"] == name and "dur" in each]
        for name in ("FireAnimationFrame", "UpdateLayoutTree", "Layout")
    }
    frames = len(spent["FireAnimationFrame"])
    assert frames >= 5
    record_property("milliseconds of script and layout in a frame", sum(map(sum, spent.values())) / frames)
    # Of 100,000 places and 14 lanes with 100 values each, a frame touches what has moved.
    assert counted / frames < 20_000
    assert len(spent["Layout"]) <= 2 * frames
    assert found.said == []
    found.page.close()

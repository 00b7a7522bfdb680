"""The report of flights that are planned anew: what happened in them, and what was flown before."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from missionc.base.source import Source
from missionc.compiler.front_end import ANY_BACKEND, check
from missionc.output.report.loop_tracks import LoopFlights
from missionc.output.report.report_html import Plotted, data, report
from tests.support.legal_plans import Array
from tests.support.opened_reports import opened
from tests.support.unpacked_reports import MOTION, RELAY, flight, links, plotted

pytestmark = pytest.mark.browser


def flown() -> Plotted:
    """Two flights: in the first one a drone is lost at 2 s, and an obstacle appears at 3 s."""
    paths: Array = np.array(MOTION)
    texts = {f"drone[{number}]": flight(path) for number, path in enumerate(paths)}
    made = plotted(RELAY, paths, texts)
    changed = check(
        Source("sample.mission", f"{RELAY}obstacle debris = disc at (6, 6) radius 1\n"), backend=ANY_BACKEND
    )
    assert changed.mission is not None
    told = [
        {"t": 2.0, "by": "event", "says": "drone[2] is lost: its motors stop"},
        {"t": 3.0, "by": "ground", "says": "drone[2] is lost: planned anew in 0.50 s, begun at 3.5 s"},
    ]
    row = {"lost": [], "touched": False, "plans": 1, "room": 0.5, "nearest": {"t": 1.0, "of": ["drone[0]", "drone[1]"]}}
    high = np.append(paths, np.ones((3, 5, 1)), axis=-1)
    loop = LoopFlights(
        record={
            "replans": True,
            "flown": 2,
            "through": "still air, every report in time",
            "kept": [{"name": "goal", "held": 1, "of": 2, "low": 0.0945, "high": 0.9055}],
            "flights": [
                {"number": 1, "passed": True, "told": told, **row},
                {"number": 2, "passed": False, "told": [], **row, "lost": ["goal"]},
            ],
            "gone": {"drone[2]": 2.0},
        },
        headline=("steps", "kept in at least 9.4 % of such flights"),
        times=np.arange(5.0),
        position=high,
        heard=np.arange(5.0),
        told=high,
        allowed=np.full(3, 0.05),
        worlds=((0.0, made.mission), (3.0, changed.mission)),
        lost={"drone[2]": 2.0},
        nearest=None,
    )
    return replace(made, loop=loop)


def past() -> str:
    """Two drones flew for a second and stood for another; the second was lost."""
    rows = [
        {"name": name, "position": [[0, y], [1, y], [1, y]], "velocity": [[0, 0]] * 3, "yaw": [0, 0, 0]}
        for name, y in (("drone[0]", 1), ("drone[3]", 3))
    ]
    nothing: dict[str, object] = {"given_up": [], "slow": {}, "moving": {}, "begins": {}, "texts": {}}
    stretch = {"step": 1, "until": 1, "lost": ["drone[3]"], **nothing, "agents": rows}
    return json.dumps({"schema": "missionc.past/1", "stretches": [stretch]})


def test_flights_are_told_of_and_the_first_one_is_played(browser: Any, tmp_path: Path) -> None:
    from axe_playwright_python.sync_playwright import Axe

    (radio,) = data(flown())["graphs"]
    assert [each for each in links(radio["runs"]) if 2 in each[:2]] == [(1, 2, 0, 2), (0, 2, 0, 2)][::-1]
    found = opened(browser, tmp_path / "flights.html", report(flown()), color_scheme="dark")
    page = found.page
    page.set_viewport_size({"width": 390, "height": 844})
    assert found.text("#verdict") == "◐ kept in at least 9.4 % of such flights"
    assert page.locator("#advice tbody tr").all_inner_texts() == ["✗ goal\t1 of 2 flights\t9.4 to 90.6 %"]
    before = found.picture()
    page.click("#advice .told button >> nth=1")
    assert found.now() == 3
    assert found.picture() != before
    assert page.locator("#marks .event, #marks .ground").count() == 2
    assert found.text(".lane[data-lane='0'] .top").startswith("goal\n✓ satisfied in flight\nplan: ✓ satisfied at 2 s")
    page.click("#plans tbody tr >> nth=1")
    assert page.locator("#advice .told").inner_text() == "none"
    assert page.locator("#plans tr[aria-current='true']").inner_text().startswith("2\t✗ violated: goal")
    assert page.evaluate("() => document.documentElement.scrollWidth") <= 390
    assert Axe().run(page).response["violations"] == []
    assert found.said == []
    page.close()


def test_a_plan_that_begins_in_flight_says_when_and_what_was_flown_before(browser: Any, tmp_path: Path) -> None:
    made = plotted(RELAY, MOTION)
    found = opened(browser, tmp_path / "rest.html", report(replace(made, past=past())))
    assert "plan start: 2 s after the start of the flight" in found.text("#about")
    assert "lost agents: drone[3]" in found.text("#about")
    assert found.page.locator("#phases span").all_inner_texts() == ["recorded 0–1 s", "commanded 1–2 s", "plan 2–6 s"]
    found.page.keyboard.press("End")
    found.settle()
    assert found.text("#clock") == "4.0 s · flight 6.0 s"
    found.page.keyboard.press("Home")
    shown = found.picture()
    bare = opened(browser, tmp_path / "bare.html", report(made))
    assert bare.picture() != shown
    assert not bare.page.is_visible("#phases")
    assert found.said == []
    for each in (bare, found):
        each.page.close()

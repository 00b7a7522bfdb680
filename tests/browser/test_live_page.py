"""The page of ``compile --watch``: it follows what is saved."""

from __future__ import annotations

import signal
from pathlib import Path
from typing import Any

import pytest

from tests.support.small_missions import SMALL, WRONG
from tests.support.watch_process import save_by_rename, watching

pytestmark = pytest.mark.browser

PATIENCE = 120_000
"""Milliseconds: far more than a plan of such a mission takes."""


def test_the_page_reloads_the_report_after_a_save_and_shows_findings_above_the_last_good_one(
    browser: Any, tmp_path: Path
) -> None:
    mission = tmp_path / "a.mission"
    mission.write_text(SMALL)
    said: list[str] = []
    with watching(tmp_path, "compile", "a.mission", "--watch", "--no-open") as run:
        page = browser.new_page(viewport={"width": 1280, "height": 900})
        page.set_default_timeout(PATIENCE)
        page.on("console", lambda message: said.append(message.text))
        page.on("pageerror", lambda error: said.append(str(error)))
        address = run.address()
        page.goto(address)
        report = page.frame_locator("#report")
        report.locator("#agents li").nth(1).wait_for()
        assert report.locator("#title").inner_text() == "small"
        assert page.inner_text("#state") == "plan of the last saved mission"
        assert not page.is_visible("#says")

        save_by_rename(mission, WRONG)
        page.wait_for_selector("[data-state=wrong]")
        assert "error[MC101]: unknown name `gaol`" in page.inner_text("#says")
        assert "below: the report of the last plan" in page.inner_text("#state")
        assert report.locator("#agents li").count() == 2

        report.locator("#ahead").click()
        report.locator("#ahead").click()
        report.locator("#theme").click()
        time, theme = (report.locator(place) for place in ("#now", "html"))
        shown = time.input_value(), theme.get_attribute("data-theme")
        assert float(shown[0]) > 0
        page.wait_for_function("() => view.includes('t=')")

        save_by_rename(mission, SMALL.replace("drone[2]", "drone[3]"))
        report.locator("#agents li").nth(2).wait_for()
        page.wait_for_selector("[data-state=planned]")
        assert not page.is_visible("#says")
        assert (time.input_value(), theme.get_attribute("data-theme")) == shown
        report.locator("#play").click()
        assert said == []

        assert run.end(signal.SIGINT) == 130
        page.wait_for_selector("[data-state=ended]")
        assert report.locator("#agents li").count() == 3
        page.close()

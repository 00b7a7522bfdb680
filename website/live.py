"""Reports that the site plays: missions planned during the build, so that they show the current version.

in   names of missions, as in `pages.missions`
out  live/NAME/report.html for each, in the folder of the site's sources
"""

from __future__ import annotations

from pathlib import Path

from missionc.compiler import driver
from website.pages import ROOT

HOME = ("wildfire",)
"""Mission that the home page always plays."""


def place(name: str) -> str:
    """Place of a mission's report on the site."""
    return f"live/{name}/report.html"


def write_reports(names: tuple[str, ...], docs: Path) -> None:
    """Plan the missions and write their reports.

    Raises:
        ValueError: a mission has no plan.
    """
    for name in names:
        compiled = driver.compile(ROOT / "missions" / f"{name}.mission")
        report = dict(compiled.files).get("report.html")
        if report is None:
            raise ValueError(f"missions/{name}.mission: no plan, and so no report to play")
        path = docs / place(name)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(report)

"""Reports that the site plays: the missions planned as it is built, so that they show what this version finds.

in   names of missions, as `pages.missions` has them
out  live/NAME/report.html of each, in the folder of the site's sources
"""

from __future__ import annotations

from pathlib import Path

from missionc.compiler import driver
from website.pages import ROOT

HOME = ("wildfire",)
"""What the home page plays, whatever else is asked for."""


def place(name: str) -> str:
    """Where on the site the report of a mission lies."""
    return f"live/{name}/report.html"


def write_reports(names: tuple[str, ...], docs: Path) -> None:
    """Plans the missions and writes their reports.

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

"""The report: one page that shows a plan in motion beside the mission's own words, and opens from disk.

in   Plotted: a mission, its plan, its polynomials, what was verified
out  the bytes of ``report.html``, the same each time
"""

from __future__ import annotations

from missionc.output.report.page_data import Plotted, data
from missionc.output.report.render_page import page

__all__ = ["Plotted", "data", "report"]


def report(plotted: Plotted) -> bytes:
    """The page: whole, in UTF-8, without a reference to anything outside it."""
    return page(plotted.mission.name, data(plotted)).encode("utf-8")

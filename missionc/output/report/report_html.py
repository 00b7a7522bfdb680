"""The report: a page that animates a plan next to the mission's text, and opens from disk.

in   Plotted: a mission, its plan, its polynomials, its certificate
out  the bytes of ``report.html``, the same each time
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from missionc.output.report.page_data import Plotted, data
from missionc.output.report.render_page import page

__all__ = ["Plotted", "data", "report"]


def report(
    plotted: Plotted,
    plans: Sequence[tuple[dict[str, object], Plotted]] = (),
    compared: tuple[tuple[str, str], Plotted] | None = None,
    advice: tuple[Mapping[str, object], Sequence[Plotted]] | None = None,
) -> bytes:
    """HTML of the report in UTF-8, without external references.

    Args:
        plans: plans of a folder with several, each with its row of the table; the first one is plotted.
        compared: another plan of the same mission for comparison, and the names of both.
        advice: for a motion that is not a plan, changes that would make the mission possible, and the plans of the
            first ones.
    """
    shown = data(plotted)
    if plans:
        shown["plans"] = [row for row, _ in plans]
        shown["others"] = [data(other) for _, other in plans[1:]]
    if compared:
        names, other = compared
        shown["compare"] = {"names": list(names), "other": data(other)}
    if advice:
        told, remedies = advice
        shown["advice"] = dict(told)
        shown["others"] = [data(remedy) for remedy in remedies]
    return page(plotted.mission.name, shown).encode("utf-8")

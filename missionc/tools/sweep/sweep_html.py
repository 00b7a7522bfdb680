"""Page of a sweep: its figure, a table of its combinations, and all runs with links to their reports.

in   the names of the varied parameters, groups, comparisons
out  the bytes of ``sweep.html``, in UTF-8, without scripts and with links to reports only
"""

from __future__ import annotations

import html
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from missionc.base.trace import counted, decimals
from missionc.flight.simulation.trials import Fraction
from missionc.output.report.render_page import asset
from missionc.tools.sweep.results_table import LEVEL, Comparison, Group, Measure, Spread, counts, measures
from missionc.tools.sweep.run_answer import OUTCOMES
from missionc.tools.sweep.run_grid import words
from missionc.tools.sweep.sweep_folder import Row

POLICY = "default-src 'none'; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'"
"""Content security policy of the page: nothing is executed or loaded."""
ASSETS = Path(__file__).resolve().parent / "assets"
MOST_ROWS = 5000
"""Maximum number of runs that the page lists; the table has all of them."""
DARK = ':root[data-theme="dark"]'
"""Selector of the report's dark colours in its style sheet."""
HEAD = re.compile(rb"^.*?(?=<svg)", re.DOTALL)


@dataclass(frozen=True, slots=True)
class Page:
    """Contents of the page.

    Args:
        title: name of the mission.
        about: one line on the sweep.
        names: names of the varied parameters.
        groups: groups of all combinations.
        figure: figure in SVG, or empty.
        comparisons: comparisons with an older sweep, if any.
        command: function from a run to the command that repeats it.
        report: function from a run to its report, relative to the page, or empty.
    """

    title: str
    about: str
    names: Sequence[str]
    groups: Sequence[Group]
    figure: bytes
    comparisons: Sequence[Comparison]
    command: Callable[[Row], str]
    report: Callable[[Row], str]


def sweep_html(page: Page) -> bytes:
    """Page as bytes; the same contents give the same bytes."""
    rows = [row for group in page.groups for row in group.rows]
    shown = measures(rows)
    figure = HEAD.sub(b"", page.figure).decode("utf-8")
    parts = {
        "POLICY": POLICY,
        "TITLE": html.escape(page.title),
        "STYLE": _colours() + (ASSETS / "sweep.css").read_text(encoding="utf-8"),
        "ABOUT": html.escape(f"{page.about}: {_counted(counts(rows))}"),
        "FIGURE": figure or "<p>The figure needs matplotlib: <code>pip install 'missionc[sweep]'</code></p>",
        "COMPARED": _compared(page.comparisons),
        "GROUPS": _table(page.groups, shown, page.names),
        "RUNS": _runs(rows, shown, page),
    }
    pieces = (ASSETS / "sweep.html").read_text(encoding="utf-8").split("%%")
    text = "".join(parts[piece] if number % 2 else piece for number, piece in enumerate(pieces))
    return text.encode("utf-8", "replace")


def _colours() -> str:
    """CSS of the report's light and dark colours; the system selects them since there is no script."""
    light, dark = asset("style.css").split("\n* {", 1)[0].split(DARK)
    return f"{light}@media (prefers-color-scheme: dark) {{ :root {dark} }}"


def place_of(row: Row, report: str) -> str:
    """Link target of a run: its report, or its line on the page if the report is empty."""
    return report or f"#{row.run.name}"


def percent(rate: Fraction | None) -> str:
    """Rate with its interval: ``90 % (70–97)``; empty for None."""
    return "" if rate is None else f"{100 * rate.share:.0f} % ({100 * rate.low:.0f}–{100 * rate.high:.0f})"


def figures(spread: Spread | None) -> str:
    """Median with its quartiles: ``1.2 (1.1–1.4)``; empty for None."""
    return "" if spread is None else f"{_number(spread.median)} ({_number(spread.low)}–{_number(spread.high)})"


def _number(value: float) -> str:
    return f"{value:.3g}" if abs(value) >= 1e-3 or value == 0 else decimals(value)


def _counted(found: dict[str, int]) -> str:
    return ", ".join(f"{count} {outcome}" for outcome, count in found.items() if count) or "no finished run"


def _cells(cells: Sequence[str], kind: str = "td") -> str:
    return "<tr>" + "".join(f"<{kind}>{html.escape(cell)}</{kind}>" for cell in cells) + "</tr>"


def _table(groups: Sequence[Group], shown: Sequence[Measure], names: Sequence[str]) -> str:
    others = [outcome for outcome in OUTCOMES[1:] if any(group.outcomes[outcome] for group in groups)]
    heads = [each.label for each in shown]
    lines = [_cells([*names, "runs", "runs with a plan", *heads, *others], "th")]
    for group in groups:
        spreads = [figures(group.spreads.get(each.name)) for each in shown]
        fewer = [str(group.outcomes[outcome] or "") for outcome in others]
        values = [value for _, value in group.values]
        lines.append(_cells([*values, str(len(group.rows)), percent(group.success), *spreads, *fewer]))
    return "<table>" + "\n".join(lines) + "</table>"


def _runs(rows: Sequence[Row], shown: Sequence[Measure], page: Page) -> str:
    heads = [*page.names, "seed", "outcome", "backend", *(each.label for each in shown), "message"]
    lines = [_cells(heads, "th")]
    for row in rows[:MOST_ROWS]:
        report = page.report(row)
        outcome = html.escape(row.result.outcome)
        link = f'<a href="{html.escape(report)}">{outcome}</a>' if report else outcome
        found = ["" if (value := each.of(row)) is None else _number(value) for each in shown]
        values = [value for _, value in row.run.values]
        before = [*values, str(row.run.seed)]
        says = row.result.values.get("says")
        after = [str(row.result.values.get("engine") or ""), *found, "" if says is None else str(says)]
        cells = [html.escape(cell) for cell in before] + [link] + [html.escape(cell) for cell in after]
        title = html.escape(page.command(row))
        lines.append(
            f'<tr id="{html.escape(row.run.name)}" class="{outcome}" title="{title}">'
            + "".join(f"<td>{cell}</td>" for cell in cells)
            + "</tr>"
        )
    left = len(rows) - MOST_ROWS
    more = f"<p>{counted(left, 'more run')} in the table of runs</p>" if left > 0 else ""
    return "<table>" + "\n".join(lines) + f"</table>{more}"


def _compared(found: Sequence[Comparison]) -> str:
    if not found:
        return ""
    lines = [_cells(["combination", "measure", "pairs", "before", "now", "verdict", "p-value", "test"], "th")]
    for each in found:
        name = "all runs" if each.values is None else words(each.values)
        numbers = [str(each.pairs), _number(each.old), _number(each.new), each.verdict, f"{each.p:.2g}", each.test]
        cell = "".join(f"<td>{html.escape(text)}</td>" for text in [name, each.measure.label, *numbers])
        lines.append(f'<tr class="{html.escape(each.verdict.partition(" ")[0])}">{cell}</tr>')
    told = f"paired by values and seed; p-values adjusted by Holm's method; significance level {LEVEL:g}"
    return f"<section><h2>Comparison <small>{told}</small></h2><table>" + "\n".join(lines) + "</table></section>"

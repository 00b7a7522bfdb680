"""Verdict lanes: one for each requirement and each of its subformulas, as the author wrote them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np

from missionc.base.source import Span
from missionc.base.trace import Trace
from missionc.ir import Formula, Mission, Without
from missionc.kernel.nodes import Kernel, Node
from missionc.language.walk_formulas import goals, operands
from missionc.monitoring.verdict_table import Row, table
from missionc.monitoring.witness import Witness, Witnesses
from missionc.output.report.pack import pack, thousandths

Places: TypeAlias = Callable[[Span], list[int] | None]

MOST_LANES = 240
"""Sub-formulas that are shared are shown wherever they are used; what comes after so many is left out."""


def lanes(
    mission: Mission, kernel: Kernel, trace: Trace, place: Places
) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """The values, once for each formula; and the lanes in the order they are read, each with the number of its row."""
    wanted = _tree(mission, kernel)
    nodes = list(dict.fromkeys(kernel.meanings[formula] for formula, _, _, _, _ in wanted))
    roots = [goal.formula for goal in kernel.requirements + kernel.preferences]
    rows = table(nodes, roots, mission, trace, kernel.opposites)
    witnesses = Witnesses(roots, mission, trace, kernel.opposites)
    lets = {formula: name for name, formula in mission.lets}
    number = {node: index for index, node in enumerate(nodes)}
    return (
        [_row(node, rows[node], witnesses) for node in nodes],
        [
            {
                "row": number[kernel.meanings[formula]],
                "depth": depth,
                "name": name,
                "weight": weight,
                "let": lets.get(formula, ""),
                "words": said + " ".join(formula.span.text.split()),
                "place": place(formula.span),
            }
            for formula, depth, name, weight, said in wanted
        ],
    )


def _tree(mission: Mission, kernel: Kernel) -> list[tuple[Formula, int, str, float | None, str]]:
    """Each goal's formulas in the order they are read, with their depth; of the goal itself its name and weight too.

    Last, what is said before the words: of one of several cases, who is lost.
    """
    lanes: list[tuple[Formula, int, str, float | None, str]] = []
    for goal in goals(mission):
        stack: list[tuple[Formula, int, str]] = [(goal.formula, 0, "")]
        while stack and len(lanes) < MOST_LANES:
            formula, depth, said = stack.pop()
            if formula not in kernel.meanings:
                continue
            named = (goal.name, getattr(goal, "weight", None)) if depth == 0 else ("", None)
            lanes.append((formula, depth, *named, said))
            below = zip(operands(formula), _said_before(formula, mission), strict=True)
            stack.extend((operand, depth + 1, words) for operand, words in reversed(list(below)))
    return lanes


def _said_before(formula: Formula, mission: Mission) -> list[str]:
    """For each operand, whom it is without."""
    if not isinstance(formula, Without):
        return [""] * len(operands(formula))
    return [f"without {', '.join(mission.agents[agent].name for agent in lost)}: " for lost in formula.lost]


def _row(node: Node, row: Row, witnesses: Witnesses) -> dict[str, Any]:
    """``team``: one line of values for all agents. ``verdict``: least and most over time, of one verdict at step 0."""
    entry: dict[str, Any] = {
        "team": len(row.asked) == 1,
        "verdict": row.unfolds,
        "asked": pack(row.asked),
        "least": pack(thousandths(row.least)),
        "surely": pack(row.surely),
    }
    if row.unfolds:
        entry |= {"most": pack(thousandths(row.most)), "possibly": pack(row.possibly)}
    seen = witnesses.of(node, row.unfolds)
    return entry | (_witness(seen, row) if seen else {})


def _witness(seen: Witness, row: Row) -> dict[str, Any]:
    """``lit``: 1 where an agent makes it true, 2 where one makes it false. ``links``: rows of four, as of a graph."""
    # Once a verdict is certain, what would make it the other way has no say.
    lit = np.where(seen.fails & ~row.surely, 2, np.where(seen.holds & row.possibly, 1, 0))
    entry: dict[str, Any] = {"lit": pack(lit)}
    if len(seen.links):
        order = np.lexsort((seen.links[:, 0], seen.links[:, 2], seen.links[:, 1]))
        step, first, second = seen.links[order].T
        fresh = np.ones(len(step), dtype=np.bool_)
        fresh[1:] = (np.diff(first) != 0) | (np.diff(second) != 0) | (np.diff(step) != 1)
        begin = np.flatnonzero(fresh)
        end = np.append(begin[1:], len(step)) - 1
        entry["links"] = pack(np.stack([first[begin], second[begin], step[begin], step[end] + 1]))
    if seen.formations:
        entry["formations"] = list(seen.formations)
    return entry

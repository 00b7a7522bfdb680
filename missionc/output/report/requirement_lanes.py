"""Verdict lanes of the report: one for each requirement and each of its subformulas, as the author wrote them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from missionc.base.late_dataclass import Record
from missionc.base.source import Span
from missionc.base.trace import Flags, Trace
from missionc.ir import Formula, Mission, Without
from missionc.ir.kernel.nodes import Kernel, Node
from missionc.ir.language.walk_formulas import goals, operands
from missionc.output.report.pack import COARSE, PER_METRE, pack, rounded
from missionc.verification.monitoring.verdict_table import Blame, Row, table
from missionc.verification.monitoring.violation import Witness, Witnesses

Places: TypeAlias = Callable[[Span], list[int] | None]

ABSENT, HELPS, HARMS, NEITHER, OPEN = range(5)
"""Effects of a formula's value on its goal."""

MOST_FINE = 40_000
"""Maximum number of values of a formula that are stored in millimetres; more values are stored in centimetres."""

MOST_LANES = 240
"""Maximum number of lanes; shared subformulas are repeated wherever they are used, and further ones are omitted."""


class _Lane(Record):
    """Lane of a formula in a goal: its depth, and the sign of its effect, as in ``Blame.sign``."""

    formula: Formula
    goal: Node
    depth: int
    sign: int
    name: str = ""
    weight: float | None = None
    said: str = ""


def lanes(
    mission: Mission, kernel: Kernel, trace: Trace, place: Places
) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Rows of values, one for each formula, and lanes in reading order, each with the number of its row."""
    roots = [goal.formula for goal in kernel.requirements + kernel.preferences]
    blame = Blame(roots, mission, trace, kernel.opposites)
    wanted = _tree(mission, kernel, blame)
    nodes = list(dict.fromkeys(kernel.meanings[each.formula] for each in wanted))
    rows = table(nodes, roots, mission, trace, kernel.opposites)
    witnesses = Witnesses(roots, mission, trace, kernel.opposites)
    seen = {node: witnesses.of(node, rows[node].unfolds) for node in nodes}
    lets = {formula: name for name, formula in mission.lets}
    number = {node: index for index, node in enumerate(nodes)}
    told = []
    for each in wanted:
        node = kernel.meanings[each.formula]
        told.append(
            {
                "row": number[node],
                "depth": each.depth,
                "name": each.name,
                "weight": each.weight,
                "let": lets.get(each.formula, ""),
                "words": each.said + " ".join(each.formula.span.text.split()),
                "place": place(each.formula.span),
                "effect": pack(effects(rows[node], each.sign, blame.failing(each.goal, node))),
                **({} if each.depth else {"decided": _decided(rows[node], seen[node])}),
            }
        )
    return [_row(rows[node], seen[node]) for node in nodes], told


def effects(row: Row, sign: int, failing: Flags) -> NDArray[np.int64]:
    """Effect of each value on the goal: ``ABSENT``, ``HELPS``, ``HARMS``, ``NEITHER``, or ``OPEN`` while undecided.

    Args:
        sign: effect of the formula: by its truth (1), by its falsity (-1), or by both or neither (0).
        failing: mask of where it makes the goal false, (agents, steps + 1).

    Returns:
        As the row: (agents, steps + 1), or (1, steps + 1) for a formula about the team.
    """
    harms = failing if len(row.asked) == len(failing) else failing.any(axis=0, keepdims=True)
    asked, truth, open_ = row.asked, row.surely, np.zeros_like(row.surely)
    if row.unfolds:
        asked, harms = (
            np.broadcast_to(asked[:, :1], truth.shape),
            np.broadcast_to(np.atleast_2d(harms)[:, :1], truth.shape),
        )
        open_ = row.possibly & ~row.surely
    helps = truth if sign > 0 else ~truth if sign < 0 else np.zeros_like(truth)
    came = np.where(harms, HARMS, np.where(helps, HELPS, NEITHER))
    return np.asarray(np.where(~asked, ABSENT, np.where(open_, OPEN, came)), dtype=np.int64)


def _decided(row: Row, seen: Witness | None) -> dict[str, Any]:
    """Step at which a goal's verdict becomes final, the verdict, and the agents that decide it there."""
    settled: Flags = np.equal(row.surely, row.possibly)[0] if row.unfolds else np.ones(1, dtype=np.bool_)
    step = int(np.argmax(settled)) if settled.any() else row.surely.shape[1] - 1
    holds = bool(row.surely[0, step])
    lit = None if seen is None else (seen.holds if holds else seen.fails)[:, step]
    return {"step": step, "holds": holds, "by": [] if lit is None else np.flatnonzero(lit).tolist()}


def _tree(mission: Mission, kernel: Kernel, blame: Blame) -> list[_Lane]:
    """Lanes for the formulas of each goal in reading order; the cases of a loss are labelled with the lost agents."""
    lanes: list[_Lane] = []
    for goal in goals(mission):
        if goal.formula not in kernel.meanings:
            continue
        root = kernel.meanings[goal.formula]
        stack = [_Lane(goal.formula, root, 0, 1, goal.name, getattr(goal, "weight", None))]
        while stack and len(lanes) < MOST_LANES:
            lane = stack.pop()
            lanes.append(lane)
            parent = kernel.meanings[lane.formula]
            below = [
                _Lane(operand, root, lane.depth + 1, blame.sign(parent, lane.sign, kernel.meanings[operand]), said=said)
                for operand, said in zip(operands(lane.formula), _said_before(lane.formula, mission), strict=True)
                if operand in kernel.meanings
            ]
            stack.extend(reversed(below))
    return lanes


def _said_before(formula: Formula, mission: Mission) -> list[str]:
    """Label of each operand of a formula: its lost agents, or empty."""
    if not isinstance(formula, Without):
        return [""] * len(operands(formula))
    return [f"without {', '.join(mission.agents[agent].name for agent in lost)}: " for lost in formula.lost]


def _row(row: Row, seen: Witness | None) -> dict[str, Any]:
    """Data of a formula's values for the page.

    ``team`` is True for one line of values for all agents, ``verdict`` for bounds over time of one verdict at step 0.
    """
    per_metre = PER_METRE if row.least.size <= MOST_FINE else COARSE
    entry: dict[str, Any] = {
        "per_metre": per_metre,
        "team": len(row.asked) == 1,
        "verdict": row.unfolds,
        "asked": pack(row.asked),
        "least": pack(rounded(row.least, per_metre)),
        "surely": pack(row.surely),
    }
    if row.unfolds:
        entry |= {"most": pack(rounded(row.most, per_metre)), "possibly": pack(row.possibly)}
    return entry | (_witness(seen, row) if seen else {})


def _witness(seen: Witness, row: Row) -> dict[str, Any]:
    """Data of a formula's witness for the page.

    ``lit`` is 1 if an agent makes the formula true, 2 if it makes it false. ``links`` are rows of four numbers, as in a
    graph.
    """
    # Once a verdict is final, evidence for the opposite has no effect.
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

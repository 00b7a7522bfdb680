"""Verdict lanes: one for each requirement and each of its subformulas, as the author wrote them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from missionc.base.source import Span
from missionc.base.trace import Flags, Trace
from missionc.ir import Formula, Mission, Without
from missionc.ir.kernel.nodes import Kernel, Node
from missionc.ir.language.walk_formulas import goals, operands
from missionc.output.report.pack import COARSE, PER_METRE, pack, rounded
from missionc.verification.monitoring.verdict_table import Blame, Row, table
from missionc.verification.monitoring.witness import Witness, Witnesses

Places: TypeAlias = Callable[[Span], list[int] | None]

ABSENT, HELPS, HARMS, NEITHER, OPEN = range(5)
"""Effects of a value on the goal that it is asked for."""

MOST_FINE = 40_000
"""Values of a formula that are kept to a millimetre; of more, to a centimetre."""

MOST_LANES = 240
"""Sub-formulas that are shared are shown wherever they are used; what comes after so many is left out."""


@dataclass(frozen=True, slots=True)
class _Lane:
    """A formula where a goal shows it: how deep below it, and how it counts for it, as ``Blame.sign`` says."""

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
    """The values, once for each formula; and the lanes in the order they are read, each with the number of its row."""
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
    """What each value does to the goal: ``ABSENT``, ``HELPS``, ``HARMS``, ``NEITHER``; ``OPEN`` while time can tell.

    Args:
        sign: how the formula counts: by its truth (1), by its falsity (-1), or by both or neither (0).
        failing: where it makes the goal false, (agents, steps + 1).

    Returns:
        As the row: (agents, steps + 1), or (1, steps + 1) where it is about the team.
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
    """The step at which a goal's verdict can no longer change, and the agents that it rests on there."""
    settled: Flags = np.equal(row.surely, row.possibly)[0] if row.unfolds else np.ones(1, dtype=np.bool_)
    step = int(np.argmax(settled)) if settled.any() else row.surely.shape[1] - 1
    holds = bool(row.surely[0, step])
    lit = None if seen is None else (seen.holds if holds else seen.fails)[:, step]
    return {"step": step, "holds": holds, "by": [] if lit is None else np.flatnonzero(lit).tolist()}


def _tree(mission: Mission, kernel: Kernel, blame: Blame) -> list[_Lane]:
    """Each goal's formulas in the order they are read; before one of several cases stands who is lost in it."""
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
    """For each operand, whom it is without."""
    if not isinstance(formula, Without):
        return [""] * len(operands(formula))
    return [f"without {', '.join(mission.agents[agent].name for agent in lost)}: " for lost in formula.lost]


def _row(row: Row, seen: Witness | None) -> dict[str, Any]:
    """``team``: one line of values for all agents. ``verdict``: least and most over time, of one verdict at step 0."""
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

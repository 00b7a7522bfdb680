"""Conditions of spatial operators: on the agent that one is asked of, and on the agents there are."""

from __future__ import annotations

from collections.abc import Iterator

from missionc.ir import Apply, Formula, Length
from missionc.syntax.ast import Metric


def length_of(formula: Apply) -> Length:
    assert isinstance(formula.bounds, Length)
    return formula.bounds


def ends_at_once(formula: Apply) -> bool:
    """Whether the agent itself may be the end of the route: no hops at all are within the bounds."""
    return length_of(formula).low <= 0


def fewest_agents(formula: Apply) -> int:
    """How many agents the shortest route within the bounds has on it, at least."""
    length = length_of(formula)
    return int(length.low) + 1 if length.metric is Metric.HOPS else (1 if length.low <= 0 else 2)


def needed_here(formula: Apply, positive: bool) -> Iterator[tuple[Formula, bool]]:
    """What must be true of the agent itself where the formula is true (``positive``), or false."""
    at_once = ends_at_once(formula)
    match formula.operator.name, positive:
        case (("escape" | "surround"), True):
            yield formula.operands[0], True
        case "reach", True if not at_once:
            yield formula.operands[0], True
        case "everywhere", True if at_once:
            yield formula.operands[0], True
        case (("somewhere" | "escape"), False) if at_once:
            yield formula.operands[0], False
        case "reach", False if at_once:
            yield formula.operands[1], False
        case _:
            return


def needed_somewhere(formula: Apply) -> Iterator[Formula]:
    """What must be true of some agent where the formula is true."""
    match formula.operator.name:
        case "reach":
            yield formula.operands[1]
        case "somewhere" | "escape":
            yield formula.operands[0]
        case _:
            return

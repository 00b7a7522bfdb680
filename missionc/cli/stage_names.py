"""Names of the stages that ``--emit`` prints."""

from __future__ import annotations

from collections.abc import Iterable

BEFORE_PLANNING = ("ast", "ir", "kernel", "cost-graph", "horizons", "backend", "strategy", "settings", "roadmap")
BY_A_BACKEND = ("smt2", "dimacs")
ALL = (*BEFORE_PLANNING, *BY_A_BACKEND, "plan")


def in_order(names: Iterable[str]) -> tuple[str, ...]:
    """Names of stages without duplicates, in the order of the pipeline."""
    stages = set(names)
    return tuple(stage for stage in ALL if stage in stages)

"""The stages that ``--emit`` prints, by name."""

from __future__ import annotations

from collections.abc import Iterable

BEFORE_PLANNING = ("ast", "ir", "kernel", "cost-graph", "horizons", "backend", "strategy", "settings", "roadmap")
BY_A_BACKEND = ("smt2", "dimacs")
ALL = (*BEFORE_PLANNING, *BY_A_BACKEND, "plan")


def in_order(names: Iterable[str]) -> tuple[str, ...]:
    """The stages of these names, each once, in the order of the pipeline."""
    stages = set(names)
    return tuple(stage for stage in ALL if stage in stages)

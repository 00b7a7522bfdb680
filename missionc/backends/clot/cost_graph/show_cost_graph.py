"""Printer of the cost graph and of the cost weights for ``--emit cost-graph``."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING

from missionc.backends.clot.cost_weights import AIMS, TIDY
from missionc.backends.clot.settings import ClotSettings, clot_settings
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from missionc.ir.kernel.show import show

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


def show_cost_graph(graph: Kernel, mission: Mission) -> str:
    """Text of the cost graph: every formula once, then the goals, and the cost weights."""
    return show(graph, mission) + show_weights(clot_settings(mission))


def show_weights(settings: ClotSettings) -> str:
    """Text of the cost weights, one per line with its unit and purpose."""
    shown: list[tuple[str, DataclassInstance]] = [
        (each.title, each) for each in (settings.weights, settings.spare, settings.probe)
    ]
    shown += [
        (f"minimize {goal.value}{', then' if number else ''}", aim)
        for goal, aims in AIMS.items()
        for number, aim in enumerate(aims)
    ]
    return "".join(_shown(title, figures) for title, figures in [*shown, ("minimize nothing", TIDY)])


def _shown(title: str, figures: DataclassInstance) -> str:
    return "".join(
        f"{title}: {each.name} = {getattr(figures, each.name):g}, {each.metadata['says']}\n" for each in fields(figures)
    )

"""Printer of the cost graph and of the weights, as ``--emit cost-graph`` shows them."""

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
    """Every formula once, then what is wanted of them, and what shortfalls weigh."""
    return show(graph, mission) + show_weights(clot_settings(mission))


def show_weights(settings: ClotSettings) -> str:
    """Every figure, with its unit and what it is for, one a line."""
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
    lines = []
    for each in fields(figures):
        amount = f"{getattr(figures, each.name):g} {each.metadata['unit']}".rstrip()
        lines.append(f"{title}: {each.name} = {amount} {each.metadata['says']}\n")
    return "".join(lines)

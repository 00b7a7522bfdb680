"""Printer of a vehicle's figures, each with its SI unit."""

from __future__ import annotations

import math
from collections.abc import Iterator

from missionc import ir
from missionc.resolve.resolve_quantities import SI
from missionc.resolve.show_ir_formula import number


def show_vehicle(vehicle: ir.Vehicle) -> str:
    """On one line, as a mission writes it; what limits nothing is left out."""
    return "  ".join([vehicle.name, *(f"{name} {text}" for name, text in figures_of(vehicle) if text)])


def figures_of(vehicle: ir.Vehicle) -> Iterator[tuple[str, str]]:
    """Each figure's name and how it is written after it; empty where it limits nothing."""
    for name, figure in ir.FIGURES.items():
        value, unit = getattr(vehicle, name), SI[figure.dimension]
        match value:
            case ir.Band(low, high):
                yield name, "" if math.isinf(high) else f"{number(low)}..{number(high)}{unit}"
            case _:
                sign = f"{figure.relation} " if figure.relation else ""
                yield name, "" if value in (0, math.inf) else f"{sign}{number(value)}{unit}"


def show_yaw(yaw: ir.Yaw) -> str:
    """Empty where the nose points along the x axis throughout, as it does unless a team says otherwise."""
    match yaw:
        case ir.AlongPath():
            return "along path"
        case ir.Fixed(angle):
            return "" if angle == 0 else f"{number(angle)} rad"

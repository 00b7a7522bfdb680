"""Printer of pads, in SI units."""

from __future__ import annotations

import math

from missionc import ir
from missionc.resolve.resolve_quantities import SI
from missionc.resolve.show_ir_formula import number, vector


def show_pad(pad: ir.Pad) -> str:
    """On one line: where it is, and what else the mission says of it."""
    where = "below its start" if pad.point is None else f"at {vector(pad.point)}"
    said = []
    for name, figure in ir.PAD_FIGURES.items():
        value = getattr(pad, name)
        if value is not None and not math.isinf(value):
            said.append(f"{name} {figure.relation} {number(value)}{SI[figure.dimension]}".replace("  ", " "))
    return "  ".join([where, *said])

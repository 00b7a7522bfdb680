"""The order of definitions: each comes after those it rests on; cycles are reported.

says MC107
"""

from __future__ import annotations

from collections.abc import Mapping

from missionc.diagnostics import code
from missionc.diagnostics.model import Label
from missionc.resolve.context import Context
from missionc.resolve.topological_order import in_order
from missionc.syntax.references import mentions


def ordered(context: Context, bodies: Mapping[str, object]) -> list[str]:
    """The names, each after those its body refers to; the ones on a cycle are reported and left out."""
    rests_on = {name: mentions(body).names for name, body in bodies.items()}
    order, cycles = in_order(rests_on)
    for cycle in cycles:
        _defined_by_itself(context, cycle)
    on_cycles = {name for cycle in cycles for name in cycle}
    return [name for name in order if name not in on_cycles]


def _defined_by_itself(context: Context, cycle: tuple[str, ...]) -> None:
    """One finding for a chain of names that ends where it starts."""
    spans = [context.names.declared[name].span for name in cycle]
    message, labels = f"`{cycle[0]}` is defined by itself", tuple[Label, ...]()
    if len(cycle) > 1:
        message = f"{len(cycle)} names are defined by one another: {_chain(cycle)}"
        labels = tuple(Label(span, "and by this") for span in spans[1:4])
    context.report(
        code.DEFINED_BY_ITSELF, message, spans[0], labels=labels, help="define one of them without the others"
    )


def _chain(cycle: tuple[str, ...], most: int = 6) -> str:
    names = [f"`{name}`" for name in cycle[:most]]
    if len(cycle) > most:
        names.append("…")
    return " → ".join([*names, f"`{cycle[0]}`"])

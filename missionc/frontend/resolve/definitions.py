"""Order of the definitions in a mission: topological order, cycles, and unused names.

    says MC103 MC107

Each definition comes after those that it depends on. A name that nothing refers to is unused. Teams, agents and
obstacles have an effect without a reference, and a map file may contain more than a mission needs. Every graph of
beacons uses a beacon, and every route without ``on`` uses the only graph.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping

from missionc.base.diagnostics import code
from missionc.base.diagnostics.model import Diagnostic, Label
from missionc.frontend.resolve.context import Context, Kind, Named, Names
from missionc.frontend.resolve.delete_declaration import deleted
from missionc.frontend.syntax import ast
from missionc.frontend.syntax.references import mentions


def in_order(rests_on: Mapping[str, Iterable[str]]) -> tuple[list[str], list[tuple[str, ...]]]:
    """Topological order of the names, and the cycles among them.

    A cycle is a chain of names in which each depends on the next and the last on the first. Its names are in the order
    too, so their users meet a definition that is not resolved yet. Names that are not keys are ignored. The function is
    iterative, because a chain of definitions may be longer than Python's stack.

    Args:
        rests_on: names that each name depends on.
    """
    order: list[str] = []
    cycles: list[tuple[str, ...]] = []
    done: set[str] = set()
    for root in rests_on:
        if root in done:
            continue
        chain = [root]
        place = {root: 0}
        pending = [iter(tuple(rests_on[root]))]
        while chain:
            following = next(pending[-1], "")
            if not following:
                name = chain.pop()
                pending.pop()
                del place[name]
                done.add(name)
                order.append(name)
            elif following in place:
                cycles.append(tuple(chain[place[following] :]))
            elif following in rests_on and following not in done:
                place[following] = len(chain)
                chain.append(following)
                pending.append(iter(tuple(rests_on[following])))
    return order, cycles


ACT_BY_BEING_THERE = (Kind.TEAM, Kind.AGENT, Kind.OBSTACLE)


def unused(names: Names, program: ast.Program) -> list[Diagnostic]:
    """A warning for each unused name, except names suggested for unknown ones; a family is one name."""
    used = set(names.suggested)
    kinds_used: set[Kind] = set()
    for declaration in program.declarations:
        mentioned = mentions(declaration)
        used.update(mentioned.names)
        kinds_used.update([Kind.BEACON] * mentioned.every_beacon + [Kind.GRAPH] * mentioned.only_graph)
    read = {each.span for each in program.declarations if isinstance(each, ast.FromFile)}
    times = Counter(each.name.text for each in program.declarations if isinstance(each, Named))
    return [
        _nothing_uses(name, declared.kind, declared.declaration, once=times[name] == 1)
        for name, declared in names.declared.items()
        if name not in used and declared.kind not in kinds_used and declared.kind not in ACT_BY_BEING_THERE
        if declared.declaration.span not in read
    ]


def _nothing_uses(text: str, kind: Kind, declaration: Named, *, once: bool) -> Diagnostic:
    return Diagnostic(
        code.UNUSED_NAME,
        f"`{text}` is never used",
        Label(declaration.name.span, kind.value),
        help="delete the declaration",
        fix=deleted(declaration.span) if once else None,
    )


def ordered(context: Context, bodies: Mapping[str, object]) -> list[str]:
    """Names in topological order of the references in their bodies; names on a cycle are reported and omitted."""
    rests_on = {name: mentions(body).names for name, body in bodies.items()}
    order, cycles = in_order(rests_on)
    for cycle in cycles:
        _defined_by_itself(context, cycle)
    on_cycles = {name for cycle in cycles for name in cycle}
    return [name for name in order if name not in on_cycles]


def _defined_by_itself(context: Context, cycle: tuple[str, ...]) -> None:
    """Report a cycle of definitions with one finding."""
    spans = [context.names.declared[name].span for name in cycle]
    message, labels = f"`{cycle[0]}` is defined by itself", tuple[Label, ...]()
    if len(cycle) > 1:
        message = f"{len(cycle)} names are defined in a cycle: {_chain(cycle)}"
        labels = tuple(Label(span, "part of the cycle") for span in spans[1:4])
    context.report(
        code.DEFINED_BY_ITSELF, message, spans[0], labels=labels, help="define one of these names without the others"
    )


def _chain(cycle: tuple[str, ...], most: int = 6) -> str:
    names = [f"`{name}`" for name in cycle[:most]]
    if len(cycle) > most:
        names.append("…")
    return " → ".join([*names, f"`{cycle[0]}`"])

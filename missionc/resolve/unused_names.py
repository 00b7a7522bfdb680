"""Unused declarations: names that nothing refers to.

A team, an agent or an obstacle acts by being there, and a file of places may
have more than one mission needs. A beacon is used by every graph of beacons,
and the only graph by every route that leaves ``on`` out.

    says MC103
"""

from __future__ import annotations

from collections import Counter

from missionc.diagnostics import code
from missionc.diagnostics.model import Diagnostic, Label
from missionc.resolve.delete_declaration import deleted
from missionc.resolve.names import Kind, Named, Names
from missionc.syntax import ast
from missionc.syntax.references import mentions

ACT_BY_BEING_THERE = (Kind.TEAM, Kind.AGENT, Kind.OBSTACLE)


def unused(names: Names, program: ast.Program) -> list[Diagnostic]:
    """A warning for each; none for what was suggested in place of an unknown name. A family is one name."""
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
        f"nothing uses `{text}`",
        Label(declaration.name.span, kind.value),
        help="use it or leave it out",
        fix=deleted(declaration.span) if once else None,
    )

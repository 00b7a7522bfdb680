"""The context of resolution: names, what has been made of them so far, and findings.

A thing that cannot be made is reported once and a stand-in takes its place, so
that the rest is still looked at: NaN for a number (every comparison with it is
false, so nothing is said of it twice), a shape of NaN, a set without agents, a
formula that is simply true. A mission with errors is never handed on, so no
stand-in ever leaves ``resolve``.
"""

from __future__ import annotations

import math
from dataclasses import field
from typing import TypeVar

from missionc import ir
from missionc.base.late_dataclass import dataclass
from missionc.base.limits import Limits
from missionc.base.source import Span
from missionc.diagnostics.code import Code
from missionc.diagnostics.model import Diagnostic, Fix, Label
from missionc.resolve.amounts import Amount
from missionc.resolve.names import Declared, Kind, Names, Unresolved
from missionc.resolve.typed import Typed
from missionc.syntax import ast

D = TypeVar("D")

REPORTED = math.nan
"""The number in place of one that has been reported."""


@dataclass(slots=True)
class Context:
    """``dimension`` is 0 and ``step`` NaN while the world and the time are not known.

    ``members`` and ``edges`` count what groups, ranges and formations have been
    spelt out to so far, over the whole mission.
    """

    names: Names
    limits: Limits
    findings: list[Diagnostic]
    step: float = REPORTED
    steps: int = 0
    dimension: int = 0
    low: ir.Vector = ()
    high: ir.Vector = ()
    params: dict[str, Amount] = field(default_factory=dict)
    regions: dict[str, ir.Region] = field(default_factory=dict)
    obstacles: dict[str, ir.Obstacle] = field(default_factory=dict)
    beacons: dict[str, ir.Beacon] = field(default_factory=dict)
    agents: list[ir.Agent] = field(default_factory=list)
    sizes: dict[str, float] = field(default_factory=dict)
    sets: dict[str, ir.AgentSet] = field(default_factory=dict)
    graphs: dict[str, ir.Graph] = field(default_factory=dict)
    formations: dict[str, ir.Formation] = field(default_factory=dict)
    resources: dict[str, ir.Resource] = field(default_factory=dict)
    flags: dict[str, ir.Flag] = field(default_factory=dict)
    lets: dict[str, Typed] = field(default_factory=dict)
    everyone: tuple[int, ...] = ()
    vehicle: ir.Vehicle = ir.PLAIN
    """The vehicle of teams that name none."""
    files: list[ir.PlacesFile] = field(default_factory=list)
    members: int = 0
    edges: int = 0

    def report(
        self,
        code: Code,
        message: str,
        span: Span,
        *,
        beside: str = "",
        labels: tuple[Label, ...] = (),
        notes: tuple[str, ...] = (),
        help: str = "",
        fix: Fix | None = None,
    ) -> None:
        """Add a finding; ``beside`` is said at the primary place."""
        self.findings.append(Diagnostic(code, message, Label(span, beside), labels, notes, help, fix))

    def find(self, name: ast.Name, *kinds: Kind, needed: str = "") -> Declared | Unresolved:
        """The declaration of a name of one of these kinds, or UNRESOLVED once it is reported."""
        return self.names.find(name, kinds, needed or kinds[0].value, self.findings)

    def declared(self, kind: type[D]) -> list[D]:
        """The declarations of this kind, in order; of two with one name, the first."""
        return [entry.declaration for entry in self.names.declared.values() if isinstance(entry.declaration, kind)]

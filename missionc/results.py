"""What the pipeline gives back: values with names, no failure among them is a bare None.

``Checked`` comes of ``check``, ``Compiled`` of ``compile``, ``Monitored`` of ``monitor``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeAlias

from missionc import ir
from missionc.backends.api import Impossible, NotFound, Report
from missionc.diagnostics.model import Diagnostic, has_errors
from missionc.kernel.nodes import Kernel
from missionc.passes.choose_backend import Choice
from missionc.source import Source
from missionc.syntax import ast
from missionc.units import Seconds

if TYPE_CHECKING:
    from missionc.plan import Judgement, Plan
    from missionc.verify import Certificate
    from missionc.verify.certificate import Between


@dataclass(frozen=True, slots=True, eq=False)
class Checked:
    """What the front end made of a mission: every finding, and each tree it came to.

    ``findings`` are in file order. The trees are None from the first stage with
    errors on; where ``ok``, all are there.
    """

    file: str
    findings: tuple[Diagnostic, ...]
    sources: tuple[Source, ...] = ()
    overrides: Mapping[str, str] = field(default_factory=dict)
    program: ast.Program | None = None
    mission: ir.Mission | None = None
    choice: Choice | None = None
    kernel: Kernel | None = None
    seconds: tuple[tuple[str, Seconds], ...] = ()

    @property
    def ok(self) -> bool:
        """Whether there is no error; warnings may be."""
        return not has_errors(list(self.findings))


@dataclass(frozen=True, slots=True)
class Refused:
    """The mission, or what it needs of the installation, has errors: they are among the findings."""


@dataclass(frozen=True, slots=True, eq=False)
class Verified:
    """A plan that passed every check of the certificate."""

    plan: Plan
    certificate: Certificate
    report: Report
    files: tuple[tuple[str, bytes], ...]
    """What belongs into the output folder: relative path and content."""


@dataclass(frozen=True, slots=True, eq=False)
class Unverified:
    """A plan that failed a check of the certificate: a defect of the compiler, never given out as a plan."""

    certificate: Certificate
    report: Report


CompileOutcome: TypeAlias = Refused | Verified | Unverified | Impossible | NotFound


@dataclass(frozen=True, slots=True, eq=False)
class Compiled:
    """How far a mission came. ``findings`` are those of ``checked``, and what planning adds."""

    checked: Checked
    outcome: CompileOutcome
    findings: tuple[Diagnostic, ...]
    seconds: tuple[tuple[str, Seconds], ...]


@dataclass(frozen=True, slots=True, eq=False)
class Monitored:
    """How a trace does. Where there are errors among the findings, nothing was judged.

    ``between`` is what becomes of the satisfied requirements between the steps, where that was asked.
    """

    checked: Checked
    requirements: tuple[Judgement, ...]
    preferences: tuple[Judgement, ...]
    findings: tuple[Diagnostic, ...]
    between: tuple[Between, ...] = ()

    @property
    def ok(self) -> bool:
        """Whether mission and trace could be read, and fit each other."""
        return not has_errors(list(self.findings))

    @property
    def satisfied(self) -> bool:
        """Whether every requirement holds; between the steps too, where that was asked."""
        return (
            self.ok and all(each.satisfied for each in self.requirements) and all(each.holds for each in self.between)
        )

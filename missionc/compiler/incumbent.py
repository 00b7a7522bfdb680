"""Incumbent: best verified plan of a compilation so far, which no later failure can lose.

in   plans that a search continues to improve, and a certifying function
out  Compiled with a verified plan, once there is one
says MC613

A search that improves a plan for longer than ``PATIENCE`` is interrupted occasionally to certify its plan. The result
of a search that ends by itself does not depend on this. A plan returned before the end of an improvement has
``cut_short`` in its report and its manifest.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace

from missionc.backends.api import CutShort, NotFound, Planned, Reason
from missionc.base.diagnostics.defect import improvement_failed
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.signals import defer_stop, reraise_stop
from missionc.base.units import Seconds
from missionc.compiler.results import Compiled, Unverified, Verified
from missionc.output.folder.file_names import MANIFEST

PATIENCE = Seconds(1.0)
"""Duration of an improvement, seconds, after which its plan is certified."""

INTERVAL = 10.0
"""Time until the next certification, as a multiple of the last certification's duration."""

CUT_SHORT = {Reason.TIME: CutShort.TIME, Reason.MEMORY: CutShort.MEMORY}
"""Reason why an improvement was cut short, by the reason why the search ended."""

RESERVE = 1.5
"""Time reserved for one certification, as a multiple of the last one's duration."""


def discard(compiled: Compiled) -> None:
    """Ignore a verified plan that the compilation's result will replace."""


@dataclass(slots=True, eq=False)
class Incumbent:
    """Latest plan of a search, and latest verified plan.

    Args:
        certify: verifies a plan and creates its files.
        secure: receives each verified plan as soon as it exists, for instance to write it.
    """

    certify: Callable[[Planned], Compiled]
    secure: Callable[[Compiled], object] = discard
    latest: Planned | None = None
    best: Compiled | None = None
    findings: list[Diagnostic] = field(default_factory=list)
    """Findings on defects that ended an improvement."""
    seconds: float = 0.0
    """Duration of the last certification; 0 before the first."""
    _next: float = 0.0
    _certified: Planned | None = None

    def found(self, planned: Planned) -> None:
        """Record a plan that the search continues to improve."""
        if self.latest is None:
            self._next = time.monotonic() + PATIENCE
        self.latest = planned
        self.look()

    def look(self) -> None:
        """Certify the latest plan if the search has run long enough since the last certification."""
        if self.latest is None or self.latest is self._certified or time.monotonic() < self._next:
            return
        self._certified = self.latest
        self.keep(self.timed(self.latest, self.certify), final=False)
        self._next = time.monotonic() + max(PATIENCE, INTERVAL * self.seconds)

    def timed(self, planned: Planned, certify: Callable[[Planned], Compiled]) -> Compiled:
        """Compilation that ``certify`` returns for a plan; its duration is recorded."""
        began = time.monotonic()
        compiled = certify(planned)
        self.seconds = time.monotonic() - began
        return compiled

    def keep(self, compiled: Compiled, *, final: bool) -> Compiled:
        """The compilation if its plan is verified; else the previous verified plan, if any.

        Args:
            final: True if no improvement follows.
        """
        if isinstance(compiled.outcome, Verified):
            defer_stop()
            self.best = compiled
            if not final:
                self.secure(cut_short(compiled, CutShort.UNFINISHED))
            return compiled
        if self.best is None:
            return compiled
        match compiled.outcome:
            case NotFound(reason=reason):
                return cut_short(self.best, CUT_SHORT.get(reason, CutShort.UNFINISHED))
            case Unverified():
                note = "a later plan failed verification; this is a bug, please report it"
                return noted(cut_short(self.best, CutShort.DEFECT), note)
            case _:
                return noted(cut_short(self.best, CutShort.UNFINISHED), "a later plan exceeds vehicle limits")

    def reserve(self, otherwise: Seconds) -> Seconds:
        """Seconds to reserve for a certification: measured if there was one before, ``otherwise`` if not."""
        return Seconds(RESERVE * self.seconds) if self.seconds else otherwise

    def failed(self, step: str, error: Exception) -> None:
        """Record that the improvement ``step`` ended with an error."""
        reraise_stop()
        self.findings.append(improvement_failed(step, error))


def improved(step: str, before: Compiled | None, work: Callable[[], Compiled]) -> Compiled:
    """Compilation after an improvement; after a failure the previous verified plan, with a warning.

    Args:
        step: the improvement, as the subject of a sentence.
        before: compilation so far; without a verified plan in it, a failure is raised.
    """
    if before is None or not isinstance(before.outcome, Verified):
        return work()
    try:
        return work()
    except Exception as error:
        reraise_stop()
        findings = (*before.findings, improvement_failed(step, error))
        return replace(cut_short(before, CutShort.DEFECT), findings=findings)


def cut_short(compiled: Compiled, why: CutShort) -> Compiled:
    """The compilation with its report and manifest stating that the search was cut short."""
    from missionc.output.folder.manifest import relisted  # has the versions of packages; only for plans

    assert isinstance(compiled.outcome, Verified)
    files, report = dict(compiled.outcome.files), compiled.outcome.report
    files[MANIFEST] = relisted({**json.loads(files[MANIFEST]), "cut_short": why.value}, {})
    report = replace(report, cut_short=why)
    return replace(compiled, outcome=replace(compiled.outcome, files=files, report=report))


def noted(compiled: Compiled, note: str) -> Compiled:
    """The compilation with one more note on its verified plan."""
    assert isinstance(compiled.outcome, Verified)
    return replace(compiled, outcome=replace(compiled.outcome, report=compiled.outcome.report.noting(note)))

"""Backends of extensions as the compiler runs them: errors are attributed to the extension, and outcomes are
checked."""

from __future__ import annotations

from dataclasses import replace

from missionc.backends import api
from missionc.backends.options import Options
from missionc.base.extensions import Kind, guard, rejected
from missionc.base.trace import Trace
from missionc.base.units import Seconds
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel


class ForeignBackend:
    """Backend of an extension. Its plans are verified like any other, and its other claims are ignored."""

    refutes = False

    def __init__(self, extension: api.BackendExtension) -> None:
        self.extension, self.name = extension, extension.name

    def missing(self, options: Options) -> None:
        return None

    def turns(self, mission: Mission, kernel: Kernel, options: Options, budget: api.Budget) -> api.Turns:
        yield 0.0
        return self.plan(mission, kernel, options, budget)

    def plan(self, mission: Mission, kernel: Kernel, options: Options, budget: api.Budget) -> api.Outcome:
        """Checked outcome of the extension's search; a claim that no plan exists becomes *undecided*.

        Raises:
            ExtensionError: the search failed, or returned a value that is no outcome of this mission.
        """

        def found(planned: api.Planned) -> object:
            checked = self._checked(planned, mission)
            return budget.on_incumbent(checked) if isinstance(checked, api.Planned) else None

        with guard(Kind.BACKEND, self.name):
            outcome = self.extension.plan(mission, kernel, options, replace(budget, on_incumbent=found))
            return self._checked(outcome, mission)

    def _checked(self, outcome: api.Outcome, mission: Mission) -> api.Outcome:
        if wrong := _fault(outcome, mission):
            raise rejected(Kind.BACKEND, self.name, wrong)
        report = _plain(outcome.report)
        if not isinstance(outcome, api.Impossible):
            return replace(outcome, report=report)
        names = "".join(f" with `{name}`" for name in outcome.conflict)
        claim = f"the backend `{self.name}` reports that no plan exists{names}; not verified"
        return api.NotFound(api.Reason.SOLVER, f"{claim}: {outcome.statement}" if outcome.statement else claim, report)


def _plain(report: api.Report) -> api.Report:
    """Report reduced to the entries that the compiler uses, converted to plain types."""
    return api.Report(
        tuple((str(name), Seconds(seconds)) for name, seconds in report.seconds),
        tuple((str(name), int(size)) for name, size in report.sizes),
        tuple((str(name), str(text)) for name, text in report.texts),
        notes=tuple(map(str, report.notes)),
        cut_short=report.cut_short if isinstance(report.cut_short, api.CutShort) else None,
    )


def _fault(outcome: object, mission: Mission) -> str:
    """Reason why a value is no outcome of the mission, as the predicate of a sentence; empty if it is an outcome."""
    if not isinstance(outcome, api.Planned | api.Impossible | api.NotFound):
        return "returned neither `Planned`, `Impossible` nor `NotFound`"
    if not isinstance(outcome.report, api.Report):
        return "returned an outcome without a `Report`"
    if isinstance(outcome, api.Planned):
        return _fault_of_trace(outcome.trace, mission)
    if not isinstance(outcome.statement, str):
        return "returned a `statement` that is no text"
    if isinstance(outcome, api.Impossible):
        unknown = set(outcome.conflict) - {each.name for each in mission.requirements}
        return (
            f"returned an `Impossible` of `{min(unknown)}`, which is no requirement of the mission" if unknown else ""
        )
    if isinstance(outcome.reason, api.Reason) and (outcome.best is None or isinstance(outcome.best, api.Attempt)):
        return ""
    return f"returned a `NotFound` whose first value is no `Reason`: `{outcome.reason!r:.40}`"


def _fault_of_trace(trace: object, mission: Mission) -> str:
    if not isinstance(trace, Trace):
        return "returned a `Planned` without a `Trace`"
    states = (len(mission.agents), mission.steps + 1)
    vectors = (*states, mission.dimension)
    for name, shape in (("position", vectors), ("velocity", vectors), ("heading", states)):
        array = getattr(trace, name)
        if getattr(getattr(array, "dtype", None), "kind", "") != "f":
            return f"returned a `Trace` whose `{name}` is no array of floats"
        if array.shape != shape:
            return f"returned a `{name}` of the shape {array.shape}; this mission needs {shape}"
    return ""

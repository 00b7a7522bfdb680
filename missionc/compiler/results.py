"""Results of the pipeline as values; no failure is a bare None.

``compile`` returns ``Compiled``, ``monitor`` returns ``Monitored``, and ``check`` returns ``Checked``, which is in
``checked``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, replace
from enum import Enum
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar, assert_never

from missionc.backends.api import Attempt, Impossible, NotFound, Report, Scope
from missionc.base.constraint import Constraint, NotJudged, all_satisfied, constraint_lines
from missionc.base.diagnostics.model import Diagnostic, has_errors
from missionc.base.diagnostics.render import counts
from missionc.base.late_dataclass import Record
from missionc.base.notebook import framed, printed, shown
from missionc.base.source import Source
from missionc.base.trace import judgement_lines
from missionc.base.units import Seconds
from missionc.compiler.front_end import Checked, below
from missionc.output.folder.file_names import REPORT

if TYPE_CHECKING:
    from missionc.base.trace import Array, Judgement, Plan, Trace
    from missionc.frontend.builder.origins import MissionLike
    from missionc.output.documents.alternatives_json import AlternativeRow
    from missionc.verification.certificate import Between, Certificate


class InvalidMission(Record):
    """Outcome of a mission with errors, or of one whose installation is incomplete; the errors are among the findings.

    ``plan`` is the verified but unflyable trace, if any.
    """

    plan: Trace | None = field(default=None, compare=False, repr=False)


class Verified(Record, eq=False):
    """Outcome with a plan that passed every check of the certificate."""

    plan: Plan
    certificate: Certificate
    report: Report
    files: Mapping[str, bytes]
    """Contents of the output folder by relative path."""

    def __str__(self) -> str:
        return str(self.plan)

    _repr_pretty_ = printed

    def _repr_html_(self) -> str:
        return framed(self.page, str(self))

    @property
    def page(self) -> str:
        """The report as an HTML page."""
        return self.files[REPORT].decode("utf-8")


class Alternative(Record, eq=False):
    """One of several alternative plans, with its rank.

    Args:
        row: its rank, the folder of its files, its difference from the best plan, and its numbers.
    """

    row: AlternativeRow
    verified: Verified


class Unverified(Record, eq=False):
    """Outcome with a plan that failed a check of the certificate: a defect of the compiler.

    The plan is not returned.
    """

    certificate: Certificate
    report: Report


class Change(Record):
    """Lines of a mission's file, from ``line`` on, before and after a suggested change; without line ends.

    A value from the command line has no file, and line 0.
    """

    file: str
    line: int
    before: str
    after: str


class Relaxation(Record):
    """A suggested change with which the mission, compiled from its text, has a verified plan.

    ``smallest`` is True if the next smaller change of its kind is infeasible on the roadmap; otherwise less may
    suffice.
    """

    says: str
    changes: tuple[Change, ...]
    size: float
    """Size of the change relative to the changed value; infinite for a dropped requirement."""
    smallest: bool
    proven: str = ""
    """Largest smaller change of its kind that a cover proves insufficient; empty if none."""
    guards: bool = False
    """True if its plan violates a safety requirement of the original mission, or the separation of bodies.

    A safety requirement is permanent: it waits for no event.
    """


class Blame(Enum):
    """Cause of infeasibility, as far as solved variants of the mission show it."""

    REQUIREMENTS = "requirements"
    HORIZON = "horizon"
    ROADMAP = "roadmap"
    UNKNOWN = "unknown"


class Trial(Record):
    """Result of a variant of the mission, solved to find the cause; ``planned``, ``impossible`` or ``undecided``."""

    says: str
    outcome: str


class NearMiss(Record, eq=False):
    """Closest infeasible candidate: a trajectory that is nearly a plan.

    For an infeasible mission, it violates one requirement and satisfies everything else. If only no plan was found, it
    may be the best candidate of the search, which may violate more.
    """

    attempt: Attempt
    planned_for: str
    """Change of the mission with which the trajectory is a plan; empty for the best candidate of a search."""
    files: tuple[tuple[str, bytes], ...]
    """Files that show the candidate: relative path and content."""


class Explained(Record, eq=False):
    """Reasons why there is no plan, and suggested fixes; ``relaxations`` have the smallest change first."""

    blame: Blame
    """Cause of infeasibility; unknown if the mission is not proved infeasible."""
    trials: tuple[Trial, ...] = ()
    relaxations: tuple[Relaxation, ...] = ()
    near_miss: NearMiss | None = None
    cut_short: bool = False
    """True if the time limit was reached before all variants were tried."""


CompileOutcome: TypeAlias = InvalidMission | Verified | Unverified | Impossible | NotFound


class Compiled(Record, eq=False):
    """Result of a compilation: the outcome, and all findings of checking and planning."""

    checked: Checked
    outcome: CompileOutcome
    findings: tuple[Diagnostic, ...]
    seconds: tuple[tuple[str, Seconds], ...]
    explained: Explained | None = None
    """Explanation of an infeasible mission, or of a search without a plan, if requested."""
    listing: tuple[tuple[str, bytes], ...] = ()
    """Manifest of a folder without a plan, as path and content; empty without files."""
    alternatives: tuple[Alternative, ...] = ()
    """Alternative plans, the best of which is the outcome and comes first; empty for a single plan."""

    @property
    def files(self) -> Mapping[str, bytes]:
        """Files of the output folder by relative path: a plan, a proof or the closest candidate, and a manifest.

        A folder with a proof contains no closest candidate: ``verify`` checks every file, and could not check that one.
        """
        match self.outcome:
            case Verified(files=files):
                return files
            case Impossible(report=report) | NotFound(report=report):
                return dict((report.files or self.near_miss_files) + self.listing)
            case InvalidMission() | Unverified():
                return {}
            case _:
                assert_never(self.outcome)

    def write(self, folder: str | Path, *, force: bool = False) -> None:
        """Write the files of the compilation to a folder.

        Args:
            force: True to replace an existing folder, if this compiler wrote it.

        Raises:
            ValueError: there are no files, or the folder cannot be written; the message begins with the code.
        """
        from missionc.output.folder.write_folder import write_folder  # loaded only for writing

        if not self.files:
            raise ValueError(f"there is nothing to write: {self.checked.file} is {self.word or 'checked'}")
        wrong = write_folder(Path(folder), self.files, force)
        if wrong:
            raise ValueError(f"{wrong.code.name}: {wrong.message}")

    @property
    def plan(self) -> Plan:
        """The verified plan.

        Raises:
            ValueError: there is no plan; the message states the outcome.
        """
        if not isinstance(self.outcome, Verified):
            raise ValueError(f"{self.checked.file} has no plan: {self.word or 'checked'}")
        return self.outcome.plan

    @property
    def times(self) -> Array:
        """Times of the steps of the plan: (steps + 1,), seconds."""
        return self.plan.times

    @property
    def positions(self) -> Array:
        """Positions of the plan: (agents, steps + 1, dim), metres."""
        return self.plan.trace.position

    @property
    def velocities(self) -> Array:
        """Velocities of the plan: (agents, steps + 1, dim), m/s."""
        return self.plan.trace.velocity

    @property
    def robustness(self) -> dict[str, float]:
        """Robustness of the plan for each requirement, by name."""
        return self.plan.robustness

    def to_pandas(self) -> Any:
        """The plan as a ``pandas.DataFrame`` with ``agent``, ``t`` in seconds, positions in metres and velocities in
        m/s.

        Raises:
            ValueError: there is no plan.
            ModuleNotFoundError: pandas is not installed.
        """
        agents, steps, dim = self.positions.shape
        names = [agent.name for agent in self.checked.valid_mission.agents]
        states = {
            prefix + axis: values[:, :, place].ravel()
            for prefix, values in (("", self.positions), ("v", self.velocities))
            for place, axis in enumerate("xyz"[:dim])
        }
        agent = [name for name in names for _ in range(steps)]
        return import_module("pandas").DataFrame({"agent": agent, "t": [*self.times] * agents, **states})

    @property
    def near_miss_files(self) -> tuple[tuple[str, bytes], ...]:
        """Files of the closest infeasible candidate, even if not part of ``files``; empty if there is none."""
        missed = self.explained.near_miss if self.explained else None
        return missed.files if missed else ()

    @property
    def word(self) -> str | None:
        """Outcome in one word, as in documents; None for a valid mission without planning."""
        match self.outcome:
            case Verified():
                return "planned"
            case Impossible() if self.ruled_out:
                return "impossible"
            case Impossible() | NotFound():
                return "undecided"
            case Unverified():
                return "unverified"
            case InvalidMission():
                return "refused" if has_errors(list(self.findings)) else None
            case _:
                assert_never(self.outcome)

    @property
    def ruled_out(self) -> bool:
        """True for an infeasible mission: no motion is a plan, or none on the roadmap that it names.

        Roadmaps of sampled places, which the compiler chose, rule nothing out.
        """
        match self.outcome:
            case Impossible(scope=scope):
                return scope is Scope.MISSION or self.checked.valid_mission.solve.roadmap is not None
            case _:
                return False

    def __str__(self) -> str:
        match self.outcome:
            case Verified():
                return below(self.findings, str(self.outcome))
            case Impossible() | NotFound():
                changes = [f"  {each.says}" for each in self.explained.relaxations] if self.explained else []
                return below(
                    self.findings, *(["each of these changes makes the mission feasible"] if changes else []), *changes
                )
            case InvalidMission() | Unverified():
                return below(self.findings, f"{self.checked.file}: {counts(self.findings)}")
            case _:
                assert_never(self.outcome)

    _repr_pretty_ = printed

    def _repr_html_(self) -> str:
        """HTML of the report, or of the errors and the closest candidate, for notebooks."""
        if isinstance(self.outcome, Verified):
            return framed(self.outcome.page, str(self))
        missed = [content.decode("utf-8") for name, content in self.near_miss_files if name == "near_miss.html"]
        return shown(self) + "".join(framed(page, "closest infeasible candidate") for page in missed)


class Monitored(Record, eq=False):
    """Result of evaluating a mission on a trace; with errors among the findings, nothing was evaluated.

    ``between`` states for each satisfied requirement whether it holds between the steps, if requested. ``constraints``
    has the verdicts on implied constraints: separation, clearance, speed.
    """

    checked: Checked
    requirements: tuple[Judgement, ...]
    preferences: tuple[Judgement, ...]
    findings: tuple[Diagnostic, ...]
    between: tuple[Between, ...] = ()
    constraints: tuple[Constraint, ...] = ()
    not_judged: tuple[NotJudged, ...] = ()

    @property
    def ok(self) -> bool:
        """True if mission and trace are valid and fit each other; findings about planning are warnings."""
        return not has_errors(list(self.findings))

    @property
    def satisfied(self) -> bool | None:
        """True if every requirement and constraint is satisfied, if requested also between the steps.

        False if one is violated.

        None if nothing was evaluated, or if nothing is violated but something is undecided.
        """
        if not self.ok:
            return None
        kept = all_satisfied(self.constraints)
        violated = kept is False or any(each.fails for each in self.between)
        if violated or not all(each.satisfied for each in self.requirements):
            return False
        return True if kept and all(each.holds for each in self.between) else None

    @property
    def verdict(self) -> str:
        """Verdict as text: ``satisfied``, ``violated`` or ``not decided``."""
        return {True: "satisfied", False: "violated", None: "not decided"}[self.satisfied]

    def __str__(self) -> str:
        mission = self.checked.mission
        if not self.ok or mission is None:
            return below(self.findings, f"{self.checked.file}: {counts(self.findings)}")
        lines = judgement_lines(self.requirements, mission.step)
        lines += constraint_lines(self.constraints, self.not_judged)
        return below(self.findings, f"{mission.name}: {self.verdict}", *lines)

    _repr_pretty_ = printed
    _repr_html_ = shown


Result = TypeVar("Result", Compiled, Monitored)


def with_origins(result: Result, mission: MissionLike) -> Result:
    """The result with its findings located at the lines of Python that built the mission, if it was built in Python."""
    if isinstance(mission, str | Path | Source):
        return result
    from missionc.frontend.builder.origins import at_origins  # loaded only for missions built in Python

    checked = replace(result.checked, findings=at_origins(result.checked.findings, mission))
    return replace(result, checked=checked, findings=at_origins(result.findings, mission))

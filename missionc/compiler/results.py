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
from missionc.base.judgement import judgement_lines
from missionc.base.late_dataclass import Record
from missionc.base.notebook import framed, printed, shown
from missionc.base.source import Source
from missionc.base.units import Seconds
from missionc.compiler.front_end import Checked, below
from missionc.output.folder.file_names import REPORT

if TYPE_CHECKING:
    from missionc.base.judgement import Judgement
    from missionc.base.trace import Array, Plan, Trace
    from missionc.frontend.builder.origins import MissionLike
    from missionc.output.documents.alternatives_json import AlternativeRow
    from missionc.verification.certificate import Between, Certificate


class InvalidMission(Record):
    """The mission, or the installation that it needs, has errors: they are among the findings.

    ``plan`` is the verified but unflyable motion, if any.
    """

    plan: Trace | None = field(default=None, compare=False, repr=False)


class Verified(Record, eq=False):
    """A plan that passed every check of the certificate."""

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
        """The report."""
        return self.files[REPORT].decode("utf-8")


class Alternative(Record, eq=False):
    """One of several different plans, with its rank.

    Args:
        row: its rank, where its files are, what is different from the best one, and its figures.
    """

    row: AlternativeRow
    verified: Verified


class Unverified(Record, eq=False):
    """A plan that failed a check of the certificate: a defect of the compiler, never given out as a plan."""

    certificate: Certificate
    report: Report


class Change(Record):
    """Lines of a mission's file, from ``line`` on, as they are and as they would be; without line ends.

    A value given on the command line is in no file, and on line 0.
    """

    file: str
    line: int
    before: str
    after: str


class Relaxation(Record):
    """A change with which the mission, compiled from its text, has a verified plan.

    ``smallest``: the next smaller change of its kind was refused on the roadmap; if False, less may suffice.
    """

    says: str
    changes: tuple[Change, ...]
    size: float
    """Size of the change relative to the changed value; infinite for a dropped requirement."""
    smallest: bool
    proven: str = ""
    """Largest smaller change of its kind that a cover proves insufficient; empty if none."""
    guards: bool = False
    """True if its motion violates a safety requirement of the original mission: a permanent one, or the separation of
    bodies."""


class Blame(Enum):
    """Cause of infeasibility, as far as trials show."""

    REQUIREMENTS = "requirements"
    HORIZON = "horizon"
    ROADMAP = "roadmap"
    UNKNOWN = "unknown"


class Trial(Record):
    """A solved variant for finding the cause; ``outcome`` is ``planned``, ``impossible`` or ``undecided``."""

    says: str
    outcome: str


class NearMiss(Record, eq=False):
    """Closest infeasible candidate: a motion that is nearly a plan.

    For an infeasible mission, it violates one requirement and satisfies everything else. If only no plan was found, it
    may be the best candidate, which may violate more.
    """

    attempt: Attempt
    planned_for: str
    """Change of the mission with which the motion is a plan; empty for a best candidate."""
    files: tuple[tuple[str, bytes], ...]
    """Files that show it: relative path and content."""


class Explained(Record, eq=False):
    """Reasons for a missing plan, and suggested fixes. ``relaxations`` have the smallest change first."""

    blame: Blame
    """Cause; unknown if the mission is not proved infeasible."""
    trials: tuple[Trial, ...] = ()
    relaxations: tuple[Relaxation, ...] = ()
    near_miss: NearMiss | None = None
    cut_short: bool = False
    """True if time was up before all trials."""


CompileOutcome: TypeAlias = InvalidMission | Verified | Unverified | Impossible | NotFound


class Compiled(Record, eq=False):
    """Result of a compilation. ``findings`` are those of ``checked``, and those of planning."""

    checked: Checked
    outcome: CompileOutcome
    findings: tuple[Diagnostic, ...]
    seconds: tuple[tuple[str, Seconds], ...]
    explained: Explained | None = None
    """Explanation of an infeasible mission, or of one with a best candidate, if requested."""
    listing: tuple[tuple[str, bytes], ...] = ()
    """Manifest of the files without a plan; None without files."""
    alternatives: tuple[Alternative, ...] = ()
    """Requested plans, the best first, which is the outcome; empty for a single plan."""

    @property
    def files(self) -> Mapping[str, bytes]:
        """Files of the output folder by relative path: a plan, a proof or the closest candidate, and a manifest.

        A folder with a proof has no closest candidate: ``verify`` checks every file, and could not check that one.
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
        """Write the files as a folder.

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
            ValueError: there is no plan; the message has the outcome.
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
        """Robustness of each requirement of the plan."""
        return self.plan.robustness

    def to_pandas(self) -> Any:
        """The plan as a ``pandas.DataFrame``: ``agent``, ``t`` in seconds, positions in metres and velocities in m/s.

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
        """Files of the closest candidate, written or not; empty if there is none."""
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
        """Report, or the errors, with the closest candidate if any."""
        if isinstance(self.outcome, Verified):
            return framed(self.outcome.page, str(self))
        missed = [content.decode("utf-8") for name, content in self.near_miss_files if name == "near_miss.html"]
        return shown(self) + "".join(framed(page, "closest infeasible candidate") for page in missed)


class Monitored(Record, eq=False):
    """Judgement of a trace. With errors among the findings, nothing was judged.

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
        """Return whether every requirement and constraint is satisfied, if requested also between the steps.

        None if nothing was judged, or if nothing is violated but something is undecided.
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
        """Verdict: ``satisfied``, ``violated`` or ``not decided``."""
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
    """Result with findings at the lines of Python that built the mission, if any."""
    if isinstance(mission, str | Path | Source):
        return result
    from missionc.frontend.builder.origins import at_origins  # loaded only for missions built in Python

    checked = replace(result.checked, findings=at_origins(result.checked.findings, mission))
    return replace(result, checked=checked, findings=at_origins(result.findings, mission))

"""Front end: from text to findings, and the resolved mission with every intermediate tree.

    in   a mission's file, or its text
    out  Checked

It solves no mission and knows no backend.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import field, replace
from pathlib import Path
from typing import TYPE_CHECKING

from missionc import ir
from missionc.backends.choose_backend import Choice, choose_backend
from missionc.backends.setting import is_setting
from missionc.base.diagnostics.code import INCLUDE_NOT_ALLOWED
from missionc.base.diagnostics.model import Diagnostic, has_errors
from missionc.base.diagnostics.render import counts, render_text
from missionc.base.diagnostics.turns import once_for_all_turns
from missionc.base.late_dataclass import Record, dataclass
from missionc.base.limits import Limits
from missionc.base.notebook import printed, shown
from missionc.base.source import Source, Span
from missionc.base.units import Seconds
from missionc.frontend.checks.check_ends import check_ends
from missionc.frontend.checks.check_headings import check_headings
from missionc.frontend.checks.check_horizons import check_horizons
from missionc.frontend.checks.check_past import check_past
from missionc.frontend.checks.check_possible import check_possible
from missionc.frontend.checks.check_requirements import check_requirements
from missionc.frontend.checks.check_world import check_world
from missionc.frontend.checks.free_space import FreeSpace
from missionc.frontend.resolve.resolve_mission import resolve
from missionc.frontend.syntax import ast
from missionc.frontend.syntax.parse import parse
from missionc.frontend.syntax.read_file import Loader, loader, read_data, read_source
from missionc.frontend.syntax.tokens import MOST_FINDINGS
from missionc.ir import PLAIN, Mission
from missionc.ir.kernel.nodes import Kernel
from missionc.ir.lower.expand import expand
from missionc.ir.vehicle_profiles import profiles

if TYPE_CHECKING:
    from missionc.planning.progression.past_document import Past
    from missionc.planning.progression.stretches import Remaining


class Checked(Record, eq=False):
    """Result of checking a mission: every finding, and each intermediate tree.

    ``findings`` are in file order. The trees are None from the first stage with errors on; if ``ok``, all are present.
    """

    file: str
    findings: tuple[Diagnostic, ...]
    sources: tuple[Source, ...] = ()
    unread: tuple[str, ...] = ()
    """Included files that could not be read, by their names as sources."""
    overrides: Mapping[str, str] = field(default_factory=dict)
    vehicle: str = ""
    """Name of the vehicle profile for teams without a vehicle; empty for none."""
    stretch: float = 1.0
    """Factor by which the mission's duration is longer than written."""
    poses: Source | None = None
    """Source of the agents' measured poses, if given."""
    program: ast.Program | None = None
    mission: ir.Mission | None = None
    choice: Choice | None = None
    kernel: Kernel | None = None
    seconds: tuple[tuple[str, Seconds], ...] = ()
    past: Past | None = None
    """Past of a mission in flight; ``mission`` and ``kernel`` are then the remaining mission."""
    rest: Remaining | None = None
    """Remaining mission in flight, with the requirements that are already violated."""
    stops: tuple[tuple[str, str], ...] = ()
    """Text of each agent's polynomials until the remaining mission begins, by agent name."""

    @property
    def ok(self) -> bool:
        """True if no finding is an error; warnings are possible."""
        return not has_errors(list(self.findings))

    @property
    def valid_mission(self) -> ir.Mission:
        """The resolved mission; only available without errors."""
        assert self.mission is not None
        return self.mission

    @property
    def valid_kernel(self) -> Kernel:
        """The kernel of the mission; only available without errors."""
        assert self.kernel is not None
        return self.kernel

    def __str__(self) -> str:
        return below(self.findings, f"{self.file}: {counts(self.findings)}")

    _repr_pretty_ = printed
    _repr_html_ = shown


def below(findings: tuple[Diagnostic, ...], *lines: str) -> str:
    """Text of the findings with their source excerpts, followed by the given lines."""
    text = render_text(list(findings), False)
    return "\n".join(([text] if text else []) + list(lines))


ANY_BACKEND = "any"
"""Value of ``backend`` with which ``check`` does not test whether a backend supports the mission."""


def ignore(stage: str) -> None:
    """Do nothing; the default callback for stages."""


@dataclass(slots=True)
class Stopwatch:
    """Measured seconds of each stage, in order; ``before`` is called with each stage's name before the stage runs."""

    seconds: list[tuple[str, Seconds]] = field(default_factory=list)
    before: Callable[[str], None] = ignore

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        self.before(name)
        begin = time.perf_counter()
        try:
            yield
        finally:
            self.seconds.append((name, Seconds(time.perf_counter() - begin)))


def check(
    file: str | Path | Source,
    *,
    overrides: Mapping[str, str] | None = None,
    backend: str = "auto",
    limits: Limits | None = None,
    stretch: float = 1.0,
    vehicle: str = "",
    poses: Path | Source | None = None,
    before: Callable[[str], None] = ignore,
    load: Loader | None = None,
    begun: bool = False,
    judging: bool = False,
) -> Checked:
    """Check a mission without solving; return every finding and, if there are no errors, the resolved mission.

    Args:
        file: a path, or a text; includes are relative to its name.
        overrides: texts for parameters, and for settings of backends: ``{"T": "30 s", "smt.nodes": "400"}``.
        backend: ``auto``, or the backend to check against.
        limits: limits on the mission's sizes.
        stretch: factor of the mission's duration, in whole steps; its windows stay the same.
        vehicle: profile of teams without a vehicle; empty for none.
        poses: measured poses of the agents, a file or its text: they start on the floor there.
        before: called with the name of each stage before it runs; an exception from it ends the check.
        load: loader of included files; by default relative to the mission.
        begun: True for a mission in flight: its starts and its total time are not checked against the present world.
        judging: True for checking a flight without planning: findings about planning are warnings.

    Raises:
        ValueError: the profile is unknown.
    """
    if vehicle and vehicle not in profiles():
        raise ValueError(f"unknown vehicle `{vehicle}`")
    limits = limits or Limits()
    name = file.name if isinstance(file, Source) else str(file)
    source = file if isinstance(file, Source) else read_source(Path(file), name, limits)
    if isinstance(source, Diagnostic):
        return Checked(name, (source,))
    watch = Stopwatch(before=before)
    sources = [source]
    measured: list[Source] = []
    unread: list[str] = []
    find = load or loader(Path(name), name, limits)

    def load_and_keep(written: str, span: Span, /, *, data: bool = False) -> Source | Diagnostic:
        included = find(written, span, data=True) if data else find(written, span)
        if isinstance(included, Source):
            sources.append(included)
        elif included.code is not INCLUDE_NOT_ALLOWED:
            unread.append(str(Path(span.source.name).parent / written))
        return included

    def so_far(findings: list[Diagnostic]) -> Checked:
        if judging:
            findings = [replace(each, as_warning=each.code.about_planning) for each in findings]
        return Checked(
            name,
            no_more_than_are_read(in_file_order(once_for_all_turns(findings), sources)),
            tuple(sources),
            tuple(unread),
            dict(overrides or {}),
            vehicle,
            stretch,
            measured[0] if measured else None,
            seconds=tuple(watch.seconds),
        )

    with watch.stage("parse"):
        program, findings = parse(source, limits, load_and_keep)
    if program is None or has_errors(findings):
        return so_far(findings)
    with watch.stage("resolve"):
        flown = profiles()[vehicle] if vehicle else PLAIN
        settings = {name: text for name, text in (overrides or {}).items() if is_setting(name)}
        values = {name: text for name, text in (overrides or {}).items() if name not in settings}
        mission, more = resolve(program, values, limits, stretch, flown)
        if mission is not None and poses is not None and not has_errors(more):
            mission, wrong = _from(mission, poses, limits, measured)
            sources.extend(measured)
            more = [*more, *wrong]
    findings = [*findings, *more]
    if mission is None or has_errors(findings):
        return replace(so_far(findings), program=program)
    choice = None
    with watch.stage("expand"):
        kernel, more = expand(mission, limits)
        findings += more
    with watch.stage("check"):
        ground = None if mission.world.flat or begun else FreeSpace.of(mission)
        kernel_or_empty = kernel or Kernel((), ())
        findings += [*check_horizons(mission), *check_past(mission), *check_headings(mission)]
        findings += [] if begun else check_world(mission, kernel_or_empty, ground)
        if kernel is not None and not begun:
            findings += check_requirements(mission, kernel, ground)
            if ground is not None:
                findings += check_possible(mission, kernel, ground, findings)
        if backend != ANY_BACKEND:
            choice, more = choose_backend(mission, None if backend == "auto" else backend)
            findings += more
        if settings:
            from missionc.backends.settings import with_settings  # few missions set settings

            mission, more = with_settings(mission, settings, choice.engines if choice else None)
            findings += more
        if has_errors([each for each in findings if not (judging and each.code.about_planning)]):
            kernel = None
        elif kernel is not None and ground is not None and not has_errors(findings):
            findings += check_ends(mission, kernel, ground)
    return replace(so_far(findings), program=program, mission=mission, choice=choice, kernel=kernel)


def _from(
    mission: Mission, poses: Path | Source, limits: Limits, measured: list[Source]
) -> tuple[Mission | None, list[Diagnostic]]:
    """The mission with starts at the measured poses, and findings; the poses' source is appended to ``measured``."""
    text = poses if isinstance(poses, Source) else read_data(poses, str(poses), limits)
    if isinstance(text, Diagnostic):
        return None, [text]
    measured.append(text)
    from missionc.frontend.resolve.measured_pads import with_measured_pads  # few flights are measured

    return with_measured_pads(mission, text, limits)


def in_file_order(findings: list[Diagnostic], sources: list[Source]) -> tuple[Diagnostic, ...]:
    """Findings sorted by file in the order of reading, then by position; findings without a position come first."""
    order = {source.name: number for number, source in enumerate(sources)}

    def place(finding: Diagnostic) -> tuple[int, int]:
        span = finding.primary.span if finding.primary else None
        return (order.get(span.source.name, len(order)), span.start) if span else (-1, 0)

    return tuple(sorted(findings, key=place))


def no_more_than_are_read(findings: tuple[Diagnostic, ...]) -> tuple[Diagnostic, ...]:
    """The first findings up to a fixed number, errors before warnings.

    The last one states the number of further findings.
    """
    left = len(findings) - MOST_FINDINGS
    if left <= 0:
        return findings
    errors_first = sorted(range(len(findings)), key=lambda number: not has_errors([findings[number]]))
    *shown, last = (findings[number] for number in sorted(errors_first[:MOST_FINDINGS]))
    more = f"{left} more findings are not shown" if left > 1 else "1 more finding is not shown"
    return (*shown, replace(last, notes=(*last.notes, more)))

"""The front end: text to findings, and the mission as meant, with every tree that was made.

    in   a mission's file, or its text
    out  Checked

Nothing here solves a mission, or knows a backend.
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
from missionc.base.late_dataclass import dataclass
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


@dataclass(frozen=True, slots=True, eq=False)
class Checked:
    """What the front end made of a mission: every finding, and each tree it came to.

    ``findings`` are in file order. The trees are None from the first stage with
    errors on; where ``ok``, all are there.
    """

    file: str
    findings: tuple[Diagnostic, ...]
    sources: tuple[Source, ...] = ()
    unread: tuple[str, ...] = ()
    """Files that are included and could not be read, by the names under which they would be sources."""
    overrides: Mapping[str, str] = field(default_factory=dict)
    vehicle: str = ""
    """The profile that flies the teams which name none; empty for none."""
    stretch: float = 1.0
    """How many times as long as written it lasts."""
    poses: Source | None = None
    """Where its agents were measured to stand."""
    program: ast.Program | None = None
    mission: ir.Mission | None = None
    choice: Choice | None = None
    kernel: Kernel | None = None
    seconds: tuple[tuple[str, Seconds], ...] = ()
    past: Past | None = None
    """What was flown of it already, where that is so: ``mission`` and ``kernel`` are then the rest of it."""
    rest: Remaining | None = None
    """That rest, with what of the mission can no longer be kept."""
    stops: tuple[tuple[str, str], ...] = ()
    """The text of the polynomials that each agent flies until the rest begins, by the agent's name."""

    @property
    def ok(self) -> bool:
        """Whether there is no error; warnings may be."""
        return not has_errors(list(self.findings))

    @property
    def valid_mission(self) -> ir.Mission:
        """The mission, if there is no error."""
        assert self.mission is not None
        return self.mission

    @property
    def valid_kernel(self) -> Kernel:
        """The kernel, if there is no error."""
        assert self.kernel is not None
        return self.kernel

    def __str__(self) -> str:
        return below(self.findings, f"{self.file}: {counts(self.findings)}")

    _repr_pretty_ = printed
    _repr_html_ = shown


def below(findings: tuple[Diagnostic, ...], *lines: str) -> str:
    """Findings with their words in the text, and then these lines."""
    text = render_text(list(findings), False)
    return "\n".join(([text] if text else []) + list(lines))


ANY_BACKEND = "any"
"""For ``check``: whether some backend can plan the mission is not asked."""


def ignore(stage: str) -> None:
    """Nobody needs to know which stage runs."""


@dataclass(slots=True)
class Stopwatch:
    """Seconds by stage, in the order the stages ran; ``before`` is called with the name of each before it runs."""

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
    """Every finding that needs no solving, and the mission as meant where there is no error.

    Args:
        file: a path, or a text already in hand; what it includes lies relative to its name.
        overrides: texts for parameters, and for settings of backends: ``{"T": "30 s", "smt.nodes": "400"}``.
        backend: ``auto``, or the one to hold the mission against.
        limits: of the sizes a mission may have.
        stretch: how many times as long as written the mission lasts, in whole steps; its windows stay as they are.
        vehicle: the name of the profile that flies teams which name none; empty for none.
        poses: where the agents were measured to stand, a file or its text in hand: they come from the floor there.
        before: called with the name of each stage before it runs; what it raises ends the check.
        load: finds what the mission includes; read from beside it if left out.
        begun: the mission is being flown; whether its starts and its whole time fit the world as it reads now is not
            asked.
        judging: a flight is judged by the mission, and nothing planned: findings about planning are warnings.

    Raises:
        ValueError: there is no such profile.
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
            from missionc.backends.settings import with_settings  # few missions are tuned

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
    """The mission from where its agents were measured to stand; what holds that is added to ``measured``."""
    text = poses if isinstance(poses, Source) else read_data(poses, str(poses), limits)
    if isinstance(text, Diagnostic):
        return None, [text]
    measured.append(text)
    from missionc.frontend.resolve.measured_pads import with_measured_pads  # few flights are measured

    return with_measured_pads(mission, text, limits)


def in_file_order(findings: list[Diagnostic], sources: list[Source]) -> tuple[Diagnostic, ...]:
    """Findings about no text first, then by file in the order of reading, then by place."""
    order = {source.name: number for number, source in enumerate(sources)}

    def place(finding: Diagnostic) -> tuple[int, int]:
        span = finding.primary.span if finding.primary else None
        return (order.get(span.source.name, len(order)), span.start) if span else (-1, 0)

    return tuple(sorted(findings, key=place))


def no_more_than_are_read(findings: tuple[Diagnostic, ...]) -> tuple[Diagnostic, ...]:
    """The first findings, errors rather than warnings; the last one says how many more there are."""
    left = len(findings) - MOST_FINDINGS
    if left <= 0:
        return findings
    errors_first = sorted(range(len(findings)), key=lambda number: not has_errors([findings[number]]))
    *shown, last = (findings[number] for number in sorted(errors_first[:MOST_FINDINGS]))
    more = f"{left} more findings are not shown" if left > 1 else "1 more finding is not shown"
    return (*shown, replace(last, notes=(*last.notes, more)))

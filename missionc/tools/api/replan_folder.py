"""Replanning from a folder during its flight: reads and verifies the folder, and plans the remaining mission."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from missionc.base.diagnostics.code import NOT_TO_BE_CHANGED, TRACE_UNREADABLE
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.diagnostics.suggest import nearest
from missionc.base.limits import Limits
from missionc.base.source import Source
from missionc.base.units import Seconds
from missionc.compiler.replan.patch import patched
from missionc.compiler.replan.plan_rest import get_ready
from missionc.compiler.replan.replan import replan
from missionc.compiler.replan.request import Flying, Replanned, Request, Way
from missionc.frontend.syntax.read_file import read_source, read_text
from missionc.tools.replay.read_folder import OutputFolder, read_folder
from missionc.tools.replay.reverify import reverify_opened
from missionc.verification.monitoring.read_trace import FlownSoFar, read_flown


def replan_folder(
    folder: Path,
    flown: Path,
    changed: Path | None,
    lost: tuple[str, ...],
    slow: Mapping[str, float],
    given_up: tuple[str, ...],
    within: Seconds,
    seed: int,
    exports: tuple[str, ...],
    limits: Limits,
) -> Replanned:
    """Verify a plan folder, and compute a new plan for the remaining part of its mission.

    Args:
        folder: path of the plan folder.
        flown: file of the trace recorded so far.
        changed: file of declarations that replace those of the mission, or None.
        lost: names of agents that no longer fly.
        slow: maximum speeds of slow agents, m/s, by name.
        given_up: names of requirements to drop.
        within: time until the start of the new plan.
        seed: random seed.
        exports: names of further file formats.
        limits: maximum sizes of the folder's files.
    """
    opened = read_folder(folder, limits)
    if not isinstance(opened, OutputFolder):
        return _refused(*opened)
    verified = reverify_opened(opened, None)
    if not verified.passed:
        return _refused(*verified.findings)
    strange = _unknown(opened, lost, slow, given_up)
    if strange:
        return _refused(strange)
    so_far = _so_far(opened, flown, lost, limits)
    if not isinstance(so_far, FlownSoFar):
        return _refused(*so_far)
    texts: Mapping[str, str] = {}
    if changed is not None:
        patch = read_source(changed, str(changed), limits)
        edited = [patch] if isinstance(patch, Diagnostic) else patched(opened.checked, patch, limits)
        if isinstance(edited, list):
            return _refused(*edited)
        texts = edited
    request = Request(so_far, lost, slow, texts, given_up, in_time=within, seed=seed, exports=exports)
    flying = Flying(opened.checked, opened.trace, opened.flights, opened.ways)
    get_ready(flying)
    return replan(flying, request, limits)


def _so_far(
    opened: OutputFolder, flown: Path, lost: tuple[str, ...], limits: Limits
) -> FlownSoFar | tuple[Diagnostic, ...]:
    text = read_text(flown, str(flown), limits.trace_bytes, TRACE_UNREADABLE)
    if isinstance(text, Diagnostic):
        return (text,)
    found, findings = read_flown(Source(str(flown), text), opened.mission, lost, limits)
    return tuple(findings) if found is None else found


def _unknown(
    opened: OutputFolder, lost: Sequence[str], slow: Iterable[str], given_up: Sequence[str]
) -> Diagnostic | None:
    """Diagnostic of the first name that the mission does not have; None if it has all.

    Args:
        opened: contents of the plan folder.
        lost, slow: names of agents.
        given_up: names of requirements.
    """
    agents = [agent.name for agent in opened.mission.agents]
    for flag, names, known in (
        ("--lost", lost, agents),
        ("--slow", slow, agents),
        ("--give-up", given_up, [goal.name for goal in opened.kernel.requirements]),
    ):
        for name in names:
            if name not in known:
                near = nearest(name, known)
                what = "requirement" if flag == "--give-up" else "agent"
                hint = f"did you mean `{near}`?" if isinstance(near, str) else f"use one of {', '.join(known[:8])}"
                return Diagnostic(NOT_TO_BE_CHANGED, f"unknown {what} in `{flag} {name}`", None, help=hint)
    return None


def _refused(*findings: Diagnostic) -> Replanned:
    return Replanned(Way.NONE, findings)

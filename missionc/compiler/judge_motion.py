"""Evaluation of a flight against a mission: of a recorded trace, or of live states.

in   a mission's file or text; a trace, or the plan of the flight
out  Monitored, or the Session of online monitoring
says MC009 MC704 MC705
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from missionc.base.diagnostics.code import TRACE_UNREADABLE
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.limits import Limits
from missionc.base.source import Source
from missionc.base.trace import Trace
from missionc.compiler.front_end import ANY_BACKEND, Checked, check
from missionc.compiler.results import Monitored
from missionc.frontend.syntax.read_file import read_text
from missionc.ir import Mission

if TYPE_CHECKING:
    from missionc.verification.certificate import Between
    from missionc.verification.monitoring.live.session import Session
    from missionc.verification.monitoring.read_trace import State


def live_session(
    file: str | Path | Source,
    *,
    overrides: Mapping[str, str] | None = None,
    limits: Limits | None = None,
    wait: float | None = None,
    skew: Mapping[str, float] | None = None,
    leap: float | None = None,
    plan: str | Path | None = None,
    tolerance: float = 0.0,
) -> tuple[Checked, Session | None]:
    """The checked mission, and a session that monitors it in flight; None if the mission, or the plan, has errors.

    Args:
        plan: folder or trace of the flight's plan, for forecasts of open goals.
        wait: seconds that a step waits for samples; default one step.
        skew: seconds by which the clock of an agent is ahead.
        leap: seconds by which a sample may be ahead of all others without confirmation.
        tolerance: error of recorded positions, metres, for constraints.

    Raises:
        KeyError: the mission has no agent of that name.
    """
    limits = limits or Limits()
    checked = check(file, overrides=overrides, limits=limits, backend=ANY_BACKEND, judging=True)
    if checked.mission is None or checked.kernel is None:
        return checked, None
    from missionc.verification.monitoring.live.session import Session
    from missionc.verification.recorded.constraint_judge import LiveConstraints

    index = {agent.name: agent.index for agent in checked.mission.agents}
    ahead = {index[name]: seconds for name, seconds in (skew or {}).items()}
    constraints = LiveConstraints(checked.mission, tolerance)
    session = Session(checked.mission, checked.kernel, limits, wait, ahead, leap, constraints)
    if plan is not None:
        motion, _, findings = _read_motion(plan, checked.mission, limits)
        if motion is None:
            return replace(checked, findings=(*checked.findings, *findings)), None
        session.follow(motion)
    return checked, session


def monitor(
    file: str | Path | Source,
    trace: str | Path,
    *,
    overrides: Mapping[str, str] | None = None,
    limits: Limits | None = None,
    continuous: bool = False,
    tolerance: float = 0.0,
) -> Monitored:
    """Evaluate a mission on a trace, recorded or written by hand, in ``plan.json`` format or CSV.

    Args:
        continuous: True to evaluate requirements and constraints in continuous time too, along the trajectories between
            samples.
        tolerance: error of recorded positions, metres, for constraints.
    """
    limits = limits or Limits()
    checked = check(file, overrides=overrides, limits=limits, backend=ANY_BACKEND, judging=True)
    if checked.mission is None or checked.kernel is None:
        return Monitored(checked, (), (), checked.findings)
    from missionc.verification.monitoring.monitor import monitor as judge

    motion, states, findings = _read_motion(trace, checked.mission, limits)
    if motion is None:
        return Monitored(checked, (), (), (*checked.findings, *findings))
    judgements = judge(checked.mission, checked.kernel, motion)
    between: tuple[Between, ...] = ()
    curves = None
    if continuous:
        from missionc.verification.between.between_steps import between_steps
        from missionc.verification.recorded.constraint_judge import recorded_motion

        curves = recorded_motion(checked.mission, motion, states)
        between = between_steps(checked.mission, checked.kernel, motion, curves)
    from missionc.verification.recorded.constraint_judge import judge_constraints

    constraints = judge_constraints(checked.mission, motion, between=curves, tolerance=tolerance)
    goals = (judgements.requirements, judgements.preferences)
    return Monitored(checked, *goals, checked.findings, between, *constraints)


def _read_motion(
    path: str | Path, mission: Mission, limits: Limits
) -> tuple[Trace | None, list[State], list[Diagnostic]]:
    """Trace in a file or in a folder's ``plan.json``, its samples, and findings on errors.

    The trace is None if there are errors.
    """
    from missionc.verification.monitoring.read_trace import assemble, read_states  # with numpy

    file = Path(path) / "plan.json" if Path(path).is_dir() else Path(path)
    text = read_text(file, str(file), limits.trace_bytes, TRACE_UNREADABLE)
    if isinstance(text, Diagnostic):
        return None, [], [text]
    source = Source(str(file), text)
    states, findings = read_states(source, mission, limits)
    trace, findings = (None, findings) if findings else assemble(source, mission, states)
    return trace, states, findings

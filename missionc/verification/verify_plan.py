"""Verification of a plan against its mission, without trust in any backend.

    in   Mission, its kernel, the Trace of a backend
    out  Certificate: every check with its margin

This module shares no code with planning; it uses only distances to shapes, their Lipschitz bound and the monitor.
"""

from __future__ import annotations

from dataclasses import replace

from missionc.base.trace import Trace
from missionc.geometry.curves.piecewise_polynomials import motion
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from missionc.verification.between.between_steps import verify_between
from missionc.verification.certificate import Certificate, Check, Figure
from missionc.verification.flight.verify_polynomials import verify_polynomials
from missionc.verification.monitoring.monitor import monitor
from missionc.verification.plan.algebraic_connectivity import connectivity
from missionc.verification.plan.clearances import check_obstacles, check_separation
from missionc.verification.plan.lanes_kept import check_lanes_kept
from missionc.verification.plan.starts_and_finishes import check_places, check_world
from missionc.verification.plan.step_dynamics import check_dynamics, check_shape
from missionc.verification.plan.time_robustness import check_tolerances, time_robustness
from missionc.verification.plan.whole_requirements import check_requirements

__all__ = ["Certificate", "Check", "Figure", "verify", "verify_between", "verify_polynomials", "with_delays"]


def verify(mission: Mission, kernel: Kernel, trace: Trace) -> Certificate:
    """Certificate of a plan, verified at the steps and in continuous time.

    For a trace of the wrong shape, it contains only the check of the shape.
    """
    shape = check_shape(mission, trace)
    if not shape.passed:
        return Certificate(mission.name, (shape,))
    curves = motion(mission, trace)
    judgements = monitor(mission, kernel, trace)
    requirements, preferences = check_requirements(mission, judgements)
    checks = (
        shape,
        *check_dynamics(mission, trace),
        *check_places(mission, trace),
        *check_lanes_kept(mission, trace),
        check_world(mission, curves),
        *check_obstacles(mission, curves),
        *check_separation(mission, curves),
        *requirements,
    )
    figures = (*preferences, *connectivity(mission, trace))
    certificate = Certificate(mission.name, checks, figures, judgements=judgements.requirements)
    if not (mission.tolerances and certificate.passed):
        return certificate
    delays = time_robustness(mission, kernel, trace)
    return replace(certificate, checks=(*checks, *check_tolerances(mission, delays)), delays=delays)


def with_delays(mission: Mission, kernel: Kernel, trace: Trace, certificate: Certificate) -> Certificate:
    """The certificate of a passing plan, with the time robustness of each agent added."""
    return certificate if certificate.delays else replace(certificate, delays=time_robustness(mission, kernel, trace))

"""Continuous-time verification of every requirement that is satisfied at the steps.

    in   Mission, its kernel, a Trace already evaluated at the steps, the flown Curves
    out  Between for each requirement that is true at the steps; for a folder's files, in a Certificate

The semantics of a mission is defined at the steps and does not change here. An operator has the same meaning with times
instead of steps (``docs/semantics.md``).
"""

from __future__ import annotations

from collections.abc import Mapping

from missionc.base.trace import Trace
from missionc.geometry.curves.piecewise_polynomials import Curves, Pieces, curves_of, read
from missionc.ir import Mission
from missionc.ir.kernel.analysis import steps_ahead
from missionc.ir.kernel.nodes import Goal, Kernel
from missionc.ir.kernel.walk import postorder
from missionc.verification.between.counterexample import Search, agents_of, sentence, stretch
from missionc.verification.between.interval_sets import Motion
from missionc.verification.between.truth_over_time import TruthOverTime
from missionc.verification.certificate import Between, Certificate, Verdict
from missionc.verification.monitoring.monitor import truths

__all__ = ["between_steps", "verify_between"]


def verify_between(mission: Mission, kernel: Kernel, trace: Trace, files: Mapping[str, str]) -> Certificate:
    """Certificate with the continuous-time verdict on each requirement, for the fitted polynomials of a verified plan.

    Args:
        files: text of each agent's trajectory file, by agent name; already accepted by ``verify_polynomials``.

    Returns:
        A certificate without entries if a file is unreadable.
    """
    trajectories = [read(files.get(agent.name, "")) for agent in mission.agents]
    pieces = [own for own in trajectories if isinstance(own, Pieces)]
    if not pieces or len(pieces) < len(trajectories):
        return Certificate(mission.name, ())
    flown = curves_of(pieces, slice(mission.dimension))
    return Certificate(mission.name, (), between=between_steps(mission, kernel, trace, flown))


def between_steps(mission: Mission, kernel: Kernel, trace: Trace, curves: Curves) -> tuple[Between, ...]:
    """Continuous-time verdict on every requirement that the trace satisfies at its steps.

    Args:
        curves: the agents' trajectories, through the states of ``trace``.
    """
    at_steps = truths([goal.formula for goal in kernel.requirements], mission, trace)
    evaluation = TruthOverTime(Motion(mission, curves, trace))
    return tuple(_judged(goal, evaluation, trace) for goal in kernel.requirements if bool(at_steps[goal.formula][0, 0]))


def _judged(goal: Goal, evaluation: TruthOverTime, trace: Trace) -> Between:
    motion = evaluation.motion
    known = evaluation.of(goal.formula)
    signal = known[goal.formula][0]
    if signal.sure and signal.sure[0][0] == 0:
        return Between(goal.name, Verdict.HOLDS)
    certain = bool(signal.never) and signal.never[0][0] == 0
    at_steps = truths(postorder((goal.formula,)), motion.mission, trace)
    ahead = steps_ahead((goal.formula,))
    culprits = Search(known, at_steps, certain, ahead, motion.end).culprits(goal.formula)
    begin, stop = (round(float(motion.seconds(tick)), 6) for tick in stretch(culprits[0]))
    agents = sorted({agent for culprit in culprits for agent in agents_of(culprit, motion)})
    return Between(
        goal.name,
        Verdict.FAILS if certain else Verdict.UNDECIDED,
        begin,
        stop,
        tuple(motion.mission.agents[agent].name for agent in agents),
        sentence(goal.name, culprits, certain, motion),
    )

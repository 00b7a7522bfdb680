"""Requirements over a mission with a flown past: past and plan, evaluated as one trajectory.

    in   the original mission, the traces of the completed parts, the trace of the plan
    out  Checks

Planning uses the progression of a requirement; this check does not rely on it.

Requirements at the steps of a plan, as checks with the monitor's truth and robustness.

Algebraic connectivity (λ₂) of the graphs that must be connected, in addition to robustness.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from missionc.base.trace import Array, Judgements, Trace
from missionc.ir import Holds, Mission
from missionc.ir.couplings import directed
from missionc.ir.kernel.nodes import Kernel
from missionc.ir.language.margins.predicate_margins import algebraic_connectivity
from missionc.ir.language.walk_formulas import formulas
from missionc.verification.certificate import Check, Figure
from missionc.verification.monitoring.monitor import monitor


def check_requirements(mission: Mission, judgements: Judgements) -> tuple[list[Check], list[Figure]]:
    """A check for each requirement, with its robustness as margin, and an informative quantity for each preference."""
    checks = [
        Check(
            name="requirement",
            subject=judgement.name,
            margin=judgement.robustness,
            unit=judgement.unit,
            tolerance=0.0,
            passed=judgement.satisfied,
            at=None if judgement.step is None else judgement.step * mission.step,
            agents=judgement.agents,
            detail="evaluated by the monitor at the sample times",
        )
        for judgement in judgements.requirements
    ]
    return checks, [Figure("preference", each.name, each.robustness, each.unit) for each in judgements.preferences]


def check_whole(mission: Mission, kernel: Kernel, past: Sequence[Trace], plan: Trace) -> list[Check]:
    """A check of each requirement, evaluated over the past followed by the plan.

    Args:
        mission: the original mission, with all agents of the traces.
        past: in order; each begins with the last state of the previous one, and so does the plan.
    """
    parts = [*past, plan]

    def joined(arrays: list[Array]) -> Array:
        return np.concatenate([*(each[:, :-1] for each in arrays[:-1]), arrays[-1]], axis=1)

    whole = Trace(
        plan.step,
        joined([each.position for each in parts]),
        joined([each.velocity for each in parts]),
        joined([each.heading for each in parts]),
    )
    checks, _ = check_requirements(mission, monitor(mission, kernel, whole))
    return [replace(check, name="whole requirement") for check in checks]


MOST_AGENTS = 400
"""Maximum number of agents; above it, computing the eigenvalues would take longer than planning."""


def connectivity(mission: Mission, trace: Trace) -> list[Figure]:
    """Minimum algebraic connectivity λ₂ over all steps, with its time, for each graph that must be ``connected``.

    It is positive if the graph is connected at every step. Directed graphs are left out, since their Laplacian is not
    symmetric.

    Source:
        [clot] III-C, λ₂.
    """
    figures: dict[tuple[str, tuple[int, ...]], Figure] = {}
    for formula in formulas(mission):
        graph = formula.predicate.restricted if isinstance(formula, Holds) else None
        if graph is None or directed(graph):
            continue
        key = graph.name, tuple(sorted(graph.agents))
        if key not in figures and 2 <= len(graph.agents) <= MOST_AGENTS:
            second = algebraic_connectivity(graph, trace)
            step = int(second.argmin())
            names = tuple(mission.agents[index].name for index in key[1])
            # Rounded, so that zero to working precision is zero.
            value = max(0.0, round(float(second[step]), 9))
            figures[key] = Figure("connectivity", graph.name, value, "lambda_2", step * trace.step, names)
    return list(figures.values())

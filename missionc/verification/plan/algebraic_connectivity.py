"""Algebraic connectivity (λ₂) of the graphs that must be connected, in addition to robustness."""

from __future__ import annotations

from missionc.base.trace import Trace
from missionc.ir import Holds, Mission
from missionc.ir.couplings import directed
from missionc.ir.language.margins.predicate_margins import algebraic_connectivity
from missionc.ir.language.walk_formulas import formulas
from missionc.verification.certificate import Figure

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

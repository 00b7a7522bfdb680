"""The clauses of a refutation against the monitor: of a motion that satisfies a formula they have a model.

Each place of the motion is a cell of its own, so that labels are as sharp as they can be.
"""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from missionc import ir
from missionc.base.limits import DEEPEST
from missionc.base.trace import Trace
from missionc.base.units import Metres, Steps
from missionc.ir.kernel.nodes import All, At, Goal, Is, Reach
from missionc.ir.kernel.normal_form import negated
from missionc.ir.language.operators import by_name
from missionc.ir.lower.expand import expand
from missionc.verification.impossibility import cnf
from missionc.verification.impossibility.cnf import TooManyClauses
from missionc.verification.monitoring.monitor import monitor
from tests.support.forged_covers import followed
from tests.support.random_runs import (
    SPAN,
    formulas,
    mission_of,
    own_states,
    positions,
    remembering,
    trace_of,
)

pysat = pytest.importorskip("pysat.solvers")

MANY = settings(
    max_examples=250, suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much], deadline=None
)


@st.composite
def asked(draw: st.DrawFn, *, plain: bool) -> tuple[ir.Mission, Trace, ir.Formula]:
    """A run of up to 4 agents that are points, and a formula about it; where plain, one about one agent's places."""
    size, steps = draw(st.integers(1, 4)), draw(st.integers(0, 6))
    trace = trace_of(draw(positions(size, steps)))
    team = tuple(replace(agent, radius=Metres(0.0)) for agent in mission_of(size, steps).agents)
    mission = replace(mission_of(size, steps), agents=team)
    if plain:
        word = by_name[draw(st.sampled_from(["always", "eventually", "until", "release", "once", "since"]))]
        low = draw(st.integers(0, steps))
        window = ir.Window(Steps(low), Steps(draw(st.integers(low, steps))), SPAN)
        inside = st.builds(
            lambda region: ir.Holds(ir.Inside(region, body=False), SPAN), st.sampled_from(mission.regions)
        )
        operands = tuple(draw(inside) for _ in range(word.arity))
        return mission, trace, ir.OfAgent(0, ir.Apply(word, operands, window, SPAN), SPAN)
    own = own_states(size)
    return mission, trace, draw(st.one_of(formulas(size, steps, 3), own, remembering(size, steps, own)))


def has_model(mission: ir.Mission, trace: Trace, goal: Goal) -> bool:
    clauses = followed(mission, (goal,), trace.position).clauses
    with pysat.Cadical195(bootstrap_with=clauses) as solver:
        return bool(solver.solve())


def both_ways(mission: ir.Mission, trace: Trace, formula: ir.Formula) -> tuple[Goal, Goal, float]:
    """A goal that holds, the one that says the opposite, and by how much."""
    kernel, _ = expand(replace(mission, requirements=(ir.Requirement("asked", formula, SPAN),)))
    (goal,), (judged,) = kernel.requirements, monitor(mission, kernel, trace).requirements
    opposite = replace(goal, formula=negated(goal.formula))
    return (goal, opposite, judged.robustness) if judged.satisfied else (opposite, goal, judged.robustness)


@MANY
@given(asked(plain=False))
def test_what_holds_of_a_motion_has_a_model(case: tuple[ir.Mission, Trace, ir.Formula]) -> None:
    mission, trace, formula = case
    holds, _, _ = both_ways(mission, trace, formula)
    assert has_model(mission, trace, holds)


@MANY
@given(asked(plain=True))
def test_what_clearly_fails_of_one_agent_has_none(case: tuple[ir.Mission, Trace, ir.Formula]) -> None:
    mission, trace, formula = case
    _, fails, margin = both_ways(mission, trace, formula)
    assert abs(margin) < 1e-6 or not has_model(mission, trace, fails)


def standing(size: int, steps: int) -> tuple[ir.Mission, Trace]:
    """Points that stand well within `base`."""
    team = tuple(replace(agent, radius=Metres(0.0)) for agent in mission_of(size, steps).agents)
    return replace(mission_of(size, steps), agents=team), trace_of([[(0.5, 0.5)] * (steps + 1)] * size)


def test_a_formation_of_three_with_a_total_tolerance_is_left_open() -> None:
    mission, trace = standing(3, 0)
    loose = next(each for each in mission.formations if each.total)
    for goal in both_ways(mission, trace, ir.Holds(ir.InFormation(loose), SPAN))[:2]:
        assert has_model(mission, trace, goal)


def test_more_agents_than_there_are_never_satisfy_anything() -> None:
    mission, trace = standing(1, 0)
    inside = ir.Holds(ir.Inside(mission.regions[0], body=False), SPAN)
    holds, fails, _ = both_ways(mission, trace, ir.AtLeastOf("at least", 4, mission.teams[0], inside, SPAN))
    assert has_model(mission, trace, holds)
    assert not has_model(mission, trace, fails)


def test_a_flag_is_followed_over_thousands_of_steps() -> None:
    mission, trace = standing(1, 3000)
    loaded = ir.Holds(ir.Flagged(ir.Flag("loaded", (0,), mission.regions[0], None, SPAN)), SPAN)
    window = ir.Window(Steps(3000), Steps(3000), SPAN)
    at_last = ir.OfAgent(0, ir.Apply(by_name["eventually"], (loaded,), window, SPAN), SPAN)
    holds, fails, _ = both_ways(mission, trace, at_last)
    assert has_model(mission, trace, holds)
    assert not has_model(mission, trace, fails)


def test_formulas_nest_as_deep_as_they_can_be_written() -> None:
    mission, trace = standing(1, 0)
    formula: ir.Formula = ir.Holds(ir.Inside(mission.regions[0], body=False), SPAN)
    for _ in range(DEEPEST):
        formula = ir.Apply(by_name["eventually"], (formula,), ir.Window(Steps(0), Steps(0), SPAN), SPAN)
    holds, fails, _ = both_ways(mission, trace, ir.OfAgent(0, formula, SPAN))
    assert has_model(mission, trace, holds)
    assert not has_model(mission, trace, fails)


def test_routes_lead_over_hundreds_of_agents(monkeypatch: pytest.MonkeyPatch) -> None:
    """A fleet beyond what a proof is gone through for is told from one that recurses too deep."""
    mission, trace = standing(400, 0)
    reach = Reach(mission.graphs[0], All(()), Is(frozenset((399,))), 400)
    monkeypatch.setattr(cnf, "MOST_CLAUSES", 200_000)
    with pytest.raises(TooManyClauses):
        followed(mission, (Goal("asked", At(0, reach), SPAN),), trace.position)

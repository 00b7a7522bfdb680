"""Every operator's encoding against its meaning: fix the motion, ask the solver, compare.

The agents' places are fixed by assumptions, so that the clauses about motion
leave one joint motion; then a formula can be asked for exactly where it holds
of that motion, and its negation exactly where it does not.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from missionc import ir
from missionc.backends.smt.encode.clauses import Clauses
from missionc.backends.smt.encode.lower import Lowered, lower
from missionc.backends.smt.encode.lower_motion import Motion, Occupancy, all_ways, lower_motion
from missionc.backends.smt.encode.metric_bounds import bounded_above, without_metres
from missionc.backends.smt.prioritized.single_agent_relaxation import SingleAgentRelaxation
from missionc.backends.smt.roadmap import roadmap_links
from missionc.backends.smt.roadmap.labels import Labels, Unexpressible
from missionc.backends.smt.roadmap.roadmap import Roadmap
from missionc.backends.smt.sat.worker import SAT, CaDiCaL
from missionc.base.units import Metric
from missionc.ir.kernel.nodes import Goal, Kernel
from missionc.ir.kernel.normal_form import negated
from missionc.ir.language.operator import Operator
from missionc.ir.language.operators import OPERATORS
from missionc.ir.lower.expand import expand
from tests import reference
from tests.support.random_runs import SPAN, applied, as_planned, formulas, mission_of, run_of, trace_of
from tests.support.small_roadmaps import roadmap_of

GRID = [(x / 2, y / 2) for x in range(5) for y in range(5)]
BY_NAME = {operator.name: operator for operator in OPERATORS}
SPATIAL = [operator.name for operator in OPERATORS if operator.spatial]
PLACES = st.lists(st.sampled_from(GRID), min_size=6, max_size=9, unique=True)


@dataclass(frozen=True)
class Case:
    """Roadmaps, where on them each agent is at each step, and a formula."""

    mission: ir.Mission
    roadmaps: tuple[Roadmap, ...]
    states: np.ndarray
    formula: ir.Formula
    most_links: int

    @property
    def run(self) -> reference.Run:
        of = {agent: roadmap for roadmap in self.roadmaps for agent in roadmap.agents}
        positions = [[tuple(of[agent].position[state]) for state in row] for agent, row in enumerate(self.states)]
        return run_of(self.mission, trace_of(positions))


@cache
def joint_motions(places: int, size: int, steps: int) -> st.SearchStrategy[list[list[int]]]:
    """The places that agents are at, each at another, by step and agent."""
    order = st.permutations(range(places)).map(lambda order: order[:size])
    return st.lists(order, min_size=steps + 1, max_size=steps + 1)


@cache
@st.composite
def cases(draw: st.DrawFn, first: Operator | None = None, metres: bool = False) -> Case:
    """Up to 4 agents on one or two roadmaps of a few states; any move is allowed."""
    size, steps = draw(st.integers(1, 4)), draw(st.integers(0, 4))
    mission = mission_of(size, steps)
    split = draw(st.integers(1, size))
    groups = [tuple(range(split)), tuple(range(split, size))]
    places = draw(PLACES)
    roadmaps = tuple(roadmap_of(group, places, steps) for group in groups if group)
    states = draw(joint_motions(len(places), size, steps))
    formula = draw(formulas(size, steps, 3)) if first is None else draw(applied(first, size, steps, 2))
    asked = expressible(formula, mission, metres)
    return Case(mission, roadmaps, np.array(states).T, asked, draw(st.sampled_from([1, 2, 9])))


def expressible(formula: ir.Formula, mission: ir.Mission, metres: bool) -> ir.Formula:
    """Metres become hops, unless they are wanted; what is about three agents at once becomes false."""
    match formula:
        case ir.Apply(operands=operands, bounds=bounds):
            if isinstance(bounds, ir.Length) and bounds.metric is Metric.METRES and not metres:
                bounds = replace(bounds, metric=Metric.HOPS, low=float(int(bounds.low)), high=bounds.low + 1.0)
                bounds = replace(bounds, high=float(int(bounds.high)))
            return replace(
                formula, operands=tuple(expressible(each, mission, metres) for each in operands), bounds=bounds
            )
        case ir.AtLeastOf(body=body) | ir.OfAgent(body=body):
            return replace(formula, body=expressible(body, mission, metres))
        case ir.Holds(ir.InFormation(formation)) if formation.total and len(formation.edges) > 1:
            return ir.Truth(False, SPAN)
        case _:
            return formula


def unchanged(kernel: Kernel) -> Kernel:
    return kernel


def asked(
    case: Case, cast: frozenset[int], form: Callable[[Kernel], Kernel] = unchanged
) -> tuple[tuple[Goal, ...], Motion, Lowered, CaDiCaL]:
    """That the formula holds, and that it fails, as goals; and all that is said to a solver of these agents."""
    requirement = ir.Requirement("asked", case.formula, SPAN)
    kernel, findings = expand(replace(case.mission, requirements=(requirement,)))
    assert kernel is not None, findings
    kernel = as_planned(case.mission, kernel, case.formula)
    node = kernel.requirements[0].formula
    clauses = Clauses(10_000_000)
    motion = lower_motion(case.roadmaps, all_ways(case.roadmaps, {}), cast, clauses)
    goals = form(Kernel((Goal("holds", node, SPAN), Goal("fails", negated(node), SPAN)), ())).requirements
    try:
        lowered = lower(
            goals, Labels(case.mission, motion.roadmaps), motion, clauses, Occupancy(motion, clauses), case.most_links
        )
    except Unexpressible:
        assume(False)
    solver = CaDiCaL()
    solver.add(clauses.everything().tolist())
    return goals, motion, lowered, solver


def answers(case: Case, form: Callable[[Kernel], Kernel]) -> tuple[list[bool], Lowered]:
    """Whether the formula, and its negation, can be asked for of the motion of the case."""
    _, motion, lowered, solver = asked(case, frozenset(range(len(case.mission.agents))), form)
    fixed = [
        int(motion.states[agent][step, state])
        for agent, row in enumerate(case.states)
        for step, state in enumerate(row)
    ]
    return [solver.solve([*fixed, literal])[0] == SAT for literal in lowered.goals], lowered


def agrees(case: Case) -> None:
    truth = reference.truth(case.formula, case.run, 0, 0)
    (holds, fails), lowered = answers(case, unchanged)
    if lowered.shortened:
        assert holds <= truth
        assert fails <= (not truth)
    else:
        assert holds == truth
        assert fails == (not truth)


@given(case=cases())
@settings(max_examples=120)
def test_a_formula_can_be_asked_for_exactly_where_it_holds(case: Case) -> None:
    agrees(case)


@pytest.mark.parametrize("operator", OPERATORS, ids=lambda operator: operator.name)
@given(data=st.data())
@settings(max_examples=40)
def test_each_operator_means_to_the_solver_what_it_means(operator: Operator, data: st.DataObject) -> None:
    agrees(data.draw(cases(operator)))


@pytest.mark.parametrize("name", SPATIAL)
@given(data=st.data())
@settings(max_examples=40)
def test_lengths_in_metres_are_asked_for_only_where_they_are_kept(name: str, data: st.DataObject) -> None:
    case = data.draw(cases(BY_NAME[name], metres=True))
    truth = reference.truth(case.formula, case.run, 0, 0)
    (holds, fails), _ = answers(case, bounded_above)
    assert holds <= truth
    assert fails <= (not truth)
    (holds, fails), lowered = answers(case, without_metres)
    if not lowered.shortened:
        assert holds >= truth
        assert fails >= (not truth)


@given(case=cases())
@settings(max_examples=60)
def test_a_formula_means_the_same_where_places_are_asked_in_groups(case: Case) -> None:
    with patch.object(roadmap_links, "DENSE", -1):
        agrees(case)


@given(case=cases(), members=st.sets(st.integers(0, 3), min_size=1))
@settings(max_examples=120)
def test_agents_are_not_given_up_as_too_few_where_they_have_a_plan(case: Case, members: set[int]) -> None:
    cast = frozenset(members) & frozenset(range(len(case.mission.agents)))
    goals, motion, lowered, solver = asked(case, cast)
    for goal, literal in zip(goals, lowered.goals, strict=True):
        outlook = SingleAgentRelaxation(Labels(case.mission, case.roadmaps), motion.ways, cast)
        if outlook.infeasible((goal.formula,)):
            assert solver.solve([literal])[0] != SAT

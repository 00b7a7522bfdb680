"""The table of every formula at every step, and who decides each, on random runs."""

from __future__ import annotations

import os
from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from missionc import ir
from missionc.ir.kernel.nodes import Kernel
from missionc.ir.language.margins.links import all_links
from missionc.ir.language.operator import Bounds
from missionc.ir.language.operators import OPERATORS, by_name
from missionc.ir.lower.expand import expand
from missionc.verification.monitoring.monitor import robustness, truth
from missionc.verification.monitoring.verdict_table import table
from missionc.verification.monitoring.violation import Witnesses
from tests import reference
from tests.support.random_runs import SPAN, Case, applied, cases, formulas, mission_of

EXAMPLES = int(os.environ.get("MISSIONC_FUZZ", "60"))


def kernel_of(case: Case) -> tuple[ir.Mission, Kernel] | None:
    """None where the formula looks past the run: nobody may ask it then."""
    if reference.ahead(case.formula) > case.run.last:
        return None
    mission = mission_of(len(case.trace.position), case.run.last, ir.Requirement("asked", case.formula, SPAN))
    kernel, findings = expand(mission)
    assert kernel is not None, findings
    return mission, kernel


@st.composite
def windows_below_routes(draw: st.DrawFn) -> Case:
    """Formulas whose routes, as a rule, look at others' windows; and conditions and quantifiers around them."""
    case = draw(cases(draw(st.sampled_from([operator for operator in OPERATORS if operator.spatial]))))
    size, steps = len(case.trace.position), case.run.last
    operator = draw(st.sampled_from([each for each in OPERATORS if each.bounds is Bounds.TIME or each.name == "next"]))
    route = case.formula
    if isinstance(route, ir.Apply):
        inside = tuple(draw(applied(operator, size, steps, 1)) for _ in route.operands)
        route = replace(route, operands=inside)
    around = draw(st.sampled_from(["nothing", "not", "and", "every", "some"]))
    if around in ("not", "and"):
        other = draw(formulas(size, steps, 1))
        operands = (route,) if around == "not" else (route, other)
        route = ir.Apply(by_name[around], operands, None, SPAN)
    elif around != "nothing":
        everyone = ir.AgentSet("these", tuple(range(size)), SPAN)
        route = ir.AtLeastOf(around, size if around == "every" else 1, everyone, route, SPAN)
    return replace(case, formula=route)


@settings(max_examples=EXAMPLES)
@given(st.one_of(cases(), windows_below_routes()))
def test_rows_agree_with_the_monitor(case: Case) -> None:
    made = kernel_of(case)
    if made is None:
        return
    mission, kernel = made
    nodes = list(dict.fromkeys(kernel.meanings.values()))
    for node, row in table(nodes, [kernel.requirements[0].formula], mission, case.trace, kernel.opposites).items():
        flags, margins = truth(node, mission, case.trace), robustness(node, mission, case.trace)
        size = len(row.asked)
        if not row.unfolds:
            np.testing.assert_array_equal(row.surely, flags[:size])
            np.testing.assert_array_equal(row.least, margins[:size])
            assert row.least is row.most or np.array_equal(row.least, row.most)
            continue
        # What a verdict can come to only narrows, around what it does come to.
        assert (row.least <= margins[:size, :1]).all()
        assert (margins[:size, :1] <= row.most).all()
        assert (row.least[:, 1:] >= row.least[:, :-1]).all()
        assert (row.most[:, 1:] <= row.most[:, :-1]).all()
        assert (row.least[:, -1] == margins[:size, 0]).all()
        assert (row.surely[:, -1] == flags[:size, 0]).all()
        assert (row.surely <= flags[:size, :1]).all()
        assert (flags[:size, :1] <= row.possibly).all()


@settings(max_examples=EXAMPLES)
@given(st.one_of(cases(), windows_below_routes()))
def test_what_is_not_asked_cannot_be_seen_in_the_verdict(case: Case) -> None:
    made = kernel_of(case)
    if made is None:
        return
    mission, kernel = made
    (goal,) = kernel.requirements
    atoms = [node for formula, node in kernel.meanings.items() if isinstance(formula, ir.Holds)]
    rows = table(atoms, [goal.formula], mission, case.trace, kernel.opposites)
    last = max((int(row.asked.any(axis=0).nonzero()[0].max(initial=-1)) for row in rows.values()), default=-1)
    later = case.trace.position.copy()
    # Speeds at a step are of the motion that starts there.
    later[:, last + 2 :] += 7.0
    moved = type(case.trace)(case.trace.step, later, case.trace.velocity, case.trace.heading)
    before = robustness(goal.formula, mission, case.trace)[:, 0]
    if not any(isinstance(node.predicate, ir.Connected) for node in atoms if hasattr(node, "predicate")):
        np.testing.assert_array_equal(robustness(goal.formula, mission, moved)[:, 0], before)


@settings(max_examples=EXAMPLES)
@given(st.one_of(cases(), windows_below_routes()))
def test_the_links_of_a_witness_are_links_of_a_graph(case: Case) -> None:
    made = kernel_of(case)
    if made is None:
        return
    mission, kernel = made
    linked = np.zeros((case.run.last + 1, len(mission.agents), len(mission.agents)), dtype=bool)
    for graph in mission.graphs:
        members = np.array(graph.agents, dtype=np.int64)
        if len(members):
            there = np.ix_(np.arange(len(linked)), members, members)
            linked[there] |= all_links(graph, case.trace.position) > 0
    goal = kernel.requirements[0].formula
    witnesses = Witnesses([goal], mission, case.trace, kernel.opposites)
    rows = table(kernel.meanings.values(), [goal], mission, case.trace, kernel.opposites)
    for node, row in rows.items():
        seen = witnesses.of(node, row.unfolds)
        if seen is None:
            assert not row.asked.any()
            continue
        assert seen.holds.shape == seen.fails.shape == case.trace.position.shape[:2]
        step, first, second = seen.links.T
        assert linked[step, first, second].all()
        for agents in (first, second):
            assert (seen.holds | seen.fails)[agents, step].all()
        if not row.unfolds:
            asked = np.broadcast_to(row.asked, seen.holds.shape).any(axis=0)
            assert not (seen.holds | seen.fails)[:, ~asked].any()

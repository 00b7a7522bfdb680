"""Requirements as checks: what the monitor judged, with its time; whole ones over what was flown and the plan."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from missionc import ir
from missionc.base.trace import Judgement, Judgements, Trace
from missionc.base.units import Metres, Seconds
from missionc.ir.kernel.nodes import Always, At, Atom, Eventually, Goal, Kernel
from missionc.verification.certificate import Check, Figure
from missionc.verification.plan.algebraic_connectivity import connectivity
from missionc.verification.plan.whole_requirements import check_requirements, check_whole
from tests.support.legal_plans import SPAN, mission_of, straight

MISSION = mission_of([[1.0, 1.0], [1.0, 3.0]], 4, step=0.5)
JUDGED = "evaluated by the monitor at the sample times"


def test_a_requirement_is_checked_and_a_preference_is_a_figure() -> None:
    judgements = Judgements(
        (Judgement("near", True, 0.5), Judgement("slow", False, -2.0, 3, ("drone[1]",), "m/s")),
        (Judgement("west", False, -1.0, 2, ("drone[0]",)),),
    )
    checks, figures = check_requirements(MISSION, judgements)
    assert checks == [
        Check("requirement", "near", 0.5, "m", 0.0, True, None, (), JUDGED),
        Check("requirement", "slow", -2.0, "m/s", 0.0, False, 1.5, ("drone[1]",), JUDGED),
    ]
    assert figures == [Figure("preference", "west", -1.0, "m")]


def least(value: float) -> Atom:
    return Atom(ir.Compare(((1.0, ir.Coordinate(0)),), -value, False))


def part(*xs: float) -> Trace:
    """Both side by side, at these x; facing where x says, as fast."""
    across = np.array(xs)
    position = np.stack([np.stack([across, np.full_like(across, y)], axis=-1) for y in (1.0, 3.0)])
    return Trace(Seconds(0.5), position, position * 0.0 + across[:, None], np.stack([across, across]))


def test_whole_requirements_are_judged_over_what_was_flown_and_the_plan_as_one_motion() -> None:
    past, plan = [part(1.0, 2.0), part(2.0, 4.0)], part(4.0, 3.0, 6.0)
    goals = {
        "far": At(1, Eventually(least(5.5), 0, 4)),
        "always": At(1, Always(least(1.5), 1, 4)),
        "dips": At(1, Always(least(3.5), 2, 4)),
        "faces": At(0, Always(Atom(ir.Facing(3.0, 0.25)), 3, 3)),
        "fast": At(0, Always(Atom(ir.Compare(((1.0, ir.Speed()),), -4.0, False)), 2, 2)),
    }
    kernel = Kernel(tuple(Goal(name, formula, SPAN) for name, formula in goals.items()), ())
    found = check_whole(MISSION, kernel, past, plan)
    assert {each.name for each in found} == {"whole requirement"}
    assert [(each.subject, each.passed, each.at) for each in found] == [
        ("far", True, None),
        ("always", True, None),
        ("dips", False, 1.5),
        ("faces", True, None),
        ("fast", True, None),
    ]
    assert found[2].agents == ("drone[1]",)
    assert [each.margin for each in found[:3]] == [0.5, 0.5, -0.5]
    (alone,) = check_whole(
        replace(MISSION, steps=MISSION.steps), Kernel(kernel.requirements[:1], ()), [], part(1, 2, 3, 4, 6)
    )
    assert (alone.passed, alone.margin) == (True, 0.5)


def test_the_least_connectivity_is_a_figure_of_a_graph_that_is_to_be_connected() -> None:
    trace = straight([[[1.0, 1.0]] * 3, [[1.0, 2.0], [1.0, 1.5], [1.0, 2.5]]], 0.5)
    radio = MISSION.graphs[0]

    def figures(*predicates: ir.Predicate, mission: ir.Mission = MISSION) -> list[Figure]:
        goals = tuple(ir.Requirement(str(n), ir.Holds(each, SPAN), SPAN) for n, each in enumerate(predicates))
        return connectivity(replace(mission, requirements=goals), trace)

    # Whoever is named first.
    (found,) = figures(ir.Connected(radio, (1, 0)), ir.Connected(radio, (0, 1)))
    assert (found.name, found.subject, found.unit, found.agents) == (
        "connectivity",
        "radio",
        "lambda_2",
        ("drone[0]", "drone[1]"),
    )
    assert found.value > 0
    close = ir.Proximity("close", Metres(1.0), (0, 1), SPAN)
    (lost,) = figures(ir.Connected(close, (0, 1)))
    # Linked below a metre: not at the steps 0 and 2, of which the first is named.
    assert (lost.value, lost.at) == (0.0, 0.0)
    assert figures(ir.Inside(ir.Region("r", ir.Box((0.0, 0.0), (1.0, 1.0)), SPAN), False)) == []
    assert figures(ir.Connected(radio, (0,))) == []
    there = ir.PairRange(frozenset((0,)), frozenset((1,)), Metres(4.0))
    assert figures(ir.Connected(replace(close, ranges=(there,)), (0, 1))) == []

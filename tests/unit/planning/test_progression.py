"""What is left of a mission after some of its steps: who is lost, where things are by then, and over how many links."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from missionc import ir
from missionc.base.diagnostics.code import NOT_SAID
from missionc.base.source import Source
from missionc.base.trace import Trace
from missionc.base.units import Metres, Seconds
from missionc.compiler.front_end import check
from missionc.compiler.remaining import not_said
from missionc.ir.kernel.nodes import All, Any, Kernel
from missionc.planning.progression.formula_progression import NotProgressableError
from missionc.planning.progression.rest_of_mission import rest_of
from missionc.planning.progression.stretches import Remaining, Stretch, after
from missionc.verification.monitoring.monitor import truth
from tests.support.random_runs import SPAN, trace_of

HEAD = """mission small
time  step 1 s, horizon 6 s
world (0, 0) to (20, 20)
region goal = box (4, 0) to (6, 2)
region dock = box (0, 0) to (2, 2)
team drone[3] { dynamics single_integrator(speed <= 9 m/s)  start line (1, 1) to (3, 1) }
graph radio = proximity 2.5 m
"""


def meant(*lines: str) -> tuple[ir.Mission, Kernel]:
    checked = check(Source("small.mission", HEAD + "\n".join(lines) + "\n"), backend="any")
    assert checked.mission is not None, checked.findings
    assert checked.kernel is not None, checked.findings
    return checked.mission, checked.kernel


def still(mission: ir.Mission, steps: int, *xs: float) -> Trace:
    """Everybody stands on the line y = 1."""
    return trace_of([[(x, 1.0)] * (steps + 1) for x in xs])


def left_of(*lines: str, lost: tuple[str, ...] = (), xs: tuple[float, ...] = (1.0, 2.0, 3.0)) -> Remaining:
    mission, kernel = meant(*lines)
    return after(Remaining(mission, kernel), Stretch(still(mission, 2, *xs), lost), mission)


def test_who_is_lost_is_asked_nothing_more() -> None:
    left = left_of("require all: every drone: eventually[0, end] goal", lost=("drone[1]",))
    assert [agent.name for agent in left.mission.agents] == ["drone[0]", "drone[2]"]
    there = still(left.mission, 4, 5.0, 5.0)
    away = still(left.mission, 4, 5.0, 1.0)
    formula = left.kernel.requirements[0].formula
    assert truth(formula, left.mission, there)[0, 0]
    assert not truth(formula, left.mission, away)[0, 0]


def test_what_the_lost_did_before_counts() -> None:
    left = left_of("require one: some drone: eventually[0, end] goal", lost=("drone[2]",), xs=(1.0, 2.0, 5.0))
    assert isinstance(left.kernel.requirements[0].formula, All)
    assert left.kernel.requirements[0].formula.parts == ()


def test_what_the_lost_only_could_do_still_is_nobodys() -> None:
    left = left_of("require him: drone[1]: eventually[0, end] goal", lost=("drone[1]",))
    assert (left.violated, left.nobodys) == ((), ("him",))


def test_a_promise_that_the_lost_has_kept_so_far_makes_no_some_true() -> None:
    left = left_of("require safe: some drone: always[0, end] dock", lost=("drone[0]",), xs=(1.0, 9.0, 9.0))
    assert left.violated == ("safe",)


def test_what_was_broken_is_broken() -> None:
    left = left_of("require stay: every drone: always[1 s, end] dock")
    assert left.violated == ("stay",)
    assert isinstance(left.kernel.requirements[0].formula, Any)


def test_what_is_given_up_is_gone() -> None:
    mission, kernel = meant("require stay: every drone: always[1 s, end] dock")
    trace = still(mission, 2, 1.0, 2.0, 3.0)
    left = after(Remaining(mission, kernel), Stretch(trace, (), ("stay",)), mission)
    assert left.kernel.requirements == ()
    assert left.violated == ()


@pytest.mark.parametrize(("xs", "holds"), [((1.0, 3.0, 5.0), True), ((1.0, 2.0, 9.0), False)])
def test_routes_that_are_over_lead_to_what_is_still_to_come(xs: tuple[float, float, float], holds: bool) -> None:
    """Two links away there was somebody, then, who comes to the goal now."""
    left = left_of(
        "require told: drone[0]: (not goal or goal) reach[hops 2..2 on radio] (eventually[4 s, 4 s] goal)", xs=xs
    )
    comes = trace_of([[(1.0, 1.0)] * 5, [(1.0, 5.0)] * 5, [(9.0, 9.0)] * 2 + [(5.0, 1.0)] * 3])
    assert truth(left.kernel.requirements[0].formula, left.mission, comes)[0, 0] == holds


def test_routes_in_metres_to_what_is_still_to_come_cannot_be_said() -> None:
    with pytest.raises(NotProgressableError) as raised:
        left_of("require told: drone[0]: (not goal or goal) reach[distance 0..4 on radio] (eventually[4 s, 4 s] goal)")
    assert not_said(raised.value).code is NOT_SAID


def test_obstacles_go_on_from_where_they_are_and_as_large_as_they_have_grown() -> None:
    mission, _ = meant(
        "obstacle mover = disc at (1, 9) radius 1 moving (1 m/s, 0 m/s)",
        "obstacle fire = disc at (9, 9) radius 1 uncertain 0.5 m/s",
        "require r: every drone: eventually[0, end] goal",
    )
    rest = rest_of(mission, 4, np.ones((3, 2)), tuple(agent.name for agent in mission.agents), {})
    mover, fire = rest.obstacles
    assert isinstance(mover.motion, ir.Path)
    assert mover.motion.times == (-4.0, 2.0)
    assert [fire.grown(time) for time in (0.0, 1.0)] == [2.0, 2.5]
    assert rest.steps == mission.steps - 4


def test_graphs_and_formations_are_of_those_that_are_left() -> None:
    everyone = (0, 1, 2)
    edges = (ir.FormationEdge(0, 1, 1.0), ir.FormationEdge(1, 2, 1.0))
    mission, _ = meant("require r: every drone: eventually[0, end] goal")
    chain = ir.Formation("chain", "chain", everyone, edges, Metres(0.5), False, SPAN)
    ranges = (ir.PairRange(frozenset((0,)), frozenset((1, 2)), Metres(3.0)),)
    graph = ir.Proximity("radio", Metres(1.0), everyone, SPAN, ranges)
    mission = replace(mission, formations=(chain,), graphs=(graph,))
    rest = rest_of(mission, 1, np.ones((2, 2)), ("drone[0]", "drone[2]"), {})
    assert rest.formations[0].edges == ()
    assert rest.graphs[0].agents == (0, 1)
    assert rest.graphs[0].ranges[0].receivers == frozenset((1,))


def test_a_stretch_of_other_agents_is_refused() -> None:
    mission, kernel = meant("require r: every drone: eventually[0, end] goal")
    whole = Remaining(mission, kernel)
    for trace in (still(mission, 2, 1.0, 2.0), still(mission, 6, 1.0, 2.0, 3.0)):
        with pytest.raises(ValueError, match="other agents"):
            after(whole, Stretch(replace(trace, step=Seconds(1.0))), mission)

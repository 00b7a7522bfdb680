"""What the checks say is true of every plan: no run of a few steps may prove them wrong."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import combinations_with_replacement, product

import numpy as np
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from missionc import ir
from missionc.base.diagnostics.code import CONTRADICTION, TOO_FAR, VACUOUS, Code
from missionc.base.source import Source
from missionc.base.trace import Trace
from missionc.base.units import Metres, Seconds, Steps
from missionc.compiler.driver import check
from missionc.frontend.checks.check_horizons import check_horizons
from missionc.frontend.checks.check_requirements import check_requirements
from missionc.frontend.checks.check_world import check_world
from missionc.ir.language.operator import Bounds
from missionc.ir.language.operators import by_name
from missionc.ir.language.walk_formulas import formulas_bottom_up
from missionc.ir.lower.expand import expand
from missionc.verification.monitoring.monitor import truths
from tests import reference
from tests.support.random_runs import SPAN, Case, cases, formulas, mission_of


def asked_of_all(case: Case) -> ir.Formula:
    return ir.AtLeastOf("every", len(case.run.mission.agents), case.run.mission.teams[0], case.formula, SPAN)


def codes_of(mission: ir.Mission) -> set[Code]:
    kernel, _ = expand(mission)
    assert kernel is not None
    return {finding.code for finding in (*check_world(mission, kernel), *check_requirements(mission, kernel))}


def as_flown(case: Case, formula: ir.Formula) -> ir.Mission:
    """The mission with the run's first and last places, its top speeds, and bodies without extent."""
    mission = case.run.mission
    agents = tuple(
        replace(
            agent,
            radius=Metres(0.0),
            dynamics=ir.SingleIntegrator(max(math.hypot(*speed) for speed in case.run.velocity[agent.index])),
            start=ir.InitialSet(SPAN, tuple(case.run.position[agent.index][0])),
            finish=ir.InitialSet(SPAN, tuple(case.run.position[agent.index][-1])),
        )
        for agent in mission.agents
    )
    return replace(mission, agents=agents, requirements=(ir.Requirement("asked", formula, SPAN),))


@given(cases())
def test_nothing_is_called_impossible_that_a_run_does_and_nothing_vacuous_that_a_run_breaks(case: Case) -> None:
    formula = asked_of_all(case)
    mission = as_flown(case, formula)
    run = reference.Run(mission, case.run.position, case.run.velocity)
    codes = codes_of(mission)
    if reference.truth(formula, run, 0, 0):
        assert not codes & {CONTRADICTION, TOO_FAR}
    else:
        assert VACUOUS not in codes


@given(cases(), st.data())
def test_two_requirements_contradict_only_where_no_run_has_both(case: Case, data: st.DataObject) -> None:
    """The second is made of the first one's own parts, so that the two often speak of the same predicates."""
    parts = [part for part in formulas_bottom_up((case.formula,)) if isinstance(part, ir.Holds | ir.Apply)]
    assume(parts)
    part = data.draw(st.sampled_from(parts))
    beside = ir.AtLeastOf("some", 1, case.run.mission.teams[0], part, SPAN)
    mission = as_flown(case, asked_of_all(case))
    both = (*mission.requirements, ir.Requirement("beside", beside, SPAN))
    mission = replace(mission, requirements=both)
    run = reference.Run(mission, case.run.position, case.run.velocity)
    if all(reference.truth(requirement.formula, run, 0, 0) for requirement in both):
        assert CONTRADICTION not in codes_of(mission)


def overruns(formula: ir.Formula, step: int, last: int) -> bool:
    """Whether asking the formula at a step looks past the last one, or at no step at all; step by step."""
    if step > last:
        return True
    match formula:
        case ir.Apply(operator, operands, ir.Window(low, int(high))) if operator.bounds is Bounds.PAST:
            asked = range(max(0, step - high), step - low + 1)
            held = range(asked.start + 1, step + 1) if operator.name == "since" and asked else range(0)
            return any(overruns(operands[-1], at, last) for at in asked) or any(
                overruns(operands[0], at, last) for at in held
            )
        case ir.Apply(operator, operands, ir.Window(low, high)):
            until = last if high is None else step + high
            if until > last or step + low > last:
                return True
            held = range(step, until) if operator.name in ("until", "release") else range(0)
            asked = range(step + low, until + 1)
            return any(overruns(operands[-1], at, last) for at in asked) or any(
                overruns(operands[0], at, last) for at in held
            )
        case ir.Apply(_, (body,), ir.Period(period)):
            return step + period > last or any(overruns(body, at, last) for at in range(step, last + 1))
        case ir.Apply(operator, operands):
            at = step + (operator.name == "next")
            return any(overruns(operand, at, last) for operand in operands)
        case ir.AtLeastOf() | ir.OfAgent():
            return overruns(formula.body, step, last)
        case ir.Without():
            return any(overruns(case, step, last) for case in formula.cases)
        case _:
            return False


@given(st.data(), st.integers(1, 5), st.integers(0, 4))
def test_a_horizon_is_refused_exactly_where_a_formula_looks_past_it(data: st.DataObject, steps: int, more: int) -> None:
    mission = mission_of(2, steps)
    formula = data.draw(formulas(2, steps + more, 4))
    mission = replace(mission, requirements=(ir.Requirement("asked", formula, SPAN),))
    assert bool(check_horizons(mission)) == overruns(formula, 0, steps)


# --------------------------------------------------------------------- goals


@dataclass(frozen=True)
class Goal:
    """A predicate, a place that only just has it, and the way straight out from there; ``radius`` of the body."""

    predicate: ir.Predicate
    border: ir.Vector
    outward: ir.Vector
    radius: float = 0.0


def region(shape: ir.Shape) -> ir.Region:
    return ir.Region("goal", shape, SPAN)


def below(feature: ir.Feature, most: float) -> ir.Compare:
    return ir.Compare(((-1.0, feature),), most, strict=False)


CUBE = ir.Box((5.0, 5.0, 5.0), (6.0, 7.0, 6.0))
SQUARE = ir.Box((5.0, 5.0), (6.0, 7.0))
DISC = ir.Disc((5.5, 6.0), 1.0)
SLANTED = (0.6, 0.8)
GOALS_IN_THE_PLANE = (
    Goal(ir.Inside(region(SQUARE), body=False), (5.0, 5.5), (-1.0, 0.0)),
    Goal(ir.Inside(region(SQUARE), body=False), (5.0, 5.0), (-0.6, -0.8)),
    Goal(ir.Inside(region(SQUARE), body=True), (5.25, 6.0), (-1.0, 0.0), radius=0.25),
    Goal(ir.Touches(region(SQUARE)), (4.75, 6.0), (-1.0, 0.0), radius=0.25),
    Goal(ir.Inside(region(DISC), body=False), (6.1, 6.8), SLANTED),
    Goal(ir.Touches(region(DISC)), (6.25, 7.0), SLANTED, radius=0.25),
    Goal(ir.Inside(region(ir.Union(SQUARE, DISC)), body=False), (5.5, 7.0), (0.0, 1.0)),
    Goal(ir.Inside(region(ir.Difference(SQUARE, ir.Box((5.0, 5.0), (5.5, 8.0)))), body=False), (5.5, 6.0), (-1.0, 0.0)),
    Goal(
        ir.Inside(region(ir.Intersection(SQUARE, ir.Box((4.0, 6.0), (8.0, 8.0)))), body=False), (5.5, 6.0), (0.0, -1.0)
    ),
    Goal(below(ir.DistanceTo(region(SQUARE)), 0.5), (4.5, 6.0), (-1.0, 0.0)),
    Goal(below(ir.DistanceTo(region(SQUARE)), -0.25), (5.25, 6.0), (-1.0, 0.0)),
    Goal(below(ir.DistanceTo(ir.Beacon("mast", (5.0, 5.0), SPAN)), 0.5), (5.3, 5.4), SLANTED),
    Goal(below(ir.Coordinate(0), 5.0), (5.0, 6.0), (1.0, 0.0)),
)
GOALS_IN_A_VOLUME = (
    Goal(ir.Inside(region(CUBE), body=False), (5.5, 6.0, 5.0), (0.0, 0.0, -1.0)),
    Goal(ir.Inside(region(CUBE), body=False), (5.0, 5.0, 5.5), (-0.6, -0.8, 0.0)),
    Goal(ir.Touches(region(CUBE)), (5.5, 6.0, 4.75), (0.0, 0.0, -1.0), radius=0.25),
    Goal(ir.Inside(region(ir.Ball((5.0, 5.0, 5.0), 1.5)), body=False), (4.0, 4.0, 4.5), (-2 / 3, -2 / 3, -1 / 3)),
    Goal(ir.Inside(region(ir.Disc((5.0, 5.0), 1.0, ir.Prism(4.0, 6.0))), body=False), (5.6, 5.8, 6.0), (0.0, 0.0, 1.0)),
    Goal(below(ir.DistanceTo(region(ir.Ball((5.0, 5.0, 5.0), 1.0))), 0.5), (4.0, 4.0, 4.5), (-2 / 3, -2 / 3, -1 / 3)),
    Goal(below(ir.Altitude(), 5.0), (5.0, 6.0, 5.0), (0.0, 0.0, 1.0)),
)


@dataclass(frozen=True)
class Journey:
    """A mission of agents that fly straight to a goal's border, to be there at its last step and no sooner."""

    mission: ir.Mission
    goal: Goal
    away: float


@st.composite
def journeys(draw: st.DrawFn) -> Journey:
    """Starts are up to 2 m straight out from the goal's border, and the top speed is exactly what the way needs."""
    goal = draw(st.sampled_from(GOALS_IN_THE_PLANE + GOALS_IN_A_VOLUME))
    size, steps = draw(st.integers(1, 3)), draw(st.integers(1, 6))
    away = draw(st.sampled_from([0.1, 0.5, 1.0, 2.0]))
    start = tuple(place + away * out for place, out in zip(goal.border, goal.outward, strict=True))
    mission = mission_of(size, steps)
    speed = math.dist(start, goal.border) / steps
    around = draw(st.booleans())
    low, high = (tuple(place + side * 0.25 for place in start) for side in (-1, 1))
    place = ir.InitialSet(SPAN, region=region(ir.Box(low, high))) if around else ir.InitialSet(SPAN, start)
    agents = tuple(
        replace(agent, radius=Metres(goal.radius), dynamics=ir.SingleIntegrator(speed), start=place)
        for agent in mission.agents
    )
    world = ir.World((0.0,) * len(start), (10.0,) * len(start), SPAN)
    return Journey(replace(mission, agents=agents, world=world, graphs=(), formations=()), goal, away)


def arrives(data: st.DataObject, formula: ir.Formula, steps: int) -> ir.Formula:
    """A formula that is true of an agent which has the one given ``steps`` ahead."""
    if steps > 1 and data.draw(st.booleans()):
        before = data.draw(st.integers(1, steps - 1))
        return arrives(data, arrives(data, formula, steps - before), before)
    low = data.draw(st.integers(0, steps))
    window, point = ir.Window(Steps(low), Steps(steps), SPAN), ir.Window(Steps(steps), Steps(steps), SPAN)
    true = ir.Truth(True, SPAN)
    return data.draw(
        st.sampled_from(
            [
                ir.Apply(by_name["eventually"], (formula,), window, SPAN),
                ir.Apply(by_name["until"], (true, formula), window, SPAN),
                ir.Apply(by_name["always"], (formula,), point, SPAN),
                ir.Apply(by_name["release"], (ir.Truth(False, SPAN), formula), point, SPAN),
            ]
        )
    )


def requiring(mission: ir.Mission, formula: ir.Formula) -> ir.Mission:
    return replace(mission, requirements=(ir.Requirement("asked", formula, SPAN),))


@given(journeys(), st.data())
def test_no_goal_is_called_out_of_reach_that_agents_reach_in_the_last_moment(
    journey: Journey, data: st.DataObject
) -> None:
    mission = journey.mission
    size = len(mission.agents)
    there = ir.Holds(journey.goal.predicate, SPAN)
    number = data.draw(st.integers(1, size))
    of_some = ir.AtLeastOf("at least", number, mission.teams[0], arrives(data, there, mission.steps), SPAN)
    at_once = arrives(data, ir.AtLeastOf("every", size, mission.teams[0], there, SPAN), mission.steps)
    mission = requiring(mission, data.draw(st.sampled_from([of_some, at_once])))
    codes = codes_of(mission)
    assert not codes & {TOO_FAR, CONTRADICTION}


@given(journeys(), st.sampled_from(["every", "some"]))
def test_a_goal_just_out_of_reach_is_found(journey: Journey, kind: str) -> None:
    mission = journey.mission
    size, agents = len(mission.agents), mission.agents
    # Circles are bounded from outside, so "just" is a centimetre here; a volume is cut in slices, which miss more.
    assume(agents[0].start.point is not None and mission.dimension == 2)
    slower = ir.SingleIntegrator((journey.away - 0.01) / mission.steps)
    mission = replace(mission, agents=tuple(replace(agent, dynamics=slower) for agent in agents))
    window = ir.Window(Steps(0), mission.steps, SPAN)
    there = ir.Apply(by_name["eventually"], (ir.Holds(journey.goal.predicate, SPAN),), window, SPAN)
    number = size if kind == "every" else 1
    mission = requiring(mission, ir.AtLeastOf(kind, number, mission.teams[0], there, SPAN))
    assert TOO_FAR in codes_of(mission)


@given(journeys())
def test_a_finish_is_out_of_reach_only_where_it_is(journey: Journey) -> None:
    mission = journey.mission
    finish = ir.InitialSet(SPAN, journey.goal.border)
    agents = tuple(replace(agent, finish=finish) for agent in mission.agents)
    assert TOO_FAR not in codes_of(replace(mission, agents=agents))
    if agents[0].start.point is not None:
        assert isinstance(agents[0].dynamics, ir.SingleIntegrator)
        slower = ir.SingleIntegrator(agents[0].dynamics.speed * 0.99)
        agents = tuple(replace(agent, dynamics=slower) for agent in agents)
        assert TOO_FAR in codes_of(replace(mission, agents=agents))


# ------------------------------------------------- all runs of a small mission

LASTS = 3
SMALL = f"""
mission small
time step 1 s, horizon {LASTS} s
world (0, 0) to (10, 10)
region anywhere = box (0, 0) to (10, 10)
region a = box (4, 0) to (6, 10)
team r[2] {{ radius 0.1 m  dynamics single_integrator(speed <= 20 m/s)  start in anywhere }}
"""
BESIDE, WITHIN = ((2.0, 2.0), (2.0, 8.0)), ((5.0, 2.0), (5.0, 8.0))


def windowed(draw: st.DrawFn, left: int, make: Callable[[int], str]) -> str:
    """A window over what ``make`` makes with the steps that are left."""
    low = draw(st.integers(0, left))
    high = draw(st.integers(low, left))
    word = draw(st.sampled_from(("always", "eventually")))
    return f"{word}[{low} s, {high} s] ({make(left - high)})"


@st.composite
def of_one(draw: st.DrawFn, left: int = LASTS, depth: int = 2) -> str:
    """A formula about one agent that looks no more than so many steps ahead."""
    if depth == 0:
        return draw(st.sampled_from(("a", "not a")))

    def part(left: int) -> str:
        return draw(of_one(left, depth - 1))

    match draw(st.sampled_from(("window", "window", "and", "or", "a"))):
        case "window":
            return windowed(draw, left, part)
        case "a":
            return draw(st.sampled_from(("a", "not a")))
        case word:
            return f"({part(left)}) {word} ({part(left)})"


@st.composite
def of_team(draw: st.DrawFn, left: int = LASTS, depth: int = 2) -> str:
    """One about the team, that counts agents within windows and windows within counts."""

    def part(left: int) -> str:
        return draw(of_team(left, depth - 1))

    match draw(st.sampled_from(("count", "count", "window", "and", "not"))) if depth else "count":
        case "count":
            return f"{draw(st.sampled_from(('every r', 'some r', 'at least 2 r')))}: {draw(of_one(left))}"
        case "window":
            return windowed(draw, left, part)
        case "not":
            return f"not ({part(left)})"
        case _:
            return f"({part(left)}) and ({part(left)})"


def all_runs() -> Iterator[Trace]:
    """Every way in which two agents can be in ``a`` or beside it at each step.

    The formulas count agents and name none: which of the two goes which way is the same to them, and left out.
    """
    ways = list(product((BESIDE, WITHIN), repeat=LASTS + 1))
    for choice in combinations_with_replacement(ways, 2):
        position = np.array([[where[agent] for where in way] for agent, way in enumerate(choice)])
        yield Trace(Seconds(1.0), position, np.zeros_like(position), np.zeros(position.shape[:2]))


@settings(max_examples=400)
@given(of_team(), of_team())
@example("always[0 s, 3 s] (not (at least 2 r: a))", "at least 2 r: eventually[0 s, 3 s] a")
@example("always[0 s, 3 s] (some r: not a)", "every r: eventually[1 s, 2 s] a")
def test_requirements_that_contradict_are_kept_by_no_run_at_all(one: str, other: str) -> None:
    checked = check(Source("small.mission", f"{SMALL}require one: {one}\nrequire other: {other}\n"))
    if not any(finding.code is CONTRADICTION for finding in checked.findings):
        return
    assert checked.mission is not None
    kernel, _ = expand(checked.mission)
    assert kernel is not None
    goals = [goal.formula for goal in kernel.requirements]
    for run in all_runs():
        kept = (truths([goal], checked.mission, run)[goal][0, 0] for goal in goals)
        assert not all(kept), run.position.tolist()

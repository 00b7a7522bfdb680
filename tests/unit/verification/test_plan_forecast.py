"""Forecasts by a plan: what was flown up to now and the plan after it, asked again after so many steps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from missionc import ir
from missionc.base.trace import Array, Trace
from missionc.base.units import Metres, Seconds
from missionc.ir.kernel.nodes import All, Always, At, Atom, Goal, Is, Kernel, Neighbour, PathLength, Reach, Route
from missionc.verification.monitoring.live import session
from missionc.verification.monitoring.live.first_violations import first_violations
from missionc.verification.monitoring.live.samples import StepState
from missionc.verification.monitoring.live.session import PlanForecast
from tests.support.random_runs import SPAN, mission_of

STEPS = 4
RADIO = ir.Proximity("radio", Metres(2.0), (0, 1), SPAN)
MISSION = replace(mission_of(2, STEPS), step=Seconds(0.5))


def goal(name: str, body: object) -> Goal:
    return Goal(name, At(0, Always(body, 0, STEPS)), SPAN)  # type: ignore[arg-type]


EAST = goal("east", Atom(ir.Compare(((1.0, ir.Coordinate(0)),), 0.0, False)))
SLOW = goal("slow", Atom(ir.Compare(((-1.0, ir.Speed()),), 2.0, False)))
FACES = goal("faces", Atom(ir.Facing(0.0, 1.0)))
NEAR = goal("near", Neighbour(RADIO, All(())))
KERNEL = Kernel((EAST, SLOW, FACES), (NEAR,))


def along(x: list[float], other: list[float]) -> Array:
    rows = np.array([x, other])
    return np.stack([rows, np.zeros_like(rows)], axis=-1)


PLAN = Trace(
    Seconds(0.5),
    along([1.0, 2.0, 3.0, 4.0, 5.0], [2.5, 3.5, 4.5, 5.5, 6.5]),
    np.full((2, STEPS + 1, 2), 0.5),
    np.full((2, STEPS + 1), 0.25),
)


def state(step: int, x: float, other: float, speed: float = 0.0, heading: float = 0.0, missing: int = -1) -> StepState:
    places, velocity = np.array([(x, 0.0), (other, 0.0)]), np.array([(speed, 0.0), (0.0, 0.0)])
    lost = () if missing < 0 else (missing,)
    return StepState(step, places, velocity, np.full(2, heading), np.zeros(2), lost)


def test_what_was_flown_stands_in_the_place_of_the_plan() -> None:
    forecast = PlanForecast(MISSION, KERNEL, PLAN)
    fast = float(np.hypot(0.5, 0.5))
    # Half a metre of two is left of the link; the plan faces a quarter of a radian aside.
    expected = {0: 1.0, 1: 2.0 - fast, 2: 0.75, 3: 0.5}
    assert forecast.take(state(0, 1.0, 2.5), range(4)) == pytest.approx(expected)
    flown = forecast.take(state(1, 0.75, 2.0, speed=1.5, heading=0.5), range(4))
    assert flown == pytest.approx({0: 0.75, 1: 0.5, 2: 0.5, 3: 0.5})
    # It went the other way for a moment, too far from the other one.
    away = forecast.take(state(2, 0.5, 3.0, speed=1.0), range(4))
    assert away == pytest.approx({0: 0.5, 1: 0.5, 2: 0.5, 3: -0.5})


def test_who_is_missing_is_where_it_is_planned_to_be() -> None:
    forecast = PlanForecast(MISSION, KERNEL, PLAN)
    gone = forecast.take(state(0, -9.0, 2.5, speed=9.0, heading=3.0, missing=0), range(4))
    assert gone == pytest.approx({0: 1.0, 1: 2.0 - float(np.hypot(0.5, 0.5)), 2: 0.75, 3: 0.5})
    other = forecast.take(state(1, 2.0, 9.0, missing=1), [3])
    assert other == pytest.approx({3: 0.5})


def test_the_plan_itself_stays_as_it_is_and_only_what_is_open_is_forecast() -> None:
    forecast = PlanForecast(MISSION, KERNEL, PLAN)
    assert forecast.take(state(0, 9.0, 9.0), []) == {}
    assert list(forecast.take(state(1, 9.0, 9.0), [3, 1])) == [3, 1]
    assert PLAN.position[0, 0, 0] == 1.0
    assert forecast.trace.step == 0.5
    assert PLAN.velocity[0, 0, 0] == 0.5
    assert PLAN.heading[0, 0] == 0.25


def test_routes_are_asked_again_where_something_changed() -> None:
    """A link is lost and found again; lengths change as places do; who counts changes too."""
    everybody, second = All(()), Is(frozenset((1,)))
    bodies = {
        "reach": Reach(RADIO, everybody, second, 1),
        "route": Route(RADIO, everybody, second, 0.0, 1.75),
        "way": PathLength(RADIO, 1, 0.0, 1.75),
        "east": Neighbour(RADIO, Atom(ir.Compare(((1.0, ir.Coordinate(0)),), -2.0, False))),
    }
    kernel = Kernel(tuple(goal(name, body) for name, body in bodies.items()), ())
    forecast = PlanForecast(MISSION, kernel, PLAN)
    assert forecast.take(state(0, 1.0, 2.5), range(4)) == pytest.approx({0: 0.5, 1: 0.25, 2: 0.25, 3: 0.5})
    # A quarter of a metre nearer, and then further: 1.25 m, and 1.875 m.
    assert forecast.take(state(1, 2.25, 3.5), range(4)) == pytest.approx({0: 0.5, 1: 0.25, 2: 0.25, 3: 0.5})
    lost = forecast.take(state(2, 2.625, 4.5), range(4))
    assert lost == pytest.approx({0: 0.125, 1: -0.125, 2: -0.125, 3: 0.125})
    assert forecast.take(state(3, 4.0, 5.5), range(4)) == pytest.approx(lost)


def test_forecasts_are_so_many_as_a_share_of_a_core_allows(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two formulas of ten values, each a hundredth of a second: a fifth of one, four times a tenth of a step."""
    kernel = Kernel((EAST,), ())
    assert PlanForecast(MISSION, kernel, PLAN).every == 1
    monkeypatch.setattr(session, "SECONDS", 0.01)
    forecast = PlanForecast(MISSION, kernel, PLAN)
    assert forecast.every == 4
    assert forecast.take(state(0, 0.75, 2.5), [0]) == {0: 0.75}
    assert forecast.take(state(1, 0.5, 2.5), [0]) == {0: 0.75}
    assert forecast.take(state(2, 0.5, 2.5), []) == {}
    assert forecast.take(state(3, 0.5, 2.5), [0]) == {}
    assert forecast.take(state(4, 0.25, 2.5), [0]) == {0: 0.25}
    monkeypatch.setattr(session, "SECONDS", 0.02)
    last = PlanForecast(MISSION, kernel, PLAN)
    assert last.every == 8
    assert last.take(state(0, 0.75, 2.5), [0]) == {0: 0.75}
    assert last.take(state(3, 0.5, 2.5), [0]) == {0: 0.75}
    assert last.take(state(4, 0.25, 2.5), [0]) == {0: 0.25}


def test_the_first_violation_of_each_goal_is_that_of_its_step() -> None:
    flown = Trace(
        Seconds(0.5),
        along([1.0, 1.0, -1.0, 1.0, -1.0], [2.5] * 5),
        np.array([[(0.0, 0.0), (3.0, 0.0), (3.0, 0.0), (0.0, 0.0), (0.0, 0.0)], [(0.0, 0.0)] * 5]),
        np.array([[0.0, 0.0, 0.0, 2.0, 2.0], [0.0] * 5]),
    )
    assert first_violations(MISSION, KERNEL, flown) == {"slow": 1, "east": 2, "near": 2, "faces": 3}
    still = replace(flown, position=along([1.0] * 5, [2.5] * 5), velocity=np.zeros((2, 5, 2)), heading=np.zeros((2, 5)))
    assert first_violations(MISSION, KERNEL, still) == {}

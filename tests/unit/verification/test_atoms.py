"""Signs of margins along motions of a second, in steps of half a second: most borders are met after one of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from missionc import ir
from missionc.base.trace import Array, Indices, Trace
from missionc.base.units import Metres, Seconds
from missionc.geometry.curves.piecewise_polynomials import Curves
from missionc.ir.predicates import (
    Altitude,
    Compare,
    Coordinate,
    DistanceBetween,
    DistanceTo,
    Facing,
    Feature,
    Flagged,
    InFormation,
    Inside,
    Level,
    Predicate,
    Speed,
    Touches,
)
from missionc.verification.between import atoms
from missionc.verification.between.atoms import atom_signals, link_signals
from missionc.verification.between.interval_sets import STEP, Motion, Signal
from tests.support.random_runs import SPAN, mission_of

END = 2 * STEP
ALWAYS, NEVER, OPEN = Signal(((0, END),), ()), Signal((), ((0, END),)), Signal((), ())
BIT = STEP >> 13
"""The shortest stretch: the first half of a half of … a step that lasts no longer than a ten-thousandth of a second."""
EARLY, LATE = Signal(((0, STEP - BIT),), ((STEP + BIT, END),)), Signal(((STEP + BIT, END),), ((0, STEP - BIT),))
"""So up to one step, and from one step on."""


def moving(*paths: tuple[float, float, float, float], trace: Trace | None = None) -> Motion:
    """Agents from (x, y) at (vx, vy), m/s."""
    mission = replace(mission_of(len(paths), 2), step=Seconds(0.5))
    rows = [[[[x, v], [y, w]]] for x, y, v, w in paths]
    return Motion(mission, Curves(np.array([0.0, 1.0]), np.array(rows, dtype=np.float64)), trace)


# Who stays at (0, 0), and who leaves (1, 0) along the x axis.
LEAVING = moving((0, 0, 0, 0), (1, 0, 2, 0))


def signals(predicate: Predicate, motion: Motion, *agents: int) -> list[Signal]:
    return atom_signals(predicate, np.array(agents, dtype=np.int64), motion)


def least(value: float, feature: Feature) -> Compare:
    return Compare(((1.0, feature),), -value, False)


def most(value: float, feature: Feature) -> Compare:
    return Compare(((-1.0, feature),), value, False)


# ------------------------------------------------------------ of a predicate


def test_a_coordinate_is_past_a_border_from_when_it_gets_there() -> None:
    assert signals(least(2.0, Coordinate(0)), LEAVING, 1, 0) == [LATE, NEVER]
    assert signals(most(2.0, Coordinate(0)), LEAVING, 0, 1) == [ALWAYS, EARLY]
    both = Compare(((3.0, Coordinate(0)), (4.0, Coordinate(1))), -6.0, False)
    assert signals(both, LEAVING, 1) == [LATE]


def test_a_region_is_left_by_the_centre_or_by_the_body() -> None:
    region = ir.Region("hall", ir.Box((-9.0, -9.0), (2.0, 9.0)), SPAN)
    narrow, wide = (ir.Region("hall", ir.Box((-9.0, -9.0), (high, 9.0)), SPAN) for high in (1.75, 2.25))
    leaving = replace(LEAVING, mission=replace(LEAVING.mission, agents=_sized(LEAVING.mission, 0.75, 0.25)))
    assert signals(Inside(region, body=False), leaving, 1) == [EARLY]
    assert signals(Inside(wide, body=True), leaving, 0, 1) == [ALWAYS, EARLY]
    assert signals(Touches(narrow), leaving, 1) == [EARLY]


def _sized(mission: ir.Mission, *radii: float) -> tuple[ir.Agent, ...]:
    return tuple(replace(agent, radius=Metres(radius)) for agent, radius in zip(mission.agents, radii, strict=True))


def test_a_distance_changes_as_fast_as_two_move_apart() -> None:
    # 4 m and 2 m a second the same way: their distance grows from 1 m by 2 m.
    together = moving((0, 0, 2, 0), (1, 0, 4, 0), (9, 9, 0, 0))
    assert signals(most(2.0, DistanceTo(1)), together, 0, 2) == [EARLY, NEVER]
    assert signals(most(2.0, DistanceBetween(0, 1)), together, 2, 0) == [EARLY]
    # Side by side nothing changes: no stretch has to be halved.
    beside = moving((0, 0, 8, 8), (1, 0, 8, 8))
    assert signals(least(1.0 - 1e-6, DistanceBetween(0, 1)), beside, 0) == [ALWAYS]
    assert signals(most(1.0 - 1e-6, DistanceTo(1)), beside, 0) == [NEVER]


def test_a_beacon_is_as_far_as_one_has_gone() -> None:
    assert signals(least(2.0, DistanceTo(ir.Beacon("mast", (0.0, 0.0), SPAN))), LEAVING, 0, 1) == [NEVER, LATE]


def test_a_formation_is_lost_as_two_move_apart() -> None:
    row = ir.Formation("row", "chain", (0, 1), (ir.FormationEdge(0, 1, 1.0),), Metres(1.0), False, SPAN)
    assert signals(InFormation(row), LEAVING, 0, 1) == [EARLY]


def test_a_speed_changes_with_the_acceleration() -> None:
    # 1 + 2 t m/s, in three pieces.
    mission = replace(mission_of(2, 2), step=Seconds(0.5))
    fast = [[[begin, speed, 1], [0, 0, 0]] for begin, speed in ((0, 1), (0.3125, 1.5), (1.3125, 2.5))]
    rows = np.array([[[[0, 0, 0], [5, 0, 0]]] * 3, fast], dtype=np.float64)
    curves = Curves(np.array([0.0, 0.25, 0.75, 1.0]), rows)
    assert signals(least(2.0, Speed()), Motion(mission, curves), 1, 0) == [LATE, NEVER]


def test_an_altitude_in_a_plane_is_not_changed_by_any_motion() -> None:
    """Its border is known exactly, however small what is missing."""
    high = replace(LEAVING.mission.agents[1], altitude=Metres(2.0))
    motion = replace(LEAVING, mission=replace(LEAVING.mission, agents=(LEAVING.mission.agents[0], high)))
    assert signals(least(1.0, Altitude()), motion, 0, 1) == [ALWAYS, ALWAYS]
    assert signals(least(2.0, Altitude()), motion, 0, 1) == [NEVER, ALWAYS]
    assert signals(replace(least(1.0, Altitude()), strict=True), motion, 0, 1) == [NEVER, ALWAYS]
    assert signals(least(1.0 + 1e-12, Altitude()), motion, 0) == [NEVER]
    assert signals(least(1.0 - 1e-12, Altitude()), motion, 0) == [ALWAYS]
    assert signals(Compare((), 0.0, False), motion, 0) == [ALWAYS]
    assert signals(Compare((), 0.0, True), motion, 0) == [NEVER]


def test_a_border_that_rounding_decides_is_open() -> None:
    assert signals(least(1.0, DistanceBetween(0, 1)), moving((0, 0, 1, 0), (1, 0, 1, 0)), 0) == [OPEN]
    assert signals(least(1e-12, Coordinate(0)), LEAVING, 0) == [OPEN]
    assert signals(most(1e-12, Coordinate(0)), LEAVING, 0) == [OPEN]


def test_who_rests_exactly_on_a_border_is_on_its_side_throughout() -> None:
    """As at the step: within what is closed, outside what is open; the other one moves along the border."""
    along = moving((0, 0, 0, 0), (0, 0, 1, 0))
    assert signals(most(0.0, Coordinate(0)), along, 0) == [ALWAYS]
    assert signals(Compare(((1.0, Coordinate(0)),), 0.0, True), along, 0) == [NEVER]
    hall = ir.Region("hall", ir.Box((0.0, 0.0), (9.0, 9.0)), SPAN)
    assert signals(Inside(hall, body=False), along, 0, 1) == [ALWAYS, OPEN]
    here, there = np.array([0]), np.array([1])
    radio = ir.Proximity("radio", Metres(1.0), (0, 1), SPAN)
    assert link_signals(radio, here, there, moving((0, 0, 0, 0), (1, 0, 0, 0))) == [NEVER]
    assert link_signals(radio, here, there, moving((0, 0, 0, 1), (1, 0, 0, 1))) == [OPEN]


def test_a_level_changes_evenly_between_steps() -> None:
    """The second one uses 2 of its 10 in the first step and then nothing."""
    fuel = ir.Resource("fuel", (0, 1), 10.0, 10.0, 0.0, 2.0, (), SPAN)
    places = np.array([[(0, 0)] * 3, [(1, 0), (2, 0), (2, 0)]], dtype=np.float64)
    trace = Trace(Seconds(0.5), places, np.zeros_like(places), np.zeros((2, 3)))
    motion = moving((0, 0, 0, 0), (1, 0, 2, 0), trace=trace)
    half = Signal(((0, STEP // 2 - BIT),), ((STEP // 2 + BIT, END),))
    assert signals(least(9.0, Level(fuel)), motion, 0, 1) == [ALWAYS, half]


# -------------------------------------------------- of what changes at steps


def test_a_flag_is_what_it_was_at_the_step_before() -> None:
    """A moment at which it jumps belongs to what begins; the last step is a moment of its own."""
    here, there = (ir.Region(name, ir.Box((low, -1.0), (low + 1.0, 1.0)), SPAN) for name, low in (("a", 0), ("b", 4)))
    flag = ir.Flag("wet", (0, 1), here, there, SPAN)
    places = np.array([[(0, 0), (4, 0), (0, 0)], [(2, 0), (0, 0), (2, 0)], [(0, 0)] * 3], dtype=np.float64)
    trace = Trace(Seconds(0.5), places, np.zeros_like(places), np.zeros((3, 3)))
    motion = moving((0, 0, 0, 0), (0, 0, 0, 0), (0, 0, 0, 0), trace=trace)
    assert signals(Flagged(flag), motion, 2, 0, 1) == [
        NEVER,
        Signal(((0, STEP - 1), (END, END)), ((STEP, END - 1),)),
        Signal(((STEP, END),), ((0, STEP - 1),)),
    ]


def facing(*headings: list[float]) -> Motion:
    places = np.zeros((len(headings), 3, 2))
    trace = Trace(Seconds(0.5), places, places, np.array(headings))
    return moving(*[(0, 0, 2, 0)] * len(headings), trace=trace)


def test_a_heading_is_that_of_the_step_before() -> None:
    motion = facing([0.0, 1.0, 0.0], [1.0, 0.1, 0.1])
    assert signals(Facing(0.0, 0.5), motion, 1, 0) == [
        Signal(((STEP, END),), ((0, STEP - 1),)),
        Signal(((0, STEP - 1), (END, END)), ((STEP, END - 1),)),
    ]


def test_who_faces_a_place_may_turn_at_steps_and_get_past_it_between_them() -> None:
    """The mast is a metre ahead at first and behind from half a second on; the second one turns round there."""
    mast = ir.Beacon("mast", (1.0, 0.0), SPAN)
    ahead, back = signals(Facing(mast, 0.5), facing([0.0, 0.0, 0.0], [0.0, np.pi, np.pi]), 0, 1)
    assert ahead == Signal(((0, STEP - BIT),), ((STEP + BIT, END),))
    assert back == Signal(((0, STEP - BIT), (STEP + BIT, END)), ())


# ------------------------------------------------------------------ of links


def linked(graph: ir.Graph, motion: Motion, *pairs: tuple[int, int]) -> list[Signal]:
    first, second = (np.array([pair[end] for pair in pairs], dtype=np.int64) for end in (0, 1))
    return link_signals(graph, first, second, motion)


def test_a_link_is_lost_as_two_move_apart() -> None:
    radio = ir.Proximity("radio", Metres(2.0), (0, 1), SPAN)
    assert linked(radio, LEAVING, (0, 1), (1, 0)) == [EARLY, EARLY]
    assert linked(radio, moving((0, 0, 8, 8), (2 - 1e-6, 0, 8, 8)), (0, 1)) == [ALWAYS]


def test_a_beacon_serves_two_as_long_as_either_is_near() -> None:
    cell = ir.BeaconCover("cell", Metres(2.0), ((0.0, 0.0),), (0, 1), SPAN)
    assert linked(cell, LEAVING, (0, 1), (1, 0)) == [EARLY, EARLY]
    beside = moving((1, 0, 2, 0), (1, 0, 2, 0))
    assert linked(cell, beside, (0, 1)) == [EARLY]


def test_a_sight_is_lost_to_what_two_pass_side_by_side() -> None:
    """A wall from 1 m to 1.5 m along their way stands between them, for a quarter of a second."""
    eyes = ir.Sight("eyes", Metres(9.0), (ir.Box((1.0, 0.4), (1.5, 0.6)),), (0, 1), SPAN)
    beside = moving((0, 0, 2, 0), (0, 1, 2, 0))
    end = 3 * STEP // 2
    (found,) = linked(eyes, beside, (0, 1))
    assert found == Signal(((0, STEP - BIT), (end + BIT, END)), ((STEP + BIT, end - BIT),))
    near = replace(eyes, radius=Metres(2.0))
    assert linked(near, LEAVING, (0, 1)) == [EARLY]


# ------------------------------------------------------------------ of signs


def signs(*margins: Callable[[Array], Array], rate: float = 1.0) -> tuple[list[Signal], int]:
    """When margins as functions of a second hold, and how many stretches were looked at."""
    looked = 0

    def margin(item: Indices, piece: Indices, local: Array) -> Array:
        nonlocal looked
        looked += item.size
        return np.array([margins[each](second) for each, second in zip(item, local, strict=True)])

    rates = np.full((len(margins), 1), rate)
    return atoms._signals(margin, rates, LEAVING, -1, np.zeros(rates.shape, dtype=np.bool_), LEAVING.slack), looked


def before_half(second: Array) -> Array:
    return 0.5 - second


def beyond_half(second: Array) -> Array:
    return second - 0.5


def nothing(second: Array) -> Array:
    return 0.0 * second


def test_a_margin_that_changes_by_a_metre_a_second_is_looked_at_where_it_is_small() -> None:
    found, looked = signs(before_half, beyond_half)
    assert found == [EARLY, LATE]
    # The whole, and then the four parts of each two that lie at its middle, down to a 2^13th of a step.
    assert looked == 2 * (1 + 2 + 13 * 4)


def test_what_cannot_change_is_looked_at_once() -> None:
    assert signs(nothing, rate=0.0) == ([OPEN], 1)
    assert signs(lambda second: nothing(second) + 1e-6, rate=0.0) == ([ALWAYS], 1)
    assert signs(lambda second: nothing(second) - 1e-6, rate=0.0) == ([NEVER], 1)


def test_stretches_are_looked_at_a_few_at_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = signs(before_half, beyond_half, before_half)
    for chunk in (1, 2, 3):
        monkeypatch.setattr(atoms, "CHUNK", chunk)
        assert signs(before_half, beyond_half, before_half) == whole


def test_after_so_many_stretches_nothing_more_is_decided(monkeypatch: pytest.MonkeyPatch) -> None:
    def found(most: int) -> tuple[list[Signal], int]:
        monkeypatch.setattr(atoms, "EVALUATIONS", most)
        return signs(before_half)

    assert [found(most) for most in (0, 1, 2)] == [([OPEN], 1), ([OPEN], 3), ([OPEN], 3)]
    half = STEP // 2
    assert found(3) == ([Signal(((0, half),), ((3 * half, END),))], 7)


def test_a_moment_of_two_signs_is_of_what_begins() -> None:
    joined = partial(atoms._joined, 1, np.zeros(2, dtype=np.int64))
    low, high, sign = np.array([5, 5]), np.array([9, 5]), np.array([-1, 1])
    assert joined(low, high, sign) == [Signal((), ((5, 9),))]
    assert joined(np.array([5, 0]), np.array([9, 5]), sign) == [Signal(((0, 4),), ((5, 9),))]
    assert joined(np.array([5, 0]), np.array([9, 5]), -sign) == [Signal(((5, 9),), ((0, 4),))]
    assert joined(np.array([5, 0]), np.array([9, 5]), np.array([1, 1])) == [Signal(((0, 9),), ())]
    assert joined(np.array([5, 0]), np.array([9, 5]), np.array([1, 0])) == [Signal(((5, 9),), ())]

"""Enclosures hold what exact arithmetic says, however the numbers are scaled; and they hold little else."""

from __future__ import annotations

from fractions import Fraction
from math import comb

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missionc.geometry.curves.bernstein_intervals import Enclosed, derivative, from_powers, root_above, root_below
from missionc.verification.proof.proof_boxes import at_least_in_box, at_most

FLOATS = st.floats(width=32, allow_nan=False, allow_infinity=False)
PLAIN = st.floats(-16, 16, width=32)
SCALED = st.builds(
    lambda number, power: float(np.float32(number * 10.0**power)), st.floats(-1, 1), st.integers(-40, 20)
)
POWERS = st.lists(st.one_of(PLAIN, SCALED), min_size=8, max_size=8)
DURATIONS = st.floats(2.0**-10, 64, width=32)
SHARES = st.fractions(0, 1, max_denominator=64)
PLACES = st.lists(st.integers(0, 1), max_size=12)


def exactly(powers: list[float], at: Fraction) -> Fraction:
    """The polynomial's value, with no rounding."""
    return sum((Fraction(number) * at**power for power, number in enumerate(powers)), Fraction(0))


def value(curve: Enclosed, share: Fraction) -> Fraction:
    """What the control points alone say: (degree + 1,)."""
    degree = curve.degree
    return sum(
        (
            Fraction(float(point)) * comb(degree, index) * share**index * (1 - share) ** (degree - index)
            for index, point in enumerate(curve.points)
        ),
        Fraction(0),
    )


def holds(curve: Enclosed, share: Fraction, true: Fraction) -> bool:
    return abs(value(curve, share) - true) <= Fraction(float(curve.radius)) and (
        Fraction(float(curve.low())) <= true <= Fraction(float(curve.high()))
    )


def enclosed(powers: list[float], duration: float) -> Enclosed:
    return from_powers(np.array(powers), np.array(duration))


@given(POWERS, DURATIONS, SHARES)
def test_a_piece_holds_its_polynomial(powers: list[float], duration: float, share: Fraction) -> None:
    assert holds(enclosed(powers, duration), share, exactly(powers, share * Fraction(duration)))


@given(POWERS, DURATIONS, SHARES, PLACES)
def test_a_part_of_a_piece_holds_its_part(
    powers: list[float], duration: float, share: Fraction, place: list[int]
) -> None:
    curve, begin, width = enclosed(powers, duration), Fraction(0), Fraction(1)
    for half in place:
        curve = curve.halves()[half]
        width /= 2
        begin += half * width
    assert holds(curve, share, exactly(powers, (begin + share * width) * Fraction(duration)))


@given(POWERS, DURATIONS, SHARES, st.floats(0, 1))
def test_a_piece_may_be_cut_anywhere(powers: list[float], duration: float, share: Fraction, cut: float) -> None:
    before, after = enclosed(powers, duration).split(np.array(cut))
    assert holds(before, share, exactly(powers, share * Fraction(cut) * Fraction(duration)))
    assert holds(after, share, exactly(powers, (Fraction(cut) + share * (1 - Fraction(cut))) * Fraction(duration)))


@given(st.lists(POWERS, min_size=3, max_size=3), DURATIONS, SHARES)
def test_a_sum_of_squares_holds_it(powers: list[list[float]], duration: float, share: Fraction) -> None:
    square = from_powers(np.array(powers), np.array(duration)).squares()
    at = share * Fraction(duration)
    assert holds(square, share, sum((exactly(each, at) ** 2 for each in powers), Fraction(0)))


@given(POWERS, POWERS, DURATIONS, SHARES, PLAIN)
def test_differences_shifts_and_multiples_hold_theirs(
    one: list[float], other: list[float], duration: float, share: Fraction, number: float
) -> None:
    first, second, at = enclosed(one, duration), enclosed(other, duration), share * Fraction(duration)
    difference = exactly(one, at) - exactly(other, at)
    assert holds(first - second, share, difference)
    assert holds((first - second).moved(np.array(number)), share, difference + Fraction(number))
    assert holds((first - second).scaled(number), share, difference * Fraction(number))
    assert holds((first - second).elevated(11), share, difference)


@given(POWERS, DURATIONS, SHARES, st.integers(1, 4))
def test_derivatives_of_float32_numbers_are_exact(
    powers: list[float], duration: float, share: Fraction, order: int
) -> None:
    derived, exact = np.array(powers), [Fraction(number) for number in powers]
    for _ in range(order):
        derived = derivative(derived)
        exact = [power * number for power, number in enumerate(exact)][1:]
    assert [Fraction(number) for number in derived.tolist()] == exact
    assert holds(enclosed(derived.tolist(), duration), share, exactly(derived.tolist(), share * Fraction(duration)))


@given(POWERS, DURATIONS)
def test_the_middle_and_the_ends_hold_the_values_there(powers: list[float], duration: float) -> None:
    curve = enclosed(powers, duration)
    assert holds(curve.middle(), Fraction(0), exactly(powers, Fraction(duration) / 2))
    for place, share in ((0, Fraction(0)), (1, Fraction(1))):
        true = exactly(powers, share * Fraction(duration))
        assert abs(Fraction(float(curve.ends().points[place])) - true) <= Fraction(float(curve.radius))


@given(st.one_of(st.floats(0, 1e6), st.floats(0, 1e-300)))
def test_roots_are_rounded_away_from_their_number(square: float) -> None:
    assert Fraction(float(root_below(np.array(square)))) ** 2 <= Fraction(square)
    assert Fraction(float(root_above(np.array(square)))) ** 2 >= Fraction(square)


@settings(max_examples=30)
@given(st.lists(PLAIN, min_size=8, max_size=8), st.floats(0.25, 2, width=32))
def test_the_radius_is_no_more_than_rounding_takes(powers: list[float], duration: float) -> None:
    largest = sum(abs(number) * duration**power for power, number in enumerate(powers))
    assert float(enclosed(powers, duration).radius) <= 1e-14 * largest + 1e-200


@np.errstate(over="ignore", invalid="ignore")
def test_what_overflows_is_not_known() -> None:
    curve = enclosed([3e38] * 9, 3e38)
    assert (float(curve.low()), float(curve.high())) == (-np.inf, np.inf)
    assert float(from_powers(np.full((2, 8), 3e38), np.array(3e38)).squares().low()) == -np.inf


def short(curve: Enclosed) -> Enclosed:
    """The same control points, with no rounding counted."""
    return Enclosed(curve.points, np.zeros_like(curve.radius))


def test_a_bound_without_its_radius_is_too_short_and_that_is_noticed() -> None:
    generator = np.random.default_rng(0)
    powers = generator.normal(size=(200, 8)).astype(np.float32).astype(np.float64)
    share, duration = Fraction(1, 3), 0.7
    missed = 0
    for row in powers.tolist():
        curve = enclosed(row, float(np.float32(duration)))
        true = exactly(row, share * Fraction(float(np.float32(duration))))
        assert holds(curve, share, true)
        missed += not holds(short(curve), share, true)
    assert missed > 100


@pytest.mark.parametrize("vector", [(3.0, 4.0, 0.0), (1.0, 2.0, 2.0), (-0.75, 1.0, 0.0), (2.0, 3.0, 6.0)])
@pytest.mark.parametrize("scale", [1.0, 2.0**-30, 2.0**40])
def test_a_distance_that_is_one_ulp_short_is_not_enough(vector: tuple[float, ...], scale: float) -> None:
    """Their lengths are exact: what needs the next longer double is not kept, nor is the next shorter limit."""
    powers = np.array([[[number * scale, 0.0] for number in vector]])
    curve, first = from_powers(powers, np.array([[1.0]])), np.array([0])
    length = scale * float(np.sqrt(sum(number**2 for number in vector)))
    lower, upper, _ = at_least_in_box(np.array([np.nextafter(length, np.inf)]))(first, curve)
    assert lower[0] < 0
    assert upper[0] == pytest.approx(0.0, abs=1e-12 * scale)
    assert at_most(np.array([np.nextafter(length, 0.0)]))(first, curve)[0][0] < 0
    assert at_least_in_box(np.array([length * (1 - 1e-12)]))(first, curve)[0][0] > 0
    assert at_most(np.array([length * (1 + 1e-12)]))(first, curve)[0][0] > 0

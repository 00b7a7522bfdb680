"""Bounds of a share from a count: exact, by the distribution of the count itself."""

from __future__ import annotations

from math import comb

import numpy as np
import pytest

from missionc.flight.simulation.trials import fraction


@pytest.mark.parametrize("flights", [1, 2, 3, 10, 40])
def test_each_bound_covers_the_true_share_as_often_as_it_says(flights: int) -> None:
    """Whatever the true share is: summed over all counts, each as likely as it is."""
    found = [fraction(held, flights) for held in range(flights + 1)]
    for share in np.linspace(0, 1, 201):
        likely = [comb(flights, held) * share**held * (1 - share) ** (flights - held) for held in range(flights + 1)]
        assert sum(each for each, of in zip(likely, found, strict=True) if of.least <= share) >= 0.95 - 1e-12
        assert sum(each for each, of in zip(likely, found, strict=True) if of.low <= share <= of.high) >= 0.95 - 1e-12


def test_no_larger_lower_bound_covers_it_so_often() -> None:
    """Of flights that all succeed: with a true share a little above the bound they are more likely than 5 %."""
    for flights in (1, 3, 10, 200):
        assert fraction(flights, flights).least ** flights == pytest.approx(0.05)
        assert fraction(flights, flights).low ** flights == pytest.approx(0.025)


def test_the_bounds_are_those_of_the_textbook() -> None:
    """Clopper and Pearson, of 8 in 10."""
    found = fraction(8, 10)
    assert (found.low, found.high) == (pytest.approx(0.4439, abs=1e-4), pytest.approx(0.9748, abs=1e-4))
    assert found.low < found.least < found.share < found.high
    assert (fraction(0, 10).least, fraction(0, 10).low, fraction(10, 10).high) == (0.0, 0.0, 1.0)


@pytest.mark.parametrize(("held", "flights"), [(1, 0), (-1, 5), (6, 5)])
def test_there_is_no_share_of_no_flights(held: int, flights: int) -> None:
    with pytest.raises(ValueError, match="flights"):
        fraction(held, flights)

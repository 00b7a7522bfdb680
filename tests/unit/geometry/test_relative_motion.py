"""The closest approach of two moving agents."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from missionc.geometry.dynamics import Motions
from missionc.geometry.relative_motion import closest_approach

Array = NDArray[np.float64]

still = np.zeros(2)
seeds = st.integers(0, 2**32 - 1)


def approach(states: Array | list[Array], step: float) -> Array:
    """The closest approach of states as of ``sampled``."""
    return closest_approach(Motions(*states[:3]), Motions(*states[3:]), step)


def sampled(states: Array, step: float, times: int = 5_001) -> Array:
    """The least distance at many times: (6, pairs, dim) states, positions, velocities and accelerations in turn."""
    time = np.linspace(0, step, times)[:, None, None]
    first = states[0] + states[1] * time + states[2] * time**2 / 2
    second = states[3] + states[4] * time + states[5] * time**2 / 2
    return np.asarray(np.linalg.norm(second - first, axis=-1).min(axis=0))


def test_agents_that_cross_in_the_middle_of_a_step_meet() -> None:
    east, west = np.array([1.0, 0.0]), np.array([-1.0, 0.0])
    assert approach([-east, east, still, east, west, still], 2.0) == pytest.approx(0.0)


def test_agents_that_would_meet_after_the_step_are_judged_at_its_end() -> None:
    east = np.array([1.0, 0.0])
    assert approach([-east, east, still, east, -east, still], 0.5) == pytest.approx(1.0)


def test_agents_that_part_are_nearest_at_the_start() -> None:
    east = np.array([1.0, 0.0])
    assert approach([still, -east, still, 3 * east, east, still], 1.0) == pytest.approx(3.0)


def test_two_agents_at_rest_keep_their_distance() -> None:
    assert approach([still, still, still, np.array([3.0, 4.0]), still, still], 1.0) == pytest.approx(5.0)


def test_a_braking_agent_stops_short_of_the_other() -> None:
    east = np.array([1.0, 0.0])
    nearest = approach([still, 2 * east, -2 * east, 3 * east, still, still], 2.0)
    assert nearest == pytest.approx(2.0)


def test_a_parabola_that_passes_twice_is_seen_on_both_passes() -> None:
    up = np.array([0.0, 1.0])
    # It is over the other agent at 0.5 s and at 1.5 s.
    nearest = approach([still, 2 * up, -2 * up, 0.75 * up, still, still], 2.0)
    assert nearest == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("dim", [2, 3])
@given(seed=seeds)
def test_no_sampled_moment_is_closer_and_one_is_as_close(dim: int, seed: int) -> None:
    generator = np.random.default_rng(seed)
    states = generator.uniform(-2, 2, (6, 8, dim))
    states[[2, 5]] *= generator.choice([0.0, 1e-9, 1.0, 20.0])
    step = float(generator.uniform(0.05, 3))
    nearest = approach(states, step)
    seen = sampled(states, step)
    assert nearest.shape == (8,)
    assert np.all(nearest <= seen + 1e-9)
    assert np.allclose(nearest, seen, atol=0.01)


@given(seed=seeds)
def test_which_agent_is_called_first_does_not_matter(seed: int) -> None:
    states = np.random.default_rng(seed).uniform(-2, 2, (6, 5, 2))
    there = approach(states, 1.0)
    back = approach(states[[3, 4, 5, 0, 1, 2]], 1.0)
    assert np.allclose(there, back, atol=1e-12)


def test_any_leading_axes_are_kept() -> None:
    states = np.random.default_rng(0).uniform(-1, 1, (6, 3, 4, 2))
    nearest = approach(states, 1.0)
    assert nearest.shape == (3, 4)
    assert nearest[1, 2] == pytest.approx(float(approach(states[:, 1, 2], 1.0)))
    assert math.isfinite(nearest.sum())

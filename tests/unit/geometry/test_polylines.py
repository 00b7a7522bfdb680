"""Lengths, points and parts of polylines."""

from __future__ import annotations

import numpy as np
import pytest

from missionc.geometry.polylines import at_length, at_shares, length, lengths_to, part, split

BENT = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 4.0]])


def test_a_length_is_that_of_all_pieces() -> None:
    assert length(BENT) == pytest.approx(7.0)
    assert lengths_to(BENT).tolist() == [0.0, 3.0, 7.0]


def test_points_at_shares_lie_at_those_shares_of_the_length() -> None:
    assert np.allclose(at_shares(BENT, np.array([0.0, 3 / 14, 5 / 7, 1.0])), [[0, 0], [1.5, 0], [3, 2], [3, 4]])
    assert at_shares(BENT[[0, 0]], np.array([0.5])).tolist() == [[0.0, 0.0]]


def test_beyond_its_end_a_path_goes_straight_on() -> None:
    assert np.allclose(at_length(BENT, 5.0), [3, 2])
    assert np.allclose(at_length(BENT, 9.0), [3, 6])


def test_a_part_has_the_corners_between_its_ends() -> None:
    assert np.allclose(part(BENT, 1.0, 5.0), [[1, 0], [3, 0], [3, 2]])


def test_the_two_parts_of_a_path_are_as_long_as_the_whole() -> None:
    before, after = split(BENT, 0.25)
    assert length(before) == pytest.approx(0.25 * length(BENT))
    assert length(before) + length(after) == pytest.approx(length(BENT))

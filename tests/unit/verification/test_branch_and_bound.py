"""The search for the least margin, and for the pieces that fail: which parts are looked at, on margins made by hand."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest

from missionc.base.trace import Array, Indices
from missionc.geometry.curves.bernstein_intervals import Enclosed
from missionc.verification.proof import branch_and_bound as search
from missionc.verification.proof.branch_and_bound import (
    Bounds,
    BoxParts,
    Claim,
    branch_and_bound,
    everyone,
    failing_pieces,
    of_agents,
)

Margin = Callable[[Indices, Array, Array], tuple[Array, Array, Array]]
"""The margin of items, from a share of the piece to another one."""


def claim_of(
    subjects: int, pieces: int, margin: Margin, asked: list[list[int]] | None = None, gap: float = 0.125
) -> Claim:
    """The curves say how far a piece has come, so that a margin knows where it is asked."""

    def judge(item: Indices, curve: Enclosed) -> Bounds:
        if asked is not None:
            asked.append(item.tolist())
        return margin(item, curve.points[:, 0, 0], curve.points[:, 0, 1])

    def curve(item: Indices) -> Enclosed:
        return Enclosed(np.tile([[[0.0, 1.0]]], (item.size, 1, 1)), np.zeros((item.size, 1)))

    times = 2.0 * np.arange(pieces + 1.0)
    return Claim("made", "up", "m", 0.0625, "", everyone(subjects), times, curve, judge, gap)


def constant(of: Sequence[float], loose: float = 1.0) -> Margin:
    """The same in all of an item, with a bound that is looser the longer a part is."""
    values = np.array(of, dtype=np.float64)
    return lambda item, begin, end: (values[item] - loose * (end - begin), values[item], np.full(item.size, 0.25))


def from_a_point(item: Indices, begin: Array, end: Array) -> tuple[Array, Array, Array]:
    """The distance from 0.3, whose bounds are exact."""
    ends = np.abs(np.stack([begin, end]) - 0.3)
    return (
        np.where((begin <= 0.3) & (end >= 0.3), 0.0, ends.min(axis=0)),
        ends.min(axis=0),
        ends.argmin(axis=0) * 1.0,
    )


def rows(parts: BoxParts) -> list[tuple[float, ...]]:
    """Item, begin, width and bound of each."""
    columns = parts.item, parts.begin, parts.width, parts.lower
    return [tuple(row) for row in np.column_stack(columns).round(9).tolist()]


# ------------------------------------------------------------------------------ the least margin


def test_parts_are_halved_until_the_bound_is_as_near_as_the_gap() -> None:
    """1 - 0.125 - 0.001: parts of an eighth are too long by that thousandth, were it not there they would do."""
    parts = branch_and_bound(claim_of(2, 2, constant([3.0, 1.0, 2.0, 4.0])))
    eighths = [(1.0, number / 8, 0.125, 0.875) for number in range(8)]
    assert rows(parts) == [(0.0, 0.0, 1.0, 2.0), *eighths, (2.0, 0.0, 1.0, 1.0), (3.0, 0.0, 1.0, 3.0)]
    assert (parts.least, parts.worst, parts.moment) == (1.0, 1, 0.25)


@pytest.mark.parametrize(("value", "width"), [(70.0, 1 / 16), (-70.0, 1 / 16), (1.0, 1 / 1024), (130.0, 1 / 8)])
def test_a_margin_is_found_to_a_thousandth_of_it(value: float, width: float) -> None:
    parts = branch_and_bound(claim_of(1, 1, constant([value]), gap=0.0))
    assert set(parts.width.tolist()) == {width}
    assert parts.item.size == 1 / width


def test_the_search_goes_where_the_least_is() -> None:
    """The distance from 0.3, whose bounds are exact, to a thirty-second."""

    parts = branch_and_bound(claim_of(1, 1, from_a_point, gap=1 / 32))
    assert rows(parts) == [
        (0.0, 0.0, 0.25, 0.05),
        (0.0, 0.25, 0.0625, 0.0),
        (0.0, 0.3125, 0.0625, 0.0125),
        (0.0, 0.375, 0.125, 0.075),
        (0.0, 0.5, 0.5, 0.2),
    ]
    assert (parts.worst, parts.moment) == (0, 0.3125)
    assert parts.least == pytest.approx(0.0125)


def test_what_is_enough_is_not_proved_any_nearer() -> None:
    claim = claim_of(1, 2, constant([1.0, 3.0]))
    assert rows(branch_and_bound(claim, enough=0.5)) == [(0, 0, 0.5, 0.5), (0, 0.5, 0.5, 0.5), (1, 0, 1, 2)]
    assert branch_and_bound(claim, enough=0.5).least == 1.0
    assert branch_and_bound(claim, enough=5.0).item.size == 9


def test_of_equal_margins_the_first_seen_is_the_worst() -> None:
    parts = branch_and_bound(claim_of(3, 1, constant([2.0, 1.0, 1.0], loose=0.0)))
    assert (parts.worst, parts.least) == (1, 1.0)


def test_where_nothing_is_known_nothing_is_halved() -> None:
    def margin(item: Indices, begin: Array, end: Array) -> tuple[Array, Array, Array]:
        return np.where(item == 1, -np.inf, 3.0), np.array([5.0, 7.0, 9.0])[item], np.zeros(item.size)

    parts = branch_and_bound(claim_of(1, 3, margin, gap=9.0))
    assert rows(parts) == [(0, 0, 1, 3), (1, 0, 1, -np.inf), (2, 0, 1, 3)]
    assert (parts.least, parts.worst, parts.moment) == (5.0, 0, 0.0)


def test_no_part_is_shorter_than_the_finest() -> None:
    """At the beginning nothing can be proved."""

    def margin(item: Indices, begin: Array, end: Array) -> tuple[Array, Array, Array]:
        return np.where(begin < 2.0**-60, -1.0, 10.0), np.full(item.size, 1.0), np.zeros(item.size)

    parts = branch_and_bound(claim_of(1, 1, margin))
    assert parts.width[:2].tolist() == [2.0**-40, 2.0**-40]
    assert parts.item.size == 41


def test_after_so_many_parts_bounds_are_taken_as_they_stand(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(search, "MOST_PARTS", 7)
    never = claim_of(1, 1, lambda item, begin, end: (begin * 0.0, begin + 1.0, end * 0.0))
    assert branch_and_bound(never).width.tolist() == [0.125] * 8
    monkeypatch.setattr(search, "MOST_PARTS", 6)
    assert branch_and_bound(never).width.tolist() == [0.25] * 4


def test_few_parts_are_looked_at_together_and_many_in_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[list[int]] = []
    branch_and_bound(claim_of(1, 1, constant([1.0]), asked, gap=0.0625))
    assert list(map(len, asked)) == [1, 2, 4, 8, 16]
    asked.clear()
    monkeypatch.setattr(search, "CHUNK", 4)
    parts = branch_and_bound(claim_of(1, 1, constant([1.0]), asked, gap=0.0625))
    assert list(map(len, asked)) == [1, 2, 4, 4, 4, 4, 4, 4, 4]
    assert parts.begin.tolist() == [number / 16 for number in range(16)]


@pytest.mark.parametrize("chunk", [1, 2, 3, 5])
@pytest.mark.parametrize("margin", [from_a_point, constant([1.0, 1.0, 1.5])], ids=["alike", "of other depths"])
def test_in_whatever_chunks_parts_cover_every_item(monkeypatch: pytest.MonkeyPatch, chunk: int, margin: Margin) -> None:
    monkeypatch.setattr(search, "CHUNK", chunk)
    asked: list[list[int]] = []
    gap = 1e-3 if margin is from_a_point else 0.25
    parts = branch_and_bound(claim_of(3, 1, margin, asked, gap=gap))
    assert max(map(len, asked)) <= max(chunk, 3)
    for item in range(3):
        begin, width = parts.begin[parts.item == item], parts.width[parts.item == item]
        assert begin[0] == 0.0
        assert (begin[1:] == begin[:-1] + width[:-1]).all()
        assert begin[-1] + width[-1] == 1.0
    assert parts.lower.min() >= parts.least - gap - 1e-3


# ------------------------------------------------------------------------------ who is far


FAR = np.array([5.0, 1.0, 7.0, 3.0, 8.0, 2.0, 6.0, 4.0])


def looked_at(monkeypatch: pytest.MonkeyPatch, few: int, claim: Claim, asked: list[list[int]]) -> BoxParts:
    asked.clear()
    with monkeypatch.context() as patched:
        patched.setattr(search, "FEW", few)
        patched.setattr(search, "CHUNK", 8)
        return branch_and_bound(claim)


def test_the_nearest_are_looked_at_first_and_who_is_far_enough_not_at_all(monkeypatch: pytest.MonkeyPatch) -> None:
    """Eight subjects of two pieces; each is 4 m further off than the box around its flight is."""
    asked: list[list[int]] = []
    claim = claim_of(8, 2, constant(np.repeat(FAR + 4.0, 2).tolist(), loose=0.0), asked, gap=0.5)
    far = replace(claim, far=lambda subject: FAR[subject])
    parts = looked_at(monkeypatch, 4, far, asked)
    # Two of them, then four; within 5 - 0.5 - 0.005 m are only two of those.
    assert asked == [[10, 11, 2, 3], [14, 15, 6, 7]]
    seen = [(2.0 * subject + piece, 0.0, 1.0, FAR[subject] + 4.0) for subject in (1, 3, 5, 7) for piece in (0, 1)]
    whole = [(2.0 * subject, 0.0, 2.0, FAR[subject]) for subject in (0, 2, 4, 6)]
    assert rows(parts) == sorted(seen + whole)
    assert (parts.least, parts.worst) == (5.0, 2)
    # As many items as FEW are looked at piece by piece, in chunks.
    looked_at(monkeypatch, 16, far, asked)
    assert sorted(item for chunk in asked for item in chunk) == list(range(16))
    assert list(map(len, asked)) == [8, 8]
    looked_at(monkeypatch, 15, far, asked)
    assert list(map(len, asked)) == [14]


def test_where_no_box_tells_all_are_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[list[int]] = []
    claim = claim_of(8, 2, constant(np.repeat(FAR, 2).tolist(), loose=0.0), asked, gap=0.5)
    looked_at(monkeypatch, 4, claim, asked)
    assert asked == [[12, 13, 14, 15], [4, 5, 6, 7, 8, 9, 10, 11], [0, 1, 2, 3]]
    looked_at(monkeypatch, 16, claim, asked)
    assert list(map(len, asked)) == [8, 8]
    # One subject at a time at least, however many pieces it has.
    long = claim_of(2, 12, constant([1.0] * 24, loose=0.0), asked)
    looked_at(monkeypatch, 4, long, asked)
    assert list(map(len, asked)) == [12, 12]


def test_chunks_of_subjects_become_twice_as_large(monkeypatch: pytest.MonkeyPatch) -> None:
    """Those who are as far come in their order, the first of them last."""
    asked: list[list[int]] = []
    count = 200
    claim = claim_of(count, 1, constant([1.0] * count, loose=0.0), asked, gap=0.5)
    monkeypatch.setattr(search, "FEW", 4)
    monkeypatch.setattr(search, "CHUNK", 32)
    far = np.array([0.25, 0.125])[np.arange(count) % 2]
    branch_and_bound(replace(claim, far=lambda subject: far[subject]))
    assert list(map(len, asked)) == [4, 8, 16, *[32] * 5, 12]
    order = [*range(0, count, 2), *range(1, count, 2)]
    assert asked[0] == order[-4:]
    assert asked[1] == order[-12:-4]
    assert asked[-1] == order[:12]


def test_who_is_far_enough_for_what_is_enough_is_not_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    """But for the nearest two: something has to be seen."""
    asked: list[list[int]] = []
    far = np.array([0.45, 0.3, 0.5, 0.4])
    claim = replace(claim_of(4, 2, constant([1.0] * 8, loose=0.0), asked, gap=0.5), far=lambda subject: far[subject])
    monkeypatch.setattr(search, "FEW", 4)
    branch_and_bound(claim, enough=0.4)
    assert asked == [[6, 7, 2, 3]]
    asked.clear()
    branch_and_bound(claim, enough=0.46)
    assert asked == [[6, 7, 2, 3], [0, 1]]
    asked.clear()
    branch_and_bound(claim)
    assert asked == [[6, 7, 2, 3], [0, 1]]


# ------------------------------------------------------------------------------ which pieces fail


def test_every_piece_that_fails_is_found() -> None:
    """With a tolerance of a sixteenth, of three subjects in four pieces."""
    values = [1.0, 1.0, 1.0, -0.07, 1.0, -0.06, 1.0, 1.0, -1.0, 1.0, 1.0, 1.0]
    assert failing_pieces(claim_of(3, 4, constant(values, loose=0.0))) == {0, 3}
    assert failing_pieces(claim_of(3, 4, constant([-0.0625] * 12, loose=0.0))) == set()
    assert failing_pieces(claim_of(3, 4, constant([-0.0626] * 12, loose=0.0))) == {0, 1, 2, 3}


def test_who_is_far_enough_fails_nowhere_and_is_not_looked_at() -> None:
    asked: list[list[int]] = []
    claim = claim_of(3, 2, constant([-1.0] * 6), asked)
    assert failing_pieces(replace(claim, far=lambda subject: np.array([0.0, 1.0, 2.0])[subject])) == set()
    assert asked == []
    assert failing_pieces(replace(claim, far=lambda subject: np.array([0.0, -0.01, np.nan])[subject])) == {0, 1}
    assert asked == [[2, 3, 4, 5]]


def test_a_piece_is_halved_until_it_is_proved_or_seen_to_fail() -> None:
    asked: list[list[int]] = []
    # Of the first a bound of -0.0625 is proved by halves, of the second by whole; the third is not as soon.
    claim = claim_of(1, 3, constant([0.4375, 3.0, 0.1875]), asked)
    assert failing_pieces(claim) == set()
    assert asked == [[0, 1, 2], [0, 2, 0, 2], [2, 2, 2, 2]]

    def dips(item: Indices, begin: Array, end: Array) -> tuple[Array, Array, Array]:
        """Below the tolerance beside a quarter of the second piece."""
        seen = np.where((item % 2 == 1) & (begin <= 0.25) & (end <= 0.5), -1.0, 1.0)
        return np.where(item % 2 == 1, begin * 0.0 - 1.0, 1.0), seen, begin * 0.0

    asked.clear()
    assert failing_pieces(claim_of(2, 2, dips, asked)) == {1}
    assert list(map(len, asked)) == [4, 4]


def test_what_is_not_proved_on_the_shortest_part_fails() -> None:
    def never(item: Indices, begin: Array, end: Array) -> tuple[Array, Array, Array]:
        return np.where((item == 0) & (begin == 0.0), -1.0, 1.0), begin * 0.0 + 1.0, begin * 0.0

    asked: list[list[int]] = []
    assert failing_pieces(claim_of(1, 2, never, asked)) == {0}
    # A part of one, of a half, and so on to one of 2**-10.
    assert list(map(len, asked)) == [2, *[2] * 10]

    def unknown(item: Indices, begin: Array, end: Array) -> tuple[Array, Array, Array]:
        return np.where(item == 0, np.nan, 1.0), np.where(item == 0, np.nan, 1.0), begin * 0.0

    assert failing_pieces(claim_of(1, 2, unknown)) == {0}


def test_pieces_are_looked_at_in_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[list[int]] = []
    monkeypatch.setattr(search, "CHUNK", 4)
    values = [1.0] * 9
    values[8] = -1.0
    assert failing_pieces(claim_of(3, 3, constant(values, loose=0.0), asked)) == {2}
    assert asked == [[0, 1, 2, 3], [4, 5, 6, 7], [8]]


# ------------------------------------------------------------------------------ claims


def test_moments_count_pieces() -> None:
    claim = replace(claim_of(2, 2, constant([1.0] * 4)), times=np.array([1.0, 2.0, 6.0]))
    assert [claim.when(moment) for moment in (0.0, 0.5, 1.25, 2.0)] == [1.0, 1.5, 3.0, 6.0]
    assert (claim.pieces, claim.items) == (2, 4)
    assert everyone(3).tolist() == [[0], [1], [2]]


def test_items_are_the_pieces_of_one_agent_after_those_of_the_other() -> None:
    curves = Enclosed(np.arange(12.0).reshape(2, 3, 1, 2), np.arange(6.0).reshape(2, 3, 1))
    some = of_agents(curves)(np.array([4, 0, 2]))
    assert some.points.tolist() == [[[8.0, 9.0]], [[0.0, 1.0]], [[4.0, 5.0]]]
    assert some.radius.tolist() == [[4.0], [0.0], [2.0]]

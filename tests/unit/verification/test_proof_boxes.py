"""Boxes of a proof: what they are made of, what proves them again, and what they say of a claim."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from missionc.base.trace import Array, Indices
from missionc.geometry.curves.bernstein_intervals import Enclosed
from missionc.verification.certificate import Check
from missionc.verification.flight import verify_polynomials
from missionc.verification.flight.verify_polynomials import prove
from missionc.verification.proof.branch_and_bound import Bounds, BoxParts, Claim, everyone
from missionc.verification.proof.proof_boxes import Boxes, bound_on, boxes_of, fault, stated
from tests.support.legal_plans import mission_of


def claim_of(
    subjects: int, pieces: int, asked: list[tuple[int, float, float]] | None = None, loose: float = 0.0
) -> Claim:
    """That ten times the item, with how far its piece has come at least, is positive."""

    def judge(item: Indices, curve: Enclosed) -> Bounds:
        begin, end = curve.points[:, 0, 0], curve.points[:, 0, 1]
        if asked is not None:
            asked.extend(zip(item.tolist(), begin.tolist(), end.tolist(), strict=True))
        return 10.0 * item + begin - loose * (end - begin), 10.0 * item + begin, np.full(item.size, 0.5)

    def curve(item: Indices) -> Enclosed:
        return Enclosed(np.tile([[[0.0, 1.0]]], (item.size, 1, 1)), np.zeros((item.size, 1)))

    times = 2.0 * np.arange(pieces + 1.0)
    return Claim("made", "up", "m", 0.0625, "words", everyone(subjects), times, curve, judge, 0.125)


# ------------------------------------------------------------------------------ what is stated


@pytest.mark.parametrize(
    ("bound", "written"),
    [
        (0.5, 0.499999999),
        (-0.5, -0.500000001),
        (0.1234567894, 0.123456788),
        (-0.1234567894, -0.123456791),
        (0.0, -1e-9),
        (999_999.5, 999_999.499999999),
        (1e6, 1e6 - 1e-6),
        (-1e6, -1e6 - 1e-6),
        (4e6, 4e6 - 4e-6),
        (-math.inf, -math.inf),
    ],
)
def test_bounds_are_stated_a_billionth_lower(bound: float, written: float) -> None:
    assert stated(bound) == pytest.approx(written, rel=1e-15)
    assert stated(bound) <= bound


def parts(*rows: tuple[int, float, float, float]) -> BoxParts:
    """Parts, each by its item, begin, width and bound."""
    item, begin, width, lower = (np.array(column) for column in zip(*rows, strict=True))
    return BoxParts(item, begin.astype(float), width.astype(float), lower.astype(float), 0.0, 0, 0.0)


def test_whole_pieces_that_follow_each_other_are_one_box() -> None:
    claim = claim_of(4, 3)
    made = boxes_of(
        claim,
        parts(
            (0, 0, 1, 0.5), (1, 0, 1, 0.25), (2, 0, 0.5, 0.125), (2, 0.5, 0.5, 0.75),
            (3, 0, 0.5, 4), (3, 0.5, 0.5, 3), (4, 0, 1, 2), (5, 0, 1, 1),
            (6, 0, 1, 9), (7, 0, 0.5, 8), (7, 0.5, 0.5, 7), (8, 0, 1, 6),
            (9, 0, 3, -0.5),
        ),
    )  # fmt: skip
    assert made.claim is claim
    assert made.ends == ((0.0, 2.0, 2.5, 3.0), (0.0, 0.5, 1.0, 3.0), (0.0, 1.0, 1.5, 2.0, 3.0), (0.0, 3.0))
    bounds = ((0.25, 0.125, 0.75), (4.0, 3.0, 1.0), (9.0, 8.0, 7.0, 6.0), (-0.5,))
    assert made.bounds == tuple(tuple(map(stated, row)) for row in bounds)
    assert made.least == stated(-0.5)


def test_a_box_ends_with_its_subject() -> None:
    made = boxes_of(claim_of(2, 2), parts((0, 0, 1, 2), (1, 0, 1, 3), (2, 0, 1, 4), (3, 0, 1, 1)))
    assert (made.ends, made.bounds) == (((0.0, 2.0), (0.0, 2.0)), ((stated(2.0),), (stated(1.0),)))


# ------------------------------------------------------------------------------ what proves them


def test_a_part_is_computed_from_its_curve_anew() -> None:
    asked: list[tuple[int, float, float]] = []
    rows = [(3, 0.0, 1.0), (0, 0.625, 0.125), (1, 0.0, 0.5), (2, 0.5, 0.5), (2, 0.25, 0.25), (5, 0.9375, 0.0625)]
    item, begin, width = (np.array(column) for column in zip(*rows, strict=True))
    given = begin.copy()
    found = bound_on(claim_of(2, 3, asked), item, given, width)
    assert found.tolist() == [30.0, 0.625, 10.0, 20.5, 20.25, 50.9375]
    assert asked == [(each, first, first + wide) for each, first, wide in rows]
    assert given.tolist() == begin.tolist()
    assert bound_on(claim_of(2, 3), item[:0], given[:0], width[:0]).tolist() == []


def test_many_parts_are_computed_in_chunks() -> None:
    count = (1 << 15) + 3
    item, begin = np.arange(count), np.full(count, 0.5)
    assert (bound_on(claim_of(count, 1), item, begin, begin) == 10.0 * item + 0.5).all()


def boxes(claim: Claim, ends: Sequence[float], lower: float = -1.0) -> Boxes:
    return Boxes(claim, (tuple(ends),), ((lower,) * (len(ends) - 1),))


def test_a_box_is_cut_into_the_longest_parts_that_halving_leads_to() -> None:
    asked: list[tuple[int, float, float]] = []
    assert fault(boxes(claim_of(1, 3, asked), (0.0, 0.375, 2.5, 3.0))) is None
    assert asked == [
        (0, 0.0, 0.25),
        (0, 0.25, 0.375),
        (0, 0.375, 0.5),
        (0, 0.5, 1.0),
        (1, 0.0, 1.0),
        (2, 0.0, 0.5),
        (2, 0.5, 1.0),
    ]
    asked.clear()
    assert fault(boxes(claim_of(1, 3, asked), (0.0, 0.5, 3.0))) is None
    assert asked == [(0, 0.0, 0.5), (0, 0.5, 1.0), (1, 0.0, 1.0), (2, 0.0, 1.0)]
    asked.clear()
    assert fault(boxes(claim_of(1, 1, asked), (0.0, 0.125, 0.8125, 1.0))) is None
    assert asked == [
        (0, 0.0, 0.125),
        (0, 0.125, 0.25),
        (0, 0.25, 0.5),
        (0, 0.5, 0.75),
        (0, 0.75, 0.8125),
        (0, 0.8125, 0.875),
        (0, 0.875, 1.0),
    ]


def test_no_box_begins_at_a_finer_part_than_halving_leads_to() -> None:
    asked: list[tuple[int, float, float]] = []
    assert fault(boxes(claim_of(1, 1, asked), (0.0, 2.0**-40, 1.0))) is None
    assert asked[:2] == [(0, 0.0, 2.0**-40), (0, 2.0**-40, 2.0**-39)]
    assert len(asked) == 41
    wrong = fault(boxes(claim_of(1, 1), (0.0, 2.0**-41, 1.0)))
    assert wrong == "its boxes do not cover the flight in order, at 0.00 s"
    wrong = fault(boxes(claim_of(1, 2), (0.0, 1.3, 2.0)))
    assert wrong == "its boxes do not cover the flight in order, at 0.00 s"


def test_a_bound_that_is_too_good_is_found_with_its_time() -> None:
    claim = claim_of(1, 2)
    good = Boxes(claim, ((0.0, 0.5, 1.25, 2.0),), ((0.0, 0.5, 10.25),))
    assert fault(good) is None
    bad = replace(good, bounds=((0.0, 0.5, 10.26),))
    assert fault(bad) == "the bound of its box at 2.50 s does not hold"


# ------------------------------------------------------------------------------ the check of a claim


def table(
    lower: Sequence[float], seen: Sequence[float], *, gap: float = 0.125, subjects: int = 2, loose: float = 0.0
) -> Claim:
    """A claim of items with these bounds, and margins that are seen at a quarter of the piece."""
    bound, margin = np.array(lower, dtype=np.float64), np.array(seen, dtype=np.float64)

    def judge(item: Indices, curve: Enclosed) -> Bounds:
        wide: Array = curve.points[:, 0, 1] - curve.points[:, 0, 0]
        return bound[item] - loose * wide, margin[item], np.full(item.size, 0.25)

    claim = claim_of(subjects, len(lower) // subjects)
    agents = np.array([[0, 2], [1, 2], [0, 1]][:subjects])
    return replace(claim, judge=judge, gap=gap, agents=agents)


MISSION = mission_of([(1.0, 1.0), (2.0, 2.0), (3.0, 3.0)], 4)


def test_a_check_names_the_least_margin_its_time_and_whom_it_is_about() -> None:
    check, proof = prove(MISSION, table([3.0, 2.5, 4.0, 1.0, 0.5, 3.0], [3.0, 2.5, 4.0, 1.0, 0.5625, 3.0]))
    assert check == Check("made", "up", stated(0.5), "m", 0.0625 + 0.125, True, 2.5, ("drone[1]", "drone[2]"), "words")
    assert proof.least == check.margin
    check, _ = prove(MISSION, table([3.0, 2.5, 4.0, 1.0], [3.0, 2.5, 4.0, 1.0], gap=math.inf))
    assert (check.tolerance, check.margin, check.at) == (0.0625, stated(1.0), 2.5)


@pytest.mark.parametrize(
    ("lower", "seen", "passed"),
    [
        (-0.0625, -0.0625, True),
        (-0.0625, -0.0626, False),
        (-0.1874, -0.0625, True),
        (-0.1876, -0.0625, False),
        (-math.inf, 5.0, False),
    ],
)
def test_a_claim_passes_where_nothing_seen_and_nothing_proved_is_too_low(
    lower: float, seen: float, passed: bool
) -> None:
    """What was seen may be lower by the tolerance, a sixteenth, and what is proved by the gap, an eighth, besides."""
    # The bound stays within the gap of what is seen: the search takes it as it is.
    claim = table([1.0, lower, 1.0, 1.0], [1.0, seen, 1.0, 1.0], gap=0.125)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("missionc.verification.proof.branch_and_bound.MOST_PARTS", 0)
        check, _ = prove(MISSION, claim)
    assert check.passed is passed
    assert check.tolerance == 0.1875


@pytest.mark.parametrize(("many", "least", "boxes_made"), [(8, 1.0, 3), (9, 1.0, 9), (8, -1.0, 9)])
def test_where_the_least_takes_many_boxes_fewer_prove_what_is_asked(
    monkeypatch: pytest.MonkeyPatch, many: int, least: float, boxes_made: int
) -> None:
    """Bounds are looser by twice the length of a part: to the gap these are eight, and one of the other piece."""
    monkeypatch.setattr(verify_polynomials, "MANY", many)
    check, proof = prove(MISSION, table([least, 3.0], [least, 3.0], gap=0.25, subjects=1, loose=2.0))
    assert check.passed is (least > 0)
    assert len(proof.bounds[0]) == boxes_made
    assert check.margin == stated(least - 2.0 / 8 if boxes_made == 9 else 0.0)

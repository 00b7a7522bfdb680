"""A certificate of impossibility is checked without what made it: whole ones pass, and forged ones do not.

Each forgery is whole but for one claim: its clauses are those of what it claims, and their proof is sound.
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from missionc.base.limits import Limits
from missionc.base.trace import Flags
from missionc.base.units import Metres
from missionc.verification.impossibility.check_refutation import CNF, DRAT, check_drat, check_refutation
from missionc.verification.impossibility.cover_document import COVER, ClaimedCover, Unreadable, read_cover
from tests.support.certificates import Certified, certified, files_of
from tests.support.drat_checker import fault

pytest.importorskip("pysat")

WHOLE = (
    "beacon_out_of_range",
    "corridor_swap",
    "escort_left_behind",
    "gate_that_opens_late",
    "hole_in_a_floor",
    "nine_in_a_cube",
    "one_charge_for_two_trips",
    "seen_through_a_wall",
    "short_relay",
    "slow_all_the_way",
    "turn_back_at_once",
)


def failing(known: Certified, files: dict[str, bytes]) -> set[str]:
    return {check.name for check in check_refutation(known.mission, known.kernel, files, Limits()) if not check.passed}


@pytest.mark.parametrize("name", WHOLE)
def test_a_certificate_passes_every_check(name: str) -> None:
    known = certified(name)
    assert failing(known, known.files) == set()


def test_each_check_says_what_it_is_of() -> None:
    known = certified("corridor_swap")
    first, second = (known.mission.agents[agent].name for agent in known.cover.asked)
    found = check_refutation(known.mission, known.kernel, known.files, Limits())
    kinds = [known.mission.agents[kind.agents[0]].name for kind in known.cover.kinds]
    visited = [known.mission.agents[agent].name for agent in known.cover.not_both]
    assert [(check.name, check.subject) for check in found] == [
        ("bodies", "all"),
        *((name, kind) for kind in kinds for name in ("cells", "moves", "turns")),
        *(
            (name, each)
            for each in (first, second)
            for name in ("places", "visits")
            if name == "places" or each in visited
        ),
        ("rooms", "all"),
        ("pairs", f"{first}, {second}"),
        ("labels", "all"),
        ("clauses", CNF),
        ("proof", DRAT),
    ]
    assert {(check.unit, check.margin, check.tolerance, check.detail) for check in found} == {("m", 0.0, 1e-6, "")}


@pytest.mark.parametrize("name", ["short_relay", "turn_back_at_once"])
def test_its_proof_passes_another_checker_too(name: str) -> None:
    files = certified(name).files
    assert fault(files[CNF].decode(), files[DRAT].decode()) == ""


# ------------------------------------------------------------- forged claims


def without_cell(cover: ClaimedCover, cell: int) -> ClaimedCover:
    """A cover whose kinds all lack a cell, and all that is said of it."""

    def rest(flags: Flags, *axes: int) -> Flags:
        for axis in axes:
            flags = np.delete(flags, cell, axis=axis)
        return flags

    kinds = tuple(
        replace(
            kind,
            boxes=(rest(kind.boxes[0], 0), rest(kind.boxes[1], 0)),
            no_move={steps: rest(flags, 0, 1) for steps, flags in kind.no_move.items()},
            no_turn={steps: rest(flags, 0, 1, 2) for steps, flags in kind.no_turn.items()},
        )
        for kind in cover.kinds
    )
    labels = tuple(
        replace(
            label,
            never_true=rest(label.never_true, *range(label.never_true.ndim)),
            never_false=rest(label.never_false, *range(label.never_false.ndim)),
        )
        for label in cover.labels
    )
    return replace(
        cover,
        kinds=kinds,
        absent={agent: rest(flags, 1) for agent, flags in cover.absent.items()},
        not_both={agent: rest(flags, 0, 1) for agent, flags in cover.not_both.items()},
        not_together={pair: rest(flags, 0, 1) for pair, flags in cover.not_together.items()},
        labels=labels,
    )


def cell_left_out(cover: ClaimedCover) -> ClaimedCover:
    """What a cell was is said to have no room in it."""
    low, high = (corner[:1] for corner in cover.kinds[0].boxes)
    smaller = without_cell(cover, 0)
    begin, end = smaller.kinds[0].left_out
    kind = replace(smaller.kinds[0], left_out=(np.concatenate([begin, low]), np.concatenate([end, high])))
    return replace(smaller, kinds=(kind, *smaller.kinds[1:]))


def shrunk(cover: ClaimedCover) -> ClaimedCover:
    low, high = cover.kinds[0].boxes
    low = low.copy()
    low[0] += 0.25 * (high[0] - low[0])
    return replace(cover, kinds=(replace(cover.kinds[0], boxes=(low, high)), *cover.kinds[1:]))


def set_in(flags: Flags, *where: int) -> Flags:
    changed = flags.copy()
    changed[where] = True
    return changed


def move(steps: int) -> Callable[[ClaimedCover], ClaimedCover]:
    """Nobody stays in the first cell for so many steps."""

    def forge(cover: ClaimedCover) -> ClaimedCover:
        kind = cover.kinds[0]
        never = {**kind.no_move, steps: set_in(kind.no_move[steps], 0, 0)}
        return replace(cover, kinds=(replace(kind, no_move=never), *cover.kinds[1:]))

    return forge


def turn(cover: ClaimedCover) -> ClaimedCover:
    kind = cover.kinds[0]
    steps, flags = next(iter(kind.no_turn.items()))
    return replace(cover, kinds=(replace(kind, no_turn={**kind.no_turn, steps: set_in(flags, 0, 0, 0)}),))


def place(cover: ClaimedCover) -> ClaimedCover:
    """The first agent is nowhere where it may start."""
    agent = cover.asked[0]
    return replace(cover, absent={**cover.absent, agent: np.ones_like(cover.absent[agent])})


def ends_that_show_each_other(cover: ClaimedCover) -> ClaimedCover:
    """It starts and ends elsewhere than it does, in one of the cells that is far from all others."""
    agent = cover.asked[0]
    absent = cover.absent[agent].copy()
    for row in (0, -1):
        only = np.flatnonzero(absent[row])[0]
        absent[row] = np.arange(absent.shape[1]) != only
    return replace(cover, absent={**cover.absent, agent: absent}, not_both={})


def visit(cover: ClaimedCover) -> ClaimedCover:
    agent = cover.asked[0]
    start = int(np.flatnonzero(~cover.absent[agent][0])[0])
    return replace(cover, not_both={**cover.not_both, agent: set_in(cover.not_both[agent], start, start)})


def pair(cover: ClaimedCover) -> ClaimedCover:
    (agents, flags), *_ = cover.not_together.items()
    starts = [int(np.flatnonzero(~cover.absent[agent][0])[0]) for agent in agents]
    return replace(cover, not_together={**cover.not_together, agents: set_in(flags, *starts)})


def room(cover: ClaimedCover) -> ClaimedCover:
    return replace(cover, at_most=tuple((low, high, most // 2) for low, high, most in cover.at_most))


def body(cover: ClaimedCover) -> ClaimedCover:
    low, high = next(iter(cover.bodies.values()))
    wide = (low - 0.5, high + 0.5)
    return replace(cover, bodies=dict.fromkeys(cover.bodies, wide))


def label(never: str) -> Callable[[ClaimedCover], ClaimedCover]:
    """All leaves fail everywhere; or all hold."""

    def forge(cover: ClaimedCover) -> ClaimedCover:
        everywhere = tuple(replace(each, **{never: np.ones_like(getattr(each, never))}) for each in cover.labels)
        return replace(cover, labels=everywhere)

    return forge


FORGED: dict[str, tuple[str, Callable[[ClaimedCover], ClaimedCover], str]] = {
    "a cell is missing": ("short_relay", lambda cover: without_cell(cover, 0), "cells"),
    "a cell in a volume is missing": ("hole_in_a_floor", lambda cover: without_cell(cover, 3), "cells"),
    "a cell is smaller": ("short_relay", shrunk, "cells"),
    "a cell is said to have no room": ("short_relay", cell_left_out, "cells"),
    "a move is missing": ("short_relay", move(1), "moves"),
    "a move over several steps is missing": ("gate_that_opens_late", move(4), "moves"),
    "a turn is missing": ("turn_back_at_once", turn, "turns"),
    "a place is missing": ("short_relay", place, "places"),
    "ends show each other": ("slow_all_the_way", ends_that_show_each_other, "places"),
    "a visit is missing": ("one_charge_for_two_trips", visit, "visits"),
    "a pair of cells is missing": ("corridor_swap", pair, "pairs"),
    "too few fit": ("nine_in_a_cube", room, "rooms"),
    "a body is larger than what stands": ("hole_in_a_floor", body, "bodies"),
    "what may hold does not": ("short_relay", label("never_true"), "labels"),
    "what is seen is hidden": ("seen_through_a_wall", label("never_true"), "labels"),
    "what is heard is not": ("beacon_out_of_range", label("never_true"), "labels"),
    "who is slow is not": ("slow_all_the_way", move(1), "moves"),
}


@pytest.mark.parametrize("name", FORGED)
def test_a_forged_claim_is_refused_by_its_own_check_alone(name: str) -> None:
    mission, forge, by = FORGED[name]
    known = certified(mission)
    files = files_of(known, forge(known.cover))
    assert files != known.files
    assert files[DRAT]
    assert failing(known, files) == {by}


def test_what_may_fail_and_is_said_not_to_is_refused() -> None:
    known = certified("short_relay")
    assert failing(known, files_of(known, label("never_false")(known.cover))) >= {"labels"}


def test_a_conflict_that_is_smaller_than_it_is_has_no_proof() -> None:
    known = certified("short_relay")
    assert failing(known, files_of(known, replace(known.cover, conflict=("visit",)))) >= {"proof"}


def test_another_conflict_is_another_certificate() -> None:
    known = certified("short_relay")
    cover = known.files[COVER].replace(b'["visit","relay"]', b'["visit"]')
    assert failing(known, {**known.files, COVER: cover}) >= {"clauses"}
    cover = known.files[COVER].replace(b'["visit","relay"]', b'["visit","other"]')
    assert failing(known, {**known.files, COVER: cover}) == {"cover"}


@pytest.mark.parametrize("clause", [1, 40, 400, -1])
def test_without_a_clause_it_is_refused(clause: int) -> None:
    known = certified("short_relay")
    lines = known.files[CNF].decode().splitlines()
    lines.pop(clause)
    lines[0] = " ".join([*lines[0].split()[:3], str(len(lines) - 1)])
    assert failing(known, {**known.files, CNF: ("\n".join(lines) + "\n").encode()}) >= {"clauses"}


def test_a_proof_cut_short_or_changed_is_refused() -> None:
    known = certified("short_relay")
    lines = known.files[DRAT].decode().splitlines()
    for changed in (lines[:-1], ["0"], [], ["7 x 0"], ["99999999 0"]):
        files = {**known.files, DRAT: ("\n".join(changed) + "\n").encode()}
        assert failing(known, files) == {"proof"}


def test_a_proof_that_is_longer_than_the_limit_is_not_believed() -> None:
    known = certified("short_relay")
    (check,) = (
        each
        for each in check_refutation(known.mission, known.kernel, known.files, Limits(proof_steps=100))
        if not each.passed
    )
    assert re.fullmatch(r"it has (\d+) steps; raise the limit with `--limit proof_steps=\1`", check.detail)


def test_a_proof_that_takes_longer_than_there_is_time_is_not_believed() -> None:
    known = certified("short_relay")
    checks = check_refutation(known.mission, known.kernel, known.files, Limits(), deadline=time.monotonic())
    assert [each.detail for each in checks if not each.passed] == [
        "the time limit was reached before the end of the proof"
    ]


def test_a_step_that_keeps_clauses_satisfiable_is_no_proof_once_some_were_deleted() -> None:
    """Both variables are true in the only model; without the second clause, nothing else says so of the second."""
    files = {CNF: b"p cnf 2 2\n1 0\n-1 2 0\n", DRAT: b"d -1 2 0\n-2 0\n0\n"}
    assert not check_drat(files, Limits()).passed


def test_agents_at_other_altitudes_are_not_alike() -> None:
    known = certified("short_relay")
    first, *others = known.mission.agents
    higher = replace(known.mission, agents=(replace(first, altitude=Metres(first.altitude + 1.0)), *others))
    failed = [check for check in check_refutation(higher, known.kernel, known.files, Limits()) if not check.passed]
    assert [(check.name, check.detail) for check in failed] == [("cells", "its agents are not of one kind")]


def test_a_certificate_of_another_mission_is_refused() -> None:
    known, other = certified("short_relay"), certified("mast_of_three")
    assert failing(other, known.files) == {"cover"}


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("missionc.cover/1", "missionc.cover/9"),
        ('"asked": ["drone[0]",', '"asked": ["drone[9]",'),
        ('"points":', '"points":-'),
        ('"cells":[[[', '"cells":[[[1e999,'),
        ('"cells":[[[', '"cells":[[[1e308,0.0],[1.7e308,1.0]],[['),
        ('"kinds": [', '"kinds": [{"agents":[],"cells":[],"points":0,"left_out":[],"no_move":{},"no_turn":{}},'),
        ('"asked": ["drone[0]",', '"asked": ['),
        ('"at_most": [', '"at_most": [{"box":[[0.0,0.0],[1.0,1.0]],"agents":-4}'),
        ('"no_move":{"1":[[', '"no_move":{"1":[[4711,'),
        ('"no_move":{"1":[[', '"no_move":{"1":[["a",'),
        ('"no_move":{"1":', '"no_move":{"99":'),
        ('"of":"pairs"', '"of":"cells"'),
        ('"labels": [', '"labels": [7,'),
        ("{", "{{"),
    ],
)
def test_what_is_no_cover_is_told_from_one_that_proves_nothing(old: str, new: str) -> None:
    known = certified("short_relay")
    text = known.files[COVER].decode()
    assert old in text
    with pytest.raises(Unreadable):
        read_cover(text.replace(old, new, 1), known.mission)
    assert failing(known, {**known.files, COVER: text.replace(old, new, 1).encode()}) == {"cover"}

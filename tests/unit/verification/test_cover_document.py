"""The document of a cover: written and read back the same, and refused where anything in it does not fit."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from missionc.base.trace import Flags
from missionc.verification.impossibility import cover_document
from missionc.verification.impossibility.cover_document import (
    CellsOfKind,
    ClaimedCover,
    Label,
    Unreadable,
    document,
    read_cover,
)
from missionc.verification.impossibility.intervals import Boxes
from tests.support.random_runs import mission_of

MISSION = mission_of(3, 2)
NAMES = ["drone[0]", "drone[1]", "drone[2]"]


def flags(shape: tuple[int, ...], *where: tuple[int, ...]) -> Flags:
    found = np.zeros(shape, dtype=np.bool_)
    for each in where:
        found[each] = True
    return found


def boxes(*corners: tuple[float, float, float, float]) -> Boxes:
    found = np.array(corners, dtype=np.float64).reshape(-1, 4)
    return found[:, :2], found[:, 2:]


PAIRED = CellsOfKind(
    (2, 0),
    boxes((0, 0, 1, 2), (1, 0, 3, 2), (1, 1, 1, 1)),
    1,
    boxes((3, 0, 4, 2)),
    {1: flags((3, 3), (0, 2)), 2: flags((3, 3))},
    {1: flags((3, 3, 3), (0, 1, 2), (2, 2, 2))},
)
ALONE = CellsOfKind((1,), boxes((0, 0, 4, 2), (0, 0, 1, 1)), 0, boxes(), {}, {})
COVER = ClaimedCover(
    ("visit", "relay"),
    (0, 1),
    True,
    (PAIRED, ALONE),
    {"obstacle 0": boxes((1, 1, 2, 2))},
    {0: flags((3, 3), (0, 1), (2, 0)), 1: flags((3, 2)), 2: flags((3, 3), (1, 1))},
    {0: flags((3, 3), (0, 1))},
    ((np.array([0.0, 0.0]), np.array([1.0, 0.5]), 1),),
    {(0, 1): flags((3, 2), (2, 1))},
    (
        Label("x >= 1", "cells", (1,), flags((2,), (0,)), flags((2,), (1,))),
        Label("speed", "moves", (0,), flags((3, 3), (0, 1)), flags((3, 3))),
        Label("near", "pairs", (0, 1), flags((3, 2), (2, 0)), flags((3, 2), (0, 1))),
    ),
)

TEXT: dict[str, Any] = {
    "schema": "missionc.cover/1",
    "mission": "random",
    "conflict": ["visit", "relay"],
    "asked": NAMES[:2],
    "apart": True,
    "bodies": {"obstacle 0": [[[1.0, 1.0], [2.0, 2.0]]]},
    "kinds": [
        {
            "agents": ["drone[2]", "drone[0]"],
            "cells": [[[0.0, 0.0], [1.0, 2.0]], [[1.0, 0.0], [3.0, 2.0]], [[1.0, 1.0], [1.0, 1.0]]],
            "points": 1,
            "left_out": [[[3.0, 0.0], [4.0, 2.0]]],
            "no_move": {"1": [[2], [], []], "2": [[], [], []]},
            "no_turn": {"1": [[[], [2], []], [[], [], []], [[], [], [2]]]},
        },
        {
            "agents": ["drone[1]"],
            "cells": [[[0.0, 0.0], [4.0, 2.0]], [[0.0, 0.0], [1.0, 1.0]]],
            "points": 0,
            "left_out": [],
            "no_move": {},
            "no_turn": {},
        },
    ],
    "absent": {"drone[0]": [[1], [], [0]], "drone[1]": [[], [], []], "drone[2]": [[], [1], []]},
    "not_both": {"drone[0]": [[1], [], []]},
    "at_most": [{"box": [[0.0, 0.0], [1.0, 0.5]], "agents": 1}],
    "not_together": [{"agents": ["drone[0]", "drone[1]"], "cells": [[], [], [1]]}],
    "labels": [
        {"leaf": "x >= 1", "of": "cells", "agents": ["drone[1]"], "never_true": [0], "never_false": [1]},
        {"leaf": "speed", "of": "moves", "agents": ["drone[0]"], "never_true": [[1], [], []], "never_false": [[]] * 3},
        {
            "leaf": "near",
            "of": "pairs",
            "agents": ["drone[0]", "drone[1]"],
            "never_true": [[], [], [0]],
            "never_false": [[1], [], []],
        },
    ],
}


def test_a_cover_is_written_key_by_key() -> None:
    written = document(COVER, MISSION).decode()
    assert json.loads(written) == TEXT
    lines = written.splitlines()
    assert (lines[0], lines[1], lines[-1], len(lines)) == ("{", '"schema": "missionc.cover/1",', "}", len(TEXT) + 2)
    assert lines[4] == '"asked": ["drone[0]","drone[1]"],'


def test_it_is_read_back_as_it_was() -> None:
    read = read_cover(json.dumps(TEXT), MISSION)
    assert document(read, MISSION) == document(COVER, MISSION)
    assert (read.conflict, read.asked, read.apart) == (COVER.conflict, (0, 1), True)
    assert [kind.agents for kind in read.kinds] == [(2, 0), (1,)]
    assert read.kind_of(0) is read.kind_of(2) is read.kinds[0]
    assert (read.cells, len(read.kinds[0]), read.kinds[0].points) == (5, 3, 1)
    assert [label.agents for label in read.labels] == [(1,), (0,), (0, 1)]
    assert read.labels[0].never_true.tolist() == [True, False]
    low, high, most = read.at_most[0]
    assert (low.tolist(), high.tolist(), most) == ([0.0, 0.0], [1.0, 0.5], 1)
    assert read_cover(json.dumps({**TEXT, "apart": 1}), MISSION).apart is False


def changed(*path: str | int, to: Any) -> str:
    text = json.loads(json.dumps(TEXT))
    place = text
    for each in path[:-1]:
        place = place[each]
    if to is KeyError:
        del place[path[-1]]
    else:
        place[path[-1]] = to
    return json.dumps(text)


NONE = "not a cover of this mission: "
NOWHERE = "an empty box, or a box outside the world"


def test_what_does_not_fit_is_refused_with_its_reason(subtests: pytest.Subtests) -> None:
    for text, said in [
        (
            changed("schema", to="missionc.cover/2"),
            "its schema is not missionc.cover/1, or it belongs to another mission",
        ),
        (changed("mission", to="other"), "its schema is not missionc.cover/1, or it belongs to another mission"),
        (changed("kinds", 1, "agents", to=["drone[0]"]), "not every agent is of one kind"),
        (changed("kinds", to=TEXT["kinds"][:1]), "not every agent is of one kind"),
        (changed("kinds", 1, "agents", to=[]), "a kind without agents"),
        (changed("kinds", 0, "agents", to=["drone[0]", "drone[0]"]), "an agent twice"),
        (changed("not_together", 0, "agents", to=["drone[0]", "drone[2]"]), "an unexpected pair of agents"),
        (changed("kinds", 0, "points", to=4), "points that are not cells"),
        (changed("kinds", 0, "points", to=-1), "points that are not cells"),
        (changed("kinds", 0, "points", to=True), "points that are not cells"),
        (changed("kinds", 0, "no_move", to={"3": [[]] * 3}), "more steps than the mission has"),
        (changed("kinds", 0, "no_move", to={"0": [[]] * 3}), "more steps than the mission has"),
        (changed("kinds", 0, "no_move", to={"01": [[]] * 3}), "more steps than the mission has"),
        (changed("kinds", 0, "no_move", "1", to=[[], []]), "rows for unknown cells"),
        (changed("kinds", 0, "no_move", "1", 0, to=[3]), "an unknown cell"),
        (changed("kinds", 0, "no_move", "1", 0, to=[-1]), "an unknown cell"),
        (changed("kinds", 0, "no_move", "1", 0, to=[True]), "an unknown cell"),
        (changed("absent", "drone[1]", to=[[], []]), "rows for unknown cells"),
        (changed("not_both", "drone[0]", to=[[], []]), "rows for unknown cells"),
        (changed("labels", 0, "agents", to=NAMES[:2]), "a label with the wrong agents"),
        (changed("labels", 2, "agents", to=NAMES[:1]), "a label with the wrong agents"),
        (changed("labels", 0, "leaf", to=7), "an entry that is not a text"),
        (changed("conflict", to=["visit", None]), "an entry that is not a text"),
        (changed("at_most", 0, "agents", to=-1), "an invalid number of agents"),
        (changed("at_most", 0, "agents", to=1.0), "an invalid number of agents"),
        (changed("at_most", 0, "box", to=[[0, 0], [-1, 1]]), NOWHERE),
        (changed("kinds", 0, "cells", 0, to=[[0, 0], [1e13, 1]]), NOWHERE),
        (
            changed("bodies", to={"obstacle 0": [[[0, -1e13], [1, 1]]]}),
            "an empty box, or a box outside the world",
        ),
        (changed("absent", "stranger", to=[]), "'stranger'"),
        (changed("labels", 0, "of", to="words"), "'words'"),
        (changed("labels", to=KeyError), "'labels'"),
        ("[]", ""),
    ]:
        with subtests.test(text=text, said=said):
            with pytest.raises(Unreadable) as found:
                read_cover(text, MISSION)
            assert str(found.value).startswith(NONE + said)
            assert not said or str(found.value) == NONE + said


def test_what_is_no_document_is_refused() -> None:
    with pytest.raises(Unreadable, match="not JSON"):
        read_cover("{", MISSION)


@pytest.mark.parametrize(
    ("limit", "most", "what"),
    [
        ("MOST_CELLS", 3, "cells"),
        ("MOST_THIRDS", 3, "cells"),
        ("MOST_BOXES", 3, "boxes"),
        ("MOST_ROOMS", 1, "boxes"),
        ("MOST_CHOICES", 1, "choices of agents"),
    ],
)
def test_no_more_is_read_than_anybody_looks_at(
    monkeypatch: pytest.MonkeyPatch, limit: str, most: int, what: str
) -> None:
    monkeypatch.setattr(cover_document, limit, most)
    assert read_cover(json.dumps(TEXT), MISSION).cells == 5
    monkeypatch.setattr(cover_document, limit, most - 1)
    with pytest.raises(Unreadable) as found:
        read_cover(json.dumps(TEXT), MISSION)
    assert str(found.value) == f"{NONE}too many {what}"


def test_one_more_than_fit_is_chosen_of_those_who_are_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two have two choices of one, and one of two."""
    none = changed("at_most", 0, "agents", to=0)
    monkeypatch.setattr(cover_document, "MOST_CHOICES", 1)
    with pytest.raises(Unreadable):
        read_cover(none, MISSION)
    monkeypatch.setattr(cover_document, "MOST_CHOICES", 2)
    assert read_cover(none, MISSION).at_most[0][2] == 0


def test_two_bodies_and_rooms_are_counted_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cover_document, "MOST_ROOMS", 1)
    for text in (
        changed("at_most", to=TEXT["at_most"] * 2),
        changed("bodies", "obstacle 0", to=TEXT["bodies"]["obstacle 0"] * 2),
    ):
        with pytest.raises(Unreadable, match="too many boxes"):
            read_cover(text, MISSION)

"""What of a written certificate may differ from the computed one, by how much, and what it is refused for."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from missionc.base.trace import Array, Indices
from missionc.geometry.curves.bernstein_intervals import Enclosed
from missionc.output.documents.certificate_json import certificate_json
from missionc.verification.certificate import CERTAIN, Between, Certificate, Check, Delay, Figure, Verdict
from missionc.verification.check_certificate import check_certificate
from missionc.verification.proof.branch_and_bound import SHARE, Claim
from missionc.verification.proof.proof_boxes import Boxes

FAR = 0.8
"""The least distance that is proved, in the first piece; in the second it is larger."""
WORST = FAR - (CERTAIN + SHARE * FAR)
"""The least that may be stated for it."""


def curve(item: Indices) -> Enclosed:
    return Enclosed(np.where(item == 0, FAR, 2 * FAR)[:, None, None], np.zeros((item.size, 1)))


def judge(item: Indices, within: Enclosed) -> tuple[Array, Array, Array]:
    least = within.points[:, 0, 0]
    return least, least, np.zeros(item.size)


PAIR = Claim("separation", "all pairs", "m", 1e-9, "", np.array([[0, 1]]), np.array([0.0, 2.0, 4.0]), curve, judge, 0.0)
CERTIFICATE = Certificate(
    "small",
    (
        Check("separation", "all pairs", FAR, "m", 1e-9, True, 2.0, ("a", "b")),
        Check("obstacle", "pillar", 1.0, "m", 1e-9, True, 3.0, ("a",)),
        Check("speed", "a", 1e-6, "m/s", 1e-6, True, 1.0, ("a",)),
        Check("finish", "all agents", 0.0, "m", 1e-6, True),
    ),
    (Figure("length", "a", 3.5, "m", 1.0, ("a",)),),
    ("it is far",),
    (Between("stay", Verdict.HOLDS), Between("meet", Verdict.FAILS, 1.0, 1.5, ("a",), "`a` leaves")),
    (Boxes(PAIR, ((0.0, 1.0, 2.0),), ((FAR, FAR),)),),
    (),
    (Delay("a", 1.0, False, "separation", "all pairs", 2.0, ("a", "b")),),
)


def refused(*changes: tuple[tuple[str | int, ...], Any]) -> dict[str, str]:
    """The parts that are refused, with the reason, where these places say something else. ``KeyError``: nothing."""
    text = json.loads(certificate_json(CERTIFICATE, "abc"))
    for (*path, last), value in changes:
        place = text
        for each in path:
            place = place[each]
        if value is KeyError:
            del place[last]
        else:
            place[last] = value
    checks = check_certificate(json.dumps(text), "abc", CERTIFICATE)
    assert [check.name for check in checks] == ["certificate"] * len(checks)
    assert {check.detail for check in checks if check.passed} <= {"its contents match the files"}
    return {check.subject: check.detail for check in checks if not check.passed}


def test_a_certificate_as_it_was_written_passes() -> None:
    assert refused() == {}


@pytest.mark.parametrize(
    "changes",
    [
        # A time is written to a millionth.
        [(("checks", 0, "at"), 2.0 + 1.9e-6)],
        [(("checks", 0, "at"), 2.0 - 1.9e-6)],
        [(("between_steps", 1, "at"), 1.0 + 1.9e-6)],
        [(("delays", 0, "at"), 2.0 - 1.9e-6)],
        # A proved margin may be as much worse as a proof may fall short.
        [(("checks", 0, "margin"), WORST + 1e-9)],
        # What is met to rounding may be tightest at any time, and of anybody.
        [(("checks", 2, "at"), 0.0)],
        [(("checks", 2, "at"), 4.0)],
        [(("checks", 2, "agents"), ["b"])],
        # Numbers that differ by rounding are the same.
        [(("checks", 1, "margin"), 1.0 + 0.9e-8)],
        [(("figures", 0, "value"), 3.5 + 3e-8)],
        [(("boxes", 0, "times", 1), 2.0 + 1.9e-8)],
        # Boxes may be finer, and prove less, as long as they prove the margin.
        [(("boxes", 0, "ends", 0), [0, 0.5, 1, 2]), (("boxes", 0, "bounds", 0), [FAR, FAR, FAR])],
        [(("boxes", 0, "bounds", 0, 0), FAR - 0.9e-12)],
        [(("boxes", 0, "bounds", 0, 0), WORST), (("checks", 0, "margin"), WORST)],
    ],
)
def test_what_may_differ_passes(changes: list[tuple[tuple[str | int, ...], Any]]) -> None:
    assert refused(*changes) == {}


PARTS = "its checks and figures do not match the files"
MISSING = "its keys do not match"
TIMES = "separation of all pairs: its times do not match the flight"
COVER = "separation of all pairs: its boxes do not cover the flight"
BOXES = "boxes are missing for a check along the flight"
UNPROVED = "separation of all pairs: its boxes do not prove its margin"
BETWEEN = "its verdicts between samples do not match the files"
DELAYS = "its delay tolerances do not match the files"


def test_what_differs_is_refused_with_its_reason(subtests: pytest.Subtests) -> None:
    for path, value, part, reason in [
        (("mission",), "large", "head", "its `mission` does not match the folder"),
        (("plan_sha256",), "abd", "head", "its `plan_sha256` does not match the folder"),
        (("passed",), False, "head", "its `passed` does not match the folder"),
        (("more",), 1, "head", "unexpected entry `more`"),
        (("warnings",), [], "warnings", "its warnings are incomplete"),
        (("checks",), {}, "checks", "an entry is missing"),
        (("checks", 3), [], "checks", "an entry is missing"),
        (("checks", 3), KeyError, "checks", PARTS),
        (("checks", 3, "name"), "start", "checks", PARTS),
        (("checks", 1, "subject"), "wall", "checks", PARTS),
        (("figures",), [], "figures", PARTS),
        (("checks", 3, "detail"), KeyError, "checks", f"finish of all agents: {MISSING}"),
        (("checks", 3, "more"), 1, "checks", f"finish of all agents: {MISSING}"),
        (
            ("checks", 1, "at"),
            3.0 + 2.1e-6,
            "checks",
            "obstacle of pillar: its `at` is 3.0000021, but the files give 3",
        ),
        (
            ("checks", 1, "at"),
            3.0 - 2.1e-6,
            "checks",
            "obstacle of pillar: its `at` is 2.9999979, but the files give 3",
        ),
        (("checks", 1, "at"), None, "checks", "obstacle of pillar: its `at` is null, but the files give 3"),
        (("checks", 2, "at"), -1e-9, "checks", "speed of a: its `at` is -1e-09, but the files give 1"),
        (("checks", 2, "at"), 4.0001, "checks", "speed of a: its `at` is 4.0001, but the files give 1"),
        (("checks", 2, "at"), None, "checks", "speed of a: its `at` is null, but the files give 1"),
        (
            ("checks", 1, "agents"),
            ["b"],
            "checks",
            "obstacle of pillar: its `agents[0]` is `b`, but the files give `a`",
        ),
        (("checks", 2, "agents"), ["c"], "checks", "speed of a: its `agents[0]` is `c`, but the files give `a`"),
        (("checks", 2, "agents"), ["a", "b"], "checks", "speed of a: its `agents` has 2 entries"),
        (("checks", 2, "agents"), "a", "checks", "speed of a: its `agents` is `a`, not a list"),
        (("checks", 0, "margin"), FAR + 2e-8, "checks", "separation of all pairs: its `margin` is 0.80000002"),
        (("checks", 0, "margin"), WORST - 2e-8, "checks", "separation of all pairs: its `margin` is 0.79918"),
        (("checks", 0, "margin"), None, "checks", "separation of all pairs: its `margin` is null"),
        (("checks", 1, "margin"), 1.0 - 2e-8, "checks", "obstacle of pillar: its `margin` is 0.99999998"),
        (("checks", 1, "tolerance"), 1e-3, "checks", "obstacle of pillar: its `tolerance` is 0.001"),
        (("checks", 1, "unit"), "cm", "checks", "obstacle of pillar: its `unit` is `cm`"),
        (
            ("checks", 1, "passed"),
            False,
            "checks",
            "obstacle of pillar: its `passed` is false, but the files give true",
        ),
        (("figures", 0, "value"), 3.5 - 4e-8, "figures", "length of a: its `value` is 3.49999996"),
        (("figures", 0, "at"), 0.5, "figures", "length of a: its `at` is 0.5"),
        (("figures", 0, "agents"), ["b"], "figures", "length of a: its `agents[0]` is `b`"),
        (("between_steps",), None, "between_steps", BETWEEN),
        (("between_steps", 0), KeyError, "between_steps", BETWEEN),
        (("between_steps", 0), 1, "between_steps", BETWEEN),
        (("between_steps", 0, "at"), 1.0, "between_steps", BETWEEN),
        (("between_steps", 1, "at"), 1.0 + 2.1e-6, "between_steps", BETWEEN),
        (("between_steps", 1, "verdict"), "holds throughout", "between_steps", BETWEEN),
        (("between_steps", 1, "more"), 1, "between_steps", BETWEEN),
        (("delays",), {}, "delays", DELAYS),
        (("delays", 0, "tolerated"), 2.0, "delays", DELAYS),
        (("delays", 0, "at"), KeyError, "delays", DELAYS),
        (("boxes",), None, "boxes", BOXES),
        (("boxes",), [], "boxes", BOXES),
        (("boxes", 0), [], "boxes", BOXES),
        (("boxes", 0, "check"), "speed", "boxes", BOXES),
        (("boxes", 0, "of"), "all", "boxes", BOXES),
        (("boxes", 0, "unit"), "cm", "boxes", f"separation of all pairs: {MISSING}"),
        (("boxes", 0, "unit"), KeyError, "boxes", f"separation of all pairs: {MISSING}"),
        (("boxes", 0, "more"), 1, "boxes", f"separation of all pairs: {MISSING}"),
        (("boxes", 0, "times"), KeyError, "boxes", f"separation of all pairs: {MISSING}"),
        (("boxes", 0, "times"), None, "boxes", TIMES),
        (("boxes", 0, "times"), [0.0, 2.0], "boxes", TIMES),
        (("boxes", 0, "times"), [0.0, 2.0, 4.0, 6.0], "boxes", TIMES),
        (("boxes", 0, "times", 1), 2.0 + 3e-8, "boxes", TIMES),
        (("boxes", 0, "times", 1), "2", "boxes", TIMES),
        (("boxes", 0, "agents"), [[0, 2]], "boxes", "separation of all pairs: its boxes do not match the agents of"),
        (("boxes", 0, "ends"), [], "boxes", "separation of all pairs: it has boxes for 0 subjects instead of 1"),
        (("boxes", 0, "bounds"), [], "boxes", "separation of all pairs: it has bounds for 0 subjects instead of 1"),
        (("boxes", 0, "ends", 0), [], "boxes", COVER),
        (("boxes", 0, "bounds", 0), [], "boxes", COVER),
        (("boxes", 0, "ends", 0), [0, 1, True], "boxes", COVER),
        (("boxes", 0, "ends", 0), [0, 1], "boxes", COVER),
        (("boxes", 0, "ends", 0), [0.5, 1, 2], "boxes", COVER),
        (("boxes", 0, "ends", 0), [0, 1, 1.5], "boxes", COVER),
        (("boxes", 0, "ends", 0), [0, 2, 2], "boxes", f"{COVER} in order, at 4.00 s"),
        (("boxes", 0, "ends", 0), [0, 1 / 3, 2], "boxes", f"{COVER} in order, at 0.00 s"),
        (("boxes", 0, "bounds", 0, 0), FAR + 1e-9, "boxes", "separation of all pairs: the bound of its box at 0.00 s"),
        (("boxes", 0, "bounds", 0, 1), 3 * FAR, "boxes", "separation of all pairs: the bound of its box at 2.00 s"),
        (("boxes", 0, "bounds", 0, 1), FAR - 1.1e-12, "boxes", UNPROVED),
    ]:
        with subtests.test(path=path, value=value, part=part, reason=reason):
            found = refused((path, value))
            assert found[part].startswith(reason)
            assert part == "checks" or list(found) == [part]


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"schema": "missionc.certificate/1"}', '{"schema": 1, "schema": 2}'])
def test_what_is_no_certificate_is_refused_as_a_whole(text: str) -> None:
    (check,) = check_certificate(text, "abc", CERTIFICATE)
    assert (check.subject, check.passed) == ("schema", False)
    assert check.detail == "not a certificate of this version of the compiler"


def test_boxes_prove_the_margin_that_is_stated_for_their_check() -> None:
    changes = [(("checks", 0, "margin"), FAR + 1e-9), (("checks", 1, "margin"), 0.0)]
    assert refused(changes[0])["boxes"] == UNPROVED
    assert "boxes" not in refused(changes[1])
    assert refused((("checks", 0), KeyError))["boxes"] == UNPROVED
    assert refused((("checks",), None))["boxes"] == UNPROVED

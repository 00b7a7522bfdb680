"""What is proven of the best plan: bounds that are known by hand, where a search ends, and who may say so."""

from __future__ import annotations

import json
import time
from functools import cache
from pathlib import Path

import pytest

import missionc
from missionc.backends.api import Budget, Planned, Progress
from missionc.backends.load import load_engines
from missionc.backends.options import Options
from missionc.base.source import Source
from missionc.base.trace import Proven
from missionc.base.units import Seconds
from missionc.cli.summary import compiled_document, compiled_lines
from missionc.compiler.ask_cover import BoundSide
from missionc.compiler.results import Compiled, Verified
from missionc.tools.replay.reverify import reverify
from tests.support.forged_folders import Files, forged

ONE = """\
mission one
time step 1 s, horizon 12 s
world (0, 0) to (10, 4)
region a = box (5, 1) to (6, 3)
region b = box (8, 1) to (9, 3)
region c = box (0, 1) to (1.5, 3)
team r[1] { radius 0.1 m  dynamics single_integrator(speed <= 1 m/s)  start at (2, 2) }
"""

TWO = """\
mission two
time step 1 s, horizon 12 s
world (0, 0) to (10, 4)
region a = box (8, 0) to (10, 4)
region b = box (0, 0) to (2, 4)
team r[2] { radius 0.1 m  dynamics single_integrator(speed <= 1 m/s)  start at (2, 1), (4, 3) }
"""

WALL = "obstacle wall = box (3, 0) to (3.5, 3.2)\n"


def bound(text: str) -> BoundSide:
    checked = missionc.check(Source("bound.mission", text))
    assert checked.mission is not None, checked.findings
    assert checked.kernel is not None
    return BoundSide(checked.mission, checked.kernel, Options(), Budget(time.monotonic() + 60))


@pytest.mark.parametrize(
    ("text", "least"),
    [
        (ONE + "require go: r[0]: eventually[0, 12 s] a\n", 3),
        (ONE + "require go: r[0]: eventually[0, 12 s] b\nrequire back: r[0]: eventually[0, 12 s] c\n", 8),
        (ONE + "require go: r[0]: eventually[0, 9 s] b\nrequire back: r[0]: eventually[9 s, 12 s] c\n", 13),
        (ONE + WALL + "require go: r[0]: eventually[0, 12 s] a\n", 4),
        (ONE + "require go: r[0]: eventually[0, 12 s] a\nrequire slow: r[0]: always[0, end] speed <= 0.5\n", 6),
        (
            ONE
            + "require dwell: r[0]: eventually[0, 4 s] always[0, 4 s] a\nrequire back: r[0]: eventually[0, 12 s] c\n",
            11,
        ),
        (ONE + "require stay: r[0]: always[0, 5 s] x <= 3\nrequire go: r[0]: eventually[0, 12 s] a\n", 7),
        (TWO + "require go: every r: eventually[0, 12 s] a\n", 6),
        (TWO + "require go: some r: eventually[0, 12 s] a\nrequire back: some r: eventually[1 s, 12 s] b\n", 4),
        (TWO + "require swap: (r[0]: eventually[0, 12 s] a) and (r[1]: eventually[0, 12 s] b)\n", 6),
        (TWO + "require one: some r: eventually[7 s, 7 s] (a and next x <= 7.5)\n", 8),
    ],
)
def test_no_plan_is_over_before_a_number_of_steps_that_is_known_by_hand(text: str, least: int) -> None:
    found = bound(text + "minimize duration\n").enough(12)
    assert found <= least
    assert found >= least - 1


@pytest.mark.parametrize(
    ("text", "least"),
    [
        (ONE + "require go: r[0]: eventually[0, 12 s] a\n", 3.0),
        (ONE + "require go: r[0]: eventually[0, 12 s] b\nrequire back: r[0]: eventually[0, 12 s] c\n", 7.0),
        (ONE + "require back: r[0]: eventually[0, 3 s] c\nrequire go: r[0]: eventually[4 s, 12 s] b\n", 7.0),
        (ONE + WALL + "require go: r[0]: eventually[0, 12 s] a\n", 3.664),
        (TWO + "require go: every r: eventually[0, 12 s] a\n", 10.0),
        (TWO + "require go: some r: eventually[0, 12 s] a\nrequire back: r[1]: eventually[1 s, 12 s] b\n", 8.0),
    ],
)
def test_no_plan_is_shorter_than_metres_that_are_known_by_hand(text: str, least: float) -> None:
    found = bound(text + "minimize distance\n").enough(100.0)
    assert found == pytest.approx(least, abs=5e-3)


def test_nothing_is_said_of_the_best_plan_where_nothing_is_minimized() -> None:
    compiled = missionc.compile(Source("one.mission", ONE + "require go: r[0]: eventually[0, 12 s] a\n"))
    assert isinstance(compiled.outcome, Verified)
    assert compiled.outcome.plan.proven is None
    assert "proven" not in json.loads(dict(compiled.outcome.files)["plan.json"])
    assert compiled_document(compiled, "", [])["proven"] is None


def planned(objective: str) -> Compiled:
    text = ONE + f"require go: r[0]: eventually[0, 12 s] b\nminimize {objective}\n"
    compiled = missionc.compile(Source("one.mission", text), backend="smt")
    assert isinstance(compiled.outcome, Verified)
    return compiled


def test_a_plan_comes_with_what_is_proven_of_the_best() -> None:
    compiled = planned("duration")
    assert isinstance(compiled.outcome, Verified)
    proven = compiled.outcome.plan.proven
    assert proven is not None
    assert (proven.unit, proven.least) == ("s", 6.0)
    assert proven.value == compiled.outcome.plan.trace.lasts >= 6
    assert json.loads(dict(compiled.outcome.files)["plan.json"])["proven"] == proven.as_record()
    assert compiled_document(compiled, "", [])["proven"] == proven.as_record()
    assert f"  {proven}" in compiled_lines(compiled, "", Seconds(1.0), verbose=False)
    assert str(proven) in dict(compiled.outcome.files)["report.html"].decode()


def test_a_bound_reads_as_a_sentence() -> None:
    assert str(Proven(12.0, 11.0, "s", "cover")) == "duration 12 s, lower bound 11 s, optimality gap 8.33 %"
    assert str(Proven(12.0, 12.0, "s", "tours")) == "duration 12 s, optimal"
    assert str(Proven(27.1, 25.9, "m", "tours")) == "distance 27.1 m, lower bound 25.9 m, optimality gap 4.43 %"
    assert str(Proven(27.1, 27.09999, "m", "tours")) == "distance 27.1 m, optimal"


@pytest.mark.parametrize("objective", ["duration", "distance"])
@pytest.mark.parametrize("backend", ["smt", "clot"])
def test_a_search_for_a_better_plan_ends_where_none_is(backend: str, objective: str) -> None:
    if backend == "clot":
        pytest.importorskip("torch")
    checked = missionc.check(
        Source("one.mission", ONE + f"require go: r[0]: eventually[0, 12 s] b\nminimize {objective}\n"),
        backend=backend,
    )
    mission, kernel = checked.mission, checked.kernel
    assert mission is not None
    assert kernel is not None
    engine = load_engines((backend,), Options())
    said: list[Progress] = []
    asked: list[float] = []

    def enough(value: float) -> float:
        asked.append(value)
        return value

    assert not isinstance(engine, missionc.Diagnostic)
    outcome = engine.plan(
        mission, kernel, Options(), Budget(time.monotonic() + 60, on_progress=said.append, lower_bound=enough)
    )
    assert isinstance(outcome, Planned)
    assert asked
    if backend == "smt":
        assert not any(each.stage == "improve" for each in said)
    else:
        ends = {"duration": "; optimal", "distance": "the distance is optimal"}[objective]
        assert any(note.endswith(ends) for note in outcome.report.notes)


@cache
def soonest() -> Files:
    """The files of a plan of least duration."""
    outcome = planned("duration").outcome
    assert isinstance(outcome, Verified)
    return dict(outcome.files)


def test_a_bound_as_it_was_written_is_accepted(tmp_path: Path) -> None:
    certificate = reverify(forged(tmp_path, soonest())).certificate
    assert certificate is not None
    assert certificate.passed


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"least": 1e3}, "its lower bound 1000 s"),
        ({"least": 1e3, "by": "tours"}, "its lower bound 1000 s"),
        ({"least": 5.0, "by": "cover"}, "proven"),
        ({"least": 5.0}, "proven"),
        ({"value": 1e3}, "proven"),
        ({"by": "a guess"}, "proven"),
    ],
)
def test_a_bound_that_cannot_be_is_refused(change: dict[str, object], reason: str, tmp_path: Path) -> None:
    files = soonest()
    plan = json.loads(files["plan.json"])
    plan["proven"].update(change)
    certificate = reverify(forged(tmp_path / "wrong", {**files, "plan.json": json.dumps(plan).encode()})).certificate
    assert certificate is not None
    (failed,) = [check for check in certificate.failures if check.subject == "plan.json" or "plan.json" in check.name]
    assert reason in f"{failed.subject} {failed.detail}"


def test_what_a_cover_shows_is_read_back(tmp_path: Path) -> None:
    text = (
        ONE + "require stay: r[0]: always[0, 5 s] x <= 3\nrequire go: r[0]: eventually[0, 12 s] a\nminimize duration\n"
    )
    outcome = missionc.compile(Source("one.mission", text)).outcome
    assert isinstance(outcome, Verified)
    assert outcome.plan.proven is not None
    assert outcome.plan.proven.by == "cover"
    certificate = reverify(forged(tmp_path, dict(outcome.files))).certificate
    assert certificate is not None
    assert certificate.passed

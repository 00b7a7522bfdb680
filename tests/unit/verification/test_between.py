"""Requirements that the steps show and the moments between them do not, each with the time at which it happens."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from missionc.base.continuous_time import ContinuousTime
from missionc.base.diagnostics.code import NOT_BETWEEN
from missionc.base.source import Source
from missionc.base.trace import Trace
from missionc.base.units import Seconds
from missionc.cli.app import main
from missionc.compiler.driver import check, compile
from missionc.compiler.results import InvalidMission, Verified
from missionc.geometry.curves.piecewise_polynomials import Curves, motion
from missionc.ir.kernel.nodes import Atom
from missionc.ir.kernel.walk import postorder
from missionc.verification.between.between_steps import Culprit, between_steps, sentence
from missionc.verification.between.interval_sets import STEP, Motion
from missionc.verification.certificate import Between, Verdict

HEAD = """\
mission sample
time step 1 s, horizon 4 s
world (-5, -5) to (9, 9)
region gate = box (0, 0) to (1.2, 1.2)
region hall = box (0, 0) to (5, 5)
region pond = disc at (1, 0) radius 1 m
"""

TEAM = "team drone[{}] {{ radius 0.1 m  dynamics {}  start in hall }}\n"
STRAIGHT, CURVED = "single_integrator(speed <= 9 m/s)", "double_integrator(speed <= 9 m/s, acceleration <= 9 m/s^2)"


def between(
    paths: list[list[tuple[float, float]]],
    *lines: str,
    velocities: list[list[tuple[float, float]]] | None = None,
) -> Between:
    """What becomes of the only requirement on paths of one point a second."""
    team = TEAM.format(len(paths), CURVED if velocities else STRAIGHT)
    found = check(Source("sample.mission", HEAD + team + "\n".join(lines) + "\n"))
    assert found.mission is not None, found.findings
    assert found.kernel is not None, found.findings
    position = np.array(paths, dtype=np.float64)
    velocity = np.zeros_like(position)
    velocity[:, :-1] = np.diff(position, axis=1)
    velocity[:, -1] = velocity[:, -2]
    if velocities:
        velocity = np.array(velocities, dtype=np.float64)
    trace = Trace(Seconds(1.0), position, velocity, np.zeros(position.shape[:2]))
    (result,) = between_steps(found.mission, found.kernel, trace, motion(found.mission, trace))
    return result


def lasts(found: Between, verdict: Verdict, begin: float, end: float) -> None:
    assert found.verdict is verdict, found
    assert found.at == pytest.approx(begin, abs=1e-3), found
    assert found.until == pytest.approx(end, abs=1e-3), found


def rest(*points: tuple[float, float]) -> list[tuple[float, float]]:
    """Those points, and from then on the last one."""
    return [*points, *[points[-1]] * (5 - len(points))]


def test_a_corner_that_is_cut_within_a_step_is_found() -> None:
    found = between([rest((3, 3), (2, 0), (0, 2), (0, 3))], "require out: every drone: always[0, 4 s] not gate")
    # (2 - 2t, 2t) is in the gate from 2 - 2t = 1.2 on and until 2t = 1.2.
    lasts(found, Verdict.FAILS, 1.4, 1.6)
    assert found.agents == ("drone[0]",)
    assert found.detail == (
        "`out` is true at every sample, but not between 1 s and 2 s: from 1.40 s to 1.60 s `gate` is true for drone[0]"
    )


def test_what_decides_at_a_step_is_not_said_to_fail_there() -> None:
    """A formula may fail between two steps by what is so at a step that its window comes to."""
    found = check(Source("sample.mission", HEAD + TEAM.format(1, STRAIGHT) + "require dry: every drone: not pond\n"))
    assert found.mission is not None
    assert found.kernel is not None
    position = np.full((1, 5, 2), 3.0)
    trace = Trace(Seconds(1.0), position, np.zeros_like(position), np.zeros((1, 5)))
    (pond,) = (node for node in postorder([found.kernel.requirements[0].formula]) if isinstance(node, Atom))
    culprit = Culprit(pond, 0, 2 * STEP, True, 2 * STEP, 2 * STEP, pond, True, False)
    says = sentence("dry", (culprit,), True, Motion(found.mission, motion(found.mission, trace)))
    assert says == ("`dry` is true at every sample, but not between samples: at 2.00 s `pond` is true for drone[0]")


def test_something_like_an_obstacle_that_is_passed_within_a_step_is_found() -> None:
    found = between([rest((-1, 3), (-1, 0.6), (2, 0.6))], "require out: every drone: always[0, 4 s] not touches(gate)")
    lasts(found, Verdict.FAILS, 1.3, 1.7667)


def test_a_link_that_is_stretched_between_two_steps_is_found() -> None:
    """A distance bulges where one of the two accelerates: 0.9 m + 0.8 t (1 - t) is 1 m at t = 0.146 and 0.854."""
    still, swing = [(0.0, 0.0)] * 5, [(0.9, 0.0)] * 5
    # From a velocity of 0.8 back to the place it left, under constant acceleration.
    velocities = [still, [(0.0, 0.0), (0.8, 0.0), (0.0, 0.0), (0.0, 0.0), (0.0, 0.0)]]
    found = between(
        [still, swing],
        "graph radio = proximity 1 m",
        "require linked: every drone: always[0, 2 s] (hall reach[hops 1..1 on radio] hall)",
        velocities=velocities,
    )
    lasts(found, Verdict.FAILS, 1.1464, 1.8536)
    assert "drone[0] and drone[1] are 1.100 m apart, the radius of `radio` is 1 m" in found.detail
    again = between(
        [still, swing],
        "graph radio = proximity 1 m",
        "require linked: always[0, 2 s] connected(radio)",
        velocities=velocities,
    )
    lasts(again, Verdict.FAILS, 1.1464, 1.8536)
    assert "`connected(radio)` is false: drone[0] and drone[1] are 1.100 m apart" in again.detail


def test_a_sight_that_is_lost_between_two_steps_is_found() -> None:
    """One of two passes behind a post, 0.2 m wide as seen from 1 m away, at 4 m/s: from 0.4 to 0.6 of the step."""
    found = between(
        [rest((0.5, 0.5)), rest((2.5, -1.5), (2.5, 2.5))],
        "obstacle post = box (1.499, 0.3) to (1.5, 0.7)",
        "graph eyes = sight 9 m",
        "require seen: always[0, 1 s] connected(eyes)",
    )
    lasts(found, Verdict.FAILS, 0.4, 0.6)
    assert "2.000 m apart, the radius of `eyes` is 9 m, and an obstacle blocks the line of sight" in found.detail


def test_a_formation_that_closes_between_two_steps_is_found() -> None:
    """Two that change places are |1 - 2t| apart, which is less than 0.7 from t = 0.15 to 0.85."""
    found = between(
        [rest((0, 0), (1, 0)), rest((1, 0), (0, 0))],
        "formation row = chain of drone spacing 1 m tolerance 0.3 m",
        "require shape: always[0, 4 s] row",
    )
    lasts(found, Verdict.FAILS, 0.15, 0.85)
    assert found.agents == ("drone[0]", "drone[1]")
    assert found.detail.endswith("from 0.15 s to 0.85 s `row` is false")


def test_the_words_of_an_operator_are_judged_as_a_whole() -> None:
    """`everywhere` is the denial of a route; what is said is of the words in the mission."""
    found = between(
        [rest((3, 3), (2, 0), (0, 2), (0, 3)), rest((3, 3))],
        "graph radio = proximity 9 m",
        "require dry: drone[1]: always[0, 4 s] everywhere[hops 0..1 on radio] not gate",
    )
    lasts(found, Verdict.FAILS, 1.4, 1.6)
    assert "`everywhere[hops 0..1 on radio] not gate` is false for drone[1]" in found.detail


def test_until_fails_where_what_holds_is_broken_before() -> None:
    found = between(
        [rest((3, 3), (2, 0), (0, 2), (-1, -1))], "require first: drone[0]: not gate until[0, 4 s] x < -0.5"
    )
    lasts(found, Verdict.FAILS, 1.4, 1.6)


AT_THE_END = (
    "(next not gate) until[4 s, 4 s] hall",
    "(next not gate) until[4 s, end] hall",
    "(eventually[1 s, 2 s] not gate) until[3 s, 3 s] hall",
    "(always[0, 2 s] not gate) until[3 s, 3 s] hall",
    "((next not gate) until[1 s, 2 s] (next hall)) until[2 s, 2 s] next hall",
    "not ((next gate) release[4 s, 4 s] not hall)",
    "next ((next not gate) until[3 s, 3 s] hall)",
    "eventually[0, 1 s] ((next not gate) until[3 s, 3 s] hall)",
    "always[0, 1 s] ((next not gate) until[2 s, 3 s] hall)",
    "(always[0, 90 s] gate) until[0, 0] hall",
)
"""Formulas whose left sides look past the horizon from moments after the last step at which they are asked."""


@pytest.mark.parametrize("formula", AT_THE_END)
def test_what_would_look_past_the_mission_is_not_asked_between_the_steps(formula: str) -> None:
    path = rest((3, 3), (4, 3), (4, 4), (2, 4), (2, 3))
    line = f"require end: drone[0]: {formula}"
    assert between([path], line) == Between("end", Verdict.HOLDS)


def test_a_left_side_that_looks_ahead_fails_where_it_looks() -> None:
    found = between(
        [[(3, 3), (3, 3), (2, 0), (0, 2), (3, 3)]], "require end: drone[0]: (next not gate) until[4 s, 4 s] hall"
    )
    # The gate is cut from 2.4 s to 2.6 s; asked at 1.4 s to 1.6 s, `next` looks there.
    lasts(found, Verdict.FAILS, 2.4, 2.6)


def test_what_holds_at_every_moment_holds_throughout() -> None:
    path = rest((3, 3), (4, 3), (4, 4), (2, 4))
    for line in (
        "every drone: always[0, 4 s] hall",
        "every drone: eventually[0, 4 s] x >= 3.5",
        "every drone: always[0, 4 s] (x <= 4.5 and speed <= 2.5 m/s)",
        "every drone: always[0, 2 s] eventually[0, 2 s] x >= 3.2",
    ):
        assert between([path], f"require sound: {line}") == Between("sound", Verdict.HOLDS), line


def test_a_speed_jumps_at_a_step_and_is_that_of_what_begins() -> None:
    found = between([rest((0, 0), (1, 0), (3, 0), (3, 1))], "require slow: drone[0]: next speed >= 1.5 m/s")
    assert found.verdict is Verdict.HOLDS


def test_a_border_that_is_only_touched_is_not_decided() -> None:
    """The straight way along y = 1 is a tangent of the pond at x = 1."""
    found = between([rest((3, 3), (0, 1), (2, 1))], "require dry: every drone: always[0, 4 s] not pond")
    assert found.verdict is Verdict.UNDECIDED
    assert found.at is not None
    assert found.until is not None
    assert 1.49 < found.at < 1.5 < found.until < 1.51
    assert found.detail == (
        "`dry` is true at every sample; between samples it is not decided: from 1.49 s to 1.51 s `pond` for drone[0] "
        "is too close to its border to decide"
    )
    above = between([rest((3, 3), (0, 1.001), (2, 1.001))], "require dry: every drone: always[0, 4 s] not pond")
    assert above.verdict is Verdict.HOLDS
    below = between([rest((3, 3), (0, 0.9998), (2, 0.9998))], "require dry: every drone: always[0, 4 s] not pond")
    lasts(below, Verdict.FAILS, 1.4917, 1.5083)


def test_nobody_owns_the_moment_at_which_a_region_is_left() -> None:
    found = between([rest((3, 3), (7, 3))], "require stay: drone[0]: hall until[0, 4 s] not hall")
    assert found.verdict is Verdict.UNDECIDED
    assert found.at == pytest.approx(0.5, abs=1e-3)


def test_what_is_violated_at_the_steps_is_not_asked_between_them() -> None:
    found = check(
        Source("sample.mission", HEAD + TEAM.format(1, STRAIGHT) + "require in: drone[0]: always[0, 4 s] gate\n")
    )
    assert found.mission is not None
    assert found.kernel is not None
    times, places = np.arange(5.0), np.full((1, 5, 2), 3.0)
    trace = Trace(Seconds(1.0), places, np.zeros((1, 5, 2)), np.zeros((1, 5)))
    still = Curves(times, np.full((1, 4, 2, 1), 3.0))
    assert between_steps(found.mission, found.kernel, trace, still) == ()


LEAP = """\
mission leap
time  step 1 s, horizon 6 s
world (0, 0) to (6, 2)
region wall = box (2.9, 0) to (3.1, 2)
team drone[1] { radius 0.1 m  dynamics single_integrator(speed <= 2 m/s)  start at (1, 1)  finish at (5, 1) }
require avoid: every drone: always[0, 6 s] not wall
require fast:  some drone: eventually[0, 6 s] x >= 4.5
solve with clot
"""


def test_a_plan_that_leaps_over_a_wall_is_told_from_one_that_does_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("torch")
    monkeypatch.chdir(tmp_path)
    Path("leap.mission").write_text(LEAP, encoding="utf-8")
    refused = compile("leap.mission", continuous_time=ContinuousTime.REQUIRED)
    assert isinstance(refused.outcome, InvalidMission)
    assert [finding.code for finding in refused.findings] == [NOT_BETWEEN]
    assert main(["compile", "leap.mission", "--continuous", "-o", "none", "--quiet"]) == 1
    assert not Path("none").exists()
    capsys.readouterr()
    assert main(["compile", "leap.mission", "-o", "out"]) == 0
    (warned,) = [line for line in capsys.readouterr().out.splitlines() if "warning" in line]
    between = r"`avoid` is violated between samples \([\d.]+–[\d.]+ s\)"
    assert re.fullmatch(rf"  2 warnings: {between}; no vehicle set, so .*", warned)
    assert main(["verify", "out"]) == 0
    assert re.search(rf"\n  warning: {between}\n", capsys.readouterr().out)
    assert main(["verify", "out", "-v"]) == 0
    note = next(line for line in capsys.readouterr().out.splitlines() if line.startswith("note: `avoid`"))
    avoid, fast = json.loads(Path("out/certificate.json").read_text(encoding="utf-8"))["between_steps"]
    assert (avoid["verdict"], fast["verdict"]) == ("fails between", "holds throughout")
    assert note == f"note: {avoid['detail']}"
    assert main(["monitor", "leap.mission", "out/plan.json"]) == 0
    assert main(["monitor", "leap.mission", "out/plan.json", "--continuous"]) == 3


def test_a_roadmap_plan_that_leaps_is_replaced_by_one_that_holds_between_samples(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    way_round = LEAP.replace("(3.1, 2)", "(3.1, 1.2)").replace("step 1 s", "step 0.5 s").replace("clot", "smt")
    Path("leap.mission").write_text(way_round, encoding="utf-8")
    first = compile("leap.mission", continuous_time=ContinuousTime.AT_STEPS)
    assert isinstance(first.outcome, Verified)
    assert first.outcome.certificate.at_steps_alone
    found = compile("leap.mission")
    assert isinstance(found.outcome, Verified)
    assert not found.outcome.certificate.at_steps_alone
    assert "planned with `avoid` strengthened between samples" in found.outcome.report.notes


def test_flags_that_ask_for_more_and_for_no_more_than_the_steps_are_not_given_together(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("leap.mission").write_text(LEAP, encoding="utf-8")
    assert main(["compile", "leap.mission", "--continuous", "--at-steps"]) == 2
    assert "`--continuous` and `--at-steps` exclude each other; remove one of them" in capsys.readouterr().err

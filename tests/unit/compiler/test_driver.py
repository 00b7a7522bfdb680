"""The pipeline: which stage stops it, and in which order findings come."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from missionc.backends.api import Budget, Impossible, NotFound, Reason, Report
from missionc.backends.options import Options
from missionc.base.diagnostics.code import CODES
from missionc.base.source import Source
from missionc.compiler import driver
from missionc.compiler.plan_request import PlanRequest
from missionc.compiler.results import Compiled, Verified
from tests.support.one_turn import OneTurn
from tests.support.small_missions import LATE, SMALL

pytestmark = pytest.mark.usefixtures("coarse_covers")


def names(text: str) -> list[str]:
    return [finding.code.name for finding in driver.check(Source("a.mission", text)).findings]


def test_a_syntax_error_keeps_names_from_being_looked_up() -> None:
    assert names(SMALL.replace("] goal", "] gaol").replace("world (0", "world 0")) == ["MC001"]


def test_an_unknown_name_keeps_the_checks_from_running() -> None:
    assert set(names(LATE.replace("in base", "in bees"))) == {"MC101", "MC103"}


def test_all_checks_of_the_mission_as_meant_run_together_and_in_file_order() -> None:
    text = LATE.replace("(2.2, 2.2) to (3.8, 3.8)", "(6.2, 6.2) to (7, 7)")
    text = text.replace("start    in base", "start at (1, 1), (1, 1)")
    assert names(text) == ["MC103", "MC504", "MC503", "MC301"]


def test_no_more_findings_are_shown_than_anybody_reads_and_the_last_says_how_many_more_there_are() -> None:
    unused = "\n".join(f"param p{index} = 1" for index in range(300))
    findings = driver.check(Source("a.mission", f"{SMALL}{unused}\nrequire nobody: every drown: goal")).findings
    assert len(findings) == 100
    assert findings[-1].code.name == "MC101", "errors come before warnings"
    assert findings[-1].notes[-1] == "201 more findings are not shown"
    assert not any("not shown" in note for finding in findings[:-1] for note in finding.notes)


def test_findings_of_several_checks_are_counted_together() -> None:
    # Each window is too long, each region unused and outside the world.
    late = "\n".join(f"require late{index}: every drone: eventually[1 s, 9 s] base" for index in range(60))
    away = "\n".join(f"region away{index} = box (9, 9) to (9.5, 9.5)" for index in range(60))
    findings = driver.check(Source("a.mission", f"{SMALL}{late}\n{away}\n")).findings
    assert len(findings) == 100
    assert findings[-1].notes[-1] == "80 more findings are not shown"


def test_warnings_stop_nothing() -> None:
    checked = driver.check(Source("a.mission", SMALL + "region spare = box (0, 0) to (1, 1)\n"))
    assert [finding.code.name for finding in checked.findings] == ["MC103"]
    assert checked.ok
    assert checked.kernel is not None


def test_findings_of_an_included_file_come_after_those_of_the_mission(tmp_path: Path) -> None:
    (tmp_path / "site.mission").write_text("region spare = box (0, 0) to (1, 1)\n")
    main = tmp_path / "a.mission"
    main.write_text('include "site.mission"\n' + SMALL + "beacon lost = (1, 1)\n")
    findings = driver.check(main).findings
    places = [finding.primary.span.source.name for finding in findings if finding.primary]
    assert places == [str(main), str(tmp_path / "site.mission")]


def test_every_stage_is_timed() -> None:
    stages = [stage for stage, _ in driver.check(Source("a.mission", SMALL)).seconds]
    assert stages == ["parse", "resolve", "expand", "check"]


class Oracle(OneTurn):
    """A backend that gives one answer to everything."""

    name = "smt"
    refutes = True

    def __init__(self, answer: Impossible | NotFound) -> None:
        self.answer = answer

    def plan(self, *arguments: object) -> Impossible | NotFound:
        return self.answer


def answered(answer: Impossible | NotFound, monkeypatch: pytest.MonkeyPatch) -> Compiled:
    monkeypatch.setattr(driver, "load_backend", lambda *arguments: Oracle(answer))
    checked = driver.check(Source("a.mission", SMALL))
    return driver.plan(checked, PlanRequest(Budget(time.monotonic() + 60)))


@pytest.mark.parametrize(
    ("reason", "code"),
    [
        (Reason.TIME, "MC602"),
        (Reason.MEMORY, "MC603"),
        (Reason.NO_ROADMAP, "MC605"),
        (Reason.SIZE, "MC606"),
        (Reason.SOLVER, "MC607"),
    ],
)
def test_every_reason_of_an_undecided_search_has_its_code(
    reason: Reason, code: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    compiled = answered(NotFound(reason, "after 3 rounds", Report()), monkeypatch)
    assert compiled.findings[-1].code is CODES[code]
    assert compiled.findings[-1].notes == (
        "after 3 rounds",
        "`--backend clot` can also plan this mission",
        "a plan may still exist",
    )


def test_a_conflict_is_shown_at_the_requirements_it_rests_on(monkeypatch: pytest.MonkeyPatch) -> None:
    finding = answered(Impossible(("visit",), "on 40 nodes", Report()), monkeypatch).findings[-1]
    assert finding.code is CODES["MC601"]
    assert finding.message == "`visit` cannot be satisfied on the roadmap"
    assert finding.primary is not None
    assert finding.primary.span.text.startswith("require visit")


def test_a_conflict_of_motion_alone_points_at_the_time(monkeypatch: pytest.MonkeyPatch) -> None:
    finding = answered(Impossible((), "on 40 nodes", Report()), monkeypatch).findings[-1]
    assert finding.message == "no plan exists on the roadmap, even without the requirements"
    assert finding.primary is not None
    assert finding.primary.span.text.startswith("time step")


def test_why_there_is_no_proof_of_a_refusal_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    report = Report(notes=("no proof was written: the time limit was reached",))
    finding = answered(Impossible(("visit",), "on 40 nodes", report, smallest=True), monkeypatch).findings[-1]
    assert finding.notes[:2] == ("on 40 nodes", "no proof was written: the time limit was reached")


def test_requirements_are_kept_by_a_margin_where_they_can_be() -> None:
    outcome = driver.compile(Source("a.mission", SMALL), options=Options(margin=0.2)).outcome
    assert isinstance(outcome, Verified)
    assert outcome.plan.judgements[0].robustness >= 0.2
    assert not any("robustness margin" in note for note in outcome.report.notes)
    assert b'"margin": "0.2"' in dict(outcome.files)["manifest.json"]


def test_where_no_plan_has_the_margin_any_plan_will_do_and_is_said() -> None:
    text = SMALL + "require edge: drone[0]: eventually[0, 6 s] x >= 3.4\n"
    outcome = driver.compile(Source("a.mission", text), options=Options(margin=1.0)).outcome
    assert isinstance(outcome, Verified)
    note, limit = [each for each in outcome.report.notes if "margin" in each]
    assert note.startswith("no plan was found with a robustness margin of 100 cm; this plan was found with ")
    assert limit.startswith("robustness margin 40 cm for `goal`, not ")

"""Attempts of a compilation: the folder lists them, and verification accepts folders with and without them."""

from __future__ import annotations

import json
import time
from functools import cache
from pathlib import Path

import pytest

from missionc.backends.api import Budget
from missionc.base.source import Source
from missionc.compiler import driver, strategy
from missionc.compiler.plan_request import PlanRequest, StageLog
from missionc.compiler.redraw import with_attempts
from missionc.compiler.results import Compiled, Verified
from missionc.output.folder.write_folder import write_folder
from missionc.tools.replay.reverify import Reverified, reverify
from tests.support.small_missions import SMALL


@cache
def compiled() -> Compiled:
    return driver.compile(Source("a.mission", SMALL))


def verified() -> Verified:
    outcome = compiled().outcome
    assert isinstance(outcome, Verified)
    return outcome


def written(plan: Verified, folder: Path) -> Reverified:
    assert write_folder(folder, plan.files, force=False) is None
    return reverify(folder)


def stages(plan: Verified) -> list[dict[str, object]]:
    return list(json.loads(plan.files["plan.json"]).get("stages", []))


def test_the_attempts_are_those_of_the_strategy_in_its_order() -> None:
    rows, checked = stages(verified()), compiled().checked
    planned = strategy.stages(checked, PlanRequest(Budget(time.monotonic() + 60)))
    tries = [each.rpartition("; ")[0] for each in planned[0].tries]
    tried = list(dict.fromkeys(row["attempt"] for row in rows if row["stage"] == "search"))
    assert tried == tries[: len(tried)]
    assert rows[-1] == {
        "stage": "verify",
        "attempt": "",
        "engine": verified().plan.backend,
        "work": 0.0,
        "outcome": "passed",
        "then": "result",
    }
    assert [row["then"] for row in rows[:-1]] == [row["stage"] for row in rows[1:]]


def test_the_work_is_that_of_the_report() -> None:
    searched = [row for row in stages(verified()) if row["outcome"] == "plan found"]
    assert [row["stage"] for row in searched] == ["search", "margins"]
    works = [row["work"] for row in searched if isinstance(row["work"], float)]
    assert sum(works) == pytest.approx(verified().report.work, abs=1e-3)


def test_attempts_after_the_certification_are_in_every_document(tmp_path: Path) -> None:
    log = StageLog(list(verified().plan.runs))
    log.add("continuous time", "clot", 2.0, "no plan was found near the motion", "repair of the first plan")
    later = with_attempts(compiled().checked, verified(), log)
    assert stages(later)[-1]["stage"] == "continuous time"
    shown = later.files["report.html"].decode().partition('id="data">')[2].partition("</script>")[0]
    assert json.loads(shown)["stages"] == stages(later)
    assert written(later, tmp_path / "out").passed


def test_a_folder_without_attempts_is_accepted(tmp_path: Path) -> None:
    older = with_attempts(compiled().checked, verified(), StageLog())
    assert stages(older) == []
    assert written(older, tmp_path / "out").passed


@pytest.mark.parametrize("entry", [{"work": -1.0}, {"work": "much"}, {"then": "the moon"}, {"more": 1}])
def test_a_record_that_no_compilation_writes_is_refused(tmp_path: Path, entry: dict[str, object]) -> None:
    assert written(verified(), tmp_path / "out").passed
    file = tmp_path / "out" / "plan.json"
    plan = json.loads(file.read_text())
    plan["stages"][0] |= entry
    file.write_text(json.dumps(plan))
    certificate = reverify(tmp_path / "out").certificate
    assert certificate is not None
    assert "plan.json" in {check.subject for check in certificate.failures}


def test_no_attempt_is_lost_when_a_log_is_shared_with_a_further_stage() -> None:
    log = StageLog()
    log.add("verify", "smt", 0.0, "passed")
    log.within("continuous time", "the same engine").searched("clot", verified_search())
    assert [(each.stage, each.attempt, each.engine) for each in log.runs] == [
        ("verify", "", "smt"),
        ("continuous time", "the same engine", "clot"),
    ]


def verified_search() -> driver.api.Planned:
    return driver.api.Planned(verified().plan.trace, driver.api.Report(work=1.0))

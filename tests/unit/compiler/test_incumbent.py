"""A verified plan is never lost: the folder is written first, and no later step that fails takes it away."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import NoReturn

import pytest

from missionc.backends.api import Budget, CutShort, NotFound, Outcome, Planned, Progress, Reason
from missionc.backends.options import Options
from missionc.backends.smt.backend import BACKEND
from missionc.base.continuous_time import ContinuousTime
from missionc.base.deadline import OutOfTime
from missionc.base.diagnostics.code import IMPROVEMENT_FAILED
from missionc.base.diagnostics.defect import improvement_failed
from missionc.base.source import Source
from missionc.base.units import Seconds
from missionc.cli import compile_request
from missionc.cli.app import main
from missionc.compiler import driver, incumbent, wider_margins
from missionc.compiler.alternatives import compare_options, search_alternatives
from missionc.compiler.front_end import Checked, check
from missionc.compiler.plan_request import PlanRequest
from missionc.compiler.results import Compiled, Impossible, Unverified, Verified
from missionc.compiler.run_limited import Ended
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from missionc.output.folder import write_folder
from missionc.output.folder.ownership import cannot_write
from missionc.verification.certificate import Between, Verdict
from tests.support.one_turn import OneTurn
from tests.support.small_missions import CONFLICT, SMALL

SHORTEST = SMALL + "minimize distance\n"


@pytest.fixture(autouse=True)
def no_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    """No search takes long enough to have its plan certified meanwhile, unless a test says otherwise.

    No margins are widened afterwards.
    """
    monkeypatch.setattr(incumbent, "PATIENCE", math.inf)
    monkeypatch.setattr(wider_margins, "widens", lambda *_: False)


@cache
def checked(text: str = SMALL) -> Checked:
    return check(Source("a.mission", text), backend="smt")


@cache
def first_plan() -> Planned:
    mission, kernel = checked().mission, checked().kernel
    assert mission is not None
    assert kernel is not None
    outcome = BACKEND.plan(mission, kernel, Options(), Budget(time.monotonic() + 60))
    assert isinstance(outcome, Planned)
    return outcome


def broken(*_: object, **__: object) -> NoReturn:
    raise IndexError("index 4 is out of bounds")


class Improving(OneTurn):
    """A backend that has a plan, and then does something else."""

    name, refutes = "smt", True

    def __init__(self, then: Callable[[Budget], Outcome]) -> None:
        self.then = then

    def plan(self, mission: Mission, kernel: Kernel, options: Options, budget: Budget) -> Outcome:
        budget.on_incumbent(first_plan())
        budget.on_progress(Progress("improve"))
        return self.then(budget)


def planned(text: str = SMALL, **more: object) -> tuple[Compiled, list[Compiled]]:
    """A compilation by the ``smt`` backend or its stand-in, and the plans that were secured on the way."""
    secured: list[Compiled] = []
    budget = Budget(time.monotonic() + 60)
    result = driver.plan(checked(text), PlanRequest(budget, secure=secured.append, **more))  # type: ignore[arg-type]
    return result, secured


def by(then: Callable[[Budget], Outcome], monkeypatch: pytest.MonkeyPatch) -> tuple[Compiled, list[Compiled]]:
    monkeypatch.setattr(driver, "load_backend", lambda *_: Improving(then))
    return planned()


def cut_short(compiled: Compiled) -> CutShort | None:
    """What ended the search, in the report and in the manifest alike."""
    assert isinstance(compiled.outcome, Verified)
    why = compiled.outcome.report.cut_short
    assert json.loads(dict(compiled.files)["manifest.json"])["cut_short"] == (why.value if why else None)
    return why


def failures(compiled: Compiled) -> list[str]:
    return [each.message for each in compiled.findings if each.code is IMPROVEMENT_FAILED]


def test_a_search_that_fails_while_it_improves_a_plan_gives_that_plan(monkeypatch: pytest.MonkeyPatch) -> None:
    result, _ = by(broken, monkeypatch)
    assert cut_short(result) is CutShort.DEFECT
    assert failures(result) == [
        f"improving the plan failed: internal error: IndexError at {Path(__file__).name}:"
        f"{broken.__code__.co_firstlineno + 1}"
    ]


def test_a_search_that_fails_before_there_is_a_plan_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    class Broken(Improving):
        plan = broken

    monkeypatch.setattr(driver, "load_backend", lambda *_: Broken(broken))
    with pytest.raises(IndexError):
        planned()


@pytest.mark.parametrize("reason", [Reason.SOLVER, Reason.SIZE, Reason.MEMORY])
def test_a_search_that_ends_without_a_better_plan_gives_the_one_it_had(
    reason: Reason, monkeypatch: pytest.MonkeyPatch
) -> None:
    result, _ = by(lambda _: NotFound(reason, reason.value, first_plan().report), monkeypatch)
    assert cut_short(result) is (CutShort.MEMORY if reason is Reason.MEMORY else CutShort.UNFINISHED)


def test_a_search_that_goes_on_has_its_plan_certified_and_secured_meanwhile(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(incumbent, "PATIENCE", 0.0)
    result, (secured,) = by(lambda _: first_plan(), monkeypatch)
    assert cut_short(secured) is CutShort.UNFINISHED
    assert cut_short(result) is None, "the search came to its end"
    assert set(secured.files) == set(result.files)


def test_a_quick_search_has_no_plan_certified_twice(monkeypatch: pytest.MonkeyPatch) -> None:
    result, secured = by(lambda _: first_plan(), monkeypatch)
    assert isinstance(result.outcome, Verified)
    assert secured == []


def last_certification(then: Callable[..., object], monkeypatch: pytest.MonkeyPatch) -> None:
    """Have the first plan certified while the search goes on, and the one after it not."""
    real, calls = driver.certify_plan, []

    def certify(*arguments: object) -> object:
        calls.append(arguments)
        return real(*arguments) if len(calls) == 1 else then(*arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(incumbent, "PATIENCE", 0.0)
    monkeypatch.setattr(driver, "certify_plan", certify)


@pytest.mark.parametrize("reason", [Reason.TIME, Reason.MEMORY])
def test_a_limit_in_the_last_certification_leaves_the_plan_before(
    reason: Reason, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object) -> NoReturn:
        raise MemoryError if reason is Reason.MEMORY else OutOfTime

    last_certification(interrupted, monkeypatch)
    result, (secured,) = by(lambda _: first_plan(), monkeypatch)
    assert cut_short(result) is CutShort(f"{reason.name.lower()} limit")
    assert result.outcome.plan.trace is secured.outcome.plan.trace  # type: ignore[union-attr]


def test_a_later_plan_that_does_not_pass_verification_leaves_the_plan_before(monkeypatch: pytest.MonkeyPatch) -> None:
    real = driver.certify_plan

    def unverified(*arguments: object) -> object:
        home = real(*arguments)  # type: ignore[arg-type]
        assert isinstance(home.outcome, Verified)
        return replace(home, outcome=Unverified(home.outcome.certificate, home.outcome.report))

    last_certification(unverified, monkeypatch)
    result, _ = by(lambda _: first_plan(), monkeypatch)
    assert cut_short(result) is CutShort.DEFECT
    assert isinstance(result.outcome, Verified)
    assert "a later plan failed verification; this is a bug, please report it" in result.outcome.report.notes


def test_a_later_plan_whose_files_cannot_be_made_leaves_the_plan_before(monkeypatch: pytest.MonkeyPatch) -> None:
    last_certification(broken, monkeypatch)
    result, _ = by(lambda _: first_plan(), monkeypatch)
    assert cut_short(result) is CutShort.DEFECT
    assert failures(result)[0].startswith("certifying a later plan failed: internal error: IndexError at ")


def test_options_are_compared_once_the_plan_is_secured_and_may_fail(monkeypatch: pytest.MonkeyPatch) -> None:
    secured_by_then: list[int] = []
    monkeypatch.setattr(driver, "weighs_options", lambda *_: True)
    monkeypatch.setattr(compare_options, "compare_options", lambda *_: secured_by_then.append(len(secured)) or broken())
    secured: list[Compiled] = []
    budget = Budget(time.monotonic() + 60)
    result = driver.plan(checked(SHORTEST), PlanRequest(budget, secure=secured.append))
    assert secured_by_then == [1]
    assert cut_short(secured[0]) is CutShort.UNFINISHED
    assert cut_short(result) is CutShort.DEFECT
    assert failures(result)[0].startswith("comparing options failed: internal error: IndexError at ")


def test_a_better_option_that_cannot_be_certified_leaves_the_plan_before(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(driver, "weighs_options", lambda *_: True)
    other = replace(first_plan(), report=replace(first_plan().report, cut_short=CutShort.SIGNAL))
    monkeypatch.setattr(compare_options, "compare_options", lambda *_: other)
    real, calls = driver.within, []

    def late_after_the_first_plan(moment: float, work: Callable[[], object]) -> object:
        calls.append(moment)
        return real(moment, work) if len(calls) <= 2 else Ended(Reason.TIME)

    monkeypatch.setattr(driver, "within", late_after_the_first_plan)  # called to plan, to certify, to certify again
    result, _ = planned(SHORTEST)
    assert len(calls) == 3
    assert cut_short(result) is CutShort.TIME


@pytest.mark.parametrize(
    ("module", "name", "more", "says"),
    [
        (driver, "plan_in_continuous_time", {}, "planning for the time between the samples"),
        (search_alternatives, "search_alternatives", {"alternatives": 2}, "planning alternatives"),
    ],
)
def test_further_plans_may_fail(
    module: object, name: str, more: dict[str, object], says: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, name, broken)
    result, _ = planned(**more)
    assert cut_short(result) is CutShort.DEFECT
    assert failures(result)[0].startswith(f"{says} failed: internal error: IndexError at ")


def test_a_step_without_memory_is_no_defect(monkeypatch: pytest.MonkeyPatch) -> None:
    def greedy(*_: object) -> NoReturn:
        raise MemoryError

    monkeypatch.setattr(search_alternatives, "search_alternatives", greedy)
    result, _ = planned(alternatives=2)
    assert failures(result) == ["planning alternatives failed: out of memory"]
    assert isinstance(result.outcome, Verified)


def test_a_plan_that_fails_between_samples_is_not_secured_if_that_is_required() -> None:
    outcome = planned()[0].outcome
    assert isinstance(outcome, Verified)
    assert driver.acceptable(outcome, ContinuousTime.REQUIRED)
    failing = replace(outcome.certificate, between=(Between("visit", Verdict.FAILS),))
    failed = replace(outcome, certificate=failing)
    assert not driver.acceptable(failed, ContinuousTime.REQUIRED)
    assert driver.acceptable(failed, ContinuousTime.WANTED)


def test_the_verdict_stands_if_its_explanation_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("missionc.compiler.relax.search_relaxations.explain", broken)
    result = driver.compile(Source("a.mission", CONFLICT), backend="smt", explain_limit=Seconds(5.0))
    assert isinstance(result.outcome, Impossible)
    assert failures(result)[0].startswith("explaining the result failed: internal error: IndexError at ")


def test_the_folder_is_there_before_options_are_compared(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    mission, folder = tmp_path / "a.mission", tmp_path / "plan"
    mission.write_text(SHORTEST)
    held: list[str] = []

    def compare(*_: object) -> NoReturn:
        held.extend(sorted(path.name for path in folder.iterdir()))
        broken()

    monkeypatch.setattr(driver, "weighs_options", lambda *_: True)
    monkeypatch.setattr(compare_options, "compare_options", compare)
    assert main(["compile", str(mission), "-o", str(folder)]) == 0
    assert "plan.json" in held
    assert "certificate.json" in held
    said = capsys.readouterr()
    assert "warning[MC613]: comparing options failed" in said.err
    assert main(["verify", str(folder)]) == 0


def test_a_folder_that_cannot_be_written_again_keeps_the_plan_that_it_has(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    result, _ = planned()
    folder = compile_request.PlanFolder(tmp_path / "plan", force=False)
    unfinished = incumbent.cut_short(result, CutShort.UNFINISHED)
    assert folder.write(unfinished) is None
    assert folder.write(unfinished) is None, "nothing has changed"
    assert folder.write(result) is None, "its own folder is replaced without --force"
    assert json.loads((tmp_path / "plan" / "manifest.json").read_text())["cut_short"] is None
    (tmp_path / "plan" / "notes.txt").write_text("somebody else's")
    wrong = folder.write(unfinished)
    assert wrong is not None
    assert folder.kept is result


def test_a_better_plan_that_cannot_be_written_leaves_the_plan_before(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    real, calls = write_folder.write_folder, []

    def full_disk(target: Path, files: object, force: bool) -> object:
        calls.append(target)
        return real(target, files, force) if len(calls) == 1 else cannot_write(target, "no space left")  # type: ignore[arg-type]

    mission, folder = tmp_path / "a.mission", tmp_path / "plan"
    mission.write_text(SHORTEST)
    monkeypatch.setattr(driver, "weighs_options", lambda *_: True)
    monkeypatch.setattr(write_folder, "write_folder", full_disk)
    assert main(["compile", str(mission), "-o", str(folder)]) == 0
    said = capsys.readouterr()
    assert "warning[MC613]: a better plan was found but not written: `" in said.err
    assert "error" not in said.err
    assert main(["verify", str(folder)]) == 0


def test_a_picture_that_cannot_be_drawn_leaves_the_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("matplotlib")
    mission, folder = tmp_path / "a.mission", tmp_path / "plan"
    mission.write_text(SMALL)
    monkeypatch.setattr("missionc.compiler.graphs.picture_of", broken)
    main(["compile", str(mission), "-o", str(folder), "--plot", str(tmp_path / "a.svg")])
    assert "warning[MC613]: drawing the plan failed" in capsys.readouterr().err
    assert main(["verify", str(folder)]) == 0


def test_memory_that_a_library_does_not_get_is_no_defect() -> None:
    finding = improvement_failed("improving the plan", RuntimeError("std::bad_alloc"))
    assert finding.message == "improving the plan failed: out of memory"
    assert finding.help == "raise the limit with `--memory-limit`"

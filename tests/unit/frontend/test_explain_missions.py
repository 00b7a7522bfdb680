"""Why a mission is infeasible: every change that is said to help has been planned and verified."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from missionc.backends.api import Budget, Impossible, NotFound, Outcome, Planned, Progress, Reason, Report, ignore
from missionc.backends.options import Options
from missionc.backends.smt.backend import BACKEND as SMT
from missionc.base.continuous_time import ContinuousTime
from missionc.base.limits import Limits
from missionc.base.source import Source
from missionc.base.units import Seconds
from missionc.cli.app import main
from missionc.compiler import driver
from missionc.compiler.front_end import Checked
from missionc.compiler.relax import search_relaxations
from missionc.compiler.results import Blame, Compiled, Explained, Relaxation, Verified
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from missionc.output.folder.write_folder import refuse
from missionc.verification.monitoring.monitor import monitor
from tests.support.small_missions import CONFLICT, SMALL

pytestmark = pytest.mark.usefixtures("coarse_covers_throughout")

ENOUGH = Seconds(200.0)
"""More than it takes, on a machine with much else to do."""


class Picky:
    """The solver, for missions with enough of something; the others it refuses, or leaves undecided."""

    name = "smt"
    refutes = True

    def __init__(self, name: str, least: float, refusal: Outcome | None = None) -> None:
        self.what, self.least = name, least
        self.refusal = refusal or Impossible(("visit",), "on 40 nodes", Report(sizes=(("nodes", 40),)))
        self.asked: list[float] = []

    def plan(self, mission: Mission, kernel: Kernel, options: Options, budget: Budget) -> Outcome:
        assert options.brief
        nodes = dict(mission.solve.options).get("nodes", 0)
        value = nodes if self.what == "nodes" else float(getattr(mission, self.what))
        self.asked.append(value)
        return SMT.plan(mission, kernel, options, budget) if value >= self.least else self.refusal


def checked(text: str) -> Checked:
    return driver.check(Source("a.mission", text))


def explained(
    text: str,
    backend: Picky,
    limit: float = ENOUGH,
    conflict: tuple[str, ...] = ("visit",),
    listen: Callable[[Progress], None] = ignore,
) -> Explained:
    refusal = Impossible(conflict, "on 40 nodes", Report(sizes=(("nodes", 40),)))
    budget = Budget(time.monotonic() + 600, on_progress=listen)
    return search_relaxations.explain(checked(text), refusal, backend, Options(), budget, Seconds(limit))


@pytest.fixture(scope="module")
def conflict(coarse_covers_throughout: None) -> Compiled:
    compiled = driver.compile(Source("a.mission", CONFLICT), explain_limit=ENOUGH)
    assert isinstance(compiled.outcome, Impossible)
    return compiled


def why(compiled: Compiled) -> Explained:
    assert compiled.explained is not None
    return compiled.explained


def relaxed(relaxation: Relaxation) -> str:
    """The mission with the change made line by line, as it is shown."""
    text = CONFLICT
    for change in relaxation.changes:
        assert text.count(change.before) == 1
        text = text.replace(change.before, change.after)
    return text


def test_changes_that_do_come_with_the_smallest_first_and_last_what_gives_up_safety(conflict: Compiled) -> None:
    found = why(conflict)
    assert len(found.relaxations) >= 4
    order = [(relaxation.guards, relaxation.size) for relaxation in found.relaxations]
    assert order == sorted(order)
    said = " ".join(relaxation.says for relaxation in found.relaxations)
    for part in ("the radius of `radio`", "without `visit`", "without `guard`", "without `link`"):
        assert part in said
    assert not found.cut_short


def test_each_of_them_makes_the_text_a_mission_with_a_plan(conflict: Compiled) -> None:
    for relaxation in why(conflict).relaxations:
        compiled = driver.compile(Source("a.mission", relaxed(relaxation)))
        assert isinstance(compiled.outcome, Verified), relaxation.says


def test_the_requirements_are_to_blame_where_more_time_does_not_help(conflict: Compiled) -> None:
    assert why(conflict).blame is Blame.REQUIREMENTS
    assert [(trial.says, trial.outcome) for trial in why(conflict).trials] == [
        ("without `visit`", "planned"),
        ("without `guard`", "planned"),
        ("without `link`", "planned"),
        ("horizon 12 s instead of 6 s, with the windows that end with it", "impossible"),
    ]
    note = conflict.findings[-1].notes[1]
    assert note.startswith("dropping `visit` or `guard` or `link` gives a plan; ")
    assert note.endswith("horizon 12 s instead of 6 s, with the windows that end with it gives no plan")


def test_the_nearest_miss_breaks_one_requirement_and_says_where(conflict: Compiled, tmp_path: Path) -> None:
    missed = why(conflict).near_miss
    assert missed is not None
    files = dict(missed.files)
    assert set(files) == {"near_miss.json", "near_miss.html", "near_miss.svg"}
    (broken,) = missed.attempt.violated
    document = json.loads(files["near_miss.json"])
    assert (document["schema"], document["plan"]) == ("missionc.near_miss/2", False)
    assert document["impossible"] == "mission"
    assert [each["name"] for each in document["violates"]] == [broken.name]
    assert document["faults"] == []
    assert f"no plan: violates `{broken.name}` by {broken.short}".encode() in files["near_miss.svg"]
    assert f'"miss":"violates `{broken.name}` by {broken.short}'.encode() in files["near_miss.html"]
    (tmp_path / "a.mission").write_text(CONFLICT)
    (tmp_path / "near_miss.json").write_bytes(files["near_miss.json"])
    monitored = driver.monitor(tmp_path / "a.mission", tmp_path / "near_miss.json")
    assert [each for each in monitored.requirements if not each.satisfied] == [broken]


def test_the_page_of_the_nearest_miss_has_the_conflict_and_each_change_with_its_plan(conflict: Compiled) -> None:
    missed = why(conflict).near_miss
    assert missed is not None
    page = dict(missed.files)["near_miss.html"].decode()
    shown = json.loads(page.partition('id="data">')[2].partition("</script>")[0])
    advice = shown["advice"]
    assert advice["conflict"] == ["visit", "guard", "link"]
    assert [each["change"] for each in advice["changes"]] == [each.says for each in why(conflict).relaxations]
    assert [each["plan"] for each in advice["changes"]] == list(range(2, 2 + len(advice["changes"])))
    assert all(plan["passed"] for plan in shown["others"])
    assert len(shown["others"]) == len(advice["changes"])
    (edit,) = advice["changes"][0]["edits"]
    assert edit["after"] in shown["others"][0]["texts"][0]["text"]


def test_who_leaves_out_a_guard_gives_up_safety(conflict: Compiled) -> None:
    by_words = {each.says: each.guards for each in why(conflict).relaxations}
    assert not by_words["without `visit`"]
    assert by_words["without `guard`"]


def test_the_nearest_miss_is_the_one_that_fails_by_least(conflict: Compiled, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("missionc.compiler.wider_margins.widens", lambda checked, request: False)  # plans as found
    mission, kernel = conflict.checked.mission, conflict.checked.kernel
    assert mission is not None
    assert kernel is not None
    fails = []
    for relaxation in why(conflict).relaxations:
        outcome = driver.compile(
            Source("a.mission", relaxed(relaxation)), continuous_time=ContinuousTime.AT_STEPS
        ).outcome
        assert isinstance(outcome, Verified)
        trace = outcome.plan.trace
        if trace.position.shape[:2] == (len(mission.agents), mission.steps + 1):
            broken = [each for each in monitor(mission, kernel, trace).requirements if not each.satisfied]
            fails += [broken[0].robustness] if len(broken) == 1 else []
    missed = why(conflict).near_miss
    assert missed is not None
    assert len(fails) > 1
    assert missed.attempt.violated[0].robustness == max(fails) < 0


def test_the_shortest_horizon_is_found_and_to_blame() -> None:
    backend = Picky("steps", 9)
    found = explained(SMALL, backend)
    assert found.blame is Blame.HORIZON
    horizon = next(each for each in found.relaxations if each.says.startswith("horizon"))
    assert horizon.says == "horizon 9 s instead of 6 s, with the windows that end with it"
    assert horizon.smallest
    assert found.near_miss is None, "a motion that lasts longer is none of this mission"


def test_where_the_motion_alone_is_in_conflict_no_requirement_is_left_out_or_moved() -> None:
    found = explained(SMALL + "separation 0.2 m\n", Picky("steps", 8), conflict=())
    assert [trial.says.split()[0] for trial in found.trials] == ["horizon", "a"]
    assert [relaxation.says for relaxation in found.relaxations] == [
        "horizon 8 s instead of 6 s, with the windows that end with it"
    ]


def test_what_is_no_mission_is_not_said_to_have_been_tried() -> None:
    limits = Limits(steps=8)
    checked = driver.check(Source("a.mission", SMALL), limits=limits)
    refusal = Impossible(("visit",), "on 40 nodes", Report(sizes=(("nodes", 40),)))
    backend = Picky("steps", 10_000)
    budget = Budget(time.monotonic() + 600, limits=limits)
    found = search_relaxations.explain(checked, refusal, backend, Options(), budget, ENOUGH)
    assert max(backend.asked) <= 8
    assert not any(trial.says.startswith("horizon") for trial in found.trials)


def test_whoever_watches_is_told_which_variant_is_tried() -> None:
    said: list[Progress] = []
    found = explained(SMALL, Picky("steps", 9), listen=said.append)
    assert {progress.stage for progress in said} == {"explain"}
    assert [progress.round for progress in said] == list(range(1, len(said) + 1))
    assert [progress.detail for progress in said][: len(found.trials)] == [trial.says for trial in found.trials]


def test_memory_that_runs_out_leaves_a_variant_open() -> None:
    class Greedy(Picky):
        def plan(self, mission: Mission, kernel: Kernel, options: Options, budget: Budget) -> Outcome:
            raise MemoryError

    assert {trial.outcome for trial in explained(SMALL, Greedy("steps", 0)).trials} == {"undecided"}


def test_a_roadmap_alone_is_to_blame_where_a_finer_one_holds_a_plan() -> None:
    found = explained(SMALL, Picky("nodes", 50))
    assert found.blame is Blame.ROADMAP
    assert [change.after for change in found.relaxations[0].changes] == ["solve with smt { nodes = 68 }"]


def test_what_is_left_undecided_is_no_relaxation_and_blames_nobody() -> None:
    open_ = NotFound(Reason.TIME, "the time limit was reached", Report())
    found = explained(SMALL, Picky("steps", 10_000, open_))
    assert found.blame is Blame.UNKNOWN
    assert {trial.outcome for trial in found.trials} == {"undecided"}
    assert found.relaxations == ()
    assert found.near_miss is None


def test_a_plan_that_fails_verification_is_no_relaxation(monkeypatch: pytest.MonkeyPatch) -> None:
    class Wrong(Picky):
        def plan(self, mission: Mission, kernel: Kernel, options: Options, budget: Budget) -> Outcome:
            found = SMT.plan(mission, kernel, options, budget)
            if isinstance(found, Planned):
                position = found.trace.position.copy()
                position[0, -1] += 3.0
                return replace(found, trace=replace(found.trace, position=position))
            return found

    found = explained(SMALL, Wrong("steps", 0))
    assert found.relaxations == ()
    assert {trial.outcome for trial in found.trials} == {"undecided"}


def test_there_is_no_more_work_than_there_is_time() -> None:
    backend = Picky("steps", 10_000)
    begin = time.process_time()
    found = explained(SMALL, backend, limit=1e-6)
    assert time.process_time() - begin < 5.0
    assert backend.asked == []
    assert (found.blame, found.trials, found.relaxations, found.near_miss) == (Blame.UNKNOWN, (), (), None)
    assert found.cut_short


def test_nothing_is_tried_unless_asked_for() -> None:
    assert driver.compile(Source("a.mission", CONFLICT)).explained is None


def test_the_command_writes_the_nearest_miss_and_says_what_would_do_the_same_each_time(
    conflict: Compiled, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a.mission").write_text(CONFLICT)
    words = ["compile", "a.mission", "--explain-limit", str(ENOUGH), "--format", "json"]
    assert main(words) == 6
    document = json.loads(capsys.readouterr().out)
    assert document["blame"]["on"] == "requirements"
    assert document["output"] == "build/small"
    assert {path.name for path in Path("build/small").iterdir()} == {
        "manifest.json",
        *(f"near_miss.{form}" for form in ("json", "html", "svg")),
    }
    before = why(conflict)
    assert before.near_miss is not None
    for name, content in before.near_miss.files:
        assert (Path("build/small") / name).read_bytes() == content, name
    assert [each["change"] for each in document["relaxations"]] == [each.says for each in before.relaxations]
    assert document["blame"]["trials"] == [{"change": each.says, "outcome": each.outcome} for each in before.trials]
    first = document["relaxations"][0]
    assert set(first) == {
        "change",
        "file",
        "line",
        "before",
        "after",
        "also",
        "smallest",
        "proven",
        "guards",
        "verified",
    }
    assert first["before"] == CONFLICT.splitlines()[first["line"] - 1]
    assert document["near_miss"]["violates"][0]["name"] in document["conflict"]
    assert refuse(Path("build/small"), force=False) is None, "a nearest miss gives way"

"""Planning methods: a plan says which method found which agents, and `--require-solver` leaves none but the solver."""

from __future__ import annotations

import json
import time
from pathlib import Path

import pytest

import missionc
from missionc.backends.api import Budget
from missionc.backends.options import Options
from missionc.base.source import Source
from missionc.base.trace import Solved, read_solved, solved_by, solved_text, then_polished
from missionc.compiler import driver
from missionc.compiler.plan_request import PlanRequest
from missionc.compiler.results import Verified
from missionc.tools.replay.reverify import reverify
from tests.support.forged_folders import forged, laid
from tests.support.small_missions import CONFLICT, SMALL

TOGETHER = SMALL.replace(
    "require visit: every drone: eventually[0, 6 s] goal",
    """\
graph radio = proximity 0.5 m
require meet: drone[0]: eventually[0, 6 s] (goal and somewhere[hops 1..1 on radio] drone)""",
)
"""Its agents have to be planned together."""


def planned(text: str, **options: object) -> Verified:
    """A plan as its engine found it."""
    request = PlanRequest(Budget(time.monotonic() + 600), Options(**options))  # type: ignore[arg-type]
    compiled = driver.plan_once(driver.check(Source("a.mission", text)), request)
    assert isinstance(compiled.outcome, Verified), compiled.findings
    return compiled.outcome


def methods(verified: Verified) -> dict[str, str]:
    """Method of each agent."""
    return {agent: each.by for each in verified.plan.solved for agent in each.agents}


def test_agents_with_requirements_of_their_own_are_planned_by_search() -> None:
    assert methods(planned(SMALL)) == {"drone[0]": "search", "drone[1]": "search"}


def test_agents_with_a_requirement_together_are_planned_by_the_solver_that_was_asked() -> None:
    assert methods(planned(TOGETHER, solver="z3")) == {"drone[0]": "z3", "drone[1]": "z3"}


@pytest.mark.parametrize("solver", ["z3", "cadical"])
def test_a_required_solver_plans_all_agents_in_one_problem(solver: str) -> None:
    if solver == "cadical":
        pytest.importorskip("pysat")
    verified = planned(SMALL, solver=solver, require_solver=True)
    assert set(methods(verified).values()) <= {"z3", "cadical"}
    assert set(methods(verified)) == {"drone[0]", "drone[1]"}
    assert "turns" not in dict(verified.report.sizes)
    assert dict(verified.report.sizes)["clauses"] > 0


@pytest.mark.usefixtures("roadmaps_alone")
def test_a_required_solver_refuses_what_no_plan_satisfies() -> None:
    compiled = missionc.compile(Source("a.mission", CONFLICT), options=Options(require_solver=True), explain_limit=0)
    assert isinstance(compiled.outcome, missionc.Impossible)
    assert set(compiled.outcome.conflict) == {"visit", "guard", "link"}
    assert dict(compiled.outcome.report.sizes)["clauses"] > 0


def test_a_folder_with_the_methods_passes_and_one_with_a_method_that_there_is_not_is_refused(tmp_path: Path) -> None:
    files = dict(planned(SMALL, solver="z3", require_solver=True).files)
    assert json.loads(files["plan.json"])["solved"] == [{"by": "z3", "agents": ["drone[0]", "drone[1]"]}]
    assert json.loads(files["manifest.json"])["options"]["require_solver"] == "True"
    assert reverify(laid(tmp_path / "sound", files)).passed
    changed = files | {"plan.json": files["plan.json"].replace(b'"by": "z3"', b'"by": "magic"')}
    assert not reverify(forged(tmp_path / "forged", changed)).passed


def test_the_text_counts_the_agents_of_each_method() -> None:
    team = [f"a{number}" for number in range(3)]
    solved = solved_by({"a0": "search", "a1": "z3", "a2": "search"})
    assert solved_text(solved) == "solved: 1 agent by Z3, 2 by search"
    assert solved_text(then_polished(solved, team)) == "solved: 1 agent by Z3, 2 by search, then 3 by polish"
    assert then_polished(then_polished(solved, team), team) == then_polished(solved, team)
    assert solved_text(()) == ""


def test_records_read_back_and_others_are_refused() -> None:
    solved = solved_by({"a0": "search", "a1": "cadical"})
    records = [each.as_record() for each in solved]
    assert read_solved(records, ("a0", "a1")) == solved == (Solved("cadical", ("a1",)), Solved("search", ("a0",)))
    for wrong in ({}, "z3", [1], [{"by": "magic", "agents": ["a0"]}], [{"by": "z3", "agents": ["a9"]}], [{"by": "z3"}]):
        with pytest.raises(ValueError, match="no record"):
            read_solved(wrong, ("a0", "a1"))

"""Alternative plans: several that differ, ranked, in one folder that is verified as a whole."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import shapely
from click.testing import CliRunner

from missionc.base.source import Source
from missionc.base.trace import Trace
from missionc.cli.app import commands
from missionc.compiler import driver
from missionc.compiler.alternatives.restriction import Restriction, restrictions
from missionc.compiler.front_end import check
from missionc.compiler.results import Compiled, Verified
from missionc.ir import Obstacle
from missionc.ir.kernel.nodes import Until
from missionc.ir.kernel.walk import postorder
from missionc.output.folder.write_folder import write_folder
from missionc.tools.replay.reverify import reverify
from missionc.verification.monitoring.monitor import truth
from missionc.verification.monitoring.signature import Signatures, differences
from missionc.verification.verify_plan import verify

PILLAR = """mission pillar
time step 1 s, horizon 24 s
world (0, 0) to (24, 12)
region a = box (18, 8) to (22, 11)
region b = box (18, 1) to (22, 4)
obstacle pillar = box (9, 4) to (12, 8)
team rover[1] { radius 0.3 m  dynamics single_integrator(speed <= 2 m/s)  start at (3, 7) }
require go: rover[0]: eventually[0, 24 s] (a or b)
solve with smt
"""

ONE = """mission one
time step 1 s, horizon 8 s
world (0, 0) to (12, 6)
region goal = box (8, 2) to (11, 5)
team rover[1] { radius 0.3 m  dynamics single_integrator(speed <= 2 m/s)  start at (2, 3) }
require go: rover[0]: eventually[0, 8 s] goal
solve with smt
"""


@cache
def compiled(text: str = PILLAR, wanted: int = 4) -> Compiled:
    made = driver.compile(Source("a.mission", text), alternatives=wanted)
    assert isinstance(made.outcome, Verified)
    return made


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    assert write_folder(tmp_path / "out", compiled().files, force=False) is None
    return tmp_path / "out"


def test_every_plan_is_verified_against_the_mission_and_no_two_are_one() -> None:
    made = compiled()
    mission, kernel = made.checked.mission, made.checked.kernel
    assert mission is not None
    assert kernel is not None
    assert len(made.alternatives) == 4
    signatures = Signatures(mission, kernel)
    traces = [each.verified.plan.trace for each in made.alternatives]
    for trace in traces:
        assert verify(mission, kernel, trace).passed
    for number, trace in enumerate(traces):
        for other in traces[:number]:
            assert differences(signatures.of(other), signatures.of(trace))


def test_the_best_is_first_and_the_outcome() -> None:
    made = compiled()
    lengths = [each.row.length for each in made.alternatives]
    assert lengths == sorted(lengths)
    assert made.outcome is made.alternatives[0].verified
    assert [each.row.rank for each in made.alternatives] == [1, 2, 3, 4]
    assert made.alternatives[0].row.differs == ()


def test_both_options_and_both_sides_are_among_them() -> None:
    said = [words for each in compiled().alternatives for words in each.row.differs]
    assert any(words.startswith("`go` by") for words in said)
    assert any("`pillar` on its" in words for words in said)


def test_the_same_seed_gives_the_same_bytes() -> None:
    again = driver.compile(Source("a.mission", PILLAR), alternatives=4)
    assert again.files == compiled().files


def test_where_there_are_fewer_that_is_said_and_it_is_a_plan_all_the_same() -> None:
    made = compiled(ONE, 3)
    assert isinstance(made.outcome, Verified)
    assert len(made.alternatives) == 1
    assert any(
        note.startswith("1 of 3 plans found: no further different plan in ") for note in made.outcome.report.notes
    )
    assert "alternatives.json" in dict(made.files)


def test_a_plan_alone_has_no_table() -> None:
    made = driver.compile(Source("a.mission", ONE))
    assert made.alternatives == ()
    assert "alternatives.json" not in dict(made.files)


def test_a_folder_of_several_is_verified_plan_by_plan(folder: Path) -> None:
    replayed = reverify(folder)
    assert replayed.passed
    assert [each.folder.name for each in replayed.others] == ["2", "3", "4"]
    assert all(each.passed for each in replayed.others)


def test_each_plan_is_a_folder_of_its_own(folder: Path) -> None:
    assert reverify(folder / "alternatives" / "3").passed


@pytest.mark.parametrize(
    ("name", "before", "after"),
    [
        ("alternatives.json", '"rank": 2', '"rank": 5'),
        ("alternatives.json", "instead of", "and not"),
        ("alternatives/2/plan.json", '"seed": 0', '"seed": 1'),
        ("alternatives/3/certificate.json", '"passed": true', '"passed": false'),
        ("manifest.json", '"alternatives": "4"', '"alternatives": "3"'),
        ("manifest.json", '"alternatives": "4"', '"alternatives": "many"'),
    ],
)
def test_a_folder_that_was_changed_is_refused(folder: Path, name: str, before: str, after: str) -> None:
    text = (folder / name).read_text()
    assert before in text
    (folder / name).write_text(text.replace(before, after))
    assert not reverify(folder).passed


def test_a_folder_from_which_a_plan_was_taken_is_refused(folder: Path) -> None:
    (folder / "alternatives" / "2" / "plan.json").unlink()
    assert not reverify(folder).passed


def test_the_report_holds_all_of_them(folder: Path) -> None:
    page = (folder / "report.html").read_text()
    begin = page.index('id="data">') + len('id="data">')
    shown = json.loads(page[begin : page.index("</script>", begin)])
    assert [row["rank"] for row in shown["plans"]] == [1, 2, 3, 4]
    assert len(shown["others"]) == 3
    assert [each["mission"] for each in shown["others"]] == ["pillar"] * 3


def test_what_is_restricted_forbids_what_the_plan_decided_and_nothing_else_is_believed() -> None:
    made = compiled()
    mission, kernel = made.checked.mission, made.checked.kernel
    assert mission is not None
    assert kernel is not None
    trace = made.alternatives[0].verified.plan.trace
    signature = Signatures(mission, kernel).of(trace)
    made_of = list(restrictions(Restriction(), signature, mission, trace.position))
    removed = [each for each in made_of if each.removed]
    barred = [each for each in made_of if each.barred]
    assert removed
    assert barred
    narrower, fewer = removed[0].applied(mission, kernel)
    assert narrower is mission
    assert not truth(fewer.requirements[0].formula, mission, trace)[0, 0]
    walled, same = barred[0].applied(mission, kernel)
    assert len(walled.obstacles) == len(mission.obstacles) + 1
    assert isinstance(walled.obstacles[-1], Obstacle)
    assert same.requirements[0].formula is kernel.requirements[0].formula
    assert not verify(walled, kernel, trace).passed


def test_an_order_is_reversed_by_a_requirement() -> None:
    text = PILLAR.replace("eventually[0, 24 s] (a or b)", "(eventually[0, 24 s] a) and (eventually[0, 24 s] b)")
    made = driver.compile(Source("a.mission", text), alternatives=2)
    mission, kernel = made.checked.mission, made.checked.kernel
    assert mission is not None
    assert kernel is not None
    assert isinstance(made.outcome, Verified)
    trace = made.outcome.plan.trace
    signature = Signatures(mission, kernel).of(trace)
    ordered = [each for each in restrictions(Restriction(), signature, mission, trace.position) if each.first]
    assert len(ordered) == 1
    _, other = ordered[0].applied(mission, kernel)
    assert any(isinstance(node, Until) for node in postorder([other.requirements[0].formula]))
    assert not truth(other.requirements[0].formula, mission, trace)[0, 0]
    assert any(" before " in words for each in made.alternatives for words in each.row.differs)
    assert np.isfinite([each.row.length for each in made.alternatives]).all()


def test_a_bar_is_one_that_all_who_pass_on_a_side_have_to_go_round() -> None:
    checked = check(
        Source("a.mission", PILLAR.replace("rover[1]", "rover[3]").replace("(3, 7)", "(3, 9), (3, 10), (3, 11)"))
    )
    mission, kernel = checked.mission, checked.kernel
    assert mission is not None
    assert kernel is not None
    across = np.linspace(3.0, 20.0, mission.steps + 1)
    position = np.stack([np.column_stack([across, np.full_like(across, height)]) for height in (9, 10, 11)])
    still = np.zeros(position.shape[:2])
    signature = Signatures(mission, kernel).of(Trace(mission.step, position, np.zeros_like(position), still))
    first = next(each for each in restrictions(Restriction(), signature, mission, position) if each.barred)
    bar = shapely.Polygon(first.barred[0])
    assert all(bar.intersects(shapely.LineString(path)) for path in position)


STAR = (Path(__file__).parents[3] / "missions" / "clot_star.mission").read_text()


@pytest.mark.slow
def test_both_regions_of_the_paper_are_among_the_plans() -> None:
    pytest.importorskip("torch")
    said = [words for each in compiled(STAR, 2).alternatives for words in each.row.differs]
    assert any(words.startswith("`stay` by `every robot: w") for words in said)


def test_the_command_says_what_differs(tmp_path: Path) -> None:
    (tmp_path / "a.mission").write_text(PILLAR)
    command = ["compile", str(tmp_path / "a.mission"), "--alternatives", "2", "-o", str(tmp_path / "out")]
    said = CliRunner().invoke(commands, command)
    assert said.exit_code == 0
    assert "2 alternative plans, best first\n" in said.output
    assert "instead of" in said.output
    as_json = CliRunner().invoke(commands, [*command, "--force", "--format", "json"])
    document = json.loads(as_json.output)
    assert [each["folder"] for each in document["alternatives"]] == [None, "alternatives/2"]
    judged = CliRunner().invoke(commands, ["verify", str(tmp_path / "out"), "--format", "json"])
    assert [each["passed"] for each in json.loads(judged.output)["alternatives"]] == [True]


def test_slower_plans_are_refused(tmp_path: Path) -> None:
    (tmp_path / "a.mission").write_text(ONE)
    command = ["compile", str(tmp_path / "a.mission"), "--alternatives", "2", "--stretch", "2"]
    said = CliRunner().invoke(commands, command)
    assert said.exit_code == 2
    assert "`--alternatives` and `--stretch` exclude each other; remove one of them" in said.output

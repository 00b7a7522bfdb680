"""Settings of the backends: their names and ranges, where they are read, and what stays a constant."""

from __future__ import annotations

import ast
import re
import tomllib
from dataclasses import replace
from pathlib import Path

import pytest

import missionc
from docs.settings import PAGE, page
from missionc.backends.clot.settings import ClotSettings, clot_settings
from missionc.backends.options import Options
from missionc.backends.setting import settings_of, with_values
from missionc.backends.settings import DEFAULTS, given, read_settings, settings_table, with_settings
from missionc.backends.smt.roadmap.sequence import roadmaps_to_try
from missionc.backends.smt.settings import SmtSettings, smt_settings
from missionc.base.source import Source
from missionc.compiler.driver import check
from missionc.compiler.results import InvalidMission, Verified
from missionc.ir import Mission
from tests.support.small_missions import SMALL

ROOT = Path(__file__).parents[3]
BACKENDS = ROOT / "missionc" / "backends"

CONSTANTS = {
    "rounding, in metres, steps or shares": """
        acceptance.ROUNDING clot.optimise.path_velocity.ROUNDING clot.optimise.path_velocity.SOON
        clot.optimise.retiming.ROUNDING clot.optimise.active_set.ROUNDING clot.schedule.tasks.ROUNDING
        clot.schedule.own_state_stops.ROUNDING clot.schedule.timetable.ROUNDING clot.schedule.gather_team.NEAR
        hybrid.backend.SLACK smt.encode.lower_routes.ROUNDING
        smt.prioritized.label_setting.FAR smt.refine.lazy_constraints.CUSHION
        smt.roadmap.geodesic_roadmap.TOUCHING smt.roadmap.lane_roadmap.ROUNDING smt.roadmap.passages.ASIDE
        clot.cost_weights.SHORT clot.paper.planning_sequence.NEARLY""",
    "codes, and figures that stand for infinity": """
        clot.paper.leaf_margins.UNLIMITED clot.paper.prefix.KNOWN clot.paper.prefix.UNKNOWN
        clot.schedule.tasks.TEAM smt.encode.clauses.TRUE smt.encode.clauses.FALSE smt.encode.clauses.NOTHING
        smt.prioritized.reservations.FIXED clot.schedule.timetable.LATE""",
    "sizes of arrays, caches and encodings: the plan is the same": """
        clot.optimise.control_points.SPARE clot.schedule.tasks.KNOWN smt.encode.lower_routes.KEPT
        smt.encode.lower_atoms.FEW smt.roadmap.roadmap_links.DENSE
        smt.roadmap.roadmap_links.BLOCK smt.roadmap.roadmap_links.WIDTH
        smt.encode.lower_routes.UNITS smt.roadmap.grow.MOST_LOOKED smt.roadmap.passages.EACH
        clot.paper.transport.CHECKED_EVERY speed_limits.HALVINGS""",
    "bounds of ranges": "clot.settings.MOST smt.settings.MOST options.SLOWEST speed_limits.LEAST",
    "units of work, fitted to measurements": """
        run_account.CLAUSE run_account.QUESTION run_account.CLAUSE_CONFLICT run_account.MOVE_STEP
        run_account.SKETCH run_account.SKETCHED run_account.ITERATION
        run_account.ITERATED run_account.SEEN run_account.SEARCH cover.refute.PAIRED cover.refute.SQUARED""",
    "turns of the backends in a portfolio, which have no settings in common": """
        portfolio.backend.FIRST portfolio.backend.LONGER portfolio.backend.ATTEMPTS portfolio.backend.TIMES""",
    "covers: tolerances above those of verification, and sizes of proofs": """
        cover.bodies.SLACK cover.bodies.THIN cover.cells.BEYOND cover.cells.CROSSED cover.cells.EDGE cover.cover.TOUCH
        cover.keep_apart.MOST_PARTS cover.keep_apart.MOST_CHOICES cover.keep_apart.MOST_PAIRS cover.may_labels.BORDER
        cover.may_moves.MORE cover.may_moves.NEAR cover.may_moves.MOST_CELLS cover.may_moves.SHAKEN
        cover.may_labels.INSIDE cover.refute.CLAUSES cover.refute.CONFLICTS cover.refute.CELLS cover.refute.MOST_PAIRS
        cover.may_labels.MOST_PAIRS""",
    "figures of one module that several of its functions share, and nobody tunes": """
        clot.optimise.path_velocity.PACE clot.optimise.path_velocity.SETTING_OUT clot.optimise.path_velocity.CHANGE
        clot.paper.expand_agent.TYPICAL clot.paper.probe_cost.PLACES clot.schedule.deconflict_space_time.ROOM
        clot.schedule.goal_sets.DETOUR clot.schedule.goal_sets.BEYOND clot.schedule.joint_waypoints.PITCHES
        smt.prioritized.single_agent_relaxation.STEPS
        clot.schedule.schedule.VAST clot.schedule.schedule.UNHURRIED clot.schedule.tasks.MOST_OPTIONS
        clot.schedule.timed_paths.MOST_CLOSED""",
}
"""Numbers that stay module constants of the backends, by the reason."""


def _is_number(value: ast.expr) -> bool:
    match value:
        case ast.Constant(value=int() | float() as number):
            return not isinstance(number, bool)
        case ast.BinOp(left=left, right=right):
            return _is_number(left) and _is_number(right)
        case ast.UnaryOp(operand=operand):
            return _is_number(operand)
        case ast.Tuple(elts=elements) | ast.List(elts=elements):
            return bool(elements) and all(map(_is_number, elements))
        case _:
            return False


def _number_names(path: Path) -> list[str]:
    """The names of the module's constants that are numbers, or tuples of numbers."""
    found = []
    module = ".".join(path.relative_to(BACKENDS).with_suffix("").parts)
    for statement in ast.parse(path.read_text(encoding="utf-8")).body:
        match statement:
            case ast.Assign(targets=[target], value=value) if _is_number(value):
                names = target.elts if isinstance(target, ast.Tuple) else [target]
            case ast.AnnAssign(target=target, value=ast.expr() as value) if _is_number(value):
                names = [target]
            case _:
                continue
        found += [f"{module}.{ast.unparse(name)}" for name in names]
    return found


def test_a_number_of_a_backend_is_a_setting_or_stands_in_the_list_with_a_reason() -> None:
    found = {name for path in BACKENDS.rglob("*.py") for name in _number_names(path)}
    listed = {name for names in CONSTANTS.values() for name in names.split()}
    assert sorted(found - listed) == []
    assert sorted(listed - found) == []


def test_every_setting_says_what_it_does_and_is_read_by_its_backend() -> None:
    wrong = []
    for backend, value in DEFAULTS.items():
        folder = BACKENDS / backend
        text = "".join(path.read_text(encoding="utf-8") for path in folder.rglob("*.py") if path.name != "settings.py")
        for each in settings_of(value):
            field = each.name.rpartition(".")[2]
            if not each.says or each.read(each.default) != each.default or not re.search(rf"\.{field}\b", text):
                wrong.append(f"{backend}.{each.name}")
    assert wrong == []


def test_a_value_is_read_within_its_range_alone() -> None:
    for value in DEFAULTS.values():
        for each in settings_of(value):
            if not isinstance(each.default, bool):
                assert each.read(each.low - 1) is None
                assert each.read(each.high * 2 + 1) is None
                assert each.read("nan") is None
                assert (each.read(repr(float(each.low) + 0.5)) is None) == isinstance(each.default, int)
            assert each.read("many") is None


def test_names_are_whole_or_without_their_group_and_the_last_value_counts() -> None:
    texts = {"smt.nodes": "50", "smt.search.push": "2", "smt.roadmap.nodes": "60", "smt.adaptive": "False"}
    values, wrong = read_settings(texts, ("smt",))
    assert values == (("smt.roadmap.adaptive", False), ("smt.roadmap.nodes", 60), ("smt.search.push", 2.0))
    assert wrong == []


@pytest.mark.parametrize(
    ("name", "text", "code", "words"),
    [
        ("smt.nods", "3", "MC415", "write `smt.nodes`"),
        ("smt.rounds", "3", "MC415", "`smt.prioritized.rounds` or `smt.shortening.rounds`"),
        ("", "3", "MC415", "--set help"),
        ("smt.nodes", "1.5", "MC416", "--set smt.roadmap.nodes=110"),
        ("smt.roadmap.growth", "0.5", "MC416", "--set smt.roadmap.growth=1.7"),
        ("clot.schedules", "3", "MC417", "--backend clot"),
    ],
)
def test_what_cannot_be_set_is_said_with_a_way_out(name: str, text: str, code: str, words: str) -> None:
    values, (finding,) = read_settings({name: text}, ("smt",))
    assert values == ()
    assert finding.code.name == code
    assert words in finding.help


def _mission(text: str = SMALL, **settings: object) -> Mission:
    checked = check(
        Source("small.mission", text), overrides=given({f"smt.{name}": value for name, value in settings.items()})
    )
    assert checked.ok, checked.findings
    return checked.valid_mission


def test_nodes_and_neighbors_of_a_mission_are_settings_and_what_is_set_comes_later() -> None:
    text = SMALL.replace("nodes = 40", "nodes = 40, neighbors = 7")
    written, further = smt_settings(_mission(text)), smt_settings(_mission(text, nodes=90))
    assert (written.roadmap.nodes, written.roadmap.neighbors, written.paper.neighbors) == (40, 7, 7)
    assert not written.roadmap.adaptive
    assert further == with_values(written, {"roadmap.nodes": 90})


def test_the_roadmaps_are_of_as_many_nodes_as_the_settings_say() -> None:
    checked = check(Source("small.mission", SMALL), overrides={"smt.nodes": "30", "smt.roadmap.growth": "3"})
    attempts = roadmaps_to_try(checked.valid_mission, checked.valid_kernel, 0)
    assert [attempt.nodes for attempt in attempts] == [30, 90, 270]


def test_the_table_is_toml_that_reads_back_and_shows_the_preset() -> None:
    mission = _mission(nodes=77)
    read = tomllib.loads(settings_table(mission, ("hybrid",), Options(preset="search", samples=9)))
    assert read["smt"]["roadmap"]["nodes"] == 77
    assert read["clot"]["search"]["many_samples"] == read["clot"]["search"]["few_samples"] == 9
    for backend, value in (("smt", smt_settings(mission)), ("clot", clot_settings(mission))):
        for each in settings_of(value):
            group, _, field = each.name.partition(".")
            if group not in ("search", "transport") or backend == "smt":
                assert read[backend][group][field] == each.value, each.name


def test_a_settings_value_is_given_by_what_differs_from_the_defaults() -> None:
    value = replace(SmtSettings(), roadmap=replace(SmtSettings().roadmap, nodes=70, adaptive=False))
    assert given(value) == {"smt.roadmap.nodes": "70", "smt.roadmap.adaptive": "False"}
    assert given(ClotSettings()) == {}
    mission, wrong = with_settings(_mission(), given(value), ("smt",))
    assert not wrong
    assert smt_settings(mission) == value


def test_a_compilation_takes_settings_records_them_and_refuses_wrong_ones() -> None:
    source = Source("small.mission", SMALL)
    outcome = missionc.compile(source, settings={"smt.nodes": 25}).outcome
    assert isinstance(outcome, Verified)
    assert dict(outcome.report.sizes)["nodes"] == 25
    assert '"--set smt.nodes": "25"' in dict(outcome.files)["manifest.json"].decode()
    refused = missionc.compile(source, settings={"smt.nodes": -1})
    assert isinstance(refused.outcome, InvalidMission)
    assert [finding.code.name for finding in refused.findings] == ["MC416"]


def test_the_page_has_the_settings_of_today() -> None:
    text = PAGE.read_text(encoding="utf-8")
    assert page(text) == text, "`python docs/settings.py` updates it"

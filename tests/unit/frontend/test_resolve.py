"""What resolve makes of a whole mission: names, parameters, time, settings, and the missions that ship."""

from __future__ import annotations

from pathlib import Path

import pytest

from missionc import ir
from missionc.base.diagnostics.code import Severity
from missionc.base.limits import Limits
from missionc.frontend.resolve.resolve_mission import resolve
from missionc.frontend.resolve.show_ir import show_ir
from tests.support.resolved_missions import codes, demo, findings, mission, only, program, texts

SHIPPED = {
    # name: agents, steps, regions, obstacles, edges of its formations, requirements
    "clot_corridor": (12, 47, 3, 3, (66,), 4),
    "clot_dynamic": (5, 31, 2, 2, (4,), 2),
    "clot_regions": (15, 47, 10, 2, (), 6),
    "clot_split": (30, 47, 5, 3, (15,) * 5, 3),
    "clot_split100": (100, 47, 10, 5, (45,) * 10, 3),
    "clot_star": (5, 47, 2, 3, (4, 4), 3),
    "clot_visit": (5, 47, 4, 3, (), 3),
    "crazyflie_corridor": (3, 150, 0, 2, (2,), 2),
    "crazyflie_corridor_flight": (3, 150, 0, 2, (2,), 2),
    "strel_avoid": (5, 10, 7, 2, (), 2),
    "strel_avoid_all": (5, 10, 7, 2, (), 2),
    "strel_avoid_one": (5, 10, 3, 2, (), 2),
    "strel_deliver": (5, 10, 4, 2, (), 1),
    "strel_escape": (5, 13, 4, 2, (), 1),
    "strel_goal": (5, 10, 4, 2, (), 1),
    "strel_threat": (5, 13, 4, 2, (), 1),
    "wildfire": (5, 20, 3, 2, (), 4),
    "wildfire_flight": (5, 20, 3, 2, (), 4),
}


def test_a_shipped_mission_resolves_to_what_it_says(missions: Path, subtests: pytest.Subtests) -> None:
    for name in sorted(SHIPPED):
        with subtests.test(name=name):
            text = (missions / f"{name}.mission").read_text(encoding="utf-8")
            resolved, found = resolve(program(text), {}, Limits())
            assert [finding.code.name for finding in found if finding.severity is Severity.ERROR] == []
            assert {finding.code.name for finding in found} <= {"MC103"}
            assert resolved is not None
            assert (
                len(resolved.agents),
                resolved.steps,
                len(resolved.regions),
                len(resolved.obstacles),
                tuple(len(formation.edges) for formation in resolved.formations),
                len(resolved.requirements),
            ) == SHIPPED[name]


def test_every_mission_that_ships_is_looked_at(missions: Path) -> None:
    assert {path.stem for path in missions.glob("*.mission")} == set(SHIPPED)


# --------------------------------------------------------------------- names


def test_names_may_be_declared_after_their_use() -> None:
    text = demo(require="require arrive: every drone: eventually[0, 10 s] late", more="region late = goal * goal")
    assert mission(text).regions[1].name == "late"


def test_an_unknown_name_is_reported_with_the_nearest_of_a_fitting_kind() -> None:
    finding = only(demo(require="require arrive: every drone: eventually[0, 10 s] gaol"), "MC101")
    assert finding.help == "did you mean `goal`?"
    assert finding.fix is not None
    assert finding.fix.replacement == "goal"


def test_a_name_of_another_kind_is_not_suggested() -> None:
    finding = only(demo(require="require arrive: every drome: eventually[0, 10 s] goal"), "MC101")
    assert "`drone`" in finding.help
    finding = only(demo(more="graph gaol = proximity 2 m", require="require every gaols: goal"), "MC101")
    assert "gaol" not in finding.help


def test_a_name_declared_twice_is_reported_at_the_second_with_the_first_as_label() -> None:
    finding = only(demo(more="graph goal = proximity 2 m"), "MC102")
    assert finding.primary is not None
    assert finding.primary.span.source.place(finding.primary.span.start)[0] == 6
    assert finding.labels[0].span.source.place(finding.labels[0].span.start)[0] == 4


def test_two_requirements_may_not_share_a_label_but_a_label_may_be_a_name() -> None:
    assert codes(demo(more="prefer arrive: some drone: goal")) == ["MC102"]
    assert codes(demo(require="require goal: some drone: goal")) == []


def test_a_requirement_without_a_label_is_called_by_its_place() -> None:
    text = demo(more="require some drone: goal\nprefer every drone: goal weight 2")
    assert [requirement.name for requirement in mission(text).requirements] == ["requirement 1", "arrive"]
    assert [(prefer.name, prefer.weight) for prefer in mission(text).preferences] == [("preference 1", 2.0)]


def test_a_name_of_the_wrong_kind_is_reported_with_what_is_needed() -> None:
    text = demo(more="graph radio = proximity 2 m\nrequire some drone: inside(radio)")
    assert only(text, "MC104").message == "expected a region, found a graph `radio`"


@pytest.mark.parametrize(
    "more",
    [
        "param p = 2 s",
        "region p = box (1, 1) to (2, 2)",
        "beacon p = (1, 1)",
        "group p = drone",
        "graph p = proximity 1 m",
        "formation p = chain of drone spacing 1 m tolerance 0.1 m",
        "let p = goal",
    ],
)
def test_a_name_that_nothing_uses_earns_a_warning(more: str) -> None:
    assert codes(demo(more=more)) == ["MC103"]


def test_obstacles_and_agents_act_by_being_there() -> None:
    scout = "agent scout { dynamics single_integrator(speed <= 1 m/s) start at (5, 5) }"
    assert codes(demo(more=f"obstacle rock = disc at (4, 4) radius 1\n{scout}")) == []


def test_a_graph_of_beacons_uses_them_and_a_route_uses_the_only_graph() -> None:
    more = "beacon mast = (1, 1)\ngraph cell = beacons 2 m\nrequire every drone: somewhere[hops 0..1] goal"
    assert codes(demo(more=more)) == []


def test_a_name_suggested_for_a_misspelt_one_is_not_called_unused() -> None:
    assert codes(demo(require="require some drone: gaol")) == ["MC101"]


def test_a_member_past_the_end_of_its_team_is_reported() -> None:
    assert only(demo(more="group g = drone[1..2]\nrequire some g: goal"), "MC105").message == (
        "unknown agent `drone[2]`: `drone` has 2 agents"
    )


def test_a_state_word_is_no_name() -> None:
    assert codes(demo(more="param speed = 2 m/s")) == ["MC007"]


@pytest.mark.parametrize(
    "more",
    [
        "param a = (b + 1 s)\nparam b = a",
        "let a = not a",
        "let a = b\nlet b = c\nlet c = (a and goal)",
        "region a = goal + b\nregion b = a",
        "group a = b\ngroup b = drone, a",
    ],
)
def test_what_is_defined_by_itself_is_reported_once(more: str) -> None:
    assert codes(demo(more=more)).count("MC107") == 1


# ---------------------------------------------------------------- parameters


def test_a_value_on_the_command_line_takes_the_place_of_a_parameter() -> None:
    text = demo(time="param T = 10 s\nparam H = (T + 2 s)\ntime step 1 s, horizon H")
    assert mission(text).steps == 12
    for written in ("30 s", "30s", "(30 s)", "0.5 min", "30"):
        assert mission(text, {"T": written}).steps == 32


def test_a_value_for_an_unknown_parameter_is_reported_with_the_nearest() -> None:
    finding = only(demo(time="param Time = 10 s\ntime step 1 s, horizon Time"), "MC106", {"Tine": "3 s"})
    assert finding.primary is None
    assert finding.help == "did you mean `Time`?"


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("30 q", "MC"),
        ("", "MC001"),
        ("3 s region a = goal", "MC001"),
        ("3 s param N = 4", "MC001"),
        ("30 m", "MC201"),
        ("(1 / 0)", "MC210"),
        ("U + 1 s", "MC101"),
        ("T", "MC107"),
    ],
)
def test_a_value_on_the_command_line_that_is_no_quantity_is_reported_without_a_place(text: str, code: str) -> None:
    mission_text = demo(time="param T = 10 s\ntime step 1 s, horizon T")
    found = [finding for finding in findings(mission_text, {"T": text}) if finding.severity is Severity.ERROR]
    assert len(found) == 1
    assert found[0].primary is None or code == "MC107"
    assert found[0].code.name.startswith(code)


# ----------------------------------------------------------- once or not at all


@pytest.mark.parametrize("part", ["mission", "time", "world", "team"])
def test_a_declaration_that_a_mission_cannot_do_without_is_missed(part: str) -> None:
    text = demo(require="require true", **{part: ""})
    assert "MC014" in codes(text)


def test_a_mission_without_requirements_is_a_mission() -> None:
    assert mission(demo(require="require some drone: goal")).requirements
    assert mission(demo(require="")).requirements == ()


@pytest.mark.parametrize(
    "again",
    [
        "mission other",
        "time step 1 s, horizon 5 s",
        "world (0, 0) to (1, 1)",
        "separation 1 m\nseparation 2 m",
        "clearance 1 m\nclearance 2 m",
        "minimize distance\nminimize duration",
        "solve with smt\nsolve with smt",
        "solve with smt { nodes = 3, nodes = 4 }",
    ],
)
def test_what_holds_for_the_whole_mission_is_said_once(again: str) -> None:
    assert codes(demo(more=again)) == ["MC013"]


# ---------------------------------------------------------------------- time


def test_a_horizon_of_decimal_fractions_is_whole() -> None:
    assert mission(demo(time="time step 0.1 s, horizon 4.7 s", require="require some drone: goal")).steps == 47
    assert mission(demo(time="time step 20 ms, horizon 3 min", require="require some drone: goal")).steps == 9000


@pytest.mark.parametrize(
    ("time", "code"),
    [
        ("time step 0 s, horizon 10 s", "MC210"),
        ("time step -1 s, horizon 10 s", "MC210"),
        ("time step 1 s, horizon 0 s", "MC210"),
        ("time step 0.4 s, horizon 10.1 s", "MC304"),
        ("time step 3 s, horizon 2 s", "MC304"),
        ("time step 0.00001 s, horizon 10 s", "MC306"),
        ("time step 1 m, horizon 10 s", "MC201"),
        ("time step 1 steps, horizon 10 s", "MC201"),
        ("time step 1 s, horizon (10 s / 0)", "MC210"),
        ("time step 1 s, horizon (1000000 * 1000000 s)", "MC006"),
    ],
)
def test_a_time_that_cannot_be_meant_is_refused(time: str, code: str) -> None:
    assert codes(demo(time=time, require="require some drone: goal")) == [code]


def test_the_message_of_a_horizon_names_the_whole_ones_beside_it() -> None:
    finding = only(demo(time="time step 0.4 s, horizon 10.2 s", require="require some drone: goal"), "MC304")
    assert finding.help == "write `horizon 10 s` or `horizon 10.4 s`"


@pytest.mark.parametrize(
    ("window", "low", "high"),
    [("[0, 10 s]", 0, 10), ("[2 steps, 4 steps]", 2, 4), ("[1, end]", 1, None), ("[(1 s + 1), 3]", 2, 3)],
)
def test_a_window_is_in_whole_steps(window: str, low: int, high: int | None) -> None:
    formula = mission(demo(require=f"require eventually{window} some drone: goal")).requirements[0].formula
    assert isinstance(formula, ir.Apply)
    assert isinstance(formula.bounds, ir.Window)
    assert (formula.bounds.low, formula.bounds.high) == (low, high)


@pytest.mark.parametrize(
    ("window", "expected"),
    [
        ("[0, 7.5 s]", ["MC302"]),
        ("[0.5 s, 7.5 s]", ["MC302", "MC302"]),
        ("[0.5 s, 0.5 s]", ["MC302"]),
        ("[8.2 s, 8.8 s]", ["MC305"]),
        ("[5 s, 3 s]", ["MC303"]),
        ("[0.5 steps, 3 steps]", ["MC302"]),
        ("[0, 3 m]", ["MC201"]),
        ("[-1 s, 3 s]", ["MC210"]),
        ("[speed, 3 s]", ["MC104"]),
    ],
)
def test_a_window_that_cannot_be_judged_is_refused(window: str, expected: list[str]) -> None:
    assert codes(demo(require=f"require eventually{window} some drone: goal")) == expected


def test_a_bound_between_two_steps_is_reported_with_both() -> None:
    finding = only(demo(require="require eventually[0, 7.5 s] some drone: goal"), "MC302")
    assert finding.help == "write `7 s` or `8 s`"


def test_steps_are_no_time_outside_of_windows() -> None:
    assert codes(demo(time="time step 1 s, horizon 10 steps", require="require some drone: goal")) == ["MC201"]


# ------------------------------------------------------------------- solving


def test_the_objective_and_the_options_are_kept() -> None:
    found = mission(demo(more="minimize duration\nsolve with smt { nodes = 110, neighbors = 6 }"))
    assert found.objective is ir.Objective.DURATION
    assert (found.solve.backend, dict(found.solve.options)) == ("smt", {"nodes": 110, "neighbors": 6})


@pytest.mark.parametrize(
    ("more", "code"),
    [
        ("minimize distanse", "MC206"),
        ("minimize none", "MC206"),
        ("solve with smtt", "MC206"),
        ("solve with smt { neighbours = 6 }", "MC206"),
        ("solve with smt { nodes = 1.5 }", "MC209"),
        ("solve with smt { nodes = 0 }", "MC210"),
        ("solve with smt { nodes = 2 m }", "MC201"),
        ("separation -1 m", "MC210"),
        ("clearance 1 s", "MC201"),
        ("prefer some drone: goal weight 0", "MC210"),
        ("prefer some drone: goal weight 1 m", "MC201"),
    ],
)
def test_settings_of_the_whole_mission_are_looked_at(more: str, code: str) -> None:
    assert codes(demo(more=more)) == [code]


# ---------------------------------------------------------------- as a whole


def test_all_findings_come_in_one_go_and_in_the_order_of_the_text() -> None:
    text = demo(
        time="time step 0 s, horizon 10 m",
        things="region goal = box (7, 7) to (9, 7)",
        require="require arrive: every drone: eventually[3 s, 1 s] gaol\nrequire arrive: goal",
    )
    assert codes(text) == ["MC210", "MC201", "MC512", "MC101", "MC102", "MC203"]
    spans = [finding.primary.span.start for finding in findings(text) if finding.primary]
    assert spans == sorted(spans)


def test_a_mission_is_printed_the_same_way_each_time() -> None:
    text = demo(
        more="let there = goal\nrequire stay: always[2 s, end] some drone: there\nprefer x1: some drone: x + 2*y <= 3"
    )
    printed = show_ir(mission(text))
    assert printed == show_ir(mission(text))
    assert "let there = goal\n" in printed
    assert "require stay: always[2 steps, end] (some drone: there)\n" in printed
    assert "prefer x1: some drone: -x - 2*y + 3 >= 0 weight 1\n" in printed


def test_every_message_has_a_way_out() -> None:
    text = demo(time="time step 0 s, horizon 10 m", more="let a = a\nregion b = ball at (1, 1) radius -1")
    assert all(finding.help for finding in findings(text))
    assert len(texts(text)) > 3

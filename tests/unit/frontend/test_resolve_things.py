"""What resolve makes of quantities, shapes, agents, groups, graphs and formations."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from missionc import ir
from missionc.base.diagnostics.suggest import Nothing, edits, nearest
from missionc.base.limits import Limits
from missionc.frontend.resolve.context import in_order
from missionc.frontend.resolve.resolve_agents import on_grid, on_line
from missionc.frontend.resolve.resolve_shapes import Simple, fault
from tests.support.resolved_missions import codes, demo, mission, only

VOLUME = {
    "world": "world (0, 0, 0) to (10, 10, 3)",
    "team": "team drone[2] { dynamics single_integrator(speed <= 2 m/s)  start at (1, 1, 1), (2, 1, 1) }",
}


def team(items: str, size: int = 3) -> str:
    return demo(team=f"team drone[{size}] {{ {items} }}")


def agents(text: str) -> tuple[ir.Agent, ...]:
    return mission(text).agents


# ---------------------------------------------------------------- quantities


def test_a_quantity_is_worked_out_in_metres(subtests: pytest.Subtests) -> None:
    for written, metres in [
        ("2", 2.0),
        ("2 m", 2.0),
        ("20 cm", 0.2),
        ("30 mm", 0.03),
        ("0.01 km", 10.0),
        ("(1 m + 50 cm)", 1.5),
        ("(1 + 50 cm)", 1.5),
        ("(2 m/s * 3 s)", 6.0),
        ("(L / 2)", 2.0),
        ("(3 * L - 2 * L)", 4.0),
        ("(N * 1 m)", 5.0),
        ("N", 5.0),
    ]:
        with subtests.test(written=written, metres=metres):
            text = demo(more=f"param L = 4 m\nparam N = 5\nprefer a: every drone: x <= L * N / 5\nseparation {written}")
            assert mission(text).separation == pytest.approx(metres, rel=1e-12)


def test_a_quantity_that_does_not_fit_is_refused(subtests: pytest.Subtests) -> None:
    for written, code in [
        ("2 s", "MC201"),
        ("(1 m + 1 s)", "MC201"),
        ("(1 m * 1 m)", "MC201"),
        ("(1 m / 0)", "MC210"),
        ("(1 m / (2 - 2))", "MC210"),
        ("(1000000 km)", None),
        ("10000000 km", "MC006"),
        ("(1000000000 m * 10)", "MC006"),
        ("nothing", "MC101"),
        ("goal", "MC104"),
        ("x", "MC104"),
        ("90 deg", "MC201"),
    ]:
        with subtests.test(written=written, code=code):
            assert codes(demo(more=f"separation {written}")) == ([code] if code else [])


def test_a_parameter_with_the_wrong_unit_is_reported_with_its_declaration() -> None:
    finding = only(demo(more="param T = 20 s\nseparation T"), "MC201")
    assert finding.message == "expected a length, found a time `T`"
    assert finding.labels[0].message == "a time, declared here"


def test_what_is_wrong_with_a_parameter_is_said_once_however_often_it_is_used() -> None:
    assert codes(demo(more="param L = (1 m + 1 s)\nseparation L\nclearance (2 * L)")) == ["MC201"]


# -------------------------------------------------------------------- shapes


def shape(written: str, **parts: str) -> ir.Shape:
    return mission(demo(things=f"region goal = {written}", **parts)).regions[0].shape


def test_a_box_with_three_coordinates_in_a_plane_is_one_finding() -> None:
    found = only(demo(more="region a = box (1, 1, 1) to (2, 2, 2)"), "MC205")
    assert found.primary is not None
    assert found.primary.span.text == "(1, 1, 1)"


def test_the_corners_of_a_box_may_be_given_either_way_round() -> None:
    assert shape("box (9, 7) to (7, 9)") == ir.Box((7.0, 7.0), (9.0, 9.0))


def test_a_plane_shape_in_a_volume_has_the_height_of_the_world_or_its_own() -> None:
    assert shape("box (7, 7) to (9, 9)", **VOLUME) == ir.Box((7.0, 7.0, 0.0), (9.0, 9.0, 3.0))
    assert shape("box (7, 7) to (9, 9) height 1..2", **VOLUME) == ir.Box((7.0, 7.0, 1.0), (9.0, 9.0, 2.0))
    assert shape("box (7, 7, 2) to (9, 9, 1)", **VOLUME) == ir.Box((7.0, 7.0, 1.0), (9.0, 9.0, 2.0))
    assert shape("disc at (7, 7) radius 1", **VOLUME) == ir.Disc((7.0, 7.0), 1.0, ir.Prism(0.0, 3.0))
    assert shape("cylinder at (7, 7) radius 1 height 1..2", **VOLUME) == ir.Disc((7.0, 7.0), 1.0, ir.Prism(1.0, 2.0))
    assert shape("ball at (7, 7, 1) radius 1", **VOLUME) == ir.Ball((7.0, 7.0, 1.0), 1.0)
    assert shape("disc at (7, 7) radius 1") == ir.Disc((7.0, 7.0), 1.0, None)


def test_the_unit_after_a_range_is_that_of_both_ends() -> None:
    assert shape("disc at (7, 7) radius 1 height 50..120 cm", **VOLUME) == ir.Disc((7.0, 7.0), 1.0, ir.Prism(0.5, 1.2))


def test_shapes_combine_by_their_names() -> None:
    a, b = ir.Disc((1.0, 1.0), 1.0), ir.Disc((2.0, 1.0), 1.0)
    others = "region a = disc at (1, 1) radius 1\nregion b = disc at (2, 1) radius 1"
    assert shape("a + b", more=others) == ir.Union(a, b)
    assert shape("a * b - a", more=others) == ir.Difference(ir.Intersection(a, b), a)
    assert shape("a * (b - rock)", more=f"{others}\nobstacle rock = a") == ir.Intersection(a, ir.Difference(b, a))


def test_a_shape_that_cannot_be_meant_is_refused_in_the_plane(subtests: pytest.Subtests) -> None:
    for written, code in [
        ("box (7, 7) to (9, 7)", "MC512"),
        ("disc at (7, 7) radius 0", "MC512"),
        ("disc at (7, 7) radius -1", "MC210"),
        ("polygon (1, 1), (2, 2)", "MC512"),
        ("polygon (1, 1), (2, 2), (3, 3)", "MC512"),
        ("polygon (1, 1), (2, 2), (2, 1), (1, 2)", "MC512"),
        ("polygon (1, 1), (1, 1), (2, 1), (1, 2)", "MC512"),
        ("box (7, 7, 1) to (9, 9)", "MC205"),
        ("disc at (7, 7, 7) radius 1", "MC205"),
        ("disc at (7, 7) radius 1 height 1..2", "MC205"),
        ("ball at (7, 7, 7) radius 1", "MC205"),
        ("cylinder at (7, 7) radius 1 height 0..1", "MC205"),
        ("disc at (7, 7) radius 1 s", "MC201"),
        ("drone", "MC104"),
        ("nowhere", "MC101"),
    ]:
        with subtests.test(written=written, code=code):
            assert codes(demo(things=f"region goal = {written}")) == [code]


@pytest.mark.parametrize(
    ("written", "code"),
    [
        ("disc at (7, 7) radius 1 height 2..1", "MC303"),
        ("disc at (7, 7) radius 1 height 1..1", "MC512"),
        ("disc at (7, 7, 1) radius 1", "MC205"),
        ("ball at (7, 7) radius 1", "MC205"),
        ("box (7, 7) to (9, 9, 1)", "MC205"),
        ("box (7, 7, 0) to (9, 9, 1) height 0..1", "MC205"),
        ("polygon (1, 1, 1), (2, 1), (1, 2)", "MC205"),
    ],
)
def test_a_shape_that_cannot_be_meant_is_refused_in_a_volume(written: str, code: str) -> None:
    assert codes(demo(things=f"region goal = {written}", **VOLUME)) == [code]


def test_a_ball_in_a_plane_is_answered_with_a_disc() -> None:
    assert "disc" in only(demo(things="region goal = ball at (1, 1, 1) radius 1"), "MC205").help


@pytest.mark.parametrize("world", ["(0, 0) to (1, 1, 1)", "(0) to (1)", "(0, 0, 0, 0) to (1, 1, 1, 1)"])
def test_a_world_has_two_or_three_coordinates(world: str) -> None:
    assert codes(demo(world=f"world {world}")) == ["MC205"]


def test_a_world_without_area_is_refused() -> None:
    assert codes(demo(world="world (0, 0) to (10, 0)")) == ["MC512"]


def test_a_shape_that_doubles_from_name_to_name_is_refused_at_once() -> None:
    chain = "\n".join(f"region r{index} = r{index - 1} + r{index - 1}" for index in range(1, 61))
    text = demo(more=f"region r0 = goal\n{chain}\nrequire some drone: r60")
    assert codes(text) == ["MC207"]


def test_the_corners_of_a_polygon_may_run_either_way() -> None:
    square = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
    assert isinstance(fault(square), Simple)
    assert isinstance(fault(square[::-1]), Simple)
    assert isinstance(fault(((0, 0), (4, 0), (4, 4), (2, 1), (0, 4))), Simple)


@pytest.mark.parametrize(
    "corners",
    [
        ((0, 0), (4, 0), (1, 1), (3, 1)),
        ((0, 0), (4, 0), (4, 4), (2, 0), (0, 4)),
        ((0, 0), (4, 0), (2, 0), (2, 3)),
        ((0, 0), (2, 0), (2, 2), (0, 0)),
    ],
)
def test_sides_that_cross_touch_or_fold_back_are_found(corners: tuple[tuple[float, float], ...]) -> None:
    assert isinstance(fault(corners), str)


CORNER = st.tuples(st.integers(0, 4).map(float), st.integers(0, 4).map(float))


@given(st.lists(CORNER, min_size=3, max_size=7).map(tuple))
def test_a_polygon_is_judged_the_same_from_any_corner_and_in_any_direction(
    corners: tuple[tuple[float, float], ...],
) -> None:
    simple = isinstance(fault(corners), Simple)
    for start in range(len(corners)):
        turned = corners[start:] + corners[:start]
        assert isinstance(fault(turned), Simple) == simple
        assert isinstance(fault(turned[::-1]), Simple) == simple


# -------------------------------------------------------------------- motion


def motion(written: str, **parts: str) -> ir.Still | ir.Path:
    return mission(demo(more=f"obstacle rock = disc at (1, 4) radius 0.5 {written}", **parts)).obstacles[0].motion


def test_a_constant_velocity_is_a_path_to_the_horizon() -> None:
    still, there = (0.0, 0.0), (20.0, -10.0)
    assert motion("moving (2, -1) m/s") == ir.Path((0.0, 10.0), (still, there))
    assert motion("moving (2, -1)") == ir.Path((0.0, 10.0), (still, there))
    assert motion("moving (V, -1 m/s)", things="region goal = box (7, 7) to (9, 9)\nparam V = 2 m/s") == motion(
        "moving (2, -1)"
    )
    assert motion("") == ir.Still()


def test_the_offsets_of_a_path_keep_the_height_in_a_volume() -> None:
    path = ir.Path((0.0, 4.0), ((0.0, 0.0, 0.0), (3.0, 0.0, 0.0)))
    assert motion("along (0 s: 0, 0), (4 s: 3, 0)", **VOLUME) == path


@pytest.mark.parametrize(
    ("written", "code"),
    [
        ("along (4 s: 0, 0), (0 s: 3, 0)", "MC303"),
        ("along (4 s: 0, 0), (4 s: 3, 0)", "MC303"),
        ("along (-1 s: 0, 0)", "MC210"),
        ("along (1 m: 0, 0)", "MC201"),
        ("along (1 s: 0, 0, 0)", "MC205"),
        ("along (1 s: 0, 0 s)", "MC201"),
        ("moving (1, 2, 3) m/s", "MC205"),
        ("moving (1, 2) m", "MC201"),
        ("moving (1 m, 2) m/s", "MC201"),
    ],
)
def test_a_motion_that_cannot_be_meant_is_refused(written: str, code: str) -> None:
    assert codes(demo(more=f"obstacle rock = disc at (1, 4) radius 0.5 {written}")) == [code]


def growth(written: str, **parts: str) -> float:
    return mission(demo(more=f"obstacle rock = disc at (1, 4) radius 0.5 {written}", **parts)).obstacles[0].growth


def test_an_obstacle_grows_as_it_says_whether_it_moves_or_stands() -> None:
    assert growth("") == 0.0
    assert growth("uncertain 0.3 m/s") == growth("uncertain 0.3") == growth("moving (1, 0) m/s uncertain 0.3") == 0.3
    assert growth("along (0 s: 0, 0), (4 s: 3, 0) uncertain 0.1 m/s") == 0.1
    assert growth("uncertain (U * 2)", things="region goal = box (7, 7) to (9, 9)\nparam U = 0.1 m/s") == 0.2


@pytest.mark.parametrize(
    ("written", "code"),
    [("uncertain 0.3 m", "MC201"), ("uncertain -0.1 m/s", "MC210"), ("uncertain 0.1 deg", "MC201")],
)
def test_a_growth_that_cannot_be_meant_is_refused(written: str, code: str) -> None:
    assert codes(demo(more=f"obstacle rock = disc at (1, 4) radius 0.5 {written}")) == [code]


def test_an_obstacle_that_grows_is_no_part_of_a_shape() -> None:
    more = "obstacle rock = disc at (1, 4) radius 0.5 uncertain 1 m/s\nregion wet = rock\nrequire every drone: not wet"
    assert codes(demo(more=more)) == ["MC104"]


def test_a_moving_obstacle_is_no_part_of_a_shape() -> None:
    more = (
        "obstacle rock = disc at (1, 4) radius 0.5 moving (1, 0) m/s\nrequire every drone: not wet\nregion wet = rock"
    )
    assert codes(demo(more=more)) == ["MC104"]


# -------------------------------------------------------------------- agents

MOVES = "dynamics single_integrator(speed <= 2 m/s)"


def test_agents_are_numbered_through_the_mission() -> None:
    scout = f"agent scout {{ {MOVES} start at (5, 5) }}"
    found = mission(demo(more=f"{scout}\nteam last[2] {{ {MOVES} start line (1, 3) to (2, 3) }}"))
    assert [agent.name for agent in found.agents] == ["drone[0]", "drone[1]", "scout", "last[0]", "last[1]"]
    assert [agent.index for agent in found.agents] == [0, 1, 2, 3, 4]
    assert [(group.name, group.agents) for group in found.teams] == [
        ("drone", (0, 1)),
        ("scout", (2,)),
        ("last", (3, 4)),
    ]


def test_radius_and_altitude_have_defaults() -> None:
    agent = agents(demo())[0]
    assert (agent.radius, agent.altitude, agent.finish) == (0.1, 1.0, None)
    agent = agents(team(f"radius 5 cm altitude 2 m {MOVES} start in goal finish in goal"))[2]
    assert (agent.radius, agent.altitude) == (0.05, 2.0)
    assert agent.finish is not None
    assert agent.finish.region is not None
    assert agent.finish.region.name == "goal"


@pytest.mark.parametrize(
    ("written", "dynamics"),
    [
        ("single_integrator(speed <= 2)", ir.SingleIntegrator(2.0)),
        ("single_integrator(speed 0..2)", ir.SingleIntegrator(2.0)),
        ("double_integrator(acceleration <= 3 m/s^2, speed <= 2)", ir.DoubleIntegrator(2.0, 3.0)),
        ("unicycle(speed 1..2 m/s)", ir.Unicycle(1.0, 2.0, math.inf)),
        ("unicycle(speed <= 2 m/s, turn <= 90 deg/s)", ir.Unicycle(0.0, 2.0, math.pi / 2)),
    ],
)
def test_dynamics_have_their_bounds_in_metres_and_seconds(written: str, dynamics: ir.Dynamics) -> None:
    assert agents(team(f"dynamics {written} start in goal"))[0].dynamics == dynamics


def test_what_is_wrong_with_a_team_is_said(subtests: pytest.Subtests) -> None:
    for items, expected in [
        (f"{MOVES}", ["MC014"]),
        ("start in goal", ["MC014"]),
        ("dynamics unicicle(speed <= 1) start in goal", ["MC206"]),
        ("dynamics unicycle(sped <= 1) start in goal", ["MC206"]),
        ("dynamics unicycle start in goal", ["MC014"]),
        ("dynamics double_integrator(speed <= 1) start in goal", ["MC014"]),
        ("dynamics single_integrator(speed 1..2) start in goal", ["MC210"]),
        ("dynamics single_integrator(speed <= 0) start in goal", ["MC210"]),
        ("dynamics unicycle(speed 2..1) start in goal", ["MC210"]),
        ("dynamics unicycle(speed -1..1) start in goal", ["MC210"]),
        ("dynamics unicycle(speed 1) start in goal", ["MC206"]),
        ("dynamics unicycle(speed <= 1 m) start in goal", ["MC201"]),
        ("dynamics unicycle(speed <= 1, turn <= 0 deg/s) start in goal", ["MC210"]),
        ("dynamics unicycle(speed <= 1, speed <= 2) start in goal", ["MC013"]),
        (f"{MOVES} start in goal start in goal", ["MC013"]),
        (f"{MOVES} start in goal radius 1 m radius 2 m", ["MC013"]),
        (f"{MOVES} start in goal radius -1 m", ["MC210"]),
        (f"{MOVES} start in goal raduis 1 m", ["MC206"]),
        (f"{MOVES} start in drone", ["MC104"]),
        (f"{MOVES} start at (1, 1)", ["MC210"]),
        (f"{MOVES} start at (1, 1), (2, 2), (3, 3, 3)", ["MC205"]),
        (f"{MOVES} start in goal finish line (1, 1) to (2, 2, 2)", ["MC205"]),
    ]:
        with subtests.test(items=items, expected=expected):
            text = demo(team=f"team drone[3] {{ {items} }}", things="region goal = box (7, 7) to (9, 9)")
            assert codes(text) == expected


def test_an_altitude_in_a_volume_is_the_third_coordinate() -> None:
    assert codes(demo(**{**VOLUME, "team": f"team drone[2] {{ altitude 1 m {MOVES} start in goal }}"})) == ["MC206"]


@pytest.mark.parametrize(
    ("size", "code"), [("0", "MC210"), ("(0 - 2)", "MC210"), ("2.5", "MC209"), ("2 m", "MC201"), ("1000000", "MC513")]
)
def test_the_size_of_a_team_is_a_whole_number_within_the_limit(size: str, code: str) -> None:
    assert codes(demo(team=f"team drone[{size}] {{ {MOVES} start in goal }}")) == [code]


def test_the_limit_on_agents_is_on_all_teams_together() -> None:
    more = f"team more[9] {{ {MOVES} start in goal }}"
    assert codes(demo(more=more), limits=Limits(agents=11)) == []
    assert codes(demo(more=more), limits=Limits(agents=10)) == ["MC513"]


def places(written: str, size: int) -> list[ir.Vector]:
    found = [agent.start for agent in agents(team(f"{MOVES} start {written}", size))]
    return [place.point for place in found if place is not None and place.point is not None]


def test_places_on_a_line_include_both_ends() -> None:
    assert places("line (1, 1) to (3, 1)", 3) == [(1.0, 1.0), (2.0, 1.0), (3.0, 1.0)]
    assert places("line (1, 1) to (3, 1)", 1) == [(2.0, 1.0)]


def test_places_on_a_grid_fill_the_box_row_by_row() -> None:
    assert places("grid (1, 1) to (3, 2)", 6) == [(1, 1), (2, 1), (3, 1), (1, 2), (2, 2), (3, 2)]
    assert places("grid (1, 1) to (3, 1)", 3) == [(1, 1), (2, 1), (3, 1)]
    assert places("grid (3, 2) to (1, 1)", 2) == places("grid (3, 2) to (1, 1)", 2)


@given(
    st.integers(1, 40),
    st.tuples(st.integers(-5, 5), st.integers(-5, 5)),
    st.tuples(st.integers(-5, 5), st.integers(-5, 5)),
)
def test_a_grid_lies_in_its_box_and_no_two_places_coincide(
    count: int, first: tuple[int, int], last: tuple[int, int]
) -> None:
    here, there = tuple(map(float, first)), tuple(map(float, last))
    points = on_grid(here, there, count)
    assert len(points) == count
    if here != there:
        assert len(set(points)) == count
    for point in points:
        assert all(
            min(a, b) - 1e-9 <= value <= max(a, b) + 1e-9 for a, b, value in zip(here, there, point, strict=True)
        )


def test_a_grid_in_a_volume_has_layers() -> None:
    points = on_grid((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), 8)
    assert set(points) == {(float(x), float(y), float(z)) for x in (0, 1) for y in (0, 1) for z in (0, 1)}
    assert on_line((0.0, 0.0), (0.3, 0.0), 4)[-1] == (0.3, 0.0)


# -------------------------------------------------------------------- groups


def test_a_group_keeps_its_order_and_counts_an_agent_once() -> None:
    more = "group b = a, drone\ngroup a = drone[1]\nrequire some b: goal"
    assert [group.agents for group in mission(demo(more=more)).groups] == [(1, 0), (1,)]


@pytest.mark.parametrize(
    ("members", "code"),
    [
        ("drone[1..0]", "MC303"),
        ("drone[0..2]", "MC105"),
        ("drone[0.5]", "MC209"),
        ("drone[-1]", "MC210"),
        ("goal", "MC104"),
        ("goal[0]", "MC104"),
        ("nobody", "MC101"),
    ],
)
def test_a_group_has_members_that_are_there(members: str, code: str) -> None:
    assert codes(demo(more=f"group g = {members}\nrequire some g: goal")) == [code]


def test_groups_that_spell_out_to_too_many_agents_are_refused() -> None:
    groups = "\n".join(f"group g{index} = drone, drone[0..1]\nrequire some g{index}: goal" for index in range(9))
    assert codes(demo(more=groups), limits=Limits(formula_nodes=20)) == ["MC207"]


# -------------------------------------------------------------------- graphs


def test_a_graph_is_over_all_agents_or_those_named() -> None:
    more = (
        "beacon mast = (1, 2)\ngraph radio = proximity 2\ngraph cell = beacons 1 m over drone[1]"
        "\nrequire connected(radio) or connected(cell)"
    )
    radio, cell = mission(demo(more=more)).graphs
    assert (radio.radius, radio.agents, cell.agents) == (2.0, (0, 1), (1,))
    assert isinstance(cell, ir.BeaconCover)
    assert cell.beacons == ((1.0, 2.0),)


def test_a_sight_is_past_the_obstacles_that_stand() -> None:
    more = "obstacle wall = box (4, 4) to (5, 6)\ngraph eyes = sight 3 over drone\nrequire connected(eyes)"
    (eyes,) = mission(demo(more=more)).graphs
    assert isinstance(eyes, ir.Sight)
    assert (eyes.radius, eyes.agents, eyes.room) == (3.0, (0, 1), 0.0)
    assert eyes.shapes[-1] == ir.Box((4.0, 4.0), (5.0, 6.0))


def test_a_sight_past_more_pieces_than_a_shape_may_have_is_refused() -> None:
    holes = " - ".join(f"({' * '.join(f'box ({x}, {y}) to ({x + 0.5}, 9)' for x in range(1, 4))})" for y in range(1, 7))
    more = f"obstacle wall = box (0, 0) to (9, 9) - {holes}\ngraph eyes = sight 3\nrequire connected(eyes)"
    assert codes(demo(more=more)) == ["MC207"]


@pytest.mark.parametrize(
    ("graph", "code"),
    [
        ("proximity 0 m", "MC210"),
        ("proximity 1 s", "MC201"),
        ("sight 0 m", "MC210"),
        ("sight 1 over goal", "MC104"),
        ("beacons 1 m", "MC014"),
        ("proximity 1 over goal", "MC104"),
    ],
)
def test_a_graph_that_cannot_be_meant_is_refused(graph: str, code: str) -> None:
    assert codes(demo(more=f"graph g = {graph}\nrequire connected(g)")) == [code]


FOUR = "team drone[4] { dynamics single_integrator(speed <= 2 m/s)  start line (1, 1) to (4, 1) }"


@pytest.mark.parametrize(
    ("call", "agents", "order"),
    [
        ("connected(g)", (0, 1, 2, 3), 1),
        ("connected(g, 2)", (0, 1, 2, 3), 2),
        ("connected(g, drone[1..3])", (1, 2, 3), 1),
        ("connected(g, drone[1..3], 2)", (1, 2, 3), 2),
        ("connected(g, K)", (0, 1, 2, 3), 3),
        ("connected(g, drone, K)", (0, 1, 2, 3), 3),
    ],
)
def test_how_many_may_be_lost_is_a_number_after_the_agents(call: str, agents: tuple[int, ...], order: int) -> None:
    found = mission(demo(team=FOUR, more=f"param K = 3\ngraph g = proximity 2\nrequire connected(g, K) or {call}"))
    (formula,) = (each.formula for each in found.requirements if "connected" in each.formula.span.text)
    assert isinstance(formula, ir.Apply)
    last = formula.operands[-1]
    assert isinstance(last, ir.Holds)
    assert last.predicate == ir.Connected(found.graphs[0], agents, order)


@pytest.mark.parametrize(
    ("call", "code"),
    [
        ("connected(g, 2)", "MC210"),
        ("connected(g, 0)", "MC210"),
        ("connected(g, 1.5)", "MC209"),
        ("connected(g, 2 m)", "MC201"),
        ("connected(g, 1, drone)", "MC104"),
        ("connected(g, 1, 1)", "MC104"),
        ("connected(g, drone, 1, 1)", "MC104"),
        ("(every drone: inside(2))", "MC104"),
    ],
)
def test_a_number_that_no_call_takes_is_refused(call: str, code: str) -> None:
    more = f"graph g = proximity 2\nlet kept = connected(g)\nrequire kept and {call}"
    assert codes(demo(more=more)) == [code]


# ---------------------------------------------------------------- formations


def edges(written: str, size: int = 4) -> dict[tuple[int, int], float | ir.Vector]:
    more = f"formation f = {written} tolerance 0.1 m\nrequire f"
    places = f"team drone[{size}] {{ {MOVES} start line (1, 1) to (8, 1) }}"
    found = mission(demo(team=places, more=more)).formations[0].edges
    return {(edge.first, edge.second): edge.target for edge in found}


def test_a_line_is_rigid_and_a_chain_may_bend() -> None:
    assert edges("line of drone spacing 0.5 m") == {(a, b): 0.5 * (b - a) for a in range(4) for b in range(a + 1, 4)}
    assert edges("chain of drone spacing 0.5 m") == {(0, 1): 0.5, (1, 2): 0.5, (2, 3): 0.5}


def test_a_line_with_a_heading_keeps_offsets_to_the_first() -> None:
    found = edges("line of drone[0..2] spacing 2 m heading 90 deg")
    assert found.keys() == {(0, 1), (0, 2)}
    assert found[0, 2] == pytest.approx((0.0, 4.0))


def test_a_heading_of_more_than_a_full_turn_is_asked_for_in_degrees() -> None:
    written = "formation f = line of drone spacing 1 m tolerance 0.1 m heading"
    assert only(demo(more=f"{written} 90"), "MC210").help == "write `90 deg`"
    assert (
        only(demo(more=f"{written} 400 deg"), "MC210").message
        == "the heading is 6.981317008 rad, more than a full turn"
    )


def test_members_are_counted_with_two_points() -> None:
    found = only(demo(more="group e = drone[0-1]"), "MC105")
    assert found.message == "expected a range of members, found the difference `0-1`"
    assert found.help == "write `drone[0..1]`"


def test_a_speed_without_a_relation_is_answered_with_the_speed_as_written() -> None:
    dynamics = "agent e { dynamics unicycle(speed 2 m/s)  start at (5, 5) }"
    assert only(demo(more=dynamics), "MC206").help == "write `speed <= 2 m/s`"


def test_no_unit_is_offered_in_place_of_another_scale() -> None:
    found = only(demo(require="require r: every drone: speed <= 50 cm/s"), "MC202")
    assert found.fix is None
    assert "one of the units" in found.help


def test_a_circle_is_a_regular_polygon() -> None:
    side = edges("circle of drone spacing 1 m")
    assert side[0, 1] == pytest.approx(1.0)
    assert side[0, 3] == pytest.approx(1.0)
    assert side[0, 2] == pytest.approx(math.sqrt(2))
    assert edges("circle of drone radius 1 m")[0, 2] == pytest.approx(2.0)


def test_a_grid_is_as_square_as_its_agents_allow_or_as_said() -> None:
    square = edges("grid of drone spacing 1 m")
    assert square[0, 3] == pytest.approx(math.sqrt(2))
    assert square[0, 1] == square[0, 2] == 1.0
    assert edges("grid of drone spacing 1 m rows 1")[0, 3] == 3.0
    assert edges("grid of drone spacing 1 m columns 1")[0, 3] == 3.0


def test_star_offsets_and_distances_keep_what_they_list() -> None:
    assert edges("star of drone spacing 1 m") == {(0, 1): 1.0, (0, 2): 1.0, (0, 3): 1.0}
    wedge = edges("offsets of drone[0..2] (1, 0), (0, 1), (0, -1)")
    assert wedge == {(0, 1): (-1.0, 1.0), (0, 2): (-1.0, -1.0)}
    assert edges("distances of drone[1..3] (0-1: 0.8, 2-0: 0.7)") == {(1, 2): 0.8, (3, 1): 0.7}


def test_what_is_wrong_with_a_formation_is_said(subtests: pytest.Subtests) -> None:
    for written, expected in [
        ("line of drone spacing 1 m", ["MC014"]),
        ("line of drone tolerance 1 m", ["MC014"]),
        ("line of drone spacing 0 m tolerance 1 m", ["MC210"]),
        ("line of drone spacing 1 m tolerance 0 m", ["MC210"]),
        ("line of drone spacing 1 m tolerance 1 m rows 2", ["MC206"]),
        ("line of drone spacing 1 m spacing 1 m tolerance 1 m", ["MC013"]),
        ("line of goal spacing 1 m tolerance 1 m", ["MC104"]),
        ("circle of drone spacing 1 m radius 1 m tolerance 1 m", ["MC013"]),
        ("grid of drone spacing 1 m rows 1 columns 1 tolerance 1 m", ["MC210"]),
        ("grid of drone spacing 1 m rows 1.5 tolerance 1 m", ["MC209"]),
        ("line of drone spacing 1 m heading 1 m tolerance 1 m", ["MC201"]),
        ("offsets of drone (0, 0) tolerance 1 m", ["MC210"]),
        ("offsets of drone (0, 0), (1, 1, 1) tolerance 1 m", ["MC205"]),
        ("distances of drone (0-2: 1) tolerance 1 m", ["MC105"]),
        ("distances of drone (0-0: 1) tolerance 1 m", ["MC210"]),
        ("distances of drone (0-1: 1, 1-0: 2) tolerance 1 m", ["MC013"]),
        ("distances of drone (0-1: 0) tolerance 1 m", ["MC210"]),
    ]:
        with subtests.test(written=written, expected=expected):
            assert codes(demo(more=f"formation f = {written}\nrequire f")) == expected


def test_a_rigid_formation_of_too_many_agents_is_refused_before_its_edges_are_made() -> None:
    text = demo(
        team=f"team drone[10000] {{ {MOVES} start line (1, 1) to (2, 1) }}",
        more="formation f = line of drone spacing 1 m tolerance 1 m\nrequire f",
    )
    assert codes(text) == ["MC207"]


def test_a_total_tolerance_is_kept() -> None:
    more = "formation f = chain of drone spacing 1 m total tolerance 0.2 m\nrequire f"
    assert mission(demo(more=more)).formations[0].total


# ---------------------------------------------------------------- small tools


def test_a_name_of_one_letter_is_near_no_other() -> None:
    assert isinstance(nearest("a", ["b", "c"]), Nothing)
    assert nearest("A", ["b", "a"]) == "a"


def test_the_nearest_name_is_a_few_letters_away() -> None:
    assert nearest("gaol", ["base", "goal"]) == "goal"
    assert nearest("Base", ["base", "goal"]) == "base"
    assert isinstance(nearest("threat", ["base", "goal"]), Nothing)
    assert edits("gaol", "goal") == 1
    assert edits("", "goal") == 4


@given(st.text("ab", max_size=5), st.text("ab", max_size=5))
def test_edits_are_counted_the_same_from_both_sides(first: str, second: str) -> None:
    assert edits(first, second) == edits(second, first)
    assert (edits(first, second) == 0) == (first == second)


GRAPHS = st.dictionaries(st.sampled_from("abcdef"), st.lists(st.sampled_from("abcdef"), max_size=3))


@given(GRAPHS)
def test_definitions_come_after_those_they_rest_on(rests_on: dict[str, list[str]]) -> None:
    order, cycles = in_order(rests_on)
    assert sorted(order) == sorted(rests_on)
    if not cycles:
        for place, name in enumerate(order):
            assert {other for other in rests_on[name] if other in rests_on} <= set(order[:place])
    for cycle in cycles:
        assert all(after in rests_on[name] for name, after in zip(cycle, cycle[1:] + cycle[:1], strict=True))


# -------------------------------------------------------------------- delays


def test_a_delay_is_in_steps_and_of_agents_by_their_numbers() -> None:
    things = "region goal = box (7, 7) to (9, 9)\nparam D = 2 s"
    found = mission(demo(things=things, more="tolerate delay D of drone\ntolerate delay 3 steps of drone[1]"))
    assert [(each.agents, each.steps) for each in found.tolerances] == [(tuple(range(2)), 2), ((1,), 3)]


@pytest.mark.parametrize(
    ("written", "code"),
    [
        ("1.5 s of drone", "MC302"),
        ("-1 s of drone", "MC210"),
        ("11 s of drone", "MC210"),
        ("2 m of drone", "MC201"),
        ("2 s of goal", "MC104"),
        ("2 s of nobody", "MC101"),
        ("2 s of drone[2]", "MC105"),
    ],
)
def test_a_delay_that_cannot_be_meant_is_refused(written: str, code: str) -> None:
    assert codes(demo(more=f"tolerate delay {written}")) == [code]

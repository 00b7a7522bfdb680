"""What resolve makes of formulas, and who they are about."""

from __future__ import annotations

import math

import pytest

from missionc import ir
from missionc.base.limits import Limits
from missionc.frontend.resolve.show_ir import show_ir
from missionc.ir.language.predicates import PREDICATES
from tests.support.resolved_missions import codes, demo, mission, only

MOVES = "dynamics single_integrator(speed <= 2 m/s)"
SCOUT = f"agent scout {{ {MOVES} start at (5, 5) }}"
MORE = "\n".join(
    [
        SCOUT,
        "beacon mast = (1, 2)",
        "group pair = drone[0], scout",
        "graph radio = proximity 2 m",
        "formation wall = chain of drone spacing 1 m tolerance 0.1 m",
        "let safe = not goal",
        "let linked = connected(radio)",
        "require used: (some pair: safe) or linked or wall or (every drone: distance(mast) >= 0)",
    ]
)


def about(formula: str, world: str = "world (0, 0) to (10, 10)") -> list[str]:
    """The codes of a mission that requires this formula."""
    return codes(demo(world=world, more=MORE, require=f"require it: {formula}"))


def formula(text: str) -> ir.Formula:
    return mission(demo(more=MORE, require=f"require it: {text}")).requirements[-1].formula


def predicate(text: str) -> ir.Predicate:
    found = formula(f"some drone: {text}")
    assert isinstance(found, ir.AtLeastOf)
    assert isinstance(found.body, ir.Holds)
    return found.body.predicate


# ------------------------------------------------------------- team or agent


def test_a_formula_about_the_team_may_be_required(subtests: pytest.Subtests) -> None:
    for text in [
        "true",
        "linked",
        "wall",
        "some drone: goal",
        "every pair: scout or drone[0..1] or pair",
        "at least 2 pair: safe",
        "scout: goal",
        "drone[1]: not safe",
        "connected(radio, pair)",
        "distance(drone[0], scout) <= 2",
        "wall until[0, 3 s] ((some drone: goal) and linked)",
        "every drone: goal until[0, 3 s] (speed <= 1 or true)",
        "some drone: goal reach[hops 0..1 on radio] scout",
        "not next linked",
        "(some drone: goal) implies some drone: always[0, 2 s] inside(goal) iff touches(goal)",
        "some drone: count[hops 0..1 on radio] goal >= 1",
    ]:
        with subtests.test(text=text):
            assert about(text) == []


def test_a_formula_about_one_agent_needs_a_quantifier(subtests: pytest.Subtests) -> None:
    for text in [
        "goal",
        "safe",
        "scout",
        "drone[0]",
        "inside(goal)",
        "x <= 3",
        "distance(mast) <= 3",
        "always[0, 3 s] goal",
        "goal and scout",
        "goal reach[hops 0..1 on radio] scout",
        "escape[hops 1.. on radio] goal",
        "wall and goal",
        "linked until[0, 3 s] goal",
        "(some drone: goal) or safe",
    ]:
        with subtests.test(text=text):
            assert about(text) == ["MC203"]


@pytest.mark.parametrize(
    "text",
    [
        "every drone: linked",
        "every drone: wall",
        "every drone: some drone: goal",
        "scout: drone[0]: goal",
        "every drone: (goal and linked)",
        "every drone: always[0, 2 s] (goal implies wall)",
        "some drone: goal reach[hops 0..1 on radio] linked",
        "some drone: somewhere[hops 0..1 on radio] drone[0]: goal",
        "some drone: count[hops 0..1 on radio] wall >= 1",
        "some drone: distance(drone[0], scout) <= 1",
        "some drone: distance(drone[0], scout) + x <= 1",
    ],
)
def test_a_formula_about_the_team_is_not_asked_of_one_agent(text: str) -> None:
    assert about(text) == ["MC204"]


def test_the_message_names_the_operand_and_writes_the_quantifier() -> None:
    finding = only(demo(more=MORE, require="require it: always[0, 2 s] (wall and goal)"), "MC203")
    assert finding.primary is not None
    assert finding.primary.span.text == "goal"
    assert finding.labels[0].span.text == "wall"
    assert "`(every drone: goal)`" in finding.help
    assert finding.fix is not None
    assert finding.fix.replacement == "(every drone: goal)"


def test_every_operand_about_one_agent_is_named() -> None:
    assert about("wall and goal and (linked or safe)") == ["MC203", "MC203"]


def test_a_let_is_named_where_it_is_used() -> None:
    finding = only(demo(more=MORE, require="require it: safe"), "MC203")
    assert finding.primary is not None
    assert finding.primary.span.text == "safe"


def test_a_let_that_mixes_is_reported_where_it_is_defined_and_only_there() -> None:
    text = demo(more=f"{MORE}\nlet mixed = goal and wall", require="require it: mixed and (some drone: mixed)")
    assert codes(text) == ["MC203"]


def test_a_label_that_was_meant_as_an_agent_is_explained() -> None:
    finding = only(demo(more=MORE, require="require scout: goal"), "MC203")
    assert finding.notes[0].startswith("`scout:` is the label here")


# ---------------------------------------------------------------- predicates


def test_a_name_stands_for_what_it_was_declared_as() -> None:
    found = predicate("goal")
    assert isinstance(found, ir.Inside)
    assert not found.body
    assert isinstance(predicate("touches(goal)"), ir.Touches)
    belongs = formula("some drone: pair")
    assert isinstance(belongs, ir.AtLeastOf)
    assert isinstance(belongs.body, ir.Belongs)
    assert belongs.body.agents.agents == (0, 2)


@pytest.mark.parametrize(
    ("text", "terms", "constant", "strict"),
    [
        ("x <= 3", [(-1.0, ir.Coordinate(0))], 3.0, False),
        ("3 > x", [(-1.0, ir.Coordinate(0))], 3.0, True),
        ("x + 2*y >= 3 m", [(1.0, ir.Coordinate(0)), (2.0, ir.Coordinate(1))], -3.0, False),
        ("x - (y - 50 cm) / 2 < x + 1", [(0.5, ir.Coordinate(1))], 0.75, True),
        ("speed <= 1 m/s", [(-1.0, ir.Speed())], 1.0, False),
        ("-altitude < -80 cm", [(1.0, ir.Altitude())], -0.8, True),
        ("distance(scout) >= 1", [(1.0, ir.DistanceTo(2))], -1.0, False),
        ("2 s * speed <= x", [(-2.0, ir.Speed()), (1.0, ir.Coordinate(0))], 0.0, False),
    ],
)
def test_a_comparison_is_one_linear_expression(
    text: str, terms: list[tuple[float, ir.Feature]], constant: float, strict: bool
) -> None:
    found = predicate(text)
    assert isinstance(found, ir.Compare)
    assert {feature: weight for weight, feature in found.terms} == {feature: weight for weight, feature in terms}
    assert (found.constant, found.strict) == (pytest.approx(constant), strict)


def test_a_predicate_that_cannot_be_meant_is_refused(subtests: pytest.Subtests) -> None:
    for text, code in [
        ("x <= 3 s", "MC201"),
        ("x + speed <= 3", "MC201"),
        ("x * y <= 3", "MC104"),
        ("1 / x <= 3", "MC104"),
        ("1 <= 2", "MC104"),
        ("x <= x", "MC104"),
        ("z <= 3", "MC205"),
        ("x <= goal", "MC104"),
        ("x <= nothing", "MC101"),
        ("distance(drone) <= 3", "MC104"),
        ("distance(drone[0..1]) <= 3", "MC104"),
        ("distance(wall) <= 3", "MC104"),
        ("distance(nothing) <= 3", "MC101"),
        ("distance(drone[7]) <= 3", "MC105"),
        ("distance(scout, scout) <= 3", "MC210"),
        ("distance(scout, goal) <= 3", "MC104"),
        ("distance(scout, scout, scout) <= 3", "MC104"),
        ("x / 0 <= 3", "MC210"),
        ("speed", "MC104"),
        ("radio", "MC104"),
        ("mast", "MC104"),
        ("nothing", "MC101"),
        ("inside(radio)", "MC104"),
        ("inside(drone[0])", "MC104"),
        ("inside(goal, goal)", "MC104"),
        ("insite(goal)", "MC101"),
    ]:
        with subtests.test(text=text, code=code):
            assert about(f"some drone: {text}") == [code]


@pytest.mark.parametrize("text", ["connected(goal)", "connected(radio, goal)", "inside(wall)"])
def test_a_call_takes_names_of_the_right_kind(text: str) -> None:
    assert "MC104" in about(text)


def test_a_graph_that_is_no_family_has_no_members() -> None:
    assert about("connected(radio[0])") == ["MC109"]


def test_in_a_volume_z_is_a_coordinate() -> None:
    text = demo(
        world="world (0, 0, 0) to (10, 10, 3)",
        team=f"team drone[2] {{ {MOVES} start in goal }}",
        require="require every drone: z <= 2",
    )
    assert "-z + 2 >= 0" in show_ir(mission(text))


def test_connected_asks_only_agents_of_its_graph() -> None:
    more = "graph east = proximity 1 m over drone[0]\nrequire connected(east, drone)"
    assert only(demo(more=more), "MC104").message == "`drone[1]` of `drone` is not on the graph `east`"


def test_the_registry_of_predicates_knows_every_form() -> None:
    assert {entry.name for entry in PREDICATES if entry.called} == {"inside", "touches", "connected"}
    for entry in PREDICATES:
        assert entry.says
        assert entry.example


# ----------------------------------------------------- operators, quantifiers


@pytest.mark.parametrize(
    ("bounds", "low", "high"),
    [
        ("hops 0..2", 0, 2),
        ("hops <= 2", 0, 2),
        ("hops 1..", 1, math.inf),
        ("hops 1..1 on radio", 1, 1),
        ("distance <= 5 m", 0, 5),
        ("distance 50..120 cm", 0.5, 1.2),
    ],
)
def test_the_length_of_a_route_has_both_bounds_and_a_graph(bounds: str, low: float, high: float) -> None:
    found = formula(f"some drone: somewhere[{bounds}] goal")
    assert isinstance(found, ir.AtLeastOf)
    assert isinstance(found.body, ir.Apply)
    assert isinstance(found.body.bounds, ir.Length)
    assert (found.body.bounds.low, found.body.bounds.high, found.body.bounds.graph.name) == (low, high, "radio")


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("somewhere[hops 0..1.5] goal", "MC209"),
        ("somewhere[hops 2..1] goal", "MC303"),
        ("somewhere[hops -1..1] goal", "MC210"),
        ("somewhere[hops 0..1 m] goal", "MC201"),
        ("somewhere[distance 0..1 s] goal", "MC201"),
        ("somewhere[distance 2..1] goal", "MC303"),
        ("somewhere[hops 0..1 on wall] goal", "MC104"),
        ("somewhere[hops 0..1 on radios] goal", "MC101"),
        ("count[hops 0..1] goal >= 1.5", "MC209"),
        ("count[hops 0..1] goal >= -1", "MC210"),
        ("always[0, 3 m] goal", "MC201"),
    ],
)
def test_bounds_that_cannot_be_meant_are_refused(text: str, code: str) -> None:
    assert about(f"some drone: {text}") == [code]


@pytest.mark.parametrize(
    "graphs", ["", "graph a = proximity 1 m\ngraph b = proximity 2 m\nrequire connected(a) iff connected(b)"]
)
def test_a_graph_may_be_left_out_only_where_there_is_one(graphs: str) -> None:
    text = demo(more=f"{graphs}\nrequire some drone: somewhere[hops 0..1] goal")
    assert codes(text) == ["MC208"]


def test_a_count_keeps_its_comparison() -> None:
    found = formula("some drone: count[hops 1..1] goal >= 2")
    assert isinstance(found, ir.AtLeastOf)
    assert isinstance(found.body, ir.Apply)
    assert (found.body.comparison, found.body.number) == (">=", 2)


@pytest.mark.parametrize(
    ("text", "number", "agents"),
    [("every pair: goal", 2, (0, 2)), ("some drone: goal", 1, (0, 1)), ("at least 2 drone: goal", 2, (0, 1))],
)
def test_a_quantifier_is_a_number_of_agents(text: str, number: int, agents: tuple[int, ...]) -> None:
    found = formula(text)
    assert isinstance(found, ir.AtLeastOf)
    assert (found.number, found.agents.agents) == (number, agents)


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("at least 3 drone: goal", "MC210"),
        ("at least 0 drone: goal", "MC210"),
        ("at least 1.5 drone: goal", "MC209"),
        ("every goal: goal", "MC104"),
        ("every dron: goal", "MC101"),
        ("drone: goal", "MC104"),
        ("drone[0..1]: goal", "MC104"),
        ("pair: goal", "MC104"),
        ("drone[2]: goal", "MC105"),
    ],
)
def test_a_quantifier_that_cannot_be_meant_is_refused(text: str, code: str) -> None:
    assert about(text) == [code]


# ---------------------------------------------------------------------- lets


def test_every_use_of_a_let_is_the_same_formula() -> None:
    found = mission(demo(more="let safe = not goal\nrequire a: every drone: safe\nrequire b: some drone: safe"))
    bodies = [item.formula.body for item in found.requirements if isinstance(item.formula, ir.AtLeastOf)]
    assert bodies[0] is bodies[1] is found.lets[0][1]


def test_a_chain_of_lets_that_doubles_sixty_times_is_refused_at_once_and_once() -> None:
    chain = "\n".join(f"let a{index} = a{index - 1} and a{index - 1}" for index in range(1, 61))
    assert codes(demo(more=f"let a0 = goal\n{chain}\nrequire every drone: a60")) == ["MC207"]


def test_a_chain_of_lets_deeper_than_the_limit_is_refused() -> None:
    chain = "\n".join(f"let a{index} = not a{index - 1}" for index in range(1, 2000))
    assert codes(demo(more=f"let a0 = goal\n{chain}\nrequire every drone: a1999")) == ["MC005"]


def test_a_formula_as_deep_as_the_limit_resolves() -> None:
    depth = Limits().nesting - 20
    assert codes(demo(more=f"require every drone: {'not ' * depth}goal")) == []
    parenthesised = "(goal or " * (depth // 2) + "goal" + ")" * (depth // 2)
    assert codes(demo(more=f"require every drone: {parenthesised}")) == []


@pytest.mark.parametrize(
    ("asked", "code", "message", "advice"),
    [
        (
            "drone[0]: goal or drone[1]: goal",
            "MC204",
            "`drone[1]: goal` is about the team; `drone[0]:` needs a formula about one agent",
            "close `drone[0]:` before this formula with parentheses: `(drone[0]: …)`",
        ),
        (
            "drone[0] and drone[1]: goal",
            "MC203",
            "`drone[0]` alone is a membership test without an agent",
            "add a formula, for example `(drone[0]: f)`",
        ),
        ("nobody: every drone: goal", "MC101", "unknown name `nobody`", "name one agent"),
        ("every drone: goal <= 3", "MC104", "expected a parameter, a state or", "`distance(goal)`"),
        ("every drone: vx <= 3", "MC101", "unknown name `vx`", "use a state: `x`, `y`, `z`, `speed`"),
        ("at least two drone: goal", "MC101", "unknown name `two`", "declare the name with `param two = VALUE`"),
        ("connected", "MC101", "`connected` needs graph in parentheses", "for example, `connected(radio, east)`"),
        ("every drone: inside(goal, goal)", "MC104", "`inside` takes one region; found 2 arguments", "`inside(field)`"),
        ("every drone: distance(goal, goal) <= 3", "MC104", "expected one agent", "name one agent"),
    ],
)
def test_a_slip_is_one_finding_with_a_way_out(asked: str, code: str, message: str, advice: str) -> None:
    found = only(demo(require=f"require r: {asked}"), code)
    assert message in found.message
    assert advice in found.help


def test_a_length_that_runs_backwards_is_said_in_hops() -> None:
    radio = "graph radio = proximity 1 m"
    found = only(demo(more=radio, require="require r: every drone: somewhere[hops 2..1] goal"), "MC303")
    assert found.message == "bounds reversed: 2 hops is greater than 1 hop"

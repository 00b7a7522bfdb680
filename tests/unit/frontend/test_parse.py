"""Every form of the language is read as the tree that is meant; includes are spliced in; limits hold."""

from __future__ import annotations

import logging
from collections.abc import Callable
from inspect import isfunction, signature
from itertools import product
from pathlib import Path

import lark
import pytest

from missionc.base.diagnostics.code import INCLUDE_NOT_ALLOWED
from missionc.base.diagnostics.model import Diagnostic, Label
from missionc.base.limits import Limits
from missionc.base.resources import folder
from missionc.base.source import Source, Span
from missionc.frontend.syntax import ast, build, build_formula, parse_table
from missionc.frontend.syntax.parse import parse
from missionc.frontend.syntax.tokens import WORDS
from missionc.ir.language.operator import Bounds, Fixity
from missionc.ir.language.operators import OPERATORS
from tests.support.random_trees import without_spans

WHOLE_LANGUAGE = """
mission wildfire                                     # once, first
param  T = 20 s                                      # may be overridden: -D T=30s

time   step 1 s, horizon T                           # the horizon is a whole number of steps
world  (0, 0) to (10, 10)                            # two coordinates: a plane; three: a volume

region   base   = box (0.5, 0.5) to (2.5, 2.5)
region   fire   = disc at (5.2, 5.2) radius 1 m
region   field  = polygon (3, 3), (4, 3.2), (3.6, 4.2)
region   wet    = field - fire                       # shapes combine: + union, * intersection, - difference
obstacle ridge  = box (3, 7) to (4, 9)
obstacle truck  = disc at (2, 5) radius 0.5 moving (2, 0) m/s
obstacle crowd  = disc at (3, 3) radius 1 m uncertain 0.1 m/s
obstacle train  = box (0, 0) to (1, 1) along (0 s: 0, 0), (4 s: 3, 0), (9 s: 3, 5)
beacon   mast   = (1.5, 1.5)

team drone[5] {                                      # drone[0] … drone[4]
  radius   0.1 m
  dynamics unicycle(speed 1..2 m/s)
  start    in base
  finish   in goal                                   # optional
}
agent  truck7 { dynamics single_integrator(speed <= 3 m/s)  start at (1, 1)  finish at (9, 9) }
group  east = drone[0..2], truck7

graph     radio = proximity 1 m
graph     cell  = beacons 2.5 m over east
formation wall  = line of drone spacing 0.8 m tolerance 0.1 m
formation wedge = offsets of east (0, 0), (-1, 1), (-1, -1) tolerance 0.2 m
formation ring  = distances of drone (0-1: 0.8, 1-2: 0.8, 2-0: 0.8) tolerance 0.1 m
separation 0.3 m
clearance  0.1 m

let     safe = not fire                              # a named formula
require relay:  every drone: always[0, T] (field implies safe reach[hops 0..2 on radio] base)
require rescue: some drone: eventually[0, 12 s] field
prefer  calm:   every drone: always[0, T] speed <= 1.5 m/s weight 2
minimize distance
tolerate delay 2 s of drone
solve with smt { nodes = 110, neighbors = 6 }
"""


def nothing_to_include(path: str, span: Span) -> Source:
    return Source(path, "")


def findings_of(text: str, limits: Limits | None = None) -> list[Diagnostic]:
    return parse(Source("test.mission", text), limits or Limits(), nothing_to_include)[1]


def read(text: str, limits: Limits | None = None) -> tuple[ast.Declaration, ...]:
    program, findings = parse(Source("test.mission", text), limits or Limits(), nothing_to_include)
    assert [finding.message for finding in findings] == []
    assert program is not None
    return program.declarations


def formula(text: str) -> ast.Formula:
    (declaration,) = read(f"let f = {text}")
    assert isinstance(declaration, ast.Let)
    return declaration.body


def same(first: str, second: str) -> bool:
    return without_spans(formula(first)) == without_spans(formula(second))


def test_the_language_by_example_is_read_whole() -> None:
    kinds = " ".join(type(declaration).__name__ for declaration in read(WHOLE_LANGUAGE))
    assert kinds == (
        "MissionName Param Time World Region Region Region Region Obstacle Obstacle Obstacle Obstacle Beacon Team Team "
        "Group Graph Graph Formation Formation Formation Separation Clearance Let Require Require Prefer Minimize "
        "Tolerate Solve"
    )


def test_every_real_mission_is_read(missions: Path) -> None:
    for path in sorted(missions.glob("*.mission")):
        assert len(read(path.read_text(encoding="utf-8"))) > 10


@pytest.mark.parametrize(
    ("short", "long"),
    [
        ("G[0, 2] a", "always[0, 2] a"),
        ("F[0, 2] a", "eventually[0, 2] a"),
        ("a U[0, end] b", "a until[0, end] b"),
        ("a Rel[1 s, 2 s] b", "a release[1 s, 2 s] b"),
        ("a R[hops 1..2 on g] b", "a reach[hops 1..2 on g] b"),
        ("E[distance 2..] a", "escape[distance 2..] a"),
        ("!a", "not a"),
        ("a & b | c", "a and b or c"),
        ("a -> b <-> c", "a implies b iff c"),
    ],
)
def test_a_letter_is_its_word(short: str, long: str) -> None:
    assert same(short, long)


def test_operators_bind_as_the_language_says(subtests: pytest.Subtests) -> None:
    for bare, bracketed in [
        ("not a and b", "(not a) and b"),
        ("always[0, 1] a until[0, 1] b", "(always[0, 1] a) until[0, 1] b"),
        ("a and b until[0, 1] c", "a and (b until[0, 1] c)"),
        ("a until[0, 1] b reach[hops 0..1] c", "(a until[0, 1] b) reach[hops 0..1] c"),
        ("a or b and c", "a or (b and c)"),
        ("a implies b or c", "a implies (b or c)"),
        ("a implies b implies c", "a implies (b implies c)"),
        ("a iff b implies c", "a iff (b implies c)"),
        ("a iff b iff c", "(a iff b) iff c"),
        ("not x <= 3", "not (x <= 3)"),
        ("x + 2*y <= 3 and a", "((x + (2*y)) <= 3) and a"),
        ("a - b - c <= 1", "((a - b) - c) <= 1"),
        ("every g: a and b or c", "every g: ((a and b) or c)"),
        ("a and every g: b and c", "a and (every g: (b and c))"),
        ("a until[0, 1] some g: b implies c", "a until[0, 1] (some g: (b implies c))"),
        ("eventually[0, 2 s] every g: a and b", "eventually[0, 2 s] (every g: (a and b))"),
        ("not drone[0]: a iff b", "not (drone[0]: (a iff b))"),
        ("at least 2 g: a or b", "at least 2 g: (a or b)"),
        ("every g: some h: a and b", "every g: (some h: (a and b))"),
        ("count[hops 1..1] not a >= 2 and b", "(count[hops 1..1] (not a) >= 2) and b"),
        ("not count[hops 1..1] a >= 2", "not (count[hops 1..1] a >= 2)"),
    ]:
        with subtests.test(bare=bare, bracketed=bracketed):
            assert same(bare, bracketed)


def test_a_quantifier_in_brackets_ends_with_them() -> None:
    match formula("((every robot: not w2) and connected(link)) until[2.4 s, 4.7 s] always[0, end] row"):
        case ast.Apply(operator="until", operands=(ast.Apply(operator="and", operands=(left, _)), right)):
            assert isinstance(left, ast.Quantified)
            assert isinstance(right, ast.Apply)
            assert isinstance(right.bounds, ast.Window)
            assert right.bounds.high is None
        case other:
            raise AssertionError(other)


def test_a_chain_of_one_operator_is_one_node() -> None:
    node = formula(" and ".join(["a"] * 1000))
    assert isinstance(node, ast.Apply)
    assert len(node.operands) == 1000
    assert node.operator_span.text == "and"


def test_brackets_keep_a_chain_apart() -> None:
    node = formula("(a and b) and c")
    assert isinstance(node, ast.Apply)
    assert len(node.operands) == 2


def test_count_keeps_its_comparison() -> None:
    node = formula("count[hops 1..1 on radio] (speed <= 1) >= 2")
    assert isinstance(node, ast.Apply)
    assert isinstance(node.operands[0], ast.Compare)
    assert node.comparison == ">="
    assert isinstance(node.number, ast.Number)
    assert node.number.value == 2


@pytest.mark.parametrize(
    ("text", "low", "high", "graph"),
    [
        ("hops 0..2 on radio", 0, 2, "radio"),
        ("hops 2..on radio", 2, None, "radio"),
        ("hops 2..", 2, None, None),
        ("hops <= 2", None, 2, None),
        ("distance <= 5 m", None, 5, None),
        ("distance 0.5..1.5 m", 0.5, 1.5, None),
    ],
)
def test_a_length_has_an_end_or_two(text: str, low: float | None, high: float | None, graph: str | None) -> None:
    node = formula(f"somewhere[{text}] a")
    assert isinstance(node, ast.Apply)
    assert isinstance(node.bounds, ast.Length)
    assert node.bounds.metric.value == text.split()[0]
    values = [end.value if isinstance(end, ast.Number) else None for end in (node.bounds.low, node.bounds.high)]
    assert values == [low, high]
    assert (node.bounds.graph.text if node.bounds.graph else None) == graph


@pytest.mark.parametrize(
    ("text", "low", "high"), [("1..2", 1, 2), ("0.5...7", 0.5, 0.7), ("1e-3..2e+0", 0.001, 2), (".5 .. 1.5", 0.5, 1.5)]
)
def test_points_in_a_range_belong_to_no_number(text: str, low: float, high: float) -> None:
    node = formula(f"somewhere[hops {text.replace('...', '.. .')}] a")
    assert isinstance(node, ast.Apply)
    assert isinstance(node.bounds, ast.Length)
    assert isinstance(node.bounds.low, ast.Number)
    assert isinstance(node.bounds.high, ast.Number)
    assert (node.bounds.low.value, node.bounds.high.value) == (low, high)


def test_the_unit_of_a_range_stays_with_its_end() -> None:
    (team,) = read("team t[2] { dynamics d(speed 1..2 m/s) }")
    assert isinstance(team, ast.Team)
    (dynamics,) = team.items
    assert isinstance(dynamics, ast.Dynamics)
    (speed,) = dynamics.settings
    assert isinstance(speed.low, ast.Number)
    assert isinstance(speed.high, ast.Number)
    assert (speed.relation, speed.low.unit, speed.high.unit) == ("..", None, "m/s")


@pytest.mark.parametrize("text", ["N", "-1", "(T/2)", "(T + 3 s)", "-(2*N - 1)", "20", "0.5 km", "1e-3s"])
def test_a_quantity_may_stand_wherever_a_number_may(text: str) -> None:
    read(
        f"""param p = {text}
        time step {text}, horizon {text}
        world ({text}, {text}) to ({text}, {text}, {text})
        region r = cylinder at ({text}, {text}) radius {text} height {text}..{text}
        obstacle o = disc at ({text}, 0) radius {text} moving ({text}, {text}) m/s
        team t[{text}] {{ radius {text} dynamics d(speed {text}..{text}, turn <= {text}) start at ({text}, {text}) }}
        graph g = proximity {text} over t[{text}..{text}]
        formation f = grid of t rows {text} spacing {text} total tolerance {text}
        separation {text}
        require every t: always[{text}, {text}] x <= {text} reach[hops {text}..{text}] distance(t[{text}]) > {text}
        prefer true weight {text}
        solve with smt {{ nodes = {text} }}"""
    )


def test_arithmetic_needs_no_brackets_of_its_own_inside_others() -> None:
    (param,) = read("param H = T + 3 s")
    (other,) = read("param H = (T + 3 s)")
    assert without_spans(param) == without_spans(other)
    read("world (0, N - 1) to (2*N, 3 + N)  require a: always[0, H - 1 s] drone[N - 1]: b")


def test_units_may_be_names() -> None:
    read(
        """region m = box (0, 0) to (1, 1)
        team s[3] { radius 1 m  start in m }
        formation f = offsets of s (0, 0), (1, 1) spacing 2 tolerance 1 m
        require at least 2 s: m and s"""
    )


def test_words_that_mean_something_only_somewhere_may_be_names_elsewhere() -> None:
    read(
        """param horizon = 3 s  param R = 2 m
        time step 1 s, horizon horizon
        region start = disc at (0, 0) radius R height 1..2
        region finish = start + start
        team total[2] { radius R  start in start  finish in finish }
        formation line = line of total spacing 1 tolerance R
        graph hops = proximity R
        require start U[0, end] finish R[hops 0..2 on hops] start"""
    )


@pytest.mark.parametrize("label", ["line", "reach", "always", "G", "region", "not", "end", "every"])
def test_any_word_may_label_a_requirement(label: str) -> None:
    (declaration,) = read(f"require {label}: a")
    assert isinstance(declaration, ast.Require)
    assert declaration.label is not None
    assert declaration.label.text == label
    assert isinstance(declaration.body, ast.Name)


def test_one_agent_by_name_is_told_from_a_label_by_brackets() -> None:
    labelled, bracketed = read("require truck: a  require (truck: a)")
    assert isinstance(labelled, ast.Require)
    assert isinstance(bracketed, ast.Require)
    assert isinstance(labelled.body, ast.Name)
    assert isinstance(bracketed.body, ast.OneAgent)


def test_white_space_only_separates() -> None:
    text = "region a=box(0,0)to(1,1)team d[2]{radius 1m start at(0,0),(1,1)}require x:always[0,2s]not a"
    spread = "\n".join(
        text.replace("(", " ( ").replace("{", " { ").replace(",", " , ").replace("=", "\t=\r\n ").split()
    )
    assert without_spans(read(text)) == without_spans(read(spread))


def test_a_formation_says_whether_its_tolerance_is_total() -> None:
    one, other = read("formation a = star of d spacing 1 total tolerance 2 m  formation b = star of d tolerance 2 m")
    assert isinstance(one, ast.Formation)
    assert isinstance(other, ast.Formation)
    assert one.total
    assert not other.total
    assert [setting.name.text for setting in one.settings] == ["spacing", "tolerance"]


def test_spans_cover_what_was_written_brackets_included() -> None:
    node = formula("not (a and (b or c))  ")
    assert node.span.text == "not (a and (b or c))"
    assert isinstance(node, ast.Apply)
    (body,) = node.operands
    assert body.span.text == "a and (b or c)"


# ------------------------------------------------------------------ includes


def folder_of(files: dict[str, str]) -> Callable[[str, Span], Source | Diagnostic]:
    def load(path: str, span: Span) -> Source | Diagnostic:
        if path not in files:
            return Diagnostic(INCLUDE_NOT_ALLOWED, f"no {path}", Label(span))
        return Source(path, files[path])

    return load


def included(files: dict[str, str], limits: Limits | None = None) -> tuple[ast.Program | None, list[Diagnostic]]:
    return parse(Source("main", files["main"]), limits or Limits(), folder_of(files))


def test_an_included_file_stands_where_its_include_stood() -> None:
    program, findings = included(
        {
            "main": 'mission m include "a" param z = 3',
            "a": 'param x = 1 include "b"',
            "b": "param y = 2 # no mission line",
        }
    )
    assert findings == []
    assert program is not None
    assert [type(node).__name__ for node in program.declarations] == ["MissionName", "Param", "Param", "Param"]
    assert [node.name.text for node in program.declarations if isinstance(node, ast.Param)] == ["x", "y", "z"]
    assert program.declarations[2].span.source.name == "b"
    assert program.span.source.name == "main"


@pytest.mark.parametrize(
    ("files", "message"),
    [
        ({"main": 'include "main"'}, "`main` includes itself"),
        ({"main": 'include "a"', "a": 'include "main"'}, "`main` includes itself through `a`"),
        ({"main": 'include "a"', "a": 'include "b"', "b": 'include "a"'}, "`a` includes itself through `b`"),
    ],
)
def test_a_cycle_of_includes_is_shown(files: dict[str, str], message: str) -> None:
    program, (finding,) = included(files)
    assert program is None
    assert finding.code.name == "MC011"
    assert finding.message == message
    assert finding.primary is not None
    assert finding.primary.span.text.startswith("include")


def test_includes_do_not_go_deeper_than_the_limit() -> None:
    files = {"main": 'include "0"'} | {str(n): f'include "{n + 1}"' for n in range(9)} | {"9": "param x = 1"}
    assert included(files)[1] == []
    _, (finding,) = included(files, Limits(include_depth=4))
    assert finding.code.name == "MC012"
    assert "5 deep; the limit is 4" in finding.message


def test_a_file_is_included_once() -> None:
    files = {"main": 'include "a" include "b"', "a": 'include "b"', "b": 'include "c" include "c"', "c": ""}
    _, findings = included(files)
    assert [(finding.code.name, finding.message) for finding in findings] == [
        ("MC013", "`c` is included twice"),
        ("MC013", "`b` is included twice"),
    ]


def test_what_is_wrong_with_an_included_file_is_said_in_its_place() -> None:
    _, findings = included({"main": 'param = 1\ninclude "a"\ninclude "gone"\nregion', "a": "team"})
    assert [(finding.code.name, finding.primary.span.source.name) for finding in findings if finding.primary] == [
        ("MC001", "main"),
        ("MC001", "a"),
        ("MC010", "main"),
        ("MC001", "main"),
    ]


# -------------------------------------------------------------------- limits


def test_formulas_nest_as_deeply_as_the_limit(subtests: pytest.Subtests) -> None:
    for count, (before, after) in product(
        [256, 257, 10_000],
        [
            ("(", ")"),
            ("not ", ""),
            ("every a: ", ""),
            ("a implies ", ""),
            ("a iff ", ""),
            ("x until[0, 1] ", ""),
            ("always[0, 1] ", ""),
        ],
    ):
        with subtests.test(count=count, before=before, after=after):
            findings = findings_of(f"let f = {before * count}x{after * count}", Limits(file_bytes=1 << 20))
            assert [finding.code.name for finding in findings] == ([] if count <= 256 else ["MC005"])


@pytest.mark.parametrize("text", ["param a = {}1", "param a = 1{}", "region a = b{}"])
def test_arithmetic_and_shapes_nest_as_deeply_as_the_limit(text: str) -> None:
    assert findings_of(text.format("- " * 256 if "{}1" in text else " + b" * 256)) == []
    (finding,) = findings_of(text.format("- " * 257 if "{}1" in text else " + b" * 257))
    assert finding.code.name == "MC005"
    assert "--limit" not in finding.help
    (finding,) = findings_of("param a = (((1)))", Limits(nesting=2))
    assert "--limit nesting=4" in finding.help


def test_brackets_that_never_close_are_counted_too() -> None:
    (finding,) = findings_of("let f = " + "(" * 10_000)
    assert finding.code.name == "MC005"


@pytest.mark.parametrize("text", ["9" * 5000, "1e400", "1e10", "0.1234567890123456", "1e-400"])
def test_a_number_keeps_within_the_limits(text: str) -> None:
    (finding,) = findings_of(f"param a = {text}")
    assert finding.code.name == "MC006"
    assert finding.primary is not None
    assert finding.primary.span.text == text


@pytest.mark.parametrize("text", ["1e9", "123456789.012345", "0.000000000000001", "000000000000000000001", "0.0"])
def test_a_number_within_the_limits_is_itself(text: str) -> None:
    (param,) = read(f"param a = {text}")
    assert isinstance(param, ast.Param)
    assert isinstance(param.value, ast.Number)
    assert param.value.value == float(text)


def test_what_a_mission_includes_counts_toward_its_size() -> None:
    texts = {"main": 'include "a"\ninclude "b"', "a": "# " + "a" * 40_000, "b": "# " + "b" * 40_000}
    _, findings = included(texts)
    assert [finding.code.name for finding in findings] == ["MC004"]
    assert findings[0].message == ("with `b`, the 3 files of the mission have 80027 bytes; the limit is 65536")
    assert findings[0].primary is not None
    assert findings[0].primary.span.text == 'include "b"'


def test_a_text_larger_than_the_limit_is_refused() -> None:
    (finding,) = findings_of("x " * 5_000_000)
    assert finding.code.name == "MC004"
    assert "10000000 bytes; the limit is 65536" in finding.message


@pytest.mark.parametrize("text", ["", " \n\t", "# only words\n", "\ufeff"])
def test_a_text_without_declarations_is_refused(text: str) -> None:
    (finding,) = findings_of(text)
    assert finding.code.name == "MC003"


def test_no_more_findings_are_given_than_anybody_reads() -> None:
    assert len(findings_of("region\n" * 5000)) == 100
    assert len(findings_of("\0" * 5000)) == 100


# ------------------------------------------------------- the grammar's tables


def grammar() -> str:
    return (folder("grammars") / "mission.lark").read_text(encoding="utf-8")


def test_the_kept_table_is_the_grammars() -> None:
    kept = (folder("grammars") / "mission.json").read_text(encoding="utf-8")
    assert parse_table.write(parse_table.build(grammar())) == kept, (
        "run: python -m missionc.frontend.syntax.parse_table"
    )


def test_the_grammar_leaves_one_choice_open_and_only_after_a_quantifier(caplog: pytest.LogCaptureFixture) -> None:
    class NoLexer(lark.lexer.Lexer):
        def __init__(self, _: object) -> None:
            pass

        def lex(self, lexer_state: object, parser_state: object) -> None:
            raise NotImplementedError

    with caplog.at_level(logging.DEBUG, logger="lark"):
        lark.Lark(grammar(), parser="lalr", lexer=NoLexer, debug=True)
    choices = [record.getMessage() for record in caplog.records if "conflict" in record.getMessage()]
    terminals = {choice.split("terminal ")[1].split(":")[0] for choice in choices}
    assert all("resolving as shift" in choice for choice in choices)
    assert terminals == {"AND", "OR", "IMPLIES", "IFF", "TIME_INFIX", "ROUTE_INFIX"}


def test_every_rule_has_its_function_and_every_function_a_rule() -> None:
    of_rules = build.functions()
    assert {rule.name for rule in parse_table.load().rules} - {"", "*"} == set(of_rules)
    written = {**vars(build_formula), **vars(build)}
    builders = {
        name: each for name, each in written.items() if isfunction(each) and "span" in signature(each).parameters
    }
    assert {name for name in builders if name[0] != "_"} - {"same"} <= set(of_rules)
    assert set(build.OTHERS) <= set(of_rules)


def test_every_word_of_the_grammar_is_in_the_one_list() -> None:
    written = {kind for row in parse_table.load().actions for kind in row if kind.islower()}
    assert written | {word.text for word in WORDS if word.token} == {word.text for word in WORDS}


def test_the_parser_and_the_language_know_the_same_operators() -> None:
    tokens = {
        (Fixity.PREFIX, Bounds.NONE): "PREFIX",
        (Fixity.PREFIX, Bounds.TIME): "TIME_PREFIX",
        (Fixity.PREFIX, Bounds.PAST): "TIME_PREFIX",
        (Fixity.PREFIX, Bounds.LENGTH): "ROUTE_PREFIX",
        (Fixity.PREFIX, Bounds.PERIOD): "",
        (Fixity.INFIX, Bounds.NONE): "",
        (Fixity.INFIX, Bounds.TIME): "TIME_INFIX",
        (Fixity.INFIX, Bounds.PAST): "TIME_INFIX",
        (Fixity.INFIX, Bounds.LENGTH): "ROUTE_INFIX",
    }
    meant = {each.name: (each.letter, tokens[each.fixity, each.bounds]) for each in OPERATORS}
    meant["count"] = (meant["count"][0], "")  # its comparison gives it a rule of its own
    words = [word for word in WORDS if word.says == "an operator" or word.text == "every"]  # that is a quantifier too
    assert {word.text: (word.letter, word.token) for word in words} == meant

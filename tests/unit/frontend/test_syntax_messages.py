"""What is said about a text that cannot be read: where, what was expected in words, and what to write instead."""

from __future__ import annotations

import re

import pytest

from missionc.base.diagnostics.model import Diagnostic
from missionc.base.limits import Limits
from missionc.base.source import Source, Span
from missionc.frontend.syntax import parse_table
from missionc.frontend.syntax.forms import DECLARED, IN_FORMULA, INSTEAD, PARTS
from missionc.frontend.syntax.parse import parse
from missionc.frontend.syntax.tokens import DECLARATIONS, PLURALS


def findings_of(text: str) -> list[Diagnostic]:
    return parse(Source("test.mission", text), Limits(), nothing_to_include)[1]


def nothing_to_include(path: str, span: Span, *, data: bool = False) -> Source:
    return Source(path, "")


def finding_of(text: str) -> Diagnostic:
    (finding,) = findings_of(text)
    return finding


def underlined(finding: Diagnostic) -> str:
    assert finding.primary is not None
    return finding.primary.span.text


def test_what_was_expected_is_said_in_words(subtests: pytest.Subtests) -> None:
    for text, place, message in [
        ("time step 1 s, horizon , 5", ",", "unexpected `,` between `horizon` and `5`"),
        ("time step 1 s horizon 5", "horizon", "expected `,` after `s`, found `horizon`"),
        ("param T", "T", "expected `=` after `T`, found the end of the file"),
        ("region", "region", "expected a name after `region`, found the end of the file"),
        ("region a = box (1, 1) to\nmission m", "to", "expected a point such as `(1, 2)` after `to`"),
        ("region a = box (1 1) to (2, 2)", "1", "expected `,` or `)` after `1`, found `1`"),
        ("region a = not b", "not", "expected a shape after `=`, found `not`"),
        ("region a = disc (1, 1) radius 1", "(", "expected `at` after `disc`, found `(`"),
        ("agent t { start at 1, 1 }", "1", "expected a point such as `(1, 2)` after `at`, found `1`"),
        (
            "team t[2] { start on b }",
            "on",
            "expected a position (`in`, `at`, `line` or `grid`) after `start`, found `on`",
        ),
        (
            "graph g = distance 1 m",
            "distance",
            "expected `beacons`, `proximity` or `sight` after `=`, found `distance`",
        ),
        (
            "graph g = proximity 1 m over",
            "over",
            "expected a team, group or agent after `over`, found the end of the file",
        ),
        ("include site.mission", "site", "expected a file name in double quotes after `include`, found `site`"),
        ("minimize [", "[", "expected `duration`, `energy` or `distance` after `minimize`, found `[`"),
        ("require a: x y", "y", "expected an operator or the next declaration after `x`, found `y`"),
        ("require a: x implies\nlet b = x", "implies", "expected a formula after `implies`"),
        ("require a: count[hops 1..1] x and y", "and", "expected a comparison of `count` before `and`"),
        ("require a: distance base <= 2", "base", "expected `(` after `distance`, found `base`"),
        (")", ")", "unmatched `)`"),
    ]:
        with subtests.test(text=text, place=place, message=message):
            finding = finding_of(text)
            assert finding.code.name == "MC001"
            assert finding.message == message
            assert underlined(finding) == place
            assert finding.help


def test_a_frequent_slip_is_named_and_can_be_mended(subtests: pytest.Subtests) -> None:
    for text, code, place, message, mended in [
        ("let f = alwais[0, 5 s] x", "MC008", "alwais", "unknown operator `alwais`", "always"),
        ("let f = globally[0, 5 s] x", "MC008", "globally", "unknown operator `globally`", "always"),
        ("let f = x untill[0, 5 s] y", "MC008", "untill", "unknown operator `untill`", "until"),
        ("let f = x AND y", "MC008", "AND", "unknown operator `AND`", "and"),
        ("let f = nott x", "MC008", "nott", "unknown operator `nott`", "not"),
        ("let f = Every d: x", "MC008", "Every", "unknown operator `Every`", "every"),
        ("let f = x reech[hops 0..2] y", "MC008", "reech", "unknown operator `reech`", "reach"),
        ("let f = x && y", "MC001", "&&", "unknown symbol `&&`", "and"),
        ("let f = x || y", "MC001", "||", "unknown symbol `||`", "or"),
        ("let f = x => y", "MC001", "=>", "unknown symbol `=>`", "implies"),
        ("let f = x ≤ 3", "MC001", "≤", "unknown symbol `≤`", "<="),
        ("let f == x", "MC001", "==", "unexpected `==`", "="),
        ("let f : x", "MC001", ":", "expected `=` after `f`", "="),
        ("require f = x", "MC001", "=", "unexpected `=` after a label", ":"),
        ("require f every d: x", "MC001", "f", "expected `:` after the label `f`", ":"),
        ("require f (x and y)", "MC001", "f", "expected `:` after the label `f`", ":"),
        ("let f = every d x", "MC001", "every d", "expected `:` after `every d`", ":"),
        ("let f = some d[0..2] x", "MC001", "some d[0..2]", "expected `:` after `some d[0..2]`", ":"),
        ("let f = at least 2 d x", "MC001", "at least 2 d", "expected `:` after `at least 2 d`", ":"),
        ("let f = always[0..5 s] x", "MC001", "..", "expected `,` between the bounds of a time window", ","),
        ("let f = x reach[hops 0, 2] y", "MC001", ",", "expected `..` between the bounds of a length", ".."),
        ("let f = (x and y", "MC001", "y", "expected `)` after `y`: unclosed bracket", ")"),
        ("team d[2] { radius 1 m", "MC001", "m", "expected `}` after `m`: unclosed bracket", "}"),
        ("team d[2] { radius = 1 m }", "MC001", "=", "unexpected `=` after `radius`", ""),
        ("agent d { dynamics u(speed < 1) }", "MC001", "<", "expected `<=`: a limit is inclusive", "<="),
        ("region a = circle at (1, 1) radius 1", "MC001", "circle", "unknown shape `circle`", "disc"),
        ("region a = polygon (0, 0) (1, 1)", "MC001", "(", "expected `,` between two points", ","),
        ("regoin a = b", "MC001", "regoin", "unknown declaration `regoin`", "region"),
        ("let f = x;", "MC001", ";", "unexpected `;`", ""),
        ("let f = x.", "MC001", ".", "unexpected `.`", ""),
        ("param T = 20.", "MC001", ".", "unexpected `.` after a number", ""),
        ("param T = 20 sec", "MC202", "sec", "unknown unit `sec`", "s"),
        ("mission wild-fire", "MC007", "wild-fire", "invalid name `wild-fire`: a name has no `-`", "wild_fire"),
        ("require no-fly: x", "MC007", "no-fly", "invalid name `no-fly`: a name has no `-`", "no_fly"),
    ]:
        with subtests.test(text=text, code=code, place=place, message=message, mended=mended):
            finding = finding_of(text)
            assert (finding.code.name, finding.message, underlined(finding)) == (code, message, place)
            assert finding.fix is not None
            assert finding.fix.replacement == mended
            span = finding.fix.span
            assert findings_of(text[: span.start] + f" {mended} " + text[span.end :]) == []


def test_a_slip_without_one_cure_gets_advice(subtests: pytest.Subtests) -> None:
    for text, code, message, advice in [
        ("let f = x == 3", "MC001", "cannot compare quantities", "x >= 2 and x <= 2.1"),
        ("let f = x = 3", "MC001", "cannot compare quantities", "x >= 2 and x <= 2.1"),
        ("let f = 0 <= x <= 3", "MC001", "two sides", "x >= 0 and x <= 3"),
        ("let f = always x", "MC001", "`always` needs a time window", "always[0 s, 5 s]"),
        ("let f = x R y", "MC001", "`R` needs a route length", "R[hops 0..2]"),
        ("let f = always[5 s] x", "MC001", "needs two bounds", "always[0 s, 5 s]"),
        ("let f = always[hops 0..2] x", "MC001", "a time window, not a route length", "always[0 s, 5 s]"),
        ("let f = x reach[0, 2 s] y", "MC001", "`hops` or `distance`", "reach[hops 0..2]"),
        ("let f = x reach[hops 2] y", "MC001", "neither a lower nor an upper bound", "`<= 2`"),
        ("time step 1 s, horizon T + 3 s", "MC001", "arithmetic needs parentheses", "(T + 3 s)"),
        ("let f = distance(base)", "MC001", "the number `distance(base)`", "`distance(base) <= 2`"),
        ("let f = (x + 2) and y", "MC001", "expected a formula, found the number `x + 2`", "`x + 2 <= 2`"),
        ("let f = (a and b) <= 3", "MC001", "expected a number", "x + 2 <= 3"),
        ("let f = at least d: x", "MC001", "needs a number", "at least 2 d"),
        ("let f = x <= 3 foo", "MC202", "unknown unit `foo`", "m/s^2"),
        ("let f = gizmo[0, 5 s] x", "MC008", "unknown operator `gizmo`", "eventually"),
        ("let f = x $ y", "MC001", "unexpected `$`", "delete"),
        ('include "site', "MC001", "unterminated text", "end the text"),
        ("every d: x", "MC001", "unexpected `every`: a formula", "require LABEL: every"),
        ("formation f = wedge of d tolerance 1", "MC001", "unknown formation `wedge`", "offsets"),
        ("formation f = line of d (0, 0) tolerance 1", "MC001", "neither points nor links", "delete"),
        ("formation f = offsets of d tolerance 1", "MC001", "takes points", "after `d`"),
        ("formation f = distances of d (0: 1) tolerance 1", "MC001", "a link needs two agents", "0-1: 0.8 m"),
        ("formation f = line of d total spacing 1", "MC001", "expected `tolerance`", "total tolerance"),
        ("team d[2] { start ring (0, 0) to (1, 1) }", "MC001", "expected `line` or `grid`", "line P to P"),
        ("region box = a", "MC007", "`box` is a keyword (a shape)", "box_1"),
        ("region G = a", "MC007", "`G` is short for `always`", "G_1"),
        ("region region = a", "MC007", "(a declaration)", "region_1"),
        ("let f = every team: x", "MC001", "a period such as `40 s` after `every`", "every drone: base"),
        ("minimize time", "MC001", "expected `duration`, `energy` or `distance`", "minimize distance"),
        ("region été = a", "MC007", "letters other than a to z", "a to z"),
        ("region a\u202e = b", "MC007", "U+202E", "delete"),
        (f"region {'a' * 129} = b", "MC007", "129 characters; the limit is 128", "--limit name_length=129"),
    ]:
        with subtests.test(text=text, code=code, message=message, advice=advice):
            finding = finding_of(text)
            assert finding.code.name == code
            assert message in finding.message
            assert advice in finding.help


def test_what_people_write_instead_is_answered_in_its_own_words(subtests: pytest.Subtests) -> None:
    for text, place, message, advice in [
        ("region 2nd = a", "2nd", "invalid name `2nd`: a name begins with a letter", "choose another name"),
        ('region "a" = b', '"a"', "unexpected quotes around a name", "delete the quotes"),
        ("region a = disc at (1, 1), radius 1", ",", "unexpected `,` between `)` and `radius`", "delete it"),
        ("region a = box (1; 1) to (2, 2)", ";", "unexpected `;`", "write `,`"),
        ("region a = box (1, 1) - (2, 2)", "-", "expected `to`", "write, for example, `box (1, 1) to (3, 3)`"),
        ("obstacle o = a moving 1 m/s", "1", "expected a point such as `(1, 2)`", "for example, `moving (1, 0) m/s`"),
        (
            "obstacle o = a uncertain",
            "uncertain",
            "expected a number or a parameter",
            "for example, `uncertain 0.3 m/s`",
        ),
        ("obstacle o = a along (0, 1, 0)", ",", "expected `:`", "for example, `along (0 s: 0, 0), (4 s: 3, 0)`"),
        ("// words", "//", "unknown symbol `//`", "write `#`"),
        ("separation: 1 m", ":", "unexpected `:` after `separation`", "delete it"),
        ("group e = d + f", "+", "expected `,`, `[` or the next declaration", "group east = drone[0..2], truck"),
        ("team e { radius 1 m }", "e", "team `e` has no size", "`team e[3]`"),
        ("team e[2] { radius 1 m, start in a }", ",", "unexpected `,` between `m` and `start`", "delete it"),
        ("team e[2] { strat in a }", "strat", "unknown setting `strat` of a team", "did you mean `start`?"),
        ("team e[2] { dynamcs a(b 1) }", "dynamcs", "unknown setting `dynamcs` of a team", "`dynamics`?"),
        ("team e[2] { start base }", "start base", "needs `in`, `at`", "write `start in base`"),
        ("team e[2] { start in box (0, 0) to (1, 1) }", "box", "expected a region after `in`", "`start in base`"),
        ("team e[2] { dynamics a(2 m/s) }", "2", "expected a setting, found `2`", "for example, `speed <= 2 m/s`"),
        ("require every d: next[1] a", "[", "`next` takes no bounds", "`next` means one step later"),
        ("require a: x weight 2", "weight", "only a preference has a weight", "write `prefer` in place of `require`"),
        ("require count[hops 1..1] a and b >= 2", "and", "expected a comparison of `count`", "(f and g) >= 2"),
        (
            "require count[hops 1..1] a != 2",
            "!=",
            "`!=` cannot compare a count",
            "`count[…] f < 2 or count[…] f > 2`",
        ),
        ("require count[hops 1..1] a == 2", "==", "unexpected `==`", "write `=`"),
        ("require count[d] a >= 2", "d", "`count` takes a route length, not `d`", "write `at least 2 d: …`"),
        ("require count d: a >= 2", "count", "`count` needs a route length", "write `at least 2 drone: base`"),
        ("require every d: count[hops 1..1] a", "a", "expected a comparison such as `>= 2`", "count[hops 1..1]"),
        ("require a == b", "==", "unexpected `==`", "write `iff`"),
        ("require x == 2", "==", "cannot compare quantities", "write a range"),
        ("require x^2 <= 3", "^", "powers are not supported: a comparison is linear", "write `distance(base)`"),
        ("require 2x <= 3", "2x", "missing `*` in `2x`", "write `2 * x`"),
        ("require every d: ~a", "~", "unknown symbol `~`", "write `not`"),
        ("require distance <= 3", "<=", "expected `(` after `distance`", "for example, `distance(base) <= 2 m`"),
        ("require every d: inside a", "inside a", "`inside` needs parentheses", "write `inside(a)`"),
        ("require d[0] in a", "in", "unexpected `in`: in a formula", "for example, `drone[0]: base`"),
        ("require at most 2 d: a", "at most", "unknown quantifier `at most`", "not at least 3 drone: f"),
        ("require exactly 2 d: a", "exactly", "unknown operator `exactly`", "(at least 2 drone: f) and not"),
        ("require never[0, 5] a", "never", "unknown operator `never`", "`always[0 s, 5 s] not f`"),
        ("require a xor b", "xor", "unknown operator `xor`", "`not (f iff g)`"),
        ("require if a then b", "if", "unknown operator `if`", "`f implies g`"),
        ("require eventually[0 to 5] a", "to", "expected `,` between the bounds of a time window", "write `,`"),
        ("require eventually[0; 5] a", ";", "expected `,` between the bounds of a time window", "write `,`"),
        ("require eventually[<= 5] a", "<=", "needs two bounds", "write `eventually[0 s, 5 s]`"),
        ("require eventually[end, 5] a", "end", "`end` can only be the upper bound", "`eventually[5 s, end]`"),
        (
            "require somewhere[hops = 2] a",
            "=",
            "expected a length such as `<= 2`, `1..2` or `1..`",
            "somewhere[hops 1..2]",
        ),
        ("require somewhere[hops 1-2] a", "2", "`1-2` is neither", "`2..2`, `2..` or `<= 2`"),
        ("require somewhere[hops 1..2 in g] a", "in", "expected `]` or `on`", "for example, `somewhere[hops 1..2]`"),
    ]:
        with subtests.test(text=text, place=place, message=message, advice=advice):
            finding = finding_of(text)
            assert underlined(finding) == place
            assert message in finding.message
            assert advice in finding.help


def test_no_word_is_offered_that_says_something_else() -> None:
    for text in ("let f = a xor b", "let f = no a", "let f = never a"):
        assert finding_of(text).fix is None


@pytest.mark.parametrize(
    ("text", "opening"), [("let f = (x and [y", "("), ("let f = (x and y]", "("), ("team d[2 {", "[")]
)
def test_an_open_bracket_is_pointed_at(text: str, opening: str) -> None:
    finding = finding_of(text)
    assert [label.span.text for label in finding.labels] == [opening]


def test_all_errors_of_a_file_are_found_in_one_run_in_file_order() -> None:
    text = """mission m
time step 1 s horizon 5 s
region a = box (0, 0) (1, 1)
team d[2] { radius 0.1 sec  dynamics unicycle(speed)  start in a }
param big = 1e400
require x: every d alwais[0, 5 s] a
require y: every d: always[0, 5 s] a
regoin b = a
require z: (a and
solve with smt
"""
    found = [(finding.code.name, underlined(finding)) for finding in findings_of(text)]
    assert found == [
        ("MC001", "horizon"),
        ("MC001", "("),
        ("MC202", "sec"),
        ("MC001", ")"),
        ("MC006", "1e400"),
        ("MC001", "every d"),
        ("MC001", "regoin"),
        ("MC001", "and"),
    ]


def test_one_error_hides_no_declaration_after_it_on_its_line() -> None:
    found = findings_of("team a[2] { radius } team b[2] { radius } region c = ) region d = box")
    assert [underlined(finding) for finding in found] == ["}", "}", ")", "box"]


def test_a_missing_brace_hides_only_its_own_declaration() -> None:
    first, second = findings_of("team a[2] { radius 1 m\nregion c = )\nregion d = a")
    assert "expected `}`" in first.message
    assert underlined(second) == ")"


def test_no_message_names_a_token_of_the_grammar() -> None:
    tokens = {kind for row in parse_table.load().actions for kind in row if kind.isupper()}
    texts = [" ".join(text.split()[:length]) for text in DECLARED.values() for length in range(1, 20)]
    for text in (*texts, *(f"{text} ]" for text in texts), *(f"{text} @" for text in texts)):
        for finding in findings_of(text):
            assert tokens.isdisjoint(re.findall(r"\w+", finding.message)), finding.message
            assert "invalid" not in finding.message
            assert not finding.message.endswith(".")


def test_every_part_that_is_shown_is_read() -> None:
    teams = [text for word in ("dynamics", "start", "finish") for text in PARTS[word].split("` or `")]
    assert findings_of("team d[2] { " + "  ".join(teams) + " }") == []
    shapes = [PARTS[word] for word in ("box", "disc", "ball", "cylinder", "polygon")]
    assert findings_of("\n".join(f"region a = {shape}" for shape in shapes)) == []
    motions = [PARTS["moving"], PARTS["along"], PARTS["uncertain"], PARTS["height"]]
    assert findings_of("\n".join(f"obstacle a = {PARTS['box']} {motion}" for motion in motions)) == []


def test_every_formula_that_is_shown_is_read() -> None:
    for text in (*IN_FORMULA.values(), *INSTEAD.values()):
        assert findings_of(f"require {text}") == [], text


def test_every_declaration_has_an_example_that_is_read() -> None:
    assert set(DECLARED) == DECLARATIONS | PLURALS
    for text in DECLARED.values():
        assert findings_of(f"{text} separation 1 m") == []


def test_a_measure_that_is_unknown_is_no_formula() -> None:
    finding = finding_of("require every d: dist(base) <= 3")
    assert (finding.code.name, underlined(finding)) == ("MC101", "dist")
    assert "`distance(…)`" in finding.help

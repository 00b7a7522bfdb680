"""Families, quantifiers over indices and arithmetic: what they are spelt out to, and what is said where they fail."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np
import pytest
from lsprotocol import types

from missionc.base.limits import Limits
from missionc.base.source import Source
from missionc.base.trace import Trace
from missionc.compiler import driver
from missionc.compiler.front_end import Checked, check
from missionc.compiler.relax.edits import changes
from missionc.compiler.relax.relax_world import without
from missionc.frontend.explain.explanation import explained, lines
from missionc.frontend.resolve.show_ir import show_ir as show_ir
from missionc.output.documents.trajectories_csv import trajectories
from missionc.output.folder.file_names import file_names
from missionc.tools.language_server import hover, text_edits, workspace_symbols
from missionc.tools.language_server.completion import completion
from tests.support.flat_families import HEAD, MOVES, flat
from tests.support.open_texts import edited, marked, opened


def checked(text: str, limits: Limits | None = None, **overrides: str) -> Checked:
    return check(Source("demo.mission", HEAD + text), limits=limits, overrides=overrides, backend="any")


def ir_of(text: str, **overrides: str) -> str:
    found = checked(text, **overrides)
    assert found.mission is not None, [(each.code.name, each.message) for each in found.findings]
    return show_ir(found.mission)


def errors(text: str, limits: Limits | None = None) -> list[tuple[str, str, str, str]]:
    """Code, words underlined, message with its notes, way out."""
    found = [each for each in checked(text, limits).findings if not each.code.warning]
    return [
        (
            each.code.name,
            each.primary.span.text if each.primary else "",
            "; ".join((each.message, *each.notes)),
            each.help,
        )
        for each in found
    ]


def test_split_and_merge_of_a_hundred_is_its_hand_written_expansion(missions: Path) -> None:
    family = driver.check(missions / "clot_split100.mission").mission
    assert family is not None
    text = "mission clot_split100\ntime step 0.1 s, horizon 4.7 s\nworld (0, 0) to (26, 20)\n"
    text += "".join(f"region w{i} = box (11, {2 * i}.2) to (20, {2 * i + 1}.8)\n" for i in range(10))
    text += "".join(f"obstacle o{i} = disc at (9.2, {4 * i + 2}) radius 0.4\n" for i in range(5))
    moves = "radius 0.1 m  dynamics single_integrator(speed <= 6 m/s)"
    starts = [f"start line (0.6, {2 * i + 1}) to (7.8, {2 * i + 1})" for i in range(10)]
    text += "".join(f"team t{i}[10] {{ {moves}  {start} }}\n" for i, start in enumerate(starts))
    text += "graph link = proximity 1.6 m\n"
    text += "".join(f"formation f{i} = line of t{i} spacing 0.8 m tolerance 0.15 m\n" for i in range(10))
    text += f"require chains: always[0, 2.4 s] ({' and '.join(f'f{i}' for i in range(10))})\n"
    text += f"require places: eventually[0, 2.4 s] ({' and '.join(f'(every t{i}: w{i})' for i in range(10))})\n"
    text += "require merge: always[2.4 s, 4.7 s] connected(link)\nsolve with clot\n"
    written = check(Source("by_hand.mission", text)).mission
    assert written is not None
    assert flat(show_ir(family), "w", "o", "t", "f") == show_ir(written)
    source = (missions / "clot_split100.mission").read_text(encoding="utf-8")
    assert len([line for line in source.splitlines() if line.strip()]) <= 20


def test_every_declaration_with_a_name_can_be_a_family() -> None:
    found = checked(
        f"""param n = 2
param far[i in 0..n - 1] = 2*i + 3
region w[i in 0..n - 1, j in 0..1] = box (3*i, 5*j) to (3*i + 2, 5*j + far[i])
obstacle o[i in 1..2] = disc at (20, 9*i) radius (i / 2)
beacon mast[i in 0..1] = (10*i, 15)
team t[i in 0..1][2] {{ {MOVES}  start in w[i, 0] }}
agent truck[i in 0..1] {{ {MOVES}  start at (25, 3*i + 1) }}
group duo[i in 0..1] = t[i][0], truck[i]
graph radio[i in 0..1] = proximity 5 m over duo[i]
formation line_up[i in 0..1] = line of t[i] spacing (i + 1) tolerance 9
resource battery[i in 0..1] of t[i] {{ start 100, drain i per s, refill 2 per s in w[i, 1] }}
flag loaded[i in 0..1] of truck[i] {{ set in w[i, 1] }}
let home[i in 0..1] = every t[i]: w[i, 0]
require go[i in 0..1]: home[i] and line_up[i] and connected(radio[i], duo[i]) and (truck[i]: not loaded[i])
require of_agents: (t[1][0]: distance(mast[1]) <= far[0] * 9) and every truck: battery[0] >= 0 or true
prefer wish[i in 0..1]: (every duo[i]: always[0, 5 s] x <= 20 + i) weight (i + 1)
"""
    )
    assert [each.message for each in found.findings if not each.code.warning and each.code.name != "MC221"] == []


def test_the_agents_of_a_family_are_named_together_by_its_name_or_by_a_range() -> None:
    teams = f"region w = box (0, 0) to (5, 5)\nteam t[i in 0..2][2] {{ {MOVES}  start in w }}\n"
    by_name = ir_of(teams + "require a: every t: w\nrequire b: some t[1..2]: w\n")
    assert "group t = 0..5" in by_name
    assert "group t[1..2] = 2..5" in by_name


def test_a_value_from_the_command_line_counts_in_ranges_and_in_arithmetic() -> None:
    text = f"param n = 2\nregion w[i in 1..n] = box (0, 0) to (n*i, max(n, 4))\nagent a {{ {MOVES}  start in w[1] }}\n"
    text += "require go: a: for some i in 1..n: eventually[0, 5 s] w[i]\n"
    assert "region w[3] = box (0, 0) to (9, 4)" in ir_of(text, n="3")
    assert "region w[3]" not in ir_of(text)


def test_a_parameter_of_a_family_is_given_from_the_command_line_by_its_index() -> None:
    text = "param p[i in 0..1] = i + 1\nregion w[i in 0..1] = box (0, 0) to (p[i], 1)\n"
    text += f"agent a {{ {MOVES}  start in w[1] }}\n"
    text += "require go: a: eventually[0, 5 s] w[0]\n"
    given = ir_of(text, **{"p[1]": "7 m"})
    assert "region w[0] = box (0, 0) to (1, 1)" in given
    assert "region w[1] = box (0, 0) to (7, 1)" in given


def test_names_of_members_are_safe_in_tables_and_as_files() -> None:
    found = checked(
        f"agent a[i in 0..1, j in -1..0] {{ {MOVES}  start at (9*i + 1, 1 - j) }}\n"
        f"team t[i in 1..2][2] {{ {MOVES}  start line (5*i, 20) to (5*i, 22) }}\nrequire b: true\n"
    ).mission
    assert found is not None
    files = file_names(found.agents)
    assert files["a[1, -1]"] == "a1_m1"
    assert files["t[2][0]"] == "t2_0"
    assert len(set(files.values())) == len(found.agents)
    shape = (len(found.agents), 1)
    still = Trace(found.step, np.zeros((*shape, 2)), np.zeros((*shape, 2)), np.zeros(shape))
    written = trajectories(found, still)
    first = next(csv.reader(io.StringIO(written.splitlines()[1])))
    assert first[:2] == ["a[0, -1]", "0.0"]


@pytest.mark.parametrize(
    ("written", "meant"),
    [
        ("0.1 * 3", "0.3 m"),
        ("0.1 + 0.2", "0.3 m"),
        ("10 cm * 3 + 2 cm", "0.32 m"),
        ("2 m / (1 s) * 0.1 s", "0.2 m"),
        ("min(30 cm, 1, 2 m) - -max(0.1, 0.05)", "0.4 m"),
        ("1 / 3 * 3", "1 m"),
    ],
)
def test_arithmetic_is_exact(written: str, meant: str) -> None:
    text = f"agent a {{ {MOVES}  start at (1, 1) }}\nrequire go: true\nseparation ({written})\n"
    assert f"separation {meant}" in ir_of(text)


REGIONS = f"""region w[i in 0..3] = box (5*i, 0) to (5*i + 3, 5)
team t[i in 0..3][2] {{ {MOVES}  start in w[i] }}
"""


def test_what_is_wrong_is_said_once_at_the_words_of_the_family(subtests: pytest.Subtests) -> None:
    for text, code, place, message, way_out in [
        (
            "require a: for i in 0..3: every t[i]: w[i + 1]",
            "MC109",
            "w[i + 1]",
            "unknown member `w[4]`: `w` has 4 members; for i = 3",
            "`w[0]` … `w[3]`",
        ),
        ("require a: every t[0]: w[0, 1]", "MC109", "w[0, 1]", "`w` has 1 index, `i`; found 2", "use one of `w[0]`"),
        (
            "require a: every t[0]: w",
            "MC108",
            "w",
            "expected one region, found the family `w`",
            "for example `w[0]`",
        ),
        (
            "param n = 3\nrequire a: every t[0]: x <= n[2]",
            "MC109",
            "n[2]",
            "`n` is a parameter, not a family",
            "write `n`",
        ),
        (
            "region b = box (0, 9) to (1, 10)\nrequire a: every t[0]: inside(b[2])",
            "MC109",
            "b[2]",
            "`b` is a region, not a family",
            "write `b`",
        ),
        (
            "team d[4] { radius 1 m }\nrequire a: every d[0, 1]: w[0]",
            "MC105",
            ", ",
            "expected `..` in a range of members",
            "write `..`",
        ),
        (
            "require a: for i in 3..0: every t[i]: w[i]",
            "MC303",
            "3..0",
            "bounds reversed: 3 is greater than 0",
            "the smaller index first",
        ),
        (
            "require a: for i in 0..2.5: every t[i]: w[i]",
            "MC209",
            "2.5",
            "the last `i` is 2.5; expected a whole number",
            "write `2` or `3`",
        ),
        (
            "require a: for i in 0..3 m: every t[i]: w[i]",
            "MC201",
            "m",
            "expected a plain number, found a length `3 m`",
            "without a unit",
        ),
        ("require a: for i in 0..n: every t[i]: w[i]", "MC101", "n", "unknown name `n`", "declare the name"),
        (
            "require a: for w in 0..3: every t[w]: w[w]",
            "MC102",
            "w",
            "`w` is already declared and cannot be an index",
            "choose another name",
        ),
        (
            "require a: for i in 0..1: for i in 0..1: every t[i]: w[i]",
            "MC102",
            "i",
            "`i` is already an index",
            "choose another name",
        ),
        (
            "require a: for x in 0..1: every t[x]: w[x]",
            "MC007",
            "x",
            "is the name of a state",
            "choose another name",
        ),
        ("require a: for i in 0..3: every i: w[i]", "MC110", "i", "found the index `i`", "`w[i]`"),
        (
            "require a: for i in 0..3: every t[i]: v[i]",
            "MC101",
            "v",
            "unknown name `v`; for every `i`",
            "",
        ),
        (
            "region w = box (0, 0) to (1, 1)\nrequire a: every t: w[0]",
            "MC102",
            "w",
            "`w` is declared twice",
            "rename one of the two",
        ),
        (
            "require a: for i in 0..3: every t[i]: x <= 1 / i",
            "MC210",
            "i",
            "`1 / i` divides by zero; for i = 0",
            "another number",
        ),
        (
            "separation (2 m + 1 s)\nrequire a: true",
            "MC201",
            "2 m + 1 s",
            "adds a length and a time",
            "the same kind of unit",
        ),
        (
            "separation max(2 m, 1 s)\nrequire a: true",
            "MC201",
            "max(2 m, 1 s)",
            "compares a length and a time",
            "same kind",
        ),
        (
            "require a: every t: max(x, 2) <= 3",
            "MC104",
            "max(x, 2)",
            "compares quantities that change with time",
            "by numbers only",
        ),
        ("separation (999999999 * 999999999)\nrequire a: true", "MC006", "", "the limit is 1000000000", "magnitude"),
        ("separation (1 / 1e-300 / 1e-300)\nrequire a: true", "MC006", "", "the limit is 1000000000", "magnitude"),
        (
            "obstacle o[i in 0..3] = disc at (9, 9) radius (i - 1)\nrequire a: true",
            "MC210",
            "i - 1",
            "is -1 m; it must be at least 0 m; for i = 0",
            "larger",
        ),
        (
            "obstacle o[i in 0..3, j in 0..i] = box (i, j) to (i + 1, j + 1 s)\nrequire a: true",
            "MC201",
            "j + 1 s",
            "for every `i` and `j`",
            "use the unit m",
        ),
    ]:
        with subtests.test(text=text, code=code, place=place, message=message, way_out=way_out):
            found = errors(REGIONS + text + "\n")
            mine = [each for each in found if each[0] == code]
            assert len(mine) == 1, found
            assert message in mine[0][2], mine
            assert way_out in mine[0][3], mine
            assert place in ("", mine[0][1]), mine


def test_a_family_too_large_is_refused_before_it_is_made() -> None:
    ((code, _, message, way_out),) = errors("region w[i in 0..1000000, j in 0..1000000] = box (0, 0) to (i, j)\n")
    assert (code, "more than 30000 parts" in message) == ("MC207", True)
    assert "--limit family_parts=" in way_out


def test_a_fix_that_would_change_other_members_is_not_offered() -> None:
    unit = checked("region w[i in 0..3] = box (0, 0) to (1 + i, 2 metr)\nrequire a: true\n").findings
    assert [each.fix.replacement for each in unit if each.fix and each.code.name == "MC202"] == []
    spelling = checked(REGIONS + "let here = true\nrequire a: for i in 0..3: (every t[i]: w[i]) and hree\n").findings
    assert [each.fix.replacement for each in spelling if each.fix and each.code.name == "MC101"] == ["here"]
    whole = checked(REGIONS + "require a: for i in 0..3: eventually[0, (i + 1) / 2 * 1 s] every t[i]: w[i]\n").findings
    assert [each.fix for each in whole if each.code.name == "MC302"] == [None]


def test_a_family_is_left_out_of_the_mission_as_a_whole() -> None:
    found = checked(REGIONS + "require go[i in 0..3]: eventually[0, 9 s] every t[i]: w[3 - i]\nrequire b: true\n")
    assert found.mission is not None
    knobs = without(found, found.mission, ("go[1]", "go[2]", "b"))
    edits = [edit for knob in knobs if (edit := knob.edit(1)) is not None]
    assert [edit.says for edit in edits] == ["without all of `go`", "without `b`"]
    (change,) = changes(edits[0], {})
    assert (change.before.startswith("require go[i in 0..3]"), change.after) == (True, "")


def test_an_explanation_says_it_once_with_the_index() -> None:
    found = checked(
        REGIONS
        + "require go[i in 0..3]: eventually[0, 9 s] every t[i]: w[3 - i]\n"
        + "require far: every t: for i in 0..2: eventually[0, (2*i + 1) * 1 s] x <= i * 0.5 + 9\n"
    )
    assert found.mission is not None
    page = " ".join(" ".join(lines(explained(found.mission), found.mission, None, True)).split())
    assert (
        "require go[i] (line 6) For each `i` from 0 to 3: at some step from 0 s to 9 s, every agent of `t[i]`" in page
    )
    assert "is in `w[-i + 3]`" in page
    assert "for each `i` from 0 to 2: at some step from 0 s to `2*i + 1` s ahead" in page or "`0.5*i + 9` m" in page
    assert page.count("require go") == 1


def test_the_editor_knows_families_and_indices() -> None:
    text = HEAD + REGIONS + "require go[k in 0..3]: eventually[0, 9 s] every t[k]: w[3 - k|]\n"
    found, here = marked(text)
    assert edited(found, text_edits.rename(found, here, "number").changes[found.uri]).count("number") == 3  # type: ignore[index]
    place = text_edits.definition(found, here)
    assert place is not None
    assert found.places.offset(place.range.start) == found.source.text.index("[k in") + 1
    said = hover.hover(found, here)
    assert isinstance(said, types.Hover)
    assert "an index" in said.contents.value  # type: ignore[union-attr]
    names = [symbol.name for symbol in workspace_symbols.symbols(found)]
    assert names == ["demo", "w[i in 0..3]", "t[i in 0..3]", "go[k in 0..3]"]
    found, here = marked(HEAD + REGIONS.replace("w[i in 0", "w|[i in 0") + "require a: every t[1]: w[1]\n")
    renamed = edited(found, text_edits.rename(found, here, "wall").changes[found.uri])  # type: ignore[index]
    assert (renamed.count("wall["), "w[" in renamed) == (3, False)
    assert opened(renamed).found.ok  # type: ignore[union-attr]


def test_the_editor_offers_indices_where_a_number_stands() -> None:
    text = HEAD + REGIONS + "require go: for some_k in 0..3: every t[|]: w[0]\n"
    found, here = marked(text)
    offered = {item.label for item in completion(found, here)}
    assert {"some_k", "min", "max"} <= offered

"""What the language server answers, asked of its parts; the process around them is in test_lsp_server."""

from __future__ import annotations

import asyncio
import re
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("pygls")

from lsprotocol import types

from missionc.base.diagnostics.code import CODES
from missionc.base.limits import Limits
from missionc.base.source import Source, Span
from missionc.cli.app import main
from missionc.compiler.front_end import check
from missionc.frontend.syntax.format import format_mission
from missionc.frontend.syntax.tokens import PLURALS, WORDS
from missionc.ir.language.operators import OPERATORS
from missionc.tools.language_server import hover as hovers
from missionc.tools.language_server import text_edits, workspace_symbols
from missionc.tools.language_server.completion import completion
from missionc.tools.language_server.hover import hover
from missionc.tools.language_server.open_text import Checks, Places, diagnostics
from missionc.tools.language_server.text_edits import RefusedError, formatting, renamable, rename
from tests.support.check_findings import text
from tests.support.open_texts import edited, marked, opened

HOME = "require home: every drone: eventually[0, 16 s] (base and eventually[0, 2 s] goal)"
EVERYWHERE = types.Range(types.Position(0, 0), types.Position(1000, 0))
UTF8, UTF16, UTF32 = (types.PositionEncodingKind(each) for each in ("utf-8", "utf-16", "utf-32"))


def fits(part: str) -> list[str]:
    """What is offered at the `|` of the last declaration of a mission."""
    return [item.label for item in completion(*marked(text(part).rstrip("\n")))]


def said(part: str) -> str:
    found = hover(*marked(text(part)))
    return found.contents.value if found and isinstance(found.contents, types.MarkupContent) else ""


def test_an_editor_is_told_of_what_no_plan_can_do_and_a_page_of_the_mission_too(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mission = text("require go: every drone: base until[3 s, 10 s] goal")
    told = diagnostics(opened(mission), check(Source("sample.mission", mission)).findings)
    (finding,) = [each for each in told if each.code == "MC552"]
    assert finding.message.startswith(
        "none of `drone[0]`, `drone[1]` and `drone[2]` can go from the left to the right side"
    )
    file = tmp_path / "a.mission"
    file.write_text(mission, encoding="utf-8")
    main(["explain", str(file)])
    assert "MC552" in capsys.readouterr().err


# ----------------------------------------------------------------- positions


@pytest.mark.parametrize(("encoding", "column"), [(UTF8, 8), (UTF16, 5), (UTF32, 4)])
def test_columns_are_counted_in_the_units_that_were_agreed_on(encoding: str, column: int) -> None:
    places = Places("a\n# 𝄞é base", encoding)
    end = places.text.index(" base")
    assert places.position(end) == types.Position(1, column)
    assert places.offset(places.position(end)) == end


@pytest.mark.parametrize("line_end", ["\n", "\r\n", "\r"])
def test_each_line_end_of_the_protocol_ends_a_line(line_end: str) -> None:
    places = Places(f"ab{line_end}cd{line_end}")
    assert places.position(2 + len(line_end)) == types.Position(1, 0)
    assert places.offset(types.Position(1, 1)) == 3 + len(line_end)
    assert places.offset(types.Position(0, 99)) == 2
    assert places.offset(types.Position(99, 0)) == len(places.text)


def test_a_place_amid_a_character_is_before_it() -> None:
    assert Places("𝄞a", UTF16).offset(types.Position(0, 1)) == 0


def test_other_characters_that_break_lines_elsewhere_end_none() -> None:
    assert Places("a\u2028b\x0cc").position(4) == types.Position(0, 4)


@pytest.mark.parametrize("written", ["", "\ufeff", "\n", "\ufeffmission a\r\n", "# only a comment", "x" * 70_000])
def test_empty_odd_and_huge_texts_are_answered(written: str) -> None:
    here = opened(written)
    place = types.Position(0, 0)
    assert here.found is not None
    assert diagnostics(here, here.found.findings)
    assert hover(here, place) is None or written
    assert text_edits.definition(here, place) is None
    assert formatting(here) == []
    assert isinstance(completion(here, place), list)


# --------------------------------------------------------------- diagnostics


def test_a_finding_keeps_its_words_its_reasons_and_its_other_places() -> None:
    here = opened(text("require a: every drone: always[0, 16 s] eventually[0, 6 s] base"))
    assert here.found is not None
    finding = next(each for each in diagnostics(here, here.found.findings) if each.code == "MC301")
    assert finding.message.splitlines() == [
        "the mission ends before `a` can be evaluated",
        "the formula needs 22 s; the mission lasts 20 s",
        "help: write `horizon 22 s`",
    ]
    assert finding.related_information is not None
    assert [label.message for label in finding.related_information] == [
        "reaches 16 s ahead",
        "reaches another 6 s ahead",
    ]
    (action,) = text_edits.fixes(here, finding.range)
    assert action.title == "Replace `20 s` by `22 s`"
    assert action.diagnostics == [finding]
    assert action.edit is not None
    assert action.edit.changes is not None
    mended = opened(edited(here, list(action.edit.changes[here.uri])))
    assert mended.found is not None
    assert mended.found.ok


def test_a_name_that_nothing_uses_is_shown_faintly() -> None:
    here = opened(text("let spare = base", HOME))
    assert here.found is not None
    finding = diagnostics(here, here.found.findings)[-1]
    assert (finding.severity, finding.tags) == (
        types.DiagnosticSeverity.Warning,
        [types.DiagnosticTag.Unnecessary],
    )


def test_fixes_are_offered_where_the_cursor_is_and_only_of_this_version() -> None:
    here = opened(text("let spare = base", "require a: every drone: bas"))
    first = here.places.position(here.source.text.index("spare"))
    (action,) = text_edits.fixes(here, types.Range(first, first))
    assert action.title.startswith("Delete `let spare")
    here.found = None
    assert text_edits.fixes(here, EVERYWHERE) == []


def test_the_older_of_two_versions_is_never_published() -> None:
    async def run() -> list[int]:
        published: list[int] = []
        checks = Checks(lambda checked: published.append(checked.version))
        for version in range(5):
            checks.ask(opened(text(HOME), checked=False, version=version))
        while not published:
            await asyncio.sleep(0.01)
        await asyncio.sleep(0.2)
        checks.close()
        return published

    assert asyncio.run(run()) == [4]


# --------------------------------------------------------------------- hover


def test_a_requirement_is_said_back_at_its_label_and_at_its_word() -> None:
    sentence = "at some step of its own from 0 s to 16 s: both the drone is in `base` and"
    assert sentence in said(HOME.replace("home", "ho|me"))
    assert sentence in said(HOME.replace("require", "req|uire"))
    assert "Horizon: 18 s." in said(HOME.replace("home", "ho|me"))


def test_a_word_says_what_it_is(subtests: pytest.Subtests) -> None:
    for part, words in [
        ("param T = 2 * 3 s\nrequire a: every drone: always[0, |T] base", "a parameter, 6 s"),
        ("let soon = eventually[0, 4 s] base\nrequire a: every drone: so|on", "Horizon: 4 s."),
        ("require a: every dro|ne: base", "3 agents."),
        ("require a: every drone: ba|se", "a region"),
        (
            "require a: every drone: alw|ays[0, 2 s] base",
            "The operand is satisfied at every step of the window; bounds: a time window",
        ),
        ("require a: eve|ry 5 s: some drone: base", "at some step of each period of this length"),
        ("require a: eve|ry drone: base", "Each of these agents satisfies the formula"),
        ("require a: every drone: spe|ed <= 1", "The speed of the agent"),
        ("require a: always[0, 3 s] conn|ected(radio)", "Each agent has a route"),
        ("require a: every drone: always[0, 300 m|s] base", "a unit of time: 0.001 s"),
        ("agent a { vehicle crazy|flie21 dynamics single_integrator(speed <= 1)  start at (5, 1) }", "fence_inset"),
        ("agent a { vehicle plain { ti|lt <= 20 deg } }", "angle of the thrust from vertical"),
        ("agent a { flight { hov|er 1 m } }", "hover height above the pad, after takeoff and before landing"),
        ("agent a { fli|ght { hover 1 m } }", "pads at (1, 1, 0)"),
        ("require a: every drone: nowhe|re", "unknown name `nowhere`"),
        ("require a: every drone: |# nothing", ""),
    ]:
        with subtests.test(part=part, words=words):
            found = said(part)
            assert words.lower() in found.lower()
            assert bool(words) == bool(found)


def test_every_keyword_that_a_reader_might_not_know_says_something() -> None:
    known = (
        {operator.name for operator in OPERATORS}
        | {word.text for word in WORDS if word.says == "a declaration"}
        | PLURALS
    )
    for word in sorted(known):
        here, place = marked(f"{word[0]}|{word[1:]} " + ('from "a"' if word in PLURALS else ""))
        found = hover(here, place)
        assert found is not None, word
        assert isinstance(found.contents, types.MarkupContent)
        assert found.contents.value.startswith(f"`{word}`: a")


def test_the_last_sentence_that_was_understood_is_kept_while_another_line_is_broken() -> None:
    broken = text(HOME, "require other: every dron")
    place = broken.index("home") + 1
    here = opened(broken, before=opened(text(HOME)).mission)
    found = hover(here, here.places.position(place))
    assert found is not None
    assert isinstance(found.contents, types.MarkupContent)
    assert "at some step" in found.contents.value


# ------------------------------------------------------------ names, symbols


def test_a_name_is_found_where_it_is_declared_and_used_in_a_text_that_is_broken() -> None:
    here, place = marked(text("require a: every drone: (ba|se and", "let b = base"))
    found = text_edits.definition(here, place)
    assert found is not None
    assert found.range == here.places.range(Span(here.source, *re.search("base", here.source.text).span()))  # type: ignore[union-attr]
    assert len(text_edits.references(here, place, True)) == here.source.text.count("base")
    assert len(text_edits.highlights(here, place)) == here.source.text.count("base")


def test_state_words_and_settings_are_no_names() -> None:
    assert text_edits.definition(*marked(text("require a: every drone: sp|eed <= 1"))) is None
    with pytest.raises(RefusedError, match="no name of the mission"):
        renamable(*marked(text("require a: every drone: sp|eed <= 1")))


@pytest.mark.parametrize(
    ("new", "why"),
    [
        ("goal", "`goal` is already declared"),
        ("every", "is a reserved word"),
        ("2nd", "is not a valid name"),
        ("speed", "a part of an agent's state"),
        ("G", "is a reserved word"),
        ("ä", "is not a valid name"),
        ("b" * 129, "the limit is 128"),
        ("a-b", "is not a valid name"),
        ("", "is not a valid name"),
    ],
)
def test_a_rename_is_refused_in_plain_words(new: str, why: str) -> None:
    with pytest.raises(RefusedError, match=re.escape(why)):
        rename(*marked(text("require a: every drone: ba|se")), new)


def test_a_broken_text_is_not_renamed_in() -> None:
    with pytest.raises(RefusedError, match="syntax errors"):
        rename(*marked(text("require a: every drone: ba|se", "let b = = base")), "other")


def test_a_label_is_renamed_by_itself() -> None:
    here, place = marked(text("require ba|se: every drone: base"))
    edit = rename(here, place, "home")
    assert edit.changes is not None
    assert edited(here, list(edit.changes[here.uri])) == text("require home: every drone: base")


def test_the_declarations_are_listed_those_that_are_broken_too() -> None:
    here = opened(text(HOME, "region new = box"))
    listed = {symbol.name: symbol for symbol in workspace_symbols.symbols(here)}
    assert {"sample", "base", "drone", "radio", "home", "new"} <= listed.keys()
    assert (listed["new"].detail, listed["home"].detail) == ("a region", "require")


def test_each_requirement_says_how_far_it_looks_ahead() -> None:
    here = opened(text("let soon = eventually[0, 4 s] base", HOME, "require now: every drone: base or soon"))
    found = hovers.hints(here, EVERYWHERE)
    assert [hint.label for hint in found] == ["horizon 4 s", "horizon 18 s", "horizon 4 s"]
    lines = here.source.text.splitlines()
    assert [found[1].position.character] == [len(lines[found[1].position.line])]


# ---------------------------------------------------------------- completion


def test_what_is_offered_fits(subtests: pytest.Subtests) -> None:
    for part, offered, not_offered in [
        ("|", {"region", "require", "let"}, {"base", "box", "at"}),
        ("require a: every |", {"drone"}, {"base", "radio", "not"}),
        ("param P = 5 s\nrequire a: every |", {"drone", "P"}, {"base", "radio", "not"}),
        ("require a: every 5 |", {"s", "min", "steps"}, {"m", "deg", "drone"}),
        ("require a: every 5 s: |", {"every", "always", "base"}, {"radio"}),
        ("require a: at least 2 |", {"drone"}, {"base", "radio"}),
        (
            "require a: every drone: |",
            {"always", "base", "goal", "speed", "inside", "not"},
            {"radio", "region", "sample"},
        ),
        ("require a: every drone: base reach[hops 0..2 on |", {"radio"}, {"base", "drone"}),
        ("require a: every drone: always[0, 5 |", {"s", "ms", "min", "steps"}, {"m", "deg", "base"}),
        ("require a: every drone: base |", {"and", "until", "implies"}, {"base", "every", "region"}),
        ("require a: every drone: inside(|", {"base", "fire"}, {"radio", "drone"}),
        ("require a: always[0, 3 s] connected(|", {"radio"}, {"base", "drone"}),
        ("require a: always[0, 3 s] connected(radio, |", {"drone"}, {"base", "radio"}),
        ("require a: every drone: distance(|", {"base", "drone"}, {"radio"}),
        ("region new = |", {"box", "disc", "polygon", "base"}, {"new", "radio", "drone"}),
        ("region new = disc at (1, 1) radius 2 |", {"m", "cm"}, {"s", "rad"}),
        ("graph wire = |", {"proximity", "beacons", "sight"}, {"base"}),
        ("graph wire = proximity 2 m over |", {"drone"}, {"base", "radio"}),
        ("graph wire = proximity 2 m { |", {"drone"}, {"base", "radio"}),
        ("graph wire = proximity 2 m { drone to |", {"drone"}, {"base", "radio"}),
        ("graph wire = proximity 2 m { drone to drone 3 |", {"m", "cm"}, {"s", "drone"}),
        ("graph wire = proximity 2 m |", {"over", "weight"}, {"drone", "base"}),
        ("graph wire = proximity 2 m weight cost 1 { |", {"drone"}, {"base", "radio"}),
        ("formation row = |", {"line", "chain", "star"}, {"base"}),
        ("formation row = line of |", {"drone"}, {"base"}),
        ("formation row = circle of drone |", {"radius", "tolerance", "total"}, {"rows", "base"}),
        ("agent a { |", {"dynamics", "start", "vehicle", "radius"}, {"region", "base"}),
        ("agent a { vehicle |", {"crazyflie21", "plain"}, {"base", "drone"}),
        ("agent a { vehicle plain { |", {"tilt", "jerk"}, {"base", "dynamics"}),
        ("agent a { flight { |", {"pads", "hover", "rise", "land"}, {"base", "dynamics", "tilt"}),
        ("agent a { dynamics |", {"unicycle", "single_integrator"}, {"base"}),
        ("agent a { dynamics unicycle(|", {"speed", "turn"}, {"acceleration"}),
        ("agent a { start |", {"in", "at", "line", "grid"}, {"base"}),
        ("agent a { start in |", {"base", "goal"}, {"radio"}),
        ("agent a { yaw 90 |", {"deg", "rad"}, {"m", "s"}),
        ("solve with |", {"smt", "clot"}, {"base"}),
        ("solve with smt { |", {"nodes", "neighbors"}, {"base"}),
        ("minimize |", {"distance", "duration", "energy"}, {"base"}),
        ("group all = |", {"drone"}, {"all", "base"}),
        ("param T = |", set(), {"base", "T", "drone"}),
        ("require ) a: every ] |", {"drone"}, {"base"}),
        ("# require a: every |", set(), {"drone"}),
        ('include "|', set(), {"base"}),
        ("region |", set(), {"base", "box"}),
    ]:
        with subtests.test(part=part, offered=offered, not_offered=not_offered):
            found = set(fits(part))
            assert offered <= found
            assert not found & not_offered


def test_what_is_offered_replaces_the_word_that_was_begun() -> None:
    here, place = marked(text("require a: every dro|").rstrip("\n"))
    (item,) = completion(here, place)
    assert isinstance(item.text_edit, types.TextEdit)
    assert edited(here, [item.text_edit]).endswith("every drone")


# ---------------------------------------------------------------- formatting


@pytest.mark.parametrize("line_end", ["\n", "\r\n"])
@pytest.mark.parametrize("mark", ["", "\ufeff"])
def test_the_layout_is_that_of_fmt_and_line_ends_stay(line_end: str, mark: str) -> None:
    plain = opened(text(HOME).replace(" = ", "="))
    assert plain.found is not None
    assert plain.found.program is not None
    wanted = format_mission(plain.source, plain.found.program, Limits())
    here = opened(mark + plain.source.text.replace("\n", line_end))
    assert edited(here, formatting(here)) == mark + wanted.replace("\n", line_end)
    assert formatting(opened(wanted)) == []


def test_a_broken_text_keeps_its_layout() -> None:
    assert formatting(opened("region   a = box")) == []


# ------------------------------------------------------------------- command


def test_without_its_package_the_command_says_how_to_install_it() -> None:
    script = (
        "import sys\nfrom importlib import util\nfound = util.find_spec\n"
        "util.find_spec = lambda name, *more: None if name == 'pygls' else found(name, *more)\n"
        "from missionc.cli.app import main\nsys.exit(main(['lsp']))"
    )
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert run.returncode == 1
    assert "error[MC404]: the language server needs the package pygls" in run.stderr
    assert "pip install 'missionc[lsp]'" in run.stderr
    assert "MC404" in CODES


def test_the_server_loads_no_solver_and_no_large_library() -> None:
    script = (
        "import missionc.tools.language_server.server, sys; print(*(name.partition('.')[0] for name in sys.modules))"
    )
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert not {"z3", "torch", "scipy", "matplotlib", "jinja2", "pysat", "piqp"} & set(run.stdout.split())

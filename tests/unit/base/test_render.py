"""Findings as text and as JSON, the text compared whole: it is what people read."""

from __future__ import annotations

from textwrap import dedent

from missionc.base.diagnostics.code import BEYOND_HORIZON, UNREADABLE, UNUSED_NAME
from missionc.base.diagnostics.model import Diagnostic, Label
from missionc.base.diagnostics.render import render_json, render_text
from missionc.base.source import Source, Span

WATCH = "require watch: every drone: always[0, 16 s] (survivor implies eventually[0, 6 s] base)\n"


def span(source: Source, words: str) -> Span:
    start = source.text.index(words)
    return Span(source, start, start + len(words))


def rendered(text: str, primary: str, *others: tuple[str, str], said: str = "here") -> str:
    """A finding about some words of a text, its header and place left out."""
    source = Source("a.mission", text)
    finding = Diagnostic(
        BEYOND_HORIZON,
        "too long",
        Label(span(source, primary), said),
        tuple(Label(span(source, a), b) for a, b in others),
    )
    return "\n".join(render_text([finding], colour=False).splitlines()[2:])


def test_a_finding_shows_its_line_its_labels_its_notes_and_a_way_out() -> None:
    source = Source("wildfire.mission", "# a\n" * 17 + WATCH)
    finding = Diagnostic(
        BEYOND_HORIZON,
        "the mission ends before `watch` can be evaluated",
        Label(span(source, "always[0, 16 s]"), "reaches 16 s ahead"),
        (Label(span(source, "eventually[0, 6 s]"), "reaches another 6 s ahead"),),
        ("the formula needs 22 s; the mission lasts 20 s",),
        "write `horizon 22 s`",
    )
    assert render_text([finding], colour=False) == dedent("""\
        error[MC301]: the mission ends before `watch` can be evaluated
          --> wildfire.mission:18:29
        18 | require watch: every drone: always[0, 16 s] (survivor implies eventually[0, 6 s] base)
           |                             ^^^^^^^^^^^^^^^                   ------------------ reaches another 6 s ahead
           |                             reaches 16 s ahead
           = the formula needs 22 s; the mission lasts 20 s
           help: write `horizon 22 s`
        """)


def test_three_labels_of_one_line_hang_below_each_other_with_stems() -> None:
    assert rendered("one two three", "one", ("two", "second"), ("three", "third")) == dedent("""\
        1 | one two three
          | ^^^ --- ----- third
          | |   second
          | here""")


def test_a_label_inside_another_hangs_below_it() -> None:
    assert rendered("every drone: (fire)", "every drone: (fire)", ("fire", "this")) == dedent("""\
        1 | every drone: (fire)
          | ^^^^^^^^^^^^^^^^^^^
          | |             this
          | here""")


def test_lines_far_apart_have_dots_between_and_near_ones_the_line_between() -> None:
    assert rendered("one\n\nthree\nfour\nfive\nsix", "one", ("three", "b"), ("six", "c")) == dedent("""\
        1 | one
          | ^^^ here
        2 |
        3 | three
          | ----- b
        ...
        6 | six
          | --- c""")


def test_a_span_over_several_lines_is_underlined_on_its_first() -> None:
    assert rendered("team drone {\n  radius 1\n}", "drone {\n  radius 1\n}") == dedent("""\
        1 | team drone {
          |      ^^^^^^^ here""")


def test_tabs_and_wide_characters_keep_the_underline_in_place() -> None:
    assert rendered("\t好 fire", "fire") == "1 |     好 fire\n  |        ^^^^ here"


def test_a_long_line_is_cut_around_its_first_label() -> None:
    _, line, marks = ("\n" + rendered("x" * 500 + " fire " + "y" * 500, "fire")).split("\n")
    assert line.startswith("1 | …xx")
    assert line.endswith("yy…")
    assert len(line) < 150
    assert marks.index("^") == line.index("fire")


def test_an_empty_span_at_the_end_of_the_text_has_one_mark() -> None:
    source = Source("a.mission", "mission a\n")
    finding = Diagnostic(BEYOND_HORIZON, "more was expected", Label(Span(source, 10, 10), "here"))
    assert render_text([finding], colour=False).splitlines()[1:] == [" --> a.mission:2:1", "2 |", "  | ^ here"]


def test_labels_in_two_files_name_both() -> None:
    main, site = Source("a.mission", "fire"), Source("site.mission", "\n\nfire")
    finding = Diagnostic(
        BEYOND_HORIZON, "twice", Label(span(main, "fire"), "again"), (Label(span(site, "fire"), "first"),)
    )
    assert render_text([finding], colour=False).splitlines()[1:] == [
        " --> a.mission:1:1",
        "1 | fire",
        "  | ^^^^ again",
        " ::: site.mission:3:1",
        "3 | fire",
        "  | ---- first",
    ]


def test_a_finding_about_no_text_has_only_words() -> None:
    finding = Diagnostic(UNREADABLE, "cannot read `a`", None, notes=("one\ntwo",), help="give a file")
    assert render_text([finding], colour=False) == dedent("""\
        error[MC002]: cannot read `a`
          = one
            two
          help: give a file
        """)


def test_control_characters_of_a_mission_do_not_reach_the_terminal() -> None:
    text = rendered("\x1b[31mfire\u202e", "fire")
    assert "\x1b" not in text
    assert "\u202e" not in text


def test_colours_are_only_there_when_asked_for() -> None:
    source = Source("a.mission", "fire")
    warning = Diagnostic(UNUSED_NAME, "`fire` is never used", Label(span(source, "fire")))
    assert "\x1b[33;1mwarning[MC103]" in render_text([warning], colour=True)
    assert "\x1b" not in render_text([warning], colour=False)


def test_json_counts_lines_and_columns_from_one_and_ends_past_the_last_character() -> None:
    source = Source("a.mission", "\nabc fire\n")
    finding = Diagnostic(
        BEYOND_HORIZON, "too long", Label(span(source, "fire")), (Label(span(source, "abc"), "this"),), ("n",), "h"
    )
    assert render_json([finding]) == [
        {
            "code": "MC301",
            "severity": "error",
            "message": "too long",
            "file": "a.mission",
            "line": 2,
            "column": 5,
            "end_line": 2,
            "end_column": 9,
            "labels": [
                {"message": "this", "file": "a.mission", "line": 2, "column": 1, "end_line": 2, "end_column": 4}
            ],
            "notes": ["n"],
            "help": "h",
        }
    ]

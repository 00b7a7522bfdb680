"""What the language server shows of a text as a whole: folds, links, colours, lenses, and the missions beside it."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import pytest

pytest.importorskip("pygls")

from lsprotocol import types

from missionc.tools.language_server import code_lenses, workspace_symbols
from missionc.tools.language_server.code_lenses import lenses
from missionc.tools.language_server.open_text import OpenText
from missionc.tools.language_server.text_edits import LEGEND, folds, links, semantic_tokens
from missionc.tools.language_server.workspace_symbols import WorkspaceSymbols
from tests.support.check_findings import text
from tests.support.open_texts import opened

UTF16 = types.PositionEncodingKind.Utf16
HOME = "require home: every drone: eventually[0, 16 s] base"


def folded(written: str) -> list[tuple[int, int, str | None]]:
    found = folds(opened(written, checked=False))
    return [(fold.start_line, fold.end_line, fold.kind) for fold in found]


# --------------------------------------------------------------------- folds


def test_what_belongs_together_is_folded(subtests: pytest.Subtests) -> None:
    for written, expected in [
        ("team a {\n  radius 1 m\n  start in b\n}\n", [(0, 2, None)]),
        ("team a {\n  radius 1 m\n  start in b }\n", [(0, 2, None)]),
        ("require a: (\n  b\n  or c\n)\n", [(0, 2, None)]),
        ("require a:\n  every drone:\n  b\n\nregion b = c\n", [(0, 2, None)]),
        ("# one\n  # two\n\n# alone\n", [(0, 1, "comment")]),
        ("region a = b\nregion b = c\nregion d = e\n\nregion f = g\n", [(0, 2, None)]),
        ("region a = b\nobstacle b = c\n", []),
        ('include "a"\ninclude "b"\n', [(0, 1, "imports")]),
        ("region a = b\nteam c {\n  d\n}\nregion d = e\n", [(1, 2, None)]),
        ("team a { }\n", []),
        ("team a { (\nregion b = c\n}\n", [(1, 2, None)]),
        ("}\n)\n{\n", []),
        ("", []),
    ]:
        with subtests.test(written=written, expected=expected):
            assert folded(written) == expected


def test_a_text_beyond_the_limit_has_folds_of_its_comments_alone() -> None:
    assert folded("# one\n# two\n" + "x" * 70_000) == [(0, 1, "comment")]


# --------------------------------------------------------------------- links


def test_each_file_that_a_text_names_is_a_link(tmp_path: Path) -> None:
    written = (
        'include "parts/site.mission"\n'
        'obstacles from "hall.yaml" layer "walls"\n'
        'team a { start from "starts.csv" }\nsolve with smt { roadmap = "lanes.graphml" }\n'
        'include "/etc/passwd"\n# include "no.mission"\ninclude ""\n'
    )
    here = opened(written, checked=False, name=str(tmp_path / "a.mission"))
    found = links(here)
    names = ["parts/site.mission", "hall.yaml", "starts.csv", "lanes.graphml"]
    assert [link.target for link in found] == [(tmp_path / name).as_uri() for name in names]
    spans = [(here.places.offset(link.range.start), here.places.offset(link.range.end)) for link in found]
    assert [written[start:end] for start, end in spans] == names


def test_a_text_on_no_disk_links_to_nothing() -> None:
    here = opened('include "a.mission"\n', checked=False)
    here.uri = "untitled:Untitled-1"
    assert links(here) == []


# ------------------------------------------------------------------- colours


def coloured(here: OpenText) -> list[tuple[str, str, bool]]:
    """The words that have a colour, with its name, and whether they declare."""
    data, found = semantic_tokens(here).data, []
    line = character = 0
    for lines, across, length, colour, modifiers in zip(*[iter(data)] * 5, strict=True):
        line, character = line + lines, across if lines else character + across
        start = here.places.offset(types.Position(line, character))
        end = here.places.offset(types.Position(line, character + length))
        found.append((here.source.text[start:end], LEGEND.token_types[colour], bool(modifiers)))
    return found


def test_a_name_has_one_colour_where_it_is_declared_and_where_it_is_used() -> None:
    here = opened(text("param T = 4 s", "let soon = eventually[0, T] base", "require a: every drone: soon or missing"))
    found = coloured(here)
    assert [each for each in found if each[0] in ("base", "T", "soon", "a", "drone")] == [
        ("base", "type", True),
        ("drone", "class", True),
        ("base", "type", False),
        ("T", "parameter", True),
        ("soon", "function", True),
        ("T", "parameter", False),
        ("base", "type", False),
        ("a", "event", True),
        ("drone", "class", False),
        ("soon", "function", False),
    ]
    assert "missing" not in [word for word, _, _ in found]


def test_colours_are_counted_in_the_units_of_the_client_and_stay_in_a_broken_text() -> None:
    here = opened(text("require a: every drone: base", 'include "𝄞"  region spare = = base'), UTF16)
    assert ("a", "event", True) in coloured(here)
    assert ("spare", "type", True) in coloured(here)


def test_what_an_included_file_declares_has_its_colour_here_and_no_place(tmp_path: Path) -> None:
    (tmp_path / "site.mission").write_text("\n\nregion base = box (1, 1) to (3, 3)\n")
    here = opened('include "site.mission"\nlet near = base\n', checked=False, name=str(tmp_path / "a.mission"))
    assert coloured(here) == [("near", "function", True), ("base", "type", False)]


# ---------------------------------------------------------- workspace symbols


def listed(found: list[types.WorkspaceSymbol]) -> list[tuple[str, str | None]]:
    return [(symbol.name, symbol.container_name) for symbol in found]


def test_declarations_are_found_in_all_missions_of_the_folder_as_they_are_now(tmp_path: Path) -> None:
    for name in ("one.mission", "deep/two.mission", ".hidden/three.mission", "build/x/mission/four.mission"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(f"region of_{Path(name).stem} = box (1, 1) to (3, 3)\n")
    (tmp_path / "build/x/manifest.json").write_text("{}")
    (tmp_path / "binary.mission").write_bytes(b"\0")
    here = opened("region typed = box (1, 1) to (2, 2)\n", checked=False, name=str(tmp_path / "one.mission"))
    symbols = WorkspaceSymbols()
    found = symbols.search("", [tmp_path], {here.uri: here}, UTF16)
    assert listed(found) == [("typed", "one.mission"), ("of_two", "two.mission")]
    assert listed(symbols.search("OTW", [tmp_path], {}, UTF16)) == [("of_two", "two.mission")]
    (place,) = [each.location for each in symbols.search("two", [tmp_path], {}, UTF16)]
    assert isinstance(place, types.Location)
    assert place.uri == (tmp_path / "deep/two.mission").as_uri()
    (tmp_path / "deep/two.mission").write_text("\nregion renamed = box (1, 1) to (3, 3)\n")
    assert listed(symbols.search("re", [tmp_path], {}, UTF16)) == [("renamed", "two.mission")]


def test_no_more_files_are_read_than_the_limit_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for number in range(5):
        (tmp_path / f"{number}.mission").write_text(f"region a{number} = box (1, 1) to (3, 3)\n")
    monkeypatch.setattr(workspace_symbols, "MOST_FILES", 2)
    symbols = WorkspaceSymbols()
    assert len(symbols.search("", [tmp_path], {}, UTF16)) == 2
    monkeypatch.setattr(workspace_symbols, "MOST_SYMBOLS", 1)
    assert len(symbols.search("", [tmp_path], {}, UTF16)) == 1
    assert symbols.search("", [tmp_path / "gone"], {}, UTF16) == []


# -------------------------------------------------------------------- lenses


def planned(folder: Path, inputs: dict[str, str], robustness: dict[str, object], **also: object) -> None:
    """As much of a folder that `compile` writes as the lenses read."""
    written = folder / "build" / "sample"
    written.mkdir(parents=True, exist_ok=True)
    hashes = {name: hashlib.sha256(content.encode()).hexdigest() for name, content in inputs.items()}
    manifest = {"schema": "missionc.manifest/1", "mission": "sample", "inputs": hashes, **also}
    (written / "manifest.json").write_text(json.dumps(manifest))
    judged = [{"name": name, "satisfied": True, "robustness": value} for name, value in robustness.items()]
    (written / "plan.json").write_text(json.dumps({"requirements": judged}))


def above(here: OpenText, folder: Path, *commands: str) -> list[tuple[int, str]]:
    """The line and the words of each lens."""
    found = lenses(here, commands, [folder])
    return [(lens.range.start.line, lens.command.title if lens.command else "") for lens in found]


def test_above_the_name_stand_the_commands_that_the_client_has(tmp_path: Path) -> None:
    here = opened(text(HOME))
    assert above(here, tmp_path) == []
    assert above(here, tmp_path, "missionc.compile", "other") == [(0, "compile")]
    (lens,) = lenses(here, ["missionc.compile"], [])
    assert lens.command is not None
    assert (lens.command.command, lens.command.arguments) == ("missionc.compile", [here.uri])
    assert above(opened("region a = b\n"), tmp_path, "missionc.compile") == []


def test_above_a_requirement_stands_its_robustness_in_the_last_plan(tmp_path: Path) -> None:
    mission = text(HOME, "require every drone: goal or true", "require free: every drone: true")
    here = opened(mission, name=str(tmp_path / "a.mission"))
    assert here.mission is not None
    unnamed = here.mission.requirements[1].name
    planned(tmp_path, {"a.mission": mission}, {"home": 0.04196, unnamed: 2, "other": 1.0})
    line = mission[: mission.index("require")].count("\n")
    assert above(here, tmp_path) == [(line, "robustness 0.042 (last plan)"), (line + 1, "robustness 2.000 (last plan)")]
    changed = opened(mission.replace("16 s", "15 s"), name=str(tmp_path / "a.mission"))
    assert above(changed, tmp_path)[0] == (line, "robustness 0.042 (last plan, mission changed since)")


def test_a_family_of_requirements_shows_the_least(tmp_path: Path) -> None:
    mission = text("require w[i in 0..1]: drone[i]: base")
    here = opened(mission, name=str(tmp_path / "a.mission"))
    assert here.mission is not None, here.found
    planned(tmp_path, {"a.mission": mission}, {"w[0]": 0.5, "w[1]": 0.25})
    assert [words for _, words in above(here, tmp_path)] == ["smallest robustness 0.250 (last plan)"]


def test_a_file_that_the_mission_includes_counts_too(tmp_path: Path) -> None:
    main, part = text(HOME, 'include "part.mission"'), "region more = box (4, 1) to (5, 2)\n"
    (tmp_path / "part.mission").write_text(part)
    planned(tmp_path, {"a.mission": main, "part.mission": part}, {"home": 0.5})
    here = opened(main, name=str(tmp_path / "a.mission"))
    assert [words for _, words in above(here, tmp_path)] == ["robustness 0.500 (last plan)"]
    (tmp_path / "part.mission").write_text(part + "#\n")
    assert [words for _, words in above(here, tmp_path)] == ["robustness 0.500 (last plan, mission changed since)"]


@pytest.mark.parametrize(
    "broken", ["", "[]", "{", "[" * 100_000, '{"requirements": [1, {"name": 2}]}', '{"schema": 1}']
)
def test_a_folder_that_cannot_be_read_says_nothing(tmp_path: Path, broken: str) -> None:
    mission = text(HOME)
    here = opened(mission, name=str(tmp_path / "a.mission"))
    for file in ("plan.json", "manifest.json"):
        planned(tmp_path, {"a.mission": mission}, {"home": 0.5})
        (tmp_path / "build" / "sample" / file).write_text(broken)
        assert above(here, tmp_path) == []


def test_a_plan_of_another_mission_or_too_large_says_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    mission = text(HOME)
    here = opened(mission, name=str(tmp_path / "a.mission"))
    planned(tmp_path, {"a.mission": mission}, {"home": 0.5}, mission="other")
    assert above(here, tmp_path) == []
    planned(tmp_path, {"a.mission": mission, "../b": "", "/c": ""}, {"home": 0.5})
    assert [words for _, words in above(here, tmp_path)] == ["robustness 0.500 (last plan, mission changed since)"]
    monkeypatch.setattr(code_lenses, "MOST_BYTES", 8)
    planned(tmp_path, {"a.mission": mission}, {"home": 0.25, "other": 1})
    assert above(here, tmp_path) == []

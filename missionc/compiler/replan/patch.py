"""Patches: declarations that replace a mission's own during its flight, as an edit of its text.

in   Checked, the text of the patch
out  the mission's files with the changes
says MC721

A declaration with an existing name replaces the old one; a team is replaced line by line. A region, obstacle or beacon
with a new name is added. Requirements, their agents, and the time stay the same.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeAlias

from missionc.base.diagnostics.code import NOT_TO_BE_CHANGED
from missionc.base.diagnostics.model import Diagnostic, Label
from missionc.base.limits import Limits
from missionc.base.source import Source, Span
from missionc.compiler.front_end import Checked
from missionc.compiler.provenance import input_name_of, texts
from missionc.frontend.syntax import ast
from missionc.frontend.syntax.parse import parse

PLACES = (ast.Region, ast.Obstacle, ast.Beacon)
"""Kinds of declarations that a patch may add or replace."""
ALONE = (ast.Separation, ast.Clearance)
"""Kinds of declarations that occur at most once in a mission."""
OTHERS = (ast.Param, ast.Graph)
"""Kinds of declarations that a patch may replace, but not add."""
CHANGEABLE = "regions, obstacles, beacons, parameters, graphs, the `separation`, the `clearance`, and lines of a team"

Change: TypeAlias = tuple[Span, str]


def patched(checked: Checked, patch: Source, limits: Limits) -> Mapping[str, str] | list[Diagnostic]:
    """Texts of the mission's files after a patch, by name, or the errors in the patch."""
    program, findings = parse(patch, limits, _no_file)
    if program is None:
        return findings
    assert checked.program is not None
    changes: list[Change] = []
    added: list[str] = []
    for item in program.declarations:
        before = _before(checked.program, item)
        match item:
            case ast.Team() if isinstance(before, ast.Team):
                made = _team(before, item)
                findings += [made] if isinstance(made, Diagnostic) else []
                changes += made if isinstance(made, list) else []
            case ast.Region() | ast.Obstacle() | ast.Beacon() if before is None:
                added.append(item.span.text)
            case _ if before is not None and isinstance(item, (*PLACES, *ALONE, *OTHERS)):
                changes.append((before.span, item.span.text))
            case ast.Separation() | ast.Clearance():
                added.append(item.span.text)
            case _:
                findings.append(_refused(item))
    if findings:
        return findings
    return _edited(checked, changes, added)


def _no_file(written: str, span: Span, /, *, data: bool = False) -> Source | Diagnostic:
    """Diagnostic of a patch that refers to a file, since it must consist of one text."""
    return _said(span, f"a patch cannot read the file `{written}`", "copy its declarations into the patch")


def _before(program: ast.Program, item: ast.Declaration) -> ast.Declaration | None:
    """Declaration of the mission that an item of the patch replaces; None if it is new."""
    for each in program.declarations:
        if type(each) is type(item) and (isinstance(item, ALONE) or _name(each) == _name(item) != ""):
            return each
    return None


def _name(item: ast.Declaration) -> str:
    name = getattr(item, "name", None)
    return name.text if isinstance(name, ast.Name) else ""


def _team(before: ast.Team, now: ast.Team) -> list[Change] | Diagnostic:
    """Changed and new lines of a team, or a diagnostic if the patch changes its size."""
    if (before.size is None) != (now.size is None) or (
        now.size is not None and before.size is not None and now.size.span.text != before.size.span.text
    ):
        return _said(now.span, "a patch cannot change the size of a team", "name lost agents with `--lost`")
    changes: list[Change] = []
    for item in now.items:
        own = next((each for each in before.items if type(each) is type(item) and _same(each, item)), None)
        if isinstance(item, ast.Start):
            return _said(
                item.span, "a patch cannot change `start`: the agents have started", "delete `start` from the patch"
            )
        if own is not None:
            changes.append((own.span, item.span.text))
        else:
            end = before.span.end - 1
            changes.append((Span(before.span.source, end, end), f"  {item.span.text}\n"))
    return changes


def _same(one: object, other: object) -> bool:
    """Return whether two lines of a team set the same value, for kinds of lines that set several."""
    names = [getattr(each, "name", None) for each in (one, other)]
    if isinstance(one, ast.Setting):
        return all(isinstance(each, ast.Name) for each in names) and names[0].text == names[1].text  # type: ignore[union-attr]
    return True


def _refused(item: ast.Declaration) -> Diagnostic:
    word = item.span.text.split(maxsplit=1)[0]
    if isinstance(item, (*OTHERS, ast.Team)):
        return _said(item.span, f"the mission has no `{_name(item)}` to replace", "check the name")
    return _said(item.span, f"`{word}` cannot be changed in flight", f"change only {CHANGEABLE}")


def _said(span: Span, message: str, help: str) -> Diagnostic:
    return Diagnostic(NOT_TO_BE_CHANGED, message, Label(span), help=help)


def _edited(checked: Checked, changes: list[Change], added: list[str]) -> dict[str, str]:
    found = dict(texts(checked))
    names = {source.name: input_name_of(checked, source) for source in checked.sources}
    for span, text in sorted(changes, key=lambda change: change[0].start, reverse=True):
        name = names[span.source.name]
        found[name] = found[name][: span.start] + text + found[name][span.end :]
    if added:
        main = names[checked.sources[0].name]
        found[main] = found[main].rstrip("\n") + "\n\n" + "\n".join(added) + "\n"
    return found

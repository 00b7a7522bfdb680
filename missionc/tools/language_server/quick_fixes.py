"""Quick fixes (code actions): the edits attached to findings."""

from __future__ import annotations

from lsprotocol import types

from missionc.base.diagnostics.model import Fix
from missionc.frontend.syntax.tokens import quoted
from missionc.tools.language_server.background_checks import diagnostics
from missionc.tools.language_server.open_text import OpenText


def fixes(text: OpenText, wanted: types.Range) -> list[types.CodeAction]:
    """Code actions with the fixes of the findings in a range; none until this version of the text is checked."""
    findings = text.found.findings if text.found else ()
    first, last = text.places.offset(wanted.start), text.places.offset(wanted.end)
    actions = []
    for finding in findings:
        if finding.fix is None or finding.primary is None:
            continue
        span = finding.primary.span
        if span.source.name != text.source.name or finding.fix.span.source.name != text.source.name:
            continue
        if first <= span.end and span.start <= last:
            edit = types.TextEdit(text.places.range(finding.fix.span), finding.fix.replacement)
            actions.append(
                types.CodeAction(
                    title=title(finding.fix),
                    kind=types.CodeActionKind.QuickFix,
                    diagnostics=diagnostics(text, [finding]),
                    edit=types.WorkspaceEdit(changes={text.uri: [edit]}),
                    is_preferred=True,
                )
            )
    return actions


def title(fix: Fix) -> str:
    """Description of a fix in one line, for the menu."""
    old, new = (quoted(" ".join(words.split())) for words in (fix.span.text, fix.replacement))
    if not fix.span.text.strip():
        return f"Insert {new}"
    return f"Replace {old} by {new}" if fix.replacement else f"Delete {old}"

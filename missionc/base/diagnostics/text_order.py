"""Order of diagnostics in the output: that of the text."""

from __future__ import annotations

from missionc.base.diagnostics.model import Diagnostic


def in_text_order(findings: list[Diagnostic]) -> list[Diagnostic]:
    """Findings by place in the text, file by file in order of appearance.

    Those without a place come first.
    """
    files: dict[int, int] = {}
    keyed = []
    for finding in findings:
        if finding.primary is None:
            keyed.append(((-1, 0), finding))
            continue
        span = finding.primary.span
        keyed.append(((files.setdefault(id(span.source), len(files)), span.start), finding))
    return [finding for _, finding in sorted(keyed, key=lambda pair: pair[0])]

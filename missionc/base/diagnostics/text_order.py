"""Order of diagnostics in the output: the order of their source locations."""

from __future__ import annotations

from missionc.base.diagnostics.model import Diagnostic


def in_text_order(findings: list[Diagnostic]) -> list[Diagnostic]:
    """Findings sorted by source location, file by file in order of first appearance; findings without a location come
    first."""
    files: dict[int, int] = {}
    keyed = []
    for finding in findings:
        if finding.primary is None:
            keyed.append(((-1, 0), finding))
            continue
        span = finding.primary.span
        keyed.append(((files.setdefault(id(span.source), len(files)), span.start), finding))
    return [finding for _, finding in sorted(keyed, key=lambda pair: pair[0])]

"""Findings as they are given out: in the order of the text, and no more of them than anybody reads."""

from __future__ import annotations

from missionc.diagnostics.model import Diagnostic
from missionc.syntax.tokens import MOST_FINDINGS


def in_text_order(findings: list[Diagnostic]) -> list[Diagnostic]:
    """By place in the text, file by file in the order first met; those without a place first.

    No more than anybody reads, and of those the errors rather than the warnings.
    """
    files: dict[int, int] = {}
    keyed = []
    for finding in findings:
        if finding.primary is None:
            keyed.append(((-1, 0), finding))
            continue
        span = finding.primary.span
        keyed.append(((files.setdefault(id(span.source), len(files)), span.start), finding))
    keyed.sort(key=lambda pair: pair[0])
    if len(keyed) > MOST_FINDINGS:
        errors_first = sorted(keyed, key=lambda pair: pair[1].code.warning)[:MOST_FINDINGS]
        keyed = sorted(errors_first, key=lambda pair: pair[0])
    return [finding for _, finding in keyed]

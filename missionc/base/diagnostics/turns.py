"""Findings about text that is repeated for several indices (families, ``for``): each is reported once, with its
indices."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import replace
from fractions import Fraction
from math import prod

from missionc.base.diagnostics.model import Diagnostic, Fix
from missionc.base.source import Span, Turn

MOST = 3
"""Maximum number of repetitions whose indices a finding lists individually."""


def once_for_all_turns(findings: Iterable[Diagnostic]) -> list[Diagnostic]:
    """Findings in order; findings with the same code and location that differ in indices only are merged, with their
    indices.

    A fix is preserved if it is the same for all indices.
    """
    alike: dict[object, list[Diagnostic]] = {}
    times: Counter[object] = Counter()
    for number, finding in enumerate(findings):
        if finding.primary is None or not finding.primary.span.turns:
            alike[number] = [finding]
            continue
        span = finding.primary.span
        place = (finding.code.name, span.source.name, span.start, span.end)
        times[place, span.turns] += 1
        alike.setdefault((place, times[place, span.turns]), []).append(finding)
    return [_one(each) for each in alike.values()]


def _one(findings: list[Diagnostic]) -> Diagnostic:
    first = findings[0]
    if first.primary is None or not first.primary.span.turns:
        return first
    turns = [finding.primary.span.turns for finding in findings if finding.primary is not None]
    everywhere = sum(map(_share, turns)) == 1
    same = all(_edit(finding.fix) == _edit(first.fix) for finding in findings)
    fix = first.fix if everywhere and same else None
    return replace(first, notes=(*first.notes, _with(turns, everywhere)), fix=fix)


def _share(turns: tuple[Turn, ...]) -> Fraction:
    """Fraction of one repetition among all repetitions of a text, by the ranges of its indices; the fractions sum to
    1."""
    return Fraction(1, prod(turn.high - turn.low + 1 for turn in turns))


def _edit(fix: Fix | None) -> tuple[object, ...]:
    return () if fix is None else (_place(fix.span), fix.replacement)


def _place(span: Span) -> tuple[str, int, int]:
    return span.source.name, span.start, span.end


# ------------------------------------------------------------------ messages


def _with(turns: list[tuple[Turn, ...]], everywhere: bool) -> str:
    if everywhere and len(turns) > 1:
        return f"for every {' and '.join(f'`{turn.name}`' for turn in turns[0])}"
    shown = [", ".join(f"{turn.name} = {turn.value}" for turn in each) for each in turns[:MOST]]
    more = f", and {len(turns) - MOST} more" if len(turns) > MOST else ""
    if len(turns) == 1:
        return f"for {shown[0]}"
    return f"for {'; '.join(shown)}{more} (first one shown)"

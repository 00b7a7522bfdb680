"""The final table: number, results, findings and time of each kind of trial."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator

from farm.journal import Line
from farm.trials import KINDS


def table(lines: Iterable[Line]) -> Iterator[str]:
    """Rows in Markdown."""
    every = list(lines)
    yield "| kind | trials | trials per minute | time (s) | findings | outcomes |"
    yield "|---|---:|---:|---:|---:|---|"
    for name in [name for name in KINDS if any(line.kind == name for line in every)]:
        yield _row(name, [line for line in every if line.kind == name])
    yield _row("all", every)


def _row(name: str, lines: list[Line]) -> str:
    seconds = sum(line.seconds for line in lines)
    found = {line.signature for line in lines if line.signature}
    outcomes = Counter(line.outcome for line in lines)
    words = ", ".join(f"{count} {word}" for word, count in outcomes.most_common(6)) if name != "all" else ""
    rate = f"{60 * len(lines) / seconds:.1f}" if seconds else "–"
    return f"| {name} | {len(lines)} | {rate} | {seconds:.0f} | {len(found)} | {words} |"

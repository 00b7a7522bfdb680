"""A finding that brings an edit with it is mended by it: it is gone, and what read before reads still."""

from __future__ import annotations

import random
import re
from pathlib import Path

import pytest

from missionc.base.diagnostics.model import Diagnostic
from missionc.base.source import Source
from missionc.compiler.front_end import check
from tests.properties.frontend.test_mutated_missions import mutated
from tests.support.check_findings import text

ROOT = Path(__file__).resolve().parents[3]
WRONG = [
    match[1]
    for page in sorted((ROOT / "docs" / "errors").glob("MC*.md"))
    for match in re.finditer(
        r"^```mission[^\n]*\n(.*?)^```", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL
    )
]
MUTANTS = 400

MENDED = [
    ("require a: every drone: always[0, 16 s] eventually[0, 6 s] base", "MC301", "22 s"),
    ("require a: every drone: always[0, end] eventually[0, 6 s] base", "MC301", "always[0, 14 s]"),
    ("require a: every drone: always[0, 2.6 s] base", "MC302", "3 s"),
    ("require a: every drone: always[8 s, 4 s] base", "MC303", "4 s, 8 s"),
    ("require a: every drone: base reach[hops 2..1] goal", "MC303", "1..2"),
    ("require a: every drone: base reach[distance 50..20 cm] goal", "MC303", "20..50 cm"),
    ("require a: every drone[2..1]: base", "MC303", "drone[1..2]"),
    ("require a: every drone: eventually[1.2 s, 1.7 s] base", "MC305", "[1 s, 2 s]"),
    ("require a: every drone[0-2]: base", "MC105", "0..2"),
    ("require a: every drone: z <= 3", "MC205", "altitude"),
    ("require a: every drone: base + 1 <= 3", "MC104", "distance(base)"),
    ("require a: always[0, 3 s] radio", "MC104", "connected(radio)"),
    ("require a: every drone: bas", "MC101", "base"),
    ("graph wire = proximity 3 m\nrequire a: every drone: base reach[hops 0..1] goal", "MC208", " on radio"),
    ("require a: every drone: escape[hops 1..1.7 on radio] base", "MC209", "2"),
    ("require a: every drone: escape[hops 0..2 on radio] base", "MC514", "escape[hops 1..2 on radio]"),
    (
        "require a: some drone: eventually[2 s, 6 s] base reach[hops 0..1 on radio] goal",
        "MC015",
        "(base reach[hops 0..1 on radio] goal)",
    ),
    ("world (0, 0) to (10, 10)", "MC013", ""),
    ("let spare = base", "MC103", ""),
    ("let\u200b spare = base", "MC007", ""),
    ("formation row = line of drone spacing 1 m heading 90 tolerance 0.1 m\nrequire a: row", "MC210", "90 deg"),
]


def mended(finding: Diagnostic, written: str) -> str:
    assert finding.fix is not None
    span = finding.fix.span
    return written[: span.start] + finding.fix.replacement + written[span.end :]


def found(written: str) -> tuple[Diagnostic, ...]:
    return check(Source("typed.mission", written)).findings


def key(finding: Diagnostic) -> tuple[str, str, str]:
    return finding.code.name, finding.message, finding.primary.span.text if finding.primary else ""


def reads(findings: tuple[Diagnostic, ...]) -> bool:
    return not any(finding.code.name in ("MC001", "MC007", "MC008") for finding in findings)


def assert_mends(finding: Diagnostic, written: str, before: tuple[Diagnostic, ...]) -> None:
    assert finding.fix is not None
    span = finding.fix.span
    assert 0 <= span.start <= span.end <= len(written)
    assert finding.fix.replacement != span.text, (finding, written)
    after = found(mended(finding, written))
    same = [key(other) for other in before].count(key(finding))
    assert [key(other) for other in after].count(key(finding)) < same, (finding, mended(finding, written))
    assert reads(after) or not reads(before), (finding, mended(finding, written))


@pytest.mark.parametrize(("part", "code", "replacement"), MENDED)
def test_a_mistake_is_mended_by_its_own_edit(part: str, code: str, replacement: str) -> None:
    written = text(part)
    findings = found(written)
    finding = next(finding for finding in findings if finding.code.name == code and finding.fix is not None)
    assert finding.fix is not None
    assert finding.fix.replacement == replacement
    assert_mends(finding, written, findings)


@pytest.mark.parametrize("seed", range(0, MUTANTS, 100))
def test_every_edit_that_comes_with_a_finding_removes_it(seed: int) -> None:
    chance = random.Random(seed)
    tried = 0
    for number in range(seed, seed + 100):
        written = chance.choice(WRONG) if number % 4 == 0 else mutated(number)
        findings = found(written)
        for finding in findings[:3]:
            if finding.fix is not None and finding.fix.span.source.name == "typed.mission":
                assert_mends(finding, written, findings)
                tried += 1
    assert tried > 20

"""The text of a mission with random changes, in every command: an answer or a coded message, no traceback."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from farm.trial import MISSION, Broken, Case, Kind
from missionc.base.diagnostics.render import render_json, render_text
from missionc.base.source import Source
from missionc.compiler import driver
from tests.support.every_command import taken_through
from tests.support.mutated_texts import SMALLEST, mutated_of, nudged
from tests.support.random_language_missions import random_program

ROOT = Path(__file__).resolve().parents[2]
LONGEST = 3_000
"""Maximum number of characters of a changed text: longer ones are slower without more findings."""
FLAGS = ("--time-limit", "1", "--explain-limit", "0", "--set", "smt.nodes=30")
"""Number of roadmap nodes if the mission gives none: for agents with momentum, more are slow."""


@cache
def texts() -> tuple[str, ...]:
    """Real missions, including earlier findings."""
    found = [ROOT / "tests" / "corpus" / "found", ROOT / "missions"]
    read = [path.read_text(encoding="utf-8") for folder in found for path in sorted(folder.rglob("*.mission"))]
    return tuple(text for text in read if len(text) < LONGEST)


def draw(generator: np.random.Generator) -> Case:
    drawn = random_program(np.random.default_rng(generator.integers(2**63)))
    base = texts() if generator.random() < 0.7 else SMALLEST
    text = base[int(generator.integers(len(base)))]
    if generator.random() < 0.4 and len(drawn) == 1:
        text = drawn[MISSION]
    change = nudged if generator.random() < 0.8 else mutated_of
    return Case({MISSION: change(text, int(generator.integers(2**31)))})


def carry_out(case: Case, folder: Path) -> str:
    checked = driver.check(Source(MISSION, case.files[MISSION]))
    findings = list(checked.findings)
    well_formed = render_text(findings, colour=False).count("[MC") >= len(findings) and len(render_json(findings)) >= 0
    if not well_formed or (not checked.ok and not findings):
        raise Broken("findings", "Every refusal has a code.", findings)
    for finding in findings:
        for label in filter(None, (finding.primary, *finding.labels)):
            if not 0 <= label.span.start <= label.span.end <= len(label.span.source.text):
                raise Broken("findings", "The position of a finding lies within the text.", finding)
    return taken_through(case.files, folder / "mission", FLAGS).outcome


MUTATED_TEXTS = Kind(
    "mutated_texts", "a mission text with random changes, through every command", draw, carry_out, 90.0
)

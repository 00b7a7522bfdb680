"""Mission texts and their `check` findings, for the tests of the passes."""

from __future__ import annotations

from missionc.base.diagnostics.code import Code
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.source import Source
from missionc.compiler.driver import check
from missionc.ir import Mission

AGENTS = "team drone[3] { radius 0.1 m  dynamics single_integrator(speed <= 2 m/s)  start in base }"

WORLD = """mission sample
world  (0, 0) to (10, 10)
region base = box (0.5, 0.5) to (3, 3)
region goal = box (7, 7) to (9, 9)
region fire = disc at (5, 5) radius 1 m
graph  radio = proximity 2 m
"""


def text(*parts: str, time: str = "step 1 s, horizon 20 s", agents: str = AGENTS, world: str = WORLD) -> str:
    """Mission with these parts, in a world with a `base`, a `goal` and a `fire`, and three drones in the base."""
    return "\n".join((world, f"time {time}", agents, *parts)) + "\n"


def findings(mission: str) -> list[Diagnostic]:
    return list(check(Source("sample.mission", mission)).findings)


def found(mission: str, code: Code) -> list[Diagnostic]:
    """Findings with one code, in file order."""
    return [finding for finding in findings(mission) if finding.code == code]


def only(mission: str, code: Code) -> Diagnostic:
    """Single finding with a code."""
    (finding,) = found(mission, code)
    return finding


def meant(mission: str) -> Mission:
    """Resolved mission of a text without errors."""
    checked = check(Source("sample.mission", mission))
    assert checked.mission is not None, checked.findings
    return checked.mission


def words(finding: Diagnostic) -> list[tuple[str, str]]:
    """Text under each label, the primary one first, and its message."""
    assert finding.primary is not None
    return [(label.span.text, label.message) for label in (finding.primary, *finding.labels)]

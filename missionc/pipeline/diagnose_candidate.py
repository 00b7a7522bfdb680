"""Diagnosis of a search's best candidate: who is late and by how much, who meets whom where, and what to try.

in   Mission, its kernel, the candidate as the acceptance test judged it
out  Diagnosis: sentences, and one change that follows from them

It is the same for every engine, and asks nothing but the candidate's own positions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

from missionc.backends.api import Attempt, Fault
from missionc.base.judgement import Judgement
from missionc.ir import Mission
from missionc.ir.wording import listed
from missionc.kernel.nodes import Kernel
from missionc.pipeline.lateness import Late, late_agents, more_time
from missionc.pipeline.meetings import Meeting, meetings, place

SHOWN = 3
"""So many of a kind are told."""


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """What the candidate fails, a sentence each, and what to try, which is empty where nothing follows from that.

    ``late``: the mission's own time is what is short, so that a longer search is not what to try first.
    """

    notes: tuple[str, ...]
    advice: str
    late: bool


def diagnose(mission: Mission, kernel: Kernel, best: Attempt) -> Diagnosis:
    """Find late agents, agents in conflict, and requirements that fail at the same agents."""
    met, late = meetings(mission, best), late_agents(mission, kernel, best)
    notes = [
        *_some([each.says for each in late], "agent is late", "agents are late"),
        *_some([each.says for each in met], "pair meets", "pairs meet"),
        *_some(_touching(mission, best), "agent touches an obstacle", "agents touch an obstacle"),
        *_some(_failing_together(best.violated), "pair of requirements fails", "pairs of requirements fail"),
    ]
    return Diagnosis(tuple(notes), _advice(mission, best.violated, late, met), bool(late and not met))


def _touching(mission: Mission, best: Attempt) -> list[str]:
    """Each agent that touches an obstacle, where it first does."""
    first: dict[str, Fault] = {}
    for fault in best.faults:
        if fault.what == "an obstacle":
            first.setdefault(fault.agents[0], fault)
    rows = {agent.name: agent.index for agent in mission.agents}
    return [
        f"`{name}` touches an obstacle {place(mission, best.trace.position[rows[name], fault.step])}"
        f" at {fault.step * mission.step:g} s"
        for name, fault in first.items()
    ]


def _failing_together(violated: Sequence[Judgement]) -> list[str]:
    """Pairs of requirements that fail at the same agents. They need not conflict: one may imply the other."""
    return [
        f"`{one.name}` and `{other.name}` both fail at {listed(shared)}"
        for one, other in combinations(violated, 2)
        if (shared := [f"`{name}`" for name in one.agents if name in other.agents])
    ]


def _advice(mission: Mission, violated: Sequence[Judgement], late: list[Late], met: list[Meeting]) -> str:
    narrow = [each for each in met if each.width is not None]
    if narrow:
        return max(narrow, key=lambda each: each.two).advice
    if late:
        return more_time(mission, max(late, key=lambda each: each.seconds), violated)
    return met[0].advice if met else ""


def _some(sentences: list[str], one: str, more: str) -> list[str]:
    """The first of them, and how many there are besides: ``1 more pair meets``."""
    left = len(sentences) - SHOWN
    return sentences if left <= 0 else [*sentences[:SHOWN], f"{left} more {one if left == 1 else more}"]

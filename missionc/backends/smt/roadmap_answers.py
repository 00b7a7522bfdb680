"""Answers about the roadmaps at hand that are no plan, and what ends their turn before there is an answer."""

from __future__ import annotations

from dataclasses import dataclass

from missionc.backends.smt.encode.clauses import Clauses


@dataclass(frozen=True, slots=True)
class NoPlan:
    """Proven: these roadmaps hold no plan. The requirements that rests on, and what was refused."""

    conflict: tuple[str, ...]
    clauses: Clauses
    core: tuple[int, ...]
    """The literals of the requirements in conflict."""


class TooDear(Exception):
    """What comes next takes more work than the roadmap at hand may."""


class TimeOver(Exception):
    """There is no time left for what comes next."""


@dataclass(frozen=True, slots=True)
class TooFewLinks:
    """No plan was found, with routes shorter than the mission allows."""


@dataclass(frozen=True, slots=True)
class Unsettled:
    """Neither a plan nor a refusal, in the work that these roadmaps may take, or for what no solver can be asked."""

    why: str = ""

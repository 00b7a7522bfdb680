"""Answers about the roadmaps at hand that are no plan, and what ends their turn before there is an answer."""

from __future__ import annotations

from dataclasses import dataclass

from missionc.backends.smt.encode.clauses import Clauses
from missionc.ir import Lanes
from missionc.ir.wording import all_listed


@dataclass(frozen=True, slots=True)
class NoPlan:
    """Proven: these roadmaps hold no plan. The requirements that rests on, and what was refused."""

    conflict: tuple[str, ...]
    clauses: Clauses
    core: tuple[int, ...]
    """The literals of the requirements in conflict."""


class WorkExceeded(Exception):
    """What comes next takes more work than the roadmap at hand may."""


class TimeOver(Exception):
    """There is no time left for what comes next."""


@dataclass(frozen=True, slots=True)
class TooFewLinks:
    """No plan was found, with routes shorter than the mission allows."""


@dataclass(frozen=True, slots=True)
class Inconclusive:
    """Neither a plan nor a refusal, in the work that these roadmaps may take, or for what no solver can be asked."""

    why: str = ""


def refusal(conflict: tuple[str, ...], tried: list[int], lanes: Lanes | None = None, flown: bool = False) -> str:
    """The words of a refusal by roadmaps of so many nodes, or by the user's own, for these requirements in conflict.

    Args:
        flown: agents come to speed and slow down on the user's own as their vehicles fly.
    """
    what = cannot_hold(conflict)
    sampled = f"roadmaps of {all_listed([str(nodes) for nodes in tried])} nodes"
    own = "" if lanes is None else f"the roadmap of `{lanes.path}`{' at speeds flown from rest to rest' * flown}"
    return f"on {own or sampled} {what}"


def cannot_hold(conflict: tuple[str, ...]) -> str:
    """That these requirements cannot; with none, that the agents cannot even move."""
    names = all_listed([f"`{name}`" for name in conflict])
    return {0: "the agents have no feasible motion", 1: f"{names} cannot be satisfied"}.get(
        len(conflict), f"{names} cannot be satisfied together"
    )

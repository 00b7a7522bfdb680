"""Answers about roadmaps other than plans, and reasons for which the work on a roadmap ends."""

from __future__ import annotations

from missionc.backends.smt.encode.clauses import Clauses
from missionc.base.late_dataclass import Record
from missionc.ir import Lanes
from missionc.ir.wording import all_listed


class NoPlan(Record):
    """Proof that these roadmaps contain no plan: names of the requirements that it uses, clauses and core."""

    conflict: tuple[str, ...]
    clauses: Clauses
    core: tuple[int, ...]
    """Literals of the requirements in conflict."""


class WorkExceeded(Exception):
    """Exception: the next stage takes more work than the current roadmap may use."""


class TimeOver(Exception):
    """Exception: no time is left for the next stage."""


class TooFewLinks(Record):
    """Result: no plan was found with routes shorter than the mission allows."""


class Inconclusive(Record):
    """Result: neither a plan nor a refusal, because the work was used up or a solver cannot express the problem."""

    why: str = ""


def refusal(conflict: tuple[str, ...], tried: list[int], lanes: Lanes | None = None, flown: bool = False) -> str:
    """Message about a refusal by roadmaps with these numbers of nodes, or by the user's own roadmap ``lanes``.

    Args:
        flown: True if agents accelerate and brake on the user's roadmap like their vehicles.
    """
    what = cannot_hold(conflict)
    sampled = f"roadmaps of {all_listed([str(nodes) for nodes in tried])} nodes"
    own = "" if lanes is None else f"the roadmap of `{lanes.path}`{' at speeds flown from rest to rest' * flown}"
    return f"on {own or sampled} {what}"


def cannot_hold(conflict: tuple[str, ...]) -> str:
    """Clause that these requirements cannot be satisfied (together); without requirements, that the agents have no
    feasible motion."""
    names = all_listed([f"`{name}`" for name in conflict])
    return {0: "the agents have no feasible motion", 1: f"{names} cannot be satisfied"}.get(
        len(conflict), f"{names} cannot be satisfied together"
    )

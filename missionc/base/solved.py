"""Planning methods: the method that found the trajectory of each agent, for summaries and plan.json."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from missionc.base.figures import counted
from missionc.base.late_dataclass import Record

SEARCH, SKETCH, TRANSPORT, POLISH = "search", "sketch", "transport", "polish"
METHODS = {
    "z3": "Z3",
    "cadical": "CaDiCaL",
    SEARCH: "search",
    SKETCH: "a polished sketch",
    TRANSPORT: "transport",
    POLISH: "polish",
}
"""Display name of each planning method, by its identifier in documents."""


class Solved(Record):
    """Names of the agents whose trajectory one planning method (``by``) found."""

    by: str
    agents: tuple[str, ...]

    def as_record(self) -> dict[str, object]:
        return {"by": self.by, "agents": list(self.agents)}


def solved_by(methods: Mapping[str, str]) -> tuple[Solved, ...]:
    """Agents grouped by planning method, solvers first.

    Args:
        methods: planning method of each agent, by agent name.
    """
    used = sorted(set(methods.values()), key=list(METHODS).index)
    return tuple(Solved(by, tuple(name for name, each in methods.items() if each == by)) for by in used)


def then_polished(solved: tuple[Solved, ...], agents: Iterable[str]) -> tuple[Solved, ...]:
    """Planning methods of a plan after the optimiser has changed the trajectories of all ``agents``."""
    return solved if solved and solved[-1].by == POLISH else (*solved, Solved(POLISH, tuple(agents)))


def solved_text(solved: Sequence[Solved]) -> str:
    """Planning methods as text, ``solved: 2 agents by Z3, 8 by search``; methods that changed agents again follow
    ``then``.

    The text is empty if no method is known.
    """
    parts: list[str] = []
    known: set[str] = set()
    for each in solved:
        count = str(len(each.agents)) if parts else counted(len(each.agents), "agent")
        parts.append(f"{'then ' if known.intersection(each.agents) else ''}{count} by {METHODS[each.by]}")
        known.update(each.agents)
    return f"solved: {', '.join(parts)}" if parts else ""


def read_solved(records: object, agents: Iterable[str]) -> tuple[Solved, ...]:
    """Parse the planning methods from the records of a document.

    Args:
        agents: names of the mission's agents.

    Raises:
        ValueError: the records are no records of known methods and agents of the mission.
    """
    names, found = frozenset(agents), []
    for record in records if isinstance(records, list) else [None]:
        match record:
            case {"by": str(by), "agents": [*listed]} if by in METHODS and names.issuperset(map(str, listed)):
                found.append(Solved(by, tuple(map(str, listed))))
            case _:
                raise ValueError("no record of a method and its agents")
    return tuple(found)

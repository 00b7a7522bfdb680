"""Planning methods: the method that found the motion of each agent, for summaries and plan.json."""

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
"""Name of each method, by its word in documents."""


class Solved(Record):
    """Agents, by name, whose motion one method found."""

    by: str
    agents: tuple[str, ...]

    def as_record(self) -> dict[str, object]:
        return {"by": self.by, "agents": list(self.agents)}


def solved_by(methods: Mapping[str, str]) -> tuple[Solved, ...]:
    """One entry for each method, solvers first, from the method of each agent, by name."""
    used = sorted(set(methods.values()), key=list(METHODS).index)
    return tuple(Solved(by, tuple(name for name, each in methods.items() if each == by)) for by in used)


def then_polished(solved: tuple[Solved, ...], agents: Iterable[str]) -> tuple[Solved, ...]:
    """The same for a plan whose agents the optimiser all moved afterwards."""
    return solved if solved and solved[-1].by == POLISH else (*solved, Solved(POLISH, tuple(agents)))


def solved_text(solved: Sequence[Solved]) -> str:
    """Text such as ``solved: 2 agents by Z3, 8 by search``, with follow-up methods after ``then``.

    Empty if unknown.
    """
    parts: list[str] = []
    known: set[str] = set()
    for each in solved:
        count = str(len(each.agents)) if parts else counted(len(each.agents), "agent")
        parts.append(f"{'then ' if known.intersection(each.agents) else ''}{count} by {METHODS[each.by]}")
        known.update(each.agents)
    return f"solved: {', '.join(parts)}" if parts else ""


def read_solved(records: object, agents: Iterable[str]) -> tuple[Solved, ...]:
    """Parse entries from their records, for a mission with these agents.

    Raises:
        ValueError: these are not records of methods and agents.
    """
    names, found = frozenset(agents), []
    for record in records if isinstance(records, list) else [None]:
        match record:
            case {"by": str(by), "agents": [*listed]} if by in METHODS and names.issuperset(map(str, listed)):
                found.append(Solved(by, tuple(map(str, listed))))
            case _:
                raise ValueError("no record of a method and its agents")
    return tuple(found)

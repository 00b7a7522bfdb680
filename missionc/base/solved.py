"""Planning methods: which of them found the motion of which agents, as a summary prints and plan.json records it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from missionc.base.figures import counted
from missionc.base.late_dataclass import dataclass

SEARCH, SKETCH, TRANSPORT, POLISH = "search", "sketch", "transport", "polish"
METHODS = {
    "z3": "Z3",
    "cadical": "CaDiCaL",
    SEARCH: "search",
    SKETCH: "a polished sketch",
    TRANSPORT: "transport",
    POLISH: "polish",
}
"""Name of each method, by its word in documents: the solver that had the model, single-agent search on a roadmap, the
sketch of clot's tasks, clot's Algorithms 1 and 2, and the optimiser that moves a plan which another method found."""


@dataclass(frozen=True, slots=True)
class Solved:
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
    """The same for a plan that the optimiser moved afterwards, all agents of it."""
    return solved if solved and solved[-1].by == POLISH else (*solved, Solved(POLISH, tuple(agents)))


def solved_text(solved: Sequence[Solved]) -> str:
    """``solved: 2 agents by Z3, 8 by search``, a method that goes on from others after ``then``; empty if not known."""
    parts: list[str] = []
    known: set[str] = set()
    for each in solved:
        count = str(len(each.agents)) if parts else counted(len(each.agents), "agent")
        parts.append(f"{'then ' if known.intersection(each.agents) else ''}{count} by {METHODS[each.by]}")
        known.update(each.agents)
    return f"solved: {', '.join(parts)}" if parts else ""


def read_solved(records: object, agents: Iterable[str]) -> tuple[Solved, ...]:
    """Entries from their records, for a mission with these agents.

    Raises:
        ValueError: these are no records of methods and agents.
    """
    names, found = frozenset(agents), []
    for record in records if isinstance(records, list) else [None]:
        match record:
            case {"by": str(by), "agents": [*listed]} if by in METHODS and names.issuperset(map(str, listed)):
                found.append(Solved(by, tuple(map(str, listed))))
            case _:
                raise ValueError("no record of a method and its agents")
    return tuple(found)

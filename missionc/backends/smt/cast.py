"""Which agents the requirements cannot do without, and which may join as they are needed.

Most missions name few agents: "``drone[0]`` delivers while some drone is near".
A problem with those and one helper is a small part of the whole; who is left out
is planned around them (``bystanders``). Only where that fails are more let in,
and at last all of them, with whom the answer is final.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import reduce

import numpy as np

from missionc.backends.smt.labels import Labels, others
from missionc.backends.smt.roadmap import Roadmap
from missionc.ir import InFormation, Mission
from missionc.kernel.nodes import All, Any, At, Atom, Is, Kernel, Node, Not, Throughout
from missionc.kernel.walk import postorder
from missionc.plan import Flags


@dataclass(slots=True)
class Roles:
    """Read off the requirements.

    ``named``: agents that every plan must give something to do. ``never``: for
    some agents, where they may not be, (steps + 1, states), whatever else.
    """

    named: set[int] = field(default_factory=set)
    never: dict[int, Flags] = field(default_factory=dict)


def roles(kernel: Kernel, mission: Mission, roadmaps: tuple[Roadmap, ...]) -> Roles:
    """Who is named, and what is forbidden to each agent by itself at all times."""
    labels = Labels(mission, roadmaps)
    found = Roles()
    roadmap_of = {agent: number for number, roadmap in enumerate(roadmaps) for agent in roadmap.agents}

    def read(node: Node) -> None:
        """Of a formula that is required as a whole, at step 0."""
        match node:
            case All(parts):
                for part in parts:
                    read(part)
            case At(agent, Throughout(body, low, high)) if _own_state(body, labels):
                number = roadmap_of[agent]
                fails = ~_states(body, agent, number, labels)
                never = found.never.setdefault(agent, np.zeros(roadmaps[number].standing.shape, dtype=np.bool_))
                never[low : None if high is None else high + 1] |= fails
            case _:
                found.named.update(_asked(node))

    for goal in kernel.requirements:
        read(goal.formula)
    return found


def casts(named: frozenset[int], agents: int) -> Iterator[frozenset[int]]:
    """Ever larger sets of agents: the named, then 1, 2, 4 … more, all but the whole team."""
    rest = [agent for agent in range(agents) if agent not in named]
    extra = 0 if named else 1
    while extra < len(rest):
        yield named.union(rest[:extra])
        extra = max(1, 2 * extra)


def _asked(node: Node) -> set[int]:
    """The agents that a formula asks something of by name, wherever it does."""
    asked: set[int] = set()
    for each in postorder((node,)):
        match each:
            case At(agent):
                asked.add(agent)
            case Atom(InFormation(formation)):
                asked.update(formation.agents)
            case Atom(predicate):
                asked |= others(predicate, -1)
            case _:
                pass
    return asked


def _own_state(node: Node, labels: Labels) -> bool:
    """Whether an agent's own state decides it."""
    match node:
        case Atom(predicate):
            return labels.of_places(predicate)
        case Is():
            return True
        case Not(body):
            return _own_state(body, labels)
        case All(parts) | Any(parts):
            return all(_own_state(part, labels) for part in parts)
        case _:
            return False


def _states(node: Node, agent: int, number: int, labels: Labels) -> Flags:
    """In which states, (states,), an agent's own state makes it true."""
    shape = len(labels.roadmaps[number].position)
    match node:
        case Atom(predicate):
            return labels.states(predicate, number)
        case Is(members):
            return np.full(shape, agent in members)
        case Not(body):
            return ~_states(body, agent, number, labels)
        case All(parts):
            everywhere = np.ones(shape, dtype=np.bool_)
            return reduce(np.logical_and, (_states(part, agent, number, labels) for part in parts), everywhere)
        case Any(parts):
            nowhere = np.zeros(shape, dtype=np.bool_)
            return reduce(np.logical_or, (_states(part, agent, number, labels) for part in parts), nowhere)
        case _:
            raise AssertionError(node)

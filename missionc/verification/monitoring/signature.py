"""Discrete signature of a plan: satisfied disjuncts, order of events, and homotopy classes around obstacles.

    in   Mission, its kernel, Trace
    out  Signature; differences between two of them, as text

Two plans differ in one of these cases:
- *option*: a choice that is made once (``kernel.choices``) holds in both, but with too few common branches; for a
      choice over a window, a branch must hold over the complete window;
- *order*: an agent reaches two events in the other order;
- *side*: an agent's path passes a part of the standing obstacles on the other side (``world.winding``).
All other differences are small changes of the same plan.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags, Trace
from missionc.geometry.winding import TURN, StandingPart, standing_parts, swept_angles
from missionc.ir import Mission
from missionc.ir.kernel.analysis import about_whom, relevance
from missionc.ir.kernel.choices import ChoicePoint, branches, kept, made_once, witnesses
from missionc.ir.kernel.nodes import At, Kernel, Node
from missionc.ir.kernel.walk import awaited, children
from missionc.verification.monitoring.monitor import truths

MOST_EVENTS = 120
"""Maximum number of events whose order is compared; the first events of the mission's text are used."""

NAMED = 3
"""Maximum number of agents listed in a sentence."""


class Options(Record, eq=False):
    """Choice point of a requirement, with the indices of the branches that are true."""

    requirement: str
    asked: ChoicePoint
    true: frozenset[int]


class Event(Record, eq=False):
    """Event that a requirement waits for: the steps at which it is true, (steps + 1,), and its agents.

    Args:
        last: last step at which the requirement evaluates the event; windows of later steps may pass the mission's end.
    """

    requirement: str
    asked: ChoicePoint
    body: Node
    steps: Flags
    last: int
    agents: frozenset[int]

    def before(self, other: Event) -> bool:
        """Return whether this event comes before the other one, without a common step."""
        mine, its = np.flatnonzero(self.steps), np.flatnonzero(other.steps)
        return bool(
            len(mine) and len(its) and mine[0] < its[0] and mine[-1] < its[-1] and not (self.steps & other.steps).any()
        )


class Signature(Record, eq=False):
    """Discrete signature of a plan: choices, events, and homotopy classes of paths.

    Args:
        options: options by choice.
        events: events by requirement and agents.
        swept: angle that each agent sweeps about each of ``parts``, radians, (agents, parts).
    """

    mission: Mission
    options: Mapping[ChoicePoint, Options]
    events: Mapping[ChoicePoint, Event]
    parts: tuple[StandingPart, ...]
    swept: Array

    @property
    def pairs(self) -> list[tuple[Event, Event]]:
        """Pairs of events with a common agent, each in the order in which they occur."""
        ordered = [
            (one, other) if one.before(other) else (other, one)
            for one, other in combinations(self.events.values(), 2)
            if one.agents & other.agents and (one.before(other) or other.before(one))
        ]
        return ordered


class Signatures:
    """Computes the signatures of a mission's plans."""

    def __init__(self, mission: Mission, kernel: Kernel) -> None:
        self.mission = mission
        self.parts = standing_parts(mission)
        formulas = [goal.formula for goal in kernel.requirements]
        self.about = about_whom(formulas, len(mission.agents))
        self.relevant = dict(relevance(formulas, len(mission.agents), mission.steps))
        self.choices: dict[ChoicePoint, str] = {}
        self.kept: dict[ChoicePoint, Node] = {}
        self.awaited: dict[ChoicePoint, str] = {}
        for goal in kernel.requirements:
            for asked in made_once(goal.formula):
                if parts := branches(asked):
                    self.choices.setdefault(asked, goal.name)
                    self.kept |= {each: kept(each) for each in (asked, *parts)}
                if asked.once and awaited(asked.node) is not None and len(self.awaited) < MOST_EVENTS:
                    self.awaited.setdefault(asked, goal.name)

    def of(self, trace: Trace) -> Signature:
        """The signature of a plan."""
        nodes = {*self.kept.values(), *map(_body, self.awaited)}
        true = truths(nodes, self.mission, trace)
        options: dict[ChoicePoint, Options] = {}
        for asked, name in self.choices.items():
            here = true[self.kept[asked]][asked.agent] & self._begun(asked)
            numbers = frozenset(
                number
                for number, part in enumerate(branches(asked))
                if bool((true[self.kept[part]][part.agent] & here).any())
            )
            if len(numbers) >= witnesses(asked):
                options[asked] = Options(name, asked, numbers)
        events: dict[ChoicePoint, Event] = {}
        for asked, name in self.awaited.items():
            body = _body(asked)
            relevant = self.relevant[body][asked.agent]
            steps = true[body][asked.agent] & relevant
            whom = np.flatnonzero(self.about[body][:, asked.agent])
            if steps.any():
                events[asked] = Event(
                    name, asked, body, steps, int(np.flatnonzero(relevant)[-1]), frozenset(whom.tolist())
                )
        return Signature(self.mission, options, events, self.parts, swept_angles(self.parts, trace.position))

    def _begun(self, asked: ChoicePoint) -> Flags:
        """Flags of the steps at which a choice's body must hold over its complete window, (steps + 1,)."""
        matters, last = self.relevant[asked.node][asked.agent], self.mission.steps
        first = np.arange(last + 1) + asked.low
        end = np.full_like(first, last) if asked.high is None else first - asked.low + asked.high
        within = (first <= last) & (end <= last)
        return np.asarray(within & matters[np.minimum(first, last)] & matters[np.minimum(end, last)])


def differences(one: Signature, other: Signature) -> tuple[str, ...]:
    """Sentences that describe how the other plan differs from the first one; empty for equal signatures."""
    return (*_options(one, other), *_orders(one, other), *_sides(one, other))


def _options(one: Signature, other: Signature) -> list[str]:
    said: list[str] = []
    for asked, mine in one.options.items():
        its = other.options.get(asked)
        if its is not None and len(mine.true & its.true) < witnesses(asked):
            new, old = (_branches(one.mission, asked, true) for true in (its.true - mine.true, mine.true - its.true))
            said.append(f"`{mine.requirement}` by {new} instead of {old}")
    return list(dict.fromkeys(said))


def _orders(one: Signature, other: Signature) -> list[str]:
    said: list[str] = []
    for first, second in one.pairs:
        early, late = other.events.get(first.asked), other.events.get(second.asked)
        if early is not None and late is not None and late.before(early):
            both = [one.mission.agents[agent].name for agent in sorted(first.agents & second.agents)]
            said.append(f"{_several(both)}: {_event(second)} before {_event(first)}")
    return list(dict.fromkeys(said))


def _sides(one: Signature, other: Signature) -> list[str]:
    said: list[str] = []
    more = other.swept - one.swept
    for number, part in enumerate(one.parts):
        for sign in (1, -1):
            names = [one.mission.agents[agent].name for agent in np.flatnonzero(sign * more[:, number] > TURN).tolist()]
            if names:
                side = ("left", "right") if sign > 0 else ("right", "left")
                whose = "its" if len(names) == 1 else "their"
                said.append(f"{_several(names)}: `{part.name}` on {whose} {side[0]} instead of {side[1]}")
    return said


def _body(asked: ChoicePoint) -> Node:
    ask = awaited(asked.node)
    assert ask is not None
    return ask.node


def _event(event: Event) -> str:
    """The event quoted from the mission's text, or the name of its requirement if it has no text."""
    return f"`{_words(event.body) or event.requirement}`"


def _branches(mission: Mission, asked: ChoicePoint, numbers: frozenset[int]) -> str:
    """Text for branches of a choice: names of agents if each branch is a different agent, else quoted formulas."""
    parts = [branches(asked)[number].node for number in sorted(numbers)]
    if all(isinstance(part, At) for part in parts):
        names = [mission.agents[part.agent].name for part in parts if isinstance(part, At)]
        if len(set(names)) == len(names):
            return _several(names)
    words = [_words(part) or f"its option {number + 1}" for part, number in zip(parts, sorted(numbers), strict=True)]
    return _several([f"`{each}`" for each in dict.fromkeys(words)])


def _words(node: Node) -> str:
    """Source text of a formula; for a shared formula, the source text of its first part."""
    while node.span is None and children(node):
        node = children(node)[0]
    return " ".join(node.span.text.split()) if node.span is not None else ""


def _several(names: list[str]) -> str:
    """Text for a list of names, such as ``a, b and 2 more``."""
    if len(names) > NAMED:
        return f"{', '.join(names[: NAMED - 1])} and {len(names) - NAMED + 1} more"
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)

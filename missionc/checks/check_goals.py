"""Reachability of goals: those that no agent can reach in the time at its top speed.

    says MC509

The straight line to the goal is the shortest way there is, so nothing is said
of a mission that some plan satisfies.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from missionc.base.late_dataclass import dataclass
from missionc.base.source import Span
from missionc.checks.free_space import FreeSpace
from missionc.checks.literals import Literal, Unbounded
from missionc.checks.necessary_conditions import Fact, NecessaryConditions
from missionc.diagnostics.code import TOO_FAR
from missionc.diagnostics.model import Diagnostic, Label
from missionc.ir import Agent, Anywhere, Exactly, Mission, Region
from missionc.ir.wording import listed, metres, seconds, speed
from missionc.kernel.nodes import Kernel
from missionc.syntax.tokens import MOST_FINDINGS
from missionc.world.area import MANY, SURE, Area
from missionc.world.configuration_space import disjoint, empty

ROUNDING = 1e-9


@dataclass(frozen=True, slots=True)
class Journey:
    """An agent that is at least ``distance`` metres from where it has to be."""

    agent: Agent
    distance: float


def check_goals(mission: Mission, kernel: Kernel, ground: FreeSpace) -> list[Diagnostic]:
    """Finishes out of reach of their starts, and requirements out of reach of theirs."""
    return [*_finishes(mission, ground), *_requirements(mission, kernel, ground)]


def _finishes(mission: Mission, ground: FreeSpace) -> list[Diagnostic]:
    by_place: dict[Span, list[Agent]] = {}
    for agent in mission.agents:
        if agent.finish is not None:
            by_place.setdefault(agent.finish.span, []).append(agent)
    findings = []
    for span, agents in by_place.items():
        late = _late_to_finish(ground, agents)
        if late:
            findings.append(_finish_too_far(mission, span, late))
    return findings


def _late_to_finish(ground: FreeSpace, agents: list[Agent]) -> list[Journey]:
    """From the start to the finish of each agent that cannot be there in time."""
    finish, steps = agents[0].finish, ground.mission.steps
    if isinstance(finish, Anywhere):
        return _late(ground, agents, ground.atlas.outer(finish.region.shape), steps)
    late: list[Journey] = []
    for agent in agents:
        if isinstance(agent.finish, Exactly):
            if isinstance(agent.start, Exactly):
                journey = Journey(agent, math.dist(agent.start.point, agent.finish.point))
                late.extend([journey] if journey.distance > _reach(ground.mission, agent, steps) else [])
            else:
                late.extend(_late(ground, [agent], ground.atlas.point(agent.finish.point), steps))
    return late


def _requirements(mission: Mission, kernel: Kernel, ground: FreeSpace) -> list[Diagnostic]:
    if not mission.agents:
        return []
    places, necessary = ground.places(mission.agents), NecessaryConditions.of(mission, kernel)
    findings: list[Diagnostic] = []
    for requirement in kernel.requirements:
        if len(findings) >= MOST_FINDINGS:
            break
        seen: set[tuple[Literal, int]] = set()
        for fact in sorted(necessary.of_requirement(requirement.formula).facts, key=lambda fact: fact.when.high):
            if fact.when.high == 0:
                continue  # a contradiction with the start
            area = places.rule(fact.literal).within
            about = fact.literal, fact.who.bits
            if isinstance(area, Unbounded) or not fact.who.agents or about in seen:
                continue
            if empty(area) or disjoint(area, ground.atlas.whole()):
                continue
            agents = [mission.agents[index] for index in fact.who.agents]
            late = _late(ground, agents, area, fact.when.high)
            if len(agents) - len(late) < fact.who.number:
                seen.add(about)
                findings.append(_too_far(mission, fact, late, len(agents)))
    return findings


def _late(ground: FreeSpace, agents: Sequence[Agent], goal: Area, steps: int) -> list[Journey]:
    """The agents that cannot be at a goal within so many steps, with how far, at least, each starts from it."""
    mission = ground.mission
    if len(agents) <= MANY:
        agents = [agent for agent in agents if not _in_time(ground, agent, goal, _reach(mission, agent, steps))]
    return [
        journey
        for journey in journeys(ground, agents, goal)
        if journey.distance > _reach(mission, journey.agent, steps)
    ]


def _in_time(ground: FreeSpace, agent: Agent, goal: Area, reach: float) -> bool:
    """Whether the goal is surely no further than ``reach`` metres from where the agent is, or may be, at the start."""
    if isinstance(agent.start, Exactly):
        return goal.depth(agent.start.point) > SURE - reach
    return ground.atlas.outer(agent.start.region.shape).witness(lambda place: goal.depth(place) + reach)


def journeys(ground: FreeSpace, agents: Sequence[Agent], goal: Area) -> list[Journey]:
    """How far, at least, each agent starts from a goal."""
    exact = [(agent, agent.start.point) for agent in agents if isinstance(agent.start, Exactly)]
    by_agent = {}
    if exact:
        distances = ground.atlas.distances([point for _, point in exact], goal)
        by_agent = {agent.index: distance for (agent, _), distance in zip(exact, distances, strict=True)}
    by_region: dict[Region, float] = {}
    for agent in agents:
        if isinstance(agent.start, Anywhere):
            region = agent.start.region
            if region not in by_region:
                by_region[region] = ground.atlas.distance(ground.atlas.outer(region.shape), goal)
            by_agent[agent.index] = by_region[region]
    return [Journey(agent, by_agent[agent.index]) for agent in agents if math.isfinite(by_agent[agent.index])]


def _reach(mission: Mission, agent: Agent, steps: int) -> float:
    """How far an agent gets in so many steps, metres."""
    return agent.dynamics.top_speed * steps * mission.step * (1 + ROUNDING) + ROUNDING


# ------------------------------------------------------------------ messages


def _needs(mission: Mission, journey: Journey) -> str:
    fastest = journey.agent.dynamics.top_speed
    if fastest <= 0:
        return f"it is {metres(journey.distance)} away and does not move"
    steps = math.ceil(journey.distance / fastest / mission.step - ROUNDING)
    return f"{metres(journey.distance)} away, which takes {seconds(mission, steps)} at {speed(fastest)}"


def _others(late: list[Journey]) -> tuple[str, ...]:
    names = [f"`{journey.agent.name}`" for journey in late[1:]]
    return (f"neither can {listed(names)}",) if names else ()


def _finish_too_far(mission: Mission, span: Span, late: list[Journey]) -> Diagnostic:
    agent = late[0].agent
    return Diagnostic(
        TOO_FAR,
        f"`{agent.name}` cannot reach its finish by {seconds(mission, mission.steps)}",
        Label(span, _needs(mission, late[0])),
        (Label(agent.start.span, "from here"),),
        _others(late),
        "lengthen the horizon, raise the top speed, or move the finish nearer",
    )


def _too_far(mission: Mission, fact: Fact, late: list[Journey], agents: int) -> Diagnostic:
    nearest = min(late, key=lambda journey: journey.distance)
    words = " ".join(fact.span.text.split())
    goal = f"be in `{words}`" if words.isidentifier() else f"satisfy `{words}`"
    by = f"by {seconds(mission, fact.when.high)}"
    if fact.who.number == agents or agents == 1:
        nearest = late[0]
        who = f"`{nearest.agent.name}` cannot"
        notes = _others(late)
    elif len(late) == agents:
        who, notes = f"no agent of {_of(fact)} can", (f"`{nearest.agent.name}` is the nearest",)
    else:
        who, notes = f"only {agents - len(late)} of the {agents} agents of {_of(fact)} can", ()
    return Diagnostic(
        TOO_FAR,
        f"{who} {goal} {by}",
        Label(fact.span, _needs(mission, nearest)),
        (Label(nearest.agent.start.span, "from here, on a straight line"),),
        notes,
        "give it more time, raise the top speed, or start nearer",
    )


def _of(fact: Fact) -> str:
    return fact.who.words[fact.who.words.index("`") :]

"""Goals that no agent can reach in the time at its top speed.

    says MC509

The straight line to the goal is the shortest way there is, so nothing is said
of a mission that some plan satisfies.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from missionc.base.source import Span
from missionc.checks.free_space import Ground
from missionc.checks.literals import Literal, Unbounded
from missionc.checks.necessary_conditions import Fact, gather
from missionc.diagnostics.code import TOO_FAR
from missionc.diagnostics.model import Diagnostic, Label
from missionc.ir import Agent, Anywhere, Exactly, Mission, Region, top_speed
from missionc.ir.wording import (
    listed,
    metres,
    seconds,
    speed,
)
from missionc.syntax.tokens import MOST_FINDINGS
from missionc.world.configuration_space import (
    Area,
    disjoint,
    empty,
)
from missionc.world.placement_conflicts import as_array

ROUNDING = 1e-9


@dataclass(frozen=True, slots=True)
class Journey:
    """An agent that is at least ``distance`` metres from where it has to be."""

    agent: Agent
    distance: float


def check_goals(mission: Mission, ground: Ground) -> list[Diagnostic]:
    """Finishes out of reach of their starts, and requirements out of reach of theirs."""
    return [*_finishes(mission, ground), *_requirements(mission, ground)]


def _finishes(mission: Mission, ground: Ground) -> list[Diagnostic]:
    by_place: dict[Span, list[Agent]] = {}
    for agent in mission.agents:
        if agent.finish is not None:
            by_place.setdefault(agent.finish.span, []).append(agent)
    findings = []
    for span, agents in by_place.items():
        late = [journey for journey in _journeys_to_finish(ground, agents) if _late(mission, journey, mission.steps)]
        if late:
            findings.append(_finish_too_far(mission, span, late))
    return findings


def _journeys_to_finish(ground: Ground, agents: list[Agent]) -> list[Journey]:
    """From each agent's start to its finish."""
    finish = agents[0].finish
    if isinstance(finish, Anywhere):
        return _journeys(ground, agents, ground.atlas.outer(finish.region.shape))
    journeys = []
    for agent in agents:
        if isinstance(agent.finish, Exactly):
            if isinstance(agent.start, Exactly):
                journeys.append(Journey(agent, math.dist(agent.start.point, agent.finish.point)))
            else:
                journeys.extend(_journeys(ground, [agent], ground.atlas.point(agent.finish.point)))
    return journeys


def _requirements(mission: Mission, ground: Ground) -> list[Diagnostic]:
    if not mission.agents:
        return []
    places = ground.places(mission.agents)
    findings: list[Diagnostic] = []
    for requirement in mission.requirements:
        if len(findings) >= MOST_FINDINGS:
            break
        seen: set[tuple[Literal, int]] = set()
        for fact in sorted(gather(mission, requirement.formula).facts, key=lambda fact: fact.when.high):
            if fact.when.high == 0:
                continue  # a contradiction with the start
            area = places.rule(fact.literal).within
            about = fact.literal, fact.who.bits
            if isinstance(area, Unbounded) or not fact.who.agents or about in seen:
                continue
            if empty(area) or disjoint(area, ground.atlas.whole()):
                continue
            agents = [mission.agents[index] for index in fact.who.agents]
            journeys = _journeys(ground, agents, area)
            late = [journey for journey in journeys if _late(mission, journey, fact.when.high)]
            if len(agents) - len(late) < fact.who.number:
                seen.add(about)
                findings.append(_too_far(mission, fact, late, len(agents)))
    return findings


def _journeys(ground: Ground, agents: Sequence[Agent], goal: Area) -> list[Journey]:
    """How far, at least, each agent starts from a goal."""
    exact = [(agent, agent.start.point) for agent in agents if isinstance(agent.start, Exactly)]
    found = {}
    if exact:
        distances = ground.atlas.distances(as_array([point for _, point in exact]), goal)
        found = {agent.index: float(distance) for (agent, _), distance in zip(exact, distances, strict=True)}
    by_region: dict[Region, float] = {}
    for agent in agents:
        if isinstance(agent.start, Anywhere):
            region = agent.start.region
            if region not in by_region:
                by_region[region] = ground.atlas.distance(ground.atlas.outer(region.shape), goal)
            found[agent.index] = by_region[region]
    return [Journey(agent, found[agent.index]) for agent in agents if math.isfinite(found[agent.index])]


def _late(mission: Mission, journey: Journey, steps: int) -> bool:
    reach = top_speed(journey.agent.dynamics) * steps * mission.step
    return journey.distance > reach * (1 + ROUNDING) + ROUNDING


# ------------------------------------------------------------------ messages


def _needs(mission: Mission, journey: Journey) -> str:
    fastest = top_speed(journey.agent.dynamics)
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

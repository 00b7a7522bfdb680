"""Reachability of goals: goals too far to reach in time at maximum speed, and goals behind too narrow passages.

    says MC509 MC551

The shortest path to the goal, straight or around the static obstacles, is a lower bound, so a satisfiable mission gets
no finding.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from missionc.base.diagnostics.code import BARRED, TOO_FAR
from missionc.base.diagnostics.model import Diagnostic, Label
from missionc.base.late_dataclass import Record
from missionc.base.source import Span
from missionc.frontend.checks.free_space import FreeSpace
from missionc.frontend.checks.literals import Literal, Unbounded
from missionc.frontend.checks.necessary_conditions import Fact, NecessaryConditions
from missionc.frontend.checks.path_bounds import ROUNDING, reach
from missionc.frontend.syntax.tokens import MOST_FINDINGS
from missionc.geometry.configuration_space import MANY, SURE, Area, disjoint, empty
from missionc.ir import Agent, Mission
from missionc.ir.agents import ends_by_region
from missionc.ir.kernel.nodes import Kernel
from missionc.ir.wording import listed, metres, seconds, speed

THIN = 1e-3
"""Minimum width of a passage, metres."""

WIDEN = "widen a passage"


class Journey(Record):
    """Distance of an agent's start from a region or point that it must reach: at least ``distance`` metres.

    Args:
        bent: True if the shortest path leads around obstacles.
        passage: width in metres that the widest passage leaves for a centre, if it is too narrow.
    """

    agent: Agent
    distance: float
    bent: bool = False
    passage: float = 0.0

    @property
    def barred(self) -> bool:
        """True if there is no path to the goal at all."""
        return math.isinf(self.distance)


def check_goals(mission: Mission, kernel: Kernel, ground: FreeSpace) -> list[Diagnostic]:
    """Findings about finishes and requirements that are out of reach of the starts."""
    return [*_finishes(mission, ground), *requirements_out_of_reach(mission, kernel, ground, mission.steps)]


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
    """Journeys from start to finish of the agents that cannot arrive in time."""
    finish, atlas, steps = agents[0].finish, ground.atlas, ground.mission.steps
    if finish is not None and finish.region is not None:
        return _late(ground, agents, atlas.outer(finish.shape), steps)
    return [journey for agent in agents if (journey := _late_to_point(ground, agent, steps))]


def _late_to_point(ground: FreeSpace, agent: Agent, steps: int) -> Journey | None:
    """Journey from the start of an agent to its finish point, or None if it may arrive in time."""
    assert agent.finish is not None
    assert agent.finish.point is not None
    goal, far = agent.finish.point, reach(ground.mission, agent, steps)
    if agent.start.point is not None and (apart := math.dist(agent.start.point, goal)) > far:
        return Journey(agent, apart)
    return next(iter(_late(ground, [agent], ground.atlas.point(goal), steps)), None)


def requirements_out_of_reach(mission: Mission, kernel: Kernel, ground: FreeSpace, last: int) -> list[Diagnostic]:
    """Findings about goals that requirements need up to a step and no agent can reach by then.

    Args:
        last: last step of the mission.
    """
    if not mission.agents:
        return []
    places, necessary = ground.places(mission.agents), NecessaryConditions.of(mission, kernel)
    findings: list[Diagnostic] = []
    for requirement in kernel.requirements:
        if len(findings) >= MOST_FINDINGS:
            break
        seen: set[tuple[Literal, int]] = set()
        for fact in sorted(necessary.of_requirement(requirement.formula).facts, key=lambda fact: fact.when.high):
            if not 0 < fact.when.high <= last:
                continue  # at 0 it is a contradiction with the start
            area = places.rule(fact.literal).within
            about = fact.literal, fact.who.bits
            if isinstance(area, Unbounded) or not fact.who.agents or about in seen:
                continue
            if empty(area) or disjoint(area, ground.atlas.whole()):
                continue
            agents = [mission.agents[index] for index in fact.who.agents]
            missed = _late(ground, agents, area, fact.when.high)
            if len(agents) - len(missed) < fact.who.number:
                seen.add(about)
                findings.append(_too_far(mission, fact, missed, len(agents)))
    return findings


def _late(ground: FreeSpace, agents: Sequence[Agent], goal: Area, steps: int) -> list[Journey]:
    """Journeys of the agents that cannot reach a goal within ``steps``, each with a lower bound on its distance."""
    mission, ways, few, open_ = ground.mission, ground.ways, len(agents) <= MANY, agents
    if few:
        open_ = [agent for agent in agents if not _in_time(ground, agent, goal, reach(mission, agent, steps))]
    missed = {
        journey.agent.index: journey
        for journey in (journeys(ground, open_, goal) if open_ else ())
        if journey.distance > reach(mission, journey.agent, steps)
    }
    others = [agent for agent in agents if agent.index not in missed] if few else ()
    for agent in others:
        start = ways.start(agent)
        way = ways.bent(agent, start, goal, reach(mission, agent, steps))
        if way is not None:
            passage = ways.passage(agent, start, goal) if math.isinf(way.length) else 0.0
            missed[agent.index] = Journey(agent, way.length, True, passage)
    return [missed[agent.index] for agent in agents if agent.index in missed]


def _in_time(ground: FreeSpace, agent: Agent, goal: Area, metres_: float) -> bool:
    """Return whether the goal is certainly within ``metres_`` of the agent's start on a straight line."""
    if agent.start.point is not None:
        return goal.depth(agent.start.point) > SURE - metres_
    return ground.atlas.outer(agent.start.shape).witness(lambda place: goal.depth(place) + metres_)


def journeys(ground: FreeSpace, agents: Sequence[Agent], goal: Area) -> list[Journey]:
    """Lower bound on the distance of each agent's start from a goal."""
    exact = [(agent, agent.start.point) for agent in agents if agent.start.point is not None]
    by_agent = {}
    if exact:
        distances = ground.atlas.distances([point for _, point in exact], goal)
        by_agent = {agent.index: distance for (agent, _), distance in zip(exact, distances, strict=True)}
    for region, there in ends_by_region((agent, agent.start) for agent in agents).items():
        distance = ground.atlas.distance(ground.atlas.outer(region.shape), goal)
        by_agent.update((agent.index, distance) for agent, _ in there)
    return [Journey(agent, by_agent[agent.index]) for agent in agents if math.isfinite(by_agent[agent.index])]


# ------------------------------------------------------------------ messages


def figures(mission: Mission, journey: Journey) -> str:
    """Text on the distance of an agent's start from its goal, and on the time that the agent needs."""
    fastest = journey.agent.dynamics.top_speed
    if journey.barred:
        return _narrow(mission, journey)
    if fastest <= 0:
        return f"the agent is {metres(journey.distance)} away and does not move"
    steps = math.ceil(journey.distance / fastest / mission.step - ROUNDING)
    round_ = " around the obstacles" if journey.bent else ""
    return f"{metres(journey.distance)} away{round_}, which takes {seconds(mission, steps)} at {speed(fastest)}"


def _narrow(mission: Mission, journey: Journey) -> str:
    needed = f"{metres(journey.agent.radius + mission.clearance)}{' with the clearance' if mission.clearance else ''}"
    if journey.passage < THIN:
        return f"obstacles block every path for a radius of {needed}"
    return f"every path passes within {metres(journey.passage)} of an obstacle; the radius is {needed}"


def begins(journey: Journey) -> Label:
    """Label at the start position of a journey, which describes the path."""
    how = "" if journey.barred else ", around the obstacles" if journey.bent else ", on a straight line"
    return Label(journey.agent.start.span, f"path starts here{how}")


def _others(missed: list[Journey]) -> tuple[str, ...]:
    names = [f"`{journey.agent.name}`" for journey in missed[1:]]
    return (f"also {listed(names)}",) if names else ()


def _finish_too_far(mission: Mission, span: Span, missed: list[Journey]) -> Diagnostic:
    first = missed[0]
    return Diagnostic(
        BARRED if first.barred else TOO_FAR,
        f"`{first.agent.name}` cannot reach its finish"
        + ("" if first.barred else f" by {seconds(mission, mission.steps)}"),
        Label(span, figures(mission, first)),
        (Label(first.agent.start.span, "path starts here"),),
        _others(missed),
        WIDEN if first.barred else "lengthen the horizon",
    )


def _too_far(mission: Mission, fact: Fact, missed: list[Journey], agents: int) -> Diagnostic:
    nearest = min(missed, key=lambda journey: journey.distance)
    words = " ".join(fact.span.text.split())
    goal = f"be in `{words}`" if words.isidentifier() else f"satisfy `{words}`"
    if fact.who.number == agents or agents == 1:
        nearest = missed[0]
        who = f"`{nearest.agent.name}` cannot"
        notes = _others(missed)
    elif len(missed) == agents:
        who, notes = f"no agent of {_of(fact)} can", (f"`{nearest.agent.name}` is the nearest",)
    else:
        who, notes = f"only {agents - len(missed)} of the {agents} agents of {_of(fact)} can", ()
    return Diagnostic(
        BARRED if nearest.barred else TOO_FAR,
        f"{who} {goal}" + ("" if nearest.barred else f" by {seconds(mission, fact.when.high)}"),
        Label(fact.span, figures(mission, nearest)),
        (begins(nearest),),
        notes,
        WIDEN if nearest.barred else "allow more time",
    )


def _of(fact: Fact) -> str:
    return fact.who.words[fact.who.words.index("`") :]

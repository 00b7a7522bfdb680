"""Check of resources: agents whose resource is compared have it, and it lasts from each refill to the next goal.

    in   Mission, its Kernel
    out  nothing but findings
    says MC221 MC531

Straight lines at maximum speed are a lower bound on the consumption of any plan, so a satisfiable mission gets no
finding.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from missionc.base.diagnostics.code import NOT_ITS_OWN, RUNS_OUT
from missionc.base.diagnostics.model import Diagnostic, Label
from missionc.base.late_dataclass import Record
from missionc.base.source import Span
from missionc.frontend.checks.check_goals import journeys
from missionc.frontend.checks.free_space import FreeSpace
from missionc.frontend.checks.literals import Unbounded, comparison_literal
from missionc.frontend.checks.necessary_conditions import Fact, NecessaryConditions
from missionc.geometry.configuration_space import Area, empty
from missionc.ir import Agent, Compare, Holds, Level, Mission, Resource
from missionc.ir.kernel.nodes import Kernel
from missionc.ir.language.walk_formulas import asked_agents
from missionc.ir.wording import listed, metres, number, seconds

ROUNDING = 1e-9


class Demand(Record):
    """Requirement that agents keep a minimum level of a resource from the step ``first`` to ``last``."""

    resource: Resource
    least: float
    agents: tuple[Agent, ...]
    first: int
    last: int
    span: Span


def check_resources(mission: Mission, kernel: Kernel, ground: FreeSpace) -> list[Diagnostic]:
    """Findings about comparisons of a resource that an agent lacks, and about resources that must fall below a
    bound.
    """
    if not mission.resources:
        return []
    necessary, findings = NecessaryConditions.of(mission, kernel), [*_strangers(mission)]
    facts = [fact for goal in kernel.requirements for fact in necessary.of_requirement(goal.formula).facts]
    for demand in _demands(mission, facts):
        found = _runs_out(mission, ground, demand) or _too_far(mission, ground, demand, facts)
        findings.extend([found] if found else [])
    return findings


def _strangers(mission: Mission) -> Iterator[Diagnostic]:
    """Yield a finding for each comparison that is evaluated for agents without the resource."""
    said: set[tuple[Span, Resource]] = set()
    for formula, agents in asked_agents(mission):
        match formula:
            case Holds(Compare(terms=terms), span):
                for resource in (each.resource for _, each in terms if isinstance(each, Level)):
                    lacking = [mission.agents[agent].name for agent in agents if agent not in resource.agents]
                    if lacking and (span, resource) not in said:
                        said.add((span, resource))
                        yield _not_its_own(resource, span, lacking)
            case _:
                pass


def _demands(mission: Mission, facts: Sequence[Fact]) -> Iterator[Demand]:
    for fact in facts:
        inequality = comparison_literal(fact.literal)
        if isinstance(inequality, Unbounded) or fact.when.low != fact.when.high:
            continue
        match inequality.terms:
            case ((weight, Level(resource)),) if weight > 0 and fact.who.number == len(fact.who.agents):
                agents = tuple(mission.agents[each] for each in fact.who.agents if each in resource.agents)
                first, last = fact.when.low, min(fact.when.low + fact.when.repeats, mission.steps)
                if agents:
                    yield Demand(resource, -inequality.constant / weight, agents, first, last, fact.span)
            case _:
                pass


def _runs_out(mission: Mission, ground: FreeSpace, demand: Demand) -> Diagnostic | None:
    """Finding if no agent reaches a refill before the drain over time uses up the resource; else None."""
    resource, spare = demand.resource, demand.resource.start - demand.least
    used = resource.per_second * mission.step
    step = max(demand.first, math.floor(spare / used + ROUNDING) + 1) if used > 0 else mission.steps + 1
    if step > demand.last:
        return None
    areas = [ground.atlas.outer(refill.region.shape) for refill in resource.refills if refill.per_second > 0]
    for agent in demand.agents:
        nearest = min((_distance(ground, agent, area) for area in areas), default=math.inf)
        late = nearest > agent.dynamics.top_speed * step * mission.step * (1 + ROUNDING) + ROUNDING
        short = demand.first == 0 and _used(resource, agent, nearest) > spare + ROUNDING
        if not areas or late or short:
            return _empty_too_soon(mission, demand, agent, step, nearest)
    return None


def _too_far(mission: Mission, ground: FreeSpace, demand: Demand, facts: Sequence[Fact]) -> Diagnostic | None:
    """Finding if an agent must be in a region that it can reach neither with its initial nor with a full resource.

    None otherwise.
    """
    places, resource = ground.places(mission.agents), demand.resource
    sources = [ground.atlas.outer(refill.region.shape) for refill in resource.refills if refill.per_second > 0]
    for fact in facts:
        area = places.rule(fact.literal).within
        needed = [agent for agent in demand.agents if agent.index in fact.who.agents]
        throughout = demand.first == 0 and fact.when.high <= demand.last
        if isinstance(area, Unbounded) or empty(area) or not throughout or fact.who.number < len(fact.who.agents):
            continue
        filled = min((ground.atlas.distance(source, area) for source in sources), default=math.inf)
        for agent in needed:
            begun = _distance(ground, agent, area)
            enough = _used(resource, agent, begun) <= resource.start - demand.least + ROUNDING
            if not enough and _used(resource, agent, filled) > resource.capacity - demand.least + ROUNDING:
                return _does_not_last(demand, agent, fact, min(begun, filled))
    return None


def _distance(ground: FreeSpace, agent: Agent, area: Area) -> float:
    """Lower bound on the distance from the agent's start to an area, metres."""
    found = journeys(ground, [agent], area)
    return found[0].distance if found else 0.0


def _used(resource: Resource, agent: Agent, distance: float) -> float:
    """Lower bound on the consumption of a resource over ``distance`` metres."""
    if distance == 0 or not math.isfinite(distance):
        return 0.0 if distance == 0 else math.inf
    fastest = agent.dynamics.top_speed
    lasting = resource.per_second * distance / fastest if fastest > 0 else math.inf
    return lasting * (1 - ROUNDING) + resource.per_metre * distance


# ------------------------------------------------------------------ messages


def _not_its_own(resource: Resource, span: Span, lacking: Sequence[str]) -> Diagnostic:
    verb = "does" if len(lacking) == 1 else "do"
    return Diagnostic(
        NOT_ITS_OWN,
        f"{listed([f'`{name}`' for name in lacking])} {verb} not have `{resource.name}`",
        Label(span, "used here"),
        (Label(resource.span, "declared for other agents"),),
        help=f"declare `{resource.name}` for these agents",
    )


def _empty_too_soon(mission: Mission, demand: Demand, agent: Agent, step: int, nearest: float) -> Diagnostic:
    resource = demand.resource
    filled = "no refill" if not resource.refills else f"nearest refill {metres(nearest)} away"
    return Diagnostic(
        RUNS_OUT,
        f"`{resource.name}` of `{agent.name}` is below {number(demand.least)} at {seconds(mission, step)},"
        " before a refill is possible",
        Label(
            demand.span, f"{number(resource.start)} at the start, minus {number(resource.per_second)} per s; {filled}"
        ),
        (Label(resource.span, "declared here"), Label(agent.start.span, "start position")),
        help="increase the start level",
    )


def _does_not_last(demand: Demand, agent: Agent, fact: Fact, distance: float) -> Diagnostic:
    resource, words = demand.resource, " ".join(fact.span.text.split())
    used, most = _used(resource, agent, distance), max(resource.start, resource.capacity) - demand.least
    return Diagnostic(
        RUNS_OUT,
        f"`{resource.name}` is not enough for `{agent.name}` to reach `{words}`",
        Label(fact.span, f"at least {metres(distance)} away, which uses {number(round(used, 4))}"),
        (Label(demand.span, f"at most {number(round(most, 4))} available"), Label(resource.span, "declared here")),
        help="increase the capacity",
    )

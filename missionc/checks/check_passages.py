"""Check of passages: formations that have to be kept on a way that leads through none wide enough.

    in   Mission, its Kernel, the FreeSpace
    out  nothing but findings
    says MC556

A formation is kept from the first step on, throughout a window or up to the end of an `until`, and its agents have to
be somewhere by then. What is needed is taken from what every plan has to satisfy, so that nothing is said of a choice.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from missionc.base.late_dataclass import dataclass
from missionc.base.source import Span
from missionc.checks.causes import Causes
from missionc.checks.formation_room import parted
from missionc.checks.free_space import FreeSpace
from missionc.checks.literals import Unbounded
from missionc.checks.may_analysis import MayAnalysis, telling
from missionc.checks.necessary_conditions import Fact, NecessaryConditions
from missionc.diagnostics.code import STUCK
from missionc.diagnostics.model import Diagnostic, Label
from missionc.ir import Formation, Mission
from missionc.kernel.conjuncts import conjuncts
from missionc.kernel.nodes import All, Atom, Goal, Kernel, Node, Until
from missionc.world.area import Area

MOST_WAYS = 20
"""Ways that are looked for; of more nothing is said."""


@dataclass(frozen=True, slots=True)
class Convoy:
    """A formation that is kept from the first step on, and where its agents have to be while it is, or a step later.

    Args:
        steps: from the last step at which it is kept to that at which they are there.
    """

    formation: Formation
    kept: Span
    goal: Mapping[int, Area]
    there: Span
    steps: int


def check_passages(mission: Mission, kernel: Kernel, ground: FreeSpace) -> list[Diagnostic]:
    """One finding for each formation that does not get through to where it is asked to be."""
    if mission.dimension != 2 or not mission.formations or not ground.ways.shapes:
        return []
    findings, said = list[Diagnostic](), set[Formation]()
    for number, convoy in enumerate((*_throughout(mission, kernel, ground), *_up_to_there(kernel, ground))):
        if number >= MOST_WAYS:
            break
        if convoy.formation not in said and (figure := _figure(mission, ground, convoy)) is not None:
            said.add(convoy.formation)
            findings.append(_stuck(convoy, figure))
    return findings


def _figure(mission: Mission, ground: FreeSpace, convoy: Convoy) -> str | None:
    agents = [mission.agents[agent] for agent in convoy.formation.agents]
    start = {agent.index: ground.ways.start(agent) for agent in agents}
    grown = max(agent.dynamics.top_speed for agent in agents) * mission.step * convoy.steps
    return parted(ground, convoy.formation, start, convoy.goal, grown * (1 + 1e-9) + 1e-9 * convoy.steps)


def _throughout(mission: Mission, kernel: Kernel, ground: FreeSpace) -> Iterator[Convoy]:
    """Formations of an `always` from the first step on, and where one of their agents has to be within its window."""
    necessary, places = NecessaryConditions.of(mission, kernel), ground.places(mission.agents)
    facts = [fact for goal in kernel.requirements for fact in necessary.of_requirement(goal.formula).facts]
    for kept in facts:
        formation, when = kept.literal.predicate.formation, kept.when
        if formation is None or not kept.literal.positive or (when.low, when.high) != (0, 0):
            continue
        for fact in facts:
            area = places.rule(fact.literal).within
            within = fact.when.high <= when.repeats
            if within and _of_each(fact) and not isinstance(area, Unbounded):
                for agent in fact.who.agents:
                    if agent in formation.agents:
                        yield Convoy(formation, kept.span, {agent: area}, fact.span, 0)


def _of_each(fact: Fact) -> bool:
    return fact.literal.predicate.formation is None and 0 < fact.who.number == len(fact.who.agents)


def _up_to_there(kernel: Kernel, ground: FreeSpace) -> Iterator[Convoy]:
    """Formations that an `until` asks for up to where its right side has their agents."""
    for goal in kernel.requirements:
        for conjunct in conjuncts((goal.formula,)):
            node = conjunct.formula
            if isinstance(node, Until) and not conjunct.windows and node.low >= 0:
                yield from _of_until(goal, node, ground)


def _of_until(goal: Goal, node: Until, ground: FreeSpace) -> Iterator[Convoy]:
    kept = [part for part in _parts(node.hold) if isinstance(part, Atom) and part.predicate.formation is not None]
    if not kept:
        return
    causes = Causes(ground)
    value = MayAnalysis(causes, goal.formula, telling((goal.formula,))).known.get(node.end)
    for part in kept:
        formation = part.predicate.formation if isinstance(part, Atom) else None
        there = {} if value is None or formation is None else value.others
        ends = {agent: causes.common(areas) for agent, areas in there.items() if areas}
        if formation is not None and any(agent in formation.agents for agent in ends):
            yield Convoy(formation, part.span or goal.span, ends, node.end.span or goal.span, 1)


def _parts(node: Node) -> tuple[Node, ...]:
    return node.parts if isinstance(node, All) else (node,)


# ------------------------------------------------------------------ messages


def _stuck(convoy: Convoy, figure: str) -> Diagnostic:
    words = " ".join(convoy.there.text.split())
    return Diagnostic(
        STUCK,
        f"formation `{convoy.formation.name}` fits through no passage to `{words}`",
        Label(convoy.kept, figure),
        (Label(convoy.there, "where its agents have to be"), Label(convoy.formation.span, "declared here")),
        help="widen a passage, let the formation be left on the way, or make it smaller",
    )

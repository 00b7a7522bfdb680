"""Contradictions of necessary facts: of two requirements, of one, of a requirement and a start or finish.

    says MC510

A contradiction is two facts that every plan would have to have, of the same
agent at the same step. Nothing is said without such a proof, so much that is
impossible is left to the solver.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import field

from missionc.base.late_dataclass import dataclass
from missionc.checks.literals import MOST_RULES, Literal, Places, Rule, Unbounded, exclude
from missionc.checks.necessary_conditions import (
    THE_TEAM,
    Fact,
    Instant,
    Necessary,
    NecessaryConditions,
    When,
    meeting,
    same_step,
)
from missionc.diagnostics.code import CONTRADICTION
from missionc.diagnostics.model import Diagnostic, Label
from missionc.ir import Agent, Exactly, Inside, Mission, Place, Region, Vector
from missionc.ir.wording import listed, seconds
from missionc.kernel.nodes import Goal


@dataclass(frozen=True, slots=True)
class Asked:
    """A fact, the requirement that rests on it, and where it lets an agent be."""

    requirement: Goal
    fact: Fact
    rule: Rule


def contradictions(
    mission: Mission, places: Places, necessary: NecessaryConditions, requirements: list[Goal]
) -> Iterator[Diagnostic]:
    """One finding for each requirement, or pair of them, that no plan can satisfy."""
    facts: list[Asked] = []
    instants: dict[Instant, Goal] = {}
    for requirement in requirements:
        gathered = necessary.of_requirement(requirement.formula)
        facts.extend(_asked(requirement, gathered, places))
        for instant in gathered.instants:
            instants.setdefault(instant, requirement)
    reported: set[frozenset[Goal]] = set()
    for one, other, steps in _clashes(facts):
        pair = frozenset((one.requirement, other.requirement))
        if pair not in reported:
            reported.add(pair)
            yield _clash(mission, one, other, steps)
    yield from _impossible_instants(places, necessary, instants, reported)
    ends = Ends(mission)
    for entry in facts:
        alone = frozenset((entry.requirement,))
        if alone not in reported:
            for finding in _against_places(ends, places, entry):
                reported.add(alone)
                yield finding


def _asked(requirement: Goal, gathered: Necessary, places: Places) -> Iterator[Asked]:
    return (Asked(requirement, fact, places.rule(fact.literal)) for fact in gathered.facts)


def _clashes(facts: list[Asked]) -> Iterator[tuple[Asked, Asked, tuple[int, int]]]:
    """Pairs of facts that no plan can have both, in the order of the text; of many, a predicate with its negation."""
    before: dict[Literal, list[Asked]] = {}
    for number, entry in enumerate(facts):
        others = facts[:number] if number < MOST_RULES else before.get(entry.fact.literal.opposite, [])[:MOST_RULES]
        for other in others:
            if entry.rule is other.rule:
                continue
            steps = meeting(entry.fact, other.fact)
            if steps is not None and exclude(other.rule, entry.rule):
                yield other, entry, steps
        before.setdefault(entry.fact.literal, []).append(entry)


def _impossible_instants(
    places: Places, necessary: NecessaryConditions, instants: dict[Instant, Goal], reported: set[frozenset[Goal]]
) -> Iterator[Diagnostic]:
    """Formulas that have to hold at some step, and cannot at any."""
    queue = list(instants)
    for instant in queue:
        requirement = instants[instant]
        if frozenset((requirement,)) in reported:
            continue
        gathered = necessary.of_instant(instant)
        for further in gathered.instants:
            if further not in instants:
                instants[further] = requirement
                queue.append(further)
        for one, other, _ in _clashes(list(_asked(requirement, gathered, places))):
            reported.add(frozenset((requirement,)))
            yield _clash_at_once(one, other)
            break


# --------------------------------------------------------- starts and finishes


@dataclass(frozen=True, slots=True, eq=False)
class There:
    """Agents and their places at one end of the mission; the other fields have rows of the first.

    Args:
        points: of those that are at a point.
    """

    placed: list[tuple[Agent, Place]]
    exact: list[int]
    points: list[Vector]
    regions: dict[Region, list[int]]


@dataclass(frozen=True, slots=True, eq=False)
class Ends:
    """Where agents start and finish, looked up once for all facts about the same ones."""

    mission: Mission
    known: dict[tuple[tuple[int, ...], int], There] = field(default_factory=dict)

    def there(self, agents: tuple[int, ...], step: int) -> There:
        """The places of these agents at the first step, or those that have one at the last."""
        if (agents, step) not in self.known:
            self.known[agents, step] = self._there(agents, step)
        return self.known[agents, step]

    def _there(self, agents: tuple[int, ...], step: int) -> There:
        named = [self.mission.agents[index] for index in agents]
        ends = [(agent, agent.start if step == 0 else agent.finish) for agent in named]
        placed = [(agent, place) for agent, place in ends if place is not None]
        points, exact, regions = list[Vector](), list[int](), dict[Region, list[int]]()
        for row, (_, place) in enumerate(placed):
            if isinstance(place, Exactly):
                points.append(place.point)
                exact.append(row)
            else:
                regions.setdefault(place.region, []).append(row)
        return There(placed, exact, points, regions)


def _against_places(ends: Ends, places: Places, entry: Asked) -> Iterator[Diagnostic]:
    """The start, or the finish, that makes a fact of that step impossible."""
    fact, mission = entry.fact, ends.mission
    if not fact.who.agents:
        return
    for step, verb in ((0, "start"), (mission.steps, "finish")):
        if same_step(fact.when, When(step, step, 0)) is None:
            continue
        stuck = _impossible_at(places, fact.literal, ends.there(fact.who.agents, step))
        if len(fact.who.agents) - len(stuck) < fact.who.number:
            yield _against(mission, entry, stuck, verb, step)
            return


def _impossible_at(places: Places, literal: Literal, there: There) -> list[tuple[Agent, Place]]:
    """The agents whose places surely break the literal."""
    rows = [there.exact[point] for point in _impossible_points(places, literal, there.points)]
    for region, within in there.regions.items():
        if exclude(places.rule(Literal(Inside(region, False), True)), places.rule(literal)):
            rows.extend(within)
    return [there.placed[row] for row in sorted(rows)]


def _impossible_points(places: Places, literal: Literal, points: list[Vector]) -> list[int]:
    """Which of the points the literal surely does not hold at."""
    if not points:
        return []
    rule = places.rule(literal)
    broken = [False] * len(points)
    if not isinstance(rule.within, Unbounded):
        broken = [not held for held in places.atlas.holds(rule.within, points)]
    if not isinstance(rule.beyond, Unbounded):
        broken = [lost or held for lost, held in zip(broken, places.atlas.holds(rule.beyond, points), strict=True)]
    return [point for point, lost in enumerate(broken) if lost]


# ------------------------------------------------------------------ messages


def _clash(mission: Mission, one: Asked, other: Asked, steps: tuple[int, int]) -> Diagnostic:
    names = (one.requirement.name, other.requirement.name)
    if one.requirement is other.requirement:
        message = f"requirement `{names[0]}` contradicts itself"
    else:
        message = f"requirements `{names[0]}` and `{names[1]}` contradict each other"
    return Diagnostic(
        CONTRADICTION,
        message,
        Label(other.fact.span, _says(mission, other.fact)),
        (Label(one.fact.span, _says(mission, one.fact)),),
        (f"{_whose(one.fact)}, {_meeting(mission, *steps)}",),
        "drop one of the two, or let their windows or agents differ",
    )


def _clash_at_once(one: Asked, other: Asked) -> Diagnostic:
    return Diagnostic(
        CONTRADICTION,
        f"requirement `{one.requirement.name}` can never hold",
        Label(other.fact.span, f"`{_text(other.fact)}`"),
        (Label(one.fact.span, f"`{_text(one.fact)}`"),),
        (f"{_whose(one.fact)}, at the same step",),
        "drop one of the two, or ask for them at different steps",
    )


def _whose(fact: Fact) -> str:
    one = "the team" if fact.who == THE_TEAM else "one agent"
    return f"both are asked of {one} and exclude each other"


def _meeting(mission: Mission, low: int, high: int) -> str:
    if low == high:
        return f"at {seconds(mission, low)}"
    return f"at some step between {seconds(mission, low)} and {seconds(mission, high)}"


def _against(mission: Mission, entry: Asked, stuck: list[tuple[Agent, Place]], verb: str, step: int) -> Diagnostic:
    (agent, place), verbs = stuck[0], "starts" if verb == "start" else "finishes"
    names = [f"`{agent.name}`" for agent, _ in stuck[1:]]
    return Diagnostic(
        CONTRADICTION,
        f"requirement `{entry.requirement.name}` contradicts where `{agent.name}` {verbs}",
        Label(entry.fact.span, _says(mission, entry.fact)),
        (Label(place.span, f"`{agent.name}` {verbs} here, at {seconds(mission, step)}"),),
        (f"the same goes for {listed(names)}",) if names else (),
        f"{verb} elsewhere, or let the requirement's window leave out {seconds(mission, step)}",
    )


def _text(fact: Fact) -> str:
    words = " ".join(fact.span.text.split())
    if fact.literal.positive:
        return words
    return f"not {words}" if words.replace("_", "a").isalnum() else f"not ({words})"


def _says(mission: Mission, fact: Fact) -> str:
    """``asks `not fire` of every `drone`, from 0 s to 20 s``"""
    of = "" if fact.who == THE_TEAM else f" of {fact.who.words}"
    when = fact.when
    if when.low == when.high:
        span = _steps(mission, when.low, when.low + when.repeats)
    elif when.repeats == 0:
        span = f"at some step {_steps(mission, when.low, when.high)}"
    else:
        span = (
            f"at some step of every {seconds(mission, when.high - when.low)}"
            f" {_steps(mission, when.low, when.high + when.repeats)}"
        )
    return f"asks `{_text(fact)}`{of}, {span}"


def _steps(mission: Mission, low: int, high: int) -> str:
    return f"at {seconds(mission, low)}" if low == high else f"from {seconds(mission, low)} to {seconds(mission, high)}"

"""Check of requirements: contradictions, tautologies, routes without effect, and satisfaction at the first step.

    in   Mission, its Kernel, the FreeSpace
    out  nothing but findings
    says MC307 MC510 MC511 MC514 MC515 MC517 MC521

Every report has a proof, so many impossible requirements are left to the solver. A contradiction is a pair of facts
about the same agent at the same step that every plan would need. They come from one requirement, from two, or from a
requirement and a start or finish.

``eventually[0, 20 s] base`` of a team that starts in ``base`` is satisfied before any agent moves. Only sure facts
about the starts count. Sets of agents are the bits of a number.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import field
from functools import reduce
from itertools import islice
from operator import and_, or_

from missionc import ir
from missionc.base.diagnostics.code import ASKS_NOTHING, CONTRADICTION, NEVER_HOLDS, VACUOUS
from missionc.base.diagnostics.model import Diagnostic, Label, in_text_order
from missionc.base.late_dataclass import Record, dataclass
from missionc.base.source import Span
from missionc.frontend.checks import necessary_conditions
from missionc.frontend.checks.check_routes import check_routes, too_few_agents
from missionc.frontend.checks.free_space import FreeSpace
from missionc.frontend.checks.literals import MOST_RULES, Literal, LiteralPlaces, LiteralRule, Unbounded, exclude
from missionc.frontend.checks.must_analysis import (
    FALSE,
    TRUE,
    MustAnalysis,
    Range,
    must_analysis,
    of_comparison,
    range_in_words,
)
from missionc.frontend.checks.place_margins import Joint, margin_at
from missionc.frontend.syntax.tokens import MOST_FINDINGS
from missionc.geometry import plain_floats
from missionc.geometry.configuration_space import SURE, covers
from missionc.ir.kernel import nodes as k
from missionc.ir.kernel.evaluate import Domain, evaluate
from missionc.ir.kernel.walk import conjuncts, more_than, postorder
from missionc.ir.language.walk_formulas import bits_of, formulas, formulas_bottom_up, goals, operands
from missionc.ir.wording import listed, seconds
from missionc.verification.monitoring.end_columns import MOST_NODES

FEW = 256
"""Maximum number of agents for the check of the first step; larger teams are not checked."""


def check_first_step(
    mission: ir.Mission, undecided: Iterable[tuple[ir.Requirement, k.Goal]], ground: FreeSpace
) -> Iterator[Diagnostic]:
    """Yield a finding for each part of a requirement that every start satisfies before any agent has moved.

    Args:
        undecided: the requirements without another finding, with their meaning.
    """
    if len(mission.agents) > FEW:
        return
    joint = tuple(
        plain_floats.Place(each.start.point) if each.start.point is not None else None for each in mission.agents
    )
    starts = Starts(mission, ground, (1 << len(mission.agents)) - 1, joint)
    for requirement, goal in undecided:
        awaited = _awaited(goal)
        if not awaited or more_than(MOST_NODES, (node for asked in awaited.values() for node, _ in asked)):
            continue
        known = evaluate([node for asked in awaited.values() for node, _ in asked], starts)
        for span, asked in awaited.items():
            if all(known[node] & (starts.everyone if agent is None else 1 << agent) for node, agent in asked):
                yield _asks_nothing(mission, requirement, span, [agent for _, agent in asked])


def _awaited(goal: k.Goal) -> dict[Span, list[tuple[k.Node, int | None]]]:
    """Nodes that wait for an event from the first step on, by their source span, with the agents they are about."""
    awaited: dict[Span, list[tuple[k.Node, int | None]]] = {}
    for conjunct in conjuncts((goal.formula,)):
        node = conjunct.formula
        if not conjunct.windows and any(isinstance(each, k.Eventually | k.Until) for each in postorder((node,))):
            awaited.setdefault(node.span or goal.span, []).append((node, conjunct.agent))
    return awaited


@dataclass(slots=True, eq=False)
class Starts(Domain[int]):
    """Evaluation of formulas at the first step to the bit set of agents for which they certainly hold, for any
    start.
    """

    mission: ir.Mission
    ground: FreeSpace
    everyone: int
    joint: Joint
    """Start position of each agent, None if it is not given as a point."""
    known: dict[tuple[ir.Predicate, bool], int] = field(default_factory=dict)

    def atom(self, predicate: ir.Predicate, holds: bool) -> int:
        if (predicate, holds) not in self.known:
            agents = (agent for agent in self.mission.agents if self._sure(predicate, holds, agent))
            bits = bits_of(tuple(agent.index for agent in agents))
            self.known[predicate, holds] = self.everyone if predicate.about_team and bits else bits
        return self.known[predicate, holds]

    def _sure(self, predicate: ir.Predicate, holds: bool, agent: ir.Agent) -> bool:
        start = agent.start
        if start.region is None:
            if predicate.graph:
                return False
            margin = margin_at(self.mission, predicate, agent, self.joint)
            return margin is not None and (margin > SURE if holds else margin < -SURE)
        if not (holds and isinstance(predicate, ir.Inside)) or predicate.body:
            return False
        atlas = self.ground.atlas
        same = predicate.region.shape == start.region.shape
        return same or covers(atlas.inner(predicate.region.shape), atlas.outer(start.region.shape))

    def member(self, agents: frozenset[int], holds: bool) -> int:
        bits = bits_of(tuple(agents))
        return bits if holds else self.everyone & ~bits

    def path_length(self, node: k.PathLength, holds: bool) -> int:
        return 0

    def meet(self, parts: Sequence[int]) -> int:
        return reduce(and_, parts, self.everyone)

    def join(self, parts: Sequence[int]) -> int:
        return reduce(or_, parts, 0)

    def at_least(self, count: int, parts: Sequence[int]) -> int:
        enough = (agent for agent in self.mission.agents if sum(part >> agent.index & 1 for part in parts) >= count)
        return bits_of(tuple(agent.index for agent in enough))

    def at(self, agent: int, body: int) -> int:
        return self.everyone if body >> agent & 1 else 0

    def window(self, node: k.WindowNode, body: int) -> int:
        here = node.low == 0 and (not node.every or node.high == 0)
        return body if here else 0

    def until(self, node: k.UntilNode, hold: int, end: int) -> int:
        return end if node.low == 0 and (not node.every or node.high == 0) else 0

    def neighbour(self, node: k.NeighbourNode, body: int) -> int:
        return 0

    def reach(self, node: k.ReachNode, through: int, end: int) -> int:
        return 0 if node.every else end

    def route(self, node: k.RouteNode, through: int, end: int) -> int:
        return end if not node.every and node.low <= 0 else 0


# ------------------------------------------------------------------ messages


def _asks_nothing(
    mission: ir.Mission, requirement: ir.Requirement, span: Span, agents: Iterable[int | None]
) -> Diagnostic:
    who = sorted({agent for agent in agents if agent is not None})
    starts = [mission.agents[agent].start.span for agent in who[:1]]
    names = [f"`{mission.agents[agent].name}`" for agent in who]
    return Diagnostic(
        ASKS_NOTHING,
        f"requirement `{requirement.name}` is satisfied at the start already",
        Label(span, f"true at 0 s{f' for {listed(names)}' if names else ''}, for every start position"),
        tuple(Label(start, "start position") for start in starts),
        help="start the window later",
    )


class RequiredFact(Record):
    """Necessary fact with its requirement and the positions that it allows for an agent."""

    requirement: k.Goal
    fact: necessary_conditions.Fact
    rule: LiteralRule


def contradictions(
    mission: ir.Mission,
    places: LiteralPlaces,
    necessary: necessary_conditions.NecessaryConditions,
    requirements: list[k.Goal],
) -> Iterator[Diagnostic]:
    """Yield a finding for each requirement, or pair of requirements, that no plan can satisfy."""
    facts: list[RequiredFact] = []
    instants: dict[necessary_conditions.Instant, k.Goal] = {}
    for requirement in requirements:
        gathered = necessary.of_requirement(requirement.formula)
        facts.extend(_asked(requirement, gathered, places))
        for instant in gathered.instants:
            instants.setdefault(instant, requirement)
    reported: set[frozenset[k.Goal]] = set()
    for one, other, steps in _clashes(facts):
        pair = frozenset((one.requirement, other.requirement))
        if pair not in reported:
            reported.add(pair)
            yield _clash(mission, one, other, steps)
    yield from _impossible_instants(places, necessary, instants, reported)
    ends = RequirementEnds(mission)
    for entry in facts:
        alone = frozenset((entry.requirement,))
        if alone not in reported:
            for finding in _against_places(ends, places, entry):
                reported.add(alone)
                yield finding


def _asked(
    requirement: k.Goal, gathered: necessary_conditions.Necessary, places: LiteralPlaces
) -> Iterator[RequiredFact]:
    return (RequiredFact(requirement, fact, places.rule(fact.literal)) for fact in gathered.facts)


def _clashes(facts: list[RequiredFact]) -> Iterator[tuple[RequiredFact, RequiredFact, tuple[int, int]]]:
    """Yield pairs of facts that exclude each other, in the order of the text.

    If there are many facts, only pairs of a predicate with its negation are found.
    """
    before: dict[Literal, list[RequiredFact]] = {}
    for number, entry in enumerate(facts):
        others = facts[:number] if number < MOST_RULES else before.get(entry.fact.literal.opposite, [])[:MOST_RULES]
        for other in others:
            if entry.rule is other.rule:
                continue
            steps = necessary_conditions.meeting(entry.fact, other.fact)
            if steps is not None and exclude(other.rule, entry.rule):
                yield other, entry, steps
        before.setdefault(entry.fact.literal, []).append(entry)


def _impossible_instants(
    places: LiteralPlaces,
    necessary: necessary_conditions.NecessaryConditions,
    instants: dict[necessary_conditions.Instant, k.Goal],
    reported: set[frozenset[k.Goal]],
) -> Iterator[Diagnostic]:
    """Yield findings about formulas that must hold at some step and cannot hold at any."""
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


class BoundaryPositions(Record, eq=False):
    """Agents and their start regions, or finish regions; the other fields select agents by row in ``placed``.

    Args:
        points: start or finish points of the agents that have one.
    """

    placed: list[tuple[ir.Agent, ir.InitialSet]]
    exact: list[int]
    points: list[ir.Vector]
    regions: dict[ir.Region, list[int]]


class RequirementEnds(Record, eq=False):
    """Starts and finishes of agents, cached for all facts about the same agents."""

    mission: ir.Mission
    known: dict[tuple[tuple[int, ...], int], BoundaryPositions] = field(default_factory=dict)

    def there(self, agents: tuple[int, ...], step: int) -> BoundaryPositions:
        """Starts of these agents at the first step, or finishes of those that have one at the last step."""
        if (agents, step) not in self.known:
            self.known[agents, step] = self._there(agents, step)
        return self.known[agents, step]

    def _there(self, agents: tuple[int, ...], step: int) -> BoundaryPositions:
        named = [self.mission.agents[index] for index in agents]
        ends = [(agent, agent.start if step == 0 else agent.finish) for agent in named]
        placed = [(agent, place) for agent, place in ends if place is not None]
        points, exact, regions = list[ir.Vector](), list[int](), dict[ir.Region, list[int]]()
        for row, (_, place) in enumerate(placed):
            if place.point is not None:
                points.append(place.point)
                exact.append(row)
            elif place.region is not None:
                regions.setdefault(place.region, []).append(row)
        return BoundaryPositions(placed, exact, points, regions)


def _against_places(ends: RequirementEnds, places: LiteralPlaces, entry: RequiredFact) -> Iterator[Diagnostic]:
    """Yield findings about starts or finishes that make a fact about that step impossible."""
    fact, mission = entry.fact, ends.mission
    if not fact.who.agents:
        return
    for step, verb in ((0, "start"), (mission.steps, "finish")):
        if necessary_conditions.same_step(fact.when, necessary_conditions.StepWindow(step, step, 0)) is None:
            continue
        stuck = _impossible_at(places, fact.literal, ends.there(fact.who.agents, step))
        if len(fact.who.agents) - len(stuck) < fact.who.number:
            yield _against(mission, entry, stuck, verb, step)
            return


def _impossible_at(
    places: LiteralPlaces, literal: Literal, there: BoundaryPositions
) -> list[tuple[ir.Agent, ir.InitialSet]]:
    """Agents whose starts or finishes certainly violate the literal."""
    rows = [there.exact[point] for point in _impossible_points(places, literal, there.points)]
    for region, within in there.regions.items():
        if exclude(places.rule(Literal(ir.Inside(region, False), True)), places.rule(literal)):
            rows.extend(within)
    return [there.placed[row] for row in sorted(rows)]


def _impossible_points(places: LiteralPlaces, literal: Literal, points: list[ir.Vector]) -> list[int]:
    """Indices of the points at which the literal certainly does not hold."""
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


def _clash(mission: ir.Mission, one: RequiredFact, other: RequiredFact, steps: tuple[int, int]) -> Diagnostic:
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
        "change one of the two requirements",
    )


def _clash_at_once(one: RequiredFact, other: RequiredFact) -> Diagnostic:
    return Diagnostic(
        CONTRADICTION,
        f"requirement `{one.requirement.name}` can never be satisfied",
        Label(other.fact.span, f"`{_text(other.fact)}`"),
        (Label(one.fact.span, f"`{_text(one.fact)}`"),),
        (f"{_whose(one.fact)}, at the same step",),
        "require the two conditions at different steps",
    )


def _whose(fact: necessary_conditions.Fact) -> str:
    one = "the team" if fact.who == necessary_conditions.THE_TEAM else "one agent"
    return f"both apply to {one} and exclude each other"


def _meeting(mission: ir.Mission, low: int, high: int) -> str:
    if low == high:
        return f"at {seconds(mission, low)}"
    return f"at some step between {seconds(mission, low)} and {seconds(mission, high)}"


def _against(
    mission: ir.Mission, entry: RequiredFact, stuck: list[tuple[ir.Agent, ir.InitialSet]], verb: str, step: int
) -> Diagnostic:
    (agent, place), verbs = stuck[0], "starts" if verb == "start" else "finishes"
    names = [f"`{agent.name}`" for agent, _ in stuck[1:]]
    return Diagnostic(
        CONTRADICTION,
        f"requirement `{entry.requirement.name}` contradicts the {verb} of `{agent.name}`",
        Label(entry.fact.span, _says(mission, entry.fact)),
        (Label(place.span, f"`{agent.name}` {verbs} here, at {seconds(mission, step)}"),),
        (f"also {listed(names)}",) if names else (),
        f"exclude {seconds(mission, step)} from the window of the requirement",
    )


def _text(fact: necessary_conditions.Fact) -> str:
    words = " ".join(fact.span.text.split())
    if fact.literal.positive:
        return words
    return f"not {words}" if words.replace("_", "a").isalnum() else f"not ({words})"


def _says(mission: ir.Mission, fact: necessary_conditions.Fact) -> str:
    """Text on a fact, such as ``asks `not fire` of every `drone`, from 0 s to 20 s``."""
    of = "" if fact.who == necessary_conditions.THE_TEAM else f" of {fact.who.words}"
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
    return f"requires `{_text(fact)}`{of}, {span}"


def _steps(mission: ir.Mission, low: int, high: int) -> str:
    return f"at {seconds(mission, low)}" if low == high else f"from {seconds(mission, low)} to {seconds(mission, high)}"


class CulpritRequirement(Record):
    """Smallest part that decides the truth of a requirement, and the reason as text."""

    formula: ir.Formula
    why: str


def check_requirements(mission: ir.Mission, kernel: k.Kernel, ground: FreeSpace | None = None) -> list[Diagnostic]:
    """Findings about the requirements that need no planning.

    Args:
        ground: the mission's free space, if known.
    """
    if not mission.agents or mission.world.flat:
        return []
    ground = ground or FreeSpace.of(mission)
    known = must_analysis(kernel, ground)
    findings = [*check_routes(mission, known), *_dead_comparisons(mission, known)]
    undecided = []
    for requirement, goal in zip(mission.requirements, kernel.requirements, strict=True):
        number = known.of(requirement.formula).number
        if number not in (TRUE, FALSE):
            undecided.append((requirement, goal))
        elif not too_few_agents((culprit := _culprit(known, requirement.formula)).formula):
            findings.append((_never_violated if number == TRUE else _never_holds)(requirement, culprit))
    places, necessary = ground.places(mission.agents), necessary_conditions.NecessaryConditions.of(mission, kernel)
    contradicting = contradictions(mission, places, necessary, [goal for _, goal in undecided])
    at_once = check_first_step(mission, undecided, ground)
    return in_text_order([*findings, *at_once, *islice(contradicting, MOST_FINDINGS)])


def _dead_comparisons(mission: ir.Mission, known: MustAnalysis) -> Iterator[Diagnostic]:
    """Yield findings about comparisons that no agent can satisfy, in formulas that they do not decide."""
    dead = {formula for formula in formulas(mission) if known.of(formula).number == FALSE and _compares(formula)}
    if dead:
        decided = {goal.formula for goal in mission.requirements if known.of(goal.formula).number in (TRUE, FALSE)}
        others = formulas_bottom_up(goal.formula for goal in goals(mission) if goal.formula not in decided)
        yield from (_comparison_never_holds(known, formula) for formula in others if formula in dead)


def _compares(formula: ir.Formula) -> bool:
    return isinstance(formula, ir.Holds) and isinstance(formula.predicate, ir.Compare)


def _culprit(known: MustAnalysis, root: ir.Formula) -> CulpritRequirement:
    """The smallest part that makes a formula certainly true or false."""
    formula = root
    while True:
        decided = [operand for operand in operands(formula) if known.of(operand).true | known.of(operand).false]
        if not decided:
            break
        formula = decided[0]
    return CulpritRequirement(formula, _why(known, formula))


def _why(known: MustAnalysis, formula: ir.Formula) -> str:
    sure = known.of(formula)
    always = sure.true != 0
    match formula:
        case ir.Holds(ir.Compare() as compare) if (
            values := _range(known, compare, sure.true or sure.false)
        ) is not None:
            return f"always {always}: {range_in_words(compare, values)}".lower()
        case ir.Holds():
            return "true at every possible position" if always else "false at every possible position"
        case ir.Apply() if not formula.operator.spatial:
            return "true for all values of its operands" if always else "false for all values of its operands"
        case ir.Apply():
            return "true for every agent" if always else "true for no agent"
        case ir.AtLeastOf() | ir.OfAgent():
            return "true for every choice of agents" if always else "false for every choice of agents"
        case ir.Without():
            return "true for every lost agent" if always else "false for every lost agent"
        case _:
            return "always true" if always else "never true"


def _range(known: MustAnalysis, comparison: ir.Compare, bits: int) -> Range | None:
    """Range of the difference of a comparison's sides for one of the agents in ``bits``; None if it decides nothing."""
    agent = next(agent for agent, kind in known.kinds if kind & bits)
    values = of_comparison(known.ground, agent, comparison)
    return None if values.low < 0 < values.high else values


# ------------------------------------------------------------------ messages


def _never_violated(requirement: ir.Requirement, culprit: CulpritRequirement) -> Diagnostic:
    return Diagnostic(
        VACUOUS,
        f"requirement `{requirement.name}` cannot be violated: every plan satisfies it",
        Label(culprit.formula.span, culprit.why),
        help="delete the requirement",
    )


def _comparison_never_holds(known: MustAnalysis, formula: ir.Formula) -> Diagnostic:
    return Diagnostic(
        NEVER_HOLDS,
        "this comparison can never be satisfied",
        Label(formula.span, _why(known, formula)),
        help="compare with a value within that range",
    )


def _never_holds(requirement: ir.Requirement, culprit: CulpritRequirement) -> Diagnostic:
    return Diagnostic(
        CONTRADICTION,
        f"requirement `{requirement.name}` can never be satisfied",
        Label(culprit.formula.span, culprit.why),
        help="change this part",
    )

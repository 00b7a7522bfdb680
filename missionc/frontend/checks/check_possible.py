"""Check of satisfiability: requirements that no motion satisfies, dead disjuncts, narrow passages.

    in   Mission, its Kernel, the FreeSpace
    out  nothing but findings
    says MC509 MC551 MC552 MC553 MC554 MC555 MC556 MC557

A requirement is an error if it cannot be satisfied. A disjunct of an `or`, or a preference, gets a warning if it can
never be satisfied.

A formation that holds from the first step on, during a window or up to the end of an `until`, is compared with the
passages on its path to the regions where its agents must be by then. Only conditions that every plan has to satisfy
count, so nothing is reported about a disjunction.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from missionc.base.diagnostics.code import DEAD_BRANCH, STUCK
from missionc.base.diagnostics.model import Diagnostic, Label, has_errors, in_text_order
from missionc.base.late_dataclass import Record
from missionc.base.source import Span
from missionc.frontend.checks.causes import Cause, Causes
from missionc.frontend.checks.formation_room import parted
from missionc.frontend.checks.free_space import FreeSpace
from missionc.frontend.checks.literals import Unbounded
from missionc.frontend.checks.may_analysis import MayAnalysis, telling
from missionc.frontend.checks.necessary_conditions import Fact, NecessaryConditions
from missionc.frontend.syntax.tokens import MOST_FINDINGS
from missionc.geometry.configuration_space import Area
from missionc.ir import Apply, Formation, Mission
from missionc.ir.kernel.nodes import All, Any, Atom, Goal, Kernel, Node, Until
from missionc.ir.kernel.walk import conjuncts

MOST_WAYS = 20
"""Maximum number of paths that are searched; further passages are not checked."""


class Convoy(Record):
    """A formation that holds from the first step on, and the goal that its agents must reach while it holds, or a step
    later.

    Args:
        steps: steps from the last one of the formation to that of the agents' arrival.
    """

    formation: Formation
    kept: Span
    goal: Mapping[int, Area]
    there: Span
    steps: int


def check_passages(mission: Mission, kernel: Kernel, ground: FreeSpace) -> list[Diagnostic]:
    """Findings about formations that do not fit through the passages to their goal, one for each."""
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
    """Yield formations required by an `always` from the first step on, each with a goal of one of its agents in the
    window.
    """
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
    """Yield formations on the left of an `until`, each with the goal that its right side requires."""
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
        f"formation `{convoy.formation.name}` does not fit through any passage to `{words}`",
        Label(convoy.kept, figure),
        (Label(convoy.there, "destination of the formation"), Label(convoy.formation.span, "declared here")),
        help="widen a passage",
    )


def check_possible(
    mission: Mission, kernel: Kernel, ground: FreeSpace, before: Sequence[Diagnostic] = ()
) -> list[Diagnostic]:
    """Findings about goals that cannot hold, and about dead disjuncts, one for each.

    Args:
        before: earlier findings; requirements with an error there are skipped.
    """
    if not mission.agents:
        return []
    suspects, causes = Causes(ground, suspecting=True), Causes(ground)
    chosen = _alternatives(kernel)
    told = telling(goal.formula for goal in (*kernel.requirements, *kernel.preferences))
    wrong = [each.primary.span for each in before if has_errors([each]) and each.primary is not None]
    findings: list[Diagnostic] = []
    for goal in (*kernel.requirements, *kernel.preferences):
        if len(findings) >= MOST_FINDINGS:
            break
        if goal.formula not in told or any(_within(span, goal.span) for span in wrong):
            continue
        if MayAnalysis(suspects, goal.formula, told).dead and (exact := MayAnalysis(causes, goal.formula, told)).dead:
            if reasons := exact.reasons(goal.formula):
                findings.append(_cannot(goal, reasons) if goal.weight is None else _vain(goal, reasons))
        elif chosen and any(_lost(MayAnalysis(suspects, goal.formula, told, latest=True), chosen)):
            ever = MayAnalysis(causes, goal.formula, told, latest=True)
            findings.extend(_never(part, reasons) for part in _lost(ever, chosen) if (reasons := ever.reasons(part)))
    if not has_errors(findings):
        findings.extend(check_passages(mission, kernel, ground))
    return in_text_order(findings)


def _alternatives(kernel: Kernel) -> dict[Node, None]:
    """Disjunctions that the author wrote: the nodes of each `or`."""
    written = (node for each, node in kernel.meanings.items() if isinstance(each, Apply) and each.operator.name == "or")
    return dict.fromkeys(node for node in written if isinstance(node, Any))


def _lost(ever: MayAnalysis, chosen: dict[Node, None]) -> Iterator[Node]:
    """Yield disjuncts that can never hold for any agent, of disjunctions with at least one other disjunct."""
    for node in chosen:
        if isinstance(node, Any) and node in ever.known:
            known = [part for part in node.parts if part in ever.known]
            lost = [part for part in known if all(ever.known[part].dead >> each & 1 for each in ever.asked[part])]
            yield from lost if len(lost) < len(node.parts) else ()


def _within(span: Span, goal: Span) -> bool:
    return span.source.name == goal.source.name and goal.start <= span.start < goal.end


# ------------------------------------------------------------------ messages


def _cannot(goal: Goal, reasons: list[Cause]) -> Diagnostic:
    first, *others = reasons
    message = first.headline
    if others:
        message = f"requirement `{goal.name}` can never be satisfied: {message}, and the other disjuncts fail too"
    labels = [Label(each.span, each.figure) for each in others if each.span is not None]
    return Diagnostic(
        first.code,
        message,
        Label(first.span or goal.span, first.figure),
        (*first.labels, *labels),
        help=first.help,
    )


def _vain(goal: Goal, reasons: list[Cause]) -> Diagnostic:
    return _warned(f"preference `{goal.name}` can never be satisfied", goal.span, reasons)


def _never(part: Node, reasons: list[Cause]) -> Diagnostic:
    return _warned("this disjunct can never be satisfied", part.span, reasons)


def _warned(what: str, span: Span | None, reasons: list[Cause]) -> Diagnostic:
    first = reasons[0]
    where = first.span or span
    assert where is not None
    return Diagnostic(
        DEAD_BRANCH,
        f"{what}: {first.headline}",
        Label(where, first.figure),
        first.labels,
        help=first.help,
    )

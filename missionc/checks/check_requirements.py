"""Check of requirements: contradictions on their face, tautologies, routes that mean nothing.

    in   Mission, its Kernel
    out  nothing but findings
    says MC307 MC510 MC511 MC514 MC515 MC517 MC521

Nothing is said without a proof, so much that is impossible is left to the solver.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

from missionc.base.late_dataclass import dataclass
from missionc.checks.check_contradictions import contradictions
from missionc.checks.check_first_step import check_first_step
from missionc.checks.check_routes import check_routes, too_few_agents
from missionc.checks.free_space import FreeSpace
from missionc.checks.must_analysis import FALSE, TRUE, MustAnalysis, must_analysis
from missionc.checks.necessary_conditions import NecessaryConditions
from missionc.checks.value_ranges import Range, in_words, of_comparison
from missionc.diagnostics.code import CONTRADICTION, NEVER_HOLDS, VACUOUS
from missionc.diagnostics.model import Diagnostic, Label
from missionc.diagnostics.text_order import in_text_order
from missionc.ir import Apply, AtLeastOf, Compare, Formula, Holds, Mission, OfAgent, Requirement, Without
from missionc.kernel.nodes import Kernel
from missionc.language.walk_formulas import bottom_up, formulas, goals, operands
from missionc.syntax.tokens import MOST_FINDINGS


@dataclass(frozen=True, slots=True)
class Culprit:
    """The smallest part from which it follows, and why it is as it is."""

    formula: Formula
    why: str


def check_requirements(mission: Mission, kernel: Kernel, ground: FreeSpace | None = None) -> list[Diagnostic]:
    """All about the requirements that needs no planning to see; ``ground`` is the mission's where it is known."""
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
    places, necessary = ground.places(mission.agents), NecessaryConditions.of(mission, kernel)
    contradicting = contradictions(mission, places, necessary, [goal for _, goal in undecided])
    at_once = check_first_step(mission, undecided, ground)
    return in_text_order([*findings, *at_once, *islice(contradicting, MOST_FINDINGS)])


def _dead_comparisons(mission: Mission, known: MustAnalysis) -> Iterator[Diagnostic]:
    """Comparisons that no agent can satisfy, where what they are part of is not decided by them."""
    dead = {formula for formula in formulas(mission) if known.of(formula).number == FALSE and _compares(formula)}
    if dead:
        decided = {goal.formula for goal in mission.requirements if known.of(goal.formula).number in (TRUE, FALSE)}
        others = bottom_up(goal.formula for goal in goals(mission) if goal.formula not in decided)
        yield from (_comparison_never_holds(known, formula) for formula in others if formula in dead)


def _compares(formula: Formula) -> bool:
    return isinstance(formula, Holds) and isinstance(formula.predicate, Compare)


def _culprit(known: MustAnalysis, root: Formula) -> Culprit:
    """Down from a formula that is surely true, or false, to the part that makes it so."""
    formula = root
    while True:
        decided = [operand for operand in operands(formula) if known.of(operand).true | known.of(operand).false]
        if not decided:
            break
        formula = decided[0]
    return Culprit(formula, _why(known, formula))


def _why(known: MustAnalysis, formula: Formula) -> str:
    sure = known.of(formula)
    always = sure.true != 0
    match formula:
        case Holds(Compare() as compare) if (values := _range(known, compare, sure.true or sure.false)) is not None:
            return f"always {always}: {in_words(compare, values)}".lower()
        case Holds():
            return "wherever an agent can be" if always else "no agent has room to be there"
        case Apply() if not formula.operator.spatial:
            return "true whatever its parts are" if always else "false whatever its parts are"
        case Apply():
            return "true of every agent there is" if always else "true of no agent there is"
        case AtLeastOf() | OfAgent():
            return "true whoever is meant" if always else "false whoever is meant"
        case Without():
            return "true whoever is lost" if always else "false whoever is lost"
        case _:
            return "always true" if always else "never true"


def _range(known: MustAnalysis, comparison: Compare, bits: int) -> Range | None:
    """Between which values a comparison's sides differ for one of these agents; None where that does not decide it."""
    agent = next(agent for agent, kind in known.kinds if kind & bits)
    values = of_comparison(known.ground, agent, comparison)
    return None if values.low < 0 < values.high else values


# ------------------------------------------------------------------ messages


def _never_violated(requirement: Requirement, culprit: Culprit) -> Diagnostic:
    return Diagnostic(
        VACUOUS,
        f"requirement `{requirement.name}` cannot be violated: every plan satisfies it",
        Label(culprit.formula.span, culprit.why),
        help="drop it, or say what it should rule out",
    )


def _comparison_never_holds(known: MustAnalysis, formula: Formula) -> Diagnostic:
    return Diagnostic(
        NEVER_HOLDS,
        "this comparison can never hold",
        Label(formula.span, _why(known, formula)),
        help="compare with a value within that range, or drop it",
    )


def _never_holds(requirement: Requirement, culprit: Culprit) -> Diagnostic:
    return Diagnostic(
        CONTRADICTION,
        f"requirement `{requirement.name}` can never hold: no plan satisfies it",
        Label(culprit.formula.span, culprit.why),
        help="change this part, or drop the requirement",
    )

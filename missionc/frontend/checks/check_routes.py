"""Check of routes: those that need more agents than there are, and those of length zero.

says MC307 MC514 MC515
"""

from __future__ import annotations

from missionc.base.diagnostics.code import ESCAPES_AT_ONCE, HOPS_BEYOND_TEAM, REACHES_ITSELF
from missionc.base.diagnostics.model import Diagnostic, Fix, Label
from missionc.base.units import Metric
from missionc.frontend.checks.must_analysis import MustAnalysis
from missionc.ir import Apply, AtLeastOf, Formula, Length, Mission, OfAgent
from missionc.ir.couplings import heaviest
from missionc.ir.kernel.walk import route_bounds
from missionc.ir.language.walk_formulas import bits_of, formulas, operands, operator_words
from missionc.ir.language.weighed_routes import longest


def check_routes(mission: Mission, known: MustAnalysis) -> list[Diagnostic]:
    """Findings about spatial operators whose bounds are meaningless, one for each."""
    asked = _asked(mission)
    findings = []
    for formula in formulas(mission):
        if not isinstance(formula, Apply) or not formula.operator.spatial:
            continue
        node, end = known.kernel.meanings[formula], formula.operands[-1]
        if too_few_agents(formula):
            findings.append(_too_few_agents(formula))
        elif node is known.kernel.meanings[end]:
            findings.append(_escapes_at_once(formula))
        elif (bounds := route_bounds(node)) and bounds[0] <= 0 and not node.every:
            whom = asked[formula]
            if whom and whom & ~known.of(end).true == 0:
                findings.append(_reaches_itself(mission, formula, end, whom))
    return findings


def length_of(formula: Apply) -> Length:
    assert isinstance(formula.bounds, Length)
    return formula.bounds


def too_few_agents(formula: Formula) -> bool:
    """Return whether a spatial operator requires routes with more agents than its graph has."""
    if not isinstance(formula, Apply) or not formula.operator.spatial:
        return False
    return 1 < len(length_of(formula).graph.agents) < fewest_agents(formula)


def fewest_agents(formula: Apply) -> int:
    """Minimum number of agents on a route within the bounds."""
    length = length_of(formula)
    if length.metric is Metric.METRES:
        return 1 if length.low <= 0 else 2
    heavy = 1 if length.weight is None else heaviest(length.weight)
    return -(-int(length.low) // heavy) + 1


def _asked(mission: Mission) -> dict[Formula, int]:
    """Bit set of the agents for which each formula may be evaluated."""
    asked = dict.fromkeys(formulas(mission), 0)
    for formula in reversed(formulas(mission)):
        match formula:
            case AtLeastOf():
                below = bits_of(formula.agents.agents)
            case OfAgent():
                below = 1 << formula.agent
            case Apply() if formula.operator.spatial:
                below = asked[formula] | bits_of(length_of(formula).graph.agents)
            case _:
                below = asked[formula]
        for operand in operands(formula):
            asked[operand] |= below
    return asked


# ------------------------------------------------------------------ messages


def _too_few_agents(formula: Apply) -> Diagnostic:
    length = length_of(formula)
    there = len(length.graph.agents)
    return Diagnostic(
        HOPS_BEYOND_TEAM,
        f"a route of {_bound(length, length.low)} needs {fewest_agents(formula)} agents;"
        f" graph `{length.graph.name}` has {there}",
        Label(operator_words(formula)),
        (Label(length.graph.span, f"{there} agents"),),
        ("a route visits no agent twice",),
        f"lower the bound to {_bound(length, longest(length))} or {'fewer' if length.weight is None else 'less'}",
    )


def _bound(length: Length, bound: float) -> str:
    return f"{bound:.0f} hops" if length.weight is None else f"{length.word} {bound:.0f}"


def _escapes_at_once(formula: Apply) -> Diagnostic:
    body = " ".join(formula.operands[0].span.text.split())
    return Diagnostic(
        ESCAPES_AT_ONCE,
        f"`{formula.operator.name}` with a lower bound of 0 is equivalent to its operand:"
        " the agent itself is the destination",
        Label(operator_words(formula), f"equivalent to `{body}`" if len(body) <= 40 else ""),
        help=f"require a distance: `{_from_one(formula)}`",
        fix=_fix(formula),
    )


def _reaches_itself(mission: Mission, formula: Apply, end: Formula, whom: int) -> Diagnostic:
    first = mission.agents[(whom & -whom).bit_length() - 1]
    who = f"`{first.name}`" if whom.bit_count() == 1 else f"each of the {whom.bit_count()} agents"
    return Diagnostic(
        REACHES_ITSELF,
        f"this `{formula.operator.name}` is always true: {who} is the end of its own route of 0 hops",
        Label(operator_words(formula), "the lower bound 0 counts the agent itself"),
        (Label(end.span, f"true for {who}"),),
        help=f"require another agent: `{_from_one(formula)}`",
        fix=_fix(formula),
    )


def _fix(formula: Apply) -> Fix | None:
    """Fix for the bounds of a spatial operator; None if they are not written next to the operator."""
    words = operator_words(formula)
    return None if words == formula.span else Fix(words, _from_one(formula))


def _from_one(formula: Apply) -> str:
    """Text of the operator with a lower bound of one hop (in metres: more than zero)."""
    length, name = length_of(formula), formula.operator.name
    unit = length.word
    low = "0.1" if length.metric is Metric.METRES else "1"
    high = "" if length.high == float("inf") else f"{max(length.high, float(low)):g}"
    return f"{name}[{unit} {low}..{high} on {length.graph.name}]"

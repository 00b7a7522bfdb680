"""Check of past windows that contain no step, or only step 0, at every step at which they are evaluated.

    in   Mission
    out  nothing but findings
    says MC308

Before step 0 there are no steps, so ``once`` is false of everything there and ``historically`` true.
"""

from __future__ import annotations

from missionc.base.diagnostics.code import BEFORE_START
from missionc.base.diagnostics.model import Diagnostic, Label
from missionc.ir import Apply, Formula, Mission
from missionc.ir.kernel.nodes import UntilNode, WindowNode
from missionc.ir.kernel.walk import range_asked
from missionc.ir.language.walk_formulas import formulas, goals, meaning, operands, operator_words, reaches_back
from missionc.ir.wording import seconds


def check_past(mission: Mission) -> list[Diagnostic]:
    """Findings about the operators whose window lies before the mission's start, one for each."""
    latest = _latest(mission)
    findings = []
    for formula in formulas(mission):
        if formula not in latest or not reaches_back(formula):
            continue
        node, _ = meaning(formula)
        assert isinstance(node, WindowNode | UntilNode)
        assert node.high is not None
        last = latest[formula] + node.high
        if last < 0 or (last == 0 and node.low < node.high):
            findings.append(_before_start(mission, formula, last, node.every, latest[formula]))
    return findings


def _latest(mission: Mission) -> dict[Formula, int]:
    """Last step at which each formula is evaluated; formulas that are never evaluated are omitted."""
    latest = {goal.formula: 0 for goal in goals(mission)}
    for formula in reversed(formulas(mission)):
        if formula not in latest:
            continue
        for operand, step in _below(formula, latest[formula], mission.steps):
            latest[operand] = max(step, latest.get(operand, 0))
    return latest


def _below(formula: Formula, step: int, last: int) -> list[tuple[Formula, int]]:
    """Operands of a formula that is evaluated up to a step, with the last step at which each operand is evaluated."""
    below = operands(formula)
    if not isinstance(formula, Apply) or formula.operator.spatial or len(below) > 2:  # a chain of `and` or `or`
        return [(operand, step) for operand in below]
    node, places = meaning(formula)
    ranges = [(operand, range_asked(node, place, 0, step, last)) for operand, place in zip(below, places, strict=True)]
    return [(operand, found[1]) for operand, found in ranges if found is not None]


# ------------------------------------------------------------------ messages


def _before_start(mission: Mission, formula: Apply, nearest: int, every: bool, step: int) -> Diagnostic:
    """Finding about an operator whose window lies before the start.

    Args:
        nearest: last step of the window when it is evaluated at the last ``step``.
    """
    word, last = formula.operator.name, formula.operands[-1]
    asked = "evaluated only at 0 s" if step == 0 else f"evaluated at {seconds(mission, step)} at the latest"
    if nearest < 0:
        message = f"this `{word}` is always {str(every).lower()}: its window is before the start of the mission"
        says = f"{asked}; the window begins {seconds(mission, step - nearest)} or more earlier"
    else:
        message = f"this `{word}` covers only 0 s: the rest of its window is before the start of the mission"
        says = f"{asked}: equivalent to `{' '.join(last.span.text.split())}` at 0 s"
    return Diagnostic(
        BEFORE_START,
        message,
        Label(operator_words(formula), says),
        notes=("there are no steps before 0 s",),
        help=f"evaluate the formula later, for example "
        f"`always[0, {seconds(mission, mission.steps)}] (f implies {word}[…] …)`",
    )

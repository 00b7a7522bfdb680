"""Check of what is possible: goals that nothing can satisfy, whichever of their alternatives is tried, and dead ones.

    in   Mission, its Kernel, the FreeSpace
    out  nothing but findings
    says MC509 MC551 MC552 MC553 MC554 MC555 MC556 MC557

A requirement is refused where it cannot hold as a whole; an alternative of an `or`, or a preference, is warned of where
it can never be the one that does.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from missionc.base.source import Span
from missionc.checks.causes import Cause, Causes
from missionc.checks.check_passages import check_passages
from missionc.checks.free_space import FreeSpace
from missionc.checks.may_analysis import MayAnalysis, telling
from missionc.diagnostics.code import DEAD_BRANCH
from missionc.diagnostics.model import Diagnostic, Label, has_errors
from missionc.diagnostics.text_order import in_text_order
from missionc.ir import Apply, Mission
from missionc.kernel.nodes import Any, Goal, Kernel, Node
from missionc.syntax.tokens import MOST_FINDINGS


def check_possible(
    mission: Mission, kernel: Kernel, ground: FreeSpace, before: Sequence[Diagnostic] = ()
) -> list[Diagnostic]:
    """One finding for each goal that cannot hold, and for each alternative.

    Args:
        before: what was found already; of a requirement that has an error there nothing more is said.
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
    """What the author offered a choice of: the nodes of each `or`."""
    written = (node for each, node in kernel.meanings.items() if isinstance(each, Apply) and each.operator.name == "or")
    return dict.fromkeys(node for node in written if isinstance(node, Any))


def _lost(ever: MayAnalysis, chosen: dict[Node, None]) -> Iterator[Node]:
    """The alternatives that can never be the one that holds, of nobody they are asked of; where not all are."""
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
        message = f"requirement `{goal.name}` can never hold: {message}, nor is there another way"
    labels = [Label(each.span, each.figure) for each in others if each.span is not None]
    return Diagnostic(
        first.code,
        message,
        Label(first.span or goal.span, first.figure),
        (*first.labels, *labels),
        help=first.help,
    )


def _vain(goal: Goal, reasons: list[Cause]) -> Diagnostic:
    return _warned(f"preference `{goal.name}` can never hold", goal.span, reasons)


def _never(part: Node, reasons: list[Cause]) -> Diagnostic:
    return _warned("this alternative can never hold", part.span, reasons)


def _warned(what: str, span: Span | None, reasons: list[Cause]) -> Diagnostic:
    first = reasons[0]
    where = first.span or span
    assert where is not None
    return Diagnostic(
        DEAD_BRANCH,
        f"{what}: {first.headline}",
        Label(where, first.figure),
        first.labels,
        help=f"drop it, or {first.help}",
    )

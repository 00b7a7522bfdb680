"""Check of the look-ahead of each formula against the mission's duration, and a printer for the look-aheads.

    in   Mission
    out  nothing but findings
    says MC301 MC305

A window ``[a, end]`` reaches to the last step from any step. The formula below it is therefore evaluated at the last
step too, where nothing lies ahead.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping

from missionc.base.diagnostics.code import BEYOND_HORIZON, WINDOW_EMPTY
from missionc.base.diagnostics.model import Diagnostic, Fix, Label, in_text_order
from missionc.base.late_dataclass import Record
from missionc.base.source import Span
from missionc.ir import Apply, Formula, Mission, Period, Preference, Requirement, Window
from missionc.ir.kernel.nodes import Node
from missionc.ir.kernel.walk import Ask, asks
from missionc.ir.language.walk_formulas import (
    formulas,
    formulas_bottom_up,
    goals,
    meaning,
    once,
    operands,
    operator_words,
)
from missionc.ir.wording import seconds

_HORIZON = re.compile(r"horizon\s+([0-9.eE+-]+\s*[a-z]*)\Z")


class Look(Record):
    """Look-ahead of a formula: the number of steps that it needs after the step at which it is evaluated.

    ``total`` is infinite if no horizon is long enough. ``own`` is the part from the formula's own window (up to ``a``
    of ``[a, end]``), and the rest is that of ``then``, the operand that looks furthest ahead.
    """

    total: float
    own: int = 0
    then: Formula | None = None


def check_horizons(mission: Mission) -> list[Diagnostic]:
    """Findings about the outermost windows that look past the mission's last step.

    If a source text is used repeatedly, its furthest window comes first.
    """
    looks = {formula: _look(formula) for formula in formulas(mission)}
    seen: set[Formula] = set()
    late = [
        (goal, formula)
        for goal in goals(mission)
        for formula in outermost_windows(goal.formula, looks, seen)
        if looks[formula].total > mission.steps
    ]
    late.sort(key=lambda each: -looks[each[1]].total)
    return in_text_order([_past_the_end(mission, goal, _chain(formula, looks), looks) for goal, formula in late])


def steps_ahead(roots: Iterable[Formula]) -> dict[Formula, Look]:
    """Look-ahead of every formula under the roots.

    Source:
        [strel] Definition 5, with ``until``'s left side evaluated one step less far.
    """
    return {formula: _look(formula) for formula in formulas_bottom_up(roots)}


@once
def _look(formula: Formula) -> Look:
    """Look-ahead of one formula.

    The look-aheads of its operands must be computed first, so that the recursion is one level deep.
    """
    below = operands(formula)
    if not isinstance(formula, Apply) or formula.operator.spatial or len(below) > 2:  # a chain of `and` or `or`
        then = max(below, key=lambda operand: _look(operand).total, default=None)
        return Look(_look(then).total if then else 0, 0, then)
    node, places = meaning(formula)
    blank: dict[Node, float] = dict.fromkeys(places, 0)
    totals = [
        (_needed(node, {**blank, place: _look(operand).total}), _look(operand).total, operand)
        for place, operand in zip(places, below, strict=True)
    ]
    total, rest, furthest = max(totals, key=lambda entry: entry[:2])
    own = total - rest if math.isfinite(total) else _needed(node, blank)
    return Look(total, int(own), furthest)


def outermost_windows(root: Formula, looks: Mapping[Formula, Look], seen: set[Formula]) -> list[Apply]:
    """Temporal operators that are below no other temporal operator, in the order of the text.

    Args:
        seen: formulas to skip; visited formulas are added.
    """
    windows: list[Apply] = []
    stack = [root]
    while stack:
        formula = stack.pop()
        if formula in seen:
            continue
        seen.add(formula)
        if isinstance(formula, Apply) and (isinstance(formula.bounds, Window) or looks[formula].own > 0):
            windows.append(formula)
        else:
            stack.extend(reversed(operands(formula)))
    return windows


def _needed(node: Node, below: Mapping[Node, float]) -> float:
    """Number of steps that a node needs ahead of its own step, given the look-aheads of its placeholders."""
    if node in below:
        return below[node]
    return max([0, *(_under_window(_needed(ask.node, below), ask) for ask in asks(node))])


def _under_window(needed: float, ask: Ask) -> float:
    """Number of steps that a window needs ahead, if its operand needs ``needed`` steps."""
    if ask.high is None:
        return ask.low if needed <= ask.before_last else math.inf
    return ask.high + needed


# ------------------------------------------------------------------ messages


def _chain(formula: Formula, looks: Mapping[Formula, Look]) -> list[Apply]:
    """Windows, outermost first, that add up to the look-ahead of the formula."""
    chain: list[Apply] = []
    following: Formula | None = formula
    while following is not None:
        if isinstance(following, Apply) and (looks[following].own != 0 or _opens_to_the_end(following, looks)):
            chain.append(following)
        following = looks[following].then
    return chain


def _opens_to_the_end(formula: Apply, looks: Mapping[Formula, Look]) -> bool:
    """Return whether the formula is a window to the end whose operand looks past the end at the last step."""
    reaches = isinstance(formula.bounds, Period) or (isinstance(formula.bounds, Window) and formula.bounds.high is None)
    below = looks[formula].then
    return reaches and math.isinf(looks[formula].total) and below is not None and math.isfinite(looks[below].total)


def _past_the_end(
    mission: Mission, goal: Requirement | Preference, chain: list[Apply], looks: Mapping[Formula, Look]
) -> Diagnostic:
    outer, last = chain[0], chain[-1]
    holds_no_step = isinstance(last.bounds, Window) and last.bounds.high is None
    stuck = next((window for window in chain if _opens_to_the_end(window, looks)), None)
    if holds_no_step:
        words = _quoted(last)
        message = f"in `{goal.name}`, the window of `{words}` begins after the last step of the mission"
    else:
        message = f"the mission ends before `{goal.name}` can be evaluated"
    labels = [_label(mission, window, looks, first=window is outer, stuck=window is stuck) for window in chain]
    if stuck is None:
        total = seconds(mission, looks[outer].total)
        note = f"the formula needs {total}; the mission lasts {seconds(mission, mission.steps)}"
        help_ = f"write `horizon {total}`"
        fix = _lasting(mission, total)
    else:
        note = "no horizon is long enough: the inner window always reaches past the last step"
        help_, fix = _bounded(mission, chain, stuck, looks)
    code = WINDOW_EMPTY if holds_no_step else BEYOND_HORIZON
    return Diagnostic(code, message, labels[0], tuple(labels[1:]), (note,), help_, fix)


def _lasting(mission: Mission, horizon: str) -> Fix | None:
    """Fix that writes a longer horizon; None if the horizon is not written as a number."""
    span = mission.time_span
    number = _HORIZON.search(span.text) if span else None
    if span is None or number is None:
        return None
    return Fix(Span(span.source, span.start + number.start(1), span.end), horizon)


def _label(mission: Mission, window: Apply, looks: Mapping[Formula, Look], *, first: bool, stuck: bool) -> Label:
    look = looks[window]
    begins = isinstance(window.bounds, Window) and window.bounds.high is None
    if look.own < 0:
        text = f"reaches {seconds(mission, -look.own)} back" if first else f"plus {seconds(mission, -look.own)} back"
    elif stuck:
        text = f"evaluated at every step up to the last, at {seconds(mission, mission.steps)}"
    elif begins and first:
        text = f"begins {seconds(mission, look.own)} later"
    elif begins:
        text = f"begins another {seconds(mission, look.own)} later"
    elif first:
        text = f"reaches {seconds(mission, look.own)} ahead"
    else:
        text = f"reaches another {seconds(mission, look.own)} ahead"
    return Label(operator_words(window), text)


def _bounded(
    mission: Mission, chain: list[Apply], stuck: Apply, looks: Mapping[Formula, Look]
) -> tuple[str, Fix | None]:
    """Remedy for a window to ``end`` whose operand looks further: text, and a fix if one can be written."""
    assert isinstance(stuck.bounds, Window | Period)
    before = sum(looks[window].own for window in chain[: chain.index(stuck)])
    further = sum(looks[window].own for window in chain[chain.index(stuck) + 1 :])
    latest = mission.steps - before - further
    if isinstance(stuck.bounds, Period):
        return _spelt_out(mission, stuck, latest)
    if latest < stuck.bounds.low:
        return f"shorten the window inside `{_quoted(stuck)}`", None
    low = seconds(mission, stuck.bounds.low) if stuck.bounds.low else "0"
    bounds = f"[{low}, {seconds(mission, latest)}]"
    way_out = f"write `{stuck.operator.name}{bounds}`"
    words = operator_words(stuck)
    return way_out, None if words == stuck.span else Fix(words, f"{stuck.operator.name}{bounds}")


def _spelt_out(mission: Mission, stuck: Apply, latest: int) -> tuple[str, Fix | None]:
    """Remedy for a recurrence whose operand looks further: a recurrence over the periods that end early enough."""
    assert isinstance(stuck.bounds, Period)
    period, word = stuck.bounds.steps, _quoted(stuck)
    if latest < period:
        return f"shorten the window inside `{word}`", None
    begins, length = (seconds(mission, steps) for steps in (latest - period, period))
    return f"write `always[0, {begins}] eventually[0, {length}] …` in place of `{word}: …`", None


def _quoted(formula: Apply) -> str:
    return " ".join(operator_words(formula).text.split())


def show_horizons(mission: Mission) -> str:
    """Text with a line for each requirement and preference: its name and the last step that can change its truth."""
    looks = steps_ahead(goal.formula for goal in goals(mission))
    rows = [(goal.name, looks[goal.formula].total) for goal in goals(mission)]
    width = max((len(name) for name, _ in rows), default=0)
    lines = [f"mission {mission.name}: {mission.steps} steps, {mission.horizon:g} s"]
    lines += [f"  {name:<{width}}  {_steps(total, mission)}" for name, total in rows]
    return "\n".join(lines) + "\n"


def _steps(total: float, mission: Mission) -> str:
    if math.isinf(total):
        return "without end"
    return f"{total:g} step{'' if total == 1 else 's'}, {total * mission.step:g} s"

"""Timing diagrams of a formula's windows on the mission's time axis, a line for each temporal operator.

in   a formula and its mission
out  its windows, and a drawing of them
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from missionc.base.late_dataclass import Record
from missionc.ir import Apply, Formula, Mission, Period, Window
from missionc.ir.kernel.nodes import Node
from missionc.ir.kernel.walk import children, range_asked, window_of
from missionc.ir.language.walk_formulas import as_written, meaning, reaches_back
from missionc.ir.wording import seconds

WIDTH = 100
"""Maximum number of columns in a drawing."""

MOST = 24
"""Maximum number of windows that are drawn; a last line counts further windows."""

_LABEL = 44


class Span(Record):
    """Window of a temporal operator, in steps of the mission.

    ``first`` is the window if the operator is evaluated at its earliest step, ``last`` at its latest: it slides between
    the two. ``looks`` is the last step at which any of its operands is evaluated.
    """

    formula: Apply
    depth: int
    words: str
    first: tuple[int, int]
    last: tuple[int, int]
    looks: int

    @property
    def slides(self) -> bool:
        return self.first != self.last

    @property
    def drawn(self) -> tuple[object, ...]:
        """Key of the window's drawing: windows with equal keys look the same."""
        return self.depth, self.words, self.first, self.last, self.looks


def windows(formula: Formula, mission: Mission) -> Iterator[Span]:
    """Yield every temporal operator of the formula, outermost first, for each range of steps at which it is
    evaluated.
    """
    seen: set[tuple[Formula, int, int]] = set()
    stack: list[tuple[Formula, int, int, int]] = [(formula, 0, 0, 0)]
    while stack:
        query = stack.pop()
        part, low, high, depth = query
        if (part, low, high) in seen:
            continue
        seen.add((part, low, high))
        below = [(operand, low, high, depth) for operand in as_written(part)]
        if isinstance(part, Apply) and not part.operator.spatial:
            node, places = meaning(part)
            window = _window(node)
            if window is not None and window[1] is not None and high + window[1] < 0:
                below = []  # before the mission's start
            elif window is not None:
                asked_over = [range_asked(node, place, low, high, mission.steps) for place in places]
                below = [
                    (operand, *over, depth + 1)
                    for operand, over in zip(part.operands, asked_over, strict=True)
                    if over is not None
                ]
                yield Span(
                    part,
                    depth,
                    _words(part, mission, depth > 0),
                    *_places(part, window, low, high, mission.steps),
                    max((last for _, _, last, _ in below), default=0),
                )
        stack.extend(reversed(below))


def draw(spans: Iterator[Span], mission: Mission, unicode: bool) -> list[str]:
    """Lines of a timing diagram: the time axis, then a line for each window; at most ``WIDTH`` columns.

    Empty if there are no windows.
    """
    drawn: list[Span] = []
    for span in spans:
        if len(drawn) == MOST:
            break
        drawn.append(span)
    if not drawn:
        return []
    solid, loose, rule = ("█", "░", "─") if unicode else ("#", ".", "-")
    label = min(_LABEL, max(len(_label(span)) for span in drawn))
    reaches = [f"{seconds(mission, span.first[0])} to {seconds(mission, span.last[1])}" for span in drawn]
    columns = WIDTH - label - max(map(len, reaches)) - 6
    end = seconds(mission, mission.steps)
    lines = [f"{'':{label}}  0 s {rule * (columns - 5 - len(end))} {end}".rstrip()]
    for span, reach in zip(drawn, reaches, strict=True):
        bar = [" "] * columns
        _fill(bar, span.first[0], span.last[1], mission.steps, loose)
        _fill(bar, *span.first, mission.steps, solid)
        lines.append(f"{_label(span)[:label]:{label}}  {''.join(bar)}  {reach}")
    if len(drawn) == MOST:
        lines.append(f"{'':{label}}  only the first {MOST} windows are shown")
    if any(span.slides for span in drawn):
        lines.append(f"{'':{label}}  {solid} first window  {loose} later windows")
    return lines


def _fill(bar: list[str], first: int, last: int, steps: int, mark: str) -> None:
    scale = (len(bar) - 1) / max(steps, 1)
    for column in range(round(first * scale), round(last * scale) + 1):
        bar[column] = mark


def _label(span: Span) -> str:
    return "  " * min(span.depth, 6) + span.words


def _words(formula: Apply, mission: Mission, nested: bool) -> str:
    """Text such as ``eventually [1 s, 3 s]``, with a plus if it is relative to the step of another window."""
    plus = "+" if nested else ""
    if isinstance(formula.bounds, Period):
        return f"{formula.operator.name} {seconds(mission, formula.bounds.steps)}"
    if not isinstance(formula.bounds, Window):
        return formula.operator.name
    low, high = formula.bounds.low, formula.bounds.high
    if reaches_back(formula) and high is not None:
        nearer, further = (f"-{seconds(mission, bound)}" if bound else seconds(mission, 0) for bound in (low, high))
        return f"{formula.operator.name} [{nearer}, {further}]"
    until = "end" if high is None else f"{plus}{seconds(mission, high)}"
    return f"{formula.operator.name} [{plus}{seconds(mission, low)}, {until}]"


def _window(node: Node) -> tuple[int, int | None] | None:
    """Bounds of the window in an operator's kernel form that closes last; None if there is none."""
    own = window_of(node)
    if own is not None:
        return own
    candidates = [window for window in map(_window, children(node)) if window is not None]
    return max(candidates, key=lambda window: math.inf if window[1] is None else window[1], default=None)


def _places(
    formula: Apply, window: tuple[int, int | None], low: int, high: int, steps: int
) -> tuple[tuple[int, int], tuple[int, int]]:
    """Window of an operator in steps of the mission, if it is evaluated at ``low``, and if it is evaluated at ``high``.

    For a recurrence, its first period and the mission's last period.
    """
    if isinstance(formula.bounds, Period):
        length = formula.bounds.steps
        return _placed((0, length), low, steps), (max(steps - length, 0), steps)
    return _placed(window, max(low, -(window[1] or 0)), steps), _placed(window, high, steps)


def _placed(window: tuple[int, int | None], step: int, steps: int) -> tuple[int, int]:
    """First and last step of a window, in steps of the mission, if its operator is evaluated at ``step``."""
    low, high = window
    return min(max(step + low, 0), steps), steps if high is None else min(step + high, steps)

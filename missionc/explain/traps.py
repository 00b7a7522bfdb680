"""Traps of a formula: conventions it hangs on that other tools have otherwise, and the example of each.

in   a formula
out  Traps of ``convention_examples``, in their order
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from missionc.explain import convention_examples
from missionc.explain.convention_examples import Example, Trap
from missionc.ir import Apply, Formula, Holds, Length, Window
from missionc.language.operators import by_name
from missionc.language.walk_formulas import as_written, bottom_up, reaches_back


def traps_of(formula: Formula) -> tuple[Trap, ...]:
    """Every trap that the formula touches, once."""
    names: set[str] = set()
    windowed: set[Formula] = set()
    for part in bottom_up([formula], as_written):
        names.update(_touched(part))
        below = any(operand in windowed for operand in as_written(part))
        window = isinstance(part, Apply) and isinstance(part.bounds, Window) and not reaches_back(part)
        if window and below:
            names.add(convention_examples.CLIPPING.name)
        if window or below:
            windowed.add(part)
    return tuple(trap for trap in convention_examples.TRAPS if trap.name in names)


def _touched(part: Formula) -> Iterator[str]:
    match part:
        case Holds(predicate):
            if predicate.region:
                yield convention_examples.BORDER.name
            if predicate.graph:
                yield convention_examples.LINK.name
        case Apply(operator, _, bounds):
            yield from by_name[operator.name].traps(part)
            if isinstance(bounds, Length):
                yield convention_examples.LINK.name
            elif isinstance(bounds, Window) and bounds.high is not None:
                yield convention_examples.CLOSED_WINDOW.name
        case _:
            return


def table(example: Example) -> list[str]:
    """The run, a line for each formula, a column for each step or agent; then the two readings of it."""
    count = len(example.places) if example.agents else len(example.places[0])
    heads = [f"a[{index}]" if example.agents else f"{index} s" for index in range(count)]
    wide = max(len(name) for name, _ in example.rows)
    lines = [f"{'':{wide}}  {'  '.join(f'{head:>4}' for head in heads)}"]
    for name, cells in example.rows:
        lines.append(f"{name:{wide}}  {'  '.join(f'{_word(cell):>4}' for cell in cells)}")
    if example.agents:
        lines.append(f"{'linked':{wide}}  {', '.join(linked(example)) or 'nobody'}")
    first, second = (example.holds, not example.holds)
    asked, otherwise = _shown(example.asked), _shown(example.otherwise)
    wide = max(len(asked), len(otherwise))
    lines.append(f"{asked:{wide}}  {'holds' if first else 'fails'}, as it is here")
    lines.append(f"{otherwise:{wide}}  {'holds' if second else 'fails'}, the other reading")
    return lines


def _shown(formula: str) -> str:
    """A formula of a run as a table shows it: asked at `a[0]`, on the one graph there is."""
    bare = formula.removeprefix("a[0]: ").replace(" on radio", "")
    return bare[1:-1] if bare != formula and bare.startswith("(") and bare.endswith(")") else bare


def linked(example: Example) -> list[str]:
    """The links of a run at one step, strictly under 1 m."""
    places = [path[0] for path in example.places]
    pairs = [(one, other) for other in range(len(places)) for one in range(other)]
    return [f"a[{one}]-a[{other}]" for one, other in sorted(pairs) if math.dist(places[one], places[other]) < 1]


def _word(cell: str) -> str:
    return "yes" if cell == "T" else "no"

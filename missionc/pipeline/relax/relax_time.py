"""Relaxations of time: a longer horizon, a window that ends later or asks for less time, a longer period."""

from __future__ import annotations

from missionc.base.source import Span
from missionc.checks.check_horizons import steps_ahead
from missionc.ir import Apply, Mission, Period, Preference, Requirement, Window
from missionc.language.walk_formulas import bottom_up, formulas, goals, operator_words
from missionc.pipeline.checked import Checked
from missionc.pipeline.relax.conflict_targets import ConflictTargets, Way
from missionc.pipeline.relax.edits import Edit, Spot, declared, is_in_main_file, spot
from missionc.pipeline.relax.knobs import Knob
from missionc.syntax import ast
from missionc.syntax.references import nodes

LONGER = 4
"""A horizon grows to so many times itself at most."""


def horizon(checked: Checked, mission: Mission) -> list[Knob]:
    """The horizon, longer by whole steps; every window that ends with the mission follows, however it is written."""
    horizon_spot = _horizon(checked)
    if horizon_spot is None:
        return []
    ends = [end for end in _ends(checked, mission) if end != horizon_spot]

    def edit(notches: int) -> Edit:
        steps = mission.steps + notches
        whole = _lasting(horizon_spot, mission, steps)
        fixes = [fix for end in ends for fix in _at(end, mission, steps, "").fixes]
        says = f"{whole.says}, with the windows that end with it" if fixes else whole.says
        return Edit(says, (*whole.fixes, *fixes), whole.overrides)

    return [Knob(edit, 1 / mission.steps, mission.steps, (LONGER - 1) * mission.steps)]


def _ends(checked: Checked, mission: Mission) -> list[Spot]:
    """Where the mission's last step is written as the end of a window, each place once."""
    meant = _meant(mission)
    ends = []
    for node in nodes(checked.program):
        if isinstance(node, ast.Apply) and isinstance(node.bounds, ast.Window) and node.span in meant:
            bounds, end = meant[node.span].bounds, spot(checked, node.bounds.high)
            if isinstance(bounds, Window) and bounds.high == mission.steps and end is not None and end not in ends:
                ends.append(end)
    return ends


def _meant(mission: Mission) -> dict[Span, Apply]:
    """What each use of an operator, by its words, was resolved to."""
    return {each.span: each for each in formulas(mission) if isinstance(each, Apply)}


def windows(checked: Checked, mission: Mission, targets: ConflictTargets) -> list[Knob]:
    """The last steps of windows: later where something is to happen, sooner where something is to last.

    Of what is to recur, the period: longer.
    """
    written = {node.span: node.bounds for node in nodes(checked.program) if isinstance(node, ast.Apply)}
    periods = _periods(checked)
    meant = _meant(mission)
    knobs = []
    for span, way in targets.windows.items():
        window, formula = written.get(span), meant.get(span)
        if isinstance(window, ast.Window) and formula is not None and way is not Way.EITHER:
            knobs.append(_window(checked, mission, window, formula, way))
        elif formula is not None and isinstance(formula.bounds, Period) and way is Way.MORE and span in periods:
            knobs.append(_period(checked, mission, periods[span], formula))
    return [knob for knob in knobs if knob is not None]


def _window(checked: Checked, mission: Mission, window: ast.Window, formula: Apply, way: Way) -> Knob | None:
    bounds, lasting = formula.bounds, _horizon(checked)
    if not isinstance(bounds, Window) or bounds.high is None or window.high is None:
        return None
    low, high = bounds.low, bounds.high
    end_spot = spot(checked, window.high)
    with_horizon = end_spot is not None and end_spot == lasting
    if end_spot is None or with_horizon:
        if (way is Way.MORE and with_horizon) or not is_in_main_file(checked, window.high.span):
            return None
        end_spot = Spot(high * mission.step, "s", window.high)
    asking = [goal for goal in goals(mission) if formula in bottom_up([goal.formula])]
    name = f"in `{asking[0].name}`, the end of `{' '.join(operator_words(formula).text.split())}` at"
    ahead = _ahead(mission, asking)

    def edit(notches: int) -> Edit | None:
        end = high + way.value * notches
        moved = _at(end_spot, mission, end, name)
        if way is Way.LESS or ahead + notches <= mission.steps:
            return moved
        return moved + _lasting(lasting, mission, ahead + notches) if lasting is not None else None

    most = (LONGER - 1) * mission.steps if way is Way.MORE else high - low
    return Knob(edit, 1 / max(1, high), min(most, max(1, high)), most) if most else None


def _periods(checked: Checked) -> dict[Span, ast.Quantity]:
    """The period of each formula that is to recur, as it is written: a quantity, or the name of a parameter."""
    found: dict[Span, ast.Quantity] = {}
    for node in nodes(checked.program):
        match node:
            case ast.Apply(span=span, bounds=ast.Period(length=length)):
                found[span] = length
            case ast.Quantified(span=span, kind="every", agents=ast.Name() as name):
                found[span] = name
            case _:
                pass
    return found


def _period(checked: Checked, mission: Mission, length: ast.Quantity, formula: Apply) -> Knob | None:
    """The period, longer by whole steps as long as the mission lasts long enough."""
    place = spot(checked, length)
    assert isinstance(formula.bounds, Period)
    steps = formula.bounds.steps
    asking = [goal for goal in goals(mission) if formula in bottom_up([goal.formula])]
    most = mission.steps - _ahead(mission, asking)
    if place is None or most < 1:
        return None
    name = f"in `{asking[0].name}`, the period"
    return Knob(lambda notches: _at(place, mission, steps + notches, name), 1 / steps, min(most, steps), most)


def _ahead(mission: Mission, asking: list[Requirement | Preference]) -> int:
    """The steps that these goals need."""
    looks = steps_ahead(goal.formula for goal in asking)
    return int(min(max(looks[goal.formula].total for goal in asking), mission.steps))


def _horizon(checked: Checked) -> Spot | None:
    times = declared(checked, ast.Time)
    return spot(checked, times[0].horizon) if times else None


def _lasting(horizon_spot: Spot, mission: Mission, steps: int) -> Edit:
    return _at(horizon_spot, mission, steps, "horizon")


def _at(place: Spot, mission: Mission, steps: int, name: str) -> Edit:
    """The time after so many steps, in the unit in which it is written."""
    value = steps if place.unit == "steps" else steps * mission.step / place.factor
    return place.put(value, f"{name} {place.written(value)} instead of {place.written(place.value)}")

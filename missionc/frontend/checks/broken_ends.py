"""Requirements that starts or finishes certainly violate, found by robustness intervals, with the violated part.

The intervals of every formula are computed with arrays, so ``check_ends`` loads this module only if its cheaper test
has not shown that nothing is violated.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from missionc.base.diagnostics.code import CONTRADICTION
from missionc.base.diagnostics.model import Diagnostic, Label
from missionc.base.late_dataclass import Record
from missionc.base.source import Span
from missionc.frontend.checks.free_space import FreeSpace
from missionc.frontend.checks.possible_ends import end_of
from missionc.ir import BeaconCover, Mission, Sight
from missionc.ir.couplings import range_of
from missionc.ir.distances.signed_distance import distance_between
from missionc.ir.kernel.analysis import reads_lengths
from missionc.ir.kernel.nodes import Atom, Goal, Kernel, Node, Not, says_opposite
from missionc.ir.kernel.walk import asks, children, graph_of, window_of
from missionc.ir.wording import listed, metres, seconds
from missionc.verification.monitoring.end_columns import FIRST
from missionc.verification.monitoring.interval_robustness import Intervals, RobustnessInterval

ROUNDING = 1e-9
"""Violations below this distance, in metres, may be rounding; a value exactly on the border of a region is exempt."""


class Culprit(Record):
    """Smallest part that decides a formula, at an agent and at the first or last step.

    ``upper`` is True if the upper bound of its interval decides. ``words`` is the source span of the part, or of the
    formula that contains it.
    """

    node: Node
    agent: int
    column: int
    upper: bool
    words: Span | None = None


def broken_ends(mission: Mission, kernel: Kernel, ground: FreeSpace) -> list[Diagnostic]:
    """Findings about the requirements that no plan can satisfy because of a start or finish, one for each."""
    intervals = Intervals(mission, ground.atlas)
    known = intervals.of(goal.formula for goal in kernel.requirements)
    return [
        _finding(mission, goal, _culprit(intervals, known, goal.formula), intervals, known)
        for goal in kernel.requirements
        if goal.formula in known and _surely_false(float(known[goal.formula].most[0, FIRST]))
    ]


def _surely_false(most: float) -> bool:
    return most < -ROUNDING or -1e-300 < most < 0


def _bound(known: dict[Node, RobustnessInterval], place: Culprit) -> float:
    one = known[place.node]
    values = one.most if place.upper else one.least
    return float(values[place.agent if len(values) > 1 else 0, place.column])


def _culprit(intervals: Intervals, known: dict[Node, RobustnessInterval], root: Node) -> Culprit:
    """Smallest part of a requirement that determines the upper bound of its robustness."""
    place = Culprit(root, 0, FIRST, True, root.span)
    while True:
        wanted = -_bound(known, place) if isinstance(place.node, Not) else _bound(known, place)
        below = (each for each in _below(intervals, place) if _bound(known, each) == wanted)
        following = next(below, None)
        if following is None:
            return place
        place = replace(following, words=following.node.span or place.words)


def _below(intervals: Intervals, place: Culprit) -> Iterator[Culprit]:
    """Yield the operands of a node that may determine its bound, each at an agent and a step."""
    node, upper = place.node, place.upper is not isinstance(place.node, Not)
    if graph_of(node) is not None:
        return
    for ask in asks(node):
        agent = place.agent if ask.of_itself else ask.agents[0]
        steps = intervals.columns(ask.low, ask.high, place.column)[0]
        if window_of(node) and ask.node is not children(node)[-1]:
            steps = [place.column]  # whatever comes later, what holds until then must hold now
        yield from (Culprit(ask.node, agent, step, upper) for step in steps)


# ------------------------------------------------------------------ messages


def _finding(
    mission: Mission, goal: Goal, culprit: Culprit, intervals: Intervals, known: dict[Node, RobustnessInterval]
) -> Diagnostic:
    amount = abs(_bound(known, culprit))
    if amount == np.inf:
        return _whatever_the_motion(mission, goal, culprit)
    verb, step = ("start", 0) if culprit.column == FIRST else ("finish", mission.steps)
    agents, notes = _because(mission, culprit, intervals, amount)
    names = [f"`{mission.agents[agent].name}`" for agent in agents]
    places = {agent: end_of(mission.agents[agent], culprit.column) for agent in agents}
    written: dict[object, list[str]] = {}
    for agent, place in places.items():
        if place is not None:
            written.setdefault(place.span, []).append(f"`{mission.agents[agent].name}`")
    by = f" by {metres(amount)}" if amount > ROUNDING else ""
    spread = any(intervals.radius[agent, culprit.column] > 0 for agent in agents)
    in_regions = " or more, for all positions in their regions" if spread and by else ""
    verdict = _verdict(culprit)
    return Diagnostic(
        CONTRADICTION,
        f"requirement `{goal.name}` contradicts the {verb} of {listed(names)}",
        Label(culprit.words or goal.span, f"{verdict} at {seconds(mission, step)}{by}{in_regions}"),
        tuple(
            Label(place.span, f"{listed(written[place.span])} {verb}{_s(verb, written[place.span])} here")
            for place in {each.span: each for each in places.values() if each is not None}.values()
        ),
        tuple(notes),
        f"exclude {seconds(mission, step)} from the window of the requirement",
    )


def _verdict(culprit: Culprit) -> str:
    return "false" if culprit.upper is not says_opposite(culprit.node) else "true, but must be false,"


def _whatever_the_motion(mission: Mission, goal: Goal, culprit: Culprit) -> Diagnostic:
    """Finding about a requirement that does not depend on motion, such as one about the number of agents."""
    step = 0 if culprit.column == FIRST else mission.steps
    return Diagnostic(
        CONTRADICTION,
        f"requirement `{goal.name}` cannot be satisfied by any motion",
        Label(culprit.words or goal.span, f"{_verdict(culprit)} at {seconds(mission, step)} for every motion"),
        help=f"exclude {seconds(mission, step)} from the window of the requirement",
    )


def _s(verb: str, names: list[str]) -> str:
    return "" if len(names) > 1 else "es" if verb == "finish" else "s"


def _because(
    mission: Mission, culprit: Culprit, intervals: Intervals, amount: float
) -> tuple[tuple[int, ...], list[str]]:
    """Agents whose positions decide the culprit, and text on their distances."""
    position = intervals.position[:, culprit.column]

    def apart(first: int, second: int) -> str:
        names = f"`{mission.agents[first].name}` and `{mission.agents[second].name}`"
        length = float(distance_between(np, position[first], position[second]))
        exact = all((place := end_of(mission.agents[each], culprit.column)) and place.point for each in (first, second))
        return f"{names} are {metres(length)} apart" + ("" if exact else " between the centres of their regions")

    match culprit.node:
        case Atom(predicate) if (formation := predicate.formation) and formation.edges:
            edge = intervals.worst_edge(formation, culprit.column)
            wanted = f"; `{formation.name}` requires {metres(edge.target)}" if isinstance(edge.target, float) else ""
            return (edge.first, edge.second), [apart(edge.first, edge.second) + wanted]
        case Atom(predicate) if pairs := predicate.pairs_of(culprit.agent):
            return pairs[0], [apart(*pairs[0])]
        case node if (graph := graph_of(node)) and not reads_lengths(node):
            bounds = intervals.links(graph)
            most = culprit.upper is not culprit.node.every
            links = (bounds.most if most else bounds.least)[culprit.column].copy()
            np.fill_diagonal(links, 0.0)
            worst_links = np.argwhere((np.abs(links) == amount) & (links != 0))
            if len(worst_links) == 0 or isinstance(graph, BeaconCover):
                return (culprit.agent,), []
            first, second = (graph.agents[place] for place in worst_links[0].tolist())
            radius = range_of(graph, first, second)
            near = float(distance_between(np, position[first], position[second])) < radius
            blocked = (
                ", and an obstacle blocks the line of sight"
                if near and isinstance(graph, Sight) and culprit.upper
                else ""
            )
            names = [f"`{mission.agents[agent].name}`" for agent in (first, second)]
            what = (
                f"range of `{graph.name}` from {names[0]} to {names[1]}"
                if graph.ranges
                else f"radius of `{graph.name}`"
            )
            reach = f"the {what} is {metres(radius)}{blocked}"
            return (first, second), [f"{apart(first, second)}; {reach}"]
        case _:
            return (culprit.agent,), []

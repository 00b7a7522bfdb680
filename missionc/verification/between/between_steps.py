"""Continuous-time verification of every requirement that is satisfied at the steps.

    in   Mission, its kernel, a Trace already evaluated at the steps, the flown Curves
    out  Between for each requirement that is true at the steps; for a folder's files, in a Certificate

The semantics of a mission is defined at the steps and does not change here. An operator has the same meaning with times
instead of steps (``docs/semantics.md``).

Counterexamples in continuous time: the time, the agent and the subformula of a failure, and the sentence about them.

The search descends from the formula to a predicate or a route. Among several causes it prefers values that differ from
the values at the adjacent steps, since a check at the steps misses these. The sentences distinguish failures between
the steps from undecided cases.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Flags, Trace
from missionc.geometry.curves.piecewise_polynomials import Curves, Pieces, curves_of, read
from missionc.ir import BeaconCover, Graph, Mission, Sight
from missionc.ir.couplings import directed, range_of
from missionc.ir.distances.signed_distance import distance_between
from missionc.ir.kernel.analysis import steps_ahead
from missionc.ir.kernel.nodes import All, Any, At, AtLeast, Atom, Goal, Kernel, Node, Not, says_opposite
from missionc.ir.kernel.walk import children, graph_of, postorder, window_of
from missionc.ir.language.margins.links import link_margin
from missionc.verification.between.interval_sets import STEP, Motion, Spans, common
from missionc.verification.between.truth_over_time import Signals, TruthOverTime, last_asked
from missionc.verification.certificate import Between, Certificate, Verdict
from missionc.verification.monitoring.monitor import truths

MOST_PARTS = 3
"""Maximum number of subformulas that a message lists if they decide a failure jointly."""


class Culprit(Record):
    """A predicate or route that decides a verdict: it is, or may be, ``value`` for an agent from ``low`` to ``high``
    (ticks).

    ``label`` is the node whose source text is printed, ``says`` states its value, and ``team`` is True if the node is
    about the team.
    """

    node: Node
    agent: int
    tick: int
    value: bool
    low: int
    high: int
    label: Node
    says: bool
    team: bool


class _Place(Record):
    node: Node
    agent: int
    tick: int
    value: bool
    label: Node
    says: bool
    team: bool = False

    def to(self, node: Node, *, agent: int | None = None, tick: int | None = None, value: bool | None = None) -> _Place:
        """The search state for a child formula; a rewritten operator keeps the source span of its original."""
        value = self.value if value is None else value
        same = node.span in (None, self.label.span)
        return _Place(
            node,
            self.agent if agent is None else agent,
            self.tick if tick is None else tick,
            value,
            self.label if same else node,
            self.says if same else value is not says_opposite(node),
            same and (self.team or agent is not None),
        )


class Search:
    """Search for the subformulas that decide a failed or undecided verdict.

    Args:
        known: signals of each node, by agent.
        truths: truth of each node at the steps, (agents or 1, steps + 1 or 1).
        certain: True if the formula surely fails; False if it may fail.
        ahead: look-ahead of each node, in steps.
        end: end of the mission, in ticks.
    """

    def __init__(
        self,
        known: dict[Node, Signals],
        truths: dict[Node, Flags],
        certain: bool,
        ahead: dict[Node, int],
        end: int,
    ) -> None:
        self.known, self.truths, self.certain, self.ahead, self.end = known, truths, certain, ahead, end

    def culprits(self, root: Node) -> tuple[Culprit, ...]:
        """Subformulas that decide why the formula fails, or may fail, at time 0."""
        found: list[Culprit] = []
        waiting = [_Place(root, 0, 0, False, root, says_opposite(root))]
        while waiting and len(found) < MOST_PARTS:
            place = waiting.pop()
            below = self._below(place)
            waiting.extend(reversed(below))
            if not below:
                found.append(self._culprit(place))
        return tuple(found)

    def when(self, node: Node, agent: int, value: bool) -> Spans:
        """Time intervals in which a formula surely is ``value``, or may be ``value`` if the verdict is not certain."""
        signal = self.known[node][agent]
        surely, other = (signal.sure, signal.never) if value else (signal.never, signal.sure)
        if self.certain:
            return surely
        edges = [-1, *(edge for span in other for edge in span), self.end + 1]
        gaps = zip(edges[::2], edges[1::2], strict=True)
        return tuple((low + 1, high - 1) for low, high in gaps if low + 1 <= high - 1)

    def is_new(self, place: _Place) -> bool:
        """Return whether the formula has the opposite value at both adjacent steps."""
        truths = self.truths[place.node]
        row = truths[place.agent if len(truths) > 1 else 0]
        steps = {place.tick // STEP, -(-place.tick // STEP)}
        return all(bool(row[step if row.size > 1 else 0]) is not place.value for step in steps)

    def _below(self, place: _Place) -> list[_Place]:
        """Search states of the child formulas that decide the value.

        Empty for a predicate or a route, which decide it themselves.
        """
        node, value = place.node, place.value
        match node:
            case Not(body):
                return [place.to(body, value=not value)]
            case At(agent, body):
                return [place.to(body, agent=agent)]
            case All(parts) | Any(parts):
                return self._parts(place, parts, one=value is not node.every)
            case AtLeast(_, parts):
                return self._parts(place, parts, one=False)
            case _ if window := window_of(node):
                return self._in_time(place, *window, one=value is not node.every)
            case _:
                return []

    def _parts(self, place: _Place, parts: tuple[Node, ...], one: bool) -> list[_Place]:
        each = [place.to(part) for part in parts]
        here = [part for part in each if _has(self.when(part.node, part.agent, part.value), place.tick)]
        new = [part for part in here if self.is_new(part)]
        return (new or here)[: 1 if one else MOST_PARTS]

    def _in_window(self, place: _Place, body: Node, low: int, high: int | None, one: bool) -> list[_Place]:
        """Search state of ``body`` at a deciding time of the window.

        The first time whose value differs from both adjacent steps is preferred; otherwise it is a step with the other
        value.
        """
        first, last = self._window(place.tick, low, high)
        if first > last:
            return []
        if one:
            spans = common(self.when(body, place.agent, place.value), ((first, last),))
            moments = [place.to(body, tick=begin) for begin, _ in spans]
        else:
            moments = [place.to(body, tick=step * STEP) for step in range(-(-first // STEP), last // STEP + 1)]
            moments.append(place.to(body, tick=first))
        return [moment for moment in moments if self.is_new(moment)][:1] or moments[:1]

    def _in_time(self, place: _Place, low: int, high: int | None, one: bool) -> list[_Place]:
        """Search state of a deciding time of the window, or of an earlier time at which the hold condition fails."""
        *holds, end = children(place.node)
        goals = self._in_window(place, end, low, high, one)
        for hold in () if one else holds:
            if low < 0:
                return self._after(place, hold, self._window(place.tick, low, high)[0]) or goals
            last = min(self._window(place.tick, low, high)[1], last_asked(self.ahead[hold], self.end))
            breaks = common(self.when(hold, place.agent, place.value), ((place.tick, last),))
            if breaks and not (goals and breaks[0][0] >= goals[0].tick and self._is_so(goals[0])):
                return [place.to(hold, tick=breaks[0][0])]
        return goals

    def _after(self, place: _Place, hold: Node, first: int) -> list[_Place]:
        """Search state of the last time from ``first`` on at which the hold condition fails.

        Empty if it never fails.
        """
        breaks = common(self.when(hold, place.agent, place.value), ((first, place.tick),))
        return [place.to(hold, tick=breaks[-1][1])] if breaks else []

    def _is_so(self, place: _Place) -> bool:
        return _has(self.when(place.node, place.agent, place.value), place.tick)

    def _window(self, tick: int, low: int, high: int | None) -> tuple[int, int]:
        return max(tick + low * STEP, 0), self.end if high is None else min(self.end, tick + high * STEP)

    def _culprit(self, place: _Place) -> Culprit:
        spans = self.when(place.node, place.agent, place.value)
        low, high = next((span for span in spans if _has((span,), place.tick)), (place.tick, place.tick))
        return Culprit(place.node, place.agent, place.tick, place.value, low, high, place.label, place.says, place.team)


def _has(spans: Spans, tick: int) -> bool:
    return any(low <= tick <= high for low, high in spans)


MOST_LINKS = 2
"""Maximum number of links listed in a sentence."""


def sentence(name: str, culprits: tuple[Culprit, ...], certain: bool, motion: Motion) -> str:
    """Sentence that explains why a requirement fails, or is undecided, between samples although every sample satisfies
    it.
    """
    first = culprits[0]
    parts = " and ".join(_part(culprit, certain, motion) for culprit in culprits)
    if certain:
        return f"`{name}` is true at every sample, but not {_between(first, motion)}: {_times(first, motion)} {parts}"
    return f"`{name}` is true at every sample; between samples it is not decided: {_times(first, motion)} {parts}"


def stretch(culprit: Culprit) -> tuple[int, int]:
    """First and last tick of the deciding interval, cut at the adjacent steps."""
    before, after = culprit.tick // STEP * STEP, -(-culprit.tick // STEP) * STEP
    return max(culprit.low, before), min(culprit.high, after)


def agents_of(culprit: Culprit, motion: Motion) -> tuple[int, ...]:
    """Indices of the agents that the deciding predicate or route is about."""
    match culprit.node:
        case Atom(predicate) if predicate.formation:
            return predicate.formation.agents
        case Atom(predicate) if predicate.pairs:
            return tuple(sorted({end for pair in predicate.pairs for end in pair}))
        case _:
            return (culprit.agent,)


def _between(culprit: Culprit, motion: Motion) -> str:
    """Text for the two steps between which the requirement fails, or "between samples" if it fails at a step."""
    before, after = culprit.tick // STEP, -(-culprit.tick // STEP)
    step = motion.mission.step
    return "between samples" if before == after else f"between {before * step:g} s and {after * step:g} s"


def _times(culprit: Culprit, motion: Motion) -> str:
    begin, stop = (f"{float(motion.seconds(tick)):.2f}" for tick in stretch(culprit))
    return f"at {begin} s" if begin == stop else f"from {begin} s to {stop} s"


def _part(culprit: Culprit, certain: bool, motion: Motion) -> str:
    names = [motion.mission.agents[agent].name for agent in agents_of(culprit, motion)]
    text = _text(culprit.label)
    whom = f" for {names[0]}" if len(names) == 1 and not culprit.team else ""
    if not certain:
        return f"{text}{whom} is too close to its border to decide"
    because = _because(culprit, motion)
    return f"{text} is {'true' if culprit.says else 'false'}{whom}{because}"


def _text(node: Node) -> str:
    return f"`{' '.join(node.span.text.split())}`" if node.span else "a part of the requirement"


def _because(culprit: Culprit, motion: Motion) -> str:
    """Text for the links that exist at this time but not at the adjacent steps, or the reverse."""
    graph, linked = graph_of(culprit.node), culprit.value is not culprit.node.every
    if graph is None:
        return ""
    changed = _changed_links(graph, culprit, linked, motion)
    names = [agent.name for agent in motion.mission.agents]
    links = [f"{names[one]} and {names[other]} are {length:.3f} m apart" for one, other, length in changed[:MOST_LINKS]]
    reach = f"the radius of `{graph.name}` is {graph.radius:g} m"
    if graph.ranges:
        shown = [(names[one], names[other], range_of(graph, one, other)) for one, other, _ in changed[:MOST_LINKS]]
        reach = f"`{graph.name}` reaches " + ", ".join(f"{far:g} m from {one} to {other}" for one, other, far in shown)
    if isinstance(graph, Sight):
        seen = "no obstacle blocks" if linked else "an obstacle blocks"
        near = all(length < range_of(graph, one, other) for one, other, length in changed)
        reach += f", and {seen} the line of sight" if near else ""
    if isinstance(graph, BeaconCover):
        links = [
            f"{names[one]} and {names[other]} share {'a' if linked else 'no'} beacon"
            for one, other, _ in changed[:MOST_LINKS]
        ]
    return f": {', '.join(links)}, {reach}" if links else ""


def _changed_links(graph: Graph, culprit: Culprit, made: bool, motion: Motion) -> list[tuple[int, int, float]]:
    """Pairs of agents that are linked only at this time, or with ``made`` False unlinked only at this time.

    Returns:
        For each pair its two agents and their distance in the middle of the interval, metres. Pairs with the agent in
        question come first.
    """
    low, high = stretch(culprit)
    ticks = np.array([(low + high) // 2, culprit.tick // STEP * STEP, -(-culprit.tick // STEP) * STEP])
    members = np.array(graph.agents)
    apart = ~np.eye(members.size, dtype=np.bool_)
    first, second = (members[places] for places in np.nonzero(apart if directed(graph) else np.triu(apart)))
    piece = motion.piece_at(ticks)
    here, there = (
        motion.position(agent[:, None], piece[None], np.broadcast_to(motion.local(piece, ticks), (agent.size, 3)))
        for agent in (first, second)
    )
    linked = np.asarray(link_margin(graph, first[:, None], second[:, None], here, there)) > 0
    lengths = np.asarray(distance_between(np, here, there))[:, 0]
    new = (linked[:, 0] == made) & ((linked[:, 1] != made) | (linked[:, 2] != made))
    pairs = [(int(first[pair]), int(second[pair]), float(lengths[pair])) for pair in np.flatnonzero(new)]
    ends = {(one, other) for one, other, _ in pairs}
    alike = {(one, other) for one, other in ends if range_of(graph, one, other) == range_of(graph, other, one)}
    pairs = [each for each in pairs if each[0] < each[1] or each[1::-1] not in alike]
    return sorted(pairs, key=lambda pair: culprit.agent not in pair[:2])


__all__ = ["between_steps", "verify_between"]


def verify_between(mission: Mission, kernel: Kernel, trace: Trace, files: Mapping[str, str]) -> Certificate:
    """Certificate with the continuous-time verdict on each requirement, for the fitted polynomials of a verified plan.

    Args:
        files: text of each agent's trajectory file, by agent name; already accepted by ``verify_polynomials``.

    Returns:
        A certificate without entries if a file is unreadable.
    """
    trajectories = [read(files.get(agent.name, "")) for agent in mission.agents]
    pieces = [own for own in trajectories if isinstance(own, Pieces)]
    if not pieces or len(pieces) < len(trajectories):
        return Certificate(mission.name, ())
    flown = curves_of(pieces, slice(mission.dimension))
    return Certificate(mission.name, (), between=between_steps(mission, kernel, trace, flown))


def between_steps(mission: Mission, kernel: Kernel, trace: Trace, curves: Curves) -> tuple[Between, ...]:
    """Continuous-time verdict on every requirement that the trace satisfies at its steps.

    Args:
        curves: the agents' trajectories, through the states of ``trace``.
    """
    at_steps = truths([goal.formula for goal in kernel.requirements], mission, trace)
    evaluation = TruthOverTime(Motion(mission, curves, trace))
    return tuple(_judged(goal, evaluation, trace) for goal in kernel.requirements if bool(at_steps[goal.formula][0, 0]))


def _judged(goal: Goal, evaluation: TruthOverTime, trace: Trace) -> Between:
    motion = evaluation.motion
    known = evaluation.of(goal.formula)
    signal = known[goal.formula][0]
    if signal.sure and signal.sure[0][0] == 0:
        return Between(goal.name, Verdict.HOLDS)
    certain = bool(signal.never) and signal.never[0][0] == 0
    at_steps = truths(postorder((goal.formula,)), motion.mission, trace)
    ahead = steps_ahead((goal.formula,))
    culprits = Search(known, at_steps, certain, ahead, motion.end).culprits(goal.formula)
    begin, stop = (round(float(motion.seconds(tick)), 6) for tick in stretch(culprits[0]))
    agents = sorted({agent for culprit in culprits for agent in agents_of(culprit, motion)})
    return Between(
        goal.name,
        Verdict.FAILS if certain else Verdict.UNDECIDED,
        begin,
        stop,
        tuple(motion.mission.agents[agent].name for agent in agents),
        sentence(goal.name, culprits, certain, motion),
    )

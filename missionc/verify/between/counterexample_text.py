"""Counterexamples in words: what fails between the steps, or is not decided."""

from __future__ import annotations

import numpy as np

from missionc.ir import BeaconCover, Graph, Sight
from missionc.ir.pair_ranges import directed, range_of
from missionc.kernel.nodes import Atom, Node
from missionc.kernel.walk import graph_of
from missionc.language.margins.links import link_margin
from missionc.verify.between.counterexample import Culprit
from missionc.verify.between.motion_clock import STEP, Motion
from missionc.world.signed_distance import distance_between

MOST_LINKS = 2
"""Links that a sentence names."""


def sentence(name: str, culprits: tuple[Culprit, ...], certain: bool, motion: Motion) -> str:
    """The sentence about a requirement that is true at the steps."""
    first = culprits[0]
    parts = " and ".join(_part(culprit, certain, motion) for culprit in culprits)
    if certain:
        return f"`{name}` is true at every step, but not {_between(first, motion)}: {_times(first, motion)} {parts}"
    return f"`{name}` is true at every step; in between that is not decided: {_times(first, motion)} {parts}"


def stretch(culprit: Culprit) -> tuple[int, int]:
    """From when to when, in ticks, between the two steps around."""
    before, after = culprit.tick // STEP * STEP, -(-culprit.tick // STEP) * STEP
    return max(culprit.low, before), min(culprit.high, after)


def agents_of(culprit: Culprit, motion: Motion) -> tuple[int, ...]:
    """Whom it is about."""
    match culprit.node:
        case Atom(predicate) if predicate.formation:
            return predicate.formation.agents
        case Atom(predicate) if predicate.pairs:
            return tuple(sorted({end for pair in predicate.pairs for end in pair}))
        case _:
            return (culprit.agent,)


def _between(culprit: Culprit, motion: Motion) -> str:
    """The steps between which it fails; what decides that may itself be at a step, where no two are named."""
    before, after = culprit.tick // STEP, -(-culprit.tick // STEP)
    step = motion.mission.step
    return "at every moment between" if before == after else f"between {before * step:g} s and {after * step:g} s"


def _times(culprit: Culprit, motion: Motion) -> str:
    begin, stop = (f"{float(motion.seconds(tick)):.2f}" for tick in stretch(culprit))
    return f"at {begin} s" if begin == stop else f"from {begin} s to {stop} s"


def _part(culprit: Culprit, certain: bool, motion: Motion) -> str:
    names = [motion.mission.agents[agent].name for agent in agents_of(culprit, motion)]
    text = _text(culprit.label)
    whom = f" of {names[0]}" if len(names) == 1 and not culprit.team else ""
    if not certain:
        return f"{text}{whom} is too near its border to tell"
    because = _because(culprit, motion)
    return f"{text} is {'true' if culprit.says else 'false'}{whom}{because}"


def _text(node: Node) -> str:
    return f"`{' '.join(node.span.text.split())}`" if node.span else "a part of it"


def _because(culprit: Culprit, motion: Motion) -> str:
    """The links that this moment has and the steps around it have not, or the other way round."""
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
        seen = "nothing is" if linked else "an obstacle is"
        near = all(length < range_of(graph, one, other) for one, other, length in changed)
        reach += f", and {seen} in the way" if near else ""
    if isinstance(graph, BeaconCover):
        links = [
            f"{names[one]} and {names[other]} share {'a' if linked else 'no'} beacon"
            for one, other, _ in changed[:MOST_LINKS]
        ]
    return f": {', '.join(links)}, {reach}" if links else ""


def _changed_links(graph: Graph, culprit: Culprit, made: bool, motion: Motion) -> list[tuple[int, int, float]]:
    """Pairs that are linked then alone, or, not ``made``, not linked then alone: those of the agent first.

    With each, its distance in the middle of the stretch.
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

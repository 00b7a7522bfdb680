"""Probabilistic roadmap (PRM): states of one kind of agent, and its one-step moves.

Source:
    [strel] Algorithm 1.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field
from typing import TypeAlias

import numpy as np

from missionc.backends.smt.roadmap.edges import NONE, Edges
from missionc.backends.smt.roadmap.geodesic_roadmap import geodesic_roadmap
from missionc.backends.smt.roadmap.grow import grow
from missionc.backends.smt.roadmap.lane_roadmap import Way, lane_roadmap
from missionc.backends.smt.roadmap.passages import passage_nodes
from missionc.backends.smt.roadmap.relay_nodes import relay_nodes
from missionc.backends.smt.roadmap.sample_nodes import Ground, NoRoadmap, free_ground, sample_nodes, spacing
from missionc.backends.smt.roadmap.slow_paths import always_slow, slow_paths
from missionc.backends.smt.roadmap.unroll import Unrolled, unroll
from missionc.base.late_dataclass import Record
from missionc.base.memory import reserve
from missionc.base.trace import Array, Flags, Indices
from missionc.geometry.clearance import clear_of_movers, clear_places
from missionc.geometry.dynamics import Motions, States, motions_between
from missionc.ir import Agent, Beacon, Facing, InitialSet, Lanes, Mission
from missionc.ir.distances.signed_distance import signed_distance
from missionc.ir.kernel.nodes import Atom, Kernel
from missionc.ir.kernel.walk import postorder

__all__ = ["Indices", "NoRoadmap"]

OwnRoadmap: TypeAlias = tuple[States, Edges, tuple[str, ...], tuple[Way, ...] | None]
"""Nodes, edges, names of the nodes, and flown paths of vehicles."""


class Roadmap(Record, eq=False):
    """Roadmap of the agents ``agents``: states, and moves of one step each.

    Args:
        agents: mission indices of the agents that share it (equal dynamics, radius, altitude and vehicle).
        position: (states, dim), metres.
        velocity: (states, dim), m/s; the state's own velocity for a double integrator, zero for first-order dynamics.
        heading: (states,), rad; NaN if arbitrary.
        moves: (moves, 2), state indices from and to, sorted; each takes exactly one step and satisfies the dynamics. A
            move from a state to itself is waiting.
        standing: (steps + 1, states): True if the state is clear of moving obstacles at the step.
        allowed: (steps, moves): True if the move may start at the step (moving obstacles).
        starts: possible start states of each of ``agents``.
        finishes: possible last states of each of ``agents`` (all states without a finish).
        nodes: nodes before the edges were unrolled over time.
        edges: edges between those nodes.
        names: names of the nodes, for a user's roadmap.
        flown: True if agents accelerate and brake on its edges like their vehicle.
    """

    agents: tuple[int, ...]
    position: Array
    velocity: Array
    heading: Array
    moves: Indices
    standing: Flags
    allowed: Flags
    starts: tuple[Indices, ...]
    finishes: tuple[Indices, ...]
    nodes: States = field(default_factory=lambda: States(np.zeros((0, 2)), np.zeros((0, 2))))
    edges: Edges = NONE
    names: tuple[str, ...] = ()
    flown: bool = False

    def motions(self, mission: Mission) -> Motions:
        """Motions of the roadmap's moves, (moves)."""
        states = States(self.position, self.velocity)
        start, end = (states.take(each) for each in self.moves.T)
        return motions_between(mission.agents[self.agents[0]].dynamics, start, end, mission.step)

    def lengths(self, mission: Mission) -> Array:
        """Lengths of the roadmap's moves, (moves,), metres."""
        return self.motions(mission).lengths(mission.step)

    def moves_of(self, way: Indices) -> Indices:
        """Moves of a path, from its states: (..., steps + 1) -> (..., steps)."""
        count = len(self.position)
        keys = self.moves[:, 0] * count + self.moves[:, 1]
        return np.searchsorted(keys, way[..., :-1] * count + way[..., 1:])


def build_roadmaps(
    mission: Mission,
    nodes: int,
    neighbours: int,
    generator: np.random.Generator,
    *,
    passages: bool = False,
    kernel: Kernel | None = None,
) -> tuple[Roadmap, ...] | NoRoadmap:
    """Sampled roadmaps, one for each kind of agent (equal dynamics, radius, altitude and vehicle); or the reason why
    there is none.

    Args:
        nodes: number of nodes of each roadmap, if starts, finishes and regions need no more. States add to them:
            between the ends of an edge of several steps, and one for each heading if turning is bounded.
        neighbours: number of neighbours of each node.
        generator: random generator; equal seeds give equal arrays.
        passages: True to add nodes in narrow passages, at most as many again.
        kernel: requirements whose local speed limits get slow moves.

    Returns:
        roadmaps in the order of the kinds in the mission.
    """
    return _of_each_kind(
        mission, kernel or Kernel((), ()), lambda ground: _sampled(ground, nodes, neighbours, generator, passages)
    )


def build_relay_roadmaps(
    mission: Mission, kernel: Kernel, neighbours: int, generator: np.random.Generator
) -> tuple[Roadmap, ...] | NoRoadmap:
    """One roadmap for each kind of agent, of places, regions and rows of relays between these."""

    def between_regions(ground: Ground) -> tuple[States, Edges] | NoRoadmap:
        places = sample_nodes(ground, 0, generator)
        if isinstance(places, NoRoadmap):
            return places
        relays = relay_nodes(ground, kernel, generator)
        if not len(relays):
            return NoRoadmap("no relays between regions")
        return grow(ground, np.concatenate([places, relays]), neighbours, generator)

    return _of_each_kind(mission, kernel, between_regions)


def build_geodesic_roadmaps(
    mission: Mission, kernel: Kernel, generator: np.random.Generator
) -> tuple[Roadmap, ...] | NoRoadmap:
    """Geodesic roadmaps, one for each kind of agent; or the reason why there is none."""
    return _of_each_kind(mission, kernel, lambda ground: geodesic_roadmap(ground, kernel, generator))


def build_lane_roadmaps(mission: Mission, lanes: Lanes) -> tuple[Roadmap, ...] | NoRoadmap:
    """Roadmaps of the user's lanes with their directions and speeds, one for each kind of agent; or the reason why
    there is none."""
    return _of_each_kind(mission, Kernel((), ()), lambda ground: lane_roadmap(ground, lanes))


def _of_each_kind(
    mission: Mission,
    kernel: Kernel,
    nodes_and_edges: Callable[[Ground], tuple[States, Edges] | OwnRoadmap | NoRoadmap],
) -> tuple[Roadmap, ...] | NoRoadmap:
    kinds: dict[object, list[Agent]] = {}
    for agent in mission.agents:
        kind = (agent.dynamics, agent.radius, agent.altitude, agent.vehicle, agent.course)
        kinds.setdefault(kind, []).append(agent)
    roadmaps: list[Roadmap] = []
    for agents in kinds.values():
        if agents[0].course:
            roadmaps += [_along_course(mission, agent) for agent in agents]
            continue
        ground = free_ground(mission, tuple(agents))
        made = nodes_and_edges(ground)
        roadmap = made if isinstance(made, NoRoadmap) else _build(ground, kernel, *made)
        if isinstance(roadmap, NoRoadmap):
            return roadmap
        roadmaps.append(roadmap)
    return tuple(roadmaps)


def _along_course(mission: Mission, agent: Agent) -> Roadmap:
    """Roadmap of an agent with a given trajectory: one state per step."""
    count = mission.steps + 1
    position = np.array(agent.course, dtype=np.float64)
    moves = np.stack([np.arange(count - 1), np.arange(1, count)], axis=1)
    return Roadmap(
        agents=(agent.index,),
        position=position,
        velocity=np.zeros_like(position),
        heading=np.full(count, np.nan),
        moves=moves,
        standing=np.eye(count, dtype=np.bool_),
        allowed=np.eye(count - 1, dtype=np.bool_),
        starts=(np.array([0]),),
        finishes=(np.array([count - 1]),),
        nodes=States(position, np.zeros_like(position)),
    )


def _sampled(
    ground: Ground, count: int, neighbours: int, generator: np.random.Generator, passages: bool
) -> tuple[States, Edges] | NoRoadmap:
    points = sample_nodes(ground, count, generator)
    if isinstance(points, NoRoadmap):
        return points
    if passages:
        narrow = passage_nodes(ground, spacing(ground, count), count, points, generator)
        points = np.concatenate([points, narrow])
    return grow(ground, points, neighbours, generator)


def _build(
    ground: Ground,
    kernel: Kernel,
    nodes: States,
    edges: Edges,
    names: tuple[str, ...] = (),
    ways: tuple[Way, ...] | None = None,
) -> Roadmap | NoRoadmap:
    """Roadmap on these nodes and edges; named nodes are the user's own, with possibly one-way edges.

    If ``ways`` are given (flown paths of vehicles), they replace the edges.
    """
    mission, dynamics = ground.mission, ground.agents[0].dynamics
    slow = list(slow_paths(ground, kernel, nodes, edges))
    fast_too = not always_slow(ground, kernel)
    asked, one_way = _headings_asked(kernel), bool(names)
    gone = edges if ways is None else NONE
    whole = unroll(
        dynamics, nodes, gone, mission.step, slow, fast_too=fast_too, one_way=one_way, asked=asked, ways=ways or ()
    )
    is_node = np.arange(len(whole.states)) < len(nodes)
    starts = [_may_be(ground, agent.start, 0, whole.states) & is_node for agent in ground.agents]
    finishes = [_may_be(ground, agent.finish, mission.steps, whole.states) for agent in ground.agents]
    if ways is not None:
        finishes = [finish & is_node for finish in finishes]  # an agent under way is not at rest at the end
    ending = np.zeros(len(whole.states), dtype=bool)
    for agent, finish in zip(ground.agents, finishes, strict=True):
        if agent.finish is not None:
            ending |= finish
    useful = _useful(whole, starts, ending, mission.steps)
    for agent, start, finish in zip(ground.agents, starts, finishes, strict=True):
        if not np.any(start & useful):
            return NoRoadmap(f"no path from {_written(agent.start)} for `{agent.name}`")
        if agent.finish is not None and not np.any(finish & useful):
            return NoRoadmap(f"no path to {_written(agent.finish)} for `{agent.name}`")
    number = np.cumsum(useful) - 1
    states, moves = whole.states.take(useful), number[whole.moves[useful[whole.moves].all(axis=1)]]
    reserve(mission.steps * (len(states) + len(moves)), f"{mission.steps} steps among {len(states)} states")
    motions = motions_between(dynamics, states.take(moves[:, 0]), states.take(moves[:, 1]), mission.step)
    return Roadmap(
        agents=tuple(agent.index for agent in ground.agents),
        position=states.position,
        velocity=states.velocity,
        heading=whole.heading[useful],
        moves=moves,
        standing=clear_places(mission, states.position, ground.margin, range(mission.steps + 1)),
        allowed=clear_of_movers(mission, motions, ground.margin),
        starts=tuple(np.flatnonzero(start[useful]) for start in starts),
        finishes=tuple(np.flatnonzero(finish[useful]) for finish in finishes),
        nodes=nodes,
        edges=edges,
        names=names,
        flown=ways is not None,
    )


def _may_be(ground: Ground, place: InitialSet | None, step: int, states: States) -> Flags:
    """Return true for each state, (states,), at rest and clear, in which an agent may start or finish in ``place`` at
    the step.

    If ``place`` is None, the result is true for every state.
    """
    if place is None:
        return np.ones(len(states), dtype=bool)
    if place.point is not None:
        there = np.all(states.position == place.point, axis=1)
    else:
        there = np.asarray(signed_distance(np, place.shape, states.position)) <= 0
    clear = clear_places(ground.mission, states.position, ground.margin, (step,))[0]
    return np.asarray(there & clear & np.all(states.velocity == 0, axis=1))


def _headings_asked(kernel: Kernel) -> tuple[float | Beacon, ...]:
    """Distinct directions and beacons in the heading predicates of the requirements."""
    atoms = (node.predicate for node in postorder(kernel.formulas) if isinstance(node, Atom))
    return tuple(dict.fromkeys(predicate.towards for predicate in atoms if isinstance(predicate, Facing)))


def _useful(whole: Unrolled, starts: list[Flags], ending: Flags, steps: int) -> Flags:
    """Return true for each state, (states,), that is reachable from a start and has a continuation or is a possible
    end.

    Dead ends are omitted, unless some agent then has no start: a short mission may end before such a path does.
    """
    source, target = whole.moves[:, 0], whole.moves[:, 1]
    able = np.ones(len(whole.states), dtype=bool)  # more moves are possible than counted
    able_at_start, count = able, 0
    while True:
        goes_on = ending.copy()
        goes_on[source[able[target]]] = True
        before, able, count = able, able & goes_on, count + 1
        if count <= steps:
            able_at_start = able
        if np.array_equal(before, able):
            break
    usable = able if all(np.any(start & able) for start in starts) else np.ones(len(whole.states), dtype=bool)
    reached: Flags = np.any(starts, axis=0) & usable & able_at_start
    while True:
        after = reached.copy()
        after[target[reached[source]]] = True
        after &= usable
        if np.array_equal(after, reached):
            return reached
        reached = after


def _written(place: InitialSet) -> str:
    if place.region is not None:
        return f"`{place.region.name}`"
    return f"({', '.join(f'{coordinate:g}' for coordinate in place.point or ())})"


def whole_moves(roadmaps: tuple[Roadmap, ...]) -> int:
    """Total number of moves of all agents over all steps."""
    return sum(len(roadmap.agents) * roadmap.allowed.size for roadmap in roadmaps)

"""Expansion of a search node: one more agent planned by Algorithm 1; or all at once, without a search.

    in   a node of the search and an agent
    out  candidates of its motion, with their cost and whether they hold among those planned before

Source:
    [clot] Algorithm 2, lines 4 to 8; V-A.3 (I) for all at once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

import numpy as np
import torch
from torch import Tensor

from missionc.backends.api import ignore
from missionc.backends.clot.cost_graph.motion_batch import Team, team
from missionc.backends.clot.cost_weights import ProbeWeights
from missionc.backends.clot.optimise.active_set import Choices
from missionc.backends.clot.optimise.free_distance import Surroundings
from missionc.backends.clot.paper.first_motions import FirstMotions
from missionc.backends.clot.paper.planning_sequence import Couplings
from missionc.backends.clot.paper.prefix import about
from missionc.backends.clot.paper.prefix_check import prefix_margin
from missionc.backends.clot.paper.probe_cost import ProbeCost
from missionc.backends.clot.paper.search_tree import Node
from missionc.backends.clot.paper.transport import transport
from missionc.backends.clot.paper.tree_search import Candidate
from missionc.backends.clot.run.child_processes import Children, children
from missionc.backends.clot.run.presets import Preset
from missionc.backends.clot.run.transport_settings import TransportSettings
from missionc.backends.clot.torch_device import seeded
from missionc.base.trace import Array
from missionc.ir import Mission
from missionc.kernel import nodes as kernel

TYPICAL = 10.0
"""Metres: the radii and deviations of presets are meant for a world of this size, and scaled for others."""

PARTS = 4
"""Instants of a step at which candidates are checked for obstacles."""


def scale(mission: Mission) -> float:
    """The least side of the world in the plane, against a typical one."""
    return float(min(np.array(mission.world.high)[:2] - np.array(mission.world.low)[:2])) / TYPICAL


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """A node, the agent to expand it by, with how many trajectories, and what they are drawn from."""

    node: Node
    agent: int
    samples: int
    seed: int


@dataclass(slots=True, eq=False)
class Expansion:
    """``tree_search.Expand``.

    Args:
        goals: the requirements' formulas.
        choices: what the schedule decided; nothing where candidates are free to choose.
        device: where candidates are moved and judged, in float32.
        go_on: whether there is time.
        tell: is told, after an expansion, how many agents are planned and the best margin, metres.

    Source:
        [clot] Algorithm 2, lines 4 to 8.
    """

    mission: Mission
    preset: Preset
    goals: tuple[kernel.Node, ...]
    choices: Choices
    first: FirstMotions
    couplings: Couplings
    device: torch.device
    go_on: Callable[[], bool]
    tell: Callable[[int, float], None]
    team: Team = field(init=False)
    settings: TransportSettings = field(init=False)
    probed: Surroundings = field(init=False)
    checked: Surroundings = field(init=False)
    workers: Children[Piece, tuple[list[Candidate], float]] | None = field(init=False, default=None)
    known: dict[tuple[frozenset[int], int | None, bool], tuple[kernel.Node, ...]] = field(
        init=False, default_factory=dict
    )

    def __post_init__(self) -> None:
        self.team = team(self.mission, self.device)
        self.probed = Surroundings(self.mission, 2, self.device)
        self.checked = Surroundings(self.mission, PARTS, self.device)
        by, given = scale(self.mission), self.preset.transport
        self.settings = replace(given, first_radius=given.first_radius * by, last_radius=given.last_radius * by)

    def __call__(self, work: Sequence[tuple[Node, int]], samples: int, seed: int, /) -> list[list[Candidate]]:
        """Candidates for each node and agent, those that hold."""
        pieces = [Piece(node, agent, samples, seed + number) for number, (node, agent) in enumerate(work)]
        if self.workers is None:
            answers = [self._one(piece) for piece in pieces]
        else:
            by_place = dict(self.workers.answers(pieces))
            answers = [by_place[place] for place in range(len(pieces))]
        for (node, _), (_, margin) in zip(work, answers, strict=True):
            self.tell(len(node.planned) + 1, margin)
        return [candidates for candidates, _ in answers]

    @contextmanager
    def spread(self, processes: int) -> Iterator[None]:
        """Within, pieces of work are shared out to so many child processes; on a GPU all stay in this one."""
        count = min(processes, self.preset.search.wide)  # no round has more pieces
        if count == 1 or self.device.type != "cpu":
            yield
            return
        with children(count, lambda piece, say: self._one(piece), ignore) as self.workers:
            yield
        self.workers = None

    def together(self, samples: int, seed: int) -> list[Candidate]:
        """Joint motions, (agents, steps + 1, dim), of all agents moved at once, those that hold.

        Source:
            [clot] V-A.3 (I), MPOT extended to several robots.
        """
        generator, own = self._generators(seed)
        agents = range(len(self.mission.agents))
        everyone = frozenset(agents)
        first = [self.first.of(agent, None, samples, generator) for agent in agents]
        begin = torch.stack(first, dim=1).to(self.device)
        fixed = torch.stack([self.first.fixed(agent) for agent in agents]).repeat(samples, 1).to(self.device)
        whole = self._goals(everyone, None, False)
        costs = [self._cost(agent, tuple(everyone - {agent}), whole) for agent in agents]

        def cost(waypoints: Tensor, probes: Tensor) -> Tensor:
            joint = waypoints.unflatten(0, (samples, len(agents)))
            moved = probes.unflatten(0, (samples, len(agents)))
            each = [
                of(joint[:, agent], moved[:, agent], joint[:, list(of.others)])
                for agent, of in zip(agents, costs, strict=True)
            ]
            return torch.stack(each, dim=1).flatten(0, 1)

        def done(_: Tensor) -> bool:
            return not self.go_on()

        motions = transport(begin.flatten(0, 1), fixed, cost, self.settings, own, done)
        joint = motions.unflatten(0, (samples, len(agents)))
        margins = [self._margin(agent, joint[:, agent], joint, everyone) for agent in agents]
        margin = torch.stack(margins).amin(dim=0)
        self.tell(len(agents), float(margin.max()))
        value = torch.stack([self._effort(joint[:, agent]) for agent in agents]).sum(dim=0)
        return self._candidates(joint, margin, margin, value)

    def _one(self, piece: Piece) -> tuple[list[Candidate], float]:
        """The candidates of a piece that hold, and the best margin of any, metres."""
        node, agent, samples = piece.node, piece.agent, piece.samples
        generator, own = self._generators(piece.seed)
        others = node.planned
        known = frozenset((*others, agent))
        begin = self.first.of(agent, self._parent(node, agent), samples, generator).to(self.device)
        fixed = self.first.fixed(agent).to(self.device)
        planned = torch.from_numpy(node.trajectories).float().reshape(1, len(others), *begin.shape[1:])
        planned = planned.to(self.device)
        of = self._cost(agent, others, self._goals(known, agent, True))

        def cost(waypoints: Tensor, probes: Tensor) -> Tensor:
            return of(waypoints, probes, planned)

        def done(waypoints: Tensor) -> bool:
            if not self.go_on():
                return True
            if not self.preset.settled:
                return False
            margin = self._margin_among(agent, others, waypoints, planned, known, False)
            return int((margin > 0.0).sum()) >= max(2, samples // 4)

        motions = transport(begin, fixed, cost, self.settings, own, done)
        margin = self._margin_among(agent, others, motions, planned, known, False)
        as_whole = self._margin_among(agent, others, motions, planned, known, True)
        return self._candidates(motions, margin, as_whole, self._effort(motions)), float(margin.max())

    def _generators(self, seed: int) -> tuple[torch.Generator, torch.Generator]:
        """For what is drawn on the CPU, and for what is drawn on the device; one and the same where that is the CPU."""
        drawn = seeded(seed, torch.device("cpu"))
        return drawn, drawn if self.device.type == "cpu" else seeded(seed, self.device)

    def _parent(self, node: Node, agent: int) -> tuple[int, Array] | None:
        parent = self.couplings.parent(agent, node.planned, self.first.key[0].position)
        return None if parent is None else (parent, node.trajectories[node.planned.index(parent)])

    def _goals(self, known: frozenset[int], newest: int | None, as_whole: bool) -> tuple[kernel.Node, ...]:
        key = known, newest, as_whole
        if key not in self.known:
            self.known[key] = about(self.goals, known, self.choices, newest, as_whole)
        return self.known[key]

    def _cost(self, agent: int, others: tuple[int, ...], goals: tuple[kernel.Node, ...]) -> ProbeCost:
        return ProbeCost(self.mission, self.team, agent, others, goals, self.probed, ProbeWeights(), self.preset.reward)

    def _margin(self, agent: int, own: Tensor, joint: Tensor, known: frozenset[int]) -> Tensor:
        others = tuple(sorted(known - {agent}))
        return self._margin_among(agent, others, own, joint[:, list(others)], known, False)

    def _margin_among(
        self,
        agent: int,
        others: tuple[int, ...],
        own: Tensor,
        planned: Tensor,
        known: frozenset[int],
        as_whole: bool,
    ) -> Tensor:
        goals = self._goals(known, None, as_whole)
        return prefix_margin(self.team, agent, others, own, planned, goals, self.checked)

    def _effort(self, candidates: Tensor) -> Tensor:
        """Way against the size of the world, and a little for bends: without unit, about 1. Source: [clot] (2)."""
        size = TYPICAL * scale(self.mission)
        way = torch.linalg.vector_norm(candidates.diff(dim=1), dim=-1).sum(dim=1)
        bend = torch.linalg.vector_norm(candidates.diff(dim=1).diff(dim=1), dim=-1).sum(dim=1)
        effort: Tensor = (way + bend) / size
        return effort

    def _candidates(self, motions: Tensor, margin: Tensor, as_whole: Tensor, effort: Tensor) -> list[Candidate]:
        """Those that hold but for the slack; room up to what is asked for makes up for a longer way.

        Args:
            margin: by which candidates hold, whatever those do who are still to come, metres.
            as_whole: the same, were those who are planned the whole team: what costs.
        """
        room = ProbeWeights().room
        cost = effort - (as_whole.clamp(max=room) / room)
        feasible = margin > -self.preset.slack
        motions, cost, feasible = motions.cpu(), cost.cpu(), feasible.cpu()
        return [
            Candidate(motion.double().numpy(), float(price), True)
            for motion, price in zip(motions[feasible], cost[feasible], strict=True)
        ]

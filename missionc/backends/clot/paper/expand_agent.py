"""Expansion of a search node: one more agent planned by Algorithm 1; or all agents at once, without a search.

    in   a node of the search and an agent
    out  candidate trajectories of the agent, with cost and feasibility among the agents planned before

Source:
    [clot] Algorithm 2, lines 4 to 8; V-A.3 (I) for all at once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import TypeAlias

import numpy as np
import torch
from torch import Tensor

from missionc.backends.api import ignore
from missionc.backends.clot.optimise.active_set import Choices
from missionc.backends.clot.paper.first_motions import FirstMotions
from missionc.backends.clot.paper.free_distance import Surroundings
from missionc.backends.clot.paper.motion_batch import Team, team
from missionc.backends.clot.paper.planning_sequence import Couplings
from missionc.backends.clot.paper.prefix import asked, spelled_out
from missionc.backends.clot.paper.prefix_check import goal_margins, left_open, prefix_margins
from missionc.backends.clot.paper.probe_cost import ProbeCost
from missionc.backends.clot.paper.search_tree import Node
from missionc.backends.clot.paper.torch_device import seeded
from missionc.backends.clot.paper.transport import transport
from missionc.backends.clot.paper.tree_search import Candidate
from missionc.backends.clot.run.child_processes import Children, children
from missionc.backends.clot.run.presets import Preset
from missionc.backends.clot.settings import ProbeWeights, TransportSettings, clot_settings
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array
from missionc.ir import Mission
from missionc.ir.kernel import nodes as kernel

TYPICAL = 10.0
"""Size of the world, metres, for which radii and deviations of presets are tuned; other sizes scale them."""


def scale(mission: Mission) -> float:
    """Ratio of the world's smallest horizontal side to the typical world size."""
    return float(min(np.array(mission.world.high)[:2] - np.array(mission.world.low)[:2])) / TYPICAL


class Piece(Record, eq=False):
    """Unit of work: a node, the agent to expand it by, the number of trajectories, and the seed of their
    distribution."""

    node: Node
    agent: int
    samples: int
    seed: int


class Crowd(Record, eq=False):
    """Pieces of work with the same planned agents and the same agent to plan, which share one cost function.

    ``planned`` are the trajectories of ``others``, (1 or batch, others, steps + 1, dim), metres.
    """

    agent: int
    others: tuple[int, ...]
    planned: Tensor
    cost: ProbeCost


Goals: TypeAlias = tuple[tuple[kernel.Node, kernel.Node], ...]
"""Goals, each with its restriction to a part of the team (``prefix.asked``)."""


@dataclass(slots=True, eq=False)
class Expansion:
    """Expansion of search nodes by Algorithm 1: the implementation of ``tree_search.Expand``.

    Args:
        goals: formulas of the requirements.
        choices: choices of the schedule; empty if candidates are free.
        device: device of the computations, in float32.
        go_on: function that returns true while time is left.
        tell: receives, after an expansion, the number of planned agents and the best margin, metres.

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
    in_one_batch: bool = field(init=False)
    """True if the pieces of a round form one batch; on a CPU they are planned one by one, or one per process."""
    known: dict[tuple[frozenset[int], int | None, bool], Goals] = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        parts = 4  # times within a step at which candidates are checked for obstacles
        # Steps of the paper's missions, for which the smoothing widths are meant; ``printed`` presets scale them.
        typical_steps = 47
        self.team = team(self.mission, self.device)
        self.probed = Surroundings(self.mission, 2, self.device)
        self.checked = Surroundings(self.mission, parts, self.device)
        self.in_one_batch = self.device.type != "cpu" and not self.preset.settled
        by, given = scale(self.mission), self.preset.transport
        self.settings = replace(given, first_radius=given.first_radius * by, last_radius=given.last_radius * by)
        if self.preset.search.printed:
            longer = self.mission.steps / typical_steps
            first, last = given.first_width * longer, given.last_width * longer
            self.settings = replace(self.settings, first_width=first, last_width=last)

    def __call__(self, work: Sequence[tuple[Node, int]], samples: int, seed: int, /) -> list[list[Candidate]]:
        """Feasible candidates for each pair of node and agent."""
        pieces = [Piece(node, agent, samples, seed + number) for number, (node, agent) in enumerate(work)]
        if self.workers is not None:
            by_place = dict(self.workers.answers(pieces))
            answers = [by_place[place] for place in range(len(pieces))]
        elif self.in_one_batch:
            answers = self._planned(pieces)
        else:
            answers = [answer for piece in pieces for answer in self._planned([piece])]
        for (node, _), (_, margin) in zip(work, answers, strict=True):
            self.tell(len(node.planned) + 1, margin)
        return [candidates for candidates, _ in answers]

    @contextmanager
    def spread(self, processes: int) -> Iterator[None]:
        """Context in which pieces of work are distributed to child processes; on a GPU all stay in this process."""
        count = min(processes, max(self.preset.search.wide, self.preset.search.narrow))  # no round has more pieces
        if count == 1 or self.device.type != "cpu":
            yield
            return
        with children(count, lambda piece, say: self._planned([piece])[0], ignore) as self.workers:
            yield
        self.workers = None

    def together(self, samples: int, seed: int) -> list[Candidate]:
        """Feasible joint trajectories, (agents, steps + 1, dim), metres, from moving all agents at once.

        Source:
            [clot] V-A.3 (I), MPOT extended to several robots.
        """
        generator, own = self._generators(seed)
        agents = range(len(self.mission.agents))
        everyone = frozenset(agents)
        first = [self.first.of(agent, None, samples, generator) for agent in agents]
        begin = torch.stack(first, dim=1).to(self.device)
        fixed = torch.stack([self.first.fixed(agent) for agent in agents]).repeat(samples, 1).to(self.device)
        costs = [self._cost(agent, tuple(sorted(everyone - {agent})), False) for agent in agents]

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
        margins = []
        for agent, of in zip(agents, costs, strict=True):
            one = Crowd(agent, of.others, joint[:, list(of.others)], of)
            margins.append(self._margins(one, joint[:, agent], False)[0])
        margin = torch.stack(margins).amin(dim=0)
        self.tell(len(agents), float(margin.max()))
        effort = torch.stack([self._effort(joint[:, agent]) for agent in agents]).sum(dim=0)
        return self._candidates(joint, margin, effort - self._spare(margin))

    def _planned(self, pieces: Sequence[Piece]) -> list[tuple[list[Candidate], float]]:
        """Feasible candidates of each piece of work, and their best margin, metres; all are optimised in one batch.

        Source:
            [clot] IV-C.2: the trajectories of all selected nodes are optimised as one batch.
        """
        samples = pieces[0].samples
        drawn = [self._generators(piece.seed) for piece in pieces]
        first = [
            self.first.of(piece.agent, self._parent(piece.node, piece.agent), samples, generator)
            for piece, (generator, _) in zip(pieces, drawn, strict=True)
        ]
        fixed = torch.cat([self.first.fixed(piece.agent).expand(samples, -1) for piece in pieces]).to(self.device)
        alike: dict[tuple[int, tuple[int, ...]], list[int]] = {}
        for number, piece in enumerate(pieces):
            alike.setdefault((piece.agent, tuple(sorted(piece.node.planned))), []).append(number)
        order = [number for numbers in alike.values() for number in numbers]
        crowds = [self._crowd([pieces[number] for number in numbers]) for numbers in alike.values()]
        sizes = [samples * len(numbers) for numbers in alike.values()]

        def cost(waypoints: Tensor, probes: Tensor) -> Tensor:
            shares = zip(crowds, waypoints.split(sizes), probes.split(sizes), strict=True)
            return torch.cat([crowd.cost(own, moved, crowd.planned) for crowd, own, moved in shares])

        def done(waypoints: Tensor) -> bool:
            if not self.go_on():
                return True
            if not self.preset.settled:
                return False
            return all(
                int((self._margins(crowd, own, False)[0] > 0.0).sum()) >= max(2, samples // 4)
                for crowd, own in zip(crowds, waypoints.split(sizes), strict=True)
            )

        begin = torch.cat([first[number] for number in order]).to(self.device)
        generators = [drawn[number][1] for number in order]
        moved = transport(begin, fixed, cost, self.settings, generators, done)
        answers: dict[int, tuple[list[Candidate], float]] = {}
        for crowd, numbers, own in zip(crowds, alike.values(), moved.split(sizes), strict=True):
            answers |= dict(zip(numbers, self._held(crowd, own, samples), strict=True))
        return [answers[number] for number in range(len(pieces))]

    def _crowd(self, pieces: Sequence[Piece]) -> Crowd:
        """Common data of pieces of work with the same planned agents and the same agent to plan."""
        agent, others = pieces[0].agent, tuple(sorted(pieces[0].node.planned))
        each = [piece.node.trajectories[np.argsort(piece.node.planned)] for piece in pieces] if others else []
        shape = len(pieces), len(others), self.mission.steps + 1, self.mission.dimension
        joint = torch.from_numpy(np.array(each, dtype=np.float32)).reshape(shape)
        joint = joint.repeat_interleave(pieces[0].samples, dim=0) if len(pieces) > 1 else joint
        planned = joint.to(self.device)
        return Crowd(agent, others, planned, self._cost(agent, others, True, planned))

    def _held(self, crowd: Crowd, motions: Tensor, samples: int) -> list[tuple[list[Candidate], float]]:
        """Feasible candidates of each piece of work in a crowd, and their best margin, metres.

        The cost of a trajectory is its effort minus its margin with the planned agents as the whole team. With
        ``printed``, shortfalls of goals cost their metres, so that ξ of (9) stays about as large as the number of
        robots.

        Args:
            motions: (batch, steps + 1, dim), metres.
        """
        margin, whole = self._margins(crowd, motions, True)
        effort = self._effort(motions)
        if self.preset.search.printed:
            lacks = (self.weights.room - whole[1:]).clamp_min(0.0).sum(dim=0)
            cost = effort + lacks - self._spare(torch.minimum(margin, whole.amin(dim=0)).clamp_min(0.0))
        else:
            cost = effort - self._spare(whole.amin(dim=0))
        shares = zip(motions.split(samples), margin.split(samples), cost.split(samples), strict=True)
        return [(self._candidates(own, by, price), float(by.max())) for own, by, price in shares]

    def _generators(self, seed: int) -> tuple[torch.Generator, torch.Generator]:
        """Random generators for draws on the CPU, and on the device; the same generator if the device is the CPU."""
        drawn = seeded(seed, torch.device("cpu"))
        return drawn, drawn if self.device.type == "cpu" else seeded(seed, self.device)

    def _parent(self, node: Node, agent: int) -> tuple[int, Array] | None:
        parent = self.couplings.parent(agent, node.planned, self.first.key[0].position)
        return None if parent is None else (parent, node.trajectories[node.planned.index(parent)])

    def _goals(self, known: frozenset[int], newest: int | None, as_whole: bool) -> Goals:
        key = known, newest, as_whole
        if key not in self.known:
            self.known[key] = asked(self.goals, known, self.choices, newest, as_whole)
        return self.known[key]

    def _cost(self, agent: int, others: tuple[int, ...], as_whole: bool, planned: Tensor | None = None) -> ProbeCost:
        known, newest = frozenset((*others, agent)), agent if as_whole else None
        goals = self._goals(known, newest, as_whole)
        kept = {root for root, _ in self._goals(known, newest, False)}
        forms, weights, reward = tuple(form for _, form in goals), self.weights, self.preset.reward
        shares: tuple[float, ...] = ()
        printed = self.preset.search.printed
        if printed:
            shares = tuple(1.0 if root in kept else weights.later for root, _ in goals)
            forms = tuple(self._spelled(root, form, agent, others, planned) for root, form in goals)
            weights = replace(weights, limits=weights.bodies)
        return ProbeCost(self.mission, self.team, agent, others, forms, self.probed, weights, reward, shares, printed)

    def _spelled(
        self, root: kernel.Node, form: kernel.Node, agent: int, others: tuple[int, ...], planned: Tensor | None
    ) -> kernel.Node:
        """Goal with ``until`` expanded; of a disjunction, without the parts that planned agents exclude.

        With means, a disjunct that the planned agents narrowly miss has a higher value than a disjunct that only this
        agent can still satisfy. A region that planned agents pass hides the approach of this agent. Agents with a
        target leave such a region to others.
        """
        before = dict(self._goals(frozenset(others), None, False)).get(root, form)
        spelled, known = spelled_out((form, before), self.mission.steps)
        may_be_lost = isinstance(form, kernel.Until) or agent not in self.first.targets
        if isinstance(spelled, kernel.Any) and isinstance(known, kernel.Any) and may_be_lost and others:
            return spelled if planned is None else left_open(spelled, known, self.team, others, planned)
        return spelled

    def _margins(self, crowd: Crowd, own: Tensor, as_whole: bool) -> tuple[Tensor, Tensor]:
        """Margins of candidates, (batch,), metres, whatever later agents do.

        The second result contains values with the planned agents as the whole team, (1 + goals, batch), metres: bodies
        and limits first, then each goal.
        """
        known = frozenset((*crowd.others, crowd.agent))
        hard, whole = (tuple(form for _, form in self._goals(known, None, how)) for how in (False, True))
        among = self.team, crowd.agent, crowd.others, own, crowd.planned
        as_flown = not self.preset.polished  # polish corrects the ends
        margins = prefix_margins(*among, hard, self.checked, as_flown)
        worth = torch.cat([margins[:1], goal_margins(*among, whole)]) if as_whole else margins
        return margins.amin(dim=0), worth

    def _effort(self, candidates: Tensor) -> Tensor:
        """Effort of candidates: path length relative to the world's size, plus a small bend cost; (batch,),
        dimensionless, near 1.

        Source:
            [clot] (2).
        """
        size = TYPICAL * scale(self.mission)
        way = torch.linalg.vector_norm(candidates.diff(dim=1), dim=-1).sum(dim=1)
        bend = torch.linalg.vector_norm(candidates.diff(dim=1).diff(dim=1), dim=-1).sum(dim=1)
        effort: Tensor = (way + bend) / size
        return effort

    def _candidates(self, motions: Tensor, margin: Tensor, cost: Tensor) -> list[Candidate]:
        """Candidates that are feasible up to the preset's slack.

        Args:
            motions: (batch, steps + 1, dim), metres.
            margin: margin of each candidate, (batch,), metres.
        """
        feasible = margin > -self.preset.slack
        motions, cost, feasible = motions.cpu(), cost.cpu(), feasible.cpu()
        return [
            Candidate(motion.double().numpy(), float(price), True)
            for motion, price in zip(motions[feasible], cost[feasible], strict=True)
        ]

    @property
    def weights(self) -> ProbeWeights:
        return clot_settings(self.mission).probe

    def _spare(self, margin: Tensor) -> Tensor:
        """Value of clearance, (batch,), dimensionless, up to the target clearance in metres; this value compensates a
        longer path."""
        room = self.weights.room
        worth: Tensor = margin.clamp(max=room) / room
        return worth

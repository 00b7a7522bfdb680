"""Run of Algorithm 2 over Algorithm 1 for a preset, from the first to the last agent.

Source:
    [clot] Algorithm 2.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import torch

from missionc.backends.api import Budget, Progress, UnusableSnapshot
from missionc.backends.clot.paper.expand_agent import Expansion, scale
from missionc.backends.clot.paper.first_motions import FirstMotions
from missionc.backends.clot.paper.planning_sequence import Couplings, Offers, couplings, in_order
from missionc.backends.clot.paper.search_checkpoint import from_arrays, to_arrays
from missionc.backends.clot.paper.torch_device import enough_memory, one_thread
from missionc.backends.clot.paper.tree_search import TreeSearch
from missionc.backends.clot.run.presets import Preset, SequenceChoice
from missionc.backends.clot.run.run_state import UNUSABLE, Searched, Searching
from missionc.backends.clot.schedule.draft import WarmStart
from missionc.backends.clot.schedule.geodesics import Geodesics
from missionc.base.trace import Array
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel


@one_thread()
@enough_memory()
def run_algorithm_2(
    mission: Mission,
    kernel: Kernel,
    graph: Kernel,
    preset: Preset,
    begun: WarmStart,
    geodesics: Geodesics,
    generator: np.random.Generator,
    budget: Budget,
    go_on: Callable[[], bool],
    attempt: int,
    device: str,
    processes: int,
    keep: Callable[[Searching], None],
    resume: Searching | None,
) -> Searched:
    """Joint trajectories that Algorithm 2 finds for a preset, and its progress.

    Each trajectory is feasible by the preset's own check, up to its slack; the caller decides if it is a plan.

    Args:
        attempt: index of the attempt for progress reports, from 1.
        device: device of Algorithm 1's batches.
        processes: number of processes that plan the pieces of a round in parallel.
        keep: receives the state of the search before each round.
        resume: state of an interrupted search; None to start from the beginning.

    Raises:
        UnusableSnapshot: ``resume`` is not a state of this search.

    Source:
        [clot] Algorithm 2; V-A.3 (I) and (II) for presets without a search.
    """
    returned = 3  # joint motions, the cheapest
    agents = len(mission.agents)
    starts = begun.key[0].position
    most, best = (0, -np.inf) if resume is None else (resume.planned, resume.margin)

    def tell(planned: int, margin: float) -> None:
        nonlocal best, most
        if planned > most:
            best, most = margin, planned
        best = max(best, margin) if planned == most else best
        budget.on_progress(Progress("search", attempt, planned=(most, agents), margin=best))

    targets = _targets(begun, mission) if preset.search.printed else frozenset()
    first = FirstMotions(
        mission,
        begun.key,
        begun.schedule if preset.seeded else None,
        begun.motion if preset.seeded else None,
        geodesics,
        preset.deviation * scale(mission),
        follows=preset.search.printed,
        targets=targets,
    )
    coupled = couplings(mission, kernel, starts, nearest=preset.search.printed)
    expansion = Expansion(
        mission,
        preset,
        tuple(wanted.formula for wanted in graph.requirements),
        begun.schedule.choices if preset.seeded else {},
        first,
        coupled,
        torch.device(device),
        go_on,
        tell,
    )
    if preset.order is SequenceChoice.TOGETHER:
        candidates = expansion.together(preset.search.many_samples, int(generator.integers(2**63)))
        together = sorted(candidates, key=lambda one: one.cost)[:returned]
        return Searched(tuple(each.trajectory for each in together), most, best, 1, len(candidates))
    offers = _offers(preset, coupled, starts)
    if resume is None:
        search = TreeSearch(agents, offers, expansion, preset.search, generator)
    else:
        try:
            search = from_arrays(resume.arrays, resume.text, agents, offers, expansion, preset.search)
        except UNUSABLE as wrong:
            raise UnusableSnapshot(str(wrong)) from wrong
    # The agent with the longest path to a target, in tenths of the world's width, has the least choice.
    ways = np.linalg.norm(begun.key[-1].position - starts, axis=1) / scale(mission)
    search.ranks = tuple(-round(float(ways[agent])) if agent in targets else 0 for agent in range(agents))

    def stop() -> bool:
        """Return true to end the search; otherwise save its state, since an interrupted round is not part of the
        state."""
        if not go_on():
            return True
        keep(Searching(*to_arrays(search), most, best))
        return False

    with expansion.spread(processes):
        solutions = search.run(budget.deadline, stop).solutions
    cheapest = tuple(solution.trajectories for solution in solutions[:returned])
    return Searched(cheapest, most, best, search.rounds, len(solutions))


def _offers(preset: Preset, coupled: Couplings, starts: Array) -> Offers:
    """Function that offers the next agents for a preset; a fixed sequence begins nearest to the mean of all starts.

    Args:
        starts: (agents, dim), metres.
    """
    if preset.order is SequenceChoice.SEARCHED:
        return coupled.valid_agents if preset.search.printed else coupled.next_agents
    middle = np.linalg.norm(starts - starts.mean(axis=0), axis=1)
    return in_order(coupled.breadth_first(int(middle.argmin())))


def _targets(begun: WarmStart, mission: Mission) -> frozenset[int]:
    """Agents that must be in a region or in a formation until the end."""
    visits = [each.visit for each in begun.schedule.appointments if each.step + each.visit.lasts >= mission.steps]
    return frozenset().union(*(visit.agents for visit in visits if visit.lasts > 0))

"""Algorithm 2 of [strel] as printed: one roadmap per agent, one query to Z3, and a check of its model.

    in   Mission, its kernel
    out  Planned or NotFound

The encoding differs from the mission in the paper's conventions: ``until`` also requires its left side at the last
step, routes have at least one link, and bodies are ignored. A model is therefore a plan only if the mission accepts it,
and the absence of a model proves nothing about the mission.

Source:
    [strel] Algorithm 2.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np

from missionc.backends.acceptance import attempt
from missionc.backends.api import Attempt, Budget, NotFound, Outcome, Planned, Progress, Reason
from missionc.backends.run_account import Account
from missionc.backends.smt.lift import lift
from missionc.backends.smt.paper.ask_solver import NoModel, ask_solver, node_links, problem
from missionc.backends.smt.paper.build_prm import build_prms
from missionc.backends.smt.paper.colliding_moves import colliding_moves
from missionc.backends.smt.paper.specify import specify
from missionc.backends.smt.roadmap.roadmap import NoRoadmap
from missionc.backends.smt.roadmap.roadmap_graph import graphs_of
from missionc.backends.smt.sat.solve import Stopped
from missionc.base.memory import left
from missionc.base.solved import Solved
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel


def plan_as_published(mission: Mission, kernel: Kernel, budget: Budget, *, apart: bool = False) -> Outcome:
    """Outcome of the published method: a plan if the model that Z3 finds on the roadmaps satisfies the mission.

    Args:
        apart: True to exclude collisions of agents, unlike the paper.
    """
    account = Account()

    def not_found(reason: Reason, statement: str, best: Attempt | None = None) -> NotFound:
        return NotFound(reason, statement, account.report(), best)

    budget.on_progress(Progress("roadmap"))
    with account.stage("roadmap"):
        prms = build_prms(mission, np.random.default_rng(budget.seed))
    if isinstance(prms, NoRoadmap):
        return not_found(Reason.NO_ROADMAP, prms.statement)
    nodes = round(sum(len(prm.nodes) for prm in prms) / len(prms))
    account.sizes["nodes"], account.sizes["states"] = nodes, sum(len(prm.position) for prm in prms)
    specification = specify(mission, prms)
    with account.stage("links"):
        links = [node_links(graph, prms) for graph in specification.graphs]
    collisions = []
    if apart:
        with account.stage("collisions"):
            collisions = [
                (one, other, colliding_moves(mission, prms[one], prms[other]).tolist())
                for one, other in combinations(range(len(prms)), 2)
            ]
    budget.on_progress(Progress("encode"))
    answer = ask_solver(
        problem(specification, prms, links, collisions),
        left(budget.memory_bytes),
        budget.seed,
        budget.deadline,
        account,
        lambda: budget.on_progress(Progress("solve")),
    )
    if isinstance(answer, Stopped):
        return not_found(answer.reason, answer.detail)
    if isinstance(answer, NoModel):
        return not_found(Reason.METHOD, f"on roadmaps of {nodes} nodes the encoding of [strel] has no model")
    trace = lift(answer, prms, mission)
    judged = attempt(mission, kernel, trace)
    if not judged.is_plan:
        leaves = "" if apart else " (without collisions)"
        return not_found(Reason.METHOD, f"the model of the encoding{leaves} violates the mission", judged)
    account.solved = (Solved("z3", mission.names),)
    return Planned(trace, replace(account.report(), roadmaps=graphs_of(mission, prms)))

"""Algorithm 2 of [strel] as printed: one roadmap per agent, one query to Z3, and a check of its model.

    in   Mission, its kernel
    out  Planned or NotFound

The encoding differs from the mission in the paper's conventions: ``until`` also requires its left side at the last
step, routes have at least one link, and bodies are ignored. A model is therefore a plan only if the mission accepts it,
and the absence of a model proves nothing about the mission.

Source:
    [strel] Algorithm 2.

Colliding moves: pairs of roadmap moves that bring two agents' centres too close to each other.

Requirements of a mission in the logic of [strel], over the states of each agent's roadmap.

    in   Mission, one Roadmap for each agent
    out  Specification

Derived operators are expanded to operators with an encoding: ``somewhere``, ``everywhere`` and ``surround`` by *reach*
and *escape*, ``implies`` by *not* and *or*, ``every`` and ``some`` by *and* and *or* over agents.

Source:
    [strel] Definition 4 and its derived operators.

Parent side of the process that encodes and solves: one problem in JSON, one answer; the child ends with its
parent.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import combinations
from pathlib import Path
from typing import Any, TypeAlias, assert_never

import numpy as np
from scipy.spatial import cKDTree

from missionc import ir
from missionc.backends.acceptance import attempt
from missionc.backends.api import Attempt, Budget, NotFound, Outcome, Planned, Progress, Reason
from missionc.backends.run_account import Account
from missionc.backends.smt.lift import lift
from missionc.backends.smt.paper.build_prm import build_prms
from missionc.backends.smt.refine.lazy_constraints import CUSHION, metric, needed
from missionc.backends.smt.roadmap.labels import Labels
from missionc.backends.smt.roadmap.roadmap import NoRoadmap, Roadmap
from missionc.backends.smt.roadmap.roadmap_graph import graphs_of
from missionc.backends.smt.sat.solve import OUT_OF_MEMORY, Stopped, package_folder
from missionc.backends.smt.sat.solver_process import Process, wait
from missionc.base.late_dataclass import Record
from missionc.base.memory import left
from missionc.base.trace import Indices, Solved
from missionc.geometry.relative_motion import closest_approach
from missionc.geometry.required_separation import SpacingTable
from missionc.ir import Graph, Mission
from missionc.ir.kernel.nodes import Kernel
from missionc.ir.language.margins.links import places_linked
from missionc.ir.language.walk_formulas import formulas_bottom_up


def colliding_moves(mission: Mission, one: Roadmap, other: Roadmap) -> Indices:
    """Pairs of moves, (pairs, 2), one of each roadmap, that two agents cannot make in one step.

    Each roadmap has one agent with first-order dynamics. The required distance is the same as in ``collisions``.
    """
    agents = np.array([one.agents[0], other.agents[0]])
    first, second = (roadmap.motions(mission) for roadmap in (one, other))
    fastest = sum(mission.agents[agent].dynamics.top_speed for agent in agents.tolist())
    reach = SpacingTable.of(mission).widest + CUSHION + fastest * mission.step
    near = cKDTree(first.position).sparse_distance_matrix(cKDTree(second.position), reach, output_type="coo_matrix")
    row, column = near.row.astype(np.int64), near.col.astype(np.int64)
    factors = metric(agents[0], agents[1], mission)
    nearest = closest_approach(first.take(row), second.take(column), mission.step, factors)
    closer = nearest < needed(agents[0], agents[1], mission)
    return np.stack([row[closer], column[closer]], axis=1)


Term: TypeAlias = list[Any]
"""Formula in JSON: the operator's word, then the indices of its children and its bounds."""


@dataclass(slots=True)
class Specification:
    """Formulas by index, children first; the last formula must be true for the team at step 0.

    Args:
        graphs: graphs used, by their indices in *reach* and *escape*.
    """

    terms: list[Term] = field(default_factory=list)
    graphs: list[ir.Graph] = field(default_factory=list)

    def add(self, *term: Any) -> int:
        """Add a formula and return its index."""
        self.terms.append([*term])
        return len(self.terms) - 1

    def graph(self, graph: ir.Graph) -> int:
        """Index of a graph, which is added if it is new."""
        if graph not in self.graphs:
            self.graphs.append(graph)
        return self.graphs.index(graph)


def specify(mission: ir.Mission, prms: tuple[Roadmap, ...]) -> Specification:
    """Conjunction of all requirements of a mission that the logic of [strel] can express."""
    spec, labels = Specification(), Labels(mission, prms)
    known: dict[ir.Formula, int] = {}
    for formula in formulas_bottom_up(each.formula for each in mission.requirements):
        known[formula] = _term(formula, known, spec, labels, mission.steps)
    spec.add("and", [known[each.formula] for each in mission.requirements])
    return spec


def _term(formula: ir.Formula, known: dict[ir.Formula, int], spec: Specification, labels: Labels, steps: int) -> int:
    match formula:
        case ir.Truth(value):
            return spec.add("and" if value else "or", [])
        case ir.Holds(predicate):
            agents = range(len(labels.roadmaps))
            return spec.add("states", [labels.states(predicate, agent).nonzero()[0].tolist() for agent in agents])
        case ir.Belongs(agents):
            return spec.add("agents", list(agents.agents))
        case ir.AtLeastOf(kind, _, agents, body):
            parts = [spec.add("of", agent, known[body]) for agent in agents.agents]
            return spec.add("and" if kind == "every" else "or", parts)
        case ir.OfAgent(agent, body):
            return spec.add("of", agent, known[body])
        case ir.Apply(operator, operands, bounds):
            below = [known[operand] for operand in operands]
            if isinstance(bounds, ir.Length):
                return _spatial(operator.name, below, bounds, spec)
            if isinstance(bounds, ir.Window):
                return spec.add(operator.name, *below, bounds.low, bounds.high)
            return _boolean(operator.name, below, spec)
        case ir.Without():
            raise AssertionError("`without any` is rejected before the specification")
        case _:
            assert_never(formula)


def _boolean(name: str, below: list[int], spec: Specification) -> int:
    if name == "not":
        return spec.add("not", *below)
    if name == "implies":
        condition, consequence = below
        return spec.add("or", [spec.add("not", condition), consequence])
    return spec.add(name, below)


def _spatial(name: str, below: list[int], length: ir.Length, spec: Specification) -> int:
    graph = spec.graph(length.graph)
    most = len(length.graph.agents) - 1
    low, high = math.ceil(max(length.low, 0)), min(length.high, most)
    high = math.floor(high)
    true = spec.add("and", [])
    match name:
        case "reach":
            return spec.add("reach", *below, graph, max(low, 1), high)
        case "escape":
            return spec.add("escape", *below, graph, low, high)
        case "somewhere":
            return spec.add("reach", true, *below, graph, max(low, 1), high)
        case "everywhere":
            broken = spec.add("not", *below)
            return spec.add("not", spec.add("reach", true, broken, graph, max(low, 1), high))
        case _:  # surround
            inner, border = below
            outside = spec.add("not", spec.add("or", [inner, border]))
            leaves = spec.add("reach", inner, outside, graph, 1, high)
            far = spec.add("escape", inner, graph, high + 1, most)
            return spec.add("and", [inner, spec.add("not", leaves), spec.add("not", far)])


WORKER = Path(__file__).with_name("worker.py")

Pairs: TypeAlias = list[tuple[int, int, list[list[int]]]]
"""For every two agents, the first with the lower index, pairs of their states or moves."""


class NoModel(Record):
    """Answer that the encoding has no model."""


def node_links(graph: Graph, prms: tuple[Roadmap, ...]) -> Pairs:
    """Edges of the timeless graph: pairs of states of each two agents that share a link.

    Source:
        [strel] "Multi-agent PRM", the redefined ε-proximity graph.
    """
    return [
        (
            one,
            other,
            np.argwhere(places_linked(graph, prms[one].position[:, None], prms[other].position[None])).tolist(),
        )
        for one, other in combinations(sorted(graph.agents), 2)
    ]


def problem(
    specification: Specification, prms: tuple[Roadmap, ...], links: list[Pairs], collisions: Pairs
) -> dict[str, Any]:
    """Problem in the format of ``Encoding``.

    Args:
        collisions: pairs of moves that two agents cannot make together; empty if collisions are ignored.
    """
    return {
        "steps": len(prms[0].standing) - 1,
        "prms": [
            {"states": len(prm.position), "moves": prm.moves.tolist(), "starts": prm.starts[0].tolist()} for prm in prms
        ],
        "collisions": collisions,
        "links": links,
        "members": [list(graph.agents) for graph in specification.graphs],
        "terms": specification.terms,
    }


def ask_solver(
    question: dict[str, Any],
    memory_bytes: int,
    seed: int,
    deadline: float,
    account: Account,
    encoded: Callable[[], None],
) -> Indices | NoModel | Stopped:
    """States of each agent at the steps in a model of the encoding, (agents, steps + 1); or the reason why there are
    none.

    Args:
        memory_bytes: memory limit of the process.
        deadline: end of the query on the clock of ``time.monotonic``, seconds.
        account: receives the processor seconds of the stages ``encode`` and ``solve``.
        encoded: called when all terms are made.
    """
    folders = dict.fromkeys((package_folder("missionc"), package_folder("z3")))
    process = Process([sys.executable, "-I", "-S", str(WORKER), str(memory_bytes), str(seed), *folders])
    stage, said = "encode", b""
    try:
        process.outbox.put(json.dumps(question).encode())
        process.outbox.end()
        while wait([process], deadline):
            process.weigh()
            more = process.read()
            *lines, said = (said + more).split(b"\n")
            for answer in map(json.loads, lines):
                if "seconds" in answer:
                    account.seconds[stage] = answer["seconds"]
                if "states" in answer:
                    return np.array(answer["states"])
                if "refused" in answer:
                    return NoModel()
                if "gave_up" in answer:
                    memory = answer["gave_up"] == "memory"
                    return Stopped(
                        Reason.MEMORY if memory else Reason.SOLVER,
                        f"{answer['gave_up']} while {Progress(stage).activity}",
                    )
                stage = "solve"
                encoded()
            if not more:
                process.close()
                short = process.process.returncode in OUT_OF_MEMORY
                statement = f"the solver process ended while {Progress(stage).activity}"
                return Stopped(Reason.MEMORY if short else Reason.SOLVER, statement)
        return Stopped(Reason.TIME, f"time limit reached while {Progress(stage).activity}")
    finally:
        process.close()
        account.sizes["solver bytes"] = process.peak_bytes


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

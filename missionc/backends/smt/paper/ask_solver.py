"""Parent side of the process that encodes and solves: one problem in JSON, one answer; the child ends with its
parent."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from itertools import combinations
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from missionc.backends.api import Progress, Reason
from missionc.backends.run_account import Account
from missionc.backends.smt.paper.specify import Specification
from missionc.backends.smt.roadmap.roadmap import Roadmap
from missionc.backends.smt.sat.solve import OUT_OF_MEMORY, Stopped, package_folder
from missionc.backends.smt.sat.solver_process import Process, wait
from missionc.base.late_dataclass import Record
from missionc.base.trace import Indices
from missionc.ir import Graph
from missionc.ir.language.margins.links import places_linked

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

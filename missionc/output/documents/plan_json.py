"""The joint plan of all agents as JSON, ``missionc.plan/1``: every number reads back as the same double."""

from __future__ import annotations

import numpy as np

from missionc.base.trace import Plan, Trace, stage_records
from missionc.ir import Graph, Mission
from missionc.ir.couplings import directed
from missionc.ir.language.margins.links import all_links, link_pieces
from missionc.ir.language.margins.resources import flag_truths, levels
from missionc.output.json_layout import compact, document, listed, record


def plan_json(mission: Mission, plan: Plan) -> str:
    """Content of ``plan.json``, one line for each list of states."""
    trace = plan.trace
    states = trace.position.shape[1]
    kept = _kept(mission, trace)
    agents = [
        record(
            {
                "name": agent.name,
                "team": agent.team,
                "radius": float(agent.radius),
                "position": trace.position[agent.index].tolist(),
                "velocity": trace.velocity[agent.index].tolist(),
                "yaw": trace.heading[agent.index].tolist(),
                **kept[agent.index],
            },
            depth=2,
        )
        for agent in mission.agents
    ]
    graphs = {graph.name: _edges(graph, trace) for graph in mission.graphs}
    head = {
        "schema": "missionc.plan/1",
        "mission": plan.mission,
        "backend": plan.backend,
        "seed": plan.seed,
        "step": float(mission.step),
        "horizon": round(mission.step * mission.steps, 9),
        "times": [round(mission.step * step, 9) for step in range(states)],
    }
    requirements = [compact(judgement.as_verdict()) for judgement in plan.judgements]
    return document(
        head
        | ({"solved": [each.as_record() for each in plan.solved]} if plan.solved else {})
        | ({"proven": plan.proven.as_record()} if plan.proven else {}),
        *([listed("stages", map(compact, stage_records(plan.runs)))] if plan.runs else []),
        listed("agents", agents),
        f'  "graphs": {record(graphs, depth=1)}',
        listed("requirements", requirements),
    )


def _kept(mission: Mission, trace: Trace) -> list[dict[str, dict[str, list[float] | list[bool]]]]:
    """Level of each resource and state of each flag at all steps, by agent."""
    kept: list[dict[str, dict[str, list[float] | list[bool]]]] = [{} for _ in mission.agents]
    for resource in mission.resources:
        left = levels(resource, trace)
        for agent in resource.agents:
            kept[agent].setdefault("resources", {})[resource.name] = left[agent].tolist()
    for flag in mission.flags:
        truths = flag_truths(flag, trace)
        for agent in flag.agents:
            kept[agent].setdefault("flags", {})[flag.name] = truths[agent].tolist()
    return kept


def _edges(graph: Graph, trace: Trace) -> list[list[list[int]]]:
    """Links of a communication graph at each step, as pairs of mission indices, (sender, receiver) if they are
    directed.
    """
    members = np.array(graph.agents, dtype=np.int64)
    one_way = directed(graph)
    edges: list[list[list[int]]] = []
    for piece in link_pieces(trace.position.shape[1], len(members)):
        for links in all_links(graph, trace.position[:, piece]):
            linked = links > 0
            pairs = members[np.argwhere(linked if one_way else np.triu(linked))]
            pairs = pairs if one_way else np.sort(pairs, axis=1)
            edges.append(sorted(pairs.tolist()))
    return edges

"""Settings of the smt backend, in groups. ``smt_settings`` gives those of a mission."""

from __future__ import annotations

from dataclasses import field
from functools import lru_cache

from missionc.backends.setting import Pairs, own_values, setting, with_values
from missionc.backends.smt.spec import SMT
from missionc.base.late_dataclass import Record
from missionc.ir import Mission

MOST = 10**6
"""Maximum value of settings that are array sizes."""


class RoadmapSettings(Record):
    """Settings of sampled roadmaps."""

    nodes: int = setting(110, "nodes", "of the first roadmap; more find narrow paths, and need more clauses", 1, MOST)
    neighbors: int = setting(6, "nodes", "that a node is connected to; more shorten plans, for more clauses", 1, 256)
    adaptive: bool = setting(True, "", "shortest paths first, nodes in narrow passages; `nodes` in a mission ends it")
    growth: float = setting(1.7, "", "nodes of the next roadmap, as a multiple of the one before", 1, 100)
    attempts: int = setting(3, "roadmaps", "sampled before the answer is that there is no plan", 1, 20)
    region_nodes: int = setting(3, "nodes", "in every region at least; more give agents more places to stop", 1, 1000)
    region_samples: int = setting(512, "points", "that the nodes of a region are chosen from", 1, MOST)
    spacing: float = setting(0.7, "", "distance of other nodes from named places, as a share of their spacing", 0, 10)
    filling: float = setting(0.5, "", "share of the nodes that fill free space at least", 0, 1)
    bridges: int = setting(4096, "bridges", "tried in the search for narrow passages", 0, MOST)
    growths: int = setting(3, "rounds", "in which isolated nodes get stepping stones", 0, 100)
    stones: int = setting(3, "nodes", "around one isolated node", 1, 1000)
    cruise: float = setting(0.6, "", "speed of nodes in motion, as a share of the top speed", 0.01, 1)
    headings: int = setting(8, "directions", "of nodes in motion", 1, 360)
    states: int = setting(8000, "states", "above which nodes get fewer neighbours", 1, 10**9)
    states_per_node: int = setting(12, "states", "of each node, above which nodes get fewer neighbours", 1, MOST)
    joins: int = setting(2, "edges", "that connect a separate part to the largest part", 1, 1000)
    join_rounds: int = setting(4, "rounds", "in which separate parts are connected", 0, 100)
    detour_steps: float = setting(1.5, "", "steps to a neighbour at most, as a multiple of the quickest", 1, 1000)
    speed_samples: int = setting(8, "points", "of an edge for each step, at which the speed limit is read", 1, 1000)


class ShortestPathSettings(Record):
    """Settings of the roadmap of shortest paths between named places."""

    clearance: float = setting(0.006, "", "spare clearance of paths, as a share of the longest side of the world", 0, 1)
    clearance_radii: float = setting(0.25, "radii", "of spare clearance, if that is more", 0, 100)
    penalty: float = setting(1.1, "", "cost of a path without spare clearance, as a multiple of its length", 1, 100)
    paths: int = setting(2, "paths", "between two places; more give the solver more to choose from", 1, 100)
    detour: float = setting(1.25, "", "cost of a path that is used already, as a multiple of its length", 1, 100)
    stretch: float = setting(1.08, "", "length of paths over the shortest at most; less keeps more edges", 1, 100)
    goal_samples: int = setting(2048, "points", "of the world where a requirement is evaluated", 1, MOST)
    rest_places: int = setting(64, "places", "to rest in for each requirement", 1, MOST)
    depth: float = setting(0.5, "", "depth of places to rest in, as a share of the deepest", 0, 1)
    edge: float = setting(0.15, "", "depth of places where agents enter, as a share of the deepest", 0, 1)
    entries: int = setting(60, "places", "where agents enter, for each requirement", 0, MOST)
    entry_candidates: int = setting(400, "nodes", "that an entry is looked for from", 1, MOST)
    entry_spacing: float = setting(0.7, "steps", "between two entries, each of the longest length", 0, 100)
    volume_samples: int = setting(300, "points", "in a volume, where paths may bend anywhere", 0, MOST)
    waypoints: int = setting(160, "nodes", "on long paths, about", 0, MOST)
    waypoint_steps: int = setting(2, "steps", "between two waypoints at least", 1, 1000)
    nearest: int = setting(40, "nodes", "that a node is connected to in a large roadmap", 1, MOST)
    pairs: int = setting(200_000, "pairs", "of a place and a node that are tried in a large roadmap", 1, 10**9)
    all_pairs: int = setting(400, "nodes", "up to which every pair is tried", 0, 100_000)


class WorkSettings(Record):
    """Work of each method, in units of about one second of one core. More work finds better plans."""

    shortest_paths: float = setting(20.0, "units", "on the roadmap of shortest paths, before sampled ones")
    prioritized: float = setting(30.0, "units", "of prioritized planning on one roadmap")
    prioritized_each: float = setting(2.0, "units", "of prioritized planning for each agent, if that is more")
    first_each: float = setting(2.0, "units", "of its first attempt, for each agent")
    growth: float = setting(2.0, "", "work of its next attempt, as a multiple of the one before", 1.01, 100)
    sooner: float = setting(3.0, "units", "on other roadmaps, for a plan of less duration")
    relief: float = setting(4.0, "units", "after which the other solver is asked", 0.001)
    core: float = setting(1.0, "units", "for a smaller unsatisfiable core at least")
    core_share: float = setting(1.0, "", "work for a smaller core, as a multiple of the question's own")
    conflict: float = setting(5.0, "units", "for the smallest conflict at least")
    conflict_share: float = setting(0.5, "", "work for the smallest conflict, as a multiple of the refusals' own")
    question_share: float = setting(0.25, "", "share of the remaining work that one question may take", 0, 1)
    makespan: float = setting(8.0, "units", "for a shorter duration at least")
    makespan_share: float = setting(2.0, "", "work for a shorter duration, as a multiple of the plan's own")


class SolverSettings(Record):
    """Settings of questions to the SAT solver."""

    all_agents: int = setting(100_000, "moves", "in all, below which an objective is solved for all agents at once", 0)
    links: int = setting(8, "links", "of a route in the first question; the next one has no bound", 1, MOST)
    turn_clauses: int = setting(100_000, "clauses", "of a turn at least", 1, 10**9)
    turn_conflicts: int = setting(500, "conflicts", "of a turn at least", 1, 10**9)
    turn_rounds: int = setting(20, "rounds", "of collision clauses in a turn", 1, MOST)
    presolve_clauses: int = setting(300_000, "clauses", "that presolves read in all; 0 ends presolving", 0, 10**9)
    presolve_conflicts: int = setting(300, "conflicts", "after which a presolve gives up; 0 ends presolving", 0, 10**9)
    eager_clauses: int = setting(20_000, "clauses", "below which collisions are excluded from the start", 0, 10**9)
    improve_work: int = setting(300_000_000, "", "clauses times conflicts of one question for a better plan", 1)
    improve_least: int = setting(500, "conflicts", "of one question for a better plan at least", 1, 10**9)
    improve_most: int = setting(20_000, "conflicts", "of one question for a better plan at most", 1, 10**9)
    improve_rounds: int = setting(60, "rounds", "of collision clauses of one question for a better plan", 1, MOST)
    conflict_conflicts: int = setting(100_000, "conflicts", "of one question for the smallest conflict", 1, 10**9)
    conflict_rounds: int = setting(200, "rounds", "of collision clauses of such a question", 1, MOST)
    relaxation_moves: int = setting(20_000_000, "moves", "in all, above which no agent is refused alone")


class PrioritizedSettings(Record):
    """Settings of prioritized planning: one agent, or a few, at a time."""

    group: int = setting(8, "agents", "planned together; more find tighter plans, and take longer", 1, MOST)
    repairs: int = setting(6, "rounds", "of replanning for agents that break a requirement", 1, MOST)
    failures: int = setting(12, "groups", "without a plan, after which all agents are planned at once", 1, MOST)
    conflicts: int = setting(1000, "conflicts", "of the solver for one group", 1, 10**9)
    rounds: int = setting(50, "rounds", "of collision clauses for one group", 1, MOST)
    single_failures: int = setting(3, "agents", "in a row without a path, after which groups are planned", 1, MOST)
    pushes: int = setting(6, "", "displaced agents at most, as a multiple of all agents", 0, MOST)
    exchanges: int = setting(2, "times", "that two agents displace each other before joint search", 1, 1000)
    exchanges_most: int = setting(4, "times", "that two agents displace each other before one waits", 1, 1000)
    orders: int = setting(6, "orders", "of the agents that are tried", 1, MOST)
    orders_work: int = setting(30_000_000, "moves", "after which no other order is tried", 1)
    search_work: int = setting(100_000_000, "moves", "of all single-agent searches", 1)
    search_work_each: int = setting(3_000_000, "moves", "of all single-agent searches, more for each agent")
    shorter_rounds: int = setting(2, "rounds", "in which each agent's path is replanned by metres", 0, 1000)
    shorter_work: int = setting(60_000_000, "moves", "after which no further such round begins")
    strides: int = setting(8, "parts", "of the excess duration; one is saved first", 1, 1000)
    makespan_failures: int = setting(2, "groups", "without a plan, after which a duration is given up", 1, 1000)
    wait_factor: float = setting(1.25, "", "steps for a goal that others wait for, over the fewest", 1, 100)
    wait_steps: int = setting(2, "steps", "for such a goal beyond that", 0, MOST)
    first_window: int = setting(16, "steps", "of the first windows; each next one is twice as long", 1, MOST)


class SearchSettings(Record):
    """Settings of single-agent search, and joint search of two agents. Costs are in longest moves."""

    haste: float = setting(0.25, "moves", "that a step costs; more makes agents wait at their goals", 0, 100)
    exact: float = setting(0.01, "moves", "of excess cost in the first search", 0, 100)
    slack: float = setting(0.05, "", "excess cost in the second search, as a share of the least cost", 0, 100)
    widening: float = setting(2.0, "", "excess cost in the next search, as a multiple of the one before", 1.01, 100)
    bounds: int = setting(6, "searches", "with a bound on the cost, before one without", 1, 1000)
    unbounded: int = setting(20_000, "moves", "at all steps, up to which the cost is not bounded")
    push: float = setting(8.0, "moves", "that it costs to displace another agent", 0, MOST)
    end: float = setting(6.0, "moves", "that it costs to end in another agent's path", 0, MOST)
    work: int = setting(20_000_000, "moves", "tried in one search", 1)
    joint_edges: int = setting(12_000_000, "moves", "of two agents, above which there is no joint search", 1, 10**9)
    joint_work: int = setting(1_000_000, "moves", "tried in one joint search", 1)
    joint_phases: int = setting(12, "phases", "of a requirement, above which there is no joint search", 1, MOST)
    joint_widening: float = setting(4.0, "", "excess cost in the next joint search, as a multiple", 1.01, 100)
    joint_bounds: int = setting(4, "searches", "of two agents with a bound on the cost", 0, 1000)


class ShorteningSettings(Record):
    """Settings for shortening a plan."""

    rounds: int = setting(4, "paths", "tried for each agent; more find shorter plans", 0, MOST)
    work: int = setting(30_000_000, "entries", "of tables, after which no shorter path is tried")
    units: int = setting(48, "units", "of the excess length at first; clauses grow with the square", 1, 10_000)
    fine_units: int = setting(192, "units", "of the excess length then", 1, 10_000)
    undecided: int = setting(2, "questions", "without an answer, after which no shorter duration is tried", 1, 1000)


class PaperSettings(Record):
    """Settings of the presets `paper` and `paper-apart`, with the nodes of `roadmap`. [strel]"""

    neighbors: int = setting(10, "states", "that a state is connected to", 1, 10_000)
    start_samples: int = setting(5, "states", "of a start region", 0, 10_000)
    draws: int = setting(200, "draws", "before a region counts as empty", 1, MOST)


class SmtSettings(Record):
    """Settings of the smt backend."""

    roadmap: RoadmapSettings = field(default_factory=RoadmapSettings)
    shortest_paths: ShortestPathSettings = field(default_factory=ShortestPathSettings)
    work: WorkSettings = field(default_factory=WorkSettings)
    solver: SolverSettings = field(default_factory=SolverSettings)
    prioritized: PrioritizedSettings = field(default_factory=PrioritizedSettings)
    search: SearchSettings = field(default_factory=SearchSettings)
    shortening: ShorteningSettings = field(default_factory=ShorteningSettings)
    paper: PaperSettings = field(default_factory=PaperSettings)


def smt_settings(mission: Mission) -> SmtSettings:
    """Settings of a mission's planning: the defaults, then its ``solve with`` clause, then ``--set``."""
    return _settings(mission.solve.options, own_values(mission, SMT.name))


@lru_cache(maxsize=64)
def _settings(options: Pairs, values: Pairs) -> SmtSettings:
    said = {name: round(value) for name, value in options}
    own: dict[str, float] = {}
    if "nodes" in said:
        own |= {"roadmap.nodes": said["nodes"], "roadmap.adaptive": False}
    if "neighbors" in said:
        own |= {"roadmap.neighbors": said["neighbors"], "paper.neighbors": said["neighbors"]}
    return with_values(SmtSettings(), own | dict(values))

"""Settings of the smt backend, in groups; ``smt_settings`` returns the settings of a mission."""

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

    nodes: int = setting(110, "nodes of the first roadmap; more nodes find narrow passages, but cost clauses", 1, MOST)
    neighbors: int = setting(6, "neighbours of each node; more neighbours shorten plans but need more clauses", 1, 256)
    adaptive: bool = setting(True, "shortest-path roadmap first, nodes in passages; `nodes` in a mission turns it off")
    growth: float = setting(1.7, "growth factor of the number of nodes from one roadmap to the next", 1, 100)
    attempts: int = setting(3, "number of roadmaps before the backend reports that no plan exists", 1, 20)
    region_nodes: int = setting(3, "fewest nodes in a region; more nodes give more positions to stop", 1, 1000)
    region_samples: int = setting(512, "number of sampled points from which the nodes of a region are chosen", 1, MOST)
    spacing: float = setting(0.7, "smallest distance of nodes from region nodes, relative to the node spacing", 0, 10)
    filling: float = setting(0.5, "smallest fraction of the nodes that is sampled in free space", 0, 1)
    bridges: int = setting(4096, "number of bridge tests in the search for narrow passages", 0, MOST)
    relay_rows: int = setting(8, "number of rows of nodes between two regions, for links between samples", 0, 1000)
    growths: int = setting(3, "number of rounds that add nodes around isolated nodes", 0, 100)
    stones: int = setting(3, "number of nodes added around one isolated node", 1, 1000)
    cruise: float = setting(0.6, "speed of nodes in motion, as a fraction of the top speed", 0.01, 1)
    headings: int = setting(8, "number of headings of nodes in motion", 1, 360)
    states: int = setting(8000, "number of states above which nodes get fewer neighbours", 1, 10**9)
    states_per_node: int = setting(12, "number of states of a node above which nodes get fewer neighbours", 1, MOST)
    joins: int = setting(2, "number of edges that connect a separate component to the largest component", 1, 1000)
    join_rounds: int = setting(4, "number of rounds that connect separate components", 0, 100)
    detour_steps: float = setting(1.5, "longest duration of an edge, relative to the quickest of its node", 1, 1000)
    speed_samples: int = setting(8, "number of points per step of an edge that evaluate the speed limit", 1, 1000)


class ShortestPathSettings(Record):
    """Settings of the roadmap of shortest paths between starts, finishes and regions."""

    clearance: float = setting(0.006, "extra clearance of paths, as a fraction of the longest side of the world", 0, 1)
    clearance_radii: float = setting(0.25, "smallest extra clearance of paths (radii)", 0, 100)
    penalty: float = setting(1.1, "cost of a path without extra clearance, as a multiple of its length", 1, 100)
    paths: int = setting(2, "number of paths between two regions; more paths give the solver more choices", 1, 100)
    detour: float = setting(1.25, "cost of an edge that another path uses already, as a multiple of its length", 1, 100)
    stretch: float = setting(1.08, "largest path length relative to the shortest; less keeps more edges", 1, 100)
    goal_samples: int = setting(2048, "number of sampled points in the world that evaluate a requirement", 1, MOST)
    rest_places: int = setting(64, "number of rest positions for each requirement", 1, MOST)
    depth: float = setting(0.5, "depth of rest positions in a region, as a fraction of the greatest depth", 0, 1)
    edge: float = setting(0.15, "depth of entry positions in a region, as a fraction of the greatest depth", 0, 1)
    entries: int = setting(60, "number of entry positions for each requirement", 0, MOST)
    entry_candidates: int = setting(400, "number of candidate nodes for an entry position", 1, MOST)
    entry_spacing: float = setting(0.7, "distance between two entry positions, in longest steps (steps)", 0, 100)
    volume_samples: int = setting(300, "number of points in a volume at which paths may bend", 0, MOST)
    waypoints: int = setting(160, "approximate number of nodes on long paths", 0, MOST)
    waypoint_steps: int = setting(2, "smallest number of steps between two waypoints", 1, 1000)
    nearest: int = setting(40, "number of neighbours of each node in a large roadmap", 1, MOST)
    pairs: int = setting(200_000, "number of pairs of a region and a node that are tried in a large roadmap", 1, 10**9)
    all_pairs: int = setting(400, "number of nodes up to which all pairs are tried", 0, 100_000)


class WorkSettings(Record):
    """Work limits of each method, in units of about one second of one core. More work finds better plans."""

    shortest_paths: float = setting(20.0, "work on the roadmap of shortest paths, before sampling (units of work)")
    prioritized: float = setting(30.0, "work of prioritized planning on one roadmap (units of work)")
    prioritized_each: float = setting(2.0, "smallest work of prioritized planning for each agent (units of work)")
    first_each: float = setting(2.0, "work of the first attempt of prioritized planning for each agent (units of work)")
    growth: float = setting(2.0, "growth factor of the work from one attempt to the next", 1.01, 100)
    sooner: float = setting(3.0, "work on other roadmaps for a plan of shorter duration (units of work)")
    relief: float = setting(4.0, "work after which the other SAT solver is queried (units of work)", 0.001)
    core: float = setting(1.0, "smallest work for a smaller unsatisfiable core (units of work)")
    core_share: float = setting(1.0, "work for a smaller core, as a multiple of the work of the query")
    conflict: float = setting(5.0, "smallest work for the minimal conflict (units of work)")
    conflict_share: float = setting(0.5, "work for the minimal conflict, as a multiple of the work of the refutations")
    question_share: float = setting(0.25, "fraction of the remaining work that one query may use", 0, 1)
    makespan: float = setting(8.0, "smallest work for a shorter duration (units of work)")
    makespan_share: float = setting(2.0, "work for a shorter duration, as a multiple of the work of the plan")
    between_samples: float = setting(4.0, "smallest work for requirements violated between samples (units of work)")
    between_samples_plans: int = setting(10, "number of plans with other relays between samples", 1, 1000)
    between_samples_share: float = setting(1.0, "work for these requirements, as a multiple of the work of the plan")


class SolverSettings(Record):
    """Settings of SAT queries."""

    all_agents: int = setting(100_000, "number of moves below which an objective is solved for all agents together", 0)
    links: int = setting(8, "number of links of a route in the first query; the next query has no bound", 1, MOST)
    turn_clauses: int = setting(100_000, "smallest number of clauses of a solver turn", 1, 10**9)
    turn_conflicts: int = setting(500, "smallest number of solver conflicts of a turn", 1, 10**9)
    turn_rounds: int = setting(20, "number of rounds of collision clauses in a turn", 1, MOST)
    presolve_clauses: int = setting(300_000, "clauses that presolving reads; 0 turns presolving off", 0, 10**9)
    presolve_conflicts: int = setting(300, "solver conflicts after which presolving stops; 0 turns it off", 0, 10**9)
    eager_clauses: int = setting(20_000, "clauses below which the first encoding excludes all collisions", 0, 10**9)
    improve_work: int = setting(300_000_000, "clauses times solver conflicts of one query for a better plan", 1)
    improve_least: int = setting(500, "smallest number of solver conflicts of one query for a better plan", 1, 10**9)
    improve_most: int = setting(20_000, "largest number of solver conflicts of one query for a better plan", 1, 10**9)
    improve_rounds: int = setting(60, "number of rounds of collision clauses of one query for a better plan", 1, MOST)
    conflict_conflicts: int = setting(100_000, "solver conflicts of one query for the minimal conflict", 1, 10**9)
    conflict_rounds: int = setting(200, "rounds of collision clauses of one query for the minimal conflict", 1, MOST)
    relaxation_moves: int = setting(20_000_000, "number of moves above which single agents are not refuted separately")


class PrioritizedSettings(Record):
    """Settings of prioritized planning, which plans one agent, or a few, at a time."""

    group: int = setting(8, "agents planned together; larger groups find tighter plans but take longer", 1, MOST)
    repairs: int = setting(6, "number of rounds that replan the agents that violate a requirement", 1, MOST)
    failures: int = setting(12, "number of groups without a plan after which all agents are planned together", 1, MOST)
    conflicts: int = setting(1000, "number of solver conflicts for one group", 1, 10**9)
    rounds: int = setting(50, "number of rounds of collision clauses for one group", 1, MOST)
    single_failures: int = setting(3, "consecutive agents without a path after which groups are planned", 1, MOST)
    pushes: int = setting(6, "largest number of displaced agents, as a multiple of the number of agents", 0, MOST)
    exchanges: int = setting(2, "number of mutual displacements of two agents before joint search", 1, 1000)
    exchanges_most: int = setting(4, "number of mutual displacements of two agents before one agent waits", 1, 1000)
    orders: int = setting(6, "number of planning orders of the agents that are tried", 1, MOST)
    orders_work: int = setting(30_000_000, "number of expanded moves after which no other order is tried", 1)
    search_work: int = setting(100_000_000, "number of moves of all single-agent searches together", 1)
    search_work_each: int = setting(3_000_000, "additional number of moves of single-agent searches for each agent")
    shorter_rounds: int = setting(2, "number of rounds that replan the path of each agent by length in metres", 0, 1000)
    shorter_work: int = setting(60_000_000, "number of moves after which no further round for shorter paths begins")
    strides: int = setting(8, "number of parts of the excess duration; the search first saves one part", 1, 1000)
    makespan_failures: int = setting(2, "number of groups without a plan after which a duration is given up", 1, 1000)
    wait_factor: float = setting(1.25, "steps for a goal that other agents wait for, relative to the fewest", 1, 100)
    wait_steps: int = setting(2, "number of additional steps for a goal that other agents wait for", 0, MOST)
    first_window: int = setting(16, "number of steps of the first windows; each next window is twice as long", 1, MOST)


class SearchSettings(Record):
    """Settings of single-agent search, and of joint search for two agents. Costs are in lengths of the longest move."""

    haste: float = setting(0.25, "cost of a time step; a higher cost makes agents wait at their goals (moves)", 0, 100)
    exact: float = setting(0.01, "excess cost allowed in the first search (moves)", 0, 100)
    slack: float = setting(0.05, "excess cost allowed in the second search, as a fraction of the least cost", 0, 100)
    widening: float = setting(2.0, "growth factor of the excess cost from one search to the next", 1.01, 100)
    bounds: int = setting(6, "number of searches with a bound on the cost, before a search without a bound", 1, 1000)
    unbounded: int = setting(20_000, "number of moves at all steps up to which the cost is not bounded")
    push: float = setting(8.0, "cost of displacing another agent (moves)", 0, MOST)
    end: float = setting(6.0, "cost of ending in the path of another agent (moves)", 0, MOST)
    work: int = setting(20_000_000, "number of moves tried in one search", 1)
    joint_edges: int = setting(12_000_000, "moves of two agents above which there is no joint search", 1, 10**9)
    joint_work: int = setting(1_000_000, "number of moves tried in one joint search", 1)
    joint_phases: int = setting(12, "number of phases of a requirement above which there is no joint search", 1, MOST)
    joint_widening: float = setting(4.0, "growth factor of the excess cost between two joint searches", 1.01, 100)
    joint_bounds: int = setting(4, "number of joint searches with a bound on the cost", 0, 1000)


class ShorteningSettings(Record):
    """Settings for shortening the paths of a plan."""

    rounds: int = setting(4, "number of paths tried for each agent; more paths find shorter plans", 0, MOST)
    work: int = setting(30_000_000, "number of table entries after which no shorter path is tried")
    units: int = setting(48, "units of the excess length in the first query; clauses grow with the square", 1, 10_000)
    fine_units: int = setting(192, "number of units of the excess length in later queries", 1, 10_000)
    undecided: int = setting(2, "number of undecided queries after which no shorter duration is tried", 1, 1000)


class PaperSettings(Record):
    """Settings of the presets `paper` and `paper-apart`, with the nodes of `roadmap`. [strel]"""

    neighbors: int = setting(10, "number of neighbours of each state", 1, 10_000)
    start_samples: int = setting(5, "number of sampled states of a start region", 0, 10_000)
    draws: int = setting(200, "number of random draws before a region counts as empty", 1, MOST)


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
    """Settings of a mission's planning: the defaults, changed by its ``solve with`` clause, then by ``--set``."""
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

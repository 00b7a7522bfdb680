"""Settings of the clot backend, in groups; ``clot_settings`` returns the settings of a mission."""

from __future__ import annotations

from dataclasses import field
from enum import Enum, auto
from functools import lru_cache
from typing import ClassVar

from missionc.backends.clot.spec import CLOT
from missionc.backends.setting import Pairs, own_values, setting, with_values
from missionc.base.late_dataclass import Record
from missionc.ir import Mission

MOST = 10**6
"""Maximum value of settings that are array sizes."""


class AttemptSettings(Record):
    """Settings of attempts: each attempt makes a schedule and optimises the trajectory that follows from it."""

    schedules: int = setting(40, "number of schedules before the backend reports that no plan was found", 1, MOST)
    polish: int = setting(60, "iterations of one polish; more iterations repair worse trajectories", 1, 10_000)
    search_every: int = setting(8, "attempts of which the last is a search, if the preset has no search", 1, MOST)
    noise: float = setting(0.4, "relative error of distances in every schedule after the first", 0, 10)
    tours_every: int = setting(3, "number of attempts of which the second begins with tours", 1, MOST)
    near: float = setting(0.2, "largest violation of a trajectory that is polished again (m)", 0, MOST)
    detours: float = setting(0.3, "probability that a team takes another route than the shortest", 0, 1)
    repairs: int = setting(3, "number of repair rounds, each with a new choice of disjuncts and agents", 1, 1000)
    repair_polish: int = setting(80, "number of iterations of one polish in a repair", 1, 10_000)


class ScheduleSettings(Record):
    """Settings of schedules: tasks, the order of visits, and the positions to visit."""

    cells: int = setting(12_000, "number of cells of the distance grid; more cells find narrower paths", 16, MOST)
    detour: float = setting(1.4, "largest length of a path with more clearance, relative to the shortest path", 1, 100)
    speed: float = setting(0.8, "fraction of the top speed that a schedule assumes", 0.01, 1)
    late_speed: float = setting(0.95, "fraction of the top speed that a schedule assumes for a late agent", 0.01, 1)
    work: int = setting(30_000, "number of visits tried in the exchange of tasks", 0, 10**9)
    vain: int = setting(6, "number of unsuccessful exchanges for each task after which the exchange ends", 1, MOST)
    inside: float = setting(0.3, "robustness at the position that an agent visits for a requirement (m)", 0, 1000)
    meeting: float = setting(0.8, "distance of meeting agents, as a fraction of the allowed distance", 0.01, 1)
    passing: float = setting(1.5, "time before and after a visit in which its agent counts as present (steps)", 0, 1000)
    samples: int = setting(256, "number of sampled points of a region from which the deepest are chosen", 1, MOST)
    tour_clearance: float = setting(0.3, "clearance on a tour in addition to the required clearance (m)", 0, 1000)
    stops: int = setting(60, "number of schedules tried with stops to refill a resource", 1, MOST)


class GuessSettings(Record):
    """Settings of joint waypoints and initial trajectories, from which local optimisation starts."""

    iterations: int = setting(40, "number of iterations of the polish of one configuration", 1, 10_000)
    jitter: float = setting(0.02, "random displacement of the agents in a configuration (m)", 0, 100)
    middles: int = setting(400, "number of candidate positions for the centre of a formation", 1, MOST)
    clearance: float = setting(0.1, "clearance in a configuration in addition to the required clearance (m)", 0, 1000)
    team: float = setting(0.5, "largest offset of agents that move together as one group (m)", 0, 1000)
    team_clearance: float = setting(0.3, "additional clearance of agents that move together as one group (m)", 0, 1000)
    grid: int = setting(20_000, "number of cells of the grid for conflict resolution between agents", 16, MOST)
    rounds: int = setting(3, "number of conflict resolution rounds after the first", 0, 1000)
    moving_grid: int = setting(2500, "number of cells of the grid for paths around moving obstacles", 16, MOST)
    meeting: float = setting(60.0, "cost of a conflict between two agents, in squares of cells", 0)


class PolishSettings(Record):
    """Settings of local optimisation (polish): Levenberg-Marquardt on the violated or nearly violated constraints."""

    damping: float = setting(0.001, "initial damping relative to the length term", 1e-9, 1000)
    settled: float = setting(0.01, "smallest relative decrease of the cost for another step", 0, 1)
    enough: float = setting(0.9, "largest missing fraction of a constraint's target margin at the end", 0, 1)
    wide_enough: float = setting(0.15, "largest missing fraction of a constraint's scaled target margin", 0, 1)
    harder: float = setting(4.0, "growth factor of the weight of violated constraints at a local minimum", 1, 1000)
    hardest: float = setting(256.0, "largest weight of violated constraints", 1)
    longest: float = setting(1.0, "largest displacement of a control point in one step (m)", 1e-6, MOST)
    close: float = setting(0.4, "distance beyond the required one within which two bodies have a cost (m)", 0, 1000)
    gap: float = setting(0.1, "distance of points checked for obstacles; smaller cuts fewer corners (m)", 0.001, 100)


class ShorteningSettings(Record):
    """Settings for shortening and smoothing a plan."""

    iterations: int = setting(40, "number of iterations of the polish of a shorter trajectory", 1, 10_000)
    same: float = setting(0.001, "smallest length by which a plan must become shorter (m)", 0, 1000)
    tidy: int = setting(6000, "largest product of control points and steps that is shortened without an objective", 0)
    duration_iterations: int = setting(40, "iterations of the polish of a trajectory of shorter duration", 1, 10_000)
    reach: float = setting(0.4, "trust region of one program, relative to the longest step", 0.01, 100)
    least_reach: float = setting(0.05, "smallest trust region, relative to the longest step", 1e-6, 100)
    least_ascent: float = setting(0.005, "smallest trust region for robustness, relative to the step", 1e-6, 100)
    ascent: int = setting(60, "number of programs for the objective `maximize robustness`", 0, 100_000)
    near: float = setting(0.15, "margin above which a program omits a constraint (m)", 0, 1000)
    straighten: int = setting(60_000, "largest product of control points and steps for straightening a roadmap plan", 0)
    straighten_polish: int = setting(40, "number of iterations of a polish for more clearance", 0, 10_000)
    longer: float = setting(0.02, "largest relative increase of the length of a plan with more clearance", 0, 10)
    wider: float = setting(0.01, "least gain of the roots of normalised margins for which a plan may be longer", 0, 1)
    margin: float = setting(0.15, "normalised margin above which a plan is not lengthened for more margin", 0, 1)
    longer_margin: float = setting(0.1, "largest relative increase of the length of a plan with a wider margin", 0, 10)
    wide: float = setting(0.18, "target of a polish for wider margins, relative to the margin's natural scale", 0, 1)
    wide_tries: int = setting(4, "number of polishes for wider margins; they bisect the share of these margins", 1, 20)
    restores: int = setting(3, "number of rounds that restore agents with violations", 1, 1000)
    top: float = setting(0.97, "largest fraction of the top speed and acceleration that a plan uses", 0.01, 1)
    retiming: int = setting(40_000_000, "largest product of nodes, steps and agents for a search of other speeds", 0)


class Weights(Record):
    """Weights of the cost terms of a joint trajectory."""

    title: ClassVar[str] = "weight"
    task: float = setting(400.0, "cost of the squared shortfall of a robustness margin (/m^2)")
    bodies: float = setting(400.0, "cost of the squared violation of obstacles, separation and world bounds (/m^2)")
    limits: float = setting(400.0, "cost of the squared excess of speed, acceleration and turning rate (/m^2)")
    links: float = setting(1.0, "cost of the shortfall of lambda_2 from a ring's, with `connectivity = lambda2` (/m^2)")
    length: float = setting(0.02, "cost of squared distances between neighbouring control points (/m^2)")
    bend: float = setting(1.0, "cost of squared second differences of control points (/m^2)")
    metres: float = setting(0.0, "cost of distances between neighbouring control points (/m)")


class Spare(Record):
    """Target margins beyond the required values."""

    title: ClassVar[str] = "spare"
    task: float = setting(0.03, "target margin of every robustness margin, up to its tolerance (m)")
    bodies: float = setting(0.03, "target margin of obstacles, separation and world bounds (m)")
    limits: float = setting(0.02, "target margin of each dynamic limit, as a fraction of the limit", 0, 0.99)
    links: float = setting(0.3, "margin of a link that counts fully in lambda_2, with `connectivity = lambda2` (m)")
    share: float = setting(0.02, "smallest target margin, as a fraction of the longest step", 0, 10)
    room: float = setting(0.005, "target clearance in free space, as a fraction of the shorter side of the world", 0, 1)
    scaled: float = setting(0.0, "smallest target margin of a formula, as a fraction of its natural scale", 0, 1)


class ProbeWeights(Record):
    """Weights of the cost of a shifted waypoint in Algorithm 1, which only compares such costs."""

    title: ClassVar[str] = "probe"
    bodies: float = setting(8.0, "cost of the violation of obstacles, bounds and separation (/m)")
    task: float = setting(6.0, "cost of the shortfall of robustness (/m)")
    limits: float = setting(4.0, "cost of the excess of a step over a dynamic limit (/m)")
    bend: float = setting(2.4, "cost of half the squared second differences (/m^2)")
    room: float = setting(0.08, "r_o and r_s: distance beyond the required one below which bodies have a cost (m)")
    margin: float = setting(0.1, "robustness above which a goal has no cost, if goals cost their shortfall (m)")
    enough: float = setting(1.0, "robustness above which a goal has no further reward in the mean of goals (m)")
    later: float = setting(0.3, "cost of a goal's shortfall that unplanned agents may still remove, as a fraction")


class SearchSettings(Record):
    """Parameters of Algorithm 2. The paper prints only the number of trajectories. [clot] (9), (11), IV-C."""

    eta: float = setting(0.2, "η of (9): cost for each agent, relative to progress from 0 to 1")
    gamma: float = setting(0.8, "γ of (11): discount factor of the search tree", 1e-9, 1 - 1e-9)
    reward: float = setting(0.5, "ψ(ν⁺) of (11): value of a new node; a failure has the negative value")
    delta: float = setting(0.1, "δ of IV-C.2: joint trajectories closer than this at every step count as equal (m)")
    wide: int = setting(4, "H of (9): number of nodes if no agent is planned", 1, MOST)
    narrow: int = setting(1, "H of (9): number of nodes if all but the last agent are planned", 1, MOST)
    children: int = setting(4, "K of (10): number of candidates that become nodes in an expansion", 1, MOST)
    few_samples: int = setting(64, "trajectories of an expansion if no agent is planned", 1, 100_000)
    many_samples: int = setting(128, "trajectories of an expansion if all but the last agent are planned", 1, 100_000)
    tries: int = setting(3, "number of times that one agent expands one node", 1, MOST)
    expansions: int = setting(20, "number of expansions for each agent", 1, MOST)
    improvement: int = setting(0, "number of expansions after the first solution", 0, MOST)
    printed: bool = setting(False, "true for (9), the choice of solutions and the pruning as printed in the paper")


class Polytope(Enum):
    """Set of probing directions that sum to zero."""

    SIMPLEX = auto()
    """Simplex: dim + 1 directions, the fewest possible."""
    ORTHOPLEX = auto()
    """Orthoplex: 2 dim directions, both directions along each axis."""
    CUBE = auto()
    """Cube: 2^dim directions, towards its corners."""


class Coupling(Enum):
    """Method that distributes the waypoints of a candidate over the probing directions."""

    SOFTMAX = auto()
    """Softmax: each waypoint chooses its directions independently."""
    SINKHORN = auto()
    """Sinkhorn: every direction receives the same total mass, as in equation (7)."""


class TransportSettings(Record):
    """Parameters of Algorithm 1 on a batch, for trajectories drawn from the prior in a world of about 10 m. [clot]

    Radii and widths are interpolated from their first to their last value over the iterations. An initial guess near a
    solution needs smaller radii.
    """

    iterations: int = setting(20, "largest number of iterations; more iterations find better trajectories", 0, 100_000)
    first_radius: float = setting(1.0, "radius of the probes of a waypoint in the first iteration (m)", 1e-6, MOST)
    last_radius: float = setting(0.06, "radius of the probes of a waypoint in the last iteration (m)", 1e-6, MOST)
    first_width: float = setting(8.0, "width of the kernel that smooths the first step (steps)", 0, MOST)
    last_width: float = setting(0.8, "width of the kernel that smooths the last step (steps)", 0, MOST)
    regulariser: float = setting(0.08, "weight of the entropy, for costs scaled to [0, 1]", 1e-6, 1000)
    flat: float = setting(0.3, "difference of the best and worst probe below which a waypoint moves less (/m)")
    polytope: Polytope = Polytope.ORTHOPLEX
    probes: int = setting(1, "number of probes in each direction, at equal distances up to the radius", 1, 1000)
    coupling: Coupling = Coupling.SOFTMAX
    check_every: int = setting(5, "number of iterations between two checks for enough feasible candidates", 1, 100_000)


class ClotSettings(Record):
    """Settings of the clot backend. A preset replaces the groups ``search`` and ``transport``."""

    attempts: AttemptSettings = field(default_factory=AttemptSettings)
    schedule: ScheduleSettings = field(default_factory=ScheduleSettings)
    guess: GuessSettings = field(default_factory=GuessSettings)
    polish: PolishSettings = field(default_factory=PolishSettings)
    shortening: ShorteningSettings = field(default_factory=ShorteningSettings)
    weights: Weights = field(default_factory=Weights)
    spare: Spare = field(default_factory=Spare)
    probe: ProbeWeights = field(default_factory=ProbeWeights)
    search: SearchSettings = field(default_factory=SearchSettings)
    transport: TransportSettings = field(default_factory=TransportSettings)


def clot_settings(mission: Mission) -> ClotSettings:
    """Settings of a mission's planning, without the values of a preset."""
    return _settings(own_values(mission, CLOT.name))


@lru_cache(maxsize=64)
def _settings(values: Pairs) -> ClotSettings:
    return with_values(ClotSettings(), dict(values))

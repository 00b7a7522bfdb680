"""Settings of the clot backend, in groups. ``clot_settings`` gives those of a mission."""

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
    """Settings of attempts: schedules tried one after the other, each with a polish of its motion."""

    schedules: int = setting(40, "schedules", "tried before the answer is that no plan was found", 1, MOST)
    polish: int = setting(60, "iterations", "of one polish; more repair worse motions, and take longer", 1, 10_000)
    search_every: int = setting(8, "attempts", "of which the last one is a search, if the preset has none", 1, MOST)
    noise: float = setting(0.4, "", "relative error of distances in every schedule but the first", 0, 10)
    tours_every: int = setting(3, "attempts", "of which the second one begins with tours", 1, MOST)
    near: float = setting(0.2, "m", "that a motion falls short by at most, to be polished again", 0, MOST)
    detours: float = setting(0.3, "", "probability of another route than the shortest, for each team", 0, 1)
    repairs: int = setting(3, "rounds", "of a repair, each with a new choice of what has to be satisfied", 1, 1000)
    repair_polish: int = setting(80, "iterations", "of one polish in a repair", 1, 10_000)


class ScheduleSettings(Record):
    """Settings of schedules: tasks, the order of visits, and places to visit."""

    cells: int = setting(12_000, "cells", "of the grid for distances; more find narrower paths", 16, MOST)
    detour: float = setting(1.4, "", "length of a path with more clearance, over the shortest at most", 1, 100)
    speed: float = setting(0.8, "", "share of the top speed that a schedule counts on", 0.01, 1)
    late_speed: float = setting(0.95, "", "share of the top speed for an agent that is late otherwise", 0.01, 1)
    work: int = setting(30_000, "visits", "tried while tasks are exchanged", 0, 10**9)
    vain: int = setting(6, "exchanges", "without success for each task, after which that ends", 1, MOST)
    inside: float = setting(0.3, "m", "of robustness at the place that an agent visits for a requirement", 0, 1000)
    meeting: float = setting(0.8, "", "distance of agents that meet, as a share of what is allowed", 0.01, 1)
    passing: float = setting(1.5, "steps", "before and after a visit in which its agent counts as present", 0, 1000)
    samples: int = setting(256, "points", "of a place that the deepest are chosen from", 1, MOST)
    tour_clearance: float = setting(0.3, "m", "beside what bodies need on a tour", 0, 1000)
    stops: int = setting(60, "schedules", "tried with stops to refill a resource", 1, MOST)


class GuessSettings(Record):
    """Settings of initial configurations and sketches: the motion with which a polish begins."""

    iterations: int = setting(40, "iterations", "of the polish of one configuration", 1, 10_000)
    jitter: float = setting(0.02, "m", "by which a configuration is shaken", 0, 100)
    middles: int = setting(400, "places", "tried for the middle of a formation", 1, MOST)
    clearance: float = setting(0.1, "m", "beyond what bodies need in a configuration", 0, 1000)
    team: float = setting(0.5, "m", "that a member of a team may change place by, and go as one of it", 0, 1000)
    team_clearance: float = setting(0.3, "m", "beyond what a team needs that goes as one", 0, 1000)
    grid: int = setting(20_000, "cells", "of the grid on which agents give way to each other", 16, MOST)
    rounds: int = setting(3, "rounds", "of giving way after the first", 0, 1000)
    moving_grid: int = setting(2500, "cells", "of the grid on which obstacles that move are avoided", 16, MOST)
    meeting: float = setting(60.0, "", "cost of a meeting, in squares of cells", 0)


class PolishSettings(Record):
    """Settings of joint polish: Levenberg-Marquardt on the violated or nearly violated constraints."""

    damping: float = setting(0.001, "", "against the length term, to begin with", 1e-9, 1000)
    settled: float = setting(0.01, "", "share of the cost that another step has to gain", 0, 1)
    enough: float = setting(0.9, "", "share of its spare that a margin may lack at the end", 0, 1)
    wide_enough: float = setting(0.15, "", "the same of wide margins, those with a share of their natural scale", 0, 1)
    harder: float = setting(4.0, "", "weight of what is violated at rest, as a multiple of the one before", 1, 1000)
    hardest: float = setting(256.0, "", "weight of what is violated at most", 1)
    longest: float = setting(1.0, "m", "that a control point moves in one step", 1e-6, MOST)
    close: float = setting(0.4, "m", "beyond what bodies need, within which they count", 0, 1000)
    gap: float = setting(0.1, "m", "between points where obstacles count; less cuts fewer corners", 0.001, 100)


class ShorteningSettings(Record):
    """Settings for shortening and smoothing a plan."""

    iterations: int = setting(40, "iterations", "of the polish of a shorter motion", 1, 10_000)
    same: float = setting(0.001, "m", "that a plan has to be shorter by", 0, 1000)
    tidy: int = setting(6000, "numbers", "of control points, times steps, without an objective", 0)
    duration_iterations: int = setting(40, "iterations", "of the polish of a motion of less duration", 1, 10_000)
    reach: float = setting(0.4, "", "step of one program in metres, for each metre of the longest step", 0.01, 100)
    least_reach: float = setting(0.05, "", "such a step, below which no program is solved", 1e-6, 100)
    least_ascent: float = setting(0.005, "", "such a step for robustness, below which no program is solved", 1e-6, 100)
    ascent: int = setting(60, "programs", "for the objective `maximize robustness`", 0, 100_000)
    near: float = setting(0.15, "m", "of margin, above which a constraint is left out of a program", 0, 1000)
    straighten: int = setting(60_000, "numbers", "of control points, times steps, for a plan from a roadmap", 0)
    straighten_polish: int = setting(40, "iterations", "of a polish for more clearance", 0, 10_000)
    longer: float = setting(0.02, "", "share by which a plan with more clearance may be longer", 0, 10)
    wider: float = setting(
        0.01, "", "least gain of the square roots of normalised margins, for which a plan may be longer", 0, 1
    )
    margin: float = setting(0.15, "", "normalised margin above which a plan is not made longer for more", 0, 1)
    longer_margin: float = setting(0.1, "", "share by which a plan with a wider margin may be longer", 0, 10)
    wide: float = setting(
        0.18, "", "share of the natural scale of a margin that a polish for wider margins aims at", 0, 1
    )
    wide_tries: int = setting(3, "polishes", "for wider margins, each for half of the margins of the one before", 1, 20)
    restores: int = setting(3, "rounds", "in which agents that violate something are put back", 1, 1000)
    top: float = setting(0.97, "", "share of the top speed and acceleration that is used at most", 0.01, 1)
    retiming: int = setting(40_000_000, "numbers", "of nodes, times steps, times agents, for other paces", 0)


class Weights(Record):
    """Weights of the costs of a joint motion."""

    title: ClassVar[str] = "weight"
    task: float = setting(400.0, "/m^2", "by which a margin of the formulas falls short")
    bodies: float = setting(400.0, "/m^2", "of obstacles, separation and the world's bounds")
    limits: float = setting(400.0, "/m^2", "of speed, acceleration and turning beyond their limits")
    links: float = setting(1.0, "/m^2", "by which lambda_2 falls short of a ring's, if connectivity is judged by it")
    length: float = setting(0.02, "/m^2", "between neighbouring control points")
    bend: float = setting(1.0, "/m^2", "of second differences of control points")
    metres: float = setting(0.0, "/m", "of way between neighbouring control points, in a descent")


class Spare(Record):
    """Margins beyond what is required."""

    title: ClassVar[str] = "spare"
    task: float = setting(0.03, "m", "of every margin of the formulas, where its tolerance allows")
    bodies: float = setting(0.03, "m", "beyond what obstacles, separation and bounds need")
    limits: float = setting(0.02, "", "of each limit, left unused", 0, 0.99)
    links: float = setting(0.3, "m", "of a link that counts in full in lambda_2, if connectivity is judged by it")
    share: float = setting(0.02, "", "of the longest step, if that is more than `task` and `bodies`", 0, 10)
    room: float = setting(0.005, "", "of the narrower side of the world, for clearance where there is room", 0, 1)
    scaled: float = setting(0.0, "", "of the natural scale of a margin, if that is more than `task`", 0, 1)


class ProbeWeights(Record):
    """Weights of a moved waypoint's costs in Algorithm 1, which only compares them."""

    title: ClassVar[str] = "probe"
    bodies: float = setting(8.0, "/m", "by which obstacles, bounds and separation lack room")
    task: float = setting(6.0, "/m", "of robustness")
    limits: float = setting(4.0, "/m", "in a step above a limit")
    bend: float = setting(2.4, "/m^2", "of half the squared second differences")
    room: float = setting(0.08, "m", "beyond what bodies need, below which they cost: r_o and r_s")
    margin: float = setting(0.1, "m", "of robustness above which a goal costs nothing, where goals cost what they lack")
    enough: float = setting(1.0, "m", "of robustness above which a goal earns nothing more, in the mean of all goals")
    later: float = setting(0.3, "", "of what a goal lacks, where agents still to come may see to it")


class SearchSettings(Record):
    """Parameters of Algorithm 2. The paper prints only the number of trajectories. [clot] (9), (11), IV-C.

    The paper prints only the number of trajectories. [clot] (9), (11), IV-C.
    """

    eta: float = setting(0.2, "", "η of (9): cost for each agent, against progress from 0 to 1")
    gamma: float = setting(0.8, "", "γ of (11)", 1e-9, 1 - 1e-9)
    reward: float = setting(0.5, "", "ψ(ν⁺) of (11): value of a new node; a failure is worth as much less")
    delta: float = setting(0.1, "m", "δ of IV-C.2: joint motions closer than this at every step count as one")
    wide: int = setting(4, "nodes", "H of (9) where nothing is planned", 1, MOST)
    narrow: int = setting(1, "nodes", "H where all but the last agent are planned", 1, MOST)
    children: int = setting(4, "candidates", "K of (10) that become nodes in an expansion", 1, MOST)
    few_samples: int = setting(64, "trajectories", "of an expansion where nothing is planned", 1, 100_000)
    many_samples: int = setting(128, "trajectories", "where all but the last agent are planned", 1, 100_000)
    tries: int = setting(3, "times", "that one node is expanded by one agent", 1, MOST)
    expansions: int = setting(20, "expansions", "for each agent", 1, MOST)
    improvement: int = setting(0, "expansions", "after the first solution", 0, MOST)
    printed: bool = setting(False, "", "(9), the choice among solutions and the pruning as printed")


class Polytope(Enum):
    """A set of directions that sum to zero."""

    SIMPLEX = auto()
    """dim + 1 corners: the fewest."""
    ORTHOPLEX = auto()
    """2 dim corners: both ways along each axis."""
    CUBE = auto()
    """2^dim corners."""


class Coupling(Enum):
    """Distribution of the waypoints of a candidate over the directions."""

    SOFTMAX = auto()
    """Each waypoint chooses independently."""
    SINKHORN = auto()
    """Every direction receives the same mass, as in equation (7)."""


class TransportSettings(Record):
    """Algorithm 1 on a batch, for trajectories drawn from the prior in a world of about 10 m. [clot]

    Radii and widths run from their first to their last value over the iterations.
    A good guess wants smaller radii.
    """

    iterations: int = setting(20, "iterations", "at most; more find better motions, and take longer", 0, 100_000)
    first_radius: float = setting(1.0, "m", "that a waypoint looks and moves in the first iteration", 1e-6, MOST)
    last_radius: float = setting(0.06, "m", "in the last iteration", 1e-6, MOST)
    first_width: float = setting(8.0, "steps", "of the kernel that smooths the first step", 0, MOST)
    last_width: float = setting(0.8, "steps", "of the kernel that smooths the last step", 0, MOST)
    regulariser: float = setting(0.08, "", "weight of the entropy, for costs scaled to [0, 1]", 1e-6, 1000)
    flat: float = setting(0.3, "/m", "difference of the best and worst probe, below which a waypoint moves less")
    polytope: Polytope = Polytope.ORTHOPLEX
    probes: int = setting(1, "probes", "on each direction, at equal distances up to the radius", 1, 1000)
    coupling: Coupling = Coupling.SOFTMAX
    check_every: int = setting(5, "iterations", "between two checks whether enough candidates hold", 1, 100_000)


class ClotSettings(Record):
    """Settings of the clot backend. A preset has values of its own for ``search`` and ``transport``."""

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
    """Settings of a mission's planning, apart from the preset."""
    return _settings(own_values(mission, CLOT.name))


@lru_cache(maxsize=64)
def _settings(values: Pairs) -> ClotSettings:
    return with_values(ClotSettings(), dict(values))

"""Verification of a flight from floor to floor: its phases, the columns above the pads, the transfers, and landing.

    in   Mission, the texts of its polynomials and of its transfers
    out  Certificate: the checks of each transfer, `out` or `home`, and of the columns

A transfer is verified like the mission's own flight, along its polynomials and by the same claims. In a column, a
vehicle may have any height at any time during takeoff or landing. Each complete column is proved clear, and margins are
metres of clearance beyond the required clearance.

After a stop, vehicles land straight down in turns, clear of hovering vehicles, landed vehicles and obstacles.

Each phase, from the floor to the floor, lasts long enough to respect the speed limits. The firmware takes off and lands
along the polynomial of degree 7 that begins and ends at rest, without acceleration and jerk.

Source:
    crazyflie-firmware, planner.c (``plan_takeoff``, ``plan_land``) and pptraj.c
    (``piecewise_plan_7th_order_no_jerk``).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array
from missionc.geometry.columns import FLOOR, column_clearance
from missionc.geometry.curves.piecewise_polynomials import Pieces, read, values
from missionc.geometry.required_separation import SpacingTable
from missionc.ir import Agent, Mission, Obstacle
from missionc.verification.certificate import MOTION, WAYPOINT, Certificate, Check, Figure, judged
from missionc.verification.flight.continuity_and_fidelity import check_level, check_smooth, exactness
from missionc.verification.flight.joint_claims import Flight, downwash, world
from missionc.verification.flight.verify_polynomials import check_apart, check_file, limits, prove_all
from missionc.verification.flight.way_missions import Stage, Way, Ways, has_risen, is_whole, way_mission, ways_of
from missionc.verification.proof.proof_boxes import Boxes

RISE, SETTLE, GO, SINK = 3.0, 2.0, 4.0, 4.0
"""Durations in seconds: shortest takeoff, hover to settle, transfer to the first point, and shortest landing."""
LANDED = 0.04
"""Height at which the motors stop in a landing, metres."""
SPEED, ACCELERATION = 35 / 16, 7.514
"""Largest speed, m/s, and acceleration, m/s² (rounded up), of the rest-to-rest polynomial over 1 m in 1 s."""
REST_TO_REST = (0.0, 0.0, 0.0, 0.0, 35.0, -84.0, 70.0, -20.0)
"""Coefficients of the firmware's rest-to-rest polynomial from 0 to 1 in 1 s, in ascending powers."""


class Phases(Record):
    """Duration of each phase of a flight in seconds, equal for all agents.

    ``duration`` is the duration of the polynomials.

    Takeoff and landing take ``rounds`` turns of ``rise`` and ``sink`` seconds each. If all agents are in the air
    initially, ``rise`` is 0, and there is no hovering before the polynomials.
    """

    rise: float
    settle: float
    go: float
    duration: float
    sink: float
    rounds: int = 1

    @property
    def hover(self) -> float:
        """Seconds from the end of the last takeoff to the beginning of the polynomials."""
        return self.settle + self.go + self.settle if self.rise else 0.0

    @property
    def before(self) -> float:
        """Seconds from the first takeoff to the beginning of the polynomials."""
        return self.rounds * self.rise + self.hover

    @property
    def whole(self) -> float:
        """Seconds from the first takeoff, or from the beginning in the air, to the last landing."""
        return self.before + self.duration + self.settle + self.rounds * self.sink


def phases_of(
    agents: Sequence[Agent],
    up: Sequence[float],
    down: Sequence[float],
    duration: float,
    rounds: int = 1,
    risen: bool = False,
    bottom: float = LANDED,
) -> Phases:
    """Durations of a flight's phases.

    Args:
        up, down: metres, by agent: heights after takeoff, and before landing.
        duration: duration of the polynomials, seconds.
        rounds: number of turns of takeoff and of landing.
        risen: True if all agents are already in the air.
        bottom: metres, final height of the landing.
    """
    rise = max(_phase_seconds(height - FLOOR, agent, _rise(agent)) for agent, height in zip(agents, up, strict=True))
    sink = max(landing_seconds(agent, height, bottom) for agent, height in zip(agents, down, strict=True))
    return Phases(0.0 if risen else max(rise, RISE), SETTLE, GO, duration, sink, rounds)


def landing_seconds(agent: Agent, height: float, bottom: float = LANDED) -> float:
    """Duration of a vertical landing from ``height`` to ``bottom``, both in metres: seconds."""
    return max(_phase_seconds(height - bottom, agent, math.inf if agent.pad is None else agent.pad.land), SINK)


def rest_to_rest(distance: float, speed: float, acceleration: float) -> float:
    """Shortest duration of the rest-to-rest polynomial over a distance in metres, within a speed and an acceleration:
    seconds.
    """
    return max(SPEED * abs(distance) / speed, math.sqrt(ACCELERATION * abs(distance) / acceleration))


def _rise(agent: Agent) -> float:
    """Climb speed that the mission allows for an agent, m/s; infinite if it sets none."""
    return math.inf if agent.pad is None else agent.pad.rise


def _phase_seconds(height: float, agent: Agent, wanted: float) -> float:
    """Duration of a vertical motion over ``height``, at most as fast as ``wanted`` and the vehicle allow: seconds.

    It is rounded up to a tenth of a second.
    """
    speed = min(agent.vehicle.vertical_speed, wanted)
    return math.ceil(10 * rest_to_rest(height, speed, agent.vehicle.acceleration) - 1e-9) / 10


class Stop(Record, eq=False):
    """Trajectories that bring all agents to rest from one time of a flight, and the order of landing afterwards.

    Args:
        at: seconds of mission time.
        pieces: by agent, the stop and a hover after it.
        turns: groups of agents, by index, that land together; agents in no turn hover.
    """

    at: float
    pieces: tuple[Pieces, ...]
    turns: tuple[tuple[int, ...], ...]

    @property
    def seconds(self) -> float:
        """Duration of the stop without the hover after it, seconds."""
        return float(self.pieces[0].duration[0])

    @property
    def places(self) -> Array:
        """Hover positions: (agents, 3), metres."""
        return np.stack([own.coefficients[-1, :3, 0] for own in self.pieces])

    def landing(self, mission: Mission) -> list[float]:
        """Duration of each landing turn in seconds: the slowest landing of its agents."""
        heights = self.places[:, 2].tolist()
        return [max(landing_seconds(mission.agents[index], heights[index]) for index in turn) for turn in self.turns]


def landing_margins(mission: Mission, stop: Stop) -> Iterator[tuple[int, float]]:
    """Clearance of each landing agent from obstacles and other agents: pairs of agent index and metres."""
    margins = _Margins(mission, stop)
    hovering, landed = set(range(len(mission.agents))), list[int]()
    end = stop.at + stop.seconds
    for turn, seconds in zip(stop.turns, stop.landing(mission), strict=True):
        hovering -= set(turn)
        end += seconds
        for index in turn:
            beside = [each for each in turn if each != index]
            others = margins.of_others(index, beside, list(hovering), landed)
            yield index, min(others, margins.of_obstacles(index, end))
        landed += turn


class _Margins:
    """Clearances, in metres, of agents that land vertically after a stop.

    Args:
        stop: its turns are not used.
    """

    def __init__(self, mission: Mission, stop: Stop) -> None:
        self.mission, self.places = mission, stop.places
        self.begin = stop.at + stop.seconds
        radius, tracking, pair, downwash = (
            np.array([figure(agent) for agent in mission.agents], dtype=np.float64)
            for figure in (_radius, _tracking, _pair_distance, _downwash_height)
        )
        missed, bodies = _sum(tracking), _sum(radius)
        everyone = np.arange(len(mission.agents))
        apart = np.linalg.norm(self.places[:, None, :2] - self.places[None, :, :2], axis=-1)
        # For two that land together: sideways, for any heights.
        self.aside = apart - SpacingTable.of(mission).between(everyone[:, None], everyone[None])
        # For a landing agent beside a hovering one: far enough aside, or below the other's whole path.
        tall = np.maximum(np.maximum(bodies, np.maximum(pair[:, None], pair[None])), _sum(downwash)) + missed
        above = self.places[None, :, 2] - self.places[:, None, 2]
        self.past = np.maximum(self.aside, above - tall)
        # For a landing agent beside a landed one with its motors off: only bodies count.
        self.onto = apart - bodies - missed
        self._standing: dict[int, float] = {}

    def of_others(self, index: int, beside: list[int], hovering: list[int], landed: list[int]) -> float:
        """Clearance of one landing agent from other agents, metres.

        Args:
            beside: agents that land at the same time.
            hovering: agents that hover meanwhile.
            landed: agents on the floor.
        """
        rows = ((self.aside, beside), (self.past, hovering), (self.onto, landed))
        return min(float(table[index, some].min(initial=math.inf)) for table, some in rows)

    def of_obstacles(self, index: int, end: float) -> float:
        """Clearance of one agent from obstacles while it hovers after the stop until it has landed, metres.

        Args:
            end: landing time, seconds of mission time.
        """
        if index not in self._standing:
            self._standing[index] = self._of(index, [each for each in self.mission.obstacles if each.constant], end)
        changing = [each for each in self.mission.obstacles if not each.constant]
        return min(self._standing[index], self._of(index, changing, end))

    def _of(self, index: int, some: list[Obstacle], end: float) -> float:
        agent, point = self.mission.agents[index], tuple(self.places[index, : self.mission.dimension].tolist())
        need = agent.radius + agent.vehicle.tracking
        return min((column_clearance(each, point, self.begin, end) - need for each in some), default=math.inf)


def _radius(agent: Agent) -> float:
    return agent.radius


def _tracking(agent: Agent) -> float:
    return agent.vehicle.tracking


def _pair_distance(agent: Agent) -> float:
    return agent.vehicle.pair_distance


def _downwash_height(agent: Agent) -> float:
    return agent.vehicle.downwash_height


def _sum(figure: Array) -> Array:
    """Pairwise sums of an agent quantity: (agents,) -> (agents, agents), in the same unit, such as metres."""
    return np.asarray(figure[:, None] + figure[None])


def pad_turns(mission: Mission, hovers: Array) -> tuple[tuple[int, ...], ...]:
    """Turns in which agents can land from above their pads, as few as possible; takeoff uses the reverse order.

    Obstacles are not included, since they depend on time.

    Args:
        hovers: hover points above the pads, (agents, 3), metres.
    """
    return in_turns(replace(mission, obstacles=()), above_pads(hovers), -MOTION)


def pads_suffice(mission: Mission, hovers: Sequence[tuple[float, ...]]) -> bool:
    """Return whether all agents can take off to their hover points and land from there, in some turns.

    Args:
        hovers: three coordinates by agent, metres.
    """
    return sum(map(len, pad_turns(mission, np.array(hovers, dtype=np.float64)))) == len(mission.agents)


def above_pads(hovers: Array, turns: tuple[tuple[int, ...], ...] = ()) -> Stop:
    """Stop with all agents at rest above their pads.

    Args:
        hovers: hover points, (agents, 3), metres.
        turns: order of landing, as groups of agent indices.
    """
    still = np.zeros((len(hovers), 2, 4, 8))
    still[:, :, :3, 0] = hovers[:, None]
    return Stop(0.0, tuple(Pieces(np.ones(2), own) for own in still), turns)


def in_turns(mission: Mission, stop: Stop, enough: float = 0.0) -> tuple[tuple[int, ...], ...]:
    """Turns in which agents can land after a stop, as few as possible, the lowest agents first.

    Agents without a surely clear landing are in no turn.

    Args:
        enough: minimum clearance of a landing, metres.
    """
    margins = _Margins(mission, stop)
    remaining, landed = set(range(len(mission.agents))), list[int]()
    heights = stop.places[:, 2].tolist()
    lasting = [landing_seconds(agent, height) for agent, height in zip(mission.agents, heights, strict=True)]
    turns: list[tuple[int, ...]] = []
    end = stop.at + stop.seconds
    while remaining:
        turn: list[int] = []
        seconds = 0.0
        for index in sorted(remaining, key=lambda each: (heights[each], each)):
            others = margins.of_others(index, turn, list(remaining.difference(turn, [index])), landed)
            longer = max(seconds, lasting[index])
            # An agent that lands with others hovers, or descends, for the same duration.
            these = [index] if longer == seconds else [*turn, index]
            if others >= enough and all(margins.of_obstacles(each, end + longer) >= enough for each in these):
                turn.append(index)
                seconds = longer
        if not turn:
            break
        end += seconds
        turns.append(tuple(sorted(turn)))
        remaining -= set(turn)
        landed += turn
    return tuple(turns)


WHOLE = "whole flight"
"""Name of the certificate's quantity for the total duration of a flight."""


def verify_whole_flight(mission: Mission, files: Mapping[str, str], ways: Ways) -> Certificate:
    """Certificate of the transfers and columns of a mission that starts on the floor.

    Args:
        files: verified text of each agent's polynomials, by name.
        ways: texts of the transfers.
    """
    flown = pieces_of(mission, files)
    if isinstance(flown, Check):
        return Certificate(mission.name, (flown,))
    wanted = ways_of(mission, flown)
    whole = Certificate(mission.name, ())
    for stage, way in wanted.items():
        if stage not in ways:
            detail = "the path is not needed, or there is one file for each agent"
            there = Check(f"{stage.value} way", "ways", 0.0, "", 0.0, not way.needed, detail=detail)
            whole = whole.joined(Certificate(mission.name, (there,)))
            continue
        whole = whole.joined(_way(mission, stage, way, ways[stage]))
    durations = {stage: _seconds(mission, ways.get(stage, {})) for stage in Stage}
    seconds = sum(durations.values()) + float(next(iter(flown.values())).times[-1])
    lasting = whole_phases(mission, wanted, seconds)
    begins = {Stage.OUT: -durations[Stage.OUT], Stage.HOME: mission.horizon + durations[Stage.HOME]}
    checks = [*_columns(mission, wanted, begins, lasting), *_endurance(mission, lasting)]
    lasts = Figure(WHOLE, "floor to floor", round(lasting.whole, 6), "s")
    return whole.joined(Certificate(mission.name, tuple(checks), (lasts,)))


def as_one(mission: Mission, files: Mapping[str, str], ways: Ways) -> tuple[dict[str, Pieces], float, float]:
    """Join the verified outbound transfer, mission and return transfer of each agent into one trajectory.

    Returns:
        The trajectories by agent name; the seconds before the mission begins; the seconds from takeoff to the beginning
        of the trajectories, 0 for a mission that begins in the air.
    """
    flown = pieces_of(mission, files)
    assert not isinstance(flown, Check), "polynomials that were verified can be read"
    parts = {stage: pieces_of(mission, texts) for stage, texts in ways.items()}
    whole: dict[str, Pieces] = {}
    before = _seconds(mission, ways.get(Stage.OUT, {}))
    for agent in mission.agents:
        own = [flown[agent.name]]
        for stage, part in parts.items():
            assert not isinstance(part, Check), "polynomials that were verified can be read"
            own.insert(0 if stage is Stage.OUT else len(own), part[agent.name])
        durations = np.concatenate([each.duration for each in own])
        whole[agent.name] = Pieces(durations, np.concatenate([each.coefficients for each in own]))
    if not is_whole(mission):
        return whole, before, 0.0
    lasting = whole_phases(mission, ways_of(mission, flown), float(durations.sum()))
    return whole, before, lasting.before


def pieces_of(mission: Mission, files: Mapping[str, str]) -> dict[str, Pieces] | Check:
    """Every agent's polynomials by name, or the failed check of the first unreadable file."""
    flown: dict[str, Pieces] = {}
    for agent in mission.agents:
        own = read(files.get(agent.name, ""))
        if isinstance(own, str):
            return check_file(agent, own)
        flown[agent.name] = own
    return flown


def whole_phases(mission: Mission, wanted: Mapping[Stage, Way], seconds: float) -> Phases:
    """Phases of a flight from floor to floor, with the given transfers.

    Args:
        seconds: duration of the polynomials and transfers together.
    """
    up, down = wanted[Stage.OUT].begin[:, 2].tolist(), wanted[Stage.HOME].end[:, 2].tolist()
    rounds = max(1, len(pad_turns(mission, wanted[Stage.HOME].end)))
    return phases_of(mission.agents, up, down, seconds, rounds, has_risen(mission))


def _seconds(mission: Mission, files: Mapping[str, str]) -> float:
    flown = pieces_of(mission, files)
    return 0.0 if isinstance(flown, Check) else float(next(iter(flown.values())).times[-1])


# ----------------------------------------------------------------------- transfers


def _way(mission: Mission, stage: Stage, way: Way, files: Mapping[str, str]) -> Certificate:
    """Certificate of one transfer, verified by the claims of flights; every name is prefixed with the stage."""
    read_files = {agent.name: read(files.get(agent.name, "")) for agent in mission.agents}
    checks = [check_file(agent, read_files[agent.name]) for agent in mission.agents]
    boxes: list[Boxes] = []
    warnings: list[str] = []
    own = [each for each in read_files.values() if isinstance(each, Pieces)]
    same = len(own) == len(read_files) and all(np.array_equal(each.duration, own[0].duration) for each in own)
    checks.append(Check("clock", "polynomials", 0.0, "s", 0.0, same, detail="the durations of all files are equal"))
    if same:
        flown = way_mission(mission, stage, way, float(own[0].times[-1]), 1, math.inf)
        flight = Flight(own[0].duration, np.stack([each.coefficients for each in own]))
        with np.errstate(over="ignore", invalid="ignore"):
            for agent, each in zip(flown.agents, own, strict=True):
                checks += [*check_smooth(agent, each), *_ends(agent, each, way), *check_level(flown, agent, each)]
            prove_all(flown, [world(flown, flight)], checks, boxes)
            warnings += check_apart(flown, flight, checks, boxes)
            prove_all(flown, [*downwash(flown, flight), *limits(flown, flight)], checks, boxes)
    word = stage.value
    said = tuple(f"on the path {word}: {warning}" for warning in warnings)
    return Certificate(mission.name, tuple(checks), warnings=said, boxes=tuple(boxes)).under(word)


def _ends(agent: Agent, own: Pieces, way: Way) -> list[Check]:
    """Checks that an agent's trajectory begins and ends at the points of the transfer."""
    first, last = own.coefficients[0, :3, 0], values(own.coefficients[-1, :3], own.duration[-1])
    found = []
    for name, here, wanted, time in (
        ("begin", first, way.begin[agent.index], 0.0),
        ("end", last, way.end[agent.index], float(own.times[-1])),
    ):
        off = float(np.linalg.norm(here - wanted))
        detail = f"the path {name}s at ({', '.join(f'{value:.4g}' for value in wanted.tolist())})"
        found.append(judged(name, agent.name, -off, "m", exactness(own), at=time, agents=(agent.name,), detail=detail))
    return found


# -------------------------------------------------------------------- columns


def _columns(
    mission: Mission, wanted: Mapping[Stage, Way], begins: Mapping[Stage, float], lasting: Phases
) -> list[Check]:
    """Checks of takeoff, standing on the floor, and landing of all agents, in their turns."""
    checks: list[Check] = []
    hovers = wanted[Stage.HOME].end
    fenced = [_fence(mission, agent, hovers[agent.index].tolist()) for agent in mission.agents]
    checks.append(min(fenced, key=lambda check: check.margin))
    checks += [_turns(mission, hovers)] if len(mission.agents) > 1 else []
    size = mission.dimension
    for name, begin, end in (
        ("rise", begins[Stage.OUT], begins[Stage.OUT]),
        ("sink", begins[Stage.HOME], begins[Stage.HOME] + lasting.settle + lasting.rounds * lasting.sink),
    ):
        for obstacle in mission.obstacles if name == "sink" or not has_risen(mission) else ():
            found = []
            for agent in mission.agents:
                need = max(agent.radius + agent.vehicle.tracking, agent.radius + mission.clearance)
                point = tuple(hovers[agent.index, :size].tolist())
                clear = column_clearance(obstacle, point, begin, end)
                detail = "every body avoids the obstacle on the vertical path above its pad"
                found.append(
                    judged(
                        f"{name} obstacle",
                        obstacle.name,
                        clear - need,
                        "m",
                        WAYPOINT,
                        agents=(agent.name,),
                        detail=detail,
                    )
                )
            checks.append(min(found, key=lambda check: check.margin))
    return checks


def _fence(mission: Mission, agent: Agent, point: list[float]) -> Check:
    low, high = mission.room(agent.index)
    margin = min(min(point[axis] - low[axis], high[axis] - point[axis]) for axis in (0, 1))
    detail = "every pad is inside the world, with the fence inset and the tracking margin of its vehicle"
    return judged("column world", "world", margin, "m", MOTION, agents=(agent.name,), detail=detail)


def _turns(mission: Mission, hovers: Array) -> Check:
    """Check that agents keep their separation while they take off and land in turns.

    Without such turns, the worst pair fails.

    Args:
        hovers: hover points above the pads, (agents, 3), metres.
    """
    turns = pad_turns(mission, hovers)
    if sum(map(len, turns)) < len(mission.agents):
        pairs = (_pair(mission, *pair, hovers.tolist()) for pair in combinations(range(len(mission.agents)), 2))
        return min(pairs, key=lambda check: check.margin)
    bare = replace(mission, obstacles=())
    margin, index = min((each, index) for index, each in landing_margins(bare, above_pads(hovers, turns)))
    name, count = mission.agents[index].name, len(turns)
    how = "together" if count == 1 else f"in {count} turns"
    detail = f"the agents take off and land {how}, with enough distance to all others"
    return judged("column separation", "all pairs", margin, "m", MOTION, agents=(name,), detail=detail)


def _pair(mission: Mission, first: int, second: int, points: list[list[float]]) -> Check:
    """Check of two agents' horizontal distance above their pads at any heights, including downwash."""
    apart = math.dist(points[first][:2], points[second][:2])
    names = (mission.agents[first].name, mission.agents[second].name)
    detail = "the pads have enough horizontal distance, or the hover heights enough vertical distance"
    margin = apart - mission.spacing(first, second).sideways
    return judged("column separation", "all pairs", margin, "m", MOTION, agents=names, detail=detail)


def _endurance(mission: Mission, lasting: Phases) -> list[Check]:
    """Checks of the flight time against battery endurance, including the flown part of a mission in flight."""
    aloft = max(agent.pad.risen or 0.0 for agent in mission.agents if agent.pad is not None)
    whole = aloft + lasting.whole
    took = f"after {aloft:g} s of the mission, the flight lasts" if has_risen(mission) else "the flight lasts"
    where = "until landing" if has_risen(mission) else "from takeoff to landing"
    return [
        Check(
            "whole endurance",
            agent.name,
            agent.vehicle.endurance - whole,
            "s",
            0.0,
            whole <= agent.vehicle.endurance,
            agents=(agent.name,),
            detail=f"{took} {lasting.whole:g} s {where}; the battery endurance is {agent.vehicle.endurance:g} s",
        )
        for agent in mission.agents
        if math.isfinite(agent.vehicle.endurance)
    ]

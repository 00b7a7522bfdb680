"""Ground control: telemetry, detection of lost, slow and displaced agents, replanning, and uploads.

    in   reports of the agents' states, and changes of the world
    out  uploads, and the setpoints of all agents over an interval of time

An upload is a polynomial that an agent flies by its own clock from a given time on. A slow agent stays on its
trajectory, and falls behind wherever the trajectory is faster than the agent.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from missionc import Checked, Limits, Source, Verified
from missionc.base.trace import Array
from missionc.base.units import Seconds
from missionc.compiler.remaining import earlier
from missionc.compiler.replan.divert import diverted
from missionc.compiler.replan.patch import patched
from missionc.compiler.replan.replan import OFF, replan
from missionc.compiler.replan.request import Flying, Replanned, Request, Way
from missionc.extension import Pieces, Trace, setpoints
from missionc.flight.simulation.disturbance import ACCELERATION, POSITION, RATES, VELOCITY
from missionc.flight.trajectories.stop_and_hover import progress
from missionc.geometry.curves.piecewise_polynomials import polynomials
from missionc.output.folder.file_names import flights_in
from missionc.tools.closed_loop.reports import Report
from missionc.verification.monitoring.live.session import Session
from missionc.verification.monitoring.live.verdicts import LiveVerdict
from missionc.verification.monitoring.read_trace import read_flown


@dataclass(slots=True, eq=False)
class _Agent:
    """Uploads and clock of one agent.

    Args:
        uploads: start times in s with the polynomials from then on, in order.
        skew: delay of the agent's clock, s.
        most: maximum speed from now on, m/s.
        behind: delay on the trajectory, s.
        current: index of the current upload.
    """

    uploads: list[tuple[float, Pieces]]
    skew: float
    most: float = math.inf
    behind: float = 0.0
    current: int = field(default=0)


class UploadedTrajectories:
    """Uploaded trajectories of all agents.

    Args:
        pieces: polynomials of each agent from time 0 on.
        skew: (agents,), delay of each clock, s.
    """

    def __init__(self, pieces: list[Pieces], skew: Array) -> None:
        self._agents = [_Agent([(0.0, own)], float(late)) for own, late in zip(pieces, skew, strict=True)]

    def upload(self, agent: int, pieces: Pieces, begins: float) -> None:
        """Upload polynomials to an agent, which replace its later uploads.

        Args:
            agent: index of the agent.
            pieces: polynomials, in time from ``begins``.
            begins: start of the polynomials, s.
        """
        own = self._agents[agent]
        own.uploads = [each for each in own.uploads if each[0] < begins] + [(begins, pieces)]

    def slow(self, agent: int, most: float) -> None:
        """Limit the speed of agent number ``agent`` to ``most`` m/s from now on."""
        self._agents[agent].most = most

    def setpoints(self, times: Array) -> Array:
        """Setpoints of all agents: (times,) in s -> (13, times, agents).

        The times are evenly spaced, increase over all calls, and are before the end of the next upload.
        """
        return np.stack([self._of(own, times) for own in self._agents], axis=-1)

    def _of(self, own: _Agent, times: Array) -> Array:
        shifted = times - own.skew
        latest = max(index for index, (begins, _) in enumerate(own.uploads) if begins <= shifted[0] or index == 0)
        begins, pieces = own.uploads[latest]
        if latest != own.current:
            own.current, own.behind = latest, 0.0
        local = shifted - begins
        if math.isinf(own.most):
            return setpoints(pieces, local)
        period = float(times[1] - times[0]) if times.size > 1 else 0.0
        columns = []
        for moment in local:
            wanted = setpoints(pieces, np.array([moment - own.behind]))
            fast = float(np.linalg.norm(wanted[VELOCITY]))
            rate = min(1.0, own.most / fast) if fast > 0 else 1.0
            own.behind += (1.0 - rate) * period
            for row, power in ((VELOCITY, 1), (ACCELERATION, 2), (RATES, 1)):
                wanted[row] *= rate**power
            columns.append(wanted)
        return np.concatenate(columns, axis=1)

    def wanted(self, agent: int, time: float) -> Array:
        """Position (3,) in metres at which ground control expects agent number ``agent`` at ``time``, in seconds."""
        return np.asarray(self.way(agent, np.array([time]))[0])

    def way(self, agent: int, times: Array) -> Array:
        """Expected positions of agent number ``agent`` from all uploads: (times,), seconds -> (times, 3), metres."""
        own = self._agents[agent]
        latest = np.maximum(np.searchsorted([begins for begins, _ in own.uploads], times, side="right") - 1, 0)
        places = np.empty((times.size, 3))
        for number in np.unique(latest).tolist():
            begins, pieces = own.uploads[number]
            places[latest == number] = setpoints(pieces, times[latest == number] - begins)[POSITION].T
        return places


def uploaded(told: UploadedTrajectories, plan: Trace) -> Trace:
    """Commanded positions at the steps of the complete flight, from all uploads so far.

    Args:
        told: uploads of all agents.
        plan: initial plan of the complete mission.
    """
    agents, steps, dimension = plan.position.shape
    times = float(plan.step) * np.arange(steps, dtype=np.float64)
    position = np.stack([told.way(agent, times)[:, :dimension] for agent in range(agents)])
    return Trace(plan.step, position, np.gradient(position, float(plan.step), axis=1), plan.heading)


SILENT = 1.0
"""Seconds without a report after which an agent counts as lost."""
SEEN = 1.0
"""Length in seconds of the report window from which the speed of a delayed agent is estimated."""
FEWEST = 5
"""Minimum number of reports in that window."""
LAG = 0.15
"""Minimum distance in metres between a delayed agent and its setpoint."""
BESIDE = 0.1
"""Minimum distance in metres between an agent off its path and the path."""
SLOWEST = 0.15
"""Minimum estimated speed, m/s; slower agents get no speed limit."""
SLOW = 0.9
"""Maximum progress of a slow agent along its trajectory, seconds of trajectory per second."""
SURE = 0.95
"""Factor on the observed speed of an agent, for safety."""
MOST_REPLANS = 6
STOP = 3.0
"""Time in seconds, with margin, that a later request needs for a stop; until then agents must not collide."""
FLOWN_ON = "kept the current plan: no other plan satisfies more requirements"
MOST_OF_IT = 0.4
"""Maximum planning time as a fraction of the remaining time."""
PATIENCE = 8
"""Maximum factor on the planning time; it doubles after each late plan."""
GIVE_UPS = 3
"""Maximum number of times that requirements are dropped for one cause."""


@dataclass(frozen=True, slots=True)
class GroundEvent:
    """Event that ground control detected, and its action.

    Args:
        time: time of the flight, s.
        why: cause in words.
        came: result of replanning in words.
        seconds: planning time, s.
        begins: start of the new plan, s; None without one.
        given_up: names of dropped requirements.
    """

    time: float
    why: str
    came: str
    seconds: float = 0.0
    begins: float | None = None
    given_up: tuple[str, ...] = ()


@dataclass(slots=True, eq=False)
class GroundStation:
    """Ground control of one mission, with or without replanning.

    Args:
        flying: current plan and its mission.
        told: uploads of all agents.
        names: names of all agents of the flight, in order.
        within: time from an event to the start of another plan.
        limits: maximum sizes of a mission.
        seed: random seed.
        replans: if false, only monitor.
        clock: time limit of planning; ``within`` if None.
        began: start of the current plan, s.
        lost: names of agents lost since the current plan.
        log: agent names and reports since the current plan.
        heard: time of the last report by agent, s.
        texts: edited contents by file name, since the current plan.
        causes: reasons for the next replanning, in words.
        slow: speed limits by agent, m/s.
        given_up: names of dropped requirements.
        happened: events and actions so far.
        session: monitor of the current plan.
        risky: reasons for which the current plan may collide, in words.
        away: last reports of agents off their paths.
    """

    flying: Flying
    told: UploadedTrajectories
    names: tuple[str, ...]
    within: Seconds
    limits: Limits
    seed: int
    replans: bool = True
    clock: Seconds | None = None
    began: float = 0.0
    lost: list[str] = field(default_factory=list)
    log: list[tuple[str, Report]] = field(default_factory=list)
    heard: dict[str, float] = field(default_factory=dict)
    texts: dict[str, str] = field(default_factory=dict)
    causes: list[str] = field(default_factory=list)
    slow: dict[str, float] = field(default_factory=dict)
    given_up: list[str] = field(default_factory=list)
    happened: list[GroundEvent] = field(default_factory=list)
    session: Session | None = None
    risky: set[str] = field(default_factory=set)
    away: dict[str, Report] = field(default_factory=dict)
    pieces: dict[str, Pieces] = field(init=False)
    patience: int = 1
    busy: float = 0.0

    world: Checked = field(init=False)
    """The complete mission after all changes so far."""

    def __post_init__(self) -> None:
        self.world = self.flying.checked
        self._fly(self.flying)
        self._watch()

    def _fly(self, flying: Flying) -> None:
        """Set the current plan and its polynomials."""
        self.flying = flying
        self.pieces = {name: polynomials(text) for name, text in flying.flights.items()}

    def _watch(self) -> None:
        """Start a new monitor and a new log for the current plan."""
        mission, kernel = self.flying.checked.valid_mission, self.flying.checked.valid_kernel
        self.session = Session(mission, kernel, self.limits)
        self.log, self.lost, self.texts, self.given_up = [], [], {}, []
        self.slow, self.risky, self.away = {}, set(), {}

    @property
    def team(self) -> list[str]:
        """Names of the agents in the current plan."""
        return [agent.name for agent in self.flying.checked.valid_mission.agents]

    @property
    def dimension(self) -> int:
        return self.flying.checked.valid_mission.dimension

    def hear(self, reports: list[Report]) -> list[str]:
        """Record reports, and return them as lines of samples with times of the complete flight."""
        heard: list[str] = []
        for report in reports:
            name = self.names[report.agent]
            self.heard[name] = max(self.heard.get(name, 0.0), report.time)
            heard.append(_line(name, report, 0.0, self.dimension))
            if name in self.team and report.time >= self.began - 1e-9:
                self.log.append((name, report))
                assert self.session is not None
                for _ in self.session.feed(_line(name, report, self.began, self.dimension)):
                    pass
                self.away[name] = report
        return heard

    def change(self, text: str) -> None:
        """Apply a patch of the mission from now on.

        Args:
            text: contents of the patch, a readable one.
        """
        edited = patched(self.world, Source("change", text), self.limits)
        assert isinstance(edited, Mapping), "patches are read before the flight"
        self.world = earlier(self.world, edited, self.limits)
        self.texts.update(edited)
        self.causes.append("the world changed")

    def look(self, time: float) -> None:
        """Detect problems up to ``time``, in seconds, and replan the remaining mission if there are any."""
        for name in self.team:
            if name not in self.lost and time - self.heard.get(name, self.began) > SILENT and time > SILENT:
                self.lost.append(name)
                self.causes.append(f"{name} is lost")
        if time < max(self.began, self.busy):
            return
        for name, report in self.away.items():
            if name not in self.lost:
                self._follow(name, report)
        assert self.session is not None
        for standing in self.session.standings[: self.session.requirements]:
            bad = standing.at_risk or standing.verdict is LiveVerdict.VIOLATED
            if bad and standing.name not in self.risky:
                self.risky.add(standing.name)
                self.causes.append(f"`{standing.name}` is {'at risk' if standing.at_risk else 'violated'}")
        if self.causes:
            why, self.causes = ", ".join(self.causes), []
            if self.replans and sum(each.begins is not None for each in self.happened) < MOST_REPLANS:
                self._replan(time, why)
            else:
                self.happened.append(GroundEvent(time, why, "no replanning"))

    def _follow(self, name: str, report: Report) -> None:
        """Record the causes of replanning if an agent is away from its expected position."""
        off = float(np.linalg.norm(report.position - self.told.wanted(self.names.index(name), report.time)))
        if off > LAG and (speed := self._slow_speed(name)) is not None:
            self.slow[name] = SURE * speed
            self.risky.add(f"{name} is off")
            self.causes.append(f"{name} is limited to {speed:.2f} m/s")
        elif off > OFF and f"{name} is off" not in self.risky:
            self.risky.add(f"{name} is off")
            self.causes.append(f"{name} is {off:.2f} m off its trajectory")

    def _slow_speed(self, name: str) -> float | None:
        """Estimated maximum speed in m/s of a delayed agent; None if it is not slow, or has too few reports."""
        mine = [each for own, each in self.log if own == name]
        recent = sorted((each for each in mine if each.time >= mine[-1].time - SEEN), key=lambda each: each.time)
        if len(recent) < FEWEST:
            return None
        top = next(each.dynamics.top_speed for each in self.flying.checked.valid_mission.agents if each.name == name)
        times = np.array([each.time - self.began for each in recent])
        places, half = np.stack([each.position for each in recent]), len(recent) // 2
        before = progress(self.pieces[name], times[: half + 1], places[: half + 1])
        found = progress(self.pieces[name], times[half:], places[half:])
        behind = found.beside < BESIDE and found.behind > BESIDE and max(before.rate, found.rate) < SLOW
        slower = SLOWEST < found.speed < SURE * self.slow.get(name, top)
        return found.speed if behind and slower else None

    def _replan(self, time: float, why: str) -> None:
        mission = self.flying.checked.valid_mission
        so_far, findings = read_flown(Source("flown.csv", self._table()), mission, self.lost, self.limits)
        if so_far is None:
            self.happened.append(GroundEvent(time, why, f"report rejected: {findings[0].message}"))
            return
        seconds, given_up = 0.0, list(self.given_up)
        patience = min(self.patience, max(1.0, MOST_OF_IT * self._left(time) / self.within))
        within = Seconds(self.within * patience)
        allowed = (self.within if self.clock is None else self.clock) * patience
        most = math.inf
        for _ in range(GIVE_UPS + 1):
            request = Request(
                so_far,
                tuple(self.lost),
                self.slow,
                self.texts,
                tuple(given_up),
                at=time - self.began,
                in_time=within,
                clock=Seconds(max(allowed - seconds, 0.0)),
                ahead=within + min(2 * within, self._left(time)) + STOP,
                seed=self.seed,
                hurried=True,
            )
            found = replan(self.flying, request, self.limits)
            seconds += found.seconds
            if found.flown_on is not None:
                most = min(most, len({*given_up, *found.flown_on}))
            if found.way is not Way.NONE or not found.cannot or len(given_up) >= most:
                break
            given_up += [name for name in found.cannot if name not in given_up]
        if len(given_up) >= most and found.way is not Way.KEPT and (most or not found.ok):
            # No plan satisfies more than the current one: if it loses nothing, two bodies still come too close.
            self.patience = 1
            self.happened.append(GroundEvent(time, why, FLOWN_ON, seconds))
            return
        self.given_up = given_up
        if found.undecided or (found.way is Way.NONE and found.must_stop):
            self._ask_again(time, within, found.undecided)
        else:
            self.patience = 1
        self._take(time, why, found, seconds)

    def _left(self, time: float) -> float:
        """Remaining seconds of the mission at ``time``, in seconds."""
        return float(self.flying.checked.valid_mission.horizon) + self.began - time

    def _ask_again(self, time: float, within: Seconds, undecided: bool) -> None:
        """Schedule another attempt after a late plan; the flight continues, and may leave more time then.

        Args:
            time: time of the flight, s.
            within: wait until the next attempt.
            undecided: whether planning ran out of time, for which the next attempt gets more.
        """
        self.busy = time + within
        self.patience = min(2 * self.patience, PATIENCE) if undecided else 1
        self.causes.append("no plan in time")

    def _table(self) -> str:
        """Reported positions since the start of the current plan, as a CSV trace."""
        rows = (
            (name, round(report.time - self.began, 9), *report.position.tolist(), report.heading)
            for name, report in self.log
        )
        return "\n".join(["agent,t,x,y,z,yaw", *(",".join(map(str, row)) for row in rows)]) + "\n"

    def _take(self, time: float, why: str, found: Replanned, seconds: float) -> None:
        """Upload the result of replanning: stops immediately, a plan for its start.

        Without a new plan, the current one continues if it has no collision.

        Args:
            time: time of the flight, s.
            why: cause in words.
            found: result of replanning.
            seconds: planning time, s.
        """
        begins = None if found.begins is None else self.began + found.begins
        came = found.way.value if found.way is not Way.NONE else "; ".join(each.message for each in found.findings[:2])
        stops = found.stops if found.ok or found.must_stop else {}
        for name, text in stops.items():
            self.told.upload(self.names.index(name), polynomials(text), time)
        if not found.ok or found.compiled is None or begins is None:
            self.happened.append(GroundEvent(time, why, came, seconds, given_up=tuple(self.given_up)))
            self._fly(diverted(self.flying, stops, time - self.began))
            return
        assert isinstance(found.compiled.outcome, Verified)
        files = dict(found.compiled.outcome.files)
        assert found.rest is not None
        mission = found.rest.valid_mission
        flights = flights_in(mission.agents, files)
        for name, text in flights.items():
            self.told.upload(self.names.index(name), polynomials(text), begins)
        self.happened.append(GroundEvent(time, why, came, seconds, begins, tuple(self.given_up)))
        self._fly(Flying(found.rest, found.compiled.outcome.plan.trace, flights))
        self.began = begins
        self._watch()


def _line(name: str, report: Report, began: float, dimension: int) -> str:
    """JSON line of a report, a sample of the agent's state with its time relative to ``began``, in seconds."""
    place, velocity = report.position[:dimension].tolist(), report.velocity[:dimension].tolist()
    state = {"t": round(report.time - began, 9), "agent": name, "position": place, "velocity": velocity}
    return json.dumps({**state, "heading": report.heading})

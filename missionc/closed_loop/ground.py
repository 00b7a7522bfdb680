"""The ground: it hears reports, sees who is lost or off, and has the rest of the mission planned anew.

in   reports, and what it is told of the world
out  uploads
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from missionc.base.limits import Limits
from missionc.base.source import Source
from missionc.base.units import Seconds
from missionc.closed_loop.reports import Report
from missionc.closed_loop.told import Told
from missionc.curves.crazyflie_csv import polynomials
from missionc.monitoring.live.session import Session
from missionc.monitoring.live.verdicts import Verdict
from missionc.monitoring.read_flown import read_flown
from missionc.output.folder.file_names import flights_in
from missionc.pipeline.replan.patch import patched
from missionc.pipeline.replan.replan import OFF, replan
from missionc.pipeline.replan.request import Flying, Replanned, Request, Way
from missionc.pipeline.results import Verified

SILENT = 1.0
"""Seconds: who is not heard of for so long is taken to be lost."""
MOST_REPLANS = 6
GIVE_UPS = 3
"""How often, for one cause, what cannot be kept is given up for the sake of the rest."""


@dataclass(frozen=True, slots=True)
class Happened:
    """What the ground did, and when: seconds of the flight, why, and how long planning took."""

    time: float
    why: str
    came: str
    seconds: float = 0.0
    begins: float | None = None
    given_up: tuple[str, ...] = ()


@dataclass(slots=True, eq=False)
class Ground:
    """One mission, watched and planned anew.

    Args:
        flying: what is flown.
        told: to which uploads go.
        names: of all agents of the flight, in order.
        within: seconds in which another plan has to be ready.
        replans: whether it plans anew at all, or only watches.
        clock: seconds that planning may take by the clock; ``within`` where it is None.
    """

    flying: Flying
    told: Told
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
    given_up: list[str] = field(default_factory=list)
    happened: list[Happened] = field(default_factory=list)
    session: Session | None = None
    risky: set[str] = field(default_factory=set)
    away: dict[str, Report] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._watch()

    def _watch(self) -> None:
        """A new session, and a new log, for what is flown now."""
        mission, kernel = self.flying.checked.mission, self.flying.checked.kernel
        assert mission is not None
        assert kernel is not None
        self.session = Session(mission, kernel, self.limits)
        self.log, self.lost, self.texts, self.given_up = [], [], {}, []
        self.risky, self.away = set(), {}

    @property
    def team(self) -> list[str]:
        """Those that the plan is for."""
        assert self.flying.checked.mission is not None
        return [agent.name for agent in self.flying.checked.mission.agents]

    @property
    def dimension(self) -> int:
        assert self.flying.checked.mission is not None
        return self.flying.checked.mission.dimension

    def hear(self, reports: list[Report]) -> list[str]:
        """Take in reports; what they say of the whole flight, as lines of samples."""
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
        """The world is another one from now on."""
        edited = patched(self.flying.checked, Source("change", text), self.limits)
        assert isinstance(edited, Mapping), "patches are read before the flight"
        self.texts.update(edited)
        self.causes.append("the world has changed")

    def look(self, time: float) -> None:
        """See what is wrong by now; and have the rest planned anew where something is."""
        for name in self.team:
            if name not in self.lost and time - self.heard.get(name, self.began) > SILENT and time > SILENT:
                self.lost.append(name)
                self.causes.append(f"{name} is lost")
        if time < self.began:
            return
        for name, report in self.away.items():
            index = self.names.index(name)
            off = float(np.linalg.norm(report.position - self.told.wanted(index, report.time)))
            if off > OFF and name not in self.lost and f"{name} is off" not in self.risky:
                self.risky.add(f"{name} is off")
                self.causes.append(f"{name} is {off:.2f} m off its way")
        assert self.session is not None
        for standing in self.session.standings[: self.session.requirements]:
            bad = standing.at_risk or standing.verdict is Verdict.VIOLATED
            if bad and standing.name not in self.risky:
                self.risky.add(standing.name)
                self.causes.append(f"`{standing.name}` is {'at risk' if standing.at_risk else 'lost'}")
        if self.causes:
            why, self.causes = ", ".join(self.causes), []
            if self.replans and sum(each.begins is not None for each in self.happened) < MOST_REPLANS:
                self._replan(time, why)
            else:
                self.happened.append(Happened(time, why, "seen"))

    def _replan(self, time: float, why: str) -> None:
        mission = self.flying.checked.mission
        assert mission is not None
        so_far, findings = read_flown(Source("flown.csv", self._table()), mission, self.lost, self.limits)
        if so_far is None:
            self.happened.append(Happened(time, why, f"not understood: {findings[0].message}"))
            return
        seconds, given_up = 0.0, list(self.given_up)
        for _ in range(GIVE_UPS + 1):
            request = Request(
                so_far,
                tuple(self.lost),
                self.texts,
                tuple(given_up),
                at=time - self.began,
                in_time=self.within,
                clock=self.clock,
                seed=self.seed,
            )
            found = replan(self.flying, request, self.limits)
            seconds += found.seconds
            if found.way is not Way.NONE or not found.cannot:
                break
            given_up += [name for name in found.cannot if name not in given_up]
        self.given_up = given_up
        self._take(time, why, found, seconds)

    def _table(self) -> str:
        """What was flown of the plan, as a table that is read like any."""
        rows = (
            (name, round(report.time - self.began, 9), *report.position.tolist(), report.heading)
            for name, report in self.log
        )
        return "\n".join(["agent,t,x,y,z,yaw", *(",".join(map(str, row)) for row in rows)]) + "\n"

    def _take(self, time: float, why: str, found: Replanned, seconds: float) -> None:
        """Upload what was found: the stops at once, the plan for when it begins.

        Where there is no plan, the old one is flown on if nobody touches anything on it.
        """
        begins = None if found.begins is None else self.began + found.begins
        came = found.way.value if found.way is not Way.NONE else "; ".join(each.message for each in found.findings[:2])
        stops = found.stops if found.ok or found.must_stop else {}
        for name, text in stops.items():
            self.told.upload(self.names.index(name), polynomials(text), time)
        if not found.ok or found.compiled is None or begins is None:
            self.happened.append(Happened(time, why, came, seconds, given_up=tuple(self.given_up)))
            return
        assert isinstance(found.compiled.outcome, Verified)
        files = dict(found.compiled.outcome.files)
        assert found.rest is not None
        mission = found.rest.mission
        assert mission is not None
        flights = flights_in(mission.agents, files)
        for name, text in flights.items():
            self.told.upload(self.names.index(name), polynomials(text), begins)
        self.happened.append(Happened(time, why, came, seconds, begins, tuple(self.given_up)))
        self.flying = Flying(found.rest, found.compiled.outcome.plan.trace, flights)
        self.began = begins
        self._watch()


def _line(name: str, report: Report, began: float, dimension: int) -> str:
    """A report as a line of samples, its time counted from then on."""
    place, velocity = report.position[:dimension].tolist(), report.velocity[:dimension].tolist()
    state = {"t": round(report.time - began, 9), "agent": name, "position": place, "velocity": velocity}
    return json.dumps({**state, "heading": report.heading})

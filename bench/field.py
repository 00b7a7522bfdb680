"""Benchmark of the field corpus, missions in the style of strangers: verdict, backend, time, path length and margins.

    python bench/field.py [DIR] [--only NAME …] [--time-limit 120] [--json FILE] [--against FILE]

Each is compiled as written, in a process of its own, one after the other, without a search for what would help where
there is no plan. *Verdict*:

- *planned*: there is a plan, and it is verified.
- *impossible*: a proof that no motion of these agents satisfies it, whatever the roadmap.
- *on roadmaps*: the tried roadmaps contain no plan, which proves nothing about the mission.
- *by check*: `missionc check` refuses it.
- *undecided*: none of these, in this time.

*Engine* is the backend that was asked last. Seconds of the processor are those of the process and its
children. *Margin* is the smallest of the plan in metres: of a requirement, to an obstacle, between two bodies.
*Normalised* is the smallest of its requirements, each margin divided by its natural scale (the inradius of a region,
the range of a link, the tolerance of a formation). *Between* is whether every requirement is satisfied between
samples, in continuous time: ``yes``, ``no``, or ``not decided``. ``DIR`` is another folder of missions.

*Of the bound* is the length of all ways together over the sum of each agent's lower bound. Where a mission asks for
nothing but reaching (of named agents, or of every agent of a team, to be in regions or beyond lines: once, in a row, or
from some time on), that is the longest of an agent's tasks: from where it starts in the plan to the first region, from
there to the one after it, and so on; or to its finish. A leg is the shortest way between the nearest points of the two
for a body of its size, round the obstacles that stand still (in a volume: the straight distance, or that by the best
hole in a floor between the two), so that a task in parts is longer than its bound by what it goes within regions. Of
all other missions it is a dash.

``--json`` keeps what was measured, and ``--against`` such a file adds columns: the seconds of the processor and the
length over those before.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import shapely
from response_time import ENVIRONMENT, ROOT

from missionc.base.trace import Array, Trace
from missionc.compiler import driver
from missionc.geometry.configuration_space import Area, Atlas
from missionc.geometry.geodesic_bounds import VisibilityGraph
from missionc.ir import Compare, Inside, Mission, Predicate, Still
from missionc.ir.distances.signed_distance import signed_distance
from missionc.ir.kernel.nodes import All, Always, At, Atom, Eventually, Node, Not, Until
from missionc.ir.predicates.features import Coordinate
from missionc.verification.certificate import Verdict
from missionc.verification.monitoring.normalised_margins import normalised_margins

MISSIONS = ROOT / "missions" / "field"

MARGINS = ("requirement", "obstacle", "separation")
"""Checks of a certificate whose margins are distances in metres."""

PITCH = 0.1
"""Distance in metres between places where a path may pass a height."""

OVERRUN = 90.0
"""Seconds beyond the limit after which a process is ended."""


@dataclass(frozen=True, slots=True)
class Row:
    """Result of one mission; None without a plan, or without a bound on its length.

    ``between``: whether the requirements are satisfied between samples. ``peer``: cells of another planner.
    """

    outcome: str
    engine: str
    processor: float
    wall: float
    length: float | None = None
    over_bound: float | None = None
    margin: float | None = None
    normalised: float | None = None
    between: str = ""
    peer: tuple[str, ...] = ()

    @property
    def planned(self) -> bool:
        return self.outcome == "planned"


class OtherTask(Exception):
    """Error for a formula that needs more than reaching."""


def tasks(node: Node, whose: int | None, *, later: bool) -> Iterator[tuple[int, list[Predicate]]]:
    """Agents of a formula, each with the places that it reaches in order.

    ``later``: it is evaluated at a step after the first.
    """
    match node:
        case At(agent, body):
            yield from tasks(body, agent, later=later)
        case Eventually(body) | Until(Not(Atom(Inside())), body):
            yield from tasks(body, whose, later=True)
        case Always(body, low) if later or low > 0:
            yield from tasks(body, whose, later=True)
        case All(parts):
            here = [part.predicate for part in parts if isinstance(part, Atom)]
            for part in parts:
                first = [] if isinstance(part, Atom) else here[:1]
                yield from ((agent, first + places) for agent, places in tasks(part, whose, later=later))
        case Atom(Inside() | Compare() as predicate) if whose is not None and later:
            yield whose, [predicate]
        case _:
            raise OtherTask


def first_before(node: Node, whose: int | None) -> Iterator[tuple[int, Predicate, Predicate]]:
    """Orders ``(not then) until first`` of an agent: agent, first and then."""
    match node:
        case At(agent, body):
            yield from first_before(body, agent)
        case All(parts):
            for part in parts:
                yield from first_before(part, whose)
        case Until(Not(Atom(Inside() as then)), Atom(Inside() as first)) if whose is not None:
            yield whose, first, then
        case _:
            pass


@dataclass(frozen=True, slots=True)
class Ground:
    """World of a mission, with lower bounds on the path lengths of its agents."""

    mission: Mission
    atlas: Atlas
    planes: dict[float, VisibilityGraph] = field(default_factory=dict)

    @staticmethod
    def of(mission: Mission) -> Ground:
        shapes = [region.shape for region in mission.regions] + [obstacle.shape for obstacle in mission.obstacles]
        return Ground(mission, Atlas.of(mission.world, shapes))

    def bound(self, starts: Array, goals: Iterable[Node]) -> float:
        """Sum over all agents of their longest tasks, metres; ``starts``: (agents, dim), metres."""
        asked = list(goals)
        orders = [order for goal in asked for order in first_before(goal, None)]
        longest: dict[int, float] = {}
        for whose, places in (task for goal in asked for task in tasks(goal, None, later=False)):
            before = [first for agent, first, then in orders if agent == whose and then == places[0]]
            areas = [self.area(place) for place in before[:1] + places]
            longest[whose] = max(
                longest.get(whose, 0.0), self.way(whose, self.atlas.point(tuple(starts[whose])), areas)
            )
        for agent in self.mission.agents:
            if agent.finish is not None and agent.finish.point is not None:
                finish, start = self.atlas.point(agent.finish.point), self.atlas.point(tuple(starts[agent.index]))
                longest[agent.index] = max(longest.get(agent.index, 0.0), self.way(agent.index, start, [finish]))
        return sum(longest.values())

    def area(self, place: Predicate) -> Area:
        """Outer bound of the places where a predicate holds."""
        match place:
            case Inside(region):
                return self.atlas.outer(region.shape)
            case Compare(terms, constant):
                weights = [0.0] * self.mission.dimension
                for weight, feature in terms:
                    if not isinstance(feature, Coordinate):
                        raise OtherTask
                    weights[feature.axis] += weight
                return self.atlas.half_space(tuple(weights), constant)
            case _:
                raise OtherTask

    def way(self, whose: int, start: Area, places: list[Area]) -> float:
        """Lower bound on the length of the legs from a start through places, metres."""
        legs = list(pairwise([start, *places]))
        radius = float(self.mission.agents[whose].radius)
        if self.mission.dimension == 3:
            return sum(max(self.atlas.distance(*leg), self.climb(*leg, radius)) for leg in legs)
        plane = self.planes.get(radius) or self.planes.setdefault(radius, self.plane(radius))
        return sum(plane.geodesic(first.geometry()[0], second.geometry()[0]) for first, second in legs)

    def climb(self, start: Area, goal: Area, radius: float) -> float:
        """Lower bound on the length of a path between two areas at different heights, metres.

        Heights are the middles of obstacles that stand still; in one, all places of a grid are tried.
        """
        still = [each.shape for each in self.mission.obstacles if isinstance(each.motion, Still)]
        floors = [self.atlas.bounds(self.atlas.inner(shape)) for shape in still]
        ends = (self.atlas.bounds(each) for each in (start, goal))
        below, above = sorted((low[2], high[2]) for low, high in ends)
        world, longest, room = self.mission.world, 0.0, radius + float(self.mission.clearance)
        sides = zip(world.low[:2], world.high[:2], strict=True)
        axes = [np.arange(low + room, high - room + PITCH, PITCH) for low, high in sides]
        level = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
        for height in {(low[2] + high[2]) / 2 for low, high in floors}:
            if not below[1] < height < above[0]:
                continue
            places = np.column_stack([level, np.full(len(level), height)])
            free = np.min([signed_distance(np, shape, places) for shape in still], axis=0) >= -PITCH
            open_places = [tuple(place) for place in places[free].tolist()]
            ways = zip(self.atlas.distances(open_places, start), self.atlas.distances(open_places, goal), strict=True)
            longest = max(longest, min(map(sum, ways), default=math.inf) - 2 * PITCH)
        return longest

    def plane(self, radius: float) -> VisibilityGraph:
        """Outer bound of the places of a body's centre: without moving obstacles, with cut corners."""
        room = (radius + float(self.mission.clearance)) * 0.99
        still = [each.shape for each in self.mission.obstacles if isinstance(each.motion, Still)]
        bodies = [self.atlas.inner(shape).geometry()[0].buffer(room, quad_segs=2) for shape in still]
        low, high = self.mission.world.low, self.mission.world.high
        world = shapely.box(low[0] + room, low[1] + room, high[0] - room, high[1] - room)
        return VisibilityGraph.of(shapely.union_all(bodies), world)


@dataclass(frozen=True, slots=True)
class Run:
    """One compilation in a process of its own: its JSON document, and its seconds."""

    document: dict[str, Any]
    processor: float
    wall: float


def run(path: Path, limit: float, folder: Path, more: Sequence[str] = ()) -> Run:
    """Compile a mission without advice; the folder exists if there is a plan.

    Args:
        more: further flags.
    """
    command = [sys.executable, "-m", "missionc", "compile", str(path), "-o", str(folder), "--force", "--quiet"]
    command += ["--format", "json", "--explain-limit", "0", "--time-limit", str(limit), *more]
    begin = time.perf_counter()
    with tempfile.TemporaryFile() as said:
        process = subprocess.Popen(
            command, stdout=said, stderr=subprocess.DEVNULL, env=ENVIRONMENT, start_new_session=True
        )
        ended = False
        while (waited := os.wait4(process.pid, os.WNOHANG))[0] == 0:
            if not ended and time.perf_counter() - begin > limit + OVERRUN:
                os.killpg(process.pid, signal.SIGKILL)
                ended = True
            time.sleep(0.05)
        wall, used = time.perf_counter() - begin, waited[2]
        process.returncode = os.waitstatus_to_exitcode(waited[1])
        said.seek(0)
        text = said.read()
    document = {"outcome": "overran", "backend": "", "diagnostics": []} if ended else json.loads(text)
    return Run(document, used.ru_utime + used.ru_stime, wall)


ROADMAPS = "MC601"
"""Code of a refusal about roadmaps only."""


def verdict(document: dict[str, Any]) -> str:
    """Verdict in a JSON document, as in the table."""
    codes = {each["code"] for each in document["diagnostics"] if each["severity"] == "error"}
    match document["outcome"]:
        case "refused":
            return "by check"
        case "impossible" | "undecided" if ROADMAPS in codes:
            return "on roadmaps"
        case other:
            return str(other)


def compiled(path: Path, limit: float, folder: Path) -> Row:
    """Result of a mission, without its plan."""
    came = run(path, limit, folder)
    return Row(verdict(came.document), str(came.document["backend"] or ""), came.processor, came.wall)


def between(certificate: dict[str, Any]) -> str:
    """Whether the requirements of a plan are satisfied in continuous time: ``yes``, ``no`` or ``not decided``."""
    verdicts = {each["verdict"] for each in certificate["between_steps"]}
    if Verdict.FAILS.value in verdicts:
        return "no"
    return "yes" if verdicts <= {Verdict.HOLDS.value} else "not decided"


def measured(path: Path, limit: float) -> Row:
    """Plan a mission, and measure its plan."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "plan"
        row = compiled(path, limit, folder)
        if not row.planned:
            return row
        plan = json.loads((folder / "plan.json").read_text(encoding="utf-8"))
        certificate = json.loads((folder / "certificate.json").read_text(encoding="utf-8"))
    position = np.array([agent["position"] for agent in plan["agents"]])
    length = float(np.linalg.norm(np.diff(position, axis=1), axis=-1).sum())
    margins = [each["margin"] for each in certificate["checks"] if each["name"] in MARGINS]
    least = min((margin for margin in margins if margin is not None and math.isfinite(margin)), default=None)
    checked = driver.check(path)
    assert checked.mission is not None
    assert checked.kernel is not None
    headings = np.array([agent["yaw"] for agent in plan["agents"]])
    velocity = np.array([agent["velocity"] for agent in plan["agents"]])
    trace = Trace(checked.mission.step, position, velocity, headings)
    scaled = normalised_margins(checked.mission, checked.kernel.requirements, trace)
    try:
        bound = Ground.of(checked.mission).bound(position[:, 0], [each.formula for each in checked.kernel.requirements])
    except OtherTask:
        bound = 0.0
    over, normalised = length / bound if bound else None, min(scaled.values(), default=None)
    found = between(certificate)
    return replace(row, length=length, over_bound=over, margin=least, normalised=normalised, between=found)


def figure(value: float | None, form: str) -> str:
    return "–" if value is None else format(value, form)


def ratio(now: float | None, before: float | None) -> float | None:
    return now / before if now is not None and before else None


def line(name: str, row: Row, before: Row | None, compares: bool) -> str:
    cells = [name, row.outcome, row.engine, f"{row.processor:.1f}", f"{row.wall:.1f}"]
    cells += [
        figure(row.length, ".1f"),
        figure(row.over_bound, ".2f"),
        figure(row.margin, ".3f"),
        figure(row.normalised, ".3f"),
        row.between or "–",
        *row.peer,
    ]
    if compares:
        cells += [before.outcome if before else "–"]
        cells += [figure(ratio(row.processor, before.processor if before else None), ".2f")]
        cells += [figure(ratio(row.length, before.length if before else None), ".2f")]
    return f"| {' | '.join(cells)} |"


def summary(rows: Iterable[Row]) -> Iterator[str]:
    """Number of planned missions, with median and maximum costs."""
    every = list(rows)
    plans = [row for row in every if row.planned]
    yield f"{len(plans)} of {len(every)} planned"
    ratios = [row.over_bound for row in plans if row.over_bound is not None]
    for says, values in (
        ("CPU seconds of planned missions", [row.processor for row in plans]),
        ("wall seconds of planned missions", [row.wall for row in plans]),
        ("length over the bound", ratios),
        ("normalised margin", [row.normalised for row in plans if row.normalised is not None]),
    ):
        if values:
            yield f"{says}: median {statistics.median(values):.2f}, most {max(values):.2f}"


def benchmark(about: str, folder: Path, peer: Mapping[str, Callable[[Path], str]] = MappingProxyType({})) -> None:
    """Measure the missions of a folder, as the command line says.

    Args:
        about: help text.
        folder: folder of the missions, if the command line names none.
        peer: further columns, with the function for a mission's cell.
    """
    parser = argparse.ArgumentParser(description=about, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", type=Path, default=folder, metavar="DIR", help="folder of the missions")
    parser.add_argument("--only", nargs="*", metavar="NAME", help="only these missions")
    parser.add_argument(
        "--time-limit", type=float, default=120.0, help="time limit of each mission, in seconds of wall time"
    )
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the results to a file")
    parser.add_argument("--against", type=Path, metavar="FILE", help="compare with the results in this file")
    arguments = parser.parse_args()
    names = sorted(path.stem for path in arguments.folder.glob("*.mission"))
    if not names:
        parser.error(f"no missions in {arguments.folder}")
    kept = json.loads(arguments.against.read_text(encoding="utf-8")) if arguments.against else {}
    before = {name: Row(**row) for name, row in kept.items()}
    heads = ["mission", "verdict", "engine", "CPU s", "wall s", "length m", "of the bound", "margin m", "normalised"]
    heads += ["between", *peer, *(["before", "CPU ratio", "length ratio"] if before else [])]
    print(f"| {' | '.join(heads)} |\n|{'---|' * len(heads)}", flush=True)
    rows: dict[str, Row] = {}
    for name in arguments.only or names:
        path = arguments.folder / f"{name}.mission"
        cells = tuple(cell(path) for cell in peer.values())
        rows[name] = replace(measured(path, arguments.time_limit), peer=cells)
        print(line(name, rows[name], before.get(name), bool(before)), flush=True)
        if arguments.json:
            text = json.dumps({each: asdict(row) for each, row in rows.items()}, indent=1)
            arguments.json.write_text(text + "\n", encoding="utf-8")
    print("\n" + "\n".join(summary(rows.values())))


if __name__ == "__main__":
    benchmark(__doc__ or "", MISSIONS)

"""The report's data: plain lists, numbers and texts; long lists of numbers are packed.

in   Plotted
out  a dict for JSON, ``missionc.report/1``
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import field
from pathlib import PurePath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from missionc.base.late_dataclass import Record
from missionc.base.source import Span
from missionc.base.trace import Array, Flags, Plan, Trace, solved_text, stage_records
from missionc.geometry.columns import FLOOR
from missionc.geometry.curves.piecewise_polynomials import curves_of
from missionc.ir import Formation, Graph, Mission
from missionc.ir.couplings import directed
from missionc.ir.kernel.nodes import Kernel
from missionc.ir.language.margins.links import all_links, link_pieces
from missionc.ir.language.margins.predicate_margins import formation_margin
from missionc.output.documents.whole_flight_json import phases_on_the_clock
from missionc.output.folder.file_names import input_name
from missionc.output.report.charts import charts
from missionc.output.report.flight_tracks import Flights, flights
from missionc.output.report.flown_past import flown_past
from missionc.output.report.loop_tracks import LoopFlights
from missionc.output.report.pack import pack, thousandths
from missionc.output.report.requirement_lanes import Places, lanes
from missionc.output.report.sample_tracks import Placed
from missionc.output.report.tightest_margins import checks
from missionc.output.report.world_data import world_data, world_over_time
from missionc.verification.certificate import Between, Certificate, Check, Verdict
from missionc.verification.flight.verify_whole_flight import pieces_of
from missionc.verification.flight.way_missions import Stage, Ways, is_whole, ways_of
from missionc.version import __version__

POINTS = 25
"""Number of points on each agent's path in a transfer before or after the mission."""


class Plotted(Record, eq=False):
    """Contents of a report: the mission, its plan and certificate, and further files.

    Args:
        kernel: with the ``meanings`` of the mission's formulas, or no formula has a lane.
        flights: text of each agent's polynomials, by the agent's name; unreadable ones are not drawn.
        texts: the mission's files, the mission first: names relative to its folder, and contents.
        miss: faults of a motion that is not a plan, in words; empty for a plan.
        simulation: text of ``simulation.json``; not drawn if it is unreadable.
        digest: SHA-256 of the file with the motion, or empty.
        ways: texts of the transfers before and after the mission.
        past: text of ``past.json``, if a part of the mission was flown; not drawn if it is unreadable.
        loop: flights in a closed loop, which the page is then about; None for a plan.
    """

    mission: Mission
    kernel: Kernel
    plan: Plan
    certificate: Certificate
    flights: Mapping[str, str]
    texts: tuple[tuple[str, str], ...]
    miss: str = ""
    simulation: str = ""
    digest: str = ""
    ways: Ways = field(default_factory=dict)
    past: str = ""
    loop: LoopFlights | None = None


def data(plotted: Plotted) -> dict[str, Any]:
    mission, plan = plotted.mission, plotted.plan
    moving = flights(mission, plan.trace, plotted.flights, plotted.simulation, plotted.loop)
    flown = moving.simulated.checks if moving.simulated else ()
    judged = plotted.certificate.joined(Certificate(mission.name, flown))
    team = _at_steps(moving, plan.trace)
    rows, tree = lanes(mission, plotted.kernel, plan.trace, places(plotted))
    return {
        "schema": "missionc.report/1",
        "backend": plan.backend,
        "solved": solved_text(plan.solved),
        "seed": plan.seed,
        "stages": stage_records(plan.runs),
        "version": __version__,
        "digest": plotted.digest,
        "proven": str(plan.proven) if plan.proven else "",
        **world_data(mission, plotted.kernel, world_over_time(moving.worlds)),
        "graphs": [_graph(graph, *team) for graph in mission.graphs],
        "formations": [_formation(formation, *team) for formation in mission.formations],
        "motion": _motion(moving),
        "texts": [{"name": name, "text": text} for name, text in plotted.texts],
        "rows": rows,
        "lanes": tree,
        "charts": charts(mission, moving, plotted.certificate, plan.trace),
        "checks": checks(judged, mission, plotted.kernel, plan.trace),
        "figures": [
            {"name": figure.name, "subject": figure.subject, "value": _number(figure.value), "unit": figure.unit}
            for figure in plotted.certificate.figures
        ],
        "between": [
            {"requirement": each.requirement, "verdict": each.verdict.value, "at": each.at, "detail": each.detail}
            for each in plotted.certificate.between
        ],
        "delays": [
            {
                "agent": each.agent,
                "tolerated": each.tolerated,
                "open": each.open,
                "breaks": each.broken,
                "at": each.at,
            }
            for each in plotted.certificate.delays
        ],
        "badge": _badge(plotted),
        "passed": plotted.certificate.passed,
        "miss": plotted.miss,
        "warnings": list(plotted.certificate.warnings),
        "whole": _whole_flight(mission, plotted.flights, plotted.ways),
        "past": flown_past(mission, plotted.past),
        "loop": None if plotted.loop is None else dict(plotted.loop.record),
    }


def _badge(plotted: Plotted) -> dict[str, str]:
    """Verdict for the page: ``holds``, ``steps`` if some requirement holds at the steps only, or ``fails``, and its
    text.
    """
    certificate = plotted.certificate
    if plotted.loop:
        state, says = plotted.loop.headline
        return {"state": state, "says": says}
    if plotted.miss:
        return {"state": "fails", "says": f"no plan: {plotted.miss}"}
    if not certificate.passed:
        return {"state": "fails", "says": "not verified"}
    broken = [_between(each) for each in certificate.between if each.verdict is Verdict.FAILS]
    open_ = [f"`{each.requirement}`" for each in certificate.between if each.verdict is Verdict.UNDECIDED]
    if open_:
        broken.append(f"{', '.join(open_)} not decided between samples")
    if broken:
        return {"state": "steps", "says": f"satisfied at the sample times; {'; '.join(broken)}"}
    return {"state": "holds", "says": "verified"}


def _between(each: Between) -> str:
    if each.at is None:
        when = ""
    elif each.until is None or each.until - each.at < 0.005:
        when = f", {each.at:.2f} s"
    else:
        when = f", {each.at:.2f}\u2013{each.until:.2f} s"
    return f"`{each.requirement}` violated between samples{when}"


def places(plotted: Plotted) -> Places:
    """Function from a span to the number of its text and its first and last character."""
    folder = PurePath(plotted.mission.span.source.name).parent
    numbers = {name: number for number, (name, _) in enumerate(plotted.texts)}

    def place(span: Span) -> list[int] | None:
        name = input_name(span.source.name, folder)
        return [numbers[name], span.start, span.end] if name in numbers else None

    return place


def _at_steps(moving: Flights, trace: Trace) -> tuple[Array, Flags]:
    """Positions of the team at the steps, (agents, steps + 1, dim), metres, and a mask of its present agents, for
    links.

    The positions are those of the plan, or of the flight in a closed loop.
    """
    flown = moving.simulated.placed if moving.told is not None and moving.simulated is not None else None
    if flown is None or flown.there is None:
        return trace.position, np.ones(trace.position.shape[:2], dtype=np.bool_)
    return flown.position[:, :: flown.rate], flown.there[:, :: flown.rate]


def _graph(graph: Graph, position: Array, there: Flags) -> dict[str, Any]:
    """Links of a communication graph, each with its first step and end (exclusive), as packed rows of four numbers.

    ``directed`` links lead from the first agent to the second. Absent agents have no links.

    Args:
        position: (agents, steps + 1, dim), metres.
    """
    members = np.array(graph.agents, dtype=np.int64)
    one_way = directed(graph)
    steps = position.shape[1]
    runs = [np.zeros((0, 4), dtype=np.int64)]
    if len(members):
        linked = np.concatenate(
            [all_links(graph, position[:, piece]) > 0 for piece in link_pieces(steps, len(members))]
        )
        every = np.ones((len(members), len(members)), dtype=np.bool_)
        first, second = np.nonzero(every & ~np.eye(len(members), dtype=np.bool_) if one_way else np.triu(every, 1))
        seen = there[members]
        runs_of = np.zeros((len(first), steps + 2), dtype=np.int8)
        runs_of[:, 1:-1] = linked[:, first, second].T & seen[first] & seen[second]
        change = np.diff(runs_of, axis=1)
        (pair, begin), (_, end) = np.nonzero(change > 0), np.nonzero(change < 0)
        ends = np.stack([members[first[pair]], members[second[pair]]], axis=1)
        ends = ends if one_way else np.sort(ends, axis=1)
        runs.append(np.concatenate([ends, begin[:, None], end[:, None]], axis=1))
    whole = np.concatenate(runs)
    return {"name": graph.name, "directed": one_way, "runs": pack(whole.T), "count": len(whole)}


def _formation(formation: Formation, position: Array, there: Flags) -> dict[str, Any]:
    margins = [
        np.where(
            there[edge.first] & there[edge.second],
            formation_margin(formation, edge, position[edge.first], position[edge.second]),
            -np.inf,
        )
        for edge in formation.edges
    ]
    return {
        "name": formation.name,
        "edges": [[edge.first, edge.second] for edge in formation.edges],
        "margins": pack(thousandths(np.array(margins).reshape(len(margins), position.shape[1]))),
    }


def _motion(moving: Flights) -> dict[str, Any]:
    """Positions of each motion for the page, packed by axis and agent, at ``rate`` samples per step.

    Motions with the plan's rate are stored as differences from it (``added``).
    """
    planned = _axes(moving.planned)
    entries = {"planned": {"rate": moving.planned.rate, "added": False, "position": pack(planned)}}
    for name, sampled in moving.places():
        if name != "planned":
            added = sampled.rate == moving.planned.rate
            position = _axes(sampled) - planned if added else _axes(sampled)
            entries[name] = {"rate": sampled.rate, "added": added, "position": pack(position)}
    return entries


def _axes(sampled: Placed) -> NDArray[np.int64]:
    return thousandths(np.moveaxis(sampled.position, 2, 0))


def _number(value: float) -> float | None:
    return float(f"{value:.6g}") if math.isfinite(value) else None


def _whole_flight(mission: Mission, files: Mapping[str, str], ways: Ways) -> dict[str, Any] | None:
    """Data of the flight from takeoff to landing; None without takeoff from the floor, or if a file is unreadable."""
    flown = pieces_of(mission, files) if is_whole(mission) else None
    parts = [pieces_of(mission, ways[stage]) for stage in Stage if stage in ways]
    if flown is None or isinstance(flown, Check) or any(isinstance(part, Check) for part in parts):
        return None
    size = mission.dimension
    lines = []
    for part in parts:
        assert not isinstance(part, Check)
        curves = curves_of([part[agent.name] for agent in mission.agents], slice(0, size))
        lines.append(np.round(curves.at(np.linspace(0.0, float(curves.times[-1]), POINTS)), 3).tolist())
    hovers = ways_of(mission, flown)[Stage.HOME].end[:, :2].tolist()
    return {
        "phases": [
            {"phase": name, "begin": round(begin, 3), "end": round(end, 3)}
            for name, begin, end in phases_on_the_clock(mission, files, ways)
        ],
        "ways": lines,
        "pads": [[round(x, 3), round(y, 3), *([FLOOR] if size == 3 else [])] for x, y in hovers],
    }

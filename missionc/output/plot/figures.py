"""Figures of a plan: the requested picture as the bytes of a file.

says MC404, MC715

Charts of a plan over time: the robustness of its requirements, its distances, and a timeline of the agents.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from missionc.backends.roadmap_graph import RoadmapGraph
from missionc.base.diagnostics.code import NO_SUCH_MOMENT
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.trace import Array, Trace
from missionc.ir import Mission
from missionc.ir.kernel.analysis import robustness_unit
from missionc.ir.kernel.nodes import Kernel
from missionc.output.plot.figure_request import DISTANCES, ROBUSTNESS, TIMELINE, WIDTHS, FigureRequest
from missionc.output.plot.plot import BROKEN, COLOURS, GREY, MOST_NAMED, missing, plot, rendered, style
from missionc.output.plot.plot_strip import INCH, PER_SECOND, TEXT, positions
from missionc.output.report.charts import clearance, separation
from missionc.output.report.sample_tracks import Placed
from missionc.verification.monitoring.verdict_table import table
from missionc.verification.monitoring.violation import Witnesses

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


HATCHES = ("", "////", "....", "xxxx")
"""Hatches of timeline lanes, one for each repetition of the colours."""
MOST_SAMPLES = 1000
"""Maximum number of times at which a distance is drawn."""


def draw_robustness(figure: Figure, mission: Mission, kernel: Kernel, trace: Trace, width: str) -> None:
    """Draw, for each requirement, the interval of final robustness values that are still possible, over time.

    Source:
        Deshmukh et al., "Robust online monitoring of signal temporal logic" (2017), robust satisfaction intervals.
    """
    goals = kernel.requirements
    roots = [goal.formula for goal in goals]
    rows = table(roots, roots, mission, trace, kernel.opposites)
    times = np.arange(trace.position.shape[1]) * float(mission.step)
    panels = _panels(figure, mission, max(1, len(goals)), 0.85, width)
    for axes, goal in zip(panels, goals, strict=False):
        row = rows[goal.formula]
        least, most = _finite(row.least), _finite(row.most)
        asked = row.asked.any(axis=0) | row.unfolds
        least, most = (np.where(asked, each, np.nan) for each in (least, most))
        axes.fill_between(times, least, most, step="post", color=COLOURS[0], alpha=0.15, lw=0)
        axes.step(times, most, where="post", color=COLOURS[0], lw=0.9, ls=(0, (3, 1.4)), label="upper bound")
        axes.step(times, least, where="post", color=COLOURS[1], lw=1.2, label="lower bound")
        if np.isfinite(least).sum() == 1:
            axes.plot(times, least, ls="", marker="o", ms=3.5, color=COLOURS[1])
        axes.axhline(0, color=BROKEN, lw=0.8, ls=(0, (1, 1.2)))
        axes.set_title(goal.name, loc="left", fontsize=TEXT + 0.5, pad=3)
        unit = robustness_unit(goal.formula)
        axes.set_ylabel(f"robustness ({unit})" if unit else "robustness", fontsize=TEXT)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2, frameon=False, fontsize=TEXT)


def draw_distances(figure: Figure, mission: Mission, trace: Trace, width: str) -> None:
    """Draw the distance of the nearest two bodies, and of the nearest body and obstacle, with the required
    distances.
    """
    last = float(mission.step * mission.steps)
    times = np.linspace(0.0, last, int(min(MOST_SAMPLES, max(2, PER_SECOND * last + 1))))
    placed = Placed(1, times, positions(mission, trace, times))
    curves: list[tuple[str, Array, float]] = []
    if len(mission.agents) > 1:
        curves.append(("separation", separation(mission, placed), float(mission.separation)))
    if mission.obstacles:
        curves.append(("clearance", clearance(mission, placed), float(mission.clearance)))
    panels = _panels(figure, mission, max(1, len(curves)), 1.35, width)
    for axes, (name, distance, required) in zip(panels, curves, strict=False):
        axes.plot(times, distance, color=COLOURS[0], lw=1.2, label="distance")
        axes.axhline(required, color=BROKEN, lw=0.9, ls=(0, (3, 1.4)), label="required")
        at = int(distance.argmin())
        axes.plot(times[at], distance[at], ls="", marker="v", ms=4, color=COLOURS[1], label="minimum")
        axes.set_ylim(bottom=min(0.0, float(distance[at])) - 0.04 * float(distance.max()))
        title = f"{name}: minimum {distance[at]:.3g} m, required {required:.3g} m"
        axes.set_title(title, loc="left", fontsize=TEXT + 0.5, pad=3)
        axes.set_ylabel("distance (m)", fontsize=TEXT)
    if not curves:
        note: dict[str, Any] = {"ha": "center", "transform": panels[0].transAxes, "fontsize": TEXT, "color": GREY}
        panels[0].text(0.5, 0.5, "no required distance: one agent, no obstacle", **note)
        return
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, frameon=False, fontsize=TEXT)


def draw_timeline(figure: Figure, mission: Mission, kernel: Kernel, trace: Trace, width: str) -> None:
    """Draw, for each requirement, a lane for each agent that it depends on, filled at its decisive steps."""
    roots = [goal.formula for goal in kernel.requirements]
    rows = table(roots, roots, mission, trace, kernel.opposites)
    witnesses = Witnesses([*roots, *(goal.formula for goal in kernel.preferences)], mission, trace, kernel.opposites)
    lanes: list[tuple[str, list[tuple[str, Any, Array]]]] = []
    for goal in kernel.requirements:
        row = rows[goal.formula]
        seen = witnesses.of(goal.formula, row.unfolds)
        holds = np.zeros(trace.position.shape[:2], dtype=np.bool_) if seen is None else seen.holds & row.possibly
        own = [
            (agent.name, style(agent.index), holds[agent.index]) for agent in mission.agents if holds[agent.index].any()
        ]
        if len(own) > MOST_NAMED:
            who = f"{len(own)} agents"
            own = [(who, (GREY, "", "-"), np.any([lane for _, _, lane in own], axis=0))]
        lanes.append((goal.name, own))
    count = sum(max(1, len(own)) for _, own in lanes) + len(lanes)
    axes = _panels(figure, mission, 1, 0.13 * count + 0.2, width)[0]
    step, names, at = float(mission.step), list[tuple[float, str]](), 0.0
    for name, own in lanes:
        axes.text(0.0, at, name, fontsize=TEXT + 0.5, fontweight="bold", va="center")
        for number, (who, (colour, _, _), lane) in enumerate(own):
            y = at + 1 + number
            bars = [(begin * step - step / 2, (end - begin) * step) for begin, end in _runs(lane)]
            hatch = HATCHES[(number // len(COLOURS)) % len(HATCHES)]
            axes.broken_barh(
                bars, (y - 0.38, 0.76), facecolor=colour, edgecolor="white", lw=0.3, hatch=hatch, gid="lane"
            )
            names.append((y, who))
        at += 1 + max(1, len(own))
    axes.set_yticks([y for y, _ in names], [name for _, name in names])
    axes.set_ylim(at - 0.4, -0.7)
    axes.grid(axis="y", visible=False)


def _panels(figure: Figure, mission: Mission, count: int, tall: float, width: str) -> list[Axes]:
    """Axes of panels above each other with a common time axis.

    Args:
        tall: height of each panel, inches.
    """
    figure.set_size_inches(WIDTHS[width or "double"] / INCH, count * (tall + 0.25) + 0.6)
    figure.set_layout_engine("constrained", w_pad=0.04, h_pad=0.03)
    panels: list[Axes] = list(figure.subplots(count, 1, sharex=True, squeeze=False)[:, 0])
    for axes in panels:
        axes.tick_params(length=2.5, labelsize=TEXT)
        axes.spines[["top", "right"]].set_visible(False)
        axes.grid(color="#ECECEC", lw=0.6)
        axes.set_axisbelow(True)
    panels[-1].set_xlabel("time (s)", fontsize=TEXT)
    half = float(mission.step) / 2
    panels[-1].set_xlim(-half, float(mission.step * mission.steps) + half)
    return panels


def _finite(robustness: Array) -> Array:
    """Minimum robustness over agents at each step, (steps + 1,); NaN if no motion can change it."""
    least: Array = robustness.min(axis=0)
    return np.where(np.isfinite(least), least, np.nan)


def _runs(lane: Array) -> list[tuple[int, int]]:
    """First step and end (exclusive) of each run of true steps.

    Args:
        lane: (steps + 1,), boolean.
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[0], lane.astype(np.int8), [0]])))
    return [(int(begin), int(end)) for begin, end in edges.reshape(-1, 2)]


def refuse_moments(request: FigureRequest, mission: Mission) -> Diagnostic | None:
    """Diagnostic of a snapshot after the mission's end; None if all are within it."""
    last = float(mission.step * mission.steps)
    late = [moment for moment in request.at if moment > last + 1e-9]
    if not late:
        return None
    message = f"a snapshot at {late[0]:g} s is after the end of the mission at {last:g} s"
    return Diagnostic(NO_SUCH_MOMENT, message, None, help=f"use a time from 0 to {last:g} with `--at`")


def figure(
    request: FigureRequest,
    mission: Mission,
    kernel: Kernel,
    trace: Trace,
    backend: str,
    suffix: str,
    roadmaps: tuple[RoadmapGraph, ...] = (),
) -> bytes | Diagnostic:
    """Requested picture of a plan as bytes, the same each time, or a diagnostic.

    Args:
        backend: backend of the plan, for the title of a map.
        suffix: ``svg``, ``png`` or ``pdf``.
        roadmaps: roadmaps drawn below the paths of a map.
    """
    wrong = missing() or refuse_moments(request, mission)
    if wrong:
        return wrong
    from missionc.output.plot import plot_strip

    width = request.width
    match request.kind:
        case kind if kind == ROBUSTNESS:
            return rendered(lambda each: draw_robustness(each, mission, kernel, trace, width), suffix, True)
        case kind if kind == DISTANCES:
            return rendered(lambda each: draw_distances(each, mission, trace, width), suffix, True)
        case kind if kind == TIMELINE:
            return rendered(lambda each: draw_timeline(each, mission, kernel, trace, width), suffix, True)
        case _ if request.at or width:
            return rendered(lambda each: plot_strip.draw_strip(each, mission, trace, request, roadmaps), suffix, True)
        case _:
            return plot(mission, trace, backend, suffix, roadmaps=roadmaps)

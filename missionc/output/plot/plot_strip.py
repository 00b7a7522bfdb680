"""Maps side by side: the complete motion at a column's width, or snapshots with links and formations."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from missionc.backends.roadmap_graph import RoadmapGraph
from missionc.base.trace import Array, Trace
from missionc.geometry.curves.piecewise_polynomials import motion, values
from missionc.ir import Mission
from missionc.ir.language.margins.links import all_links
from missionc.output.plot.figure_request import WIDTHS, FigureRequest
from missionc.output.plot.plot import INK, MOST_NAMED, PAD, draw_agents, draw_view, legend_entries, style
from missionc.output.plot.plot_roadmap import draw_roadmap
from missionc.output.plot.silhouette import View

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LINK, SHAPE = "#9AA3AD", "#6A3D9A"
INCH = 2.54
"""Centimetres per inch."""
LEAST = 1.55
"""Minimum width of a map in inches, so that its names are readable."""
PER_SECOND = 20
"""Number of points per second on a drawn trail."""
TEXT = 7.0
"""Font size of the text around the maps, points."""


def draw_strip(
    figure: Figure, mission: Mission, trace: Trace, request: FigureRequest, roadmaps: tuple[RoadmapGraph, ...]
) -> None:
    """Draw a map for each requested time, or one of the complete motion.

    A volume is drawn from above and from the side.
    """
    from matplotlib.lines import Line2D

    moments: tuple[float | None, ...] = request.at or (None,)
    views = [View(0, 1)] if mission.dimension == 2 else [View(0, 1), View(0, 2)]
    wide = WIDTHS[request.width or "double"] / INCH
    low, high = mission.world.low, mission.world.high
    # A flat world gets more of the width, so that there is height for the names in it.
    flat = max(1.0, math.sqrt((high[0] - low[0]) / (high[1] - low[1])))
    columns = min(len(moments), max(1, int(wide / (LEAST * flat))))
    rows = math.ceil(len(moments) / columns)
    pad = PAD * max(top - bottom for bottom, top in zip(low, high, strict=True))
    across = high[0] - low[0] + 2 * pad
    heights = [high[view.up] - low[view.up] + 2 * pad for view in views]
    map_wide = wide / columns - 0.35
    handles = [*legend_entries(mission, roadmaps)]
    if request.at:
        handles = [each for each in handles if each.get_label() not in ("finish", f"position every {mission.step:g} s")]
    if request.at and mission.graphs:
        handles.append(Line2D([], [], color=LINK, lw=0.8, label="link"))
    if request.at and mission.formations:
        handles.append(Line2D([], [], color=SHAPE, lw=1.3, ls=(0, (2, 1)), label="formation"))
    per_line = max(1, int(wide / 1.25))
    legend = 0.17 * math.ceil(len(handles) / per_line) + 0.1
    tall = rows * sum(map_wide * height / across + 0.55 for height in heights) + legend
    figure.set_size_inches(wide, tall)
    figure.set_layout_engine("constrained", w_pad=0.03, h_pad=0.03)
    grid = figure.subplots(rows * len(views), columns, squeeze=False, gridspec_kw={"height_ratios": heights * rows})
    for number in range(rows * columns):
        row, column = divmod(number, columns)
        for which, view in enumerate(views):
            axes = grid[row * len(views) + which][column]
            if number >= len(moments):
                axes.set_axis_off()
                continue
            axes.set_xlim(low[0] - pad, high[0] + pad)
            axes.set_ylim(low[view.up] - pad, high[view.up] + pad)
            axes.set_aspect("equal")
            moment = moments[number]
            draw_view(axes, mission, trace, view, moment)
            axes.tick_params(labelsize=TEXT)
            axes.xaxis.label.set_size(TEXT)
            axes.yaxis.label.set_size(TEXT)
            if column:
                axes.set_ylabel("")
            for index, roadmap in enumerate(roadmaps):
                draw_roadmap(axes, roadmap, index, view)
            if moment is None:
                draw_agents(axes, mission, trace, view)
            else:
                _snapshot(axes, mission, trace, view, moment)
                if which == 0:
                    axes.set_title(f"{moment:g} s", loc="left", fontsize=TEXT + 1, pad=3)
    figure.legend(handles=handles, loc="outside lower center", ncols=per_line, frameon=False, fontsize=TEXT)


def positions(mission: Mission, trace: Trace, times: Array) -> Array:
    """Positions of all agents at times within the plan (seconds): (agents, times, dim), metres."""
    curves = motion(mission, trace)
    begins = np.concatenate([[0.0], np.cumsum(curves.durations)])
    piece = np.clip(np.searchsorted(begins, times, side="right") - 1, 0, len(curves.durations) - 1)
    local = np.broadcast_to(times - begins[piece], (len(mission.agents), len(times)))
    return values(curves.coefficients[:, piece], local)


def _snapshot(axes: Axes, mission: Mission, trace: Trace, view: View, moment: float) -> None:
    """Draw the bodies and markers of all agents at a time, their paths until then, and their links and formations.

    Args:
        moment: seconds.
    """
    from matplotlib.patches import Circle

    planes = (view.across, view.up)
    times = np.linspace(0.0, moment, max(2, round(PER_SECOND * moment)))
    way = positions(mission, trace, times)
    now = way[:, -1:]
    for graph in mission.graphs:
        linked = all_links(graph, now)[0] > 0
        for one, other in np.argwhere(linked | linked.T):
            if one < other:
                _join(axes, now[[graph.agents[one], graph.agents[other]], 0][:, planes], "link", LINK, 0.8, "-")
    for formation in mission.formations:
        # If all agents keep a distance to all others, bold lines would hide them.
        width = 1.3 if len(formation.edges) <= 2 * len(formation.agents) else 0.35
        for edge in formation.edges:
            ends = now[[edge.first, edge.second], 0][:, planes]
            _join(axes, ends, "formation", SHAPE, width, (0, (2, 1)))
    crowd = len(mission.agents) > MOST_NAMED
    for agent in mission.agents:
        colour, mark, dash = style(agent.index)
        trail = way[agent.index][:, planes]
        axes.plot(*trail.T, color=colour, ls="-" if crowd else dash, lw=0.6 if crowd else 0.9, alpha=0.8, zorder=4)
        x, y = trail[-1]
        axes.add_patch(Circle((x, y), agent.radius, fc=colour, ec="none", alpha=0.25, zorder=3.9))
        axes.plot(*trail[0], ls="", marker=mark, ms=3.5, mfc="white", mec=colour, mew=0.7, zorder=5, clip_on=False)
        axes.plot(
            *trail[-1], ls="", marker=mark, ms=3 if crowd else 5, mfc=colour, mec=INK, mew=0.4, zorder=6, clip_on=False
        )


def _join(axes: Axes, ends: Array, name: str, colour: str, width: float, dash: Any) -> None:
    """Draw a line between two agents.

    Args:
        ends: positions of both agents, (2, 2), metres, across and up.
        name: identifier of the line in the file.
    """
    axes.plot(*ends.T, color=colour, lw=width, ls=dash, zorder=3, gid=name)

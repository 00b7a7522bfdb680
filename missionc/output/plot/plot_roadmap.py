"""Roadmaps drawn on the map: nodes and edges, with an arrowhead on one-way edges.

Source:
    [strel] Fig. 2.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from missionc.backends.roadmap_graph import RoadmapEdge, RoadmapGraph
from missionc.base.trace import Array
from missionc.output.plot.silhouette import View

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D

INK = ("#7A7F87", "#A07A4E", "#5E8C73", "#8E6C93")
"""Colours of roadmaps, one for each kind of agent; they repeat after the last."""
HEAD = "#333333"
"""Colour of an arrowhead, which is drawn above the paths."""
ARROWS = 400
"""Maximum number of one-way edges that are drawn with arrowheads, which would otherwise hide the map."""


def draw_roadmap(axes: Axes, roadmap: RoadmapGraph, number: int, view: View) -> None:
    """Draw the nodes and edges of a roadmap below the paths of agents, in the colour of its number."""
    from matplotlib.collections import LineCollection

    colour, planes = INK[number % len(INK)], (view.across, view.up)
    pairs = {(edge.source, edge.target) for edge in roadmap.edges}
    one_way = [edge for edge in roadmap.edges if (edge.target, edge.source) not in pairs]
    lines = [edge.path[:, planes] for edge in roadmap.edges]
    axes.add_collection(LineCollection(lines, colors=colour, linewidths=0.55, alpha=0.4, zorder=2.4))
    for edge in one_way if len(one_way) <= ARROWS else ():
        before, after = (
            (float(at[view.across]), float(at[view.up])) for at in (_along(edge, 0.52), _along(edge, 0.58))
        )
        arrow: dict[str, Any] = {"arrowstyle": "-|>", "fc": HEAD, "ec": "white", "lw": 0.4, "mutation_scale": 9}
        axes.annotate("", after, before, arrowprops=arrow, zorder=4.6)
    places = roadmap.position[:, planes]
    axes.plot(*places.T, ls="", marker="o", ms=2.6, mfc="white", mec=colour, mew=0.7, zorder=2.6, clip_on=False)


def roadmap_entry(roadmap: RoadmapGraph, number: int) -> Line2D:
    """Legend entry of a roadmap, in the colour of its number."""
    from matplotlib.lines import Line2D

    colour = INK[number % len(INK)]
    label = f"roadmap: {len(roadmap.names)} nodes"
    return Line2D([], [], color=colour, lw=0.7, marker="o", ms=3, mfc="white", mec=colour, mew=0.7, label=label)


def _along(edge: RoadmapEdge, share: float) -> Array:
    """Point (dim,) at a fraction ``share`` of a roadmap edge, metres."""
    at = share * (len(edge.path) - 1)
    first = min(int(at), len(edge.path) - 2)
    place: Array = edge.path[first] + (at - first) * (edge.path[first + 1] - edge.path[first])
    return place

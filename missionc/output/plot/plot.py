"""The map of a plan: world, regions, obstacles and the path of every agent, with a side view for a volume.

    says MC404

Matplotlib comes with the extra ``viz``, and is loaded only here, when a map is requested. Agents differ in colour, and
also in marks and dashes, for readers who see no colours. Labels of regions are placed inside their shape, next to the
paths that cross it. Paths along the same segment are offset sideways, as lines on a transit map.
"""

from __future__ import annotations

import io
from collections.abc import Callable
from importlib.util import find_spec
from itertools import pairwise
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from missionc.backends.api import Attempt, Violation
from missionc.backends.roadmap_graph import RoadmapGraph
from missionc.base.diagnostics.code import EXTRA_MISSING
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.late_dataclass import Record
from missionc.base.palette import LIGHT, MARKS
from missionc.base.trace import Array, Judgement, Trace
from missionc.geometry.curves.piecewise_polynomials import motion, values
from missionc.geometry.displacement import displaced
from missionc.ir import Agent, Mission, Obstacle, Path, Shape, World
from missionc.output.plot.plot_roadmap import draw_roadmap, roadmap_entry
from missionc.output.plot.silhouette import View, draw_shape, silhouette_point
from missionc.output.region_roles import region_roles
from missionc.verification.plan.obstacle_bodies import solid

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch


LETTER = 0.62
"""Width of a letter, as a multiple of the font size."""

LINE = 1.5
"""Height of a line, as a multiple of the font size."""

SHIFTS = (0.0, -1.0, 1.0, -2.0, 2.0, -3.0, 3.0, -4.0, 4.0)
"""Vertical offsets of a name from the middle of its shape, in lines, in the order in which they are tried."""

PIECES = 24
"""Number of pieces into which each segment of a path is split."""


def name_place(world: World, view: View, shape: Shape, name: str, letter: float, paths: Array) -> tuple[float, float]:
    """Centre of a shape's name: the middle of the shape, or the nearest line above or below that no path crosses.

    Args:
        letter: font size, metres.
        paths: (agents, points, 2), metres, across and up.
    """
    middle = silhouette_point(world, view, shape)
    if world.dimension > 2:
        return middle
    wide, high = LETTER * letter * len(name), LINE * letter
    share = np.linspace(0.0, 1.0, PIECES)[:, None, None, None]
    points = (paths[None, :, :-1] * (1 - share) + paths[None, :, 1:] * share).reshape(-1, 2)
    for shift in SHIFTS:
        place = np.array([middle[0], middle[1] + shift * high])
        crossed = (np.abs(points - place) < np.array([wide, high]) / 2).all(axis=1).any()
        if not crossed and float(solid(shape, 2)(place[None])[0]) <= -high / 2:
            return float(place[0]), float(place[1])
    return middle


Segment: TypeAlias = tuple[tuple[float, ...], ...]

SAME = 6
"""Number of decimals in metres to which two points must agree to count as equal."""


class _Use(Record, eq=False):
    """Path segment with the agents that use it, in the direction of its first user, so that sides do not change along a
    path.
    """

    along: Array
    agents: list[int]


def lane_lines(paths: Array, gap: float) -> Array:
    """Sideways shift of each vertex of each path, so that paths along the same segment are drawn side by side.

    Args:
        paths: (agents, steps + 1, 2), metres.
        gap: distance between two lines, metres.

    Returns:
        (agents, steps + 1, 2), metres; zero if no other agent takes the same path.
    """
    uses: dict[Segment, _Use] = {}
    for agent, path in enumerate(paths):
        for start, end in pairwise(path):
            use = uses.setdefault(_segment(start, end), _Use(end - start, []))
            if agent not in use.agents:
                use.agents.append(agent)
    shifts = np.zeros_like(paths)
    for agent, path in enumerate(paths):
        sides = [_side(uses[_segment(start, end)], agent, gap) for start, end in pairwise(path)]
        for vertex in range(len(path)):
            moving = [side for side in _around(sides, vertex) if side is not None]
            if moving:
                shifts[agent, vertex] = np.mean(moving, axis=0)
    return shifts


def _segment(start: Array, end: Array) -> Segment:
    """Key of the segment between two points, (2,), independent of its direction."""
    return tuple(sorted(tuple(point.tolist()) for point in (np.round(start, SAME) + 0.0, np.round(end, SAME) + 0.0)))


def _side(use: _Use, agent: int, gap: float) -> Array | None:
    """Sideways shift of an agent along one segment, (2,), metres; None if the agent waits."""
    length = float(np.linalg.norm(use.along))
    if length < 10.0**-SAME:
        return None
    across = np.array([-use.along[1], use.along[0]]) / length
    return np.asarray(across * gap * (use.agents.index(agent) - (len(use.agents) - 1) / 2))


def _around(sides: list[Array | None], vertex: int) -> list[Array | None]:
    """Shifts of the segments before and after a vertex, (2,) each; waits are skipped."""
    before = next((side for side in reversed(sides[:vertex]) if side is not None), None)
    after = next((side for side in sides[vertex:] if side is not None), None)
    return [before, after]


COLOURS = LIGHT["agents"]
MARKERS = {
    "disc": "o",
    "square": "s",
    "triangle": "^",
    "diamond": "D",
    "plus": "P",
    "cross": "X",
    "hexagon": "h",
    "wedge": "v",
}
"""Matplotlib names of the palette's markers."""
DASHES: tuple[Any, ...] = ("-", (0, (5, 1.4)), (0, (1.2, 1.0)), (0, (6, 1.4, 1.2, 1.4)))
OBSTACLE, INK, GREY, BROKEN = LIGHT["obstacle"], LIGHT["ink"], "#8A8A8A", "#B00020"
METADATA: dict[str, dict[str, str | None]] = {
    "svg": {"Date": None, "Creator": "missionc"},
    "png": {"Software": "missionc"},
    "pdf": {"CreationDate": None, "Creator": "missionc", "Producer": None},
}
MOST_NAMED = 16
"""Maximum number of agents with their own entry in the legend."""
MOST_DOTS = 101
"""Maximum number of states of an agent that are drawn as dots; more would hide the path."""
CROWDED = 20
"""Size of a family of obstacles from which labels show only the indices."""
NAME = 8.5
"""Font size of a region's name, points."""
LANE = 2.6
"""Distance between two paths drawn along the same segment, points."""
PAD = 0.02
"""Padding around the world, as a ratio of its longest side."""
MARGIN = 0.6
"""Margin left of the map, inches."""
LONG_SIDE = 6.4
"""Length of the map's longer side, inches."""


def missing() -> Diagnostic | None:
    """Diagnostic if matplotlib, which maps need, is not installed; None if it is."""
    if find_spec("matplotlib"):
        return None
    message = "a map needs matplotlib, which is not installed"
    return Diagnostic(EXTRA_MISSING, message, None, help="install it with `pip install 'missionc[viz]'`")


def plot(
    mission: Mission,
    trace: Trace,
    backend: str,
    kind: str,
    miss: Attempt | None = None,
    roadmaps: tuple[RoadmapGraph, ...] = (),
) -> bytes | Diagnostic:
    """Map of a trace as the bytes of a picture, the same each time, or a diagnostic.

    Args:
        backend: backend of the plan, for the title; may be empty.
        kind: ``svg`` or ``png``.
        miss: evaluation of a trajectory that is not a plan, shown in the title and with a ring at the first failure.
        roadmaps: roadmaps drawn below the paths.
    """
    absent = missing()
    if absent:
        return absent
    return rendered(lambda figure: _draw(figure, mission, trace, backend, miss, roadmaps), kind)


def rendered(draw: Callable[[Figure], None], kind: str, exact: bool = False) -> bytes:
    """Bytes of a picture, ``svg``, ``png`` or ``pdf``, the same each time; requires matplotlib.

    Text stays text, so that it can be searched and edited.

    Args:
        draw: function that draws on a figure.
        exact: if true, the picture keeps its size; otherwise it is cropped to its contents.
    """
    import matplotlib
    from matplotlib.figure import Figure

    settings: Any = {
        "svg.hashsalt": "missionc",
        "svg.fonttype": "none",
        "pdf.fonttype": 42,
        "font.family": ["DejaVu Sans", "sans-serif"],
        "font.size": 8.5,
        "axes.edgecolor": GREY,
        "axes.linewidth": 0.8,
        "axes.labelcolor": INK,
        "text.color": INK,
        "xtick.color": GREY,
        "ytick.color": GREY,
        "xtick.labelcolor": INK,
        "ytick.labelcolor": INK,
    }
    with matplotlib.rc_context():
        # The user's own style is for the user's own figures.
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(settings)
        figure = Figure(dpi=160)
        draw(figure)
        buffer = io.BytesIO()
        # Neither a date nor a version: the same plan gives the same bytes.
        tight: dict[str, Any] = {} if exact else {"bbox_inches": "tight", "pad_inches": 0.12}
        figure.savefig(buffer, format=kind, metadata=METADATA[kind], **tight)
    return buffer.getvalue()


def _draw(
    figure: Figure,
    mission: Mission,
    trace: Trace,
    backend: str,
    miss: Attempt | None,
    roadmaps: tuple[RoadmapGraph, ...],
) -> None:
    panels = _panels(figure, mission)
    for axes, view in panels:
        draw_view(axes, mission, trace, view)
        for number, roadmap in enumerate(roadmaps):
            draw_roadmap(axes, roadmap, number, view)
        draw_agents(axes, mission, trace, view)
        for wrong in miss.shown if miss else ():
            _ring(axes, mission, trace, view, wrong)
    top = panels[0][0]
    if len(panels) > 1:
        for (axes, _), name in zip(panels, ("top view", "side view"), strict=True):
            axes.set_title(name, loc="right", fontsize=8, color=GREY, pad=4)
    count = len(mission.agents)
    about = [
        f"{count} agent" + ("s" if count > 1 else ""),
        f"horizon {mission.step * mission.steps:g} s, time step {mission.step:g} s",
        *([f"backend {backend}"] if backend and miss is None else []),
    ]
    top.set_title(mission.name, loc="left", fontsize=12, fontweight="bold", pad=20)
    top.annotate(
        ", ".join(about), (0, 1), (0, 6), xycoords="axes fraction", textcoords="offset points", fontsize=8.5, color=GREY
    )
    if miss is not None:
        says: dict[str, Any] = {"xycoords": "axes fraction", "textcoords": "offset points", "fontsize": 8.5}
        top.annotate(f"no plan: {miss.violation(mission.step)}", (1, 1), (0, 6), ha="right", color=BROKEN, **says)
    _legend(top, mission, roadmaps)


def _ring(axes: Axes, mission: Mission, trace: Trace, view: View, wrong: Judgement | Violation) -> None:
    """Draw a ring around each agent that causes a failure, at the time of the failure."""
    for agent in mission.agents:
        if agent.name in wrong.agents and wrong.step is not None:
            x, y = trace.position[agent.index, wrong.step, (view.across, view.up)]
            axes.plot([x], [y], marker="o", ms=17, mfc="none", mec=BROKEN, mew=1.8, ls="", zorder=10, clip_on=False)


def _panels(figure: Figure, mission: Mission) -> list[tuple[Axes, View]]:
    """Axes of a map: one panel, or for a volume two at one scale, from above and from the side, aligned on the left."""
    low, high = mission.world.low, mission.world.high
    size = [top - bottom for bottom, top in zip(low, high, strict=True)]
    views = [View(0, 1)] if mission.dimension == 2 else [View(0, 1), View(0, 2)]
    pad = PAD * max(size)
    width, heights = size[0] + 2 * pad, [size[view.up] + 2 * pad for view in views]
    scale = LONG_SIDE / max(width, sum(heights))
    gap, title = 0.75, 0.6
    whole, inches = sum(heights) * scale + gap * len(views) + title, width * scale + MARGIN
    figure.set_size_inches(inches, whole)
    panels = []
    bottom = whole - title
    for view, height in zip(views, heights, strict=True):
        bottom -= height * scale
        place = (
            0.6 / (width * scale + 0.8),
            bottom / whole,
            width * scale / (width * scale + 0.8),
            height * scale / whole,
        )
        axes = figure.add_axes(place)
        axes.set_xlim(low[0] - pad, high[0] + pad)
        axes.set_ylim(low[view.up] - pad, high[view.up] + pad)
        panels.append((axes, view))
        bottom -= gap
    return panels


def draw_view(axes: Axes, mission: Mission, trace: Trace, view: View, moment: float | None = None) -> None:
    """Draw the world, regions and obstacles, seen from above or from the side.

    Args:
        moment: time in seconds at which obstacles are drawn; None for their initial position and track.
    """
    low, high = mission.world.low, mission.world.high
    across, up = (low[view.across], high[view.across]), (low[view.up], high[view.up])
    axes.set_facecolor("#F1F1EF")
    axes.set_xlabel("xyz"[view.across] + " (m)")
    axes.set_ylabel("xyz"[view.up] + " (m)")
    axes.tick_params(length=2.5, labelsize=8)
    for side in axes.spines.values():
        side.set_visible(False)
    from matplotlib.patches import Rectangle

    floor = Rectangle((across[0], up[0]), across[1] - across[0], up[1] - up[0], fc="white", ec=GREY, lw=1.0, zorder=0)
    axes.add_patch(floor)
    axes.grid(color="#ECECEC", linewidth=0.6, zorder=0.1)
    axes.set_axisbelow(True)
    roles = region_roles(mission)
    for region in mission.regions:
        fill, edge = LIGHT["region"][roles[region.name]], LIGHT["outline"][roles[region.name]]
        avoided: dict[str, Any] = {"hatch": "///", "ls": (0, (4, 2))} if roles[region.name] == "avoid" else {}
        look = {"fc": fill, "ec": edge, "lw": 0.9, "zorder": 1, **avoided, **_see_through(view)}
        draw_shape(axes, mission.world, view, region.shape, **look)
        if view.up == 1:
            size = NAME * _metres_per_point(axes)
            place = name_place(mission.world, view, region.shape, region.name, size, trace.position[..., :2])
            _name(axes, place, region.name, INK, NAME)
    for obstacle in mission.obstacles:
        _draw_obstacle(axes, mission, view, obstacle, moment, _crowded(mission, obstacle))
    for beacon in mission.beacons:
        place = (beacon.position[view.across], beacon.position[view.up])
        axes.plot(*place, marker="*", ms=10, mfc="white", mec=INK, mew=0.9, ls="", zorder=5)
        axes.annotate(beacon.name, place, (6, 4), textcoords="offset points", fontsize=8, zorder=9)


def _crowded(mission: Mission, obstacle: Obstacle) -> bool:
    """Return whether an obstacle belongs to a family so large that only its indices fit as a label."""
    place = obstacle.span.start if obstacle.span.turns else -1
    return sum(bool(each.span.turns) and each.span.start == place for each in mission.obstacles) > CROWDED


def _draw_obstacle(
    axes: Axes, mission: Mission, view: View, obstacle: Obstacle, moment: float | None, crowded: bool
) -> None:
    world, since = mission.world, moment or 0.0
    away = np.array(displaced(obstacle, since, mission.dimension))
    body: dict[str, Any] = {"fc": OBSTACLE, "ec": OBSTACLE, "lw": 0.8, "zorder": 2, **_see_through(view)}
    draw_shape(axes, world, view, obstacle.shape, away, obstacle.grown(since), **body)
    if view.up == 1:
        across, up = silhouette_point(world, view, obstacle.shape)
        words, size = (obstacle.name.partition("[")[2].rstrip("]"), 4.5) if crowded else (obstacle.name, 7.5)
        _name(axes, (across + float(away[0]), up + float(away[1])), words, "white", size)
    if obstacle.constant or moment is not None:
        return
    last = mission.step * mission.steps
    for share in (0.25, 0.5, 0.75, 1.0):
        shift = np.array(displaced(obstacle, share * last, mission.dimension))
        style = {"fc": OBSTACLE, "ec": OBSTACLE, "lw": 0.8, "ls": (0, (3, 2)), "alpha": 0.16, "zorder": 1.5}
        draw_shape(axes, world, view, obstacle.shape, shift, obstacle.grown(share * last), **style)
    if isinstance(obstacle.motion, Path):
        _draw_track(axes, mission, view, obstacle, obstacle.motion)


def _draw_track(axes: Axes, mission: Mission, view: View, obstacle: Obstacle, path: Path) -> None:
    """Draw the track of a moving obstacle with an arrow halfway."""
    last = mission.step * mission.steps
    start = silhouette_point(mission.world, view, obstacle.shape)
    times = sorted({0.0, last, *(time for time in path.times if 0 < time < last)})
    track = np.array([displaced(obstacle, time, mission.dimension) for time in times])
    axes.plot(
        start[0] + track[:, view.across],
        start[1] + track[:, view.up],
        color=OBSTACLE,
        lw=0.9,
        ls=(0, (3, 2)),
        zorder=2.1,
    )
    middle, after = (displaced(obstacle, share * last, mission.dimension) for share in (0.48, 0.52))
    heads = [(start[0] + shift[view.across], start[1] + shift[view.up]) for shift in (after, middle)]
    arrow = {"arrowstyle": "-|>", "color": OBSTACLE, "lw": 0.9, "mutation_scale": 9}
    axes.annotate("", heads[0], heads[1], arrowprops=arrow, zorder=2.2)


def _see_through(view: View) -> dict[str, Any]:
    """Drawing style for shapes that overlap in the side view."""
    return {} if view.up == 1 else {"alpha": 0.3}


def draw_agents(axes: Axes, mission: Mission, trace: Trace, view: View) -> None:
    crowd = len(mission.agents) > MOST_NAMED
    tracks = _tracks(mission, trace)[..., (view.across, view.up)]
    steps = trace.position[..., (view.across, view.up)]
    if not crowd and tracks.shape == steps.shape:
        tracks = tracks + lane_lines(steps, LANE * _metres_per_point(axes))
    if not crowd and steps.shape[1] <= MOST_DOTS:
        dots = np.unique(np.round(steps.reshape(-1, 2), 6), axis=0)
        axes.plot(*dots.T, ls="", marker="o", ms=3.2, mfc=INK, mec="white", mew=0.5, zorder=5, clip_on=False)
    for agent in mission.agents:
        colour, _, dash = style(agent.index)
        line: dict[str, Any] = {"ls": "-", "lw": 0.9, "alpha": 0.75} if crowd else {"ls": dash, "lw": 1.6}
        joined: dict[str, Any] = {"solid_joinstyle": "round", "clip_on": False}
        axes.plot(*tracks[agent.index].T, color=colour, zorder=4, **joined, **line)
        _draw_ends(axes, agent, steps[agent.index], 0.6 if crowd else 1.0)


def _draw_ends(axes: Axes, agent: Agent, steps: Array, size: float) -> None:
    """Draw an agent's body at both ends of its path: a ring of its marker at the start, a filled marker at the finish.

    Args:
        steps: positions across and up, (steps + 1, 2), metres.
    """
    from matplotlib.patches import Circle

    colour, mark, _ = style(agent.index)
    for place in (steps[0], steps[-1]):
        body = Circle((place[0], place[1]), agent.radius, fc=colour, ec="none", alpha=0.22, zorder=3.9, clip_on=False)
        axes.add_patch(body)
    ends: dict[str, Any] = {"marker": mark, "ls": "", "mec": colour, "clip_on": False}
    axes.plot(*steps[0], ms=9.5 * size, mfc="white", mew=1.6 * size, zorder=6, **ends)
    axes.plot(*steps[-1], ms=6 * size, mfc=colour, mew=0.5, zorder=7, **ends)


def _tracks(mission: Mission, trace: Trace) -> Array:
    """Positions along the trajectories, including points between the steps, (agents, points, dim), metres."""
    curves = motion(mission, trace)
    agents, _, dim, size = curves.coefficients.shape
    if size == 2:
        return trace.position
    share = np.linspace(0, 1, 9)[:-1]
    points = values(
        curves.coefficients[:, :, None],
        np.broadcast_to(curves.durations[:, None] * share, (agents, curves.durations.size, 8)),
    )
    return np.concatenate([points.reshape(agents, -1, dim), trace.position[:, -1:]], axis=1)


def _metres_per_point(axes: Axes) -> float:
    return float((axes.get_xlim()[1] - axes.get_xlim()[0]) / (axes.bbox.width / axes.figure.dpi * 72))


def style(index: int) -> tuple[str, str, Any]:
    # A second round of colours comes with other markers and dashes.
    turn, own = divmod(index, len(COLOURS))
    return COLOURS[own], MARKERS[MARKS[(index + 3 * turn) % len(MARKS)]], DASHES[turn % len(DASHES)]


def _name(axes: Axes, place: tuple[float, float], name: str, colour: str, size: float) -> None:
    # A stroke around it would turn text into outlines.
    ground = OBSTACLE if colour == "white" else "white"
    halo: dict[str, Any] = {"boxstyle": "round,pad=0.06", "fc": ground, "ec": "none", "alpha": 0.6}
    centred: dict[str, Any] = {"ha": "center", "va": "center", "annotation_clip": True}
    axes.annotate(name, place, fontsize=size, color=colour, bbox=halo, zorder=8, **centred)


def legend_entries(mission: Mission, roadmaps: tuple[RoadmapGraph, ...]) -> list[Line2D | Patch]:
    """Entries of a map's legend: agents, regions, obstacles and roadmaps."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Line2D | Patch] = []
    if len(mission.agents) <= MOST_NAMED:
        for agent in mission.agents:
            colour, mark, dash = style(agent.index)
            handles.append(Line2D([], [], color=colour, ls=dash, lw=1.5, marker=mark, ms=5.5, label=agent.name))
    else:
        teams = [team for team in mission.teams if team.agents]
        for team in teams:
            label = f"{team.name}: {len(team.agents)} agents"
            handles.append(Line2D([], [], color=GREY, lw=0.9, label=label))
    handles.append(Line2D([], [], ls="", marker="o", ms=8, mfc="white", mec=GREY, mew=1.5, label="start"))
    handles.append(Line2D([], [], ls="", marker="o", ms=5.5, mfc=GREY, mec=GREY, mew=0.5, label="finish"))
    if len(mission.agents) <= MOST_NAMED and mission.steps < MOST_DOTS:
        every = f"position every {mission.step:g} s"
        handles.append(Line2D([], [], ls="", marker="o", ms=3.2, mew=0, color=INK, label=every))
    if any(isinstance(obstacle.motion, Path) for obstacle in mission.obstacles):
        handles.append(Line2D([], [], color=OBSTACLE, lw=0.9, ls=(0, (3, 2)), label="moving obstacle"))
    handles += [roadmap_entry(roadmap, number) for number, roadmap in enumerate(roadmaps)]
    if any(obstacle.growth for obstacle in mission.obstacles):
        handles.append(Patch(fc=OBSTACLE, ec=OBSTACLE, alpha=0.3, ls=(0, (3, 2)), label="possible obstacle growth"))
    return handles


def _legend(axes: Axes, mission: Mission, roadmaps: tuple[RoadmapGraph, ...]) -> None:
    place: dict[str, Any] = {"loc": "upper left", "bbox_to_anchor": (1.01, 1.0), "borderaxespad": 0}
    axes.legend(
        handles=legend_entries(mission, roadmaps),
        frameon=False,
        fontsize=8.5,
        handlelength=2.4,
        labelspacing=0.45,
        **place,
    )

"""Relaxations of the world: graphs, formations, regions, room between bodies, and the number of agents."""

from __future__ import annotations

import math

from missionc import ir
from missionc.base.source import Span
from missionc.diagnostics.model import Fix
from missionc.ir import Mission
from missionc.pipeline.checked import Checked
from missionc.pipeline.relax.conflict_targets import ConflictTargets, Way
from missionc.pipeline.relax.edits import ROUND, Edit, declared, is_in_main_file, spot
from missionc.pipeline.relax.knobs import Knob, less, more, notch, whole
from missionc.resolve.resolve_quantities import excerpt, shown
from missionc.syntax import ast

MORE_AGENTS = 3
"""So many agents are added to a team at most."""

FINER = 1.7
"""So many times the nodes of the finest roadmap that was refused."""


def graphs(checked: Checked, targets: ConflictTargets) -> list[Knob]:
    """The radius of a graph, wider where links are asked for."""
    knobs = []
    for graph in declared(checked, ast.Graph):
        way = targets.graphs.get(graph.name.text)
        written = [(f"the radius of `{graph.name.text}`", graph.radius)] if graph.radius is not None else []
        written += [
            (
                f"the range of `{graph.name.text}` from `{excerpt(p.senders.span)}` to `{excerpt(p.receivers.span)}`",
                p.value,
            )
            for p in graph.ranges
        ]
        for name, quantity in written:
            radius = spot(checked, quantity)
            if radius is not None and way is not None:
                knobs.append(less(radius, name, notch(radius.value)) if way is Way.LESS else more(radius, name))
    return knobs


def formations(checked: Checked, targets: ConflictTargets) -> list[Knob]:
    """The tolerance of a formation."""
    knobs = []
    for formation in declared(checked, ast.Formation):
        for setting in formation.settings:
            tolerance = spot(checked, setting.high) if setting.name.text == "tolerance" else None
            if tolerance is not None and targets.formations.get(formation.name.text) is Way.MORE:
                knobs.append(more(tolerance, f"the tolerance of `{formation.name.text}`"))
    return knobs


def regions(checked: Checked, mission: Mission, targets: ConflictTargets) -> list[Knob]:
    """A region that is to be reached or kept, larger to all sides: a box within the world, a disc or a ball."""
    meant = {region.name: region.shape for region in mission.regions}
    knobs = []
    for region in declared(checked, ast.Region):
        name, shape = region.name.text, meant.get(region.name.text)
        if targets.regions.get(name) is not Way.MORE:
            continue
        match region.shape, shape:
            case ast.Box() as box, ir.Box() if is_in_main_file(checked, box.span):
                knobs.append(_wider_box(name, box, shape, mission))
            case (ast.Disc() | ast.Ball()) as round_, _:
                radius = spot(checked, round_.radius)
                knobs += [more(radius, f"the radius of `{name}`")] if radius is not None else []
            case _:
                pass
    return knobs


def _wider_box(name: str, box: ast.Box, shape: ir.Box, mission: Mission) -> Knob:
    """Two coordinates where the box has so many as written, also where a height is given apart."""
    side = min(high - low for low, high in zip(shape.low, shape.high, strict=True))
    by, axes = notch(side), range(len(box.low.coordinates))
    world = mission.world

    def edit(notches: int) -> Edit:
        low = [max(world.low[axis], shape.low[axis] - notches * by) for axis in axes]
        high = [min(world.high[axis], shape.high[axis] + notches * by) for axis in axes]
        fixes = Fix(box.low.span, _point(low)), Fix(box.high.span, _point(high))
        return Edit(f"`{name}` larger by {shown(round(notches * by, ROUND))} m to each side", fixes)

    most = math.floor(2 * side / by)
    return Knob(edit, by / side, max(1, most // 2), most)


def _point(values: list[float]) -> str:
    return f"({', '.join(shown(round(value, ROUND)) for value in values)})"


def margins(checked: Checked) -> list[Knob]:
    """The room between bodies, and between bodies and obstacles: less of it."""
    knobs = []
    room: list[ast.Separation | ast.Clearance] = [*declared(checked, ast.Separation), *declared(checked, ast.Clearance)]
    for item in room:
        name, distance = item.span.text.split(maxsplit=1)[0], spot(checked, item.distance)
        if distance is not None and distance.value > 0:
            knobs.append(less(distance, name))
    return knobs


def teams(checked: Checked) -> list[Knob]:
    """One agent more in a team, or two or three."""
    sizes = [(team.name.text, spot(checked, team.size)) for team in declared(checked, ast.Team)]
    return [whole(size, f"the size of team `{name}`", MORE_AGENTS) for name, size in sizes if size is not None]


def roadmap(checked: Checked, nodes: int) -> list[Knob]:
    """A roadmap finer than those that were refused, the finest of which had so many nodes."""
    if checked.mission is not None and checked.mission.solve.roadmap is not None:
        return []  # it is the mission's own
    finer = round(nodes * FINER)
    says = f"a finer roadmap, of {finer} nodes"
    solves = declared(checked, ast.Solve)
    settings = {setting.name.text: setting for setting in (solves[0].settings if solves else ())}
    if "nodes" in settings:
        node_count = spot(checked, settings["nodes"].high)
        edit = node_count.put(finer, says) if node_count is not None else None
    elif settings:
        setting = next(iter(settings.values())).span
        edit = _at(checked, Span(setting.source, setting.start, setting.start), f"nodes = {finer}, ", says)
    elif solves:
        edit = _at(checked, solves[0].span, f"solve with smt {{ nodes = {finer} }}", says)
    else:
        source = checked.sources[0]
        end = Span(source, len(source.text), len(source.text))
        line = "" if source.text.endswith("\n") else "\n"
        edit = Edit(says, (Fix(end, f"{line}solve with smt {{ nodes = {finer} }}\n"),))
    return [Knob(lambda notches: edit, 0.0)] if edit is not None else []


def _at(checked: Checked, span: Span, text: str, says: str) -> Edit | None:
    return Edit(says, (Fix(span, text),)) if is_in_main_file(checked, span) else None

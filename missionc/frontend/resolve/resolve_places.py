"""Resolution of positions and shapes alone, even in a text whose formulas cannot be read yet.

    in   the declarations that can be read
    out  Places, without unknown ones

It reports no findings: ``resolve`` does.
"""

from __future__ import annotations

from collections.abc import Sequence

from missionc import ir
from missionc.base.late_dataclass import Record
from missionc.base.limits import Limits
from missionc.base.source import Source, Span
from missionc.base.units import Dimension, Metres
from missionc.frontend.resolve.context import Context, collect
from missionc.frontend.resolve.resolve_agents import resolve_teams
from missionc.frontend.resolve.resolve_files import with_places
from missionc.frontend.resolve.resolve_quantities import resolve_parameters, resolved_number
from missionc.frontend.resolve.resolve_shapes import known, resolve_point, resolve_regions, resolve_world
from missionc.frontend.resolve.resolve_time import resolve_time
from missionc.frontend.resolve.spell_out import spell_out
from missionc.frontend.syntax import ast


class Places(Record, eq=False):
    """World, regions, obstacles, beacons and agents of a text, by name if they have one.

    ``context`` has the parameters. ``declarations`` has a separate entry for each member of a family, and for each
    feature of a file.
    """

    context: Context
    declarations: tuple[ast.Declaration, ...]
    world: ir.World
    regions: dict[str, ir.Region]
    obstacles: dict[str, ir.Obstacle]
    beacons: dict[str, ir.Beacon]
    agents: tuple[ir.Agent, ...]

    def metres(self, quantity: ast.Quantity) -> Metres:
        """Length in metres; NaN if it is unknown."""
        return Metres(resolved_number(self.context, quantity, Dimension.LENGTH, "the length"))


def resolve_places(source: Source, declarations: Sequence[ast.Declaration], limits: Limits) -> Places | None:
    """World, regions, obstacles, beacons and agents of a text; None if the world is unknown or empty."""
    written = ast.Program(Span(source, 0, len(source.text)), tuple(declarations))
    placed, _, _ = with_places(written, {}, limits)
    program = spell_out(placed, collect(placed, []), {}, limits, []) or placed
    context = Context(collect(program, []), limits, [])
    resolve_parameters(context, {})
    times = [item for item in program.declarations if isinstance(item, ast.Time)]
    worlds = [item for item in program.declarations if isinstance(item, ast.World)]
    if times:
        resolve_time(context, times[0])
    if not worlds:
        return None
    resolve_world(context, worlds[0])
    world = ir.World(context.low, context.high, worlds[0].span)
    if context.dimension == 0 or not known(context.low, context.high) or world.flat:
        return None
    resolve_regions(context)
    for beacon in context.declared(ast.Beacon):
        place = resolve_point(context, beacon.position)
        context.beacons[beacon.name.text] = ir.Beacon(beacon.name.text, place, beacon.name.span)
    resolve_teams(context)
    agents = tuple(context.agents)
    return Places(context, program.declarations, world, context.regions, context.obstacles, context.beacons, agents)

"""Background of a plan's picture in a notebook: regions by role, and obstacles at their initial positions.

in   Mission, its Kernel
out  Ground
"""

from __future__ import annotations

from missionc.base.notebook import Figure, Ground
from missionc.base.palette import LIGHT
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from missionc.output.region_roles import region_roles
from missionc.output.report.outlines import Solid, inner_point, solids


def notebook_ground(mission: Mission, kernel: Kernel) -> Ground:
    """Background of a plan's picture, seen from above, in the palette's light colours.

    Each shape has its name once, on its largest part.
    """
    world, roles = mission.world, region_roles(mission, kernel)
    figures: list[Figure] = []

    def draw(name: str, parts: list[Solid], fill: str, outline: str, ink: str) -> None:
        place = inner_point(world, parts)
        for number, part in enumerate(parts):
            curved = part.get("disc") or part.get("ball")
            disc = (curved[0], curved[1], curved[-1]) if curved else ()
            rings = tuple(part.get("rings", ()))
            figures.append(Figure("" if number else name, fill, outline, ink, place, rings, disc))

    for region in mission.regions:
        role = roles[region.name]
        draw(region.name, solids(world, region.shape), LIGHT["region"][role], LIGHT["outline"][role], LIGHT["ink"])
    for obstacle in mission.obstacles:
        parts = solids(world, obstacle.shape)
        draw(obstacle.name, parts, LIGHT["obstacle"], LIGHT["obstacle"], LIGHT["on_obstacle"])
    (left, low), (right, high) = world.low[:2], world.high[:2]
    return Ground((left, low), (right, high), tuple(figures))

"""Role of each region in its mission, which determines its colour in pictures.

in   Mission, its Kernel
out  a role of the palette for each region
"""

from __future__ import annotations

from missionc.ir import Mission
from missionc.ir.kernel.nodes import Atom, Kernel, Not
from missionc.ir.kernel.walk import children, postorder
from missionc.ir.lower.expand import expand


def region_roles(mission: Mission, kernel: Kernel | None = None) -> dict[str, str]:
    """Role of each region, by name: ``goal`` if a goal needs agents in it, ``avoid`` if goals only need them outside.

    A region in no goal is ``start`` if agents start in it, otherwise ``plain``.

    Args:
        kernel: kernel of the mission; computed here if omitted.
    """
    kernel = kernel or expand(mission)[0] or Kernel((), ())
    order = postorder(goal.formula for goal in kernel.requirements + kernel.preferences)
    denied = {name for node in order if isinstance(node, Not) for name in _named(node.body)}
    positive = (child for node in order if not isinstance(node, Not) for child in children(node))
    wanted = {name for node in (*positive, *(goal.formula for goal in kernel.requirements)) for name in _named(node)}
    starts = {agent.start.region.name for agent in mission.agents if agent.start.region is not None}

    def role(name: str) -> str:
        if name in wanted:
            return "goal"
        return "avoid" if name in denied else "start" if name in starts else "plain"

    return {region.name: role(region.name) for region in mission.regions}


def _named(node: object) -> tuple[str, ...]:
    return tuple(region.name for region in node.predicate.regions) if isinstance(node, Atom) else ()

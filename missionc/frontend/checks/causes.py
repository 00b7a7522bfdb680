"""Causes of unsatisfiability: the quantities that prove that a formula cannot hold, with a message for each.

Causes are a goal that is too far, two sides of an `until` further apart than one step, a stay that the minimum speed
does not allow, more agents than a set can contain, and a formation that fits nowhere. Each is proved on outer bounds of
the possible positions of centres.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import field
from functools import reduce
from itertools import combinations
from typing import TypeAlias

from missionc.base.diagnostics.code import BARRED, CROWDED, JUMP, NO_FIT, RESTLESS, TOO_FAR, Code
from missionc.base.diagnostics.model import Label
from missionc.base.late_dataclass import Record, dataclass
from missionc.base.source import Span
from missionc.frontend.checks.check_goals import WIDEN, Journey, begins, figures
from missionc.frontend.checks.free_space import FreeSpace
from missionc.frontend.checks.path_bounds import reach
from missionc.geometry.configuration_space import Area, common
from missionc.ir import Agent, Formation, Mission, Predicate
from missionc.ir.kernel.nodes import Node, UntilNode
from missionc.ir.language.walk_formulas import bits_of
from missionc.ir.wording import listed, metres, seconds, speed

ROUNDING = 1e-9

Areas: TypeAlias = frozenset[Area]


class Cause(Record, eq=False):
    """Reason why a formula cannot hold for some agents: headline, quantity at its source text, other labels, remedy.

    ``bits`` is the bit set of the agents.
    """

    code: Code
    bits: int
    headline: str
    span: Span | None
    figure: str
    labels: tuple[Label, ...]
    help: str


@dataclass(slots=True, eq=False)
class Causes:
    """Search for reasons why formulas of a mission cannot hold.

    Args:
        suspecting: report each possible cause that sample positions do not rule out, without geometry and without text.
    """

    ground: FreeSpace
    suspecting: bool = False
    sets: dict[Areas, Area] = field(default_factory=dict)
    unions: dict[tuple[Areas, ...], Areas] = field(default_factory=dict)
    formations: dict[Formation, str | None] = field(default_factory=dict)

    @property
    def mission(self) -> Mission:
        return self.ground.mission

    def common(self, areas: Areas) -> Area:
        """Intersection of the areas, of which there is at least one."""
        if areas not in self.sets:
            self.sets[areas] = reduce(common, areas)
        return self.sets[areas]

    def either(self, alternatives: Sequence[Areas]) -> Areas:
        """Areas that contain a centre if it is in all areas of one of the alternatives."""
        key = tuple(alternatives)
        if not key or not all(key):
            return frozenset()
        if len(set(key)) == 1:
            return key[0]
        if key not in self.unions:
            whole = self.ground.atlas.union([self.common(each) for each in key])
            self.unions[key] = frozenset.intersection(*key) | {whole}
        return self.unions[key]

    # -------------------------------------------------------------- too far, too near

    def far(self, node: Node, area: Area, steps: Mapping[int, int]) -> Cause | None:
        """Cause for the agents that cannot reach an area by their step, unless some agent has to be there only at the
        first step.
        """
        if self.suspecting:
            return _suspect(self.away((area,), {agent: by for agent, by in steps.items() if by > 0}))
        journeys = []
        for agent, by in sorted(steps.items()):
            if by > 0 and (journey := self._journey(self.mission.agents[agent], area, by)):
                journeys.append(journey)
        if not journeys:
            return None
        nearest = min(journeys, key=lambda journey: journey.distance)
        by = max(steps[journey.agent.index] for journey in journeys)
        when = "" if nearest.barred else f" by {seconds(self.mission, by)}"
        return Cause(
            BARRED if nearest.barred else TOO_FAR,
            _bits([journey.agent for journey in journeys]),
            f"{_nobody([journey.agent for journey in journeys])} {_satisfy(node.span)}{when}",
            node.span,
            figures(self.mission, nearest),
            (begins(nearest),),
            WIDEN if nearest.barred else "allow more time",
        )

    def away(self, areas: Collection[Area], steps: Mapping[int, int]) -> int:
        """Bit set of the agents that cannot be in all of these areas by their step, not even at the first step."""
        if not areas:
            return 0
        area = self.common(frozenset(areas))
        late = [self.mission.agents[agent] for agent, by in steps.items() if self._late(agent, area, by)]
        return _bits(late)

    def _late(self, agent: int, area: Area, by: int) -> bool:
        who, ways = self.mission.agents[agent], self.ground.ways
        asked = who, ways.start(who), area, reach(self.mission, who, by)
        return not ways.shown(*asked) and (self.suspecting or ways.too_long(*asked) is not None)

    def _journey(self, agent: Agent, area: Area, by: int) -> Journey | None:
        ways = self.ground.ways
        start = ways.start(agent)
        way = ways.too_long(agent, start, area, reach(self.mission, agent, by))
        if way is None:
            return None
        return Journey(agent, way.length, way.bent, ways.passage(agent, start, area) if math.isinf(way.length) else 0.0)

    def jump(self, node: UntilNode, hold: Areas, end: Areas, steps: Mapping[int, int]) -> Cause | None:
        """Cause for the agents that cannot get from the left side of an *until* to its right side in one step."""
        if not hold or not end or hold & end:
            return None
        here, there, ways = self.common(hold), self.common(end), self.ground.ways
        agents = [self.mission.agents[each] for each in sorted(steps)]
        if self.suspecting:
            jumping = [each for each in agents if not ways.shown(each, here, there, reach(self.mission, each, 1))]
            return _suspect(_bits(jumping))
        tried = [(agent, ways.too_long(agent, here, there, reach(self.mission, agent, 1))) for agent in agents]
        found = [(agent, way) for agent, way in tried if way is not None]
        if not found:
            return None
        agent, way = min(found, key=lambda pair: pair[1].length)
        apart = "no path between them" if math.isinf(way.length) else f"{metres(way.length)} apart"
        far = metres(agent.dynamics.top_speed * self.mission.step)
        return Cause(
            JUMP,
            _bits([agent for agent, _ in found]),
            f"{_nobody([agent for agent, _ in found])} go from the left to the right side of this `until` in one step",
            node.end.span or node.span,
            f"{apart}{' around the obstacles' if way.bent and math.isfinite(way.length) else ''}; {far} per step",
            (Label(node.hold.span, "left side"),) if node.hold.span else (),
            "raise the top speed",
        )

    # ------------------------------------------------------------------ stays

    def restless(self, node: Node, areas: Areas, moves: Mapping[int, int]) -> Cause | None:
        """Cause for agents whose minimum speed takes them out of an area in which they have to stay for some moves."""
        fast = {each: count for each, count in moves.items() if count > 0 and self._least(each, 1) > 0}
        if not areas or not fast:
            return None
        needed = {each: max(self._least(each, few) for few in range(1, count + 1)) for each, count in fast.items()}
        area = self.common(areas)
        if area.holds_ball(max(needed.values()) / 2):
            return None
        if self.suspecting:
            return _suspect(bits_of(tuple(sorted(fast))))
        wide = self.ground.atlas.diameter(area)
        stuck = [each for each, far in sorted(needed.items()) if far > wide * (1 + ROUNDING) + ROUNDING]
        if not stuck:
            return None
        agent = self.mission.agents[stuck[0]]
        few = next(few for few in range(1, fast[stuck[0]] + 1) if self._least(agent.index, few) > wide + ROUNDING)
        far = metres(self._least(agent.index, few))
        turns = "" if few == 1 else f", with turns of at most {_turn(self.mission, agent)}"
        return Cause(
            RESTLESS,
            _bits([self.mission.agents[each] for each in stuck]),
            f"{_nobody([self.mission.agents[each] for each in stuck])} stay there for"
            f" {seconds(self.mission, fast[stuck[0]])}",
            node.span,
            f"at most {metres(wide)} across; at {speed(agent.dynamics.lowest_speed)} or more, it is {far} away after"
            f" {few} {'step' if few == 1 else 'steps'}{turns}",
            (Label(agent.span, "lowest speed"),),
            "make the region larger",
        )

    def _least(self, agent: int, moves: int) -> float:
        """Lower bound on the distance between the ends of ``moves`` moves, metres; 0 if the agent may turn back.

        If headings differ by at most ``turn`` between consecutive moves, each move advances along the direction of the
        middle move by at least the cosine of the angle between them, as long as all angles are below a right angle.
        """
        dynamics = self.mission.agents[agent].dynamics
        length = dynamics.lowest_speed * self.mission.step
        if moves == 1 or length <= 0:
            return length
        turn = dynamics.top_turn * self.mission.step
        if self.mission.dimension != 2 or not (moves - 1) * turn <= math.pi:
            return 0.0
        return length * math.sin(moves * turn / 2) / math.sin(turn / 2) if turn > 0 else length * moves

    # ------------------------------------------------------------------ room

    def crowded(self, node: Node, count: int, parts: Sequence[Mapping[int, Areas]]) -> Cause | None:
        """Cause for an area that is too small for the agents that must be in it if ``count`` of the parts hold."""
        agents = [frozenset(part) for part in parts]
        sets = {area: None for part in parts for areas in part.values() for area in areas}
        for area in sets:
            inside = [frozenset(each for each in part if area in part[each]) for part in parts]
            there = frozenset[int]().union(*inside)
            if count < len(parts):
                if sum(map(len, agents)) != len(frozenset[int]().union(*agents)):
                    continue  # one agent may be counted by several parts
                number = count - sum(not each for each in inside)
            else:
                number = len(there)
            if number > 1 and (found := self._no_room(node, area, number, sorted(there))):
                return found
        return None

    def _no_room(self, node: Node, area: Area, number: int, there: Sequence[int]) -> Cause | None:
        agents = [self.mission.agents[each] for each in there]
        spacing = _least_spacing(self.mission, there)
        across = math.ceil(math.sqrt(number)) - 1
        if spacing <= ROUNDING:
            return None
        free = common(area, self.ground.free(min(agent.radius for agent in agents)))
        if free.holds_ball(across * spacing / math.sqrt(2)):
            return None
        if self.suspecting:
            return _suspect(-1)
        room = self.ground.atlas.capacity(free, spacing * (1 - ROUNDING) - ROUNDING)
        if room >= number:
            return None
        most = "no agent" if room == 0 else "at most one agent" if room == 1 else f"at most {room:,} agents"
        return Cause(
            CROWDED,
            -1,
            f"no room for {number:,} agents at the same time",
            node.span,
            f"room for {most}, with centres {metres(spacing)} apart",
            (),
            "make the region larger",
        )

    def no_fit(self, node: Node, predicate: Predicate) -> Cause | None:
        """Cause for a formation that does not fit anywhere in the world."""
        formation = predicate.formation
        if formation is None:
            return None
        if formation not in self.formations:
            from missionc.frontend.checks.formation_room import no_room

            self.formations[formation] = no_room(self.ground, formation, suspecting=self.suspecting)
        figure = self.formations[formation]
        if figure is None:
            return None
        return Cause(
            NO_FIT,
            -1,
            f"formation `{formation.name}` does not fit into the world",
            node.span,
            figure,
            (Label(formation.span, f"tolerance {metres(formation.tolerance)}"),),
            "make the formation smaller",
        )


def _suspect(bits: int) -> Cause | None:
    return Cause(TOO_FAR, bits, "", None, "", (), "") if bits else None


def _least_spacing(mission: Mission, agents: Sequence[int]) -> float:
    """Lower bound on the required distance between any two of the agents, metres.

    For many agents, the bound is smaller than the exact value.
    """
    if len(agents) <= 32:
        return min(mission.spacing(*pair).least for pair in combinations(agents, 2))
    return 2 * min(mission.agents[each].radius for each in agents) + mission.separation


def _bits(agents: Sequence[Agent]) -> int:
    return bits_of(tuple(sorted(agent.index for agent in agents)))


def _nobody(agents: Sequence[Agent]) -> str:
    names = listed([f"`{agent.name}`" for agent in agents])
    return f"{names} cannot" if len(agents) == 1 else f"none of {names} can"


def _satisfy(span: Span | None) -> str:
    words = " ".join(span.text.split()) if span else "this"
    return f"be in `{words}`" if words.isidentifier() else f"satisfy `{words}`"


def _turn(mission: Mission, agent: Agent) -> str:
    return f"{round(agent.dynamics.top_turn * mission.step, 4):g} rad"

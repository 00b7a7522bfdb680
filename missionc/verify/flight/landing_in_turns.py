"""Landing after a stop: straight down in turns, clear of those who hover still, of those who stand there, of obstacles.

Margins are metres by which an agent is clearer than it has to be. They are of whole columns: whoever lands may be at
any height of its own at any time of its turn.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from missionc.base.trace import Array
from missionc.curves.crazyflie_csv import Pieces
from missionc.ir import Agent, Mission, Obstacle
from missionc.verify.flight.flight_phases import landing_seconds
from missionc.verify.tolerances import MOTION
from missionc.world.columns import column_clearance
from missionc.world.required_separation import SpacingTable


@dataclass(frozen=True, slots=True, eq=False)
class Stop:
    """A stop of everybody at a moment, and the order in which they land after it.

    Args:
        at: seconds since the mission began.
        pieces: by agent: the stop, and a hover after it.
        turns: agents, by their indices, who land at once; those in no turn hover.
    """

    at: float
    pieces: tuple[Pieces, ...]
    turns: tuple[tuple[int, ...], ...]

    @property
    def seconds(self) -> float:
        """For the stop itself."""
        return float(self.pieces[0].duration[0])

    @property
    def places(self) -> Array:
        """(agents, 3), metres: where they hover."""
        return np.stack([own.coefficients[-1, :3, 0] for own in self.pieces])

    def landing(self, mission: Mission) -> list[float]:
        """Seconds of each turn, which is as long as the slowest in it takes."""
        heights = self.places[:, 2].tolist()
        return [max(landing_seconds(mission.agents[index], heights[index]) for index in turn) for turn in self.turns]


def landing_margins(mission: Mission, stop: Stop) -> Iterator[tuple[int, float]]:
    """By how much each agent that lands is clear of all that it might touch."""
    margins = _Margins(mission, stop)
    hovering, landed = set(range(len(mission.agents))), list[int]()
    end = stop.at + stop.seconds
    for turn, seconds in zip(stop.turns, stop.landing(mission), strict=True):
        hovering -= set(turn)
        end += seconds
        for index in turn:
            beside = [each for each in turn if each != index]
            others = margins.of_others(index, beside, list(hovering), landed)
            yield index, min(others, margins.of_obstacles(index, end))
        landed += turn


class _Margins:
    """Metres by which agents that go straight down after a stop are clear.

    Args:
        stop: its turns are of no interest.
    """

    def __init__(self, mission: Mission, stop: Stop) -> None:
        self.mission, self.places = mission, stop.places
        self.begin = stop.at + stop.seconds
        radius, tracking, pair, downwash = (
            np.array([figure(agent) for agent in mission.agents], dtype=np.float64)
            for figure in (_radius, _tracking, _pair_distance, _downwash_height)
        )
        missed, bodies = _sum(tracking), _sum(radius)
        everyone = np.arange(len(mission.agents))
        apart = np.linalg.norm(self.places[:, None, :2] - self.places[None, :, :2], axis=-1)
        # For two that land at once: sideways, whatever their heights.
        self.aside = apart - SpacingTable.of(mission).between(everyone[:, None], everyone[None])
        # For the first, that lands, while the second hovers: far enough aside, or with it above all of its way.
        tall = np.maximum(np.maximum(bodies, np.maximum(pair[:, None], pair[None])), _sum(downwash)) + missed
        above = self.places[None, :, 2] - self.places[:, None, 2]
        self.past = np.maximum(self.aside, above - tall)
        # For one that lands beside another that stands there with its motors off: bodies alone count.
        self.onto = apart - bodies - missed
        self._standing: dict[int, float] = {}

    def of_others(self, index: int, beside: list[int], hovering: list[int], landed: list[int]) -> float:
        """For one agent that lands.

        Args:
            beside: who lands with it.
        """
        rows = ((self.aside, beside), (self.past, hovering), (self.onto, landed))
        return min(float(table[index, some].min(initial=math.inf)) for table, some in rows)

    def of_obstacles(self, index: int, end: float) -> float:
        """Likewise, where it hovers from the stop on until it lands.

        Args:
            end: seconds since the mission began: when it stands.
        """
        if index not in self._standing:
            self._standing[index] = self._of(index, [each for each in self.mission.obstacles if each.constant], end)
        changing = [each for each in self.mission.obstacles if not each.constant]
        return min(self._standing[index], self._of(index, changing, end))

    def _of(self, index: int, some: list[Obstacle], end: float) -> float:
        agent, point = self.mission.agents[index], tuple(self.places[index, : self.mission.dimension].tolist())
        need = agent.radius + agent.vehicle.tracking
        return min((column_clearance(each, point, self.begin, end) - need for each in some), default=math.inf)


def _radius(agent: Agent) -> float:
    return agent.radius


def _tracking(agent: Agent) -> float:
    return agent.vehicle.tracking


def _pair_distance(agent: Agent) -> float:
    return agent.vehicle.pair_distance


def _downwash_height(agent: Agent) -> float:
    return agent.vehicle.downwash_height


def _sum(figure: Array) -> Array:
    """(agents, agents): of every two."""
    return np.asarray(figure[:, None] + figure[None])


def pad_turns(mission: Mission, hovers: Array) -> tuple[tuple[int, ...], ...]:
    """The turns in which agents can land from above their pads, as many at once as can; they rise the other way round.

    Obstacles are left out: they count with the times at which they are there.

    Args:
        hovers: (agents, 3), metres.
    """
    return in_turns(replace(mission, obstacles=()), above_pads(hovers), -MOTION)


def pads_suffice(mission: Mission, hovers: Sequence[tuple[float, ...]]) -> bool:
    """Whether everybody can rise to where it hovers, and land from there, in whatever turns; three coordinates each."""
    return sum(map(len, pad_turns(mission, np.array(hovers, dtype=np.float64)))) == len(mission.agents)


def above_pads(hovers: Array, turns: tuple[tuple[int, ...], ...] = ()) -> Stop:
    """Everybody at rest above its pad."""
    still = np.zeros((len(hovers), 2, 4, 8))
    still[:, :, :3, 0] = hovers[:, None]
    return Stop(0.0, tuple(Pieces(np.ones(2), own) for own in still), turns)


def in_turns(mission: Mission, stop: Stop, enough: float = 0.0) -> tuple[tuple[int, ...], ...]:
    """The turns in which agents can land after a stop, as many at once as can, the lowest first.

    Those that nobody can be sure of landing clear are in none.
    """
    margins = _Margins(mission, stop)
    remaining, landed = set(range(len(mission.agents))), list[int]()
    heights = stop.places[:, 2].tolist()
    lasting = [landing_seconds(agent, height) for agent, height in zip(mission.agents, heights, strict=True)]
    turns: list[tuple[int, ...]] = []
    end = stop.at + stop.seconds
    while remaining:
        turn: list[int] = []
        seconds = 0.0
        for index in sorted(remaining, key=lambda each: (heights[each], each)):
            others = margins.of_others(index, turn, list(remaining.difference(turn, [index])), landed)
            longer = max(seconds, lasting[index])
            # Who lands with others hovers, or sinks, as long as they.
            these = [index] if longer == seconds else [*turn, index]
            if others >= enough and all(margins.of_obstacles(each, end + longer) >= enough for each in these):
                turn.append(index)
                seconds = longer
        if not turn:
            break
        end += seconds
        turns.append(tuple(sorted(turn)))
        remaining -= set(turn)
        landed += turn
    return tuple(turns)

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
from missionc.ir import Mission
from missionc.verify.flight.flight_phases import landing_seconds
from missionc.verify.tolerances import MOTION
from missionc.world.columns import column_clearance


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
    hovering, landed = set(range(len(mission.agents))), set[int]()
    end = stop.at + stop.seconds
    for turn, seconds in zip(stop.turns, stop.landing(mission), strict=True):
        hovering -= set(turn)
        end += seconds
        for index in turn:
            yield index, margin_of(mission, stop, index, set(turn) - {index}, hovering, landed, end)
        landed |= set(turn)


def margin_of(
    mission: Mission, stop: Stop, index: int, beside: set[int], hovering: set[int], landed: set[int], end: float
) -> float:
    """For one agent that lands.

    Args:
        beside: who lands with it.
        end: seconds since the mission began: when it stands. It hovers from the stop on until it lands.
    """
    places = stop.places
    margins = [_aside(mission, index, other, places) for other in beside]
    margins += [_past(mission, index, other, places) for other in hovering]
    margins += [_onto(mission, index, other, places) for other in landed]
    agent, point = mission.agents[index], tuple(places[index, : mission.dimension].tolist())
    need = agent.radius + agent.vehicle.tracking
    begin = stop.at + stop.seconds
    margins += [column_clearance(obstacle, point, begin, end) - need for obstacle in mission.obstacles]
    return min(margins, default=math.inf)


def _aside(mission: Mission, one: int, other: int, places: Array) -> float:
    """For two that land at once: sideways, whatever their heights."""
    return _sideways(places, one, other) - mission.spacing(one, other).sideways


def _past(mission: Mission, one: int, other: int, places: Array) -> float:
    """For one that lands while another hovers: far enough aside, or with the other above all of its way."""
    first, second = mission.agents[one], mission.agents[other]
    missed = first.vehicle.tracking + second.vehicle.tracking
    tall = first.vehicle.downwash_height + second.vehicle.downwash_height
    bodies = max(first.radius + second.radius, first.vehicle.pair_distance, second.vehicle.pair_distance)
    above = float(places[other, 2] - places[one, 2]) - max(bodies, tall) - missed
    return max(_aside(mission, one, other, places), above)


def _onto(mission: Mission, one: int, other: int, places: Array) -> float:
    """For one that lands beside another that stands there with its motors off: bodies alone count."""
    first, second = mission.agents[one], mission.agents[other]
    need = first.radius + second.radius + first.vehicle.tracking + second.vehicle.tracking
    return _sideways(places, one, other) - need


def _sideways(places: Array, one: int, other: int) -> float:
    return float(np.linalg.norm((places[one] - places[other])[:2]))


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
    remaining, landed = set(range(len(mission.agents))), set[int]()
    heights = stop.places[:, 2].tolist()
    turns: list[tuple[int, ...]] = []
    end = stop.at + stop.seconds
    while remaining:
        turn: list[int] = []
        for index in sorted(remaining, key=lambda each: (heights[each], each)):
            until = end + max(landing_seconds(mission.agents[each], heights[each]) for each in (*turn, index))
            with_it = {*turn, index}
            clear = all(
                margin_of(mission, stop, each, with_it - {each}, remaining - with_it, landed, until) >= enough
                for each in with_it
            )
            if clear:
                turn.append(index)
        if not turn:
            break
        end += max(landing_seconds(mission.agents[each], heights[each]) for each in turn)
        turns.append(tuple(sorted(turn)))
        remaining -= set(turn)
        landed |= set(turn)
    return tuple(turns)

"""Formulas of a random mission: all operators, predicates and bounds, with windows that often end exactly at the last
step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Names:
    """Names for the formulas of a mission.

    Args:
        step: step, seconds.
        regions, beacons, graphs, formations: names.
        agents: names of single agents, ``drone[0]``.
        teams: teams with several agents, with their sizes.
        hops, metres: True if routes have such bounds.
        volume: True if the world has a height.
        lets: names of formulas about one agent that look no step ahead.
        faces: True if all agents have a heading.
    """

    step: float
    regions: Sequence[str]
    beacons: Sequence[str]
    graphs: Sequence[str]
    formations: Sequence[str]
    agents: Sequence[str]
    teams: Sequence[tuple[str, int]]
    hops: bool
    metres: bool
    volume: bool
    lets: Sequence[str] = ()
    resources: Sequence[str] = ()
    flags: Sequence[str] = ()
    faces: bool = False


class Formulas:
    """Random formulas; ``room`` is the maximum look-ahead in steps, ``depth`` the maximum nesting."""

    def __init__(self, generator: np.random.Generator, names: Names) -> None:
        self.random, self.names = generator, names
        self.below_a_route = 0

    def one(self, among: Sequence[str]) -> str:
        return among[int(self.random.integers(len(among)))]

    def odds(self, share: float) -> bool:
        return bool(self.random.random() < share)

    def number(self, low: float, high: float) -> str:
        return f"{self.random.uniform(low, high):.2f}"

    # ------------------------------------------------------------- about the team

    def team(self, room: int, depth: int) -> str:
        """Formula about the team."""
        kind = self.one(["quantified", "quantified", "quantified", "temporal", "logic", "leaf"])
        if depth <= 0 or kind == "leaf":
            return self._team_leaf(room)
        if kind == "temporal":
            return self._temporal(self.team, room, depth)
        if kind == "logic":
            return self._logic(self.team, room, depth)
        return f"({self.quantified(room, depth)})"

    def quantified(self, room: int, depth: int) -> str:
        """Formula about some members of a team, or about one agent."""
        team, size = self.names.teams[int(self.random.integers(len(self.names.teams)))]
        whom = self.one(["every {}", "some {}", "at least {n} {}", self.one(self.names.agents)])
        count = int(self.random.integers(1, size + 1))
        return f"{whom.format(team, n=count)}: {self.agent(room, depth)}"

    def _team_leaf(self, room: int) -> str:
        kinds = ["agent"]
        if self.names.graphs:
            kinds += ["connected", "connected"]
        if self.names.formations:
            kinds += ["formation", "formation"]
        if len(self.names.agents) > 1:
            kinds += ["pair"]
        match self.one(kinds):
            case "connected":
                return f"connected({self.one(self.names.graphs)}{self.one(['', '', ', 1'])})"
            case "formation":
                return self.one(self.names.formations)
            case "pair":
                first, second = self.random.permutation(len(self.names.agents))[:2]
                pair = f"distance({self.names.agents[first]}, {self.names.agents[second]})"
                return f"{pair} {self.one(['<=', '>=', '<', '>'])} {self.number(0.4, 5)} m"
            case _:
                return f"({self.one(self.names.agents)}: {self.agent(room, 1)})"

    # -------------------------------------------------------------- about an agent

    def agent(self, room: int, depth: int) -> str:
        """Formula about one agent."""
        if depth <= 0:
            return self._leaf()
        kinds = ["temporal", "temporal", "temporal", "logic", "leaf"]
        if self.names.graphs:
            kinds += ["spatial", "spatial"]
        match self.one(kinds):
            case "temporal":
                return self._temporal(self.agent, room, depth)
            case "logic":
                return self._logic(self.agent, room, depth)
            case "spatial":
                return self._spatial(room, depth)
            case _ if self.odds(0.1) and not self.below_a_route:
                return f"(({self._leaf()}) {self.one(['and', 'or', 'iff'])} ({self.quantified(room, depth - 1)}))"
            case _:
                return self._leaf()

    def _leaf(self) -> str:
        place = self.one(self.names.regions)
        kinds = [place, place, f"inside({place})", f"touches({place})", "belongs", "coordinates", "speed", "distance"]
        kinds += ["true", "false"] if self.odds(0.1) else []
        kinds += ["heading", "heading", "heading"] if self.names.faces else []
        kinds += [*self.names.lets, *self.names.flags, *self.names.flags, *self.names.resources, *self.names.resources]
        sign = self.one(["<=", ">=", "<", ">"])
        match self.one(kinds):
            case "belongs":
                return self.one([name for name, _ in self.names.teams] + list(self.names.agents[:1]))
            case "coordinates":
                plus = self.one(
                    ["x", "y", "x + y", "x - 2*y", "2*x + 1"] + (["z", "z - x"] if self.names.volume else [])
                )
                return f"{plus} {sign} {self.number(0, 5)}"
            case "speed":
                return self.one(
                    ["speed <= 1.2 m/s", "speed >= 0.1 m/s", "altitude >= 0.5 m", "speed + 0.2 m/s <= 2 m/s"]
                )
            case "heading":
                towards = self.one([f"{self.number(-180, 360)} deg", *self.names.beacons])
                return f"heading within {self.number(10, 120)} deg of {towards}"
            case "distance":
                thing = self.one([*self.names.regions, *self.names.beacons, *self.names.agents])
                return f"distance({thing}) {sign} {self.number(0.2, 4)} m"
            case said if said in self.names.resources:
                return f"{said} {sign} {self.number(0, 30)}"
            case said:
                return said

    # ------------------------------------------------------------------- operators

    def _logic(self, part: object, room: int, depth: int) -> str:
        assert callable(part)
        word = self.one(["not", "and", "or", "implies", "iff", "and", "or"])
        if word == "not":
            return f"not ({part(room, depth - 1)})"
        return f"(({part(room, depth - 1)}) {word} ({part(room, depth - 1)}))"

    def _temporal(self, part: object, room: int, depth: int) -> str:
        assert callable(part)
        words = ["always", "eventually", "eventually", "until", "release"] + (["next"] if room else [])
        if not (self.below_a_route and self.names.metres):  # no backend looks back there
            words += ["once", "historically", "since", "arrives", "leaves"] + (["every"] if room else [])
        word = self.one(words)
        if word in ("once", "historically", "since"):
            low = int(self.random.integers(0, 3))
            bounds = f"[{self._time(low)}, {self._time(low + int(self.random.integers(0, 4)))}]"
            if word == "since":
                return f"(({part(room, depth - 1)}) since{bounds} ({part(room, depth - 1)}))"
            return f"{word}{bounds} ({part(room, depth - 1)})"
        if word == "every":
            period = self._time(int(self.random.integers(1, room + 1)))
            return f"({word} {period}: {part(0, depth - 1)})"
        if word in ("arrives", "leaves"):
            return f"{word} ({part(room, depth - 1)})"
        if word == "next":
            return f"next ({part(room - 1, depth - 1)})"
        high, bounds = self._window(room)
        left = room - high
        if word in ("always", "eventually"):
            return f"{word}{bounds} ({part(left, depth - 1)})"
        # The left side is evaluated up to the step before the last one of the window, so at no step if that is now.
        before = (left + 1 if high > 0 else room + 3) if self.odds(0.5) else left
        return f"(({part(before, depth - 1)}) {word}{bounds} ({part(left, depth - 1)}))"

    def _window(self, room: int) -> tuple[int, str]:
        """Last step and text of a window; one that is open to the end uses the whole look-ahead."""
        high = room if self.odds(0.4) else int(self.random.integers(0, room + 1))
        low = 0 if self.odds(0.5) else int(self.random.integers(0, high + 1))
        if self.odds(0.15):
            return room, f"[{self._time(low)}, end]"
        return high, f"[{self._time(low)}, {self._time(high)}]"

    def _time(self, steps: int) -> str:
        return f"{steps} steps" if self.odds(0.1) else f"{steps * self.names.step:g} s" if steps else "0"

    def _spatial(self, room: int, depth: int) -> str:
        word = self.one(["reach", "escape", "somewhere", "everywhere", "surround", "count", "reach"])
        bounds = self._length()
        self.below_a_route += 1
        formula = self._of_route(word, bounds, room, depth)
        self.below_a_route -= 1
        return formula

    def _of_route(self, word: str, bounds: str, room: int, depth: int) -> str:
        if word in ("reach", "surround"):
            return f"(({self.agent(room, depth - 1)}) {word}{bounds} ({self.agent(room, depth - 1)}))"
        if word == "count":
            sign, number = self.one([">=", ">", "<", "<="]), int(self.random.integers(0, 3))
            return f"count{bounds} ({self.agent(room, depth - 1)}) {sign} {number}"
        return f"{word}{bounds} ({self.agent(room, depth - 1)})"

    def _length(self) -> str:
        graph = self.one(self.names.graphs)
        if self.names.metres and (not self.names.hops or self.odds(0.5)):
            low, more = self.one(["0", "0", "0.3", "0.8"]), self.random.uniform(0.2, 3)
            text = self.one(
                [f"distance {low} m..{float(low) + more:.2f} m", f"distance <= {more:.2f} m", f"distance {low} m.."]
            )
        else:
            low, more = int(self.random.integers(0, min(3, len(self.names.agents)))), int(self.random.integers(0, 3))
            text = self.one([f"hops {low}..{low + more}", f"hops <= {more}", f"hops {low}.."])
        return f"[{text} on {graph}]"

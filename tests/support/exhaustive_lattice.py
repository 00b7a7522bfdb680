"""Random missions on a lattice of 1 m cells, and all plans from cell to cell.

Agents may also move between cells: a mission without such a plan may have another one.
"""

from __future__ import annotations

import random
from collections.abc import Iterator
from itertools import pairwise, product

from missionc import ir
from missionc.base.diagnostics.code import BARRED, CROWDED, JUMP, NO_FIT, RESTLESS, STUCK, TOO_FAR
from tests import reference

SAY_IMPOSSIBLE = frozenset({TOO_FAR, BARRED, JUMP, RESTLESS, CROWDED, NO_FIT, STUCK})
"""Errors of `check` that claim that no plan can satisfy a mission."""

SIDE = 3
CELLS = tuple(product(range(SIDE), repeat=2))
MOVES = ((0, 0), (1, 0), (-1, 0), (0, 1), (0, -1))
Path = tuple[tuple[int, int], ...]


def box(cell: tuple[int, int], half: float) -> str:
    x, y = cell[0] + 0.5, cell[1] + 0.5
    return f"box ({x - half:g}, {y - half:g}) to ({x + half:g}, {y + half:g})"


class Small:
    """Mission on a lattice of 1 m cells: obstacles, starts and requirements."""

    def __init__(self, seed: int) -> None:
        self.random = random.Random(seed)
        draw = self.random
        self.agents = draw.choice((1, 2))
        self.steps = 4 if self.agents == 1 else 2
        self.blocked = frozenset(draw.sample(CELLS, draw.choice((0, 2, 3))))
        free = [cell for cell in CELLS if cell not in self.blocked]
        self.starts = tuple(draw.sample(free, self.agents))
        self.places = {name: draw.choice(free) for name in "abc"}
        self.half = draw.choice((0.1, 0.2))
        self.restless = draw.random() < 0.25
        self.formula = self.team(2)

    def window(self) -> str:
        low = self.random.randint(0, 2)
        high = self.random.randint(low, 2)
        return f"[{low} s, {high} s]"

    def team(self, depth: int) -> str:
        if depth and self.random.random() < 0.4:
            word = self.random.choice(("or", "or", "and"))
            return f"({self.team(depth - 1)}) {word} ({self.team(depth - 1)})"
        if self.agents > 1 and self.random.random() < 0.3:
            together = self.random.choice(("every bot: a", "(bot[0]: b) and (bot[1]: b)", "row", "row and (bot[0]: c)"))
            return f"{self.random.choice(('eventually', 'always'))}{self.window()} ({together})"
        return f"{self.random.choice(('every', 'some'))} bot: {self.own(3)}"

    def own(self, depth: int) -> str:
        if depth == 0 or self.random.random() < 0.15:
            return self.random.choice(("a", "b", "c", "(a or b)", "(not a)"))
        match self.random.choice(("until", "until", "window", "window", "or", "and", "not")):
            case "until":
                return f"({self.own(depth - 1)} until{self.window()} {self.own(depth - 1)})"
            case "window":
                return f"({self.random.choice(('eventually', 'always'))}{self.window()} {self.own(depth - 1)})"
            case "not":
                return f"(not {self.own(depth - 1)})"
            case word:
                return f"({self.own(depth - 1)} {word} {self.own(depth - 1)})"

    @property
    def text(self) -> str:
        dynamics = "unicycle(speed 1..1 m/s)" if self.restless else "single_integrator(speed <= 1 m/s)"
        starts = ", ".join(f"({x + 0.5:g}, {y + 0.5:g})" for x, y in self.starts)
        lines = [
            "mission small",
            f"time step 1 s, horizon {self.steps} s",
            f"world (0, 0) to ({SIDE}, {SIDE})",
            *(f"region {name} = {box(cell, self.half)}" for name, cell in self.places.items()),
            *(f"obstacle o{number} = {box(cell, 0.45)}" for number, cell in enumerate(sorted(self.blocked))),
            f"team bot[{self.agents}] {{ radius 0.2 m  dynamics {dynamics}  start at {starts} }}",
            *(["formation row = offsets of bot (0, 0), (1, 0) tolerance 0.1 m"] if self.agents > 1 else []),
            f"require r: {self.formula}",
        ]
        return "\n".join(lines) + "\n"

    def paths(self, agent: int) -> Iterator[Path]:
        moves = MOVES[1:] if self.restless else MOVES
        for chosen in product(moves, repeat=self.steps):
            path = [self.starts[agent]]
            for across, up in chosen:
                cell = path[-1][0] + across, path[-1][1] + up
                if cell in self.blocked or not (0 <= cell[0] < SIDE and 0 <= cell[1] < SIDE):
                    break
                path.append(cell)
            else:
                yield tuple(path)

    def plans(self) -> Iterator[tuple[Path, ...]]:
        """All joint motions from cell to cell without shared cells or swaps."""
        for plan in product(*(list(self.paths(agent)) for agent in range(self.agents))):
            if all(len(set(cells)) == self.agents for cells in zip(*plan, strict=True)) and not _swapped(plan):
                yield plan


def _swapped(plan: tuple[Path, ...]) -> bool:
    if len(plan) < 2:
        return False
    moves = zip(pairwise(plan[0]), pairwise(plan[1]), strict=True)
    return any(one[0] == other[1] and one[1] == other[0] for one, other in moves)


def satisfied(mission: ir.Mission, plan: tuple[Path, ...]) -> bool:
    position = [[(x + 0.5, y + 0.5) for x, y in path] for path in plan]
    velocity = []
    for path in position:
        moved = [(b[0] - a[0], b[1] - a[1]) for a, b in pairwise(path)]
        velocity.append([*moved, moved[-1]])
    run = reference.Run(mission, position, velocity)
    return bool(reference.truth(mission.requirements[0].formula, run, 0, 0))

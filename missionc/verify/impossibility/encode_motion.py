"""The encoding of where agents are: a variable for each agent, step and cell, and what a cover leaves out.

in   ClaimedCover, the number of the last step
out  clauses
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from missionc.base.trace import Flags
from missionc.verify.impossibility.cnf import FALSE, Cnf
from missionc.verify.impossibility.cover_document import CellsOfKind, ClaimedCover

States = NDArray[np.int64]
"""The literal that an agent is in a cell at a step, (steps + 1, cells); FALSE where it never is."""

FEW = 4
"""A clause for each cell ruled out, up to so many; else one over those that are left."""


def encode_motion(cover: ClaimedCover, cnf: Cnf) -> dict[int, States]:
    """Adds that each agent asked is in one cell at each step, and never does what the cover leaves out."""
    states: dict[int, States] = {}
    for agent in cover.asked:
        absent, kind = cover.absent[agent], cover.kind_of(agent)
        own = np.full(absent.shape, FALSE, dtype=np.int64)
        own[~absent] = [cnf.fresh() for _ in range(int((~absent).sum()))]
        for row in own:
            cnf.add(row.tolist())
            cnf.at_most_one(row.tolist())
        for steps, never in sorted(kind.no_move.items()):
            for step in range(len(own) - steps):
                add_support(cnf, own[step], own[step + steps], ~never)
                if steps == 1:
                    add_support(cnf, own[step + steps], own[step], ~never.T)
        for steps, never in sorted(kind.no_turn.items()):
            _add_turns(cnf, own, steps, ~never)
        states[agent] = own
    for agent, never in cover.not_both.items():
        if agent in states:
            _add_visits(cnf, states[agent], never)
    if cover.apart:
        for (first, second), never in cover.not_together.items():
            if first in states and second in states:
                for one, other in zip(states[first], states[second], strict=True):
                    add_support(cnf, one, other, ~never)
        _add_rooms(cnf, cover, states)
    return states


def add_support(cnf: Cnf, here: States, there: States, fits: Flags, condition: int = FALSE) -> None:
    """Where the one is in a cell, the other is in one that goes with it, unless the condition holds.

    Args:
        here: (cells,); ``there`` likewise.
        fits: (cells, cells).
    """
    columns = np.flatnonzero(there != FALSE)
    for row in np.flatnonzero(here != FALSE).tolist():
        able = fits[row, columns]
        if able.all():
            continue
        ruled_out = columns[~able]
        if len(ruled_out) <= FEW:
            for column in ruled_out.tolist():
                cnf.add((condition, -int(here[row]), -int(there[column])))
        else:
            cnf.add((condition, -int(here[row]), *there[columns[able]].tolist()))


def _add_turns(cnf: Cnf, own: States, steps: int, fits: NDArray[np.bool_]) -> None:
    for step in range(steps, len(own) - steps):
        for cell in np.flatnonzero(own[step - steps] != FALSE).tolist():
            add_support(cnf, own[step], own[step + steps], fits[cell], -int(own[step - steps, cell]))


def _add_visits(cnf: Cnf, own: States, never: Flags) -> None:
    """Whoever is ever in one of two cells is never in the other."""
    wanted = np.flatnonzero(never.any(axis=0) | never.any(axis=1))
    ever = {}
    for cell in wanted.tolist():
        ever[cell] = cnf.fresh()
        for literal in own[:, cell].tolist():
            cnf.add((-literal, ever[cell]))
    for first, second in np.argwhere(never | never.T).tolist():
        if first <= second:
            cnf.add((-ever[first], -ever[second]))


def _add_rooms(cnf: Cnf, cover: ClaimedCover, states: dict[int, States]) -> None:
    for low, high, most in cover.at_most:
        inside: list[list[int]] = []
        for agent, own in states.items():
            kind = cover.kind_of(agent)
            within = within_box(kind, low, high)
            inside.append([_seen(cnf, row[within].tolist()) for row in own])
        for at_once in zip(*inside, strict=True):
            for chosen in combinations(at_once, most + 1):
                cnf.add(-literal for literal in chosen)


def within_box(kind: CellsOfKind, low: NDArray[np.float64], high: NDArray[np.float64]) -> Flags:
    """Which cells lie in a box: (cells,)."""
    inside: Flags = np.all((kind.boxes[0] >= low) & (kind.boxes[1] <= high), axis=1)
    return inside


def _seen(cnf: Cnf, literals: Sequence[int]) -> int:
    """A literal that each of these implies."""
    able = [literal for literal in literals if literal != FALSE]
    if len(able) < 2:
        return able[0] if able else FALSE
    name = cnf.fresh()
    for literal in able:
        cnf.add((-literal, name))
    return name

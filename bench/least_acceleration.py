"""Lower bound on the acceleration of any flight through a plan's steps in time.

    python bench/least_acceleration.py FOLDER...

A point mass that starts and ends at rest passes every step's position at its time. It may change its acceleration
``CHANGES`` times a step without any limit on jerk, and its path between the steps is free. The bound is a linear
program over the accelerations, whose norm is bounded from below by ``SIDES`` half-planes (a polygon for the unit
circle, which underestimates it by 2 %). Every smooth flight needs at least this. Prints the minimum peak in m/s² for
each agent that moves.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import csr_array, eye_array, hstack, kron, vstack

from missionc.base.trace import Array
from missionc.tools.replay.read_folder import OutputFolder, read_folder

CHANGES, SIDES = 16, 16


def least(path: Array, step: float) -> float:
    """Minimum peak acceleration, m/s², for a path (steps + 1, 2) in metres and a step in seconds."""
    steps = len(path) - 1
    count, moment = steps * CHANGES, step / CHANGES
    until = np.arange(1, steps + 1)[:, None] * CHANGES
    moves = np.clip(until - np.arange(count), 0, None)
    place = np.where(moves > 0, moment**2 * (moves - 0.5), 0.0)
    form = csr_array(np.concatenate([place, np.full((1, count), moment)]))
    target = np.concatenate([path[1:] - path[0], np.zeros((1, 2))])
    none = csr_array((2 * form.shape[0], 1))
    angle = 2 * np.pi * np.arange(SIDES) / SIDES
    sides = kron(np.stack([np.cos(angle), np.sin(angle)], axis=-1), eye_array(count))
    peak = np.zeros(2 * count + 1)
    peak[-1] = 1.0
    solved = linprog(
        peak,
        A_ub=vstack([hstack([csr_array(sides), csr_array(-np.ones((sides.shape[0], 1)))])]),
        b_ub=np.zeros(sides.shape[0]),
        A_eq=hstack([kron(eye_array(2), form), none]),
        b_eq=target.T.ravel(),
        bounds=[(None, None)] * (2 * count) + [(0, None)],
        method="highs-ipm",
    )
    return float(solved.fun) if solved.success else float("nan")


def main() -> None:
    for name in sys.argv[1:]:
        opened = read_folder(Path(name))
        if not isinstance(opened, OutputFolder):
            raise SystemExit(f"{name} cannot be read")
        for agent in opened.mission.agents:
            path = opened.trace.position[agent.index, :, :2]
            if np.ptp(path, axis=0).max() > 0:
                print(f"{Path(name).name} {agent.name} {least(path, float(opened.mission.step)):.2f} m/s^2", flush=True)


if __name__ == "__main__":
    main()

"""Small random missions, mostly impossible, and a test of subsets of their requirements."""

from __future__ import annotations

import random
import time
from collections.abc import Collection, Iterator
from dataclasses import replace

from missionc.backends.api import Budget, Planned
from missionc.backends.options import Options
from missionc.backends.run_account import run_to_end
from missionc.backends.smt.backend import Run
from missionc.backends.smt.roadmap.roadmap import NoRoadmap
from missionc.backends.smt.roadmap.sequence import roadmaps_to_try
from missionc.base.source import Source
from missionc.compiler import driver
from missionc.compiler.front_end import Checked
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel

HORIZON = 10
"""Horizon of all of these missions, in seconds and steps."""

LIMIT = 60.0
"""Time limit of one satisfiability question, seconds."""

PLACES = {
    "dock": "box (1, 1) to (2.5, 3)",
    "pier": "box (9, 1) to (10.5, 3)",
    "lawn": "box (5, 5.5) to (7, 7)",
    "shed": "box (1, 5.5) to (2.5, 7)",
    "gate": "box (5.5, 0) to (6.5, 4)",
}


def random_mission(seed: int) -> str:
    """Text of a mission with five or six requirements; the same seed gives the same text."""
    draw = random.Random(seed)
    agents = draw.randint(1, 3)
    starts = ", ".join(draw.sample(["(2, 2)", "(3.5, 2)", "(2, 4)", "(4, 4)"], agents))
    lines = [
        f"mission drawn\ntime step 1 s, horizon {HORIZON} s\nworld (0, 0) to (12, 8)",
        *(f"region {name} = {shape}" for name, shape in PLACES.items()),
        f"team robot[{agents}] {{ radius 0.2 m  dynamics single_integrator(speed <= {draw.choice((1, 1.5, 2))} m/s)",
        f"  start at {starts} }}",
        f"graph radio = proximity {draw.choice((2, 3, 5))} m",
        *(f"require r{number}: {_requirement(draw, agents)}" for number in range(draw.randint(5, 6))),
    ]
    return "\n".join(lines) + "\n"


def _requirement(draw: random.Random, agents: int) -> str:
    """Requirement on one, all, or some of the agents."""
    here, there, other = draw.sample(sorted(PLACES), 3)
    who = draw.choice(["every robot:", "some robot:", f"robot[{draw.randrange(agents)}]:"])
    low = draw.randint(0, 6)
    window = f"[{low} s, {draw.randint(low, HORIZON)} s]"
    one = [
        f"{who} eventually{window} {here}",
        f"{who} eventually[{HORIZON} s, {HORIZON} s] {here}",
        f"{who} always[0, {HORIZON} s] not {here}",
        f"{who} (not {here}) until[0, {HORIZON} s] {there}",
        f"{who} ({here} until[3 s, {HORIZON} s] {there}) or ({here} until[3 s, {HORIZON} s] {other})",
        f"{who} eventually[0, 6 s] ({here} and eventually[0, 4 s] {there})",
        f"{who} eventually[0, 7 s] always[0, 3 s] {here}",
        f"{who} always[0, {HORIZON} s] speed <= 0.7",
        f"{who} always[0, {HORIZON} s] x <= 6.5",
    ]
    several = [
        f"always[0, {HORIZON} s] connected(radio)",
        f"eventually{window} ((robot[0]: {here}) and (robot[1]: {there}))",
        f"always[2 s, {HORIZON} s] distance(robot[0], robot[1]) >= 3",
        f"eventually{window} (connected(radio) and (some robot: {here}))",
    ]
    return draw.choice(one + several if agents > 1 else one)


def sound_missions(first: int = 0) -> Iterator[tuple[int, Checked]]:
    """Seeds from ``first`` on whose missions pass `check`, with these missions, for `smt`."""
    seed = first
    while True:
        checked = driver.check(Source("drawn.mission", random_mission(seed)), backend="smt")
        if checked.ok:
            yield seed, checked
        seed += 1


def can_hold(mission: Mission, kernel: Kernel, names: Collection[str]) -> bool:
    """Return whether one of the roadmaps of the whole mission has a plan for these requirements alone."""
    fewer = Kernel(tuple(goal for goal in kernel.requirements if goal.name in names), ())
    for attempt in roadmaps_to_try(mission, kernel, 0):
        roadmaps = attempt.build()
        if isinstance(roadmaps, NoRoadmap):
            continue
        run = Run(mission, fewer, Options(solver="auto"), Budget(time.monotonic() + LIMIT))
        with run.solvers() as solvers:
            if isinstance(run_to_end(run.on_roadmaps(roadmaps, solvers), run.budget), Planned):
                return True
    return False


def is_smallest(checked: Checked, conflict: tuple[str, ...]) -> bool:
    """Return whether each subset of a conflict without one element is satisfiable."""
    assert checked.mission is not None
    assert checked.kernel is not None
    mission, kernel = checked.mission, replace(checked.kernel, preferences=())
    return all(can_hold(mission, kernel, [each for each in conflict if each != name]) for name in conflict)

"""A small flight for replanning: its mission, compiled folder, and flown part."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path

from missionc.base.limits import Limits
from missionc.base.source import Source
from missionc.base.units import Seconds
from missionc.compiler.driver import compile
from missionc.compiler.replan.patch import patched
from missionc.compiler.replan.replan import replan
from missionc.compiler.replan.request import Flying, Request
from missionc.compiler.results import Compiled, Verified
from missionc.output.folder.file_names import flights_in
from missionc.verification.monitoring.read_trace import read_flown

SHELF = """mission shelf
time  step 1 s, horizon 22 s
world (0, 0) to (7, 5)
region   pad  = box (0.5, 0.5) to (2, 4.5)
region   look = box (4.8, 1) to (6.5, 4)
obstacle rack = box (2.8, 1.5) to (3.4, 3.5)
team drone[3] {
  vehicle  crazyflie21
  dynamics single_integrator(speed <= 1 m/s)
  start    at (1, 1), (1, 2.5), (1, 4)
}
require inspect: some drone: eventually[0, end] look
require home:    every drone: eventually[8 s, end] pad
"""


CHANGED = "region look = box (5.4, 0.5) to (6.5, 1.5)\nobstacle debris = disc at (4.2, 4.5) radius 0.2"
"""Patch of the world after which the plan must change."""


@cache
def compiled() -> Compiled:
    """Shelf mission as planned by ``smt``."""
    return compile(Source("shelf.mission", SHELF), backend="smt")


def outcome() -> Verified:
    found = compiled().outcome
    assert isinstance(found, Verified), compiled().findings
    return found


def flying() -> Flying:
    """Its plan in flight."""
    checked, verified = compiled().checked, outcome()
    assert checked.mission is not None
    return Flying(checked, verified.plan.trace, flights_in(checked.mission.agents, dict(verified.files)))


def inspector() -> str:
    """Name of the drone that inspects the far end."""
    checked, trace = compiled().checked, outcome().plan.trace
    assert checked.mission is not None
    return checked.mission.agents[int(trace.position[:, :, 0].max(axis=1).argmax())].name


def folder(place: Path) -> Path:
    """Its folder, written to ``place``."""
    return written_to(place, outcome().files)


def written_to(place: Path, files: Mapping[str, bytes] | Iterable[tuple[str, bytes]]) -> Path:
    """Folder of files, written to ``place``."""
    for name, content in dict(files).items():
        (place / name).parent.mkdir(parents=True, exist_ok=True)
        (place / name).write_bytes(content)
    return place


def flown(until: int) -> str:
    """Table of the flight up to ``until`` seconds, as planned."""
    checked, trace = compiled().checked, outcome().plan.trace
    assert checked.mission is not None
    rows = [
        ",".join(map(str, (agent.name, float(number), *trace.position[agent.index, number])))
        for agent in checked.mission.agents
        for number in range(until + 1)
    ]
    return "\n".join(["agent,t,x,y", *rows]) + "\n"


@cache
def replanned() -> dict[str, bytes]:
    """Folder of the plan from 4 s on, in the changed world."""
    before = flying()
    assert before.checked.mission is not None
    texts = patched(before.checked, Source("patch", CHANGED), Limits())
    assert not isinstance(texts, list), texts
    so_far, findings = read_flown(Source("flown.csv", flown(4)), before.checked.mission, ())
    assert so_far is not None, findings
    found = replan(before, Request(so_far, texts=texts, clock=Seconds(60.0)), Limits())
    assert found.ok, found.findings
    return dict(found.files)

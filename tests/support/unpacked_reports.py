"""Reports of missions with hand-made motion, with their packed data decoded."""

from __future__ import annotations

import base64
import json
from itertools import accumulate, pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from missionc.base.source import Source
from missionc.base.trace import Plan, Trace
from missionc.compiler.front_end import ANY_BACKEND, check
from missionc.geometry.curves.piecewise_polynomials import COLUMNS
from missionc.output.folder.file_names import SIMULATION_SCHEMA
from missionc.output.report.pack import FAR, PER_METRE
from missionc.output.report.report_html import Plotted
from missionc.verification.verify_plan import verify
from tests.support.legal_plans import Array, straight

RELAY = """\
mission relay
time step 1 s, horizon 4 s
world (0, 0) to (10, 10)
region base = box (0, 0) to (2, 2)
region far  = box (6, 0) to (10, 2)
team drone[3] {
  radius   0.1 m
  dynamics single_integrator(speed <= 5 m/s)
  start    in base
}
graph radio = proximity 4 m
require goal: some drone: eventually[0, 3 s] far
require chain: every drone: always[0, 4 s] (far implies true reach[hops 0..2 on radio] base)
prefer calm: always[0, 4 s] not (drone[0]: far)
"""
"""Drone 0 reaches ``far`` at step 2 in ``MOTION``, and drone 1 is between it and drone 2 in ``base``."""

MOTION = [
    [[1.0, 1.0], [4.0, 1.0], [8.0, 1.0], [8.0, 1.0], [8.0, 1.0]],
    [[1.5, 1.5], [3.0, 1.5], [4.5, 1.5], [4.5, 1.5], [4.5, 1.5]],
    [[0.5, 0.5], [1.0, 0.5], [1.5, 0.5], [1.5, 0.5], [1.5, 0.5]],
]


def plotted(
    text: str, motion: Array | list[list[list[float]]], flights: dict[str, str] | None = None, simulation: str = ""
) -> Plotted:
    """Report data for a mission and a motion, (agents, steps + 1, dim), metres."""
    checked = check(Source("sample.mission", text), backend=ANY_BACKEND)
    assert checked.mission is not None, checked.findings
    assert checked.kernel is not None, checked.findings
    mission, kernel = checked.mission, checked.kernel
    trace: Trace = straight(motion, mission.step)
    plan = Plan(mission.name, "smt", 0, trace, ())
    certificate = verify(mission, kernel, trace)
    return Plotted(
        mission, kernel, plan, certificate, flights or {}, (("sample.mission", text),), simulation=simulation
    )


def flight(path: Array) -> str:
    """Polynomials that move straight from place to place, one second each: (steps + 1, 2), metres."""
    rows = [",".join(COLUMNS)]
    for start, end in pairwise(path):
        axes = [[value, change, *[0.0] * 6] for value, change in zip(start, end - start, strict=True)]
        rows.append(",".join(f"{number:.9g}" for number in [1.0, *axes[0], *axes[1], 1.0, *[0.0] * 15]))
    return "\n".join(rows) + "\n"


def simulation(motion: Array, off: float) -> str:
    """Output of ``simulate`` for drones ``off`` metres above ``flight``, at 25 Hz.

    Motion: (agents, steps + 1, 2), metres.
    """
    times = np.arange(25 * (motion.shape[1] - 1) + 1) / 25
    steps = np.arange(motion.shape[1])
    names = [f"drone[{agent}]" for agent in range(len(motion))]
    paths = [[*(np.interp(times, steps, axis) for axis in own.T), np.full(times.size, 1.0 + off)] for own in motion]
    document = {
        "schema": SIMULATION_SCHEMA,
        "engine": "quadrotor",
        "planned": [{"name": "goal", "robustness": 0.2}],
        "requirements": [{"name": "goal", "satisfied": True, "robustness": 0.1}],
        "tracking": [{"agent": name, "allowed": 0.05, "most": off, "at": 1.0} for name in names],
        "room": [{"subject": "all pairs", "margin": 0.3, "at": 0.0, "agents": names[:2]}],
        "flight": {
            "samples_per_second": 25,
            "agents": {name: np.round(path, 4).tolist() for name, path in zip(names, paths, strict=True)},
        },
    }
    return json.dumps(document)


def unpacked(text: str) -> NDArray[np.int64]:
    """Numbers given to ``pack``, (numbers,), decoded digit by digit."""
    way, *rest = base64.b64decode(text)
    bits = 7 if way & 4 else 3
    digits = rest if way & 4 else [half for byte in rest for half in (byte & 15, byte >> 4)]
    if not way & 4 and digits[-1:] == [15]:
        digits.pop()
    numbers: list[int] = []
    stream = iter(digits)

    def number(digit: int) -> int:
        value, shift = 0, 0
        while digit >> bits:
            value, shift = value | (digit & ((1 << bits) - 1)) << shift, shift + bits
            digit = next(stream)
        return value | digit << shift

    for digit in stream:
        code = number(digit)
        numbers += [0] * number(next(stream)) if code == 0 else [-(code + 1) // 2 if code % 2 else code // 2]
    for _ in range(way & 3):
        numbers = list(accumulate(numbers))
    return np.array(numbers, dtype=np.int64)


def metres(text: str, rows: int) -> Array:
    """Values of the packed rows, (rows, steps + 1), metres."""
    numbers = unpacked(text).reshape(rows, -1)
    return np.where(np.abs(numbers) >= FAR, np.sign(numbers) * np.inf, numbers / PER_METRE)


def lane(report: dict[str, Any], words: str) -> dict[str, Any]:
    """Values of the first lane with these words."""
    number = next(each["row"] for each in report["lanes"] if each["words"] == words)
    row: dict[str, Any] = report["rows"][number]
    return row


def links(runs: str) -> list[tuple[int, ...]]:
    return [tuple(each) for each in unpacked(runs).reshape(4, -1).T.tolist()]

"""Benchmark of flight proofs in continuous time: ``python bench/flight_proof.py``.

The flights last 15 s: drones circle around the points of a grid, with two polynomial pieces a second, the profile of a
Crazyflie and an adjacent obstacle. They are fitted as by ``missionc compile``, and read back from the text. Seconds are
processor time. The proof is compared with two other methods for pairs of agents: exact fractions, and samples at
intervals of a millisecond, which prove nothing.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from fractions import Fraction
from itertools import combinations, pairwise
from math import comb

import numpy as np

from missionc import ir
from missionc.base.source import Source, Span
from missionc.base.trace import Trace
from missionc.base.units import Metres, Seconds, Steps
from missionc.flight.trajectories.crazyflie import Flyable, crazyflie
from missionc.geometry.curves.piecewise_polynomials import Curves, Pieces, motion, read, values
from missionc.ir.kernel.nodes import Kernel
from missionc.ir.vehicle_profiles import profiles
from missionc.output.documents.certificate_json import certificate_json
from missionc.verification.check_certificate import check_certificate
from missionc.verification.flight.continuity_and_fidelity import check_flight, tube
from missionc.verification.flight.joint_claims import Flight, downwash, obstacles, separation, world
from missionc.verification.flight.verify_polynomials import limits
from missionc.verification.proof.branch_and_bound import branch_and_bound
from missionc.verification.proof.proof_boxes import boxes_of, fault
from missionc.verification.verify_plan import verify_polynomials

STEP, STEPS, APART = 0.5, 30, 0.8
NOTHING = Kernel((), ())
SPAN = Span(Source("bench", ""), 0, 0)


def flown(agents: int, seed: int) -> tuple[ir.Mission, Trace, dict[str, str]]:
    """Mission, plan that swings about a grid, and its polynomials."""
    generator = np.random.default_rng(seed)
    side = int(np.ceil(np.sqrt(agents)))
    grid = np.stack(np.unravel_index(np.arange(agents), (side, side)), axis=-1) * APART + 1.0
    home = np.concatenate([grid, np.full((agents, 1), 1.0)], axis=-1)
    times = STEP * np.arange(STEPS + 1)
    angle = generator.uniform(0, 2 * np.pi, agents)[:, None] + 1.2 * times
    swing = 0.15 * np.minimum(1.0, np.minimum(times, times[-1] - times) / 2)
    offset = np.stack([swing * np.cos(angle), swing * np.sin(angle), 0.3 * swing * np.sin(2 * angle)], axis=-1)
    position = home[:, None] + offset
    velocity = np.diff(position, axis=1) / STEP
    trace = Trace(
        Seconds(STEP), position, np.concatenate([velocity, velocity[:, -1:]], axis=1), np.zeros(position.shape[:2])
    )
    vehicle = profiles()["crazyflie21"]
    team = tuple(
        ir.Agent(
            index,
            f"cf[{index}]",
            "cf",
            Metres(0.1),
            ir.SingleIntegrator(1.0),
            ir.InitialSet(SPAN, tuple(position[index, 0].tolist())),
            None,
            Metres(1.0),
            SPAN,
            vehicle,
        )
        for index in range(agents)
    )
    size = side * APART + 1.5
    pillar = ir.Obstacle("pillar", ir.Disc((0.6, 0.6), 0.1, ir.Prism(0.0, 2.5)), ir.Still(), SPAN)
    mission = ir.Mission(
        name="bench",
        step=Seconds(STEP),
        steps=Steps(STEPS),
        world=ir.World((0.0, 0.0, 0.0), (size, size, 2.5), SPAN),
        regions=(),
        obstacles=(pillar,),
        beacons=(),
        agents=team,
        teams=(),
        groups=(),
        graphs=(),
        formations=(),
        separation=Metres(0.1),
        clearance=Metres(0.0),
        requirements=(),
        preferences=(),
        objective=ir.Objective.NONE,
        solve=ir.SolveWith(),
        span=SPAN,
    )
    found = crazyflie(mission, NOTHING, trace)
    if not isinstance(found, Flyable):
        raise SystemExit(f"{found.message}: {found.notes}")
    return mission, trace, found.files


def seconds(work: Callable[[], object], best_of: int) -> float:
    """Processor seconds, the minimum of ``best_of`` runs."""
    found = []
    for _ in range(best_of):
        begin = time.process_time()
        work()
        found.append(time.process_time() - begin)
    return min(found)


def in_fractions(flight: Flight, need: float) -> int:
    """Prove all pairs in exact numbers: squared distances in Bernstein form, halved if necessary."""
    durations = [Fraction(number) for number in flight.durations.tolist()]
    points = [
        [
            [_bernstein([Fraction(number) for number in axis], duration) for axis in piece[:3]]
            for piece, duration in zip(own, durations, strict=True)
        ]
        for own in flight.coefficients.tolist()
    ]
    square, halvings = Fraction(need) ** 2, 0
    for first, second in combinations(points, 2):
        for own, other in zip(first, second, strict=True):
            between = [[x - y for x, y in zip(*axes, strict=True)] for axes in zip(own, other, strict=True)]
            waiting = [_squared(between)]
            while waiting:
                polynomial = waiting.pop()
                if min(polynomial[0], polynomial[-1]) < square:
                    raise AssertionError("the pair is too near")
                if min(polynomial) < square:
                    waiting += _halved(polynomial)
                    halvings += 1
    return halvings


def _bernstein(powers: list[Fraction], duration: Fraction) -> list[Fraction]:
    scaled = [number * duration**power / comb(7, power) for power, number in enumerate(powers)]
    return [sum(comb(i, j) * scaled[j] for j in range(i + 1)) for i in range(8)]


def _squared(points: list[list[Fraction]]) -> list[Fraction]:
    weighted = [[comb(7, index) * point for index, point in enumerate(axis)] for axis in points]
    sums = [Fraction(0)] * 15
    for axis in weighted:
        for i, one in enumerate(axis):
            for j, other in enumerate(axis):
                sums[i + j] += one * other
    return [total / comb(14, index) for index, total in enumerate(sums)]


def _halved(points: list[Fraction]) -> list[list[Fraction]]:
    before, after = [points[0]], [points[-1]]
    while len(points) > 1:
        points = [(x + y) / 2 for x, y in pairwise(points)]
        before.append(points[0])
        after.append(points[-1])
    return [before, after[::-1]]


def in_samples(flight: Flight) -> float:
    """Minimum distance of any pair at moments 1 ms apart, metres."""
    curves = Curves(flight.times, flight.coefficients[:, :, :3])
    when = np.arange(0.0, flight.times[-1], 1e-3)
    piece = np.clip(np.searchsorted(flight.times, when, side="right") - 1, 0, flight.durations.size - 1)
    local = np.broadcast_to(when - flight.times[piece], (len(flight.coefficients), when.size))
    places = values(curves.coefficients[:, piece], local)
    least = np.inf
    for first in range(1, len(places)):
        least = min(least, float(np.linalg.norm(places[:first] - places[first], axis=-1).min()))
    return least


def measure(agents: int, best_of: int, fractions: bool) -> None:
    mission, trace, files = flown(agents, seed=0)
    certificate = verify_polynomials(mission, NOTHING, trace, files)
    failed = [f"{check.name} {check.margin:.4g} {check.unit}" for check in certificate.failures]
    pieces = [own for own in map(read, files.values()) if isinstance(own, Pieces)]
    planned = motion(mission, trace)

    def flight() -> Flight:
        whole = Flight(pieces[0].duration, np.stack([own.coefficients for own in pieces]))
        assert whole.position.degree == 7
        assert whole.speed.shape == (agents, whole.durations.size)
        return whole

    whole = flight()
    text = certificate_json(certificate, "0" * 64)
    plan = [tube(mission, agent, own, planned) for agent, own in zip(mission.agents, pieces, strict=True)]
    prove = lambda claims: [boxes_of(claim, branch_and_bound(claim)) for claim in claims]  # noqa: E731
    parts: dict[str, Callable[[], object]] = {
        "reading": lambda: [read(file) for file in files.values()],
        "joints, rest, waypoints": lambda: [
            check_flight(mission, agent, own, planned) for agent, own in zip(mission.agents, pieces, strict=True)
        ],
        "tube": lambda: prove(plan),
        "positions and speeds": flight,
        "world": lambda: prove([world(mission, whole)]),
        "obstacle": lambda: prove(obstacles(mission, whole, strict=True)),
        "pairs": lambda: prove(separation(mission, whole, strict=True)),
        "downwash": lambda: prove(downwash(mission, whole)),
        "limits": lambda: prove(limits(mission, whole)),
        "all of it": lambda: verify_polynomials(mission, NOTHING, trace, files),
        "boxes checked once more": lambda: [fault(boxes) for boxes in certificate.boxes],
        "certificate read and compared": lambda: check_certificate(text, "0" * 64, certificate),
        "pairs, samples at 1 ms": lambda: in_samples(whole),
    }
    count = sum(len(bounds) for boxes in certificate.boxes for bounds in boxes.bounds)
    print(f"{agents} drones, {trace.step * STEPS:g} s, {whole.durations.size} pieces:", end=" ")
    print(f"{', '.join(failed) or 'proved'}; {count} boxes, certificate of {len(text) / 1e6:.2f} MB")
    apart = next(check for check in certificate.checks if check.name == "flown separation")
    print(f"  separation proved with a margin of {apart.margin:.6f} m at {apart.at:.2f} s")
    for name, work in parts.items():
        print(f"  {name:32} {seconds(work, best_of):8.3f} s")
    if fractions:
        print(f"  {'pairs, exact fractions':32} {seconds(lambda: in_fractions(whole, 0.3), 1):8.3f} s")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--agents", type=int, nargs="*", default=[3, 30])
    parser.add_argument("--best-of", type=int, default=3)
    parser.add_argument(
        "--no-fractions", action="store_true", help="skip the exact fractions, which take minutes for 30 drones"
    )
    given = parser.parse_args()
    for agents in given.agents:
        measure(agents, given.best_of, not given.no_fractions)


if __name__ == "__main__":
    main()

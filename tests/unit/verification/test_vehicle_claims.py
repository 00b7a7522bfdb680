"""What vehicles' profiles claim of a flight, to the number, by pieces of which one derivative is constant."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from missionc import ir
from missionc.base.trace import Array
from missionc.verification.certificate import Check
from missionc.verification.flight.joint_claims import Flight
from missionc.verification.flight.verify_polynomials import check_endurance, check_memory, limits
from missionc.verification.proof.branch_and_bound import Claim
from tests.support.legal_plans import mission_of


def team(*vehicles: ir.Vehicle, dimension: int = 3) -> ir.Mission:
    made = mission_of([(1.0 + index, 1.0, 1.0)[:dimension] for index in range(len(vehicles))], 4)
    agents = (replace(agent, vehicle=vehicle) for agent, vehicle in zip(made.agents, vehicles, strict=True))
    return replace(made, agents=tuple(agents))


def flight(agents: int, **more: Sequence[float]) -> Flight:
    """All fly alike, for half a second each: this velocity (x, y, z, yaw), this acceleration, this jerk; at 2 m."""
    own = np.zeros((agents, 3, 4, 8))
    own[:, :, 2, 0] = 2.0
    for order, name in enumerate(("velocity", "acceleration", "jerk"), start=1):
        values = np.array(more.get(name, (0.0,)))
        own[:, order - 1, : values.size, order] = values / math.factorial(order)
    return Flight(np.full(3, 0.5), own)


def claims(mission: ir.Mission, own: Flight) -> dict[str, Claim]:
    return {claim.name: claim for claim in limits(mission, own)}


def lowers(claim: Claim) -> Array:
    """(subjects, pieces): the bounds on whole pieces."""
    every = np.arange(claim.items)
    return claim.judge(every, claim.curve(every))[0].reshape(-1, claim.pieces)


def of(figure: str, *limits_of: object, **motion: Sequence[float]) -> tuple[Claim, Array]:
    """The claim of one limit, of vehicles with these figures and one without any."""
    vehicles = [replace(ir.PLAIN, **{figure: limit}) for limit in limits_of]  # type: ignore[arg-type]
    mission = team(vehicles[0], ir.PLAIN, *vehicles[1:])
    (claim,) = limits(mission, flight(1 + len(vehicles), **motion))
    assert claim.agents.tolist() == [[0], *([index + 1] for index in range(1, len(vehicles)))]
    assert (claim.subject, claim.tolerance, claim.gap) == ("vehicles", 1e-6, 1e-5)
    assert claim.times.tolist() == [0.0, 0.5, 1.0, 1.5]
    return claim, lowers(claim)


@pytest.mark.parametrize(
    ("figure", "name", "unit", "which", "motion", "piece", "size"),
    [
        ("speed", "speed", "m/s", "horizontally", {"velocity": (3.0, -4.0, 9.0, 8.0)}, 0, 5.0),
        ("vertical_speed", "vertical speed", "m/s", "vertically", {"velocity": (9.0, 9.0, -3.0, 8.0)}, 0, 3.0),
        ("acceleration", "acceleration", "m/s^2", "in any direction", {"acceleration": (3.0, -4.0, 12.0)}, 1, 13.0),
        ("jerk", "jerk", "m/s^3", "in any direction", {"jerk": (3.0, -4.0, 12.0)}, 2, 13.0),
        ("yaw_rate", "yaw rate", "rad/s", "about the vertical", {"velocity": (9.0, 9.0, 9.0, -2.0)}, 0, 2.0),
    ],
)
def test_nobody_exceeds_a_limit(
    figure: str, name: str, unit: str, which: str, motion: dict[str, Sequence[float]], piece: int, size: float
) -> None:
    claim, found = of(figure, 20.0, 1.0, **motion)
    assert (claim.name, claim.unit, claim.detail) == (f"flown {name}", unit, f"no vehicle exceeds its limit {which}")
    assert found[:, piece] == pytest.approx([20.0 - size, 1.0 - size], abs=1e-9)
    if piece == 0:
        assert found[:, 1:] == pytest.approx(np.array([[20.0] * 2, [1.0] * 2]), abs=1e-9)


def test_nobody_leans_further_than_it_may() -> None:
    claim, found = of("tilt", 1.0, 0.5, acceleration=(3.0, -4.0, 1.19))
    assert (claim.name, claim.unit) == ("flown tilt", "rad")
    assert claim.detail == "no vehicle exceeds its tilt limit"
    lean = math.atan2(5.0, 11.0)
    assert found == pytest.approx(np.array([[1.0, 1.0 - lean, 1.0], [0.5, 0.5 - lean, 0.5]]), abs=1e-9)


def test_thrust_is_in_multiples_of_the_weight() -> None:
    bands = ir.Band(0.5, 2.0), ir.Band(0.25, math.inf), ir.Band(0.0, 1.25)
    claim, found = of("thrust", *bands, acceleration=(9.81 * 0.9, 0.0, 9.81 * 0.2))
    assert (claim.name, claim.unit) == ("flown thrust", "g")
    assert claim.detail == "the thrust of every vehicle, in multiples of its weight, is in its range"
    assert found[:, 1] == pytest.approx([0.5, 1.25, -0.25], abs=1e-9)
    assert found[:, 0] == pytest.approx([0.5, 0.75, 0.25], abs=1e-9)


def test_a_band_from_nothing_without_an_end_is_none() -> None:
    assert limits(team(replace(ir.PLAIN, thrust=ir.Band(0.0, math.inf))), flight(1)) == []


def test_heights_are_in_their_bands() -> None:
    bands = ir.Band(1.75, 9.0), ir.Band(-math.inf, 3.5), ir.Band(0.5, math.inf), ir.Band(2.5, 2.75)
    claim, found = of("height", *bands, velocity=(9.0, 9.0, 1.0))
    assert (claim.name, claim.unit, claim.detail) == ("flown height", "m", "every vehicle is in its height range")
    # It rises to 2.5 m in the first piece.
    assert found == pytest.approx(np.array([[0.25] * 3, [1.0, 1.5, 1.5], [1.5] * 3, [-0.5, -0.5, -0.5]]), abs=1e-9)


def test_claims_are_in_the_order_of_the_profile() -> None:
    every = ir.Vehicle(
        "every", 0.1, 1.0, 1.0, 1.0, 1.0, 1.0, ir.Band(0.5, 2.0), 1.0, ir.Band(0.0, 9.0)
    )  # radius, speed, vertical_speed, acceleration, jerk, tilt, thrust, yaw_rate, height
    names = ["speed", "vertical speed", "acceleration", "jerk", "yaw rate", "tilt", "thrust", "height"]
    assert list(claims(team(every), flight(1))) == [f"flown {name}" for name in names]


# ------------------------------------------------------------------------------ memory and battery


@pytest.mark.parametrize(
    ("dimension", "pieces", "memory", "margin", "compressed"),
    [
        (3, 3, 396, 250, 146),
        (3, 3, 146, 0, 146),
        (3, 3, 145, -1, 146),
        (2, 3, 104, 0, 104),
        (2, 3, 103, -1, 104),
        (2, 1, 42, 0, 42),
    ],
)
def test_the_memory_of_each_vehicle_holds_its_pieces(
    dimension: int, pieces: int, memory: int, margin: float, compressed: int
) -> None:
    """A piece takes 132 bytes; compressed 45 in a volume, 31 in a plane, and 11 once."""
    mission = team(ir.PLAIN, ir.Vehicle("small", memory=memory), dimension=dimension)
    own = Flight(np.ones(pieces), np.zeros((2, pieces, 4, 8)))
    detail = f"{pieces} pieces need {132 * pieces} bytes, {compressed} compressed; the memory has {memory}"
    assert check_memory(mission, own) == [
        Check("memory", "drone[1]", float(margin), "bytes", 0.0, margin >= 0, None, ("drone[1]",), detail)
    ]


@pytest.mark.parametrize(("endurance", "margin"), [(2.0, 0.5), (1.5, 0.0), (1.0, -0.5)])
def test_a_flight_ends_before_the_battery_does(endurance: float, margin: float) -> None:
    mission = team(ir.PLAIN, ir.Vehicle("tired", endurance=endurance))
    detail = f"the polynomials last 1.5 s; the battery endurance is {endurance:g} s"
    assert check_endurance(mission, flight(2)) == [
        Check("endurance", "drone[1]", margin, "s", 0.0, margin >= 0, None, ("drone[1]",), detail)
    ]

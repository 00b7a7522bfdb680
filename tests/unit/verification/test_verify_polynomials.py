"""The verdict on written polynomials as a whole: two agents in a plane, that stand, or nearly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from missionc import ir
from missionc.base.trace import Trace
from missionc.base.units import Metres
from missionc.geometry.curves.piecewise_polynomials import Pieces, written
from missionc.ir.kernel.nodes import Always, Atom, Goal, Kernel
from missionc.verification.certificate import Certificate, Check, Figure
from missionc.verification.flight.verify_polynomials import verify_polynomials
from tests.support.legal_plans import NOTHING, SPAN, mission_of, still, straight

STARTS = (1.5, 1.0), (4.5, 1.0)
MISSION = mission_of(STARTS, 4, step=0.5)
"""2 s, at 1 m."""


def files(pieces: int = 2, lasts: float = 2.0) -> list[Pieces]:
    made = []
    for start in STARTS:
        own = np.zeros((pieces, 4, 8))
        own[:, :3, 0] = *start, 1.0
        made.append(Pieces(np.full(pieces, lasts / pieces), own))
    return made


def trace() -> Trace:
    return straight([[start] * 5 for start in STARTS], 0.5)


def judged(own: Sequence[Pieces], mission: ir.Mission = MISSION, kernel: Kernel = NOTHING) -> Certificate:
    texts = {agent.name: written(each) for agent, each in zip(mission.agents, own, strict=True)}
    return verify_polynomials(mission, kernel, trace(), texts)


def named(certificate: Certificate, name: str) -> Check:
    (found,) = (check for check in certificate.checks if check.name == name)
    return found


def with_vehicle(vehicle: ir.Vehicle, mission: ir.Mission = MISSION) -> ir.Mission:
    return replace(mission, agents=tuple(replace(agent, vehicle=vehicle) for agent in mission.agents))


def test_checks_come_in_their_order_with_boxes_for_what_is_along_the_flight() -> None:
    vehicle = ir.Vehicle("some", speed=1.0, downwash_radius=0.1, downwash_height=0.1, endurance=9.0)
    mission = replace(with_vehicle(vehicle), obstacles=(still(ir.Disc((8.0, 8.0), 0.5)),))
    found = judged(files(), mission)
    own = ["duration", "joints", "rest", "waypoints", "altitude", "yaw", "tube"]
    along = ["world", "obstacle", "separation", "downwash", "speed"]
    assert [check.name for check in found.checks] == [
        *["file"] * 2,
        *own * 2,
        "clock",
        *(f"flown {name}" for name in along),
        *["memory", "endurance"] * 0,
        *["memory"] * 2,
        *["endurance"] * 2,
    ]
    assert [boxes.claim.name for boxes in found.boxes] == ["tube", "tube", *(f"flown {name}" for name in along)]
    assert found.passed
    assert found.mission == "made"
    assert found.checks[:2] == tuple(
        Check(
            "file",
            name,
            0.0,
            "",
            0.0,
            True,
            agents=(name,),
            detail="header, columns, at least two rows, finite numbers, positive durations",
        )
        for name in ("drone[0]", "drone[1]")
    )
    assert found.checks[16] == Check(
        "clock", "polynomials", 0.0, "s", 0.0, True, detail="the durations of all files are equal"
    )
    assert found.warnings == ()


def test_a_file_that_cannot_be_read_is_all_that_is_said() -> None:
    found = verify_polynomials(MISSION, NOTHING, trace(), {"drone[0]": written(files()[0]), "drone[1]": "x"})
    assert [(check.name, check.passed, check.detail) for check in found.checks] == [
        ("file", True, "header, columns, at least two rows, finite numbers, positive durations"),
        ("file", False, "the first line is not the header"),
    ]
    assert found.checks[1] == Check(
        "file", "drone[1]", 0.0, "", 0.0, False, None, ("drone[1]",), "the first line is not the header"
    )


def test_files_of_other_durations_are_judged_no_further() -> None:
    first, _ = files()
    _, second = files(4)
    found = judged([first, second])
    assert found.checks[-1].name == "clock"
    assert not found.passed
    assert [boxes.claim.name for boxes in found.boxes] == ["tube", "tube"]


# ------------------------------------------------------------------------------ what is told, not refused


def test_bodies_closer_than_asked_but_apart_are_told() -> None:
    near = replace(MISSION, separation=Metres(3.0), clearance=Metres(0.5))
    walls = still(ir.Disc((1.5, 2.0), 0.5), "first"), still(ir.Disc((4.5, 4.0), 0.5), "second")
    found = judged(files(), replace(near, obstacles=walls))
    assert found.passed
    assert [check.detail for check in found.checks if check.name in ("flown obstacle", "flown separation")] == [
        "no bodies touch in continuous time",
        "every body has a clearance of 0.5 m in continuous time",
        "no bodies touch in continuous time",
    ]
    assert [round(check.margin, 3) for check in found.checks if "flown ob" in check.name] == [0.4, 1.9]
    assert found.warnings == (
        "in the trajectories, `drone[0]` comes within 0.400 m of `first` at 0.50 s, and the mission requires 0.5 m",
        "in the trajectories, `drone[0]` and `drone[1]` come within 2.800 m of each other at 0.00 s, and "
        "the mission requires 3 m",
    )
    details = [boxes.claim.detail for boxes in found.boxes if "flown ob" in boxes.claim.name]
    assert details == ["no bodies touch in continuous time", "every body has a clearance of 0.5 m in continuous time"]


def test_bodies_that_touch_are_refused_by_what_was_asked() -> None:
    found = judged(files(), replace(MISSION, obstacles=(still(ir.Disc((1.5, 1.5), 0.5)),), clearance=Metres(0.5)))
    check = named(found, "flown obstacle")
    assert (check.passed, check.detail) == (False, "every body has a clearance of 0.5 m in continuous time")
    assert found.warnings == ()


@pytest.mark.parametrize(("push", "told"), [(12.0, False), (12.125, True)])
def test_who_pushes_harder_than_standard_motors_is_told(push: float, told: bool) -> None:
    own = files()
    own[1].coefficients[1, 1, 2] = push / 2
    found = judged(own)
    assert found.figures == (
        Figure("peak speed", "drone[1]", push, "m/s", 2.0, ("drone[1]",)),
        Figure("peak acceleration", "drone[1]", push, "m/s^2", 1.0, ("drone[1]",)),
    )
    said = ("`drone[1]` accelerates at 12.1 m/s^2 at 1.00 s, above the 12 m/s^2 of a Crazyflie with standard motors",)
    assert found.warnings == (said if told else ())


def test_a_peak_is_found_within_a_piece_to_a_hundredth() -> None:
    """x = 2 t**2 - 2 t**3 / 3 in the second piece, whose speed 4 t - 2 t**2 is greatest at its end, 2 m/s."""
    own = files()
    own[0].coefficients[1, 0, 2:4] = 2.0, -2.0 / 3.0
    speed, push = judged(own).figures
    assert (speed.subject, speed.value, speed.at) == ("drone[0]", 2.0, 2.0)
    assert (push.value, push.at) == (4.0, 1.0)


def test_figures_are_rounded_to_a_thousandth() -> None:
    own = [replace(each, duration=np.array([0.12345, 1.87655])) for each in files()]
    own[1].coefficients[1, 1, 2] = 1.23456 / 2
    push = judged(own).figures[1]
    assert (push.value, push.at) == (1.235, 0.123)


@pytest.mark.parametrize(
    ("pieces", "vehicle", "told"),
    [(31, ir.PLAIN, False), (32, ir.PLAIN, True), (32, ir.Vehicle("large", memory=9999), False)],
)
def test_more_pieces_than_a_memory_holds_are_told(pieces: int, vehicle: ir.Vehicle, told: bool) -> None:
    mission = with_vehicle(vehicle)
    if told:
        # One of them has no vehicle of its own.
        mission = replace(mission, agents=(mission.agents[0], with_vehicle(ir.Vehicle("large")).agents[1]))
    said = (f"each trajectory has {pieces} pieces, but the memory of a Crazyflie holds 31 at a time",)
    assert judged(files(pieces), mission).warnings == (said if told else ())


# ------------------------------------------------------------------------------ requirements


def east_of(metres: float) -> Kernel:
    atom = Atom(ir.Compare(((1.0, ir.Coordinate(0)),), -metres, False))
    return Kernel((Goal("east", Always(atom, 0, 4), SPAN),), ())


def test_requirements_are_judged_where_the_polynomials_are_at_the_steps() -> None:
    own = files()
    own[0].coefficients[0, 0, 1] = -0.00390625
    own[0].coefficients[1, 0, :2] = 1.5 - 0.00390625, -0.00390625
    assert named(judged(own, kernel=east_of(1.0)), "flown requirement").margin == pytest.approx(0.4921875, abs=1e-9)
    check = named(judged(own, kernel=east_of(1.49609375)), "flown requirement")
    assert check == Check(
        "flown requirement",
        "east",
        check.margin,
        "m",
        1e-5,
        False,
        1.5,
        ("drone[0]",),
        "evaluated by the monitor on the polynomials at the sample times",
    )
    assert check.margin == pytest.approx(-0.00390625, abs=1e-9)


@pytest.mark.parametrize(("less", "passed"), [(-1e-3, True), (0.5e-5, True), (0.99e-5, True), (1.01e-5, False)])
def test_a_requirement_may_be_short_by_rounding(less: float, passed: bool) -> None:
    check = named(judged(files(), kernel=east_of(1.5 + less)), "flown requirement")
    assert check.margin == pytest.approx(-less, abs=1e-9)
    assert check.passed is passed

"""The checks of a whole flight to the number: agents that stand in their mission, and go straight to their pads."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from missionc import ir
from missionc.base.units import Metres
from missionc.geometry.curves.piecewise_polynomials import COLUMNS, Pieces, written
from missionc.verification.certificate import Certificate, Check, Figure
from missionc.verification.flight.verify_whole_flight import REST_TO_REST, as_one, verify_whole_flight
from missionc.verification.flight.way_missions import Stage, Ways
from tests.support.legal_plans import SPAN, mission_of, moving, still

VEHICLE = ir.Vehicle("made", tracking=0.125, vertical_speed=1.0)
STARTS = (1.0, 1.0, 1.0), (4.0, 1.0, 1.5)
PADS = (1.0, 5.0, 1.0), (4.0, 5.0, 1.5)
"""Where they hover above them."""

YAWS = 0.25, -2.0


def team(*, pads: Sequence[tuple[float, ...]] = PADS, **figures: float) -> ir.Mission:
    made = mission_of(STARTS, 4, step=2.0, separation=0.0)
    return replace(
        made,
        agents=tuple(
            replace(agent, vehicle=replace(VEHICLE, **figures), pad=ir.Pad(pad[:2], SPAN, hover=pad[2]))  # type: ignore[arg-type]
            for agent, pad in zip(made.agents, pads, strict=True)
        ),
    )


MISSION = team()


def straight(begin: Sequence[float], end: Sequence[float], seconds: float, yaw: float = 0.0) -> Pieces:
    """From rest to rest, in two pieces that last as long; all numbers are those of float32."""
    coefficients = np.zeros((2, 4, 8))
    whole = Polynomial(np.array(REST_TO_REST) / seconds ** np.arange(8))
    for axis, (here, there) in enumerate(zip(begin, end, strict=True)):
        for piece in (0, 1):
            shifted = (here + (there - here) * whole)(Polynomial([piece * seconds / 2, 1]))
            coefficients[piece, axis, : shifted.coef.size] = shifted.coef
    coefficients[:, 3, 0] = yaw
    assert (coefficients == coefficients.astype(np.float32)).all()
    return Pieces(np.full(2, seconds / 2), coefficients)


def middle(begin: Sequence[float], end: Sequence[float]) -> list[float]:
    return [(here + there) / 2 for here, there in zip(begin, end, strict=True)]


def flown() -> dict[str, Pieces]:
    """8 s."""
    return {f"drone[{index}]": straight(STARTS[index], STARTS[index], 8.0, YAWS[index]) for index in (0, 1)}


def way(stage: Stage, pads: Sequence[tuple[float, ...]] = PADS) -> dict[str, Pieces]:
    """4 s out, 8 s home."""
    found = {}
    for index, (start, pad) in enumerate(zip(STARTS, pads, strict=True)):
        begin, end = (pad, start) if stage is Stage.OUT else (start, pad)
        found[f"drone[{index}]"] = straight(begin, end, 4.0 if stage is Stage.OUT else 8.0, YAWS[index])
    return found


def texts(of: dict[str, Pieces]) -> dict[str, str]:
    return {name: written(own) for name, own in of.items()}


def ways(pads: Sequence[tuple[float, ...]] = PADS) -> Ways:
    return {stage: texts(way(stage, pads)) for stage in Stage}


def judged(mission: ir.Mission = MISSION, of: Ways | None = None) -> Certificate:
    return verify_whole_flight(mission, texts(flown()), ways() if of is None else of)


def named(certificate: Certificate, name: str) -> list[Check]:
    return [check for check in certificate.checks if check.name == name]


def changed(stage: Stage, name: str, piece: int, axis: int, power: int, by: float) -> Ways:
    own = way(stage)
    own[name].coefficients[piece, axis, power] += by
    return {**ways(), stage: texts(own)}


# ------------------------------------------------------------------------------ ways


def test_a_way_has_the_checks_of_a_flight_and_where_it_begins_ends_and_looks() -> None:
    found = judged()
    assert found.mission == "made"
    for word, lasts, yaw in (("out", 4.0, YAWS), ("home", 8.0, YAWS)):
        own = [check for check in found.checks if check.name.startswith(f"{word} ")]
        each = ["joints", "rest", "begin", "end", "yaw"]
        claims = ["flown world", "flown separation", "flown vertical speed"]
        assert [check.name for check in own] == [
            f"{word} {name}" for name in ["file"] * 2 + ["clock"] + each * 2 + claims
        ]
        assert [check.subject for check in own[:2]] == ["drone[0]", "drone[1]"]
        assert own[2] == Check(
            f"{word} clock", "polynomials", 0.0, "s", 0.0, True, detail="the durations of all files are equal"
        )
        for index in (0, 1):
            begin, end, nose = own[5 + 5 * index : 8 + 5 * index]
            who = f"drone[{index}]"
            (first, last) = (PADS, STARTS) if word == "out" else (STARTS, PADS)
            for check, at, place in ((begin, 0.0, first[index]), (end, lasts, last[index])):
                says = f"the path {check.name.split()[1]}s at ({', '.join(f'{value:g}' for value in place)})"
                exact = check.tolerance
                assert check == Check(check.name, who, check.margin, "m", exact, True, at, (who,), says)
                assert check.margin == pytest.approx(0.0, abs=1e-12)
                # By the largest number that a piece begins with, of 5 or 3 m, or 4 m.
                assert exact == pytest.approx(5e-6 if word == "out" else (3e-6, 4e-6)[index])
            says = f"the yaw is {yaw[index]:g} rad in continuous time"
            tolerance = 1e-6 * max(1.0, abs(yaw[index]))
            assert nose == Check(f"{word} yaw", who, nose.margin, "rad", tolerance, True, 0.0, (who,), says)
            assert nose.margin == pytest.approx(0.0, abs=1e-12)
        assert all(check.passed for check in own)
        assert [boxes.claim.name for boxes in found.boxes if boxes.claim.name.startswith(word)] == [
            f"{word} {name}" for name in claims
        ]
    assert not found.warnings


@pytest.mark.parametrize(
    ("stage", "change", "name", "margin", "tolerance"),
    [
        (Stage.OUT, ("drone[1]", 0, 0, 0, 0.0078125), "out begin", -0.0078125, 5e-6),
        (Stage.HOME, ("drone[0]", 1, 1, 0, -0.0078125), "home end", -0.0078125, 2.9921875e-6),
        (Stage.HOME, ("drone[0]", 1, 2, 1, 0.015625), "home end", -0.0625, 3e-6),
        (Stage.HOME, ("drone[0]", 0, 3, 0, 0.0078125), "home yaw", -0.0078125, 1e-6),
        (Stage.OUT, ("drone[1]", 1, 3, 0, -0.0078125), "out yaw", -0.0078125, 2e-6),
        (Stage.OUT, ("drone[1]", 1, 3, 1, 0.0078125), "out yaw", -0.015625, 2e-6),
    ],
)
def test_what_a_way_is_off_is_measured(
    stage: Stage, change: tuple[str, int, int, int, float], name: str, margin: float, tolerance: float
) -> None:
    found = judged(of=changed(stage, *change))
    wrong = {check.name: check for check in found.failures}
    assert wrong[name].margin == pytest.approx(margin, abs=1e-9)
    assert wrong[name].subject == change[0]
    assert wrong[name].tolerance == pytest.approx(tolerance)
    assert all(each.startswith(f"{stage.value} ") for each in wrong)


def test_a_way_whose_files_do_not_go_together_is_judged_no_further() -> None:
    other = way(Stage.OUT)
    other["drone[1]"] = straight(PADS[1], STARTS[1], 8.0)
    for own in (texts(other), {"drone[0]": ways()[Stage.OUT]["drone[0]"]}, {**ways()[Stage.OUT], "drone[0]": "x"}):
        found = judged(of={**ways(), Stage.OUT: own})
        out = [check for check in found.checks if check.name.startswith("out ")]
        assert [check.name for check in out] == ["out file", "out file", "out clock"]
        assert not out[2].passed
        assert [boxes.claim.name.split()[0] for boxes in found.boxes] == ["home"] * 3
    header = ",".join(COLUMNS)
    found = judged(of={**ways(), Stage.OUT: {"drone[1]": header}})
    detail = "the first line is not the header", "fewer than two complete rows"
    assert named(found, "out file") == [
        Check("out file", f"drone[{index}]", 0.0, "", 0.0, False, agents=(f"drone[{index}]",), detail=detail[index])
        for index in (0, 1)
    ]


def test_bodies_that_come_closer_than_the_mission_asks_are_told() -> None:
    found = judged(replace(MISSION, separation=Metres(3.0), obstacles=(still(ir.Ball((1.0, 3.0, 3.0), 0.5)),)))
    assert found.passed
    assert found.warnings == tuple(
        f"on the path {word}: in the trajectories, `drone[0]` and `drone[1]` come within 2.841 m of each other "
        "at 0.00 s, and the mission requires 3 m"
        for word in ("out", "home")
    )
    assert [check.detail for check in found.checks if "flown separation" in check.name] == [
        "no bodies touch in continuous time"
    ] * 2


def test_a_way_is_flown_by_the_missions_vehicles_among_its_obstacles() -> None:
    truck = moving(ir.Ball((1.0, 9.0, 1.0), 0.5), (0.0, 8.0, 12.0), [(0.0, 0.0, 0.0)] * 2 + [(0.0, -6.0, 0.0)], "truck")
    found = judged(replace(team(downwash_radius=2.0, downwash_height=0.5, speed=1.25), obstacles=(truck,)))
    failing = {check.name: check for check in found.failures}
    assert sorted(failing) == [
        "column separation",
        "home flown downwash",
        "home flown obstacle",
        "out flown downwash",
        "out flown speed",
    ]
    # 4 m in 4 s, at the peak 35/16 of that.
    assert failing["out flown speed"].margin == pytest.approx(1.25 - 35 / 16, abs=1e-2)
    # It is there at the end of the first half of the way home, where the agent is.
    assert failing["home flown obstacle"].at == pytest.approx(4.0, abs=0.6)


def test_a_way_beyond_all_measure_is_refused_without_a_warning(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("missionc.verification.proof.branch_and_bound.MOST_PARTS", 1000)
    own = way(Stage.OUT)
    for index, each in enumerate(own.values()):
        each.coefficients[:, :3, 1:] = 0.0
        each.coefficients[:, index, 7] = 3e38
    endless = {name: Pieces(np.full(2, 3e38), each.coefficients) for name, each in own.items()}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = judged(of={**ways(), Stage.OUT: texts(endless)})
    names = {check.name for check in found.failures}
    assert names >= {"out joints", "out end", "out flown world"}
    assert not any(name.startswith("home ") for name in names)


def test_what_grows_is_on_the_way_home_as_large_as_at_its_end() -> None:
    """The way home begins after 8 s, and lasts 8 s."""
    grows = replace(still(ir.Ball((1.0, 9.0, 1.0), 0.5), "grows"), growth=0.125)
    own = {check.name: check for check in judged(replace(MISSION, obstacles=(grows,))).checks}
    assert own["out flown obstacle"].margin == pytest.approx(4.0 - 0.5 - 0.225, abs=1e-3)
    assert own["home flown obstacle"].margin == pytest.approx(4.0 - 0.5 - 2.0 - 0.225, abs=1e-3)


def test_files_of_the_mission_that_cannot_be_read_are_all_that_is_said() -> None:
    found = verify_whole_flight(MISSION, {"drone[0]": written(flown()["drone[0]"])}, ways())
    detail = "the first line is not the header"
    assert found == Certificate(
        "made", (Check("file", "drone[1]", 0.0, "", 0.0, False, agents=("drone[1]",), detail=detail),)
    )


@pytest.mark.parametrize(("pads", "needed"), [(PADS, True), (STARTS, False)])
def test_a_way_that_is_not_there_is_one_that_nobody_needs(pads: Sequence[tuple[float, ...]], needed: bool) -> None:
    found = judged(team(pads=pads), {})
    detail = "the path is not needed, or there is one file for each agent"
    assert list(found.checks[:2]) == [
        Check(f"{word} way", "ways", 0.0, "", 0.0, not needed, detail=detail) for word in ("out", "home")
    ]
    # 3.3 s up, 8 s there, the mission, 2 s and 4 s down.
    assert found.figures == (Figure("whole flight", "floor to floor", 25.3, "s"),)


def test_a_whole_flight_is_told_to_a_millionth_of_a_second() -> None:
    longer = {name: replace(own, duration=np.array([2.7182817, 5.0])) for name, own in flown().items()}
    found = verify_whole_flight(team(pads=STARTS), texts(longer), {})
    assert found.figures == (Figure("whole flight", "floor to floor", 25.018282, "s"),)


# ------------------------------------------------------------------------------ columns


@pytest.mark.parametrize(
    ("pads", "margin", "who"),
    [
        (PADS, 0.875, 0),
        (((3.0, 5.0, 1.0), (0.5, 5.0, 1.5)), 0.375, 1),
        (((3.0, 5.0, 1.0), (9.75, 5.0, 1.5)), 0.125, 1),
        (((3.0, 0.5, 1.0), (6.0, 5.0, 1.5)), 0.375, 0),
        (((3.0, 9.75, 1.0), (6.0, 5.0, 1.5)), 0.125, 0),
        (((3.0, 9.9, 1.0), (6.0, 5.0, 1.5)), -0.025, 0),
        (((3.0, 5.0, 0.0625), (6.0, 5.0, 1.5)), 2.875, 0),
    ],
)
def test_every_pad_is_inside_the_world(pads: tuple[tuple[float, ...], ...], margin: float, who: int) -> None:
    (found,) = named(judged(team(pads=pads), {}), "column world")
    detail = "every pad is inside the world, with the fence inset and the tracking margin of its vehicle"
    assert found == Check(
        "column world", "world", found.margin, "m", 1e-6, margin > 0, None, (f"drone[{who}]",), detail
    )
    assert found.margin == pytest.approx(margin, abs=1e-6)


def test_who_rise_at_once_or_in_turns_keep_apart() -> None:
    block = still(ir.Box((0.0, 4.0, 0.0), (9.0, 6.0, 0.5)), "block")
    (found,) = named(judged(replace(MISSION, obstacles=(block,)), {}), "column separation")
    detail = "the agents take off and land together, with enough distance to all others"
    assert found == Check("column separation", "all pairs", found.margin, "m", 1e-6, True, None, ("drone[0]",), detail)
    assert found.margin == pytest.approx(3.0 - 0.2 - 0.25)
    # 0.5 m apart, too near for the downwash of both, but not for who stands beside them; and one hovers well above.
    near = team(pads=((1.0, 5.0, 3.5), (1.5, 5.0, 1.0)), downwash_radius=0.25, downwash_height=0.5)
    certificate = judged(near, {})
    (found,) = named(certificate, "column separation")
    assert (found.passed, found.agents) == (True, ("drone[0]",))
    assert found.detail == detail.replace("together", "in 2 turns")
    assert found.margin == pytest.approx(0.5 - 0.2 - 0.25)
    # Two turns of 3.5 m at 35/16 of 1 m/s up, and of 3.46 m down.
    assert certificate.figures[0].value == pytest.approx(2 * 7.7 + 8 + 8 + 2 + 2 * 7.6)


def test_of_those_who_cannot_rise_the_nearest_are_named() -> None:
    third = replace(MISSION.agents[1], index=2, name="drone[2]", pad=ir.Pad((1.25, 5.0), SPAN, hover=1.0))
    crowd = replace(MISSION, agents=(*MISSION.agents, third))
    files = {**texts(flown()), "drone[2]": written(flown()["drone[1]"])}
    (found,) = named(verify_whole_flight(crowd, files, {}), "column separation")
    detail = "the pads have enough horizontal distance, or the hover heights enough vertical distance"
    names = ("drone[0]", "drone[2]")
    assert found == Check("column separation", "all pairs", found.margin, "m", 1e-6, False, None, names, detail)
    assert found.margin == pytest.approx(0.25 - 0.2 - 0.25)


def test_one_agent_keeps_apart_from_nobody() -> None:
    alone = replace(MISSION, agents=MISSION.agents[:1])
    found = judged(alone)
    assert found.passed
    assert [len(named(found, name)) for name in ("out clock", "home clock", "column separation")] == [1, 1, 0]


DISC = ir.Disc((1.0, 7.0), 0.5, ir.Prism(0.0, 3.0))


def rows(mission: ir.Mission, of: Ways | None = None) -> list[tuple[object, ...]]:
    checks = judged(mission, of).checks
    return [
        (check.name, check.subject, round(check.margin, 2), check.agents[0])
        for check in checks
        if check.name in ("rise obstacle", "sink obstacle")
    ]


@pytest.mark.parametrize(("clearance", "need"), [(0.0, 0.225), (0.5, 0.6)])
def test_a_column_keeps_clear_of_what_stands(clearance: float, need: float) -> None:
    other = ir.Disc((4.0, 8.0), 0.5, ir.Prism(0.0, 3.0))
    mission = replace(MISSION, clearance=Metres(clearance), obstacles=(still(DISC, "first"), still(other, "second")))
    found = [check for check in judged(mission).checks if check.name in ("rise obstacle", "sink obstacle")]
    detail = "every body avoids the obstacle on the vertical path above its pad"
    assert found == [
        Check(name, subject, each.margin, "m", 5e-3, True, None, (who,), detail)
        for each, (name, subject, who) in zip(
            found,
            [
                ("rise obstacle", "first", "drone[0]"),
                ("rise obstacle", "second", "drone[1]"),
                ("sink obstacle", "first", "drone[0]"),
                ("sink obstacle", "second", "drone[1]"),
            ],
            strict=True,
        )
    ]
    assert [check.margin for check in found] == pytest.approx([1.5 - need, 2.5 - need] * 2, abs=3e-3)


def test_what_moves_is_where_it_is_while_they_rise_and_sink() -> None:
    """They rise until 4 s before the mission, and sink from 16 s on, for 2 s and 4 s."""
    comes = moving(DISC, (0.0, 16.0, 26.0), [(0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, -1.0, 0.0)], "comes")
    goes = moving(DISC, (0.0, 4.0, 15.5, 16.5), [(0.0, 1.0, 0.0)] + [(0.0, -1.0, 0.0)] * 2 + [(0.0, 1.0, 0.0)], "goes")
    assert rows(replace(MISSION, obstacles=(comes, goes))) == [
        ("rise obstacle", "comes", pytest.approx(1.5 - 0.225, abs=0.011), "drone[0]"),
        ("rise obstacle", "goes", pytest.approx(2.5 - 0.225, abs=0.011), "drone[0]"),
        ("sink obstacle", "comes", pytest.approx(0.9 - 0.225, abs=0.011), "drone[0]"),
        ("sink obstacle", "goes", pytest.approx(1.5 - 0.225, abs=0.011), "drone[0]"),
    ]


def test_what_grows_is_as_large_as_at_the_end_of_either() -> None:
    grows = replace(still(DISC, "grows"), growth=0.03125, age=8.0)
    assert rows(replace(MISSION, obstacles=(grows,))) == [
        ("rise obstacle", "grows", pytest.approx(1.5 - 0.225 - 0.125, abs=0.011), "drone[0]"),
        ("sink obstacle", "grows", pytest.approx(1.5 - 0.225 - 30 * 0.03125, abs=0.011), "drone[0]"),
    ]


def test_in_two_turns_it_takes_twice_as_long_to_sink() -> None:
    near = ((1.0, 5.0, 3.5), (1.5, 5.0, 1.0))
    grows = replace(still(DISC, "grows"), growth=0.015625)
    mission = team(pads=near, downwash_radius=0.25, downwash_height=0.5)
    # 16 s, 2 s, and twice 7.6 s.
    assert rows(replace(mission, obstacles=(grows,)), ways(near))[1] == (
        "sink obstacle",
        "grows",
        pytest.approx(1.5 - 0.225 - 33.2 * 0.015625, abs=0.011),
        "drone[0]",
    )


def test_who_has_risen_rises_no_more() -> None:
    pads = [
        replace(agent.pad, risen=risen) for agent, risen in zip(MISSION.agents, (5.0, 7.0), strict=True) if agent.pad
    ]
    agents = (
        replace(agent, pad=pad, vehicle=replace(VEHICLE, endurance=30.0 - agent.index), begins=((0.0,) * 4,))
        for agent, pad in zip(MISSION.agents, pads, strict=True)
    )
    mission = replace(MISSION, agents=tuple(agents), obstacles=(still(DISC, "first"),))
    certificate = judged(mission, {Stage.HOME: ways()[Stage.HOME]})
    assert [row[0] for row in rows(mission, {Stage.HOME: ways()[Stage.HOME]})] == ["sink obstacle"]
    # Its ways begin at rest, however the mission does.
    assert [check.name for check in certificate.checks[:6]] == [
        "out way",
        *["home file"] * 2,
        "home clock",
        "home joints",
        "home rest",
    ]
    assert not named(certificate, "home begins")
    # The mission, the way home, 2 s and 4 s.
    assert certificate.figures == (Figure("whole flight", "floor to floor", 22.0, "s"),)
    detail = "after 7 s of the mission, the flight lasts 22 s until landing; the battery endurance is {} s"
    assert named(certificate, "whole endurance") == [
        Check("whole endurance", "drone[0]", 1.0, "s", 0.0, True, None, ("drone[0]",), detail.format("30")),
        Check("whole endurance", "drone[1]", 0.0, "s", 0.0, True, None, ("drone[1]",), detail.format("29")),
    ]


@pytest.mark.parametrize(("endurance", "margin"), [(37.5, 0.2), (37.0, -0.3)])
def test_everybody_is_on_the_floor_before_its_battery_is_empty(endurance: float, margin: float) -> None:
    first, second = MISSION.agents
    tired = replace(first, vehicle=replace(VEHICLE, endurance=endurance))
    certificate = judged(replace(MISSION, agents=(tired, second)))
    # 3.3 s up, 8 s there, 4 s out, 8 s, 8 s home, 2 s and 4 s down.
    assert certificate.figures == (Figure("whole flight", "floor to floor", 37.3, "s"),)
    (found,) = named(certificate, "whole endurance")
    detail = f"the flight lasts 37.3 s from takeoff to landing; the battery endurance is {endurance:g} s"
    assert found == Check(
        "whole endurance", "drone[0]", found.margin, "s", 0.0, margin > 0, None, ("drone[0]",), detail
    )
    assert found.margin == pytest.approx(margin)


# ------------------------------------------------------------------------------ as one


def test_ways_and_mission_are_one_flight() -> None:
    whole, before, aloft = as_one(MISSION, texts(flown()), ways())
    assert list(whole) == ["drone[0]", "drone[1]"]
    assert (before, aloft) == pytest.approx((4.0, 3.3 + 8.0))
    for index, own in enumerate(whole.values()):
        assert own.duration.tolist() == [2.0, 2.0, 4.0, 4.0, 4.0, 4.0]
        there = [PADS[index], middle(PADS[index], STARTS[index]), *[STARTS[index]] * 3]
        assert own.coefficients[:, :3, 0].tolist() == [[*each] for each in [*there, middle(PADS[index], STARTS[index])]]


def test_without_a_way_there_is_nothing_before_or_after() -> None:
    whole, before, aloft = as_one(MISSION, texts(flown()), {Stage.HOME: ways()[Stage.HOME]})
    assert (before, aloft) == pytest.approx((0.0, 3.3 + 8.0))
    assert whole["drone[1]"].duration.tolist() == [4.0] * 4
    in_the_air = replace(MISSION, agents=tuple(replace(agent, pad=None) for agent in MISSION.agents))
    whole, before, aloft = as_one(in_the_air, texts(flown()), {})
    assert (before, aloft) == (0.0, 0.0)
    assert whole["drone[0]"].coefficients.tolist() == flown()["drone[0]"].coefficients.tolist()

"""What is changed in a folder is refused with its reason, even where the manifest fits; so is what nobody proved."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from missionc import ir
from missionc.base.source import Source
from missionc.compiler import driver
from missionc.compiler.results import Verified
from missionc.tools.replay.reverify import Reverified, reverify
from missionc.verification.verify_plan import verify_polynomials
from tests.support.forged_folders import (
    Files,
    Table,
    bulged,
    bumped,
    changed,
    delayed,
    flights,
    forged,
    lengthened,
    stated,
    turned,
)
from tests.support.small_missions import SMALL

CORRIDOR = Path(__file__).resolve().parents[3] / "missions" / "crazyflie_corridor.mission"

GUARDED = """
mission guarded
time  step 1 s, horizon 8 s
world (0, 0, 0) to (6, 6, 2)
obstacle pillar = disc at (3, 3) radius 0.3 m
team cf[2] {
  dynamics single_integrator(speed <= 0.4 m/s)
  vehicle  crazyflie21 { speed <= 3 m/s  acceleration <= 9 m/s^2  jerk <= 200 m/s^3  tilt <= 60 deg  thrust 0..3 }
  start    at (1, 1, 1), (1, 5, 1)
  finish   at (2.5, 1, 1.2), (2.5, 5, 1.2)
}
"""

PLANS = [
    pytest.param("small"),
    pytest.param("guarded"),
    pytest.param("corridor", marks=pytest.mark.slow),
]


@cache
def compiled(name: str) -> driver.Compiled:
    text = {"small": SMALL, "guarded": GUARDED, "corridor": CORRIDOR.read_text()}[name]
    return driver.compile(Source("a.mission", text), overrides={})


def files_of(name: str) -> Files:
    outcome = compiled(name).outcome
    assert isinstance(outcome, Verified), compiled(name)
    return dict(outcome.files)


def failures(replayed: Reverified) -> set[str]:
    assert replayed.certificate is not None, replayed.findings
    return {check.name for check in replayed.certificate.failures}


def judged(name: str, files: Files, **figures: Any) -> set[str]:
    """What fails of the polynomials alone, flown by vehicles of other figures."""
    outcome, mission = compiled(name).outcome, compiled(name).checked.mission
    assert isinstance(outcome, Verified)
    assert mission is not None
    kernel = compiled(name).checked.kernel
    assert kernel is not None
    agents = tuple(replace(agent, vehicle=replace(agent.vehicle, **figures)) for agent in mission.agents)
    changed_mission = replace(mission, agents=agents)
    texts = [files[flight].decode() for flight in flights(files)]
    named = dict(zip((agent.name for agent in agents), texts, strict=True))
    return {check.name for check in verify_polynomials(changed_mission, kernel, outcome.plan.trace, named).failures}


def swapped(files: Files) -> Files:
    first, second = flights(files)[:2]
    return {**files, first: files[second], second: files[first]}


def of_first(change: Callable[[Table], Table]) -> Callable[[Files], Files]:
    return lambda files: changed(files, flights(files)[0], change)


def of_all(change: Callable[[Table], Table]) -> Callable[[Files], Files]:
    def apply(files: Files) -> Files:
        for name in flights(files):
            files = changed(files, name, change)
        return files

    return apply


MUTATIONS = {
    "a number bumped by one per cent": (of_first(bumped), {"joints"}),
    "two drones in each other's place": (swapped, {"waypoints", "tube"}),
    "one delayed by a tenth of a second": (of_first(delayed), {"clock", "waypoints"}),
    "all delayed by a tenth of a second": (of_all(delayed), {"waypoints"}),
    "a piece dropped": (
        of_first(lambda table: table[[*range(2), *range(3, len(table))]]),
        {"duration", "joints", "clock"},
    ),
    "a bulge that leaves the tube": (of_first(bulged), {"tube"}),
    "a duration off by a millisecond": (of_first(lengthened), {"duration", "clock"}),
    "a nose that points elsewhere": (of_first(turned), {"yaw"}),
    "all durations off by a millisecond": (of_all(lengthened), {"duration"}),
}


@pytest.mark.parametrize("name", PLANS)
def test_a_folder_that_was_not_changed_passes(name: str, tmp_path: Path) -> None:
    assert failures(reverify(forged(tmp_path, files_of(name)))) == set()


@pytest.mark.parametrize("name", PLANS)
@pytest.mark.parametrize("mutation", MUTATIONS)
def test_a_changed_flight_is_refused_with_the_reason(name: str, mutation: str, tmp_path: Path) -> None:
    change, reasons = MUTATIONS[mutation]
    files = change(files_of(name))
    assert reasons <= judged(name, files)
    replayed = reverify(forged(tmp_path, files))
    assert reasons <= failures(replayed)
    assert "manifest" not in failures(replayed)
    (finding,) = replayed.findings
    assert any(reason in note for note in finding.notes for reason in reasons)


def test_a_bulge_is_nothing_but_a_bulge() -> None:
    assert "joints" not in judged("guarded", of_first(bulged)(files_of("guarded")))


def test_a_limit_that_was_tightened_afterwards_is_refused(tmp_path: Path) -> None:
    files = files_of("guarded")
    text = files["mission/a.mission"].decode()
    files["mission/a.mission"] = text.replace("acceleration <= 9 m/s^2", "acceleration <= 0.1 m/s^2").encode()
    replayed = reverify(forged(tmp_path, files))
    assert failures(replayed) == {"flown acceleration"}
    (finding,) = replayed.findings
    assert any(note.startswith("flown acceleration of vehicles (cf[") for note in finding.notes)


@pytest.mark.parametrize(
    ("figures", "reason"),
    [
        ({"speed": 0.1}, "flown speed"),
        ({"vertical_speed": 0.01}, "flown vertical speed"),
        ({"acceleration": 0.01}, "flown acceleration"),
        ({"jerk": 0.01}, "flown jerk"),
        ({"tilt": 1e-4}, "flown tilt"),
        ({"thrust": ir.Band(0.0, 1.0)}, "flown thrust"),
        ({"thrust": ir.Band(0.9999, 3.0)}, "flown thrust"),
        ({"height": ir.Band(1.1, 2.0)}, "flown height"),
        ({"height": ir.Band(0.0, 1.1)}, "flown height"),
        ({"pair_distance": 4.5}, "flown separation"),
        ({"tracking": 2.0}, "flown separation"),
        ({"tracking": 2.0}, "flown obstacle"),
        ({"tracking": 0.99}, "flown world"),
        ({"start_skew": 20.0, "pair_distance": 3.5}, "flown separation"),
        ({"fence_inset": 0.99}, "flown world"),
        ({"downwash_radius": 2.5, "downwash_height": 0.3}, "flown downwash"),
        ({"memory": 500}, "memory"),
        ({"endurance": 1.0}, "endurance"),
    ],
)
def test_a_profile_that_the_flight_exceeds_is_refused(figures: dict[str, Any], reason: str) -> None:
    own = files_of("guarded")
    assert judged("guarded", own) == set()
    assert reason in judged("guarded", own, **figures)


# ------------------------------------------------------------ the certificate


def row(certificate: dict[str, Any], check: str) -> dict[str, Any]:
    return next(row for row in certificate["boxes"] if row["check"] == check)


def nicer(certificate: dict[str, Any]) -> None:
    check = next(check for check in certificate["checks"] if check["name"] == "flown separation")
    check["margin"] += 0.01


def wrong(certificate: dict[str, Any]) -> None:
    row(certificate, "flown separation")["bounds"][0][0] += 10.0


def shortened(certificate: dict[str, Any]) -> None:
    row(certificate, "flown world")["ends"][0][-1] -= 1


def gapped(certificate: dict[str, Any]) -> None:
    box = row(certificate, "flown world")
    box["ends"][0][0] = 0.5


def lost(certificate: dict[str, Any]) -> None:
    box = row(certificate, "flown world")
    del box["ends"][-1], box["bounds"][-1]


def backwards(certificate: dict[str, Any]) -> None:
    box = row(certificate, "flown world")
    box["ends"][0][1:1] = [3, 1]
    box["bounds"][0][1:1] = [box["bounds"][0][0]] * 2


def uncut(certificate: dict[str, Any]) -> None:
    box = row(certificate, "flown world")
    box["ends"][0][1:1] = [0.3]
    box["bounds"][0][1:1] = [box["bounds"][0][0]]


def worse(certificate: dict[str, Any]) -> None:
    row(certificate, "flown world")["bounds"][0][0] = -5.0


def others(certificate: dict[str, Any]) -> None:
    row(certificate, "flown separation")["agents"][0] = [1, 0]


def left_out(certificate: dict[str, Any]) -> None:
    certificate["checks"] = [check for check in certificate["checks"] if check["name"] != "joints"]


def unproved(certificate: dict[str, Any]) -> None:
    certificate["boxes"] = [row for row in certificate["boxes"] if row["check"] != "flown separation"]


def faster(certificate: dict[str, Any]) -> None:
    figure = next(each for each in certificate["figures"] if each["name"] == "peak acceleration")
    figure["value"] /= 2


def silent(certificate: dict[str, Any]) -> None:
    certificate["warnings"] = ["all is well"]


def steadier(certificate: dict[str, Any]) -> None:
    certificate["between_steps"] = [{"requirement": "none", "verdict": "holds throughout"}]


def later(certificate: dict[str, Any]) -> None:
    certificate["delays"][0]["tolerated"] += 1.0


def another(certificate: dict[str, Any]) -> None:
    certificate["plan_sha256"] = "0" * 64


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (nicer, "flown separation of all pairs: its `margin` is"),
        (wrong, "flown separation of all pairs: the bound of its box at 0.00 s does not hold"),
        (shortened, "flown world of world: its boxes do not cover the flight"),
        (gapped, "flown world of world: its boxes do not cover the flight"),
        (lost, "flown world of world: it has boxes for 1 subjects instead of 2"),
        (backwards, "flown world of world: its boxes do not cover the flight in order"),
        (uncut, "flown world of world: its boxes do not cover the flight in order"),
        (worse, "flown world of world: its boxes do not prove its margin"),
        (others, "flown separation of all pairs: its boxes do not match the agents of the mission"),
        (left_out, "its checks and figures do not match"),
        (unproved, "boxes are missing for a check along the flight"),
        (faster, "peak acceleration of"),
        (silent, "its warnings are incomplete"),
        (steadier, "its verdicts between samples"),
        (later, "its delay tolerances"),
        (another, "its `plan_sha256` does not match the folder"),
        (lambda certificate: certificate.clear(), "not a certificate"),
    ],
)
def test_a_certificate_that_states_too_much_is_refused(
    change: Callable[[dict[str, Any]], None], reason: str, tmp_path: Path
) -> None:
    replayed = reverify(forged(tmp_path, stated(files_of("guarded"), change)))
    assert failures(replayed) == {"certificate"}
    (finding,) = replayed.findings
    assert any(note.startswith(f"file `certificate.json`: {reason}") for note in finding.notes), finding.notes


@pytest.mark.parametrize(
    "content", [b"", b"[" * 100_000, b"\xff", b'{"schema": "missionc.certificate/2", "boxes": [1]}']
)
def test_a_certificate_that_is_none_is_refused(content: bytes, tmp_path: Path) -> None:
    files = {**files_of("guarded"), "certificate.json": content}
    assert failures(reverify(forged(tmp_path, files))) == {"certificate"}


@pytest.mark.parametrize(("less", "passes"), [(1e-5, True), (0.01, False)])
def test_a_proved_margin_may_be_less_by_what_a_proof_may_fall_short(less: float, passes: bool, tmp_path: Path) -> None:
    def modest(certificate: dict[str, Any]) -> None:
        check = next(check for check in certificate["checks"] if check["name"] == "flown separation")
        check["margin"] -= less
        box = row(certificate, "flown separation")
        box["bounds"][0] = [bound - less / 2 for bound in box["bounds"][0]]

    assert reverify(forged(tmp_path, stated(files_of("guarded"), modest))).passed is passes


def test_the_same_flight_gets_the_same_certificate() -> None:
    again = driver.compile(Source("a.mission", GUARDED), overrides={}).outcome
    assert isinstance(again, Verified)
    assert dict(again.files)["certificate.json"] == files_of("guarded")["certificate.json"]

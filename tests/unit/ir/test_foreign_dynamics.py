"""Dynamics of extensions: their words in missions, plans within their bounds, and rules that plans are judged by."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import missionc
from missionc.backends.api import BackendExtension, Budget, Outcome, Planned, Report
from missionc.backends.features import Feature
from missionc.backends.options import Options
from missionc.base.source import Source
from missionc.base.trace import Trace
from missionc.cli.app import main
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from tests.support.installed_packages import package, source_package

EXAMPLE = Path(__file__).resolve().parents[3] / "examples" / "extension"
CAR = "car(speed 0.5..1 m/s, steering <= 30 deg, wheelbase <= 0.4 m)"
MISSION = """mission drive
time step 1 s, horizon 8 s
world (0, 0) to (10, 6)
region goal = box (5, 1) to (9, 5)
team cart[1] {
  radius   0.2 m
  dynamics DYNAMICS
  start    at (1, 1)
}
require arrive: every cart: eventually[0, 8 s] goal
"""
GENTLE = '''
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from missionc.extension import Dynamics

INTERFACE = 1


@dataclass(frozen=True)
class Gentle(Dynamics):
    """The speed changes by at most 0.2 m/s from one step to the next."""

    word: ClassVar = "gentle"
    rules: ClassVar = ("change of speed",)
    speed: float

    @classmethod
    def of(cls, slowest, fastest, *limits):
        return cls(fastest)

    @property
    def top_speed(self):
        return self.speed

    def at_most(self, speed, acceleration):
        return Gentle(min(self.speed, speed))

    def step_margins(self, position, heading, step):
        speeds = np.linalg.norm(np.diff(position, axis=0), axis=1) / step
        return {"change of speed": (0.2 - np.abs(np.diff(speeds)), "m/s")}
'''

pytestmark = pytest.mark.usefixtures("roadmaps_alone")


class Steps(BackendExtension):
    """The cart moves along a diagonal at these speeds, m/s."""

    name = "steps"
    features = frozenset({Feature.EXTENSION_RULES})

    def __init__(self, *speeds: float) -> None:
        self.speeds = speeds

    def plan(self, mission: Mission, kernel: Kernel, options: Options, budget: Budget) -> Outcome:
        way = np.array([1.0, 0.5]) / np.hypot(1.0, 0.5)
        velocity = np.array([*self.speeds, self.speeds[-1]])[None, :, None] * way
        position = 1.0 + np.concatenate([np.zeros((1, 1, 2)), np.cumsum(velocity[:, :-1], axis=1)], axis=1)
        return Planned(Trace(mission.step, position, velocity, np.zeros(position.shape[:2])), Report())


@pytest.fixture
def carts(tmp_path: Path) -> Iterator[None]:
    with source_package(EXAMPLE, tmp_path / "site"):
        yield


@pytest.fixture
def gentle(tmp_path: Path) -> Iterator[None]:
    with package(tmp_path / "site", "gentle_robots", {"missionc.dynamics": {"gentle": "gentle_robots:Gentle"}}, GENTLE):
        yield


def text(dynamics: str) -> Source:
    return Source("drive.mission", MISSION.replace("DYNAMICS", dynamics))


@pytest.mark.usefixtures("carts")
def test_a_car_is_planned_within_its_bounds_verified_and_monitored(tmp_path: Path) -> None:
    file, folder = tmp_path / "drive.mission", tmp_path / "out"
    file.write_text(text(CAR).text, encoding="utf-8")
    assert main(["compile", str(file), "--backend", "smt", "-o", str(folder)]) == 0
    assert main(["verify", str(folder)]) == 0
    assert main(["monitor", str(file), str(folder / "plan.json")]) == 0
    plan = missionc.compile(file, backend="smt").outcome
    assert isinstance(plan, missionc.Verified)
    moves = np.diff(plan.plan.trace.position[0], axis=0)
    speeds, turns = np.linalg.norm(moves, axis=1), np.diff(np.unwrap(np.arctan2(moves[:, 1], moves[:, 0])))
    assert np.all((speeds >= 0.5 - 1e-6) & (speeds <= 1 + 1e-6))
    assert np.all(np.abs(turns) <= 2 * np.arcsin(0.5 * np.tan(np.pi / 6) / 0.4 / 2) + 1e-6)


@pytest.mark.usefixtures("carts")
@pytest.mark.parametrize(
    ("dynamics", "code", "says"),
    [
        ("car(speed <= 1 m/s, steering <= 30 deg, wheelbase <= 0.4 m)", "MC210", "a car that stands still cannot turn"),
        ("car(speed 0.5..1 m/s, steering <= 30 deg)", "MC014", "the wheelbase of `car`"),
        ("car(speed 0.5..1 m/s, steering <= 30 deg, wheelbase <= 1 s)", "MC201", "a length"),
        ("car(speed 0.5..1 m/s, steering <= 30 deg, wheelbase <= 0.4 m, wheels <= 4)", "MC206", "`wheels`"),
        ("cart(speed 0.5..1 m/s)", "MC206", "`cart`"),
    ],
)
def test_wrong_settings_are_reported_at_their_place(dynamics: str, code: str, says: str) -> None:
    found = [each for each in missionc.check(text(dynamics)).findings if each.primary is not None]
    assert [each.code.name for each in found] == [code]
    assert says in f"{found[0].message} {found[0].help}"


@pytest.mark.usefixtures("gentle")
def test_a_rule_is_planned_by_a_backend_that_offers_it_alone() -> None:
    compiled = missionc.compile(text("gentle(speed <= 1 m/s)"))
    assert [each.code.name for each in compiled.findings] == ["MC402"]
    assert "dynamics with rules of an extension rules out `smt`, `clot` and `hybrid`" in str(compiled.findings[0])


@pytest.mark.usefixtures("gentle")
@pytest.mark.parametrize(("speeds", "passes"), [((0.5, 0.7, 0.9, 1, 1, 0.8, 0.6, 0.4), True), ((1,) * 7 + (0,), False)])
def test_a_rule_is_verified_of_each_plan(speeds: tuple[float, ...], passes: bool) -> None:
    compiled = missionc.compile(text("gentle(speed <= 1 m/s)"), backend=Steps(*speeds))
    if passes:
        assert isinstance(compiled.outcome, missionc.Verified)
        checks = [check for check in compiled.outcome.certificate.checks if check.name == "rule"]
        assert [round(check.margin, 9) for check in checks] == [0.0]
        return
    assert [each.code.name for each in compiled.findings] == ["MC570"]
    assert compiled.findings[0].notes == ("rule cart[0]: margin -0.8 m/s, the rule `change of speed` of `gentle`",)


@pytest.mark.usefixtures("gentle")
def test_a_rule_of_a_recorded_flight_is_not_judged_and_that_is_reported(tmp_path: Path) -> None:
    compiled = missionc.compile(text("gentle(speed <= 1 m/s)"), backend=Steps(0.5, 0.7, 0.9, 1, 1, 1, 1, 1))
    plan = tmp_path / "plan.json"
    plan.write_bytes(dict(compiled.files)["plan.json"])
    monitored = missionc.monitor(text("gentle(speed <= 1 m/s)"), plan)
    assert [each.names for each in monitored.not_judged] == [("change of speed",)]


@pytest.mark.parametrize(
    ("before", "after", "says"),
    [
        ("class Gentle(Dynamics)", "class Gentle", "extends `Dynamics`"),
        ("def at_most", "def at_least", "its class has no `at_most`"),
        ('"gentle"', '"calm"', "its `word` is not `gentle`"),
    ],
)
def test_a_class_that_is_no_kind_of_dynamics_is_refused(before: str, after: str, says: str, tmp_path: Path) -> None:
    entries = {"missionc.dynamics": {"gentle": "gentle_robots:Gentle"}}
    with package(tmp_path / "site", "gentle_robots", entries, GENTLE.replace(before, after)):
        found = missionc.check(text("gentle(speed <= 1 m/s)")).findings
    assert [each.code.name for each in found] == ["MC410"]
    assert says in found[0].message

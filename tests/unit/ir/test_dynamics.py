"""Steering between states in whole steps."""

from __future__ import annotations

import ast
import math
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from missionc.geometry.dynamics import (
    ACCELERATION,
    DRIFT,
    SPEED,
    States,
    can_wait,
    check_step,
    headings_along,
    path_between,
    steer,
    turn_in_step,
)
from missionc.ir import DoubleIntegrator, Dynamics, SingleIntegrator, Unicycle
from missionc.ir.dynamics import DYNAMICS

ROOT = Path(__file__).resolve().parents[3]
KINDS = ROOT / "missionc/ir/dynamics"
EXPORTS = ROOT / "missionc/ir/__init__.py"

seeds = st.integers(0, 2**32 - 1)

FIRST_ORDER = [
    SingleIntegrator(1.5),
    Unicycle(0.0, 2.0, math.inf),
    Unicycle(1.0, 2.0, math.inf),
    Unicycle(1.0, 1.0, math.inf),
    Unicycle(1.0, 2.0, math.pi / 4),
    Unicycle(0.5, 2.0, 0.3),
]
SECOND_ORDER = [DoubleIntegrator(2.0, 1.0), DoubleIntegrator(1.0, 4.0)]


def places(*points: tuple[float, ...]) -> States:
    position = np.array(points, dtype=float)
    return States(position, np.zeros_like(position))


def some(seed: int, dim: int, speed: float) -> tuple[States, States]:
    generator = np.random.default_rng(seed)
    position = generator.uniform(0, 6, (2, 40, dim))
    velocity = generator.uniform(-1, 1, (2, 40, dim)) * speed / math.sqrt(dim)
    return States(position[0], velocity[0]), States(position[1], velocity[1])


def test_a_distance_of_one_step_takes_one_step() -> None:
    count, bend = steer(Unicycle(1.0, 2.0, math.inf), places((0, 0)), places((1.5, 0)), 1.0, 10)
    assert count.tolist() == [1]
    assert bend.tolist() == [0.0]


def test_a_long_way_takes_the_fewest_steps_the_top_speed_allows() -> None:
    count, _ = steer(SingleIntegrator(2.0), places((0, 0), (0, 0)), places((4, 0), (4.1, 0)), 1.0, 10)
    assert count.tolist() == [2, 3]


def test_a_place_too_near_for_the_least_speed_cannot_be_steered_to_straight() -> None:
    count, _ = steer(Unicycle(1.0, 2.0, math.inf), places((0, 0)), places((0.5, 0)), 1.0, 10)
    assert count.tolist() == [0]


def test_a_distance_between_two_whole_numbers_of_steps_cannot_be_steered_to() -> None:
    count, _ = steer(Unicycle(1.8, 2.0, math.inf), places((0, 0)), places((3.0, 0)), 1.0, 10)
    assert count.tolist() == [0]


def test_ways_longer_than_asked_are_of_no_interest() -> None:
    count, _ = steer(SingleIntegrator(1.0), places((0, 0)), places((5, 0)), 1.0, 4)
    assert count.tolist() == [0]


def test_an_agent_of_one_speed_comes_to_a_near_place_by_two_legs() -> None:
    dynamics = Unicycle(1.0, 1.0, math.inf)
    start, end = places((0, 0)), places((1.2, 0))
    count, bend = steer(dynamics, start, end, 1.0, 10, side=1)
    position, _ = path_between(dynamics, start, end, 1.0, 2, bend)
    assert count.tolist() == [2]
    assert np.allclose(position[0], [[0, 0], [0.6, -0.8], [1.2, 0]])


def test_rest_to_rest_takes_the_least_effort_in_closed_form() -> None:
    dynamics = DoubleIntegrator(10.0, 10.0)
    start, end = places((0, 0)), places((1, 0))
    position, velocity = path_between(dynamics, start, end, 1.0, 2, np.zeros(1))
    assert np.allclose(position[0, :, 0], [0, 0.5, 1])
    assert np.allclose(velocity[0, :, 0], [0, 1, 0])


def test_a_double_integrator_takes_as_many_steps_as_its_acceleration_asks_for() -> None:
    start, end = places((0, 0)), places((1, 0))
    assert steer(DoubleIntegrator(10.0, 1.0), start, end, 1.0, 20)[0].tolist() == [2]
    assert steer(DoubleIntegrator(10.0, 0.99), start, end, 1.0, 20)[0].tolist() == [3]
    assert steer(DoubleIntegrator(0.9, 1.0), start, end, 1.0, 20)[0].tolist() == [3]


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("dynamics", FIRST_ORDER, ids=str)
@given(seed=seeds, side=st.sampled_from([0, 1, -1]))
def test_every_step_of_a_first_order_way_obeys_the_dynamics(dynamics: Dynamics, dim: int, seed: int, side: int) -> None:
    start, end = some(seed, dim, 0.0)
    count, bend = steer(dynamics, start, end, 1.0, 12, side)
    for steps in np.unique(count[count > 0]):
        which = np.flatnonzero(count == steps)
        pair = start.take(which), end.take(which)
        position, velocity = path_between(dynamics, *pair, 1.0, int(steps), bend[which])
        assert np.allclose(position[:, 0], pair[0].position)
        assert np.array_equal(position[:, -1], pair[1].position)
        margin = check_step(dynamics, position[:, :-1], position[:, 1:], velocity[:, :-1], velocity[:, 1:], 1.0)
        assert min(each.min() for each in margin.values()) >= -1e-8
        way = np.diff(position, axis=1)
        heading = headings_along(*pair, int(steps), bend[which])
        assert np.allclose(np.exp(1j * np.arctan2(way[..., 1], way[..., 0])), np.exp(1j * heading), atol=1e-6)
        if math.isfinite(turn_in_step(dynamics, 1.0)):
            assert np.all(np.abs(np.diff(heading, axis=1)) <= turn_in_step(dynamics, 1.0) + 1e-9)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("dynamics", SECOND_ORDER, ids=str)
@given(seed=seeds)
def test_every_step_of_a_second_order_way_obeys_the_dynamics(dynamics: DoubleIntegrator, dim: int, seed: int) -> None:
    start, end = some(seed, dim, dynamics.speed)
    count, bend = steer(dynamics, start, end, 0.5, 40)
    assert np.any(count > 0)
    for steps in np.unique(count[count > 0]):
        which = np.flatnonzero(count == steps)
        pair = start.take(which), end.take(which)
        position, velocity = path_between(dynamics, *pair, 0.5, int(steps), bend[which])
        assert np.array_equal(position[:, -1], pair[1].position)
        assert np.array_equal(velocity[:, -1], pair[1].velocity)
        margin = check_step(dynamics, position[:, :-1], position[:, 1:], velocity[:, :-1], velocity[:, 1:], 0.5)
        assert min(each.min() for each in margin.values()) >= -1e-9


@given(seed=seeds)
def test_no_other_accelerations_between_the_same_states_have_less_effort(seed: int) -> None:
    dynamics = DoubleIntegrator(2.0, 1.0)
    start, end = some(seed, 2, 1.0)
    _, velocity = path_between(dynamics, start, end, 1.0, 5, np.zeros(40))
    accelerations = np.diff(velocity, axis=1)
    # What changes neither end: the kernel of the two conditions on the five accelerations.
    conditions = np.stack([np.ones(5), 4.5 - np.arange(5)])
    kernel = np.linalg.svd(conditions)[2][2:]
    assert np.allclose(np.einsum("ks,psd->pkd", kernel, accelerations), 0, atol=1e-9)


def test_only_dynamics_that_allow_speed_zero_can_wait() -> None:
    assert can_wait(SingleIntegrator(1.0))
    assert can_wait(DoubleIntegrator(1.0, 1.0))
    assert can_wait(Unicycle(0.0, 2.0, math.inf))
    assert not can_wait(Unicycle(1.0, 2.0, math.inf))


def test_a_step_that_is_too_quick_too_slow_or_too_strong_has_a_negative_margin() -> None:
    still, there = np.zeros(2), np.array([3.0, 0.0])
    assert check_step(SingleIntegrator(2.0), still, there, still, still, 1.0) == {SPEED: pytest.approx(-1.0)}
    assert check_step(Unicycle(1.0, 2.0, math.inf), still, there / 6, still, still, 1.0) == {SPEED: pytest.approx(-0.5)}
    double = DoubleIntegrator(4.0, 2.0)
    assert check_step(double, still, there / 2, still, there, 1.0)[ACCELERATION] == pytest.approx(-1.0)
    assert check_step(double, still, there, still, there / 3, 1.0)[DRIFT] == pytest.approx(-2.5)


def test_half_a_turn_in_a_step_is_no_bound() -> None:
    assert turn_in_step(Unicycle(1.0, 2.0, math.pi), 1.0) == math.inf
    assert turn_in_step(Unicycle(1.0, 2.0, 1.0), 0.5) == 0.5
    assert turn_in_step(SingleIntegrator(1.0), 1.0) == math.inf


def words_of(path: Path) -> set[str]:
    """Every name and every text in a module."""
    words: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        match node:
            case ast.Name(id=word) | ast.Attribute(attr=word) | ast.alias(name=word) | ast.Constant(value=str(word)):
                words.add(word)
            case _:
                pass
    return words


def test_no_module_asks_which_kind_of_dynamics_an_agent_has() -> None:
    named = {kind.__name__ for kind in DYNAMICS} | {kind.word for kind in DYNAMICS}
    inside = [path for path in (ROOT / "missionc").rglob("*.py") if path.parent == KINDS or path == EXPORTS]
    assert named <= set().union(*map(words_of, inside))
    functions = {ROOT / "missionc" / "__init__.py", ROOT / "missionc" / "frontend" / "builder" / "items.py"}
    assert {kind.word for kind in DYNAMICS} <= words_of(ROOT / "missionc" / "frontend" / "builder" / "items.py")
    others = set((ROOT / "missionc").rglob("*.py")) - set(inside) - functions
    assert len(others) > 400
    assert {str(path.relative_to(ROOT)): found for path in others if (found := words_of(path) & named)} == {}


CART = """\
\"\"\"The cart: a velocity chosen anew in every step, and a gentle turn between two.\"\"\"

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

from missionc.base.units import Dimension
from missionc.ir.dynamics.kinds import Dynamics, Limit


@dataclass(frozen=True, slots=True)
class Cart(Dynamics):
    word: ClassVar[str] = "cart"
    limits: ClassVar[tuple[Limit, ...]] = (Limit("steering", Dimension.TURN, "the steering rate"),)
    faces_ahead: ClassVar[bool] = True

    speed: float
    steering: float

    @classmethod
    def of(cls, slowest: float, fastest: float, *limits: float) -> Cart:
        return cls(fastest, *limits)

    @property
    def top_speed(self) -> float:
        return self.speed

    @property
    def top_turn(self) -> float:
        return self.steering

    def at_most(self, speed: float, acceleration: float) -> Cart:
        return replace(self, speed=min(self.speed, speed))
"""

DELIVERY = """\
mission delivery
time step 1 s, horizon 20 s
world (0, 0) to (10, 8)
region shop = box (7, 5) to (9, 7)
team van[1] { radius 0.2 m  dynamics cart(speed <= 1 m/s, steering <= 60 deg/s)  start at (1, 1) }
require deliver: eventually[0, 20 s] every van: shop
"""


def test_a_kind_of_dynamics_is_one_new_file_and_its_name_in_the_registration(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "missionc", tmp_path / "missionc", ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("grammars", "docs"):
        (tmp_path / name).symlink_to(ROOT / name)
    (tmp_path / "missionc/ir/dynamics/cart.py").write_text(CART, encoding="utf-8")
    registration = tmp_path / "missionc/ir/dynamics/__init__.py"
    text = registration.read_text(encoding="utf-8")
    first = "from missionc.ir.dynamics.kinds"
    text = text.replace(first, f"from missionc.ir.dynamics.cart import Cart\n{first}")
    registration.write_text(text.replace("Unicycle)", "Unicycle, Cart)"), encoding="utf-8")
    (tmp_path / "delivery.mission").write_text(DELIVERY, encoding="utf-8")
    compiling = [sys.executable, "-m", "missionc", "compile", "delivery.mission", "--backend", "smt", "-o", "plan"]
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    run = subprocess.run(compiling, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert run.returncode == 0, run.stdout + run.stderr
    certificate = (tmp_path / "plan/certificate.json").read_text(encoding="utf-8")
    assert '"turn"' in certificate
    showing = [sys.executable, "-m", "missionc", "compile", "delivery.mission", "--emit", "ir"]
    shown = subprocess.run(showing, cwd=tmp_path, env=environment, capture_output=True, text=True, check=True)
    assert "cart speed <= 1 m/s steering <= 1.04719" in shown.stdout

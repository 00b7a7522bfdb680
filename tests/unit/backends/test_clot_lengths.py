"""Lengths in metres for the transport backend: plans that keep them, relays that go where they are needed."""

from __future__ import annotations

import numpy as np
import pytest

from missionc.ir.kernel.nodes import RouteNode

pytest.importorskip("torch")

from missionc.backends.clot.optimise.active_set import Stretch
from missionc.backends.clot.optimise.residuals import rows
from missionc.base.source import Source
from missionc.base.trace import Array
from missionc.base.units import Seconds
from missionc.compiler import driver
from missionc.compiler.results import Verified
from tests.support.transport_missions import costs_and_demand

FIELD = """\
mission far
time step 0.5 s, horizon 8 s
world (0, 0) to (14, 8)
region base = box (0.5, 0.5) to (2.5, 3)
region fire = box (10, 3) to (12, 5)
region field = box (4, 5) to (7, 7.5)
team drone[3] { radius 0.1 m  dynamics single_integrator(speed <= 3 m/s)  start in base }
graph radio = proximity 4.2 m
"""

RELAYED = """\
require stay: drone[0]: always[0, 8 s] base
require go:   drone[2]: eventually[0, 8 s] (fire and somewhere[distance <= 11 m on radio] drone[0])
"""

KEPT = {
    "a reach between bounds": (
        "require far: drone[2]: always[6 s, 8 s] (drone reach[distance 5 m..6 m on radio] drone[0])"
    ),
    "nobody near": "require alone: drone[1]: always[5 s, 8 s] not somewhere[distance 0.1 m..3 m on radio] drone",
    "everywhere": (
        "require safe: drone[2]: always[0, 8 s] everywhere[distance <= 3 m on radio] not field\n"
        "require look: drone[1]: always[5 s, 6 s] field"
    ),
    "escape": "require out: drone[0]: always[6 s, 7 s] escape[distance 5 m..6 m on radio] drone",
    "count": "require some: drone[0]: always[4 s, 6 s] count[distance 2 m..5 m on radio] drone >= 2",
    "surround": (
        "require ring: drone[0]: always[4 s, 5 s] (base surround[distance <= 3 m on radio] field)\n"
        "require out: drone[1]: always[4 s, 5 s] not base"
    ),
}


def verified(text: str, *, seed: int = 0, backend: str = "clot") -> Verified:
    found = driver.compile(Source("a.mission", text), backend=backend, seed=seed, time_limit=Seconds(3600))
    assert isinstance(found.outcome, Verified), found.outcome
    return found.outcome


def metres(position: Array, route: tuple[int, ...], step: int) -> float:
    return float(np.linalg.norm(np.diff(position[list(route), step], axis=0), axis=-1).sum())


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("dynamics", ["", "double"])
def test_a_robot_that_nothing_else_is_asked_of_goes_between_two_that_are_too_far_apart(
    seed: int, dynamics: str
) -> None:
    text = FIELD + RELAYED
    if dynamics:
        text = text.replace(
            "single_integrator(speed <= 3 m/s)", "double_integrator(speed <= 3 m/s, acceleration <= 3 m/s^2)"
        )
    position = verified(text, seed=seed).plan.trace.position
    # `fire` is 7.5 m from `base` and a link bridges 4.2 m.
    there = [
        step
        for step in range(position.shape[1])
        if np.linalg.norm(position[2, step] - position[1, step]) < 4.2
        and np.linalg.norm(position[1, step] - position[0, step]) < 4.2
        and position[2, step, 0] >= 10
    ]
    assert there
    assert min(metres(position, (2, 1, 0), step) for step in there) <= 11


@pytest.mark.parametrize("name", KEPT)
def test_a_length_is_kept(name: str) -> None:
    assert verified(FIELD + KEPT[name] + "\n").certificate.passed


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("backend", ["clot", "hybrid"])
@pytest.mark.parametrize("name", KEPT)
def test_a_length_is_kept_with_any_seed(name: str, backend: str, seed: int) -> None:
    assert verified(FIELD + KEPT[name] + "\n", seed=seed, backend=backend).certificate.passed


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_a_chain_of_relays_is_found(seed: int) -> None:
    text = FIELD.replace("drone[3]", "drone[5]").replace("4.2 m", "2.4 m")
    asked = RELAYED.replace("drone[2]: eventually", "drone[4]: eventually")
    assert verified(text + asked, seed=seed).certificate.passed


@pytest.mark.parametrize("backend", ["smt", "hybrid"])
def test_hops_and_metres_are_planned_together(backend: str) -> None:
    text = FIELD + RELAYED + "require ends: drone[0]: always[6 s, 8 s] somewhere[hops 1..1 on radio] drone[1]\n"
    assert verified(text, backend=backend).plan.backend == backend


def test_bodies_cannot_be_asked_to_be_nearer_than_they_can_be() -> None:
    """Of what breaks a route from 0.1 m on, being shorter is nothing that a body of 0.1 m can do."""
    text = FIELD + "require alone: drone[1]: always[0, 8 s] not somewhere[distance 0.1 m..3 m on radio] drone\n"
    stretches = asked(text, np.array([[1.0, 1.0], [1.25, 1.0], [1.0, 1.25]]))
    assert stretches
    assert all(stretch.longer for stretch in stretches)


def asked(text: str, places: Array) -> list[Stretch]:
    """The lengths that have to hold of a team that stands still at these places."""
    costs, demand = costs_and_demand(text)
    position = np.repeat(places[:, None], costs.splines.steps + 1, axis=1)
    active = demand.active(position, np.zeros_like(position))
    return [stretch for stretches in active.lengths.values() for stretch in stretches]


@pytest.mark.parametrize("name", ["a reach between bounds", "nobody near", "count"])
@pytest.mark.parametrize("seed", range(3))
def test_the_gradient_of_a_length_is_what_small_differences_say(name: str, seed: int) -> None:
    costs, demand = costs_and_demand(FIELD + KEPT[name] + "\n")
    generator = np.random.default_rng(seed)
    shape = len(demand.mission.agents), demand.mission.steps + 1, 2
    control = costs.splines.through(generator.uniform((0, 0), (5, 4), shape))
    active = demand.active(*costs.splines.states(control))
    assert all(isinstance(node, RouteNode) for node in active.lengths)
    groups = [group for group in costs.groups(control, active) if group.name == "length on radio"]
    assert groups
    direction, tiny = generator.standard_normal(control.shape), 1e-6
    for group in groups:
        here, ahead, back = (rows(group, control + tiny * sign * direction) for sign in (0, 1, -1))
        if len(here.value) == len(ahead.value) == len(back.value):
            foretold = sum(
                (argument.of(direction) * gradient).sum(axis=1)
                for argument, gradient in zip(here.arguments, here.gradient, strict=True)
            )
            assert (ahead.value - back.value) / (2 * tiny) == pytest.approx(foretold, abs=1e-4)

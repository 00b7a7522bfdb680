"""Connectivity by λ₂, where a mission asks for it: its value, its slope, and what it makes of plans."""

from __future__ import annotations

import numpy as np
import pytest

nx = pytest.importorskip("networkx")

import missionc
from missionc.backends.clot.optimise.active_set import Active
from missionc.backends.clot.optimise.control_points import splines
from missionc.backends.clot.optimise.residuals import rows
from missionc.backends.clot.optimise.task_residuals import TaskCosts, link_weight, second_eigenvalue
from missionc.backends.clot.settings import Spare, Weights
from missionc.base.source import Source
from missionc.base.units import Seconds
from missionc.ir import Connected

AWAY = """\
mission away
time step 0.2 s, horizon 5 s
world (0, 0) to (12, 8)
region far = box (8, 3) to (11, 5)
team rover[5] {
  radius 0.1 m  dynamics single_integrator(speed <= 3 m/s)
  start at (1, 4), (1, 3), (2, 4), (2, 3), (2, 5)
}
graph radio = proximity 3 m
require link: always[0, 5 s] connected(radio)
require go:   rover[0]: eventually[0, 5 s] far
"""
BY_LAMBDA_2 = AWAY + "solve with clot { connectivity = lambda2 }\n"


def test_lambda_2_is_that_of_others_on_random_weighted_graphs() -> None:
    generator = np.random.default_rng(0)
    for members in range(2, 12):
        weight = np.triu(generator.uniform(0, 1, (3, members, members)) * (generator.random((3, 1, 1)) + 0.2), 1)
        weight += weight.swapaxes(1, 2)
        found = second_eigenvalue(weight)
        for each, value in zip(weight, found, strict=True):
            laplacian = nx.laplacian_matrix(nx.from_numpy_array(each)).toarray()
            assert value == pytest.approx(np.linalg.eigvalsh(laplacian)[1], abs=1e-9)


def test_lambda_2_of_smooth_weights_is_positive_exactly_where_the_graph_is_connected() -> None:
    generator = np.random.default_rng(1)
    seen = set()
    for _ in range(200):
        links = np.triu(generator.uniform(-0.6, 0.4, (5, 5)), 1)
        links += links.T
        weight = link_weight(links, 0.3)
        connected = nx.is_connected(nx.from_numpy_array((links > 0).astype(int)))
        assert (float(second_eigenvalue(weight)) > 1e-9) == connected
        seen.add(connected)
    assert seen == {True, False}


def test_its_slope_by_positions_is_that_of_differences() -> None:
    checked = missionc.check(Source("a.mission", BY_LAMBDA_2), backend="clot")
    assert checked.mission is not None
    mission = checked.mission
    made = splines(mission)
    costs = TaskCosts(mission, made, Weights(), Spare())
    margin = Connected(mission.graphs[0], (0, 1, 2, 3, 4))
    mask = np.zeros((5, mission.steps + 1), dtype=np.bool_)
    mask[0, 3] = True
    control = np.random.default_rng(2).uniform(1, 4, (5, made.points, 2))
    groups = list(costs.groups(control, Active(margins={(margin, True): mask})))
    (group,) = [each for each in groups if each.name == "connectivity of radio"]
    points = [each.of(control) for each in group.arguments]
    slopes = rows(group, control, near=np.inf).gradient
    assert max(float(np.abs(slope).max()) for slope in slopes) > 1e-3
    for number, slope in enumerate(slopes):
        for axis in range(2):
            ends = []
            for by in (1e-6, -1e-6):
                moved = [point.copy() for point in points]
                moved[number][0, axis] += by
                ends.append(float(group.shortfall(*moved)[0]))
            assert float(slope[0, axis]) == pytest.approx((ends[0] - ends[1]) / 2e-6, abs=1e-6)


def least(text: str) -> float:
    outcome = missionc.compile(Source("a.mission", text), backend="clot", time_limit=Seconds(3600)).outcome
    assert isinstance(outcome, missionc.Verified), outcome
    (figure,) = [each for each in outcome.certificate.figures if each.name == "connectivity"]
    return figure.value


def test_a_mission_planned_by_lambda_2_is_verified_and_better_connected() -> None:
    chain = 2 - 2 * np.cos(np.pi / 5)
    bottleneck, by_lambda_2 = least(AWAY), least(BY_LAMBDA_2)
    assert bottleneck >= chain - 1e-9
    assert by_lambda_2 > 1.3 * bottleneck


def test_what_connectivity_is_judged_by_is_a_word_that_is_known() -> None:
    wrong = missionc.check(Source("a.mission", BY_LAMBDA_2.replace("lambda2", "lamda2")))
    (finding,) = [each for each in wrong.findings if each.code.name == "MC206"]
    assert finding.message == "`connectivity` has no value `lamda2`"
    assert finding.help == "did you mean `lambda2`?"
    number = missionc.check(Source("a.mission", BY_LAMBDA_2.replace("lambda2", "2")))
    assert [each.code.name for each in number.findings] == ["MC206"]


CAVE = """\
mission cave
time  step 2 s, horizon 120 s
world (0, 0) to (40, 30)
obstacle rock = box (8, 10) to (40, 14)
region mouth = box (1, 1) to (8, 7)
region deep  = disc at (36, 24) radius 3 m
team r[4] { radius 0.3 m  dynamics single_integrator(speed <= 1.5 m/s)  start grid (2, 2) to (6, 6) }
graph radio = proximity 18 m
separation 0.2 m
require link: always[0, end] connected(radio)
require base: always[0, end] (some r: mouth)
require look: some r: eventually[0, 110 s] deep
"""


def test_relays_stand_along_the_way_round_what_stands() -> None:
    compiled = missionc.compile(Source("cave.mission", CAVE), backend="clot")
    assert isinstance(compiled.outcome, missionc.Verified)
    assert dict(compiled.outcome.report.sizes)["attempts"] == 1
    position = compiled.outcome.plan.trace.position
    gone = [agent for agent in position if (agent[:, 1] > 14).any()]
    assert len(gone) >= 2  # a relay has left the mouth by the same way as who looks
    assert not any(((agent[:, 0] > 10) & (agent[:, 1] > 7) & (agent[:, 1] < 10)).any() for agent in position)

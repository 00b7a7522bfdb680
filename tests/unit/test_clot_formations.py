"""Total tolerances for the transport backend: the sum of the errors counts, however it is shared."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("torch")

from missionc.backends.clot.optimise.residuals import rows
from missionc.backends.clot.optimise.task_residuals import shares
from missionc.ir import InFormation
from missionc.language.margins.predicate_margins import margin
from tests.support.random_runs import trace_of
from tests.support.transport_missions import costs_and_demand, planned

ROW = """\
mission row
time step 0.5 s, horizon 6 s
world (0, 0) to (12, 8)
team drone[4] { radius 0.1 m  dynamics single_integrator(speed <= 3 m/s)  start at (1, 1), (1, 3), (1, 5), (1, 7) }
formation row = chain of drone spacing 1 m total tolerance 0.3 m
"""

ONE_EDGE_OFF = """\
region left = box (4, 2) to (6, 6)
region right = box (7.15, 2) to (9, 6)
require held: always[5 s, 6 s] row
require apart: always[5 s, 6 s] ((drone[1]: left) and (drone[2]: right))
"""
"""Of three edges one has an error of at least 0.15 m: more than its third of 0.3 m."""

ALL_EDGES_OFF = """\
region a = box (4, 4) to (4.1, 4.1)
region b = box (5.15, 4) to (5.25, 4.1)
region c = box (6.3, 4) to (6.4, 4.1)
region d = box (7.45, 4) to (7.55, 4.1)
require never: always[5 s, 6 s] not row
require apart: always[5 s, 6 s] ((drone[0]: a) and (drone[1]: b) and (drone[2]: c) and (drone[3]: d))
"""
"""No edge has an error of 0.3 m; all together have 0.45 m where everybody is in the middle."""


@pytest.mark.parametrize("asked", [ONE_EDGE_OFF, ALL_EDGES_OFF], ids=["held", "not held"])
def test_one_edge_may_take_most_of_a_total_tolerance_and_all_together_break_it(asked: str) -> None:
    planned(ROW + asked)


@pytest.mark.parametrize(
    "edges", ["distances of drone (0-1: 1 m, 1-2: 1.5 m, 3-0: 2 m)", "offsets of drone (0, 0), (1, 0), (0, 1), (1, 1)"]
)
@pytest.mark.parametrize("word", ["", "not "])
@pytest.mark.parametrize("spread", [0.05, 1.0])
def test_what_the_edges_lack_together_is_what_the_sum_lacks(word: str, edges: str, spread: float) -> None:
    shape = f"formation odd = {edges} total tolerance 0.3 m\n"
    costs, demand = costs_and_demand(ROW + shape + f"require held: always[0, 6 s] {word}odd")
    (formation,) = (each for each in costs.mission.formations if each.name == "odd")
    control = np.zeros((4, costs.splines.points, 2))
    control[1:, :, 0] = 1.0
    control += np.random.default_rng(0).uniform(0.0, spread, control.shape)
    position, _ = costs.splines.states(control)
    active = demand.active(position, np.zeros_like(position))
    (group,) = (each for each in costs.groups(control, active) if each.name == f"{word}formation odd")
    here = rows(group, control, near=10.0)
    sign = 1.0 if word == "" else -1.0
    lacking = len(formation.edges) * group.spare - sign * margin(
        InFormation(formation), costs.mission, trace_of(position.tolist())
    )
    together = here.value.reshape(len(formation.edges), -1)
    assert np.allclose(together.sum(axis=0), lacking)
    assert (np.sign(together.max(axis=0)) == np.sign(lacking)).all()


def test_shares_sum_to_the_total_and_nothing_that_does_is_nearer() -> None:
    generator = np.random.default_rng(0)
    errors = generator.exponential(size=(4, 50))
    found = shares(errors, 1.5)
    assert (found >= 0).all()
    assert np.allclose(found.sum(axis=0), 1.5)
    others = generator.dirichlet(np.ones(4), size=(2000, 1)).swapaxes(1, 2) * 1.5
    assert (np.linalg.norm(found - errors, axis=0) <= np.linalg.norm(others - errors, axis=1) + 1e-9).all()

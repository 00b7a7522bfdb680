"""What has a plan is refused by no cover: motions at random, with missions that they are plans of."""

from __future__ import annotations

import time
from unittest.mock import patch

from hypothesis import HealthCheck, event, given, settings

from missionc.backends.api import Budget
from missionc.backends.cover import refute as module
from missionc.backends.cover.refute import Refuted, refute
from missionc.backends.run_account import Account
from missionc.verification.verify_plan import verify
from tests.support.motions_with_missions import Planned, on_a_grid, under_way

FEW = settings(
    max_examples=60, suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much], deadline=None
)


def admits(planned: Planned, cells: tuple[int, ...]) -> None:
    certificate = verify(planned.mission, planned.kernel, planned.trace)
    assert certificate.passed, certificate.failures
    with patch.object(module, "CELLS", cells):
        answer = refute(planned.mission, planned.kernel, Budget(time.monotonic() + 60, work=20.0), Account())
    event(type(answer).__name__)
    assert not isinstance(answer, Refuted), answer


@FEW
@given(on_a_grid())
def test_a_motion_on_a_grid_is_not_refused(planned: Planned) -> None:
    admits(planned, (6, 30))


@FEW
@given(under_way())
def test_a_motion_at_its_bounds_is_not_refused(planned: Planned) -> None:
    admits(planned, (5, 25, 90))

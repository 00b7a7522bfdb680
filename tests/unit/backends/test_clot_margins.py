"""Wider margins: a plan keeps away from borders by a share of their natural scales if that makes it little longer."""

from __future__ import annotations

import pytest

pytest.importorskip("torch")

from missionc.base.source import Source
from missionc.compiler import driver
from missionc.compiler.results import Verified
from missionc.verification.monitoring.normalised_margins import normalised_margins

ROUND = """
mission rounds
time step 1 s, horizon 24 s
world (0, 0) to (12, 8)
region left = box (0, 5) to (3, 8)
region right = box (9, 5) to (12, 8)
obstacle block = box (5, 4) to (7, 8)
team rover[2] { radius 0.2 m  dynamics single_integrator(speed <= 1.5 m/s)  start at (6, 1), (6, 2) }
require first: rover[0]: eventually[0, 12 s] left and eventually[12 s, 24 s] right
require second: rover[1]: eventually[0, 12 s] right and eventually[12 s, 24 s] left
"""


@pytest.mark.parametrize("backend", ["auto", "clot"])
@pytest.mark.parametrize("objective", ["", "minimize distance\n"])
def test_the_smallest_margin_is_a_share_of_its_scale_at_a_tenth_more_length(backend: str, objective: str) -> None:
    found = {}
    for scaled in (0.0, 0.18):
        compiled = driver.compile(
            Source("rounds.mission", ROUND + objective), backend=backend, settings={"clot.shortening.wide": str(scaled)}
        )
        assert isinstance(compiled.outcome, Verified), compiled.outcome
        trace, checked = compiled.outcome.plan.trace, compiled.checked
        margins = normalised_margins(checked.valid_mission, checked.valid_kernel.requirements, trace)
        found[scaled] = min(margins.values()), trace.metres
    (narrow, short), (wide, length) = found.values()
    assert narrow <= wide
    assert wide >= 0.149
    assert length <= 1.1 * short


CHOICE = """
mission choice
time step 1 s, horizon 12 s
world (0, 0) to (12, 8)
region narrow = box (9, 1) to (10, 2)
region wide = box (9, 4) to (11.4, 7)
obstacle block = box (4, 2) to (5, 4)
agent rover { radius 0.2 m  dynamics double_integrator(speed <= 2 m/s, acceleration <= 1 m/s^2)  start at (1, 3) }
require reach: rover: eventually[0, 12 s] (narrow or wide)
require edge: rover: always[0, 12 s] x <= 10.6
maximize robustness
"""


def test_the_robustness_of_a_plan_is_maximised_over_options_as_well() -> None:
    compiled = driver.compile(Source("choice.mission", CHOICE))
    assert isinstance(compiled.outcome, Verified), compiled.outcome
    least = min(each.robustness for each in compiled.outcome.plan.judgements)
    # In `wide`, halfway between its left side and the edge: (10.6 - 9) / 2; in `narrow`, half of its side.
    assert least == pytest.approx(0.8, rel=0.02)

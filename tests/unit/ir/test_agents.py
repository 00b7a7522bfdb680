"""Starts and finishes of agents as sets of positions."""

from __future__ import annotations

from dataclasses import replace

from missionc import ir
from missionc.ir.agents import ends_by_region
from tests.support.legal_plans import SPAN, mission_of

YARD = ir.Region("yard", ir.Box((0.0, 0.0), (2.0, 1.0)), SPAN)
IN_YARD = ir.InitialSet(SPAN, region=YARD)


def test_a_start_at_a_point_is_a_box_without_extent() -> None:
    start = ir.InitialSet(SPAN, (1.0, 2.5))
    assert start.shape == ir.Box((1.0, 2.5), (1.0, 2.5))
    assert str(start) == "at (1, 2.5)"


def test_a_start_in_a_region_has_the_shape_of_that_region() -> None:
    assert IN_YARD.shape is YARD.shape
    assert str(IN_YARD) == "in `yard`"


def test_starts_are_at_the_first_step_and_finishes_at_the_last() -> None:
    mission = mission_of([[1.0, 1.0], [2.0, 3.0], [4.0, 4.0]], 2, step=0.5)
    one, other, third = mission.agents
    mission = replace(mission, agents=(replace(one, finish=IN_YARD), replace(other, start=IN_YARD), third))
    assert [(agent.name, str(start)) for agent, start in mission.ends_at(0)] == [
        ("drone[0]", "at (1, 1)"),
        ("drone[1]", "in `yard`"),
        ("drone[2]", "at (4, 4)"),
    ]
    assert mission.ends_at(1) == []
    assert [(agent.name, finish) for agent, finish in mission.ends_at(2)] == [("drone[0]", IN_YARD)]
    assert [len(agent.ends) for agent in mission.agents] == [2, 1, 1]
    assert {
        region.name: [agent.name for agent, _ in ends] for region, ends in ends_by_region(mission.starts).items()
    } == {"yard": ["drone[1]"]}

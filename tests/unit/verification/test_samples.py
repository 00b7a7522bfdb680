"""States at steps of half a second from samples: what is known of an agent at a step, from when, and how far off."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from missionc import ir
from missionc.base.units import Seconds
from missionc.verification.monitoring.live.samples import UNSEEN, Fate, Sample, SampleSteps, StepState
from tests.support.random_runs import mission_of


def stream(step: float = 0.5, steps: int = 6, **options: float) -> SampleSteps:
    """Two agents, no faster than 4 m/s."""
    mission = replace(mission_of(2, steps), step=Seconds(step))
    agents = tuple(replace(agent, dynamics=ir.SingleIntegrator(4.0)) for agent in mission.agents)
    return SampleSteps(replace(mission, agents=agents), **options)  # type: ignore[arg-type]


def said(agent: int, time: float, x: float, *velocity: float, heading: float = math.nan) -> Sample:
    return Sample(agent, time, (x, 2 * x), (velocity[0], 0.0) if velocity else (), heading)


def fed(steps: SampleSteps, *samples: Sample) -> list[StepState]:
    return [state for sample in samples for state in steps.add(sample)]


def test_a_sample_on_time_is_the_state_of_its_step() -> None:
    (state,) = fed(stream(), said(0, 9e-7, 3.0, 1.5, heading=0.25), said(1, -9e-7, 4.0))
    assert (state.step, state.missing) == (0, ())
    assert state.position.tolist() == [[3.0, 6.0], [4.0, 8.0]]
    assert state.velocity.tolist() == [[1.5, 0.0], [0.0, 0.0]]
    assert state.heading.tolist() == [0.25, 0.0]
    assert state.doubt.tolist() == [0.0, 0.0]


BEGIN = said(0, 0.0, 0.0), said(1, 0.0, 0.0)


def test_between_two_samples_places_and_velocities_change_evenly_and_headings_do_not() -> None:
    samples = said(0, 0.375, 1.0, 1.0, heading=1.0), said(0, 0.875, 3.0, 3.0, heading=2.0), said(1, 0.5, 1.0)
    _, state = fed(stream(), *BEGIN, *samples)
    assert state.position[0].tolist() == [1.5, 3.0]
    assert state.velocity[0].tolist() == [1.5, 0.0]
    assert state.heading[0] == 1.0
    # Where the later one has no velocity, it is that of the earlier one; where that has none, of the way between steps.
    late = said(0, 0.375, 1.0, 1.0), said(0, 0.875, 3.0), said(1, 0.5, 1.0)
    assert fed(stream(), *BEGIN, *late)[1].velocity.tolist() == [[1.0, 0.0], [2.0, 4.0]]
    early = said(0, 0.375, 1.0), said(0, 0.875, 3.0, 3.0), said(1, 0.5, 1.0)
    assert fed(stream(), *BEGIN, *early)[1].velocity[0].tolist() == [3.0, 6.0]


def test_of_who_is_not_seen_for_longer_than_a_step_the_nearest_sample_is_known() -> None:
    _, state = fed(stream(), *BEGIN, said(1, 0.5, 1.0), said(0, 0.625, 3.0, 2.0))
    assert state.missing == (0,)
    assert state.position[0].tolist() == [3.0, 6.0]
    # An eighth of a second, at 4 m/s.
    assert state.doubt.tolist() == [0.5, 0.0]
    assert state.velocity[0].tolist() == [0.0, 0.0]
    # A hole of just one step is none.
    *_, whole = fed(stream(), said(0, 0.25, 1.0), said(1, 0.0, 0.0), said(1, 0.5, 1.0), said(0, 0.75, 2.0))
    assert (whole.step, whole.missing, whole.position[0].tolist()) == (1, (), [1.5, 3.0])


def test_of_who_was_never_seen_nothing_is_known() -> None:
    states = fed(stream(), said(1, 0.0, 0.0), said(1, 0.75, 1.0))
    assert states[0].missing == (0,)
    assert states[0].doubt.tolist() == [UNSEEN, 0.0]


def test_a_step_is_closed_when_all_have_passed_it_or_one_by_more_than_the_wait() -> None:
    for time, count in ((0.5, 1), (0.99, 1), (1.0 + 5e-7, 1), (1.0 + 2e-6, 2)):
        assert len(fed(stream(), *BEGIN, said(1, time, 1.0))) == count
    assert stream().wait == 0.5
    patient = stream(wait=0.75)
    assert len(fed(patient, *BEGIN, said(1, 1.2, 1.0))) == 1
    assert len(fed(patient, said(1, 1.3, 1.0))) == 1


def test_a_sample_just_on_time_waits_for_its_step_with_the_others() -> None:
    """A millionth of a second before it, whether it comes before the step before is closed or after."""
    on_time = 0.5 - 1e-6
    assert len(fed(stream(), said(0, 0.0, 0.0), said(0, on_time, 0.0), said(1, 0.0, 0.0), said(1, on_time, 0.0))) == 2
    assert len(fed(stream(), *BEGIN, said(0, on_time, 0.0), said(1, on_time, 0.0))) == 2
    early = 0.5 - 1.1e-6
    assert len(fed(stream(), *BEGIN, said(0, early, 0.0), said(1, early, 0.0))) == 1


def test_what_comes_after_its_step_was_closed_is_late() -> None:
    steps = stream()
    fed(steps, *BEGIN, said(0, 1e-6, 1.0), said(0, -0.25, 1.0), said(1, 0.0, 1.0))
    assert steps.fates == {Fate.LATE: 3}
    fed(steps, said(0, 2e-6, 1.0))
    assert steps.fates == {Fate.LATE: 3}
    # Before the first step nothing is late.
    early = stream()
    fed(early, said(0, -5.0, 1.0))
    assert early.fates == {}


def test_two_samples_at_one_time_are_one() -> None:
    steps = stream()
    fed(steps, *BEGIN, said(0, 0.25, 1.0), said(0, 0.25 + 4e-7, 2.0), said(0, 0.25 - 4e-7, 2.0))
    assert steps.fates == {Fate.DOUBLED: 2}
    fed(steps, said(0, 0.25 + 6e-7, 2.0), said(0, 0.2, 2.0), said(0, 0.2, 3.0), said(0, 0.3, 3.0))
    assert steps.fates == {Fate.DOUBLED: 3, Fate.REORDERED: 1}
    assert steps.tracks[0].times == [0.0, 0.2, 0.25, 0.25 + 6e-7, 0.3]


def test_a_leap_is_ten_seconds_or_three_steps_and_the_wait() -> None:
    assert stream().leap == 10.0
    assert stream(step=4.0).leap == 16.0
    assert stream(step=4.0, wait=1.0).leap == 13.0
    assert [stream(leap=leap).leap for leap in (0.25, 0.75)] == [0.5, 0.75]


def test_a_sample_far_ahead_is_confirmed_by_another_one_near_it_of_another_agent_or_time() -> None:
    for other, ahead in (
        (said(1, 20.0, 1.0), 0),
        (said(0, 20.5, 1.0), 0),
        (said(1, 9.9, 1.0), 1),
        (said(0, 20.0, 1.0), 1),
        (said(1, 30.5, 1.0), 2),
    ):
        steps = stream(steps=100)
        fed(steps, *BEGIN, said(0, 20.0, 1.0), other)
        assert steps.fates[Fate.AHEAD] == ahead
    again = stream(steps=100)
    fed(again, *BEGIN, said(0, 20.0, 1.0), said(0, 20.0, 2.0))
    assert again.fates == {Fate.AHEAD: 1, Fate.DOUBLED: 1}


def test_a_stream_that_ends_closes_what_it_has_reached() -> None:
    steps = stream()
    fed(steps, *BEGIN, said(0, 1.0, 2.0))
    assert [state.step for state in steps.finish()] == [1, 2]
    assert [state.step for state in steps.finish()] == []
    short = stream(steps=1)
    fed(short, *BEGIN, said(0, 0.5, 2.0), said(1, 0.5, 2.0), said(1, 9.0, 2.0))
    assert short.over
    assert list(short.finish()) == []


def test_a_velocity_that_is_not_said_is_that_of_the_way_from_the_step_before() -> None:
    states = fed(stream(), *BEGIN, said(0, 0.5, 1.0), said(1, 0.5, 2.0), said(0, 1.0, 1.0), said(1, 1.0, 5.0))
    assert [state.velocity[:, 0].tolist() for state in states] == [[0.0, 0.0], [2.0, 4.0], [0.0, 6.0]]
    assert np.isfinite(states[2].velocity).all()


@pytest.mark.parametrize("ahead", [0.25, -0.25])
def test_a_clock_is_ahead_by_as_much_as_is_said(ahead: float) -> None:
    mission = replace(mission_of(2, 6), step=Seconds(0.5))
    steps = SampleSteps(mission, skew={1: ahead})
    (state,) = fed(steps, said(0, 0.0, 1.0), said(1, ahead, 2.0))
    assert state.position[:, 0].tolist() == [1.0, 2.0]

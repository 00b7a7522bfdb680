"""Resources that are asked of who does not have them, and resources that no plan can keep above a bound."""

from __future__ import annotations

import pytest

from missionc.base.diagnostics.code import CONTRADICTION, DECLARED_AGAIN, NOT_ITS_OWN, RUNS_OUT
from tests.support.check_findings import found, only, text

CHARGED = "require charged: every drone: always[0, 20 s] battery >= 5"


def battery(rates: str, of: str = "drone") -> str:
    return f"resource battery of {of} {{ {rates}, refill 5 per s in base }}"


def test_whoever_does_not_have_a_resource_is_not_asked_about_it() -> None:
    declared = battery("start 30, drain 1 per s", of="drone[0..1]")
    finding = only(text(declared, CHARGED), NOT_ITS_OWN)
    assert finding.message == "`drone[2]` does not have `battery`"
    two = battery("start 30, drain 1 per s", of="drone[0]")
    assert only(text(two, CHARGED), NOT_ITS_OWN).message == "`drone[1]` and `drone[2]` do not have `battery`"


def test_below_an_operator_of_space_everybody_of_the_graph_is_asked() -> None:
    declared = battery("start 30, drain 3 per s", of="drone[0]")
    asked = "require near: drone[0]: always[0, 20 s] (battery <= 20 or somewhere[hops 0..1] battery >= 5)"
    assert len(found(text(declared, asked), NOT_ITS_OWN)) == 1
    alone = text(declared, asked).replace("proximity 2 m", "proximity 2 m over drone[0]")
    assert found(alone, NOT_ITS_OWN) == []


def test_a_flag_may_be_asked_of_anybody() -> None:
    flag = "flag seen of drone[0] { set in goal }"
    assert found(text(flag, "require seen: some drone: eventually[0, 20 s] seen"), NOT_ITS_OWN) == []


@pytest.mark.parametrize(
    ("rates", "place"),
    [
        ("start 20, drain 1 per s", "at (9, 9), (8, 9), (9, 8)"),  # 8.5 m to the base at 2 m/s: filled in time
        ("start 14, drain 1 per s, drain 0.5 per m", "at (9, 9), (8, 9), (9, 8)"),
        ("start 6, drain 1 per s", "in base"),
        ("start 30, drain 1 per m", "in base"),
    ],
)
def test_nothing_is_said_where_it_can_be_filled_in_time(rates: str, place: str) -> None:
    agents = f"team drone[3] {{ radius 0.1 m  dynamics single_integrator(speed <= 2 m/s)  start {place} }}"
    assert found(text(battery(rates), CHARGED, agents=agents), RUNS_OUT) == []


def test_time_alone_uses_it_up_before_it_is_filled() -> None:
    agents = "team drone[1] { radius 0.1 m  dynamics single_integrator(speed <= 2 m/s)  start at (9, 9) }"
    late = only(text(battery("start 8, drain 1 per s"), CHARGED, agents=agents), RUNS_OUT)
    assert late.message == "`battery` of `drone[0]` is below 5 at 4 s, before a refill is possible"
    short = only(text(battery("start 12, drain 1 per s, drain 1 per m"), CHARGED, agents=agents), RUNS_OUT)
    assert short.message == "`battery` of `drone[0]` is below 5 at 8 s, before a refill is possible"
    never = text("resource battery of drone { start 22, drain 1 per s }", CHARGED)
    finding = only(never, RUNS_OUT)
    assert finding.message == "`battery` of `drone[0]` is below 5 at 18 s, before a refill is possible"
    assert finding.primary is not None
    assert finding.primary.message.endswith("no refill")


def test_a_window_that_ends_before_it_is_used_up_asks_for_no_filling() -> None:
    brief = "require charged: every drone: always[0, 10 s] battery >= 5"
    assert found(text("resource battery of drone { start 22, drain 1 per s }", brief), RUNS_OUT) == []


def test_a_place_to_which_not_even_a_full_one_leads_is_found() -> None:
    goal = "require goal: every drone: eventually[0, 15 s] goal"
    finding = only(text(battery("start 20, drain 3 per m"), CHARGED, goal), RUNS_OUT)
    assert finding.message == "`battery` is not enough for `drone[0]` to reach `goal`"
    assert found(text(battery("start 20, capacity 30, drain 3 per m"), CHARGED, goal), RUNS_OUT) == []
    either = "require goal: every drone: (eventually[0, 15 s] goal) or eventually[0, 15 s] fire"
    assert found(text(battery("start 20, drain 3 per m"), CHARGED, either), RUNS_OUT) == []


def test_a_value_that_it_never_has_is_found() -> None:
    asked = "require full: some drone: eventually[0, 20 s] battery > 40"
    finding = only(text(battery("start 30, drain 1 per s"), asked), CONTRADICTION)
    assert finding.labels == ()


def test_a_flag_that_is_set_twice_is_told_how_to_unite_the_regions() -> None:
    finding = only(text("flag carries of drone { set in base, set in goal }"), DECLARED_AGAIN)
    assert finding.help == "declare `region either = base + goal` and write `set in either`"
    united = "region either = base + goal\nflag carries of drone { set in either }"
    assert found(text(united), DECLARED_AGAIN) == []

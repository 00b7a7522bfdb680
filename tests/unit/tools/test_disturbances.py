"""Disturbances from Python and from the command line: one reading, one set of ranges."""

from __future__ import annotations

import re
from typing import Any

import click
import pytest

from missionc.cli.commands.compile import command
from missionc.cli.disturbance_options import disturbance_of
from missionc.tools.api.disturbances import amounts_of


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"wind": 101}, "`wind` must be a number from 0 to 100"),
        ({"wind": (1.0, -0.5)}, "`wind` must be a number from 0 to 100"),
        ({"wind": float("nan")}, "`wind` must be a number from 0 to 100"),
        ({"wind": (1, 2, 3)}, "`wind` must be a number from 0 to 100"),
        ({"mass_error": 51}, "`mass_error` must be a number from 0 to 50"),
        ({"noise": True}, "`noise` must be a number from 0 to 1"),
        ({"lose": [("drone[0]", 1.0), ("drone[0]", 2.0)]}, "`drone[0]` is lost more than once"),
        ({"lose": {"drone[0]": -1}}, "`lose` must be a time of at least 0 s"),
        ({"lose": ["drone[0]"]}, "`lose` must give each agent a time in seconds"),
        ({"lose": [(f"a{n}", 0.0) for n in range(1001)]}, "at most 1000 agents can be lost"),
    ],
)
def test_a_disturbance_out_of_its_range_is_refused_from_python_and_by_the_flags(
    given: dict[str, Any], says: str
) -> None:
    with pytest.raises(ValueError, match=re.escape(says)) as wrong:
        amounts_of("simulate", given)
    with pytest.raises(click.UsageError) as usage:
        disturbance_of(**given)
    assert usage.value.message == str(wrong.value)


def test_both_give_the_fields_of_a_disturbance() -> None:
    given: dict[str, Any] = {"wind": (0.5, 0.25), "mass_error": 5, "lose": {"drone[0]": 2}}
    amounts, lost = amounts_of("simulate", given)
    assert (amounts["wind"], amounts["gust"], amounts["mass"]) == (0.5, 0.25, 0.05)
    assert lost == (("drone[0]", 2.0),)
    assert disturbance_of(**given) == (amounts, lost)


def test_the_settings_that_can_be_set_are_printed_without_a_mission(capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["--set", "help"], standalone_mode=False) == 0
    printed = capsys.readouterr().out
    assert "[smt.roadmap]\nnodes = 110  # nodes of the first roadmap" in printed
    assert "a whole number from 1 to 1,000,000" in printed
    assert "[clot." in printed

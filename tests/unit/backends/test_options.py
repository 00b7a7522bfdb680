"""Options of a plan: each is described once, and the command line, the manifest and its verification follow it."""

from __future__ import annotations

from dataclasses import fields

import pytest

from missionc.backends.load import load
from missionc.backends.options import DESCRIBED, OneOf, Options, Real, Recorded, Switch, Whole
from missionc.backends.registry import BACKENDS
from missionc.base.diagnostics.code import NOT_ITS_FLAG
from missionc.base.diagnostics.model import Diagnostic
from missionc.cli.commands.compile import command

WITHOUT_A_FLAG = {"captures", "brief"}
OTHER = {
    "solver": "race",
    "preset": "search",
    "device": "cuda",
    "samples": 3,
    "margin": 0.5,
    "processes": 2,
    "require_solver": True,
}


def test_every_option_is_described_and_has_a_flag_with_its_default() -> None:
    assert set(DESCRIBED) == {field.name for field in fields(Options)} - WITHOUT_A_FLAG
    flags = {parameter.name: parameter for parameter in command.params}
    for option in DESCRIBED.values():
        assert flags[option.name].default == option.default


def test_every_option_is_one_that_some_backend_hears_of() -> None:
    assert set().union(*(spec.options for _, spec in BACKENDS.items_built_in())) == set(DESCRIBED)


@pytest.mark.parametrize("name", [option.name for option in DESCRIBED.values() if option.refused])
def test_an_option_for_others_is_refused_by_name(name: str) -> None:
    deaf = next(spec.name for _, spec in BACKENDS.items_built_in() if name not in spec.options)
    finding = load(deaf, Options(**{name: OTHER[name]}))  # type: ignore[arg-type]
    assert isinstance(finding, Diagnostic)
    assert finding.code is NOT_ITS_FLAG
    assert " ".join(DESCRIBED[name].words(Options(**{name: OTHER[name]}))) in finding.message  # type: ignore[arg-type]


@pytest.mark.parametrize("option", DESCRIBED.values(), ids=DESCRIBED)
def test_a_manifest_may_say_what_the_command_line_takes_and_nothing_else(option: object) -> None:
    match option.kind:  # type: ignore[attr-defined]
        case OneOf(words) as kind:
            assert all(map(kind.admits, words))
            assert not kind.admits("")
        case Whole(least, most) as kind:
            assert kind.admits(str(least))
            assert kind.admits(str(most))
            assert not any(map(kind.admits, (str(least - 1), str(most + 1), "1.0", "x", "\u00b2", "9" * 400)))
        case Real(least, most) as kind:
            assert kind.admits(repr(float(least)))
            assert kind.admits(repr(float(most)))
            assert not any(map(kind.admits, (repr(least - 1.0), repr(most + 1.0), "nan", "1e400", "x", "1_0.0")))
        case Switch() as kind:
            assert kind.admits("True")
            assert not any(map(kind.admits, ("False", "true", "1", "")))


def test_what_changes_no_plan_is_not_recorded() -> None:
    assert {option.name for option in DESCRIBED.values() if option.recorded is Recorded.NEVER} == {
        "processes",
        "certify",
    }

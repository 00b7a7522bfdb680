"""Backend choice: set inclusion, explained; and what to say where it fails."""

from __future__ import annotations

import pytest

from missionc.backends.choose_backend import Choice, choose_backend, needs
from missionc.backends.features import Feature
from missionc.backends.load import load
from missionc.backends.options import Options
from missionc.backends.registry import BACKENDS
from missionc.base.diagnostics.code import CANNOT_EXPRESS, EXTRA_MISSING, NO_BACKEND
from missionc.base.diagnostics.model import Diagnostic
from tests.support.check_findings import found, meant, only, text, words

HOPS = "require linked: every drone: always[0, 20 s] (fire implies somewhere[hops 1..2] base)"
METRES = "require near: every drone: always[0, 20 s] (fire implies somewhere[distance <= 6 m] base)"
TOTAL = "formation tight = chain of drone spacing 1 m total tolerance 0.2 m\nrequire shape: eventually[3 s, 9 s] tight"
ROW = "formation row = chain of drone spacing 1 m tolerance 0.2 m\nrequire shape: eventually[3 s, 9 s] row"
RESTLESS = "team drone[3] { dynamics unicycle(speed 1..2 m/s)  start in base }"


def choice(mission: str, forced: str | None = None) -> Choice:
    chosen, told = choose_backend(meant(mission), forced)
    assert chosen is not None, told
    assert told == []
    return chosen


def test_auto_takes_the_first_backend_that_offers_all() -> None:
    assert choice(text(HOPS)).backend == "smt"
    assert choice(text(TOTAL)).backend == "clot"
    assert choice(text(HOPS, TOTAL)).backend == "hybrid"
    assert choice(text(METRES)).backend == "clot"
    assert choice(text(METRES, HOPS)).engines == ("smt", "hybrid")
    assert choice(text(TOTAL, "minimize duration")).backend == "clot"


def test_lengths_in_metres_are_given_to_transport_before_they_are_rounded() -> None:
    assert choice(text(METRES)).engines == ("clot", "smt", "hybrid")
    restless = text(METRES, agents=RESTLESS)
    assert choice(restless).engines == ("clot", "smt", "hybrid")


def test_the_words_that_rule_a_backend_out_are_in_the_explanation() -> None:
    assert choice(text(HOPS, TOTAL)).explanation == (
        "backend: hybrid\n"
        "because this backend supports the mission\n"
        "not smt: this backend cannot express\n"
        "  a formation with a total tolerance (line 12: `tight`)\n"
        "not clot: this backend cannot express\n"
        "  a route bounded in hops (line 10: `somewhere[hops 1..2]`)\n"
        "the mission needs:\n"
        "  a route bounded in hops (line 10: `somewhere[hops 1..2]`)\n"
        "  a formation with a total tolerance (line 12: `tight`)\n"
    )


def test_all_that_can_express_the_mission_take_turns() -> None:
    near = choice(text("require near: every drone: eventually[0, 20 s] goal"))
    assert near.engines == ("smt", "clot", "hybrid")
    assert near.explanation.startswith("backends: smt, clot, hybrid\nbecause all these backends support the mission")


def test_hybrid_takes_the_turns_of_transport_where_that_cannot() -> None:
    assert choice(text(HOPS)).engines == ("smt", "hybrid")


@pytest.mark.parametrize(
    ("dynamics", "first"),
    [
        ("unicycle(speed 0..2 m/s)", "smt"),
        ("unicycle(speed 1..2 m/s)", "clot"),
        ("double_integrator(speed <= 2 m/s, acceleration <= 1 m/s^2)", "clot"),
    ],
)
def test_agents_with_momentum_or_a_least_speed_are_given_to_transport_first(dynamics: str, first: str) -> None:
    chosen = choice(
        text(
            "require go: every drone: eventually[3 s, 9 s] fire",
            agents=f"team drone[3] {{ dynamics {dynamics}  start in base }}",
        )
    )
    assert chosen.engines[0] == first
    assert set(chosen.engines[:2]) == {"smt", "clot"}


def test_a_formation_is_given_to_transport_first() -> None:
    assert choice(text(ROW)).engines == ("clot", "smt", "hybrid")
    assert choice(text(TOTAL)).engines == ("clot", "hybrid")


def test_a_backend_that_is_not_asked_for_is_said_to_have_been_able() -> None:
    asked = choice(text(ROW, "solve with clot")).explanation
    assert "because the mission selects this backend (line 12: `solve with clot`)\n" in asked
    assert "not smt: this backend supports the mission, but clot is selected\n" in asked


def test_the_command_line_overrules_the_mission() -> None:
    chosen = choice(text(ROW, "solve with clot"), "smt")
    assert chosen.backend == "smt"
    assert "because the command line selects this backend\n" in chosen.explanation
    assert choice(text(ROW, "solve with clot"), "auto").engines == ("clot", "smt", "hybrid")


def test_a_backend_that_cannot_express_the_mission_is_refused_with_the_words_in_the_way() -> None:
    finding = only(text(HOPS, "solve with clot"), CANNOT_EXPRESS)
    assert finding.message == "the backend `clot` cannot express a route bounded in hops"
    assert words(finding) == [("somewhere[hops 1..2]", ""), ("solve with clot", "`clot` chosen here")]
    assert finding.help == "write `solve with auto`, or choose `smt` or `hybrid`, which can"


@pytest.mark.parametrize(
    ("parts", "feature"),
    [
        (TOTAL, Feature.TOTAL_TOLERANCE),
        (ROW + "\nminimize energy", Feature.ENERGY),
    ],
)
def test_smt_says_what_it_cannot_express(parts: str, feature: Feature) -> None:
    finding = only(text(parts, "solve with smt"), CANNOT_EXPRESS)
    assert finding.message == f"the backend `smt` cannot express {feature.value}"


def test_the_least_duration_of_agents_that_cannot_wait_is_refused() -> None:
    parts = (ROW, "minimize duration")
    finding = only(text(*parts, "solve with smt", agents=RESTLESS), CANNOT_EXPRESS)
    assert finding.message == "the backend `smt` cannot express `minimize duration` for agents that cannot wait"
    assert finding.notes == ("`drone` cannot wait, so every plan lasts for the whole horizon",)
    assert finding.help == "let `drone` wait, with `speed 0..`"
    finding = only(text(*parts, agents=RESTLESS), NO_BACKEND)
    assert "rules out `smt`, `clot` and `hybrid`" in words(finding)[0][1]
    assert found(text(*parts), NO_BACKEND) == []


def test_every_feature_is_found_at_its_first_words() -> None:
    mission = meant(
        "mission all\n"
        "time step 1 s, horizon 20 s\n"
        "world (0, 0, 0) to (9, 9, 3)\n"
        "obstacle truck = box (5, 5) to (6, 6) moving (0.1, 0, 0) m/s\n"
        "obstacle crowd = disc at (8, 8) radius 0.5 m uncertain 0.01 m/s\n"
        "team drone[3] { dynamics unicycle(speed 0..1 m/s)  start line (1, 1, 1) to (3, 1, 1) }\n"
        "agent kite { dynamics double_integrator(speed <= 1 m/s, acceleration <= 1 m/s^2)  start at (1, 4, 1) }\n"
        "graph radio = proximity 2 m\n"
        "formation row = chain of drone spacing 1 m tolerance 0.2 m\n"
        "require r: always[1 s, 9 s] (connected(radio) or row)\n"
        "require q: drone[0]: eventually[0, 9 s] somewhere[hops 1..2] kite\n"
        "prefer p: eventually[0, 20 s] row weight 2\n"
        "minimize duration\n"
        "tolerate delay 2 s of kite\n"
    )
    assert {need.feature: need.span.text for need in needs(mission)} == {
        Feature.VOLUME: "world (0, 0, 0) to (9, 9, 3)",
        Feature.MOVING_OBSTACLE: "truck",
        Feature.UNCERTAIN_OBSTACLE: "crowd",
        Feature.UNICYCLE: "drone",
        Feature.SECOND_ORDER: "kite",
        Feature.CONNECTED: "connected(radio)",
        Feature.FORMATION: "row",
        Feature.HOPS: "somewhere[hops 1..2]",
        Feature.PREFER: "prefer p: eventually[0, 20 s] row weight 2",
        Feature.DURATION: "minimize duration",
        Feature.DELAY: "tolerate delay 2 s of kite",
    }


def test_transport_offers_all_but_hops_lanes_and_what_no_backend_does() -> None:
    nobody = {Feature.RESTLESS_DURATION, Feature.PAST_BELOW_METRES, Feature.EXTENSION_RULES}
    assert set(Feature) - BACKENDS["clot"].features == {Feature.HOPS, Feature.LANES} | nobody


def test_hybrid_offers_all_that_transport_does_and_hops() -> None:
    assert list(BACKENDS.built_in) == ["smt", "clot", "hybrid"]
    assert BACKENDS["hybrid"].features == BACKENDS["clot"].features | {Feature.HOPS}


@pytest.mark.parametrize(
    ("options", "flag"), [(Options(solver="cadical"), "--solver cadical"), (Options(certify=True), "--certify")]
)
def test_a_flag_whose_package_is_missing_is_named_with_the_command_that_installs_it(
    options: Options, flag: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("missionc.backends.smt.sat.installed_solvers.find_spec", lambda name: None)
    finding = load("smt", options)
    assert isinstance(finding, Diagnostic)
    assert finding.code == EXTRA_MISSING
    assert finding.message.startswith(f"`{flag}` needs the package python-sat")
    assert "pip install 'missionc[sat]'" in finding.help

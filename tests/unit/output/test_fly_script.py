"""Scripts that fly: every phase against every failure, in virtual time. The page says in a table what they do."""

from __future__ import annotations

import re
import signal
import threading
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from missionc.ir import Vehicle as Profile
from missionc.output.export import fly_script, takeoff_and_landing
from missionc.output.export.formats import Flight, flight
from missionc.verification.flight.verify_whole_flight import LANDED, SPEED
from tests.support.flown_scripts import (
    SCRIPTS,
    Event,
    World,
    drain,
    export,
    fly,
    interrupt,
    lose_link,
    raise_in_client,
    safe,
    standing,
    tumble,
)
from tests.support.hand_made_flights import wandered

PAGE = Path(__file__).resolve().parents[3] / "docs" / "exports.md"

scripts = pytest.mark.parametrize("form", SCRIPTS)

COMMANDS = {
    "before arming": "upload",
    "armed, on the floor": "arm",
    "rise": "takeoff",
    "flight to the first points": "go",
    "mission": "start",
    "flight home": "",
    "landing": "land",
}
"""Each phase with the command that begins it, if it has one of its own."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The scripts of one flight."""
    found = tmp_path_factory.mktemp("scripts")
    for form in SCRIPTS:
        export(form, wandered(2), found)
    return found


def flown(
    folder: Path,
    form: str,
    monkeypatch: pytest.MonkeyPatch,
    *events: Event,
    failing: dict[tuple[str, int], int] | None = None,
) -> World:
    """One flight of two vehicles, with what happens in it, which ends safely."""
    world = World(standing(wandered(2)), list(events), failing or {})
    fly(folder / form / "fly.py", world, monkeypatch)
    safe(world)
    return world


@cache
def begins(folder: Path, form: str) -> dict[str, float]:
    """The second at which each phase begins, in a flight in which nothing happens."""
    with pytest.MonkeyPatch.context() as patched:
        world = flown(folder, form, patched)
    sent = {each.name: each.time for each in reversed(world.commands)}
    found = {phase: sent[command] for phase, command in COMMANDS.items() if command}
    return found | {"flight home": found["mission"] + 0.8 * wandered(2).duration}


def first_ctrl_c(phase: str, begin: float) -> dict[str, object]:
    return {"events": [(begin + 0.5, interrupt)]}


def second_ctrl_c(phase: str, begin: float) -> dict[str, object]:
    return {"events": [(begin + 0.5, interrupt), (begin + 1.5, interrupt)]}


def failing_command(phase: str, begin: float) -> dict[str, object] | None:
    return {"events": [], "failing": {(COMMANDS[phase], 1): 2}} if COMMANDS[phase] else None


def one_event(happens: Callable[[World], None]) -> Callable[[str, float], dict[str, object]]:
    return lambda phase, begin: {"events": [(begin + 0.5, happens)]}


FAILURES: dict[str, Callable[[str, float], dict[str, object] | None]] = {
    "first Ctrl-C": first_ctrl_c,
    "second Ctrl-C, 1 s later": second_ctrl_c,
    "a command to one vehicle fails": failing_command,
    "a link is lost": one_event(lose_link),
    "a battery is low": one_event(drain),
    "a vehicle tumbles": one_event(tumble),
}


def told(world: World, since: float) -> str:
    """What a flight came to after something happened, in the words of the page."""
    after = [each for each in world.commands if each.time >= since - 1e-6]
    names = {each.name for each in world.commands}
    if "emergency" in names:
        return "all motors stop at once"
    if "takeoff" not in names:
        return "no vehicle takes off; all are disarmed" if "disarm" in names else "no vehicle takes off"
    before = {each.agent for each in world.commands if each.name == "land" and each.time < since - 1e-6}
    landing = {each.agent: each.time for each in after if each.name == "land"}
    if len(before) == len(world.vehicles):
        return "the landing goes on"
    if len(landing) < len(world.vehicles):
        return "the others land"
    if ("land", 1) in world.failing:
        assert max(landing.values()) > since + 0.9
        return "all land; the failed command is repeated"
    return "all land"


def table(folder: Path, form: str, monkeypatch: pytest.MonkeyPatch) -> str:
    """Every phase against every failure, as a table of Markdown."""
    lines = ["| phase | " + " | ".join(FAILURES) + " |", "|---" * (len(FAILURES) + 1) + "|"]
    for phase in COMMANDS:
        begin = begins(folder, form)[phase]
        cells = []
        for failure in FAILURES.values():
            given = failure(phase, begin)
            if given is None:
                cells.append("no command is sent")
                continue
            events, failing = given["events"], given.get("failing")
            assert isinstance(events, list)
            assert failing is None or isinstance(failing, dict)
            since = events[-1][0] if events else begin
            cells.append(told(flown(folder, form, monkeypatch, *events, failing=failing), since))
        lines.append(f"| {phase} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def test_the_page_says_what_both_scripts_do_in_every_phase(
    folder: Path, monkeypatch: pytest.MonkeyPatch, update_golden: bool
) -> None:
    made = {table(folder, form, monkeypatch) for form in SCRIPTS}
    assert len(made) == 1, "\n".join(made)
    page = PAGE.read_text(encoding="utf-8")
    renewed = re.sub(r"^\| phase \|.*?\n(?=\n)", lambda found: made.copy().pop(), page, flags=re.MULTILINE | re.DOTALL)
    if update_golden and renewed != page:
        PAGE.write_text(renewed, encoding="utf-8")
    else:
        assert made.pop() in page


# ------------------------------------------------------------------ one by one


@scripts
@pytest.mark.parametrize("phase", ["rise", "flight to the first points", "mission", "flight home"])
def test_the_first_ctrl_c_lands_all_at_once_and_disarms_after_the_landing(
    form: str, phase: str, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    when = begins(folder, form)[phase] + 0.99
    world = flown(folder, form, monkeypatch, (when, interrupt))
    after = [each for each in world.commands if each.time >= when]
    assert [each.agent for each in after if each.name == "land"] in ([0, 1], [1, 0])
    for agent in (0, 1):
        land, off, *_ = [each for each in after if each.agent == agent]
        assert (land.name, off.name) == ("land", "disarm")
        assert 0 <= land.time - when <= 0.05
        assert off.time - land.time == pytest.approx(land.values["lasting"])
        assert off.height == pytest.approx(LANDED)
    assert world.ended == "all vehicles landed: Ctrl-C"


@scripts
def test_a_vehicle_whose_start_fails_keeps_no_other_in_the_air(
    form: str, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    begin = begins(folder, form)["mission"]
    world = flown(folder, form, monkeypatch, failing={("start", 1): 1})
    assert {each.agent: each.time for each in world.commands if each.name == "land"} == {0: begin, 1: begin}
    assert "start failed" in world.ended


@pytest.mark.parametrize("phase", ["rise", "mission", "landing"])
def test_an_error_of_the_client_stops_no_motors(phase: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    when = begins(folder, "crazyswarm2")[phase] + 1
    world = flown(folder, "crazyswarm2", monkeypatch, (when, raise_in_client))
    assert "emergency" not in {each.name for each in world.commands}
    assert all(each.time <= when + 0.05 for each in world.commands if each.name == "land")


@scripts
@pytest.mark.parametrize("phase", ["rise", "mission", "landing"])
def test_an_order_to_end_lands_all_and_never_stops_motors_however_often(
    form: str, phase: str, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    begin = begins(folder, form)[phase]

    def hang_up(world: World) -> None:
        signal.raise_signal(signal.SIGHUP)
        signal.raise_signal(signal.SIGTERM)

    world = flown(folder, form, monkeypatch, (begin + 1, hang_up), (begin + 2, hang_up))
    names = [each.name for each in world.commands]
    assert names.count("land") == 2
    assert "emergency" not in names


@scripts
def test_a_vehicle_that_refuses_to_land_is_told_again_until_motors_are_stopped_by_hand(
    form: str, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    begin = begins(folder, form)["mission"]
    patient = [(begin + 60, interrupt), (begin + 61, interrupt)]
    world = flown(folder, form, monkeypatch, (begin + 1, drain), *patient, failing={("land", 1): 1000})
    assert {each.agent for each in world.commands if each.name == "land"} == {0}
    assert 1000 - world.failing["land", 1] >= 55
    stops = [each for each in world.commands if each.name == "emergency"]
    assert {each.agent for each in stops} == {0, 1}
    assert min(each.time for each in stops) == begin + 61


@scripts
def test_no_phase_begins_while_a_report_is_overdue(form: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for command in ("takeoff", "go", "start"):
        begin = begins(folder, form)[{name: phase for phase, name in COMMANDS.items()}[command]]
        world = flown(folder, form, monkeypatch, (begin - 1.3, lose_link))
        assert command not in {each.name for each in world.commands}
        assert world.ended.startswith("all vehicles landed" if command != "takeoff" else "no vehicle took off")


@scripts
def test_a_vehicle_without_a_link_is_never_disarmed(form: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    begin = begins(folder, form)["mission"]

    def come_back(world: World) -> None:
        world.vehicles[1].linked = True

    world = flown(folder, form, monkeypatch, (begin + 1, lose_link), (begin + 5, come_back))
    assert {each.agent for each in world.commands if each.name == "disarm"} == {0}


def test_a_radio_that_hangs_delays_no_other_vehicle_and_its_command_is_not_followed_by_another(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    script = folder / "cflib" / "hasty" / "cflib" / "fly.py"
    export("cflib", wandered(2), folder / "cflib" / "hasty")
    script.write_text(script.read_text().replace("PATIENCE = 0.5", "PATIENCE = 0.02"))
    world = World(standing(wandered(2)))
    released = threading.Event()
    world.hanging["go", 1] = released
    begin = begins(folder, "cflib")["flight to the first points"]
    world.events = [(begin + 2, lambda world: released.set())]
    fly(script, world, monkeypatch)
    own = [[each for each in world.commands if each.agent == agent and each.time >= begin] for agent in (0, 1)]
    assert [(each.name, each.time) for each in own[0]][:2] == [("go", begin), ("land", begin)]
    assert [each.name for each in own[1]][:2] == ["go", "land"]
    assert "its radio did not accept the command" in world.ended
    assert "start" not in {each.name for each in world.commands}
    assert all(each.height <= LANDED + 1e-6 for each in world.commands if each.name == "disarm")


# ------------------------------------------------------------------ turns, stops, and profiles


def in_turns(monkeypatch: pytest.MonkeyPatch) -> None:
    for user in (fly_script, takeoff_and_landing):
        monkeypatch.setattr(user, "turns_of", lambda flight: ((1,), (0,)))


@scripts
def test_whoever_has_not_risen_in_its_turn_stays_on_the_floor(
    form: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    in_turns(monkeypatch)
    script = export(form, wandered(2), tmp_path)
    world = fly(script, World(standing(wandered(2))), monkeypatch)
    safe(world)
    for command, order in (("takeoff", [1, 0]), ("land", [0, 1])):
        assert [each.agent for each in world.commands if each.name == command] == order
    first = next(each.time for each in world.commands if each.name == "takeoff")
    world = fly(script, World(standing(wandered(2)), [(first + 1, interrupt)]), monkeypatch)
    safe(world)
    assert [each.agent for each in world.commands if each.name in ("takeoff", "land")] == [1, 1]
    off = {each.agent: each.time for each in reversed(world.commands) if each.name == "disarm"}
    assert off[0] == pytest.approx(first + 1, abs=0.06)
    assert off[1] > off[0] + 3


@scripts
def test_ctrl_c_in_a_landing_in_turns_lands_those_at_once_that_still_hover(
    form: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    in_turns(monkeypatch)
    script = export(form, wandered(2), tmp_path)
    quiet = fly(script, World(standing(wandered(2))), monkeypatch)
    begin = next(each.time for each in quiet.commands if each.name == "land")
    world = fly(script, World(standing(wandered(2)), [(begin + 1, interrupt)]), monkeypatch)
    safe(world)
    lands = [(each.agent, each.time) for each in world.commands if each.name == "land"]
    assert lands == [(0, begin), (1, pytest.approx(begin + 1, abs=0.06))]


@scripts
@pytest.mark.parametrize("happens", ["nothing", "aside", "Ctrl-C", "failing upload"])
def test_what_is_left_of_a_flight_ends_on_the_floor_whatever_happens(
    form: str, happens: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rest = replace(wandered(2), in_flight=True)
    world = World(standing(rest, 0.5 if happens == "aside" else 0.0))
    if happens == "Ctrl-C":
        world.events = [(1.0, interrupt)]
    if happens == "failing upload":
        world.failing = {("upload", 1): 1}
    fly(export(form, rest, tmp_path), world, monkeypatch)
    safe(world)
    names = {each.name for each in world.commands}
    assert not names & {"takeoff", "arm", "go", "emergency"}
    assert ("start" in names) is (happens == "nothing")
    assert {each.agent for each in world.commands if each.name == "land"} == {0, 1}


@scripts
def test_no_landing_is_faster_than_a_profile_allows_wherever_it_begins(
    form: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = wandered(2)
    slow = tuple(replace(agent, vehicle=Profile("slow", vertical_speed=0.25)) for agent in made.mission.agents)
    texts = {each.agent.name: each.text for each in made.parts}
    careful = flight(replace(made.mission, agents=slow), made.kernel, made.trace, texts)
    script = export(form, careful, tmp_path)
    highest = max(each.height for each in fly(script, World(standing(careful)), monkeypatch).commands)
    begin = next(
        each.time for each in fly(script, World(standing(careful)), monkeypatch).commands if each.name == "start"
    )
    for since in np.linspace(0, careful.duration, 5).tolist():
        world = fly(script, World(standing(careful), [(begin + since, interrupt)]), monkeypatch)
        for each in world.commands:
            if each.name == "land":
                highest = max(highest, each.height)
                assert (each.height - LANDED) / each.values["lasting"] * SPEED <= 0.25 + 1e-9
    assert highest > max(part.last[2] for part in careful.parts) + 0.2


def test_flights_that_nothing_happens_to_end_without_a_message(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made: Flight = wandered(2)
    for form in SCRIPTS:
        world = flown(folder, form, monkeypatch)
        assert world.ended == ""
        assert world.now >= made.duration

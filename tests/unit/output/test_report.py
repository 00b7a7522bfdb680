"""The report's data against the monitor, and the page as a text that holds itself together."""

from __future__ import annotations

import base64
import hashlib
import html
import json
import re
import shutil
import subprocess
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from missionc.base.source import Source
from missionc.cli.app import commands
from missionc.compiler import driver
from missionc.compiler.results import Verified
from missionc.output.folder.write_folder import write_folder
from missionc.output.report.render_page import ASSETS, SCRIPTS
from missionc.output.report.report_html import data, report
from missionc.verification.certificate import Certificate, Check
from missionc.verification.monitoring.monitor import robustness, truth
from tests.support.small_missions import SMALL
from tests.support.unpacked_reports import MOTION, RELAY, flight, lane, links, metres, plotted, simulation, unpacked


@cache
def relay() -> dict[str, Any]:
    return data(plotted(RELAY, MOTION))


def rows_of(words: str) -> list[dict[str, Any]]:
    return [relay()["rows"][each["row"]] for each in relay()["lanes"] if each["words"] == words]


def agents_of(row: dict[str, Any]) -> int:
    return 1 if row["team"] else 3


def test_every_formula_of_every_goal_has_a_lane_in_the_order_of_the_text() -> None:
    assert [(each["depth"], each["name"], each["words"]) for each in relay()["lanes"]] == [
        (0, "goal", "some drone: eventually[0, 3 s] far"),
        (1, "", "eventually[0, 3 s] far"),
        (2, "", "far"),
        (0, "chain", "every drone: always[0, 4 s] (far implies true reach[hops 0..2 on radio] base)"),
        (1, "", "always[0, 4 s] (far implies true reach[hops 0..2 on radio] base)"),
        (2, "", "far implies true reach[hops 0..2 on radio] base"),
        (3, "", "far"),
        (3, "", "true reach[hops 0..2 on radio] base"),
        (4, "", "true"),
        (4, "", "base"),
        (0, "calm", "always[0, 4 s] not (drone[0]: far)"),
        (1, "", "not (drone[0]: far)"),
        (2, "", "drone[0]: far"),
        (3, "", "far"),
    ]


def test_a_lane_points_at_the_words_it_speaks_of() -> None:
    for each in relay()["lanes"]:
        file, start, end = each["place"]
        assert file == 0
        assert " ".join(RELAY[start:end].split()) == each["words"]


def test_values_at_every_step_are_those_of_the_monitor() -> None:
    made = plotted(RELAY, MOTION)
    judged = 0
    meanings = {" ".join(formula.span.text.split()): node for formula, node in made.kernel.meanings.items()}
    for each in relay()["lanes"]:
        row = relay()["rows"][each["row"]]
        if row["verdict"]:
            continue
        size = agents_of(row)
        node = meanings[each["words"]]
        expected = robustness(node, made.mission, made.plan.trace)[:size]
        np.testing.assert_allclose(metres(row["least"], size), expected, atol=5e-4)
        holds = truth(node, made.mission, made.plan.trace)[:size]
        np.testing.assert_array_equal(unpacked(row["surely"]).reshape(size, -1), holds)
        judged += 1
    assert judged == 9


def test_a_verdict_is_open_until_time_has_brought_it_out() -> None:
    goal = lane(relay(), "some drone: eventually[0, 3 s] far")
    assert unpacked(goal["surely"]).tolist() == [0, 0, 1, 1, 1]
    assert unpacked(goal["possibly"]).tolist() == [1, 1, 1, 1, 1]
    assert metres(goal["least"], 1)[0].tolist() == [-4.5, -2.0, 1.0, 1.0, 1.0]
    assert metres(goal["most"], 1)[0].tolist() == [np.inf, np.inf, np.inf, 1.0, 1.0]
    calm = lane(relay(), "always[0, 4 s] not (drone[0]: far)")
    assert unpacked(calm["possibly"]).tolist() == [1, 1, 0, 0, 0]
    assert unpacked(calm["surely"]).tolist() == [0, 0, 0, 0, 0]


def test_what_a_window_does_not_reach_is_not_asked() -> None:
    goal, chain, calm = (row for row in rows_of("far"))
    assert unpacked(goal["asked"]).reshape(3, -1).tolist() == [[1, 1, 1, 1, 0]] * 3
    assert unpacked(chain["asked"]).reshape(3, -1).tolist() == [[1] * 5] * 3
    assert unpacked(calm["asked"]).reshape(3, -1).tolist() == [[1] * 5, [0] * 5, [0] * 5]


def test_a_route_is_lit_where_it_makes_the_formula_true() -> None:
    chain = lane(relay(), "far implies true reach[hops 0..2 on radio] base")
    # Only drone 0 is far away, from step 2 on; the others need no route.
    assert links(chain["links"]) == [(0, 1, 2, 5), (1, 2, 2, 5)]
    lit = unpacked(chain["lit"]).reshape(3, -1)
    assert (lit == 1).all()


def test_agents_that_break_a_formula_are_lit_as_such() -> None:
    calm = lane(relay(), "not (drone[0]: far)")
    assert unpacked(calm["lit"]).reshape(3, -1).tolist() == [[1, 1, 2, 2, 2], [0] * 5, [0] * 5]


def test_links_come_with_the_steps_at_which_they_appear_and_break() -> None:
    (graph,) = relay()["graphs"]
    apart = [
        [[1.0, 1.0], [1.0, 1.0], [9.0, 1.0], [1.0, 1.0], [1.0, 1.0]],
        [[1.5, 1.5]] * 5,
        [[1.0, 9.0]] * 5,
    ]
    assert links(graph["runs"]) == [(0, 1, 0, 5), (0, 2, 0, 2), (1, 2, 0, 5)]
    assert links(data(plotted(RELAY, apart))["graphs"][0]["runs"]) == [(0, 1, 0, 2), (0, 1, 3, 5)]


def test_positions_are_the_plan_s_to_a_millimetre() -> None:
    motion = relay()["motion"]["planned"]
    position = unpacked(motion["position"]).reshape(2, 3, -1) / 1000
    np.testing.assert_allclose(np.moveaxis(position, 0, 2), MOTION, atol=5e-4)


def test_the_tightest_room_is_marked_once_with_its_time() -> None:
    (tightest,) = [each for each in relay()["checks"] if each["tightest"]]
    rooms = [each for each in relay()["checks"] if each["name"] in ("requirement", "separation")]
    assert tightest["margin"] == min(each["margin"] for each in rooms)
    requirement = next(each for each in rooms if each["subject"] == "goal")
    assert requirement["at"] == 2.0


def test_separation_is_between_bodies_at_every_sample() -> None:
    chart = next(each for each in relay()["charts"] if each["name"] == "separation")
    first = np.array(MOTION)
    pairs = [(0, 1), (0, 2), (1, 2)]
    nearest = np.min([np.linalg.norm(first[a] - first[b], axis=-1) - 0.2 for a, b in pairs], axis=0)
    np.testing.assert_allclose(metres(chart["series"][0]["values"], 1)[0], nearest, atol=5e-4)


def simulated(text: str) -> dict[str, Any]:
    motion = np.array(MOTION)
    return data(plotted(RELAY, MOTION, {f"drone[{agent}]": flight(path) for agent, path in enumerate(motion)}, text))


def test_the_share_of_flights_as_required_is_shown_where_there_is_one() -> None:
    found = json.loads(simulation(np.array(MOTION), 0.01))
    words = "in at least 98.1 % of such flights (one-sided 95 % lower confidence bound)"
    kept = {"held": 200, "of": 200, "least": 0.98115, "low": 0.975, "high": 1.0}
    (row,) = shares(simulated(json.dumps({**found, "headline": words, "kept": kept})))
    assert (row["margin"], row["unit"], row["passed"], row["detail"]) == (98.1, "% or more", True, words)
    (row,) = shares(simulated(json.dumps({**found, "headline": words, "kept": {**kept, "held": 199}})))
    assert not row["passed"]
    assert not shares(simulated(json.dumps({**found, "headline": "", "kept": {**kept, "least": None}})))
    assert not shares(simulated(json.dumps(found)))


def shares(page: dict[str, Any]) -> list[dict[str, Any]]:
    return [each for each in page["checks"] if each["name"] == "simulated flights"]


def test_a_simulated_flight_is_shown_with_its_error_and_what_it_was_judged_for() -> None:
    shown = simulated(simulation(np.array(MOTION), 0.07))
    assert set(shown["motion"]) == {"planned", "flown", "simulated"}
    assert shown["motion"]["simulated"]["position"] == shown["motion"]["flown"]["position"]
    chart = next(each for each in shown["charts"] if each["name"] == "tracking error")
    np.testing.assert_allclose(metres(chart["series"][0]["values"], 1)[0], 70.0, atol=0.01)
    assert [each["value"] for each in chart["limits"]] == [50.0]
    found = {(each["name"], each["subject"]): each for each in shown["checks"] if each["name"].startswith("simulated")}
    assert found["simulated requirement", "goal"]["passed"]
    assert found["simulated requirement", "goal"]["margin"] == 0.1
    tracking = next(each for (name, _), each in found.items() if name == "simulated tracking")
    assert not tracking["passed"]
    assert tracking["margin"] == pytest.approx(-0.02)
    assert shown["passed"]


@pytest.mark.parametrize(
    "change",
    [
        lambda found: found.update(schema="missionc.plan/1"),
        lambda found: found["flight"]["agents"].pop("drone[1]"),
        lambda found: found["flight"]["agents"].update({"drone[1]": [[0.0], [0.0], [float("nan")]]}),
        lambda found: found["flight"].update(samples_per_second=0),
        lambda found: found["flight"].update(samples_per_second=2500),
        lambda found: found.update(tracking=[]),
        lambda found: found.update(requirements={"goal": 1}),
    ],
)
def test_a_simulation_of_something_else_is_not_drawn(change: Callable[[dict[str, Any]], object]) -> None:
    found = json.loads(simulation(np.array(MOTION), 0.0))
    change(found)
    assert set(simulated(json.dumps(found))["motion"]) == {"planned", "flown"}


def test_the_separation_that_was_proved_is_drawn_beside_the_mission_s() -> None:
    made = plotted(RELAY, MOTION, {f"drone[{agent}]": flight(path) for agent, path in enumerate(np.array(MOTION))})
    pair = ("drone[0]", "drone[2]")
    proved = Check("flown separation", "all pairs", 0.1, "m", 0.0, True, 0.0, pair)
    made = replace(made, certificate=made.certificate.joined(Certificate("relay", (proved,))))
    chart = next(each for each in data(made)["charts"] if each["name"] == "separation")
    # Their centres are hypot(0.5, 0.5) apart at the start, their bodies 0.2 m less.
    assert {each["by"]: each["value"] for each in chart["limits"]} == {
        "mission": 0.0,
        "proof": pytest.approx(0.7071 - 0.2 - 0.1, abs=1e-3),
    }


# ---------------------------------------------------------------------- the page


def embedded(page: str) -> Any:
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.DOTALL)
    assert found
    return json.loads(found[1])


HOSTILE = """# </script><script>alert(1)</script> <!-- "quotes" 'single' & \\u003c/script> \U0001f681 %%SCRIPT%%
"""


def test_no_text_of_a_mission_breaks_out_of_its_place() -> None:
    text = RELAY.replace("require goal", HOSTILE + "require goal")
    page = report(plotted(text, MOTION)).decode()
    assert page.count("<script") == page.count("</script>") == 2
    assert "alert(1)" not in re.sub(r'<script type="application/json".*?</script>', "", page, flags=re.DOTALL)
    assert embedded(page)["texts"] == [{"name": "sample.mission", "text": text}]


def test_a_span_after_a_wide_letter_still_points_at_its_words() -> None:
    text = RELAY.replace("require goal", HOSTILE + "require goal")
    made = data(plotted(text, MOTION))
    _, start, end = made["lanes"][0]["place"]
    assert text[start:end] == "some drone: eventually[0, 3 s] far"


def test_the_page_s_policy_allows_its_own_script_and_nothing_else() -> None:
    page = report(plotted(RELAY, MOTION)).decode()
    script = re.findall(r'<script type="module">(.*?)</script>', page, re.DOTALL)[0]
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    policy = html.unescape(re.findall(r'Content-Security-Policy" content="([^"]*)"', page)[0])
    assert policy.startswith("default-src 'none'; ")
    assert f"script-src 'sha256-{digest}';" in policy
    assert "connect-src" not in policy


def test_the_page_refers_to_nothing_outside_itself() -> None:
    page = report(plotted(RELAY, MOTION)).decode()
    assert not re.search(r"https?:|\ssrc=|\shref=|@import|url\(|\bimport\s*\(|fetch\(|XMLHttp", page)


def test_the_same_plan_gives_the_same_page() -> None:
    assert report(plotted(RELAY, MOTION)) == report(plotted(RELAY, MOTION))


def test_ten_agents_in_a_thousand_steps_take_less_than_600_kilobytes() -> None:
    text = RELAY.replace("drone[3]", "drone[10]").replace("horizon 4 s", "horizon 1000 s").replace("4 s]", "1000 s]")
    time = np.linspace(0, 40, 1001)
    motion = np.stack(
        [
            np.stack([5 + (3 + 0.1 * agent) * np.sin(time + agent), 5 + 4 * np.cos(0.7 * time + agent)], axis=-1)
            for agent in range(10)
        ]
    )
    flights = {f"drone[{agent}]": flight(motion[agent]) for agent in range(10)}
    made = plotted(text, motion, flights, simulation(motion, 0.02))
    page = report(made)
    assert set(embedded(page.decode())["motion"]) == {"planned", "flown", "simulated"}
    assert len(page) <= 600_000


@pytest.mark.parametrize("name", SCRIPTS)
def test_the_page_s_scripts_parse(name: str) -> None:
    node = shutil.which("node")
    if node is None:
        pytest.skip("there is no node")
    run = subprocess.run([node, "--check", str(ASSETS / name)], capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr


def test_every_script_is_part_of_the_page() -> None:
    assert sorted(path.name for path in ASSETS.glob("*.js")) == sorted(SCRIPTS)


# -------------------------------------------------------------------- the command


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    assert write_folder(tmp_path / "out", written(), force=False) is None
    return tmp_path / "out"


@cache
def written() -> Mapping[str, bytes]:
    compiled = driver.compile(Source("a.mission", SMALL))
    assert isinstance(compiled.outcome, Verified)
    return compiled.outcome.files


def test_a_folder_s_own_files_give_the_page_that_lies_in_it(folder: Path, tmp_path: Path) -> None:
    run = CliRunner().invoke(
        commands, ["report", str(folder), "-o", str(tmp_path / "again.html")], standalone_mode=False
    )
    assert run.return_value == 0, run.output
    assert (tmp_path / "again.html").read_bytes() == (folder / "report.html").read_bytes()
    assert json.loads((folder / "manifest.json").read_text())["files"]["report.html"]


def test_the_page_lies_beside_the_folder_where_nothing_else_is_said(folder: Path, tmp_path: Path) -> None:
    run = CliRunner().invoke(commands, ["report", str(folder)], standalone_mode=False)
    assert run.return_value == 0
    assert (tmp_path / "out.html").exists()


def test_a_page_is_drawn_over_a_page_and_over_no_other_file_that_nobody_named(folder: Path, tmp_path: Path) -> None:
    page = tmp_path / "out.html"
    words = ["report", str(folder)]
    assert CliRunner().invoke(commands, words, standalone_mode=False).return_value == 0
    assert CliRunner().invoke(commands, words, standalone_mode=False).return_value == 0
    page.write_text("dear")
    run = CliRunner().invoke(commands, words, standalone_mode=False)
    assert run.return_value == 1
    assert "MC701" in run.output
    assert page.read_text() == "dear"
    assert CliRunner().invoke(commands, [*words, "-o", str(page)], standalone_mode=False).return_value == 0
    assert page.read_text() != "dear"


def test_a_page_has_its_folder_s_whole_name(folder: Path, tmp_path: Path) -> None:
    folder.rename(tmp_path / "v1.2")
    run = CliRunner().invoke(commands, ["report", str(tmp_path / "v1.2")], standalone_mode=False)
    assert run.return_value == 0
    assert (tmp_path / "v1.2.html").exists()


def test_a_page_is_not_drawn_into_the_folder_that_it_shows(folder: Path) -> None:
    before = (folder / "report.html").read_bytes(), sorted(folder.rglob("*"))
    for name in ("report.html", "mission/page.html", "plan.json"):
        run = CliRunner().invoke(commands, ["report", str(folder), "-o", str(folder / name)], standalone_mode=False)
        assert run.return_value == 1
        assert "MC702" in run.output
    assert ((folder / "report.html").read_bytes(), sorted(folder.rglob("*"))) == before


def test_a_folder_that_fails_is_drawn_with_what_fails(folder: Path, tmp_path: Path) -> None:
    mission = folder / "mission" / "a.mission"
    mission.write_text(mission.read_text() + "\nrequire corner: drone[0]: eventually[0, 3 s] (x >= 3.9 and y <= 0.1)\n")
    run = CliRunner().invoke(commands, ["report", str(folder)], standalone_mode=False)
    assert run.return_value == 5
    shown = embedded((tmp_path / "out.html").read_text())
    assert not shown["passed"]
    assert [(each["name"], each["subject"]) for each in shown["checks"] if not each["passed"]] == [
        ("manifest", "mission/a.mission"),
        ("requirement", "corner"),
    ]


def test_a_folder_that_cannot_be_read_gives_no_page(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    run = CliRunner().invoke(commands, ["report", str(tmp_path / "empty")], standalone_mode=False)
    assert run.return_value == 1
    assert "MC708" in run.output
    assert not (tmp_path / "empty.html").exists()


def test_two_folders_of_a_mission_are_one_page_whatever_its_file_is_called(folder: Path, tmp_path: Path) -> None:
    compiled = driver.compile(Source("renamed.mission", SMALL), seed=3)
    assert isinstance(compiled.outcome, Verified)
    assert write_folder(tmp_path / "second", compiled.outcome.files, force=False) is None
    run = CliRunner().invoke(commands, ["report", str(folder), str(tmp_path / "second")], standalone_mode=False)
    assert run.return_value == 0, run.output
    shown = embedded((tmp_path / "out-second.html").read_text())
    assert shown["compare"]["names"] == ["out", "second"]
    assert (shown["seed"], shown["compare"]["other"]["seed"]) == (0, 3)
    plan = (tmp_path / "second" / "plan.json").read_bytes()
    assert shown["compare"]["other"]["digest"] == hashlib.sha256(plan).hexdigest()


def test_folders_of_different_missions_are_refused_with_where_they_differ(folder: Path, tmp_path: Path) -> None:
    compiled = driver.compile(Source("a.mission", SMALL.replace("horizon 6 s", "horizon 7 s")))
    assert SMALL.replace("horizon 6 s", "horizon 7 s") != SMALL
    assert isinstance(compiled.outcome, Verified)
    assert write_folder(tmp_path / "second", compiled.outcome.files, force=False) is None
    run = CliRunner().invoke(commands, ["report", str(folder), str(tmp_path / "second")], standalone_mode=False)
    assert run.return_value == 1
    assert "MC716" in run.output
    assert "horizon 7 s` in the second" in run.output
    assert not (tmp_path / "out-second.html").exists()

"""The page of a flight that goes on: what it is told, what it keeps, and whom its server lets in."""

from __future__ import annotations

import http.client
import json
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest

from missionc.base.trace import Trace
from missionc.cli.flight_page import FlightPage
from missionc.output.flight_page.flight_record import AT_RISK, BROKEN, MOST_COLUMNS, MOST_NEWS, FlightRecord, Seen
from missionc.verification.monitoring.live.session import Session, Unusable
from tests.support.live_flights import FLIGHT, IN_TOUCH, line, session_of
from tests.support.unpacked_reports import unpacked


def recorded(text: str = FLIGHT) -> tuple[FlightRecord, Session]:
    checked, session = session_of(text)
    assert checked.kernel is not None
    return FlightRecord(session.mission, checked.kernel), session


def told(record: FlightRecord, seen: Seen | None = None) -> tuple[Seen, dict[str, Any]]:
    known, made = record.since(seen)
    return known, made()


def fly(record: FlightRecord, session: Session, *lines: str) -> None:
    for each in lines:
        for event in session.feed(each):
            record.take(event)


def test_a_page_that_knows_something_is_told_the_rest() -> None:
    record, session = recorded()
    known, first = told(record)
    assert first["world"]["goals"][0] == {
        "name": "there",
        "words": "drone[0]: eventually[0, 4 s] goal",
        "preference": False,
        "unit": "m",
    }
    assert first["columns"]["count"] == 0
    assert "now" not in first
    fly(record, session, line(0, (1, 1), (2, 1)), line(1, (1, 1), (2, 1.5)), line(2, (1, 1), (2, 1)))
    known, second = told(record, known)
    assert "world" not in second
    assert (second["columns"]["from"], second["columns"]["count"]) == (0, 3)
    assert unpacked(second["columns"]["place"]).reshape(2, 2, 3).tolist() == [
        [[1000, 1000, 1000], [2000, 2000, 2000]],
        [[1000, 1000, 1000], [1000, 1500, 1000]],
    ]
    assert second["stream"]["heard"] == 2.0
    assert second["now"]["goals"][0]["verdict"] == "violated"
    assert second["now"]["goals"][0]["since"] == 2.0
    assert [each["tone"] for each in second["news"]] == ["risk", "bad"]
    assert second["news"][-1]["says"].startswith("there: violated (final)")
    _, third = told(record, known)
    assert third["columns"]["count"] == 0
    assert third["news"] == []
    assert told(record)[1]["columns"]["count"] == 3


def test_what_is_kept_does_not_grow_with_the_mission() -> None:
    record, session = recorded(FLIGHT.replace("4 s", "100000 s"))
    assert record.stride == 50
    assert record.columns == MOST_COLUMNS + 1
    fly(record, session, *(line(time, (1, 1), (2, 1)) for time in range(102)))
    for number in range(2 * MOST_NEWS):
        record.take(Unusable(number, "no JSON"))
    _, message = told(record)
    assert message["columns"]["count"] == 3
    assert message["now"]["t"] == 101
    assert len(message["news"]) == MOST_NEWS


def test_an_agent_that_was_never_seen_is_nowhere() -> None:
    record, session = recorded()
    fly(record, session, *(json.dumps({"t": time, "agent": "drone[0]", "position": [1, 1]}) for time in (0, 1, 2, 3)))
    _, message = told(record)
    assert message["now"]["place"][1] is None
    assert message["now"]["missing"] == [1]
    assert unpacked(message["columns"]["seen"]).reshape(2, -1).min(axis=1).tolist() == [1, 0]
    assert any(each["says"] == "drone[1] missing" for each in message["news"])


def test_a_plan_and_a_world_are_told_again_when_they_change() -> None:
    record, _ = recorded()
    known, first = told(record)
    assert first["plan"] is None
    assert "plan" not in told(record, known)[1]
    position = np.ones((2, 5, 2))
    record.set_plan(Trace(1.0, position, np.zeros_like(position), np.zeros((2, 5))))
    known, second = told(record, known)
    assert unpacked(second["plan"]).tolist() == [1000] * 20
    checked, _ = session_of(FLIGHT + "region closed = box (0, 4) to (1, 5)\n")
    assert checked.mission is not None
    assert checked.kernel is not None
    record.set_world(checked.mission, checked.kernel)
    _, third = told(record, known)
    assert [region["name"] for region in third["world"]["regions"]] == ["goal", "closed"]
    assert unpacked(third["plan"]).tolist() == [1000] * 20


def changes(message: dict[str, Any]) -> list[list[int]]:
    found: list[list[int]] = unpacked(message["columns"]["changes"]["radio"]).reshape(-1, 4).tolist()
    return found


def pairs(message: dict[str, Any], kind: str) -> list[int]:
    found: list[int] = unpacked(message["now"]["couplings"]["graphs"]["radio"][kind]).tolist()
    return found


def test_links_are_told_as_they_begin_and_end_and_while_they_are_at_risk_or_broken() -> None:
    record, session = recorded(IN_TOUCH)
    position = np.ones((2, 5, 2))
    record.set_plan(Trace(1.0, position, np.zeros_like(position), np.zeros((2, 5))))
    known, first = told(record)
    assert first["world"]["graphs"] == [{"name": "radio", "directed": False}]
    assert first["world"]["formations"] == [{"name": "pair", "edges": [[0, 1]]}]
    fly(record, session, line(0, (1, 1), (2, 1)), line(1, (1, 1), (3, 1)))
    known, there = told(record, known)
    # Two metres apart, going on at one metre in a step: exactly as far as the link reaches.
    assert changes(there) == [[0, 0, 1, 1]]
    assert (pairs(there, "risk"), pairs(there, "broken")) == ([0, 1], [])
    assert there["now"]["couplings"]["formations"]["pair"] == [AT_RISK]
    assert unpacked(there["columns"]["margins"]["pair"]).tolist() == [-500, 500]
    fly(record, session, line(2, (1, 1), (4.5, 1)), line(3, (1, 1), (4.5, 1)))
    known, gone = told(record, known)
    assert changes(gone) == [[2, 0, 1, 0]]
    assert (pairs(gone, "risk"), pairs(gone, "broken")) == ([], [0, 1])
    assert gone["now"]["couplings"]["formations"]["pair"] == [BROKEN]
    _, whole = told(record)
    assert changes(whole) == [[0, 0, 1, 1], [2, 0, 1, 0]]


def test_links_are_looked_for_ten_times_a_second_and_those_of_the_past_once_a_column() -> None:
    record, session = recorded(IN_TOUCH.replace("step 1 s", "step 0.01 s").replace("<= 2 m/s", "<= 200 m/s"))
    for step in range(15):
        fly(record, session, line(step / 100, (1, 1), (2 + 0.2 * step, 1)))
    _, message = told(record)
    # 3 m apart at the tenth step.
    assert changes(message) == [[0, 0, 1, 1], [10, 0, 1, 0]]
    record, session = recorded(IN_TOUCH.replace("4 s", "100000 s"))
    for step in range(8):
        fly(record, session, line(step, (1, 1), (2 + 0.4 * step, 1)))
    _, message = told(record)
    assert changes(message) == [[0, 0, 1, 1]]
    assert pairs(message, "linked") == []


def test_who_is_not_seen_is_linked_to_nobody_for_sure() -> None:
    record, session = recorded(IN_TOUCH)
    alone = (json.dumps({"t": time, "agent": "drone[0]", "position": [1, 1]}) for time in (1, 2, 3))
    fly(record, session, line(0, (1, 1), (2, 1)), *alone)
    _, message = told(record)
    assert changes(message) == [[0, 0, 1, 1]]
    assert pairs(message, "risk") == [0, 1]
    never, other = recorded(IN_TOUCH)
    fly(never, other, *(json.dumps({"t": time, "agent": "drone[0]", "position": [1, 1]}) for time in (0, 1, 2)))
    _, message = told(never)
    assert changes(message) == []
    assert message["now"]["couplings"]["formations"]["pair"] == [BROKEN]


# ------------------------------------------------------------------- the server


@contextmanager
def served() -> Iterator[tuple[FlightPage, Session]]:
    checked, session = session_of()
    assert checked.kernel is not None
    with FlightPage(session.mission, checked.kernel) as page:
        yield page, session


def ask(page: FlightPage, path: str | None = None, **headers: str) -> http.client.HTTPResponse:
    parts = urlsplit(page.address)
    client = http.client.HTTPConnection("127.0.0.1", parts.port or 0, timeout=60)
    client.putrequest("GET", parts.path if path is None else path, skip_host="Host" in headers)
    for name, value in headers.items():
        client.putheader(name.replace("_", "-"), value)
    client.endheaders()
    return client.getresponse()


def test_the_page_is_sent_to_whoever_knows_its_address() -> None:
    with served() as (page, _):
        answer = ask(page)
        assert answer.status == 200
        policy = answer.headers["Content-Security-Policy"]
        assert "default-src 'none'; script-src 'sha256-" in policy
        assert "frame-ancestors 'none'" in policy
        assert b"<h2>Events</h2>" in answer.read()
        assert ask(page, urlsplit(page.address).path + "plan.json").status == 404


def test_a_stranger_is_refused() -> None:
    with served() as (page, _):
        port = urlsplit(page.address).port
        for path in ("/", "/news", "/x/", f"/{'a' * 32}/news"):
            assert ask(page, path).status == 403
        assert ask(page, Host=f"evil.example:{port}").status == 403
        assert ask(page, Sec_Fetch_Site="cross-site").status == 403
        assert ask(page, Host=f"localhost:{port}").status == 200


def test_every_page_hears_what_is_published_from_the_beginning() -> None:
    with served() as (page, session):
        for event in session.feed(line(0, (1, 1), (2, 1))):
            page.publish(event)
        page.heard(session.steps.newest)
        page.tell("`north` is closed", "risk", 0.5)
        page.end("the stream has ended")
        for _ in range(2):
            stream = ask(page, urlsplit(page.address).path + "news")
            assert stream.headers["Content-Type"] == "text/event-stream"
            message = json.loads(stream.readline().removeprefix(b"data: "))
            assert message["columns"]["count"] == 1
            assert message["news"] == [{"number": 1, "t": 0.5, "tone": "risk", "says": "`north` is closed"}]
            assert message["stream"]["heard"] == 0
            assert message["stream"]["ended"] == "the stream has ended"
            stream.close()


@pytest.mark.parametrize("words", [("--page",), ("--no-open",), ("--live", "--no-open")])
def test_what_does_not_go_with_the_page_is_refused(words: tuple[str, ...], tmp_path: Any) -> None:
    from missionc.cli.app import main

    mission = tmp_path / "flight.mission"
    mission.write_text(FLIGHT, encoding="utf-8")
    assert main(["monitor", str(mission), *words]) == 2

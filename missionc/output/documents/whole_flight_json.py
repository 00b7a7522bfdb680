"""The flight from takeoff to landing as JSON: its phases on the mission's clock, and the agents' main positions."""

from __future__ import annotations

from collections.abc import Mapping

from missionc.geometry.columns import FLOOR
from missionc.geometry.curves.piecewise_polynomials import read
from missionc.ir import Mission
from missionc.output.folder.file_names import file_names, way_file
from missionc.output.json_layout import compact, document, listed
from missionc.verification.certificate import Check
from missionc.verification.flight.verify_whole_flight import pad_turns, pieces_of, whole_phases
from missionc.verification.flight.way_missions import Stage, Ways, is_whole, ways_of

SCHEMA = "missionc.whole_flight/1"


def whole_flight_json(mission: Mission, files: Mapping[str, str], ways: Ways) -> str:
    """Content of ``whole_flight.json``.

    Args:
        files: verified polynomials of each agent.
        ways: verified transfers.
    """
    flown = pieces_of(mission, files)
    assert not isinstance(flown, Check), "polynomials that were verified can be read"
    wanted = ways_of(mission, flown)
    begins, ends = wanted[Stage.OUT], wanted[Stage.HOME]
    rows = phases_on_the_clock(mission, files, ways)
    agents = [
        {
            "agent": agent.name,
            "pad": _point([*ends.end[agent.index, :2].tolist(), FLOOR]),
            "hover": _point(ends.end[agent.index].tolist()),
            "start": _point(begins.end[agent.index].tolist()),
            "finish": _point(ends.begin[agent.index].tolist()),
        }
        for agent in mission.agents
    ]
    head = {
        "schema": SCHEMA,
        "mission": mission.name,
        "seconds": round(rows[-1][2] - rows[0][1], 6),
        "turns": [[mission.agents[index].name for index in turn] for turn in reversed(pad_turns(mission, ends.end))],
    }
    phases = ({"phase": name, "begin": round(begin, 6), "end": round(end, 6)} for name, begin, end in rows)
    return document(head, listed("phases", map(compact, phases)), listed("agents", map(compact, agents)))


def ways_in(mission: Mission, files: Mapping[str, bytes]) -> Ways:
    """Texts of the transfers in the files of a folder; a missing file of a transfer has an empty text."""
    names, found = file_names(mission.agents), {}
    for stage in Stage if is_whole(mission) else ():
        own = {agent.name: files.get(way_file(stage.value, names[agent.name])) for agent in mission.agents}
        if any(content is not None for content in own.values()):
            found[stage] = {name: (content or b"").decode("utf-8", errors="replace") for name, content in own.items()}
    return found


def phases_on_the_clock(mission: Mission, files: Mapping[str, str], ways: Ways) -> list[tuple[str, float, float]]:
    """Phases of a flight, each with its start and end in seconds since the mission began, negative before."""
    flown = pieces_of(mission, files)
    assert not isinstance(flown, Check), "polynomials that were verified can be read"
    lengths = {stage: _seconds(files_of) for stage, files_of in ways.items()}
    out, home = lengths.get(Stage.OUT, 0.0), lengths.get(Stage.HOME, 0.0)
    duration = float(next(iter(flown.values())).times[-1])
    lasting = whole_phases(mission, ways_of(mission, flown), out + duration + home)
    begin = -(lasting.before + out)
    rows = []
    for name, seconds in (
        ("rise", lasting.rounds * lasting.rise),
        ("hover", lasting.hover),
        ("out", out),
        ("mission", duration),
        ("home", home),
        ("hover", lasting.settle),
        ("land", lasting.rounds * lasting.sink),
    ):
        if seconds > 0:
            # The mission's own beginning is exactly 0.
            begin = 0.0 if name == "mission" else begin
            rows.append((name, begin, begin + seconds))
            begin += seconds
    return rows


def _seconds(files: Mapping[str, str]) -> float:
    own = read(next(iter(files.values())))
    assert not isinstance(own, str), "polynomials that were verified can be read"
    return float(own.times[-1])


def _point(values: list[float]) -> list[float]:
    return [round(value, 6) + 0.0 for value in values]

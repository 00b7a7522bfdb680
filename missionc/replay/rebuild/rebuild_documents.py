"""Rebuilt documents of a folder, from what was verified, compared with those that lie in it.

    in   OutputFolder, and the Certificate of its plan and its flight
    out  Checks: of each document, and of each entry of the manifest

What people read and what flies is computed from the mission, the plan and the
polynomials alone. Where that can be done on any machine to the byte, bytes are
compared; where numbers are computed, they may differ by rounding.
"""

from __future__ import annotations

from collections.abc import Iterator

from missionc.base.limits import Limits
from missionc.curves.crazyflie_csv import Pieces, read, written
from missionc.output.documents.safe_end_json import read_safe_end, safe_end_json
from missionc.output.documents.trajectories_csv import trajectories
from missionc.output.documents.whole_flight_json import whole_flight_json
from missionc.output.folder.file_names import (
    PAST,
    REPORT,
    SAFE_END,
    SIMULATION,
    WHOLE_FLIGHT,
    file_names,
    polynomials_file,
    stop_file,
    way_file,
)
from missionc.progression.past_document import past_json
from missionc.replay.read_folder import CERTIFICATE, PLAN, OutputFolder
from missionc.replay.rebuild.alternatives import Judged, check_alternatives, table_of
from missionc.replay.rebuild.export_files import check_exports
from missionc.replay.rebuild.manifest_entries import check_manifest
from missionc.replay.rebuild.plan_document import check_plan, plan_of
from missionc.replay.rebuild.report_page import check_page, page
from missionc.replay.rebuild.simulation_document import check_simulation
from missionc.replay.rebuild.verdict import verdict
from missionc.verify.certificate import Certificate, Check
from missionc.verify.compare_documents import same_text
from missionc.verify.flight.verify_safe_end import has_safe_end
from missionc.verify.flight.way_missions import is_whole

__all__ = ["check_documents", "page"]

TRAJECTORIES = "trajectories.csv"
ALWAYS = (PLAN, TRAJECTORIES, CERTIFICATE, REPORT)
"""What every folder holds, beside polynomials and the mission."""


def check_documents(
    opened: OutputFolder, flown: Certificate, limits: Limits | None, others: list[Judged]
) -> Iterator[Check]:
    """What the files say and hold, compared with what the mission, the plan and the polynomials come to.

    Args:
        flown: of the plan, its polynomials and the time between the steps; it has passed.
        limits: absent where a simulation was flown just now, and is not to be flown once more.
        others: the further plans in the folder, with what was verified of each.
    """
    plan = plan_of(opened)
    names = file_names(opened.mission.agents)
    states = trajectories(opened.mission, opened.trace).encode()
    yield from check_manifest(opened)
    yield from (verdict(name, "it is missing") for name in ALWAYS if name not in opened.files)
    yield check_plan(opened, plan)
    same = opened.files.get(TRAJECTORIES, states) == states
    yield verdict(TRAJECTORIES, "" if same else f"it does not hold the states of `{PLAN}`")
    for agent in opened.mission.agents:
        yield _polynomials(polynomials_file(names[agent.name]), opened.flights[agent.name])
    for stage, texts in opened.ways.items():
        for name, text in texts.items():
            yield _polynomials(way_file(stage.value, names[name]), text)
    if opened.checked.past is not None:
        for name, text in opened.stops.items():
            yield _polynomials(stop_file(names[name]), text)
        same = past_json(opened.checked.past) == opened.text(PAST)
        yield verdict(PAST, "" if same else "it is not written as the compiler writes it")
    if is_whole(opened.mission):
        yield _whole_flight(opened)
    if has_safe_end(opened.mission):
        yield _safe_end(opened)
    yield from check_exports(opened)
    if SIMULATION in opened.files and limits:
        yield check_simulation(opened, limits)
    table = table_of(opened, flown, others)
    yield from check_alternatives(opened, others, table)
    if REPORT in opened.files:
        yield check_page(opened, plan, flown, others, table)


def _whole_flight(opened: OutputFolder) -> Check:
    if WHOLE_FLIGHT not in opened.files:
        return verdict(WHOLE_FLIGHT, "it is missing")
    made = whole_flight_json(opened.mission, opened.flights, opened.ways)
    same = same_text(opened.text(WHOLE_FLIGHT), made)
    return verdict(WHOLE_FLIGHT, "" if same else "its phases or places are not those of the polynomials")


def _safe_end(opened: OutputFolder) -> Check:
    """That nothing else is written in it than the stops that were judged, in the one form."""
    if SAFE_END not in opened.files:
        return verdict(SAFE_END, "it is missing")
    stops = read_safe_end(opened.text(SAFE_END), opened.mission)
    same = not isinstance(stops, str) and safe_end_json(opened.mission, stops) == opened.text(SAFE_END)
    return verdict(SAFE_END, "" if same else "it is not written as the compiler writes it")


def _polynomials(name: str, text: str) -> Check:
    """That a program which reads numbers in another way than we do reads the ones that were verified."""
    pieces = read(text)
    same = isinstance(pieces, Pieces) and written(pieces) == text
    return verdict(name, "" if same else "its numbers are not written as the compiler writes them")

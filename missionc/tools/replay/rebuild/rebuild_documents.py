"""Check of the documents in a plan folder: each is computed from verified data and compared.

    in   OutputFolder, and the Certificate of its plan and its flight
    out  Checks: of each document, ``report.html`` included, and of each entry of the manifest

Documents for people and for vehicles are computed from the mission, the plan and the polynomials alone. Bytes are
compared if every machine computes the same bytes; otherwise numbers may differ by rounding.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from missionc.base.limits import Limits
from missionc.base.strict_json import is_finite_number, parse_json
from missionc.base.trace import Plan
from missionc.compiler.provenance import texts
from missionc.geometry.curves.piecewise_polynomials import Pieces, read, written
from missionc.output.documents.alternatives_json import AlternativeRow
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
from missionc.output.folder.manifest import sha256
from missionc.output.report.report_html import Plotted, report
from missionc.output.with_alternatives import others
from missionc.planning.progression.past_document import past_json
from missionc.tools.replay.read_folder import CERTIFICATE, PLAN, OutputFolder
from missionc.tools.replay.rebuild.alternatives import Judged, check_alternatives, table_of
from missionc.tools.replay.rebuild.export_files import check_exports
from missionc.tools.replay.rebuild.manifest_entries import check_manifest
from missionc.tools.replay.rebuild.plan_document import check_plan, plan_of
from missionc.tools.replay.rebuild.simulation_document import check_simulation
from missionc.tools.replay.rebuild.verdict import verdict
from missionc.verification.certificate import Certificate, Check
from missionc.verification.compare_documents import difference, same_text
from missionc.verification.flight.verify_safe_end import has_safe_end
from missionc.verification.flight.way_missions import is_whole

BEGIN, END = '<script type="application/json" id="data">', "</script>"
OTHER = "it differs from the page of this version of the compiler"
NOISE = 1e-6
"""Magnitude below which a margin is 0 up to rounding; its time and agents then depend on the machine."""


def page(
    opened: OutputFolder,
    certificate: Certificate,
    plan: Plan | None = None,
    judged: Sequence[Judged] = (),
    table: Sequence[AlternativeRow] = (),
) -> bytes:
    """Report page of a folder with the results of a certificate.

    Args:
        opened: plan folder.
        certificate: certificate to show.
        plan: its plan, computed if None.
        judged: further plans in the folder with their certificates.
        table: table of all plans; empty for a folder with one plan.
    """
    plots = [plotted(opened, certificate, plan), *(plotted(each, own) for each, own in judged)]
    return report(plots[0], others(plots, table) if table else ())


def plotted(opened: OutputFolder, certificate: Certificate, plan: Plan | None = None) -> Plotted:
    """Report data of a folder's plan.

    Args:
        opened: plan folder.
        certificate: certificate to show.
        plan: its plan, computed if None.
    """
    return Plotted(
        opened.mission,
        opened.kernel,
        plan or plan_of(opened),
        certificate,
        opened.flights,
        texts(opened.checked),
        simulation=opened.text(SIMULATION),
        digest=sha256(opened.files[PLAN]) if PLAN in opened.files else "",
        ways=opened.ways,
        past=opened.text(PAST),
    )


def check_page(
    opened: OutputFolder,
    plan: Plan,
    flown: Certificate,
    judged: Sequence[Judged] = (),
    table: Sequence[AlternativeRow] = (),
) -> Check:
    """Check of the report page: its program, words and pictures must be equal; numbers may differ by rounding.

    Args:
        opened: plan folder.
        plan: its plan.
        flown: certificate of the flight.
        judged: further plans in the folder with their certificates.
        table: table of all plans.
    """
    drawn, lying = page(opened, flown, plan, judged, table).decode("utf-8"), opened.files[REPORT]
    if lying == drawn.encode("utf-8"):
        return verdict(REPORT, None)
    try:
        shell, data = _split(lying.decode("utf-8"))
        own_shell, own = _split(drawn)
    except ValueError:
        return verdict(REPORT, OTHER)
    mission = opened.mission
    names, end = {agent.name for agent in mission.agents}, float(mission.horizon) + NOISE
    same = shell == own_shell
    return verdict(REPORT, difference(_settled(data, names, end), _settled(own, names, end)) if same else OTHER)


def _split(text: str) -> tuple[tuple[str, str], Any]:
    """Split a report page into the texts before and after its data, and the parsed data.

    Raises:
        ValueError: there is no data.
    """
    before, begin, rest = text.partition(BEGIN)
    data, end, after = rest.partition(END)
    if not (begin and end):
        raise ValueError("no data")
    return (before, after), parse_json(data)


def _settled(data: Any, names: set[str], end: float) -> Any:
    """Report data without the times and agents of margins that are 0 up to rounding, if they are plausible.

    Args:
        data: parsed data; changed in place.
        names: names of the agents.
        end: end of the mission, s.
    """
    further = data.get("others") if isinstance(data, dict) else None
    for other in further if isinstance(further, list) else []:
        _settled(other, names, end)
    rows = data.get("checks") if isinstance(data, dict) else None
    for row in rows if isinstance(rows, list) else []:
        if isinstance(row, dict) and is_finite_number(row.get("margin")) and abs(row["margin"]) <= NOISE:
            when, who = row.get("at"), row.get("agents")
            if is_finite_number(when) and 0 <= when <= end:
                row["at"] = None
            if isinstance(who, list) and names.issuperset(map(str, who)):
                row["agents"] = len(who)
    return data


__all__ = ["check_documents", "page"]

TRAJECTORIES = "trajectories.csv"
ALWAYS = (PLAN, TRAJECTORIES, CERTIFICATE, REPORT)
"""Names of the files in every folder, apart from polynomials and the mission."""


def check_documents(
    opened: OutputFolder, flown: Certificate, limits: Limits | None, others: list[Judged]
) -> Iterator[Check]:
    """Yield the checks of the documents against the mission, the plan and the polynomials.

    Args:
        opened: plan folder.
        flown: passed certificate of the plan, its polynomials and the time between the steps.
        limits: maximum sizes; None if a simulation was just flown and need not be repeated.
        others: further plans in the folder with their certificates.
    """
    plan = plan_of(opened)
    names = file_names(opened.mission.agents)
    states = trajectories(opened.mission, opened.trace).encode()
    yield from check_manifest(opened)
    yield from (verdict(name, "it is missing") for name in ALWAYS if name not in opened.files)
    yield check_plan(opened, plan)
    same = opened.files.get(TRAJECTORIES, states) == states
    yield verdict(TRAJECTORIES, "" if same else f"it does not contain the states of `{PLAN}`")
    for agent in opened.mission.agents:
        yield _polynomials(polynomials_file(names[agent.name]), opened.flights[agent.name])
    for stage, way in opened.ways.items():
        for name, text in way.items():
            yield _polynomials(way_file(stage.value, names[name]), text)
    if opened.checked.past is not None:
        for name, text in opened.stops.items():
            yield _polynomials(stop_file(names[name]), text)
        same = past_json(opened.checked.past) == opened.text(PAST)
        yield verdict(PAST, "" if same else "it is not in the format of the compiler")
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
    return verdict(WHOLE_FLIGHT, "" if same else "its phases or positions do not match the polynomials")


def _safe_end(opened: OutputFolder) -> Check:
    """Check that the file of safe ends contains exactly the verified stops, in the compiler's format."""
    if SAFE_END not in opened.files:
        return verdict(SAFE_END, "it is missing")
    stops = read_safe_end(opened.text(SAFE_END), opened.mission)
    same = not isinstance(stops, str) and safe_end_json(opened.mission, stops) == opened.text(SAFE_END)
    return verdict(SAFE_END, "" if same else "it is not in the format of the compiler")


def _polynomials(name: str, text: str) -> Check:
    """Check that a polynomial file is in the compiler's format, so that other parsers read the verified numbers."""
    pieces = read(text)
    same = isinstance(pieces, Pieces) and written(pieces) == text
    return verdict(name, "" if same else "its numbers are not in the format of the compiler")

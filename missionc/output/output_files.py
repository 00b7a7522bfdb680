"""All files of the output folder as bytes, built from a verified plan; nothing is written here.

in   Mission, its kernel, Plan, its Certificate, the names of exports
out  Output: the files by name, and the certificate with the checks on the polynomials
says MC703 MC711, and the codes of exports
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from missionc.base.diagnostics.model import Diagnostic
from missionc.base.late_dataclass import Record
from missionc.base.trace import Plan
from missionc.flight.trajectories.required_performance import required_performance
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from missionc.output.documents.certificate_json import certificate_json
from missionc.output.documents.plan_json import plan_json
from missionc.output.documents.safe_end_json import safe_end_json, safe_end_noted
from missionc.output.documents.trajectories_csv import trajectories
from missionc.output.documents.whole_flight_json import phases_on_the_clock, whole_flight_json
from missionc.output.export.formats import FORMATS, flight
from missionc.output.folder.file_names import (
    MANIFEST,
    MISSION,
    PAST,
    REPORT,
    SAFE_END,
    WHOLE_FLIGHT,
    file_names,
    polynomials_file,
    stop_file,
    way_file,
)
from missionc.output.folder.manifest import Option, Provenance, manifest, sha256
from missionc.output.report.report_html import Plotted, report
from missionc.verification.certificate import Certificate
from missionc.verification.flight.verify_stops import Stops, verify_stops
from missionc.verification.flight.verify_whole_flight import Stop
from missionc.verification.flight.way_missions import Ways, has_risen, is_whole
from missionc.verification.verify_plan import verify_between, with_delays

__all__ = ["Option", "Output", "Provenance", "emit", "plan_json"]


class WholeFlight(Record, eq=False):
    """Transfers and safe ends of a flight, with their checks; a mission that begins in the air has no transfers."""

    ways: Ways
    stops: tuple[Stop, ...]
    certificate: Certificate


PlanWays = Callable[[Mission, Mapping[str, str]], WholeFlight | Diagnostic | None]
"""Function from a mission and its polynomials to its transfers and safe ends; None if it has neither."""


def no_ways(mission: Mission, files: Mapping[str, str]) -> WholeFlight | Diagnostic | None:
    """Return no transfers and safe ends; the default of ``plan_ways``."""
    return None


class Output(Record):
    """Files of the output folder in a fixed order, and the complete certificate.

    ``notes`` inform the user of the flight and of the exports, ``findings`` explain missing exports.
    """

    files: tuple[tuple[str, bytes], ...]
    certificate: Certificate
    notes: tuple[str, ...] = ()
    findings: tuple[Diagnostic, ...] = ()


def emit(
    mission: Mission,
    kernel: Kernel,
    plan: Plan,
    certificate: Certificate,
    provenance: Provenance,
    exports: tuple[str, ...] = (),
    plan_ways: PlanWays = no_ways,
    stops: Stops | None = None,
) -> Output | Diagnostic:
    """Files of a verified plan, or a diagnostic that states why its polynomials cannot be flown.

    Equal arguments give equal bytes.

    Args:
        mission, kernel: mission of the plan.
        plan: verified plan.
        certificate: its certificate.
        provenance: origin of the plan, for the manifest.
        exports: names of export formats to write in addition.
        plan_ways: function that plans transfers from and to the floor for verified polynomials.
        stops: trajectory of every agent until the beginning of a plan made in flight.
    """
    # Imported here: redrawing a folder needs no fit and no solver.
    from missionc.flight.trajectories.crazyflie import crazyflie
    from missionc.flight.trajectories.refusals import not_flyable

    flyable = crazyflie(mission, kernel, plan.trace, provenance.stretch)
    if isinstance(flyable, Diagnostic):
        return flyable
    planned = plan_ways(mission, flyable.files)
    if isinstance(planned, Diagnostic):
        return planned
    whole = with_delays(mission, kernel, plan.trace, certificate).joined(flyable.certificate)
    if stops is not None:
        whole = whole.joined(verify_stops(stops))
        if not whole.passed:
            return not_flyable(mission, list(whole.failures))
    whole = whole if planned is None else whole.joined(planned.certificate)
    whole = whole.joined(verify_between(mission, kernel, plan.trace, flyable.files))
    files = {
        "plan.json": plan_json(mission, plan).encode(),
        "trajectories.csv": trajectories(mission, plan.trace).encode(),
    }
    names = file_names(mission.agents)
    for agent in mission.agents:
        files[polynomials_file(names[agent.name])] = flyable.files[agent.name].encode()
    if stops is not None:
        files.update({stop_file(names[name]): text.encode() for name, text in stops.files.items()})
    if provenance.past:
        files[PAST] = provenance.past.encode()
    ways = {} if planned is None else planned.ways
    for stage, own in ways.items():
        files |= {way_file(stage.value, names[name]): text.encode() for name, text in own.items()}
    notes = list(required_performance(mission, flyable.certificate))
    if planned is not None:
        files[SAFE_END] = safe_end_json(mission, planned.stops).encode()
        notes += safe_end_noted(planned.certificate)
    if is_whole(mission):
        files[WHOLE_FLIGHT] = whole_flight_json(mission, flyable.files, ways).encode()
        notes.append(_phases_noted(mission, flyable.files, ways))
    findings: list[Diagnostic] = []
    for name in dict.fromkeys(exports):
        made = FORMATS[name].export(flight(mission, kernel, plan.trace, flyable.files, ways, bool(provenance.past)))
        if isinstance(made, Diagnostic):
            findings.append(made)
            continue
        notes += made.notes
        files.update({f"export/{name}/{file}": content for file, content in made.files.items()})
    for name, content in provenance.inputs:
        files[f"{MISSION}/{name}"] = content
    digest = sha256(files["plan.json"])
    files["certificate.json"] = certificate_json(whole, digest).encode()
    texts = tuple((name, content.decode("utf-8")) for name, content in provenance.inputs if name not in provenance.data)
    plotted = Plotted(
        mission, kernel, plan, whole, flyable.files, texts, digest=digest, ways=ways, past=provenance.past
    )
    files[REPORT] = report(plotted)
    files[MANIFEST] = manifest(plan, provenance, files).encode()
    return Output(tuple(files.items()), whole, tuple(notes), tuple(findings))


def _phases_noted(mission: Mission, files: Mapping[str, str], ways: Ways) -> str:
    """Note for the user on the duration of the flight and of each of its phases."""
    rows = phases_on_the_clock(mission, files, ways)
    each = ", ".join(f"{name} {end - begin:.4g} s" for name, begin, end in rows)
    where = "to landing" if has_risen(mission) else "from takeoff to landing"
    return f"whole flight: {rows[-1][2] - rows[0][1]:.4g} s {where} ({each})"

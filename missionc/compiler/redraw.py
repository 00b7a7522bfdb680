"""Documents of a verified plan recreated from its files: the report, and all lists of later attempts.

in   a checked mission, Verified, StageLog
out  Plotted; Verified with the attempts that came after its certification
"""

from __future__ import annotations

import json
from dataclasses import replace

from missionc.compiler.front_end import Checked
from missionc.compiler.plan_request import StageLog
from missionc.compiler.provenance import texts
from missionc.compiler.results import Verified
from missionc.output.documents.certificate_json import certificate_json
from missionc.output.documents.plan_json import plan_json
from missionc.output.documents.whole_flight_json import ways_in
from missionc.output.folder.file_names import MANIFEST, PAST, REPORT, file_names, polynomials_file
from missionc.output.folder.manifest import relisted, sha256
from missionc.output.report.report_html import Plotted, report

PLAN, CERTIFICATE = "plan.json", "certificate.json"


def plotted_of(checked: Checked, verified: Verified) -> Plotted:
    """Plan, certificate and trajectories of a verified plan, as the report needs them."""
    mission, files = checked.valid_mission, verified.files
    names = file_names(mission.agents)
    return Plotted(
        mission,
        checked.valid_kernel,
        verified.plan,
        verified.certificate,
        {agent.name: files[polynomials_file(names[agent.name])].decode() for agent in mission.agents},
        texts(checked),
        digest=sha256(files[PLAN]),
        ways=ways_in(mission, files),
        past=files.get(PAST, b"").decode(),
    )


def with_attempts(checked: Checked, verified: Verified, log: StageLog) -> Verified:
    """The verified plan with all attempts of a log listed in its documents; unchanged if they are already listed."""
    plan, runs = verified.plan, tuple(log.runs)
    if plan.runs == runs:
        return verified
    plan, files = replace(plan, runs=runs), dict(verified.files)
    files[PLAN] = plan_json(checked.valid_mission, plan).encode()
    files[CERTIFICATE] = certificate_json(verified.certificate, sha256(files[PLAN])).encode()
    drawn = replace(verified, plan=plan, files=files)
    files[REPORT] = report(plotted_of(checked, drawn))
    files[MANIFEST] = relisted(json.loads(files[MANIFEST]), {name: files[name] for name in (PLAN, CERTIFICATE, REPORT)})
    return drawn

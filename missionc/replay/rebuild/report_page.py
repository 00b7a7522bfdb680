"""Rebuilt ``report.html``, from what was verified, compared with the one that lies in the folder."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from missionc.base.strict_json import is_number, parse_json
from missionc.base.trace import Plan
from missionc.output.documents.alternatives_json import AlternativeRow
from missionc.output.folder.file_names import PAST, REPORT, SIMULATION
from missionc.output.folder.manifest import sha256
from missionc.output.report.report_html import Plotted, report
from missionc.output.with_alternatives import others
from missionc.pipeline.provenance import texts
from missionc.replay.read_folder import PLAN, OutputFolder
from missionc.replay.rebuild.alternatives import Judged
from missionc.replay.rebuild.plan_document import plan_of
from missionc.replay.rebuild.verdict import verdict
from missionc.verify.certificate import Certificate, Check
from missionc.verify.compare_documents import difference

BEGIN, END = '<script type="application/json" id="data">', "</script>"
OTHER = "it is not the page that this version of the compiler draws"
NOISE = 1e-6
"""A margin no larger is met to rounding: when it is tightest, and whose it is, depends on the machine."""


def page(
    opened: OutputFolder,
    certificate: Certificate,
    plan: Plan | None = None,
    judged: Sequence[Judged] = (),
    table: Sequence[AlternativeRow] = (),
) -> bytes:
    """The page of a folder, with what a certificate says of it.

    Args:
        judged: the further plans in it, with what was verified of each.
        table: of all of them; nothing of a folder with one plan.
    """
    plots = [plotted(opened, certificate, plan), *(plotted(each, own) for each, own in judged)]
    return report(plots[0], others(plots, table) if table else ())


def plotted(opened: OutputFolder, certificate: Certificate, plan: Plan | None = None) -> Plotted:
    """What the page shows of a folder's plan, with what a certificate says of it."""
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
    """The same program, words and pictures; numbers but for rounding."""
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
    """The page without its data, and the data.

    Raises:
        ValueError: there are none.
    """
    before, begin, rest = text.partition(BEGIN)
    data, end, after = rest.partition(END)
    if not (begin and end):
        raise ValueError("no data")
    return (before, after), parse_json(data)


def _settled(data: Any, names: set[str], end: float) -> Any:
    """Without the time and the agents of what is met to rounding, where they can be right."""
    further = data.get("others") if isinstance(data, dict) else None
    for other in further if isinstance(further, list) else []:
        _settled(other, names, end)
    rows = data.get("checks") if isinstance(data, dict) else None
    for row in rows if isinstance(rows, list) else []:
        if isinstance(row, dict) and is_number(row.get("margin")) and abs(row["margin"]) <= NOISE:
            when, who = row.get("at"), row.get("agents")
            if is_number(when) and 0 <= when <= end:
                row["at"] = None
            if isinstance(who, list) and names.issuperset(map(str, who)):
                row["agents"] = len(who)
    return data

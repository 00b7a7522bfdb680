"""A compilation with the further plans that were asked for: ranked, described, and written into one folder.

in   Compiled with a verified plan, how many plans are wanted
out  Compiled whose outcome is the best of them, with ``alternatives``
"""

from __future__ import annotations

from dataclasses import replace

from missionc.backends.api import Budget
from missionc.backends.options import Options
from missionc.base.throughout import Throughout
from missionc.ir import Mission
from missionc.kernel.nodes import Kernel
from missionc.output.documents.alternatives_json import rows
from missionc.output.documents.whole_flight_json import ways_in
from missionc.output.folder.file_names import file_names, polynomials_file
from missionc.output.folder.manifest import sha256
from missionc.output.report.report_html import Plotted
from missionc.output.with_alternatives import with_alternatives as joined_files
from missionc.pipeline.alternatives.search_alternatives import search_alternatives
from missionc.pipeline.front_end import Stopwatch
from missionc.pipeline.provenance import texts
from missionc.pipeline.results import Alternative, Compiled, Verified


def with_alternatives(
    first: Compiled, wanted: int, options: Options, budget: Budget, exports: tuple[str, ...], throughout: Throughout
) -> Compiled:
    """The same compilation with as many plans as are wanted, or as were found; the best one is its outcome.

    That there are fewer is among the notes.
    """
    checked, outcome = first.checked, first.outcome
    mission, kernel = checked.valid_mission, checked.valid_kernel
    assert isinstance(outcome, Verified)
    watch = Stopwatch(list(first.seconds))
    found = search_alternatives(checked, outcome, wanted, options, budget, watch, exports, throughout)
    plans = [verified for verified, _ in found.plans]
    with watch.stage("emit"):
        table = rows(
            [signature for _, signature in found.plans],
            [each.plan.trace for each in plans],
            [each.certificate for each in plans],
        )
        plots = [_plotted(mission, kernel, each, texts(checked)) for each in plans]
        files = joined_files(plots, [each.files for each in plans], table, wanted)
    notes = (*plans[0].report.notes, *((found.note,) if found.note else ()))
    best = replace(plans[0], files=files, report=replace(plans[0].report, notes=notes, tried=outcome.report.tried))
    alternatives = tuple(Alternative(row, each) for row, each in zip(table, [best, *plans[1:]], strict=True))
    return replace(first, outcome=best, seconds=tuple(watch.seconds), alternatives=alternatives)


def _plotted(
    mission: Mission, kernel: Kernel, verified: Verified, mission_texts: tuple[tuple[str, str], ...]
) -> Plotted:
    files, names = dict(verified.files), file_names(mission.agents)
    flights = {agent.name: files[polynomials_file(names[agent.name])].decode() for agent in mission.agents}
    digest = sha256(files["plan.json"])
    ways = ways_in(mission, files)
    return Plotted(
        mission, kernel, verified.plan, verified.certificate, flights, mission_texts, digest=digest, ways=ways
    )

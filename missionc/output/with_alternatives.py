"""The files of a folder with several plans: those of the best plan, and each other plan in a folder of its own.

in   the plotted plans, the files of each, and their table
out  the files of the folder: its manifest and report cover all plans
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence

from missionc.output.documents.alternatives_json import AlternativeRow, alternatives_json
from missionc.output.folder.file_names import ALTERNATIVES, MANIFEST, REPORT
from missionc.output.folder.manifest import relisted
from missionc.output.report.report_html import Plotted, report

OPTION = "alternatives"

Files = Mapping[str, bytes]


def with_alternatives(
    plots: Sequence[Plotted], files: Sequence[Files], table: Sequence[AlternativeRow], wanted: int
) -> Files:
    """Files of a folder with several plans.

    Args:
        plots: one for each plan, the best first.
        files: files of each plan, as in a folder of its own.
        table: rows of the plans.
        wanted: number of requested plans, recorded in the manifest.
    """
    best = dict(files[0])
    before = json.loads(best.pop(MANIFEST))
    before["options"] |= {OPTION: str(wanted)}
    best[ALTERNATIVES] = alternatives_json(plots[0].mission, table).encode()
    for row, own in zip(table[1:], files[1:], strict=True):
        best |= {f"{row.folder}/{name}": content for name, content in own.items()}
    best[REPORT] = report(plots[0], others(plots, table))
    best[MANIFEST] = relisted(before, _listed(best))
    return best


def others(plots: Sequence[Plotted], table: Sequence[AlternativeRow]) -> list[tuple[dict[str, object], Plotted]]:
    """Table rows and contents of all plans, as the report of the best plan needs them."""
    return [(row.as_record(), plotted) for row, plotted in zip(table, plots, strict=True)]


def _listed(files: Mapping[str, bytes]) -> dict[str, bytes]:
    return {name: content for name, content in files.items() if name != MANIFEST}

"""A folder's page drawn anew from its files; and what was flown in simulation, laid into the folder beside them.

in   Replayed; or a folder and the text of a simulation
out  the page's bytes; the folder with both, and with a manifest that lists them
says MC708, and why a file cannot be written
"""

from __future__ import annotations

from pathlib import Path

from missionc.diagnostics.model import Diagnostic
from missionc.emit.folder import write_file
from missionc.emit.manifest import relisted
from missionc.file_names import REPORT, SIMULATION
from missionc.limits import Limits
from missionc.monitoring import monitor
from missionc.plan import Plan
from missionc.provenance import texts
from missionc.reopen import MANIFEST, Reopened, reopen
from missionc.replay import Replayed, judged
from missionc.report import Plotted, report


def redrawn(replayed: Replayed) -> bytes:
    """The page's bytes; none where the folder could not be read."""
    opened, certificate = replayed.reopened, replayed.certificate
    if opened is None or certificate is None:
        return b""
    mission, kernel, trace = opened.mission, opened.kernel, opened.trace
    seed = opened.manifest.get("seed")
    judgements = monitor(mission, kernel, trace)[: len(kernel.requirements)]
    plan = Plan(
        mission.name, str(opened.manifest.get("backend", "")), seed if isinstance(seed, int) else 0, trace, judgements
    )
    simulation = opened.files.get(SIMULATION, b"").decode("utf-8", errors="replace")
    return report(
        Plotted(mission, kernel, plan, certificate, opened.flights, texts(opened.checked), simulation=simulation)
    )


def laid(folder: Path, simulation: bytes, limits: Limits | None = None) -> tuple[Diagnostic, ...]:
    """Write a simulation and the page that shows it, and list both; no other entry of the manifest is touched.

    A file that was changed by hand is still not the one that was written.
    """
    before = reopen(folder, limits)
    if not isinstance(before, Reopened):
        return before
    for name, content in ((SIMULATION, simulation), (MANIFEST, relisted(before.manifest, {SIMULATION: simulation}))):
        wrong = write_file(folder / name, content)
        if wrong:
            return (wrong,)
    with_it = reopen(folder, limits)
    if not isinstance(with_it, Reopened):
        return with_it
    page = redrawn(judged(with_it))
    wrong = write_file(folder / REPORT, page) or write_file(
        folder / MANIFEST, relisted(with_it.manifest, {REPORT: page})
    )
    return (wrong,) if wrong else ()

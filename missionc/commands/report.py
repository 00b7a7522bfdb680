"""``missionc report FOLDER``: the page of a compiled folder, drawn anew from its files."""

from __future__ import annotations

from pathlib import Path

import click

from missionc.answers import Status, say
from missionc.flags import folder, folders, limits_and_form, read_limits
from missionc.replay import Replayed, replay


@click.command("report")
@click.argument("path", type=folder, shell_complete=folders, metavar="FOLDER")
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE",
    help="The page to write; FOLDER.html beside the folder if left out.",
)
@limits_and_form
def command(path: Path, output: Path | None, limits: tuple[tuple[str, str], ...], form: str) -> Status:
    """Draw the page of a compiled folder anew, from its files; one that fails is drawn too."""
    from missionc.emit.folder import refuse_file, write_file

    target = output or path.absolute().with_suffix(".html")
    replayed = replay(path, read_limits(limits))
    page = _page(replayed)
    findings = replayed.findings
    written = False
    if page:
        wrong = refuse_file(target) or write_file(target, page)
        findings, written = (*findings, wrong) if wrong else findings, not wrong
    lines = [f"written to {target}"] if written else []
    say(findings, lines, form, {"output": str(target) if written else None})
    if not written:
        return Status.MISSION_ERRORS
    return Status.DONE if replayed.passed else Status.NOT_VERIFIED


def _page(replayed: Replayed) -> bytes:
    """The page's bytes; none where the folder could not be read."""
    from missionc.monitoring import monitor
    from missionc.plan import Plan
    from missionc.provenance import inputs
    from missionc.report import Plotted, report

    opened, certificate = replayed.reopened, replayed.certificate
    if opened is None or certificate is None:
        return b""
    mission, kernel, trace = opened.mission, opened.kernel, opened.trace
    seed = opened.manifest.get("seed")
    judgements = monitor(mission, kernel, trace)[: len(kernel.requirements)]
    plan = Plan(
        mission.name, str(opened.manifest.get("backend", "")), seed if isinstance(seed, int) else 0, trace, judgements
    )
    texts = tuple((name, content.decode("utf-8")) for name, content in inputs(opened.checked))
    return report(Plotted(mission, kernel, plan, certificate, opened.flights, texts))

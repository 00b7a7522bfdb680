"""``missionc check FILE…``: static checks of missions, which report all errors without planning."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import click

from missionc.base.diagnostics.model import has_errors
from missionc.base.diagnostics.render import counts
from missionc.cli import options
from missionc.cli.exit_status import Status, say
from missionc.cli.options import Pairs, existing, files, of_mission, read_limits
from missionc.compiler.front_end import Checked, check
from missionc.frontend.resolve.resolve_files import file_lines, file_records


@click.command("check")
@click.argument("missions", nargs=-1, required=True, type=existing, shell_complete=files, metavar="FILE...")
@partial(of_mission, forms=("text", "json", "sarif"))
@options.vehicle
@options.watch
def command(
    missions: tuple[Path, ...], overrides: Pairs, limits: Pairs, form: str, vehicle: str | None, watch: bool
) -> Status:
    """Check missions and report all problems, without planning."""
    allowed = read_limits(limits)

    def checked() -> list[Checked]:
        return [check(file, overrides=dict(overrides), limits=allowed, vehicle=vehicle or "") for file in missions]

    if not watch:
        return _answer(checked(), form)
    if form != "text":
        raise click.UsageError("`--watch` prints text only; remove `--format`")
    from missionc.cli.watch import watched_missions as watching  # for those who ask for it

    watching.watch_missions(watching.Missions([str(file) for file in missions], checked), partial(_answer, form=form))


def _answer(results: list[Checked], form: str) -> Status:
    findings = [finding for checked in results for finding in checked.findings]
    lines, documents = [], []
    for checked in results:
        read = file_lines(checked.mission) if checked.mission else []
        lines += [f"{checked.file}: {counts(checked.findings)}", *(f"  {line}" for line in read)]
        places = file_records(checked.mission) if checked.mission else []
        documents.append({"file": checked.file, "ok": checked.ok, "places": places})
    say(findings, lines, form, {"files": documents})
    return Status.MISSION_ERRORS if has_errors(findings) else Status.DONE

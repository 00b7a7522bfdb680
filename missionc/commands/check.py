"""``missionc check FILE…``: every problem of missions; nothing is solved."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import click

from missionc import driver, summary
from missionc.answers import Status, say
from missionc.diagnostics.model import has_errors
from missionc.flags import existing, files, of_mission, read_limits
from missionc.limits import Limits

Pairs = tuple[tuple[str, str], ...]


@click.command("check")
@click.argument("missions", nargs=-1, required=True, type=existing, shell_complete=files, metavar="FILE...")
@partial(of_mission, forms=("text", "json", "sarif"))
def command(missions: tuple[Path, ...], overrides: Pairs, limits: Pairs, form: str) -> Status:
    """Report every problem of the missions; solve nothing."""
    return _answer(missions, dict(overrides), read_limits(limits), form)


def _answer(missions: tuple[Path, ...], overrides: dict[str, str], limits: Limits, form: str) -> Status:
    results = [driver.check(file, overrides=overrides, limits=limits) for file in missions]
    findings = [finding for checked in results for finding in checked.findings]
    lines = [f"{checked.file}: {summary.counts(checked.findings)}" for checked in results]
    say(findings, lines, form, summary.checked_document(results))
    return Status.MISSION_ERRORS if has_errors(findings) else Status.DONE

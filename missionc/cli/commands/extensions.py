"""``missionc extensions``: installed extensions with their status.

says MC410 MC411 MC412
"""

from __future__ import annotations

from importlib import import_module

import click

from missionc.base.diagnostics.defect import extension_error
from missionc.base.extensions import REGISTRIES, installed
from missionc.cli.exit_status import Status, say
from missionc.cli.options import form_flag

HOMES = (
    "missionc.backends.registry",
    "missionc.cli.command_names",
    "missionc.flight.simulation.trial_bounds",
    "missionc.frontend.resolve.called_predicates",
    "missionc.ir.dynamics",
    "missionc.output.export.form_names",
)
"""Modules that define a registry."""


@click.command("extensions")
@form_flag
def command(form: str) -> Status:
    """List installed extensions and their problems."""
    for home in HOMES:
        import_module(home)
    troubles = {each: REGISTRIES[each.kind].state(each) for each in installed()}
    rows = [
        {
            "name": each.name,
            "kind": each.kind.noun,
            "package": each.package,
            "version": each.version,
            "state": error.code.name if error else "ready",
        }
        for each, error in troubles.items()
    ]
    widths = [max((len(row[column]) for row in rows), default=0) for column in (rows[0] if rows else ())]
    lines = ["  ".join(f"{word:<{width}}" for word, width in zip(row.values(), widths, strict=True)) for row in rows]
    findings = [extension_error(error) for error in troubles.values() if error is not None]
    say(findings, [line.rstrip() for line in lines] or ["no extensions installed"], form, {"extensions": rows})
    return Status.MISSION_ERRORS if findings else Status.DONE

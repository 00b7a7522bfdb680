"""``missionc vehicles [NAME]``: list of the vehicle profiles for teams, or the values of one."""

from __future__ import annotations

import click

from missionc.base.diagnostics.render import as_json
from missionc.cli import summary
from missionc.cli.exit_status import Status
from missionc.cli.options import form_flag, one_of, vehicle_name
from missionc.frontend.resolve.show_ir import show_vehicle
from missionc.ir.vehicle_profiles import profiles


@click.command("vehicles")
@click.argument("name", required=False, type=vehicle_name, shell_complete=one_of(profiles))
@form_flag
def command(name: str | None, form: str) -> Status:
    """List vehicle profiles, or all values of one profile."""
    known = profiles()
    chosen = list(known.values()) if name is None else [known[name]]
    if form == "json":
        click.echo(as_json(summary.vehicles_document(chosen)))
        return Status.DONE
    for line in map(show_vehicle, chosen) if name is None else summary.vehicle_lines(chosen[0]):
        click.echo(line)
    return Status.DONE

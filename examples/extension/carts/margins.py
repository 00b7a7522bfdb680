"""The command ``missionc margins MISSION TRACE``: the margin of each constraint of a recorded flight."""

import click

import missionc


@click.command()
@click.argument("mission")
@click.argument("trace")
def command(mission: str, trace: str) -> None:
    """Print the margin of each constraint of a recorded flight."""
    for each in missionc.monitor(mission, trace).constraints:
        click.echo(f"{each.name:12} {each.margin:+.2f}")

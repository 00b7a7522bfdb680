"""``missionc demo``: compilation of the included example mission; its report opens in the browser."""

from __future__ import annotations

from itertools import chain, count
from pathlib import Path

import click

from missionc.base.resources import folder
from missionc.cli import options
from missionc.cli.browser import said
from missionc.cli.compile_request import CompileRequest, run_request
from missionc.cli.exit_status import Status, say_line
from missionc.output.folder.file_names import REPORT

MISSION = "wildfire"

# The working directory rather than the system's temporary folder, which sandboxed browsers cannot read.
FOLDER = "missionc-demo"


@click.command("demo")
@options.output(f"Plan folder to write. [default: {FOLDER}, with a number if it exists]")
@options.no_open
def command(output: Path | None, no_open: bool) -> Status:
    """Plan an included mission and open its report."""
    answer = run_request(CompileRequest(folder("missions") / f"{MISSION}.mission", output=output or _fresh()))
    if answer.output:
        written = Path(answer.output)
        page = written / REPORT
        say_line(said(page.absolute().as_uri(), no_open, str(page)))
        say_line(f"mission file to copy and edit: {written / 'mission' / f'{MISSION}.mission'}")
    return answer.status


def _fresh() -> Path:
    """First of the demo's folder names that does not exist yet."""
    names = chain([FOLDER], (f"{FOLDER}-{number}" for number in count(2)))
    return next(path for path in map(Path, names) if not path.exists() and not path.is_symlink())

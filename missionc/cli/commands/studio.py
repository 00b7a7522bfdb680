"""``missionc studio [FILE]``: a local page for writing, viewing and compiling a mission.

says MC002 MC004 MC009 MC404
"""

from __future__ import annotations

import os
from importlib.util import find_spec
from pathlib import Path

import click

from missionc.base.diagnostics.code import EXTRA_MISSING
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.limits import Limits
from missionc.cli import options
from missionc.cli.browser import said
from missionc.cli.exit_status import Status, say, say_line
from missionc.cli.studio_planner import StudioPlanner
from missionc.frontend.templates import DEFAULT, templates
from missionc.tools.studio.text_file import TextFile, fresh, opened_text

NEEDED = ("pygls", "websockets")


@click.command("studio")
@click.argument("file", type=options.file_to_write, required=False, shell_complete=options.files)
@options.no_open
def command(file: Path | None, no_open: bool) -> Status:
    """Edit, view and compile a mission in the browser.

    Without FILE, the studio opens a template. The page is available on this machine only, until Ctrl-C.
    """
    missing = next((name for name in NEEDED if find_spec(name) is None), None)
    if missing:
        message = f"the studio needs the package {missing}, which is not installed"
        help_ = "install it with `pip install 'missionc[studio]'`"
        say([Diagnostic(EXTRA_MISSING, message, None, help=help_)], [], "text", {})
        return Status.MISSION_ERRORS
    path = Path(os.path.abspath(file)) if file else None
    if path and not path.parent.is_dir():
        raise click.UsageError(f"there is no folder `{path.parent}`; check the path")
    home = path.parent if path else Path.cwd()
    first = _first(path, home)
    if isinstance(first, Diagnostic):
        say([first], [], "text", {})
        return Status.MISSION_ERRORS
    from missionc.tools.studio.serve import serve  # loaded from the extra only

    serve(home, first, StudioPlanner, lambda address: _say(address, no_open))
    return Status.DONE


def _first(path: Path | None, home: Path) -> TextFile | Diagnostic:
    """Text of the given file, or of a template if the file does not exist; a finding if it is unreadable.

    Args:
        path: file to edit, or None.
        home: folder of new missions.
    """
    if path and os.path.lexists(path):
        return opened_text(path, Limits())
    template = templates()[DEFAULT]
    if path is None:
        return TextFile(fresh(home, template.mission), template.text)
    return TextFile(path, template.text, named=True)


def _say(address: str, no_open: bool) -> None:
    say_line(said(address, no_open, address, "studio"))
    say_line("changes are saved only on request; Ctrl-C stops the server")

"""``missionc lsp``: the language server, for an editor to start."""

from __future__ import annotations

from importlib.util import find_spec

import click

from missionc.base.diagnostics.code import EXTRA_MISSING
from missionc.base.diagnostics.model import Diagnostic
from missionc.cli.exit_status import Status, say


@click.command("lsp")
@click.option("--stdio", is_flag=True, help="Use standard input and output (the default).")
def command(stdio: bool) -> Status:
    """Run the language server for an editor.

    The server communicates over standard input and output until the editor closes the connection.
    """
    if find_spec("pygls") is None:
        message = "the language server needs the package pygls, which is not installed"
        say(
            [Diagnostic(EXTRA_MISSING, message, None, help="install it with `pip install 'missionc[lsp]'`")],
            [],
            "text",
            {},
        )
        return Status.MISSION_ERRORS
    # Loaded on request of an editor only.
    from missionc.tools.language_server.server import serve

    serve()
    return Status.DONE

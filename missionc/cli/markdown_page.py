"""Documentation pages on a terminal: formatted headings, code and lists, wrapped to its width."""

from __future__ import annotations

import io
import sys

from missionc.cli.exit_status import columns, in_colour


def rendered_page(page: str) -> str:
    """Text of a Markdown page for standard output: formatted for a terminal, otherwise unchanged."""
    width = columns(sys.stdout.isatty())
    return rendered(page, width, in_colour(True)) if width else page.removesuffix("\n")


def rendered(page: str, width: int, colour: bool) -> str:
    """Text of a Markdown page formatted for a terminal, without a final line end.

    Args:
        page: Markdown.
        width: width of the terminal in columns.
        colour: whether to use colours.
    """
    from rich.console import Console  # only for pages on a terminal
    from rich.markdown import Markdown

    text = io.StringIO()
    console = Console(file=text, force_terminal=True, width=width, no_color=not colour, color_system="standard")
    console.print(Markdown(page, hyperlinks=False, code_theme="ansi_light"))
    return "\n".join(line.rstrip() for line in text.getvalue().strip("\n").splitlines())

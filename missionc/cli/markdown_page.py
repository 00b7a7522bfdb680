"""A page of the documentation on a terminal: headings, code and lists as such, wrapped to its width."""

from __future__ import annotations

import io
import sys

from missionc.cli.exit_status import columns, in_colour


def rendered_page(page: str) -> str:
    """Markdown as standard output shows it: rendered on a terminal, else as it is."""
    width = columns(sys.stdout.isatty())
    return rendered(page, width, in_colour(True)) if width else page.removesuffix("\n")


def rendered(page: str, width: int, colour: bool) -> str:
    """Markdown for a terminal so many columns wide, without a line end."""
    from rich.console import Console  # for those who read a page on a terminal
    from rich.markdown import Markdown

    text = io.StringIO()
    console = Console(file=text, force_terminal=True, width=width, no_color=not colour, color_system="standard")
    console.print(Markdown(page, hyperlinks=False, code_theme="ansi_light"))
    return "\n".join(line.rstrip() for line in text.getvalue().strip("\n").splitlines())

"""The user's browser: a page is opened in it, where there is one that can show it."""

from __future__ import annotations

import os
import sys
import webbrowser

SCREENS = ("DISPLAY", "WAYLAND_DISPLAY")


def opened(address: str) -> bool:
    """Whether a browser was asked to show the page.

    Without a screen there are only browsers that take over the terminal and run no script. They are
    asked only where ``BROWSER`` says so.
    """
    blind = sys.platform not in ("darwin", "win32") and not any(map(os.environ.get, SCREENS))
    if blind and not os.environ.get("BROWSER"):
        return False
    try:
        return webbrowser.open(address)
    except webbrowser.Error:
        return False


def said(address: str, no_open: bool, name: str, what: str = "report") -> str:
    """Open the page, unless nobody wants that, and say how it went; ``name`` is where the user finds it."""
    if no_open:
        return f"{what}: {name}"
    if opened(address):
        return f"{what} (opened in the browser): {name}"
    return f"{what} (no browser found; open it yourself): {name}"

"""Access to the user's browser: opens a page in it, if one can show it."""

from __future__ import annotations

import os
import sys
import webbrowser

SCREENS = ("DISPLAY", "WAYLAND_DISPLAY")


def opened(address: str) -> bool:
    """Open a page in the browser, and return whether a browser was started.

    Without a screen there are only browsers in the terminal, which run no scripts. They are used only if ``BROWSER`` is
    set.
    """
    blind = sys.platform not in ("darwin", "win32") and not any(map(os.environ.get, SCREENS))
    if blind and not os.environ.get("BROWSER"):
        return False
    try:
        return webbrowser.open(address)
    except webbrowser.Error:
        return False


def said(address: str, no_open: bool, name: str, what: str = "report") -> str:
    """Open a page unless disabled, and return a message about it.

    Args:
        address: address of the page.
        no_open: if true, do not open it.
        name: location of the page for the user.
        what: description of the page.
    """
    if no_open:
        return f"{what}: {name}"
    if opened(address):
        return f"{what} (opened in the browser): {name}"
    return f"{what} (no browser found; open it yourself): {name}"

"""Notebook display of values that are the result of a cell: in Jupyter, and in IPython on a terminal.

What a value says is its ``str``; a notebook shows that as it stands, or a report in a frame. Nothing here is loaded for
it, and nothing of a notebook has to be installed.
"""

from __future__ import annotations

import base64
import html
from collections.abc import Sequence
from typing import Protocol

from missionc.base.palette import LIGHT

HEIGHT = 760
"""Pixels of a report in a cell: the map, and lanes enough below it."""

WIDTH, EDGE = 320.0, 12.0
"""Pixels of a picture of paths, and of the room around them."""

COLOURS = LIGHT["agents"]


class Printer(Protocol):
    """The pretty printer of IPython."""

    def text(self, words: str) -> None: ...


def printed(value: object, printer: Printer, cycle: bool) -> None:
    """For ``_repr_pretty_``. IPython looks for it beside ``__repr__``, in the class itself: a base class is too far."""
    printer.text(str(value))


def shown(value: object) -> str:
    """For ``_repr_html_`` of a value that is words."""
    return preformatted(str(value))


def preformatted(words: str) -> str:
    """Text with its columns, whatever is in it."""
    style = "font-family: ui-monospace, monospace; overflow-x: auto"  # which a notebook's own style may take from it
    return f'<pre style="{style}">{html.escape(words)}</pre>' if words else ""


def framed(page: str, words: str) -> str:
    """A report in a frame; where frames are not shown, what it says."""
    # Its script is its own, and has no business with the notebook.
    return (
        f'<iframe srcdoc="{html.escape(page)}" sandbox="allow-scripts" title="report" '
        f'style="width: 100%; height: {HEIGHT}px; border: 1px solid #8888">{preformatted(words)}</iframe>'
    )


def picture(svg: bytes) -> str:
    """A drawing, as an image: nothing in it runs, and its names clash with no other's."""
    return (
        f'<img alt="" src="data:image/svg+xml;base64,{base64.b64encode(svg).decode("ascii")}" style="max-width: 100%">'
    )


def paths(motion: Sequence[Sequence[Sequence[float]]]) -> bytes:
    """Everybody's path from above, as SVG: a ring where it begins, a disc where it ends.

    Args:
        motion: (agents, steps + 1, dim), metres; the first two coordinates are drawn.
    """
    places = [place for path in motion for place in path]
    left, right = (choose(place[0] for place in places) for choose in (min, max))
    low, high = (choose(place[1] for place in places) for choose in (min, max))
    scale = (WIDTH - 2 * EDGE) / max(right - left, high - low, 1e-9)
    height = (high - low) * scale + 2 * EDGE
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH:.0f}" height="{height:.0f}" '
        f'viewBox="0 0 {WIDTH:.0f} {height:.0f}" fill="none" stroke-width="2">'
    ]
    for number, path in enumerate(motion):
        colour = COLOURS[number % len(COLOURS)]
        drawn = [(EDGE + (place[0] - left) * scale, EDGE + (high - place[1]) * scale) for place in path]
        points = " ".join(f"{x:.1f},{y:.1f}" for x, y in drawn)
        (x, y), (to_x, to_y) = drawn[0], drawn[-1]
        lines += [
            f'<polyline points="{points}" stroke="{colour}"/>',
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="7" stroke="{colour}"/>',
            f'<circle cx="{to_x:.1f}" cy="{to_y:.1f}" r="4" fill="{colour}"/>',
        ]
    return "\n".join([*lines, "</svg>\n"]).encode("ascii")

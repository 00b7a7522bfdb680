"""Notebook display of values that are the result of a cell, in Jupyter and in IPython on a terminal.

A value is displayed as its preformatted ``str``, or as a report in an HTML frame. The functions import no notebook
package, and none must be installed.
"""

from __future__ import annotations

import base64
import html
from collections.abc import Sequence
from typing import Protocol

from missionc.base.late_dataclass import Record
from missionc.base.palette import LIGHT

HEIGHT = 760
"""Height of the frame of a report in a cell, pixels: enough for the map and some timelines below it."""

WIDTH, EDGE = 320.0, 12.0
"""Width of a picture of paths, and its padding, pixels."""

COLOURS = LIGHT["agents"]


class Printer(Protocol):
    """Interface of the pretty printer of IPython."""

    def text(self, words: str) -> None: ...


def printed(value: object, printer: Printer, cycle: bool) -> None:
    """Print a value as its ``str``: the implementation of ``_repr_pretty_``.

    IPython looks for the method in the class that defines ``__repr__``, not in a base class.
    """
    printer.text(str(value))


def shown(value: object) -> str:
    """Preformatted HTML of the ``str`` of a value: the implementation of ``_repr_html_``."""
    return preformatted(str(value))


def preformatted(words: str) -> str:
    """Preformatted HTML of a text, which keeps its columns aligned; empty for an empty text."""
    style = "font-family: ui-monospace, monospace; overflow-x: auto"  # which a notebook's own style may remove
    return f'<pre style="{style}">{html.escape(words)}</pre>' if words else ""


def framed(page: str, words: str) -> str:
    """HTML frame with a report page; ``words`` is the text for viewers without frames."""
    # Its script runs isolated from the notebook.
    return (
        f'<iframe srcdoc="{html.escape(page)}" sandbox="allow-scripts" title="report" '
        f'style="width: 100%; height: {HEIGHT}px; border: 1px solid #8888">{preformatted(words)}</iframe>'
    )


def picture(svg: bytes) -> str:
    """HTML image element of an SVG drawing, isolated from the page: its scripts do not run and its identifiers cannot
    clash."""
    return (
        f'<img alt="" src="data:image/svg+xml;base64,{base64.b64encode(svg).decode("ascii")}" style="max-width: 100%">'
    )


class Figure(Record):
    """Shape drawn in a picture, from above: ``rings`` of corners, or a ``disc`` (x, y, radius); metres.

    ``place`` is the position of the shape's name, (x, y), metres.
    """

    name: str
    fill: str
    outline: str
    ink: str
    place: Sequence[float]
    rings: Sequence[Sequence[Sequence[float]]] = ()
    disc: Sequence[float] = ()


class Ground(Record):
    """Background of a picture of paths: corners ``low`` and ``high`` of the world, (x, y) in metres, and the shapes in
    it."""

    low: tuple[float, float]
    high: tuple[float, float]
    figures: tuple[Figure, ...]


def paths(motion: Sequence[Sequence[Sequence[float]]], ground: Ground | None = None) -> bytes:
    """SVG picture of the paths of all agents from above: a ring marks each start, a disc each end.

    Args:
        motion: positions, (agents, steps + 1, dim), metres; the first two coordinates are drawn.
        ground: background with axes in metres; if None, the picture is cropped to the paths.
    """
    view = _View.of([place for path in motion for place in path] if ground is None else [ground.low, ground.high])
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH:.0f}" height="{view.height:.0f}" '
        f'viewBox="0 0 {WIDTH:.0f} {view.height:.0f}" fill="none" stroke-width="2" font-family="sans-serif">'
    ]
    lines += [] if ground is None else _ground(view, ground)
    for number, path in enumerate(motion):
        colour = COLOURS[number % len(COLOURS)]
        drawn = [view.at(place) for place in path]
        points = " ".join(f"{x:.1f},{y:.1f}" for x, y in drawn)
        (x, y), (to_x, to_y) = drawn[0], drawn[-1]
        lines += [
            f'<polyline points="{points}" stroke="{colour}"/>',
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="7" stroke="{colour}"/>',
            f'<circle cx="{to_x:.1f}" cy="{to_y:.1f}" r="4" fill="{colour}"/>',
        ]
    return "\n".join([*lines, "</svg>\n"]).encode("ascii", "xmlcharrefreplace")


class _View(Record):
    """Transformation from world coordinates (metres) to picture coordinates (pixels)."""

    left: float
    top: float
    scale: float
    height: float

    @classmethod
    def of(cls, places: Sequence[Sequence[float]]) -> _View:
        """Transformation that fits the given positions, metres, into the picture inside its padding."""
        left, right = (choose(place[0] for place in places) for choose in (min, max))
        low, high = (choose(place[1] for place in places) for choose in (min, max))
        scale = (WIDTH - 2 * EDGE) / max(right - left, high - low, 1e-9)
        return cls(left, high, scale, (high - low) * scale + 2 * EDGE)

    def at(self, place: Sequence[float]) -> tuple[float, float]:
        return EDGE + (place[0] - self.left) * self.scale, EDGE + (self.top - place[1]) * self.scale


def _ground(view: _View, ground: Ground) -> list[str]:
    """SVG elements of the floor, the shapes with their names, and the axis labels."""
    (x, y), (to_x, to_y) = view.at((ground.low[0], ground.high[1])), view.at((ground.high[0], ground.low[1]))
    floor = f'<rect x="{x:.1f}" y="{y:.1f}" width="{to_x - x:.1f}" height="{to_y - y:.1f}" stroke-width="1"'
    lines = [f'{floor} fill="{LIGHT["floor"]}" stroke="{LIGHT["faint"]}"/>']
    for figure in ground.figures:
        style = f'fill="{figure.fill}" stroke="{figure.outline}" stroke-width="1"'
        if figure.disc:
            (cx, cy), radius = view.at(figure.disc), figure.disc[-1] * view.scale
            lines.append(f'<circle cx="{cx:.1f}" cy="{cy:.1f}" r="{radius:.1f}" {style}/>')
        else:
            corners = [" L".join("{:.1f},{:.1f}".format(*view.at(each)) for each in ring) for ring in figure.rings]
            lines.append(f'<path d="{" ".join(f"M{each}Z" for each in corners)}" fill-rule="evenodd" {style}/>')
    named = [figure for figure in ground.figures if figure.name]
    lines += [_text(view.at(each.place), each.name, each.ink, "middle") for each in named]
    for number in (ground.low[0], ground.high[0]):
        (at, _), anchor = view.at((number, 0.0)), "start" if number == ground.low[0] else "end"
        lines.append(_text((at, to_y + EDGE - 2), f"{number:g}", LIGHT["faint"], anchor))
    for number, drop in ((ground.low[1], -3.0), (ground.high[1], 10.0)):
        lines.append(_text((x + 3, view.at((0.0, number))[1] + drop), f"{number:g}", LIGHT["faint"], "start"))
    return lines


def _text(place: tuple[float, float], words: str, colour: str, anchor: str) -> str:
    where = f'x="{place[0]:.1f}" y="{place[1]:.1f}" text-anchor="{anchor}"'
    return f'<text {where} font-size="10" fill="{colour}">{html.escape(words)}</text>'

"""Figure of a sweep: success rates with intervals, medians with quartiles, and all runs, as small multiples.

The first varied parameter is the horizontal axis, the second one distinguishes lines, the third one panels; runs that
differ in further ones are merged. Each quantity has a row of panels.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from missionc.output.plot.figure_request import WIDTHS
from missionc.output.plot.plot import GREY, rendered, style
from missionc.output.plot.plot_strip import INCH, TEXT
from missionc.tools.sweep.results_table import SHARE, Group, Measure, measures, pooled
from missionc.tools.sweep.run_grid import number_of
from missionc.tools.sweep.sweep_folder import Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

AXES = 3
"""Maximum number of parameters that a figure distinguishes."""
MOST_LINES = 8
MOST_BESIDE = 6
"""Maximum number of panels in a row; a third parameter with more values is not distinguished."""
ACROSS = {"single": 2, "double": 3}
"""Number of panels in a row by width, one or two columns of a paper, if each quantity has one panel."""
TALL = 1.25
"""Height of a panel, inches."""
DODGE = 0.16
"""Horizontal offset between lines, as a fraction of the distance between two values."""
TIMES = 30.0
"""Minimum ratio of the longest to the shortest time for a logarithmic axis."""


def sweep_figure(
    names: Sequence[str], groups: Sequence[Group], kind: str, width: str = "", link: Callable[[Row], str] | None = None
) -> bytes:
    """Figure as the bytes of a file; the same groups give the same bytes. Needs matplotlib.

    Args:
        names: names of the varied parameters.
        groups: runs by combination.
        kind: ``svg``, ``png`` or ``pdf``.
        width: name in ``WIDTHS``; two columns if empty.
        link: link target of a run's point, in an SVG.
    """
    return rendered(lambda figure: _draw(figure, names, groups, width, link), kind, exact=True)


def _draw(
    figure: Figure, names: Sequence[str], groups: Sequence[Group], width: str, link: Callable[[Row], str] | None
) -> None:
    told = _told_apart(groups, len(names))
    found = pooled(groups, told)
    shown = (None, *measures(row for group in found for row in group.rows))
    beside = _values(found, 2) if told > 2 else [""]
    panels = _panels(figure, len(shown), len(beside), width or "double")
    places = _places(_values(found, 0)) if told else {"": 0.0}
    for column, value in enumerate(beside):
        here = [group for group in found if told < 3 or group.values[2][1] == value]
        for number, measure in enumerate(shown):
            axes = panels[number][column]
            _draw_lines(axes, here, measure, places, told, link)
            _below(axes, names, places, told)
            if column == 0:
                axes.set_ylabel(_label(measure), fontsize=TEXT)
        if told > 2:
            panels[0][column].set_title(f"{names[2]} = {value}", fontsize=TEXT + 0.5, pad=4)
    for number, measure in enumerate(shown):
        _scale(panels[number][0], measure)
    if told > 1:
        lines, labels = panels[0][0].get_legend_handles_labels()
        looks: dict[str, Any] = {"frameon": False, "fontsize": TEXT, "handlelength": 2.2, "columnspacing": 1.4}
        figure.legend(
            lines, [f"{names[1]} = {label}" for label in labels], loc="outside upper center", ncols=4, **looks
        )


def _panels(figure: Figure, measures_: int, beside: int, width: str) -> list[list[Axes]]:
    """Panels by quantity and column; with one panel each, the quantities share rows.

    Args:
        figure: figure, which gets its size here.
        measures_: number of quantities.
        beside: number of panels of a quantity.
        width: name in ``WIDTHS``.
    """
    across = beside if beside > 1 else ACROSS[width]
    down = measures_ if beside > 1 else -(-measures_ // across)
    figure.set_size_inches(WIDTHS[width] / INCH, (TALL + 0.2) * down + 0.6)
    figure.set_layout_engine("constrained", w_pad=0.07, h_pad=0.05)
    grid = figure.add_gridspec(down, across)
    panels: list[list[Axes]] = []
    for number in range(measures_):
        own: list[Axes] = []
        for column in range(beside):
            place = (number, column) if beside > 1 else divmod(number, across)
            axes = figure.add_subplot(grid[place], sharey=own[0] if own else None)
            axes.tick_params(length=2.5, labelsize=TEXT, labelleft=not own)
            axes.spines[["top", "right"]].set_visible(False)
            axes.grid(color="#ECECEC", lw=0.6)
            axes.set_axisbelow(True)
            own.append(axes)
        panels.append(own)
    figure.align_ylabels()
    return panels


def _told_apart(groups: Sequence[Group], parameters: int) -> int:
    """Number of leading parameters that the figure distinguishes by axis, lines or panels."""
    told = min(parameters, AXES)
    if told > 2 and len(_values(groups, 2)) > MOST_BESIDE:
        told = 2
    return 1 if told > 1 and len(_values(groups, 1)) > MOST_LINES else told


def _values(groups: Sequence[Group], place: int) -> list[str]:
    return list(dict.fromkeys(group.values[place][1] for group in groups))


def _places(values: Sequence[str]) -> dict[str, float]:
    """Horizontal position by value: the numbers if all values have the same unit, otherwise 0, 1, 2, …."""
    numbers = [number_of(value) for value in values]
    units = {number and number[1] for number in numbers}
    if len(units) == 1 and None not in units:
        return {value: number[0] for value, number in zip(values, numbers, strict=True) if number}
    return {value: float(place) for place, value in enumerate(values)}


def _draw_lines(
    axes: Axes,
    groups: Sequence[Group],
    measure: Measure | None,
    places: dict[str, float],
    told: int,
    link: Callable[[Row], str] | None,
) -> None:
    names = _values(groups, 1) if told > 1 else [""]
    ordered = sorted(places.values())
    gap = min((high - low for low, high in pairwise(ordered)), default=1.0)
    for number, name in enumerate(names):
        own = [group for group in groups if told < 2 or group.values[1][1] == name]
        colour, mark, dash = style(number)
        beside = DODGE * gap * (number - (len(names) - 1) / 2)
        points = []
        for group in own:
            at = places[group.values[0][1] if told else ""] + beside
            point = _point(group, measure)
            if point is not None:
                points.append((at, *point))
            if measure is not None:
                _draw_runs(axes, group, measure, at, colour, link)
        points.sort()
        if not points:
            continue
        x, low, middle, high = ([point[place] for point in points] for place in range(4))
        bars = [[m - b for m, b in zip(middle, low, strict=True)], [t - m for m, t in zip(middle, high, strict=True)]]
        line: dict[str, Any] = {"ls": dash, "lw": 1.1, "marker": mark, "ms": 4, "mew": 0.4, "mec": "white"}
        axes.errorbar(x, middle, bars, color=colour, elinewidth=0.9, capsize=1.6, label=name, zorder=4, **line)


def _point(group: Group, measure: Measure | None) -> tuple[float, float, float] | None:
    """Lower end, centre and upper end of a group's bar; None without values.

    Args:
        group: runs of one combination.
        measure: quantity; None for the success rate.
    """
    if measure is None:
        rate = group.success
        return None if rate is None else (rate.low, rate.share, rate.high)
    spread = group.spreads.get(measure.name)
    return None if spread is None else (spread.low, spread.median, spread.high)


def _draw_runs(
    axes: Axes, group: Group, measure: Measure, x: float, colour: str, link: Callable[[Row], str] | None
) -> None:
    """Draw a faint, linked dot for every run.

    Args:
        axes: panel.
        group: runs of one combination.
        measure: quantity.
        x: horizontal position.
        colour: colour of the dots.
        link: function that returns the link target of a run, or None.
    """
    found = [(figure, row) for row in group.rows if (figure := measure.of(row)) is not None]
    if not found:
        return
    looks: dict[str, Any] = {"s": 9, "color": colour, "alpha": 0.28, "lw": 0, "zorder": 3}
    dots = axes.scatter([x] * len(found), [figure for figure, _ in found], **looks)
    if link is not None:
        dots.set_urls([link(row) for _, row in found])


def _label(measure: Measure | None) -> str:
    return "runs with a plan" if measure is None else measure.label


def _below(axes: Axes, names: Sequence[str], places: dict[str, float], told: int) -> None:
    """Set the horizontal axis, with a tick for each value.

    Args:
        axes: panel.
        names: names of the varied parameters.
        places: horizontal position by value.
        told: number of distinguished parameters.
    """
    if not told:
        axes.set_xticks([])
        return
    numbers = [number_of(value) for value in places]
    units = {number and number[1] for number in numbers}
    plain = len(units) == 1 and None not in units
    unit = units.pop() if plain else None
    labels = [f"{place:g}" if plain else value for value, place in places.items()]
    axes.set_xticks(list(places.values()), labels)
    axes.set_xlabel(f"{names[0]} ({unit})" if unit else names[0], fontsize=TEXT, labelpad=1)
    ends = min(places.values()), max(places.values())
    room = 0.12 * (ends[1] - ends[0]) or 0.5
    axes.set_xlim(ends[0] - room, ends[1] + room)


def _scale(axes: Axes, measure: Measure | None) -> None:
    """Set the vertical axis: rates from 0 to 1, widely varying times logarithmic, other quantities from 0."""
    from matplotlib.ticker import PercentFormatter

    if measure is None or measure.name == SHARE:
        axes.set_ylim(-0.04, 1.04)
        axes.yaxis.set_major_formatter(PercentFormatter(1.0, 0))
        return
    low, high = axes.dataLim.y0, axes.dataLim.y1
    if measure.unit == "s" and low > 0 and high / low > TIMES:
        axes.set_yscale("log")
    elif low >= 0:
        axes.set_ylim(bottom=0)
    else:
        axes.axhline(0, color=GREY, lw=0.7, ls=(0, (1, 1.2)))

"""Plots and tables of simulated flights: the first flight as a table, and a picture of all flights.

The picture has the map with planned and flown paths, the error over time, and how often each requirement was satisfied.
Matplotlib comes with the extra ``viz``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from missionc.flight.simulation.default_engine import Flown
from missionc.flight.simulation.trials import Trials
from missionc.ir import Mission
from missionc.output.documents.trajectories_csv import COLUMNS, cell
from missionc.output.plot.plot import GREY, INK, LONG_SIDE, PAD, draw_view, rendered, style
from missionc.output.plot.silhouette import View

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDE, GAP = 3.6, 0.7
"""Width of the graphs next to the map, and gap between panels, inches."""
KEPT, MISSED = "#009E73", "#D55E00"
LABELS = {"tracking": "tracking error", "nothing touched": "no collision"}


def table(mission: Mission, flown: Flown) -> bytes:
    """CSV table of the first flight's samples in the format that ``missionc monitor`` reads.

    Numbers are in SI units with nine significant digits.
    """
    lines = [COLUMNS]
    for agent in mission.agents:
        columns = [
            flown.times[:, None],
            flown.position[0, agent.index],
            flown.velocity[0, agent.index],
            flown.heading[0, agent.index][:, None],
        ]
        rows = np.concatenate(columns, axis=1).tolist()
        lines += [",".join([cell(agent.name), *(f"{number:.9g}" for number in row)]) for row in rows]
    return ("\n".join(lines) + "\n").encode()


def draw(mission: Mission, trials: Trials, kind: str) -> bytes:
    """Picture of the flights as bytes, ``svg``, ``png`` or ``pdf``, the same each time; requires matplotlib."""
    return rendered(lambda figure: _draw(figure, mission, trials), kind)


def _draw(figure: Figure, mission: Mission, trials: Trials) -> None:
    low, high = mission.world.low, mission.world.high
    pad = PAD * max(top - bottom for bottom, top in zip(low, high, strict=True))
    across, up = high[0] - low[0] + 2 * pad, high[1] - low[1] + 2 * pad
    scale = LONG_SIDE / max(across, up)
    tall = max(up * scale, 4.0)
    width, height = across * scale + WIDE + 2 * GAP, tall + 2 * GAP
    figure.set_size_inches(width, height)
    place = (GAP / width, (GAP + tall - up * scale) / height, across * scale / width, up * scale / height)
    axes = figure.add_axes(place)
    axes.set_xlim(low[0] - pad, high[0] + pad)
    axes.set_ylim(low[1] - pad, high[1] + pad)
    _paths(axes, mission, trials)
    left, half = (2 * GAP + across * scale) / width, (tall - GAP) / 2
    _errors(figure.add_axes((left, (GAP + half + GAP) / height, WIDE / width, half / height)), trials)
    _fractions(figure.add_axes((left, GAP / height, WIDE / width, half / height)), trials)


def _paths(axes: Axes, mission: Mission, trials: Trials) -> None:
    count = trials.trial.flights
    about = f"{count} flight{'s' if count > 1 else ''}, engine {trials.trial.engine}, seed {trials.trial.seed}"
    axes.set_title(mission.name, loc="left", fontsize=12, fontweight="bold", pad=20)
    axes.annotate(about, (0, 1), (0, 6), xycoords="axes fraction", textcoords="offset points", fontsize=8.5, color=GREY)
    draw_view(axes, mission, trials.flights[0].trace, View(0, 1))
    for agent in mission.agents:
        planned = trials.planned[agent.index]
        axes.plot(planned[:, 0], planned[:, 1], color=INK, lw=0.7, ls=(0, (4, 2)), zorder=4.5)
        for path in trials.flown.position[:, agent.index]:
            axes.plot(path[:, 0], path[:, 1], color=style(agent.index)[0], lw=1.0, alpha=0.8, zorder=4)


def _errors(axes: Axes, trials: Trials) -> None:
    """Draw the maximum tracking error over all agents against time: the median and the maximum over all flights."""
    largest = np.stack([flight.largest for flight in trials.flights])
    times = trials.flown.times
    median, most = np.median(largest, axis=0), largest.max(axis=0)
    axes.fill_between(times, median, most, color="#CFE3F1", lw=0, label="median to maximum")
    axes.plot(times, median, color="#0072B2", lw=1.2, label="median of the flights")
    axes.axhline(float(trials.allowed.min()), color=MISSED, lw=0.9, ls=(0, (4, 2)), label="limit")
    axes.set_xlim(times[0], times[-1])
    axes.set_ylim(0, 1.3 * max(float(largest.max()), float(trials.allowed.min())))
    axes.set_title("largest tracking error of any agent", loc="left", fontsize=8.5, color=INK)
    axes.set_xlabel("time (s)", fontsize=7.5)
    axes.set_ylabel("error (m)", fontsize=7.5)
    axes.legend(frameon=False, fontsize=7.5, loc="upper right")


def _fractions(axes: Axes, trials: Trials) -> None:
    """Draw the fraction of flights that satisfied each requirement, with the confidence interval."""
    fractions = trials.fractions()
    for row, (name, each) in enumerate(fractions.items()):
        colour = KEPT if each.held == each.flights else MISSED
        axes.barh(row, each.share, height=0.6, color=colour, alpha=0.55, lw=0)
        if each.flights > 1:
            axes.plot([each.low, each.high], [row, row], color=INK, lw=1.1, marker="|", ms=6)
        axes.annotate(f"{LABELS.get(name, name)}  {each.held}/{each.flights}", (0.02, row), va="center", fontsize=7.5)
    axes.set_xlim(0, 1)
    axes.set_ylim(len(fractions) - 0.5, -0.5)
    axes.set_yticks([])
    axes.set_title(
        "satisfied share of flights (two-sided 95 % confidence interval)", loc="left", fontsize=8.5, color=INK
    )

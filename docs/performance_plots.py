"""Plots of the performance page, drawn from its tables.

python docs/performance_plots.py docs/performance.md → docs/images/performance_*.svg
"""

from __future__ import annotations

import re
import sys
from collections import defaultdict
from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "performance.md"
PICTURES = ROOT / "docs" / "images"
Curves = dict[str, list[tuple[float, float]]]
"""Points of each curve, by name."""


def rows(heading: str) -> list[dict[str, str]]:
    """First table below a heading of the page, with a dictionary for each row."""
    below = PAGE.read_text(encoding="utf-8").split(f"## {heading}\n", 1)[1]
    table = re.search(r"(?:^\|.*\|\n)+", below, re.MULTILINE)
    assert table, heading
    lines = table[0].splitlines()
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    return [dict(zip(cells[0], row, strict=True)) for row in cells[2:]]


def roadmaps() -> Curves:
    """Seconds of a plan with 10 steps by the number of drones, here and as published."""
    curves: Curves = defaultdict(list)
    for row in rows("[strel] Table 2"):
        if row["steps T"] == "10":
            published = sum(map(float, row["published s"].split("+")))
            curves[row["mission"]].append((float(row["drones N"]), float(row["total s"])))
            curves[f"{row['mission']}, published"].append((float(row["drones N"]), published))
    return curves


def transport() -> Curves:
    """Seconds by the number of robots, for the methods that solved every seed."""
    curves: Curves = defaultdict(list)
    for row in rows("[clot] Table I"):
        solved, _, seeds = row["solved"].partition("/")
        if solved == seeds and not row["CPU s"].startswith(">"):
            curves[row["method"]].append((float(row["robots N"]), float(row["CPU s"])))
    return curves


def draw(curves: Curves, name: str, across: str, up: str) -> Path:
    """Plot of curves, with seconds on a logarithmic axis."""
    figure = Figure(figsize=(6.4, 3.6), layout="constrained")
    axes = figure.subplots()
    for curve, points in curves.items():
        dashed = "--" if curve.endswith("published") else "-"
        axes.plot(*zip(*points, strict=True), dashed, marker="o", markersize=4, label=curve)
    axes.set(xlabel=across, ylabel=up, yscale="log")
    axes.grid(alpha=0.3)
    axes.legend(fontsize=7, loc="center left", bbox_to_anchor=(1, 0.5))
    path = PICTURES / f"performance_{name}.svg"
    figure.savefig(path, metadata={"Date": None})
    return path


def main() -> int:
    mpl.rcParams.update({"svg.hashsalt": "missionc", "svg.fonttype": "none", "font.size": 9})
    print(draw(roadmaps(), "roadmaps", "drones, 10 steps", "planning time (s)"))
    print(draw(transport(), "transport", "robots", "CPU time (s)"))
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""Colour palette of all pictures: plots, the report, notebooks.

True is blue and false is vermilion, which are distinct in the common colour vision deficiencies; no agent has either
colour. Agents differ in colour and marker, and the role of a region determines its colour.

Source:
    Okabe and Ito, "Color Universal Design" (2008); light colours are darkened for white backgrounds.
"""

from __future__ import annotations

from typing import Any

ROLES = ("goal", "avoid", "start", "plain")
"""Roles of regions in pictures: to reach or stay in, to avoid, start of an agent, none of these."""

MARKS = ("disc", "square", "triangle", "diamond", "plus", "cross", "hexagon", "wedge")
"""Marker shapes of agents in mission order, or of teams if there are many agents."""

LIGHT: dict[str, Any] = {
    "agents": ("#6a3d9a", "#009e73", "#b8478f", "#8a6d00", "#2a8cb8", "#444444", "#7a3b12", "#5f8f00"),
    "paper": "#f1f1ef",
    "floor": "#ffffff",
    "grid": "#ececec",
    "ink": "#222222",
    "faint": "#6b6b6b",
    "region": {"goal": "#d5ebdd", "avoid": "#f8ddcb", "start": "#cfe3f1", "plain": "#ebe9e2"},
    "outline": {"goal": "#4f9a70", "avoid": "#c98456", "start": "#6a9cc0", "plain": "#a09a86"},
    "obstacle": "#5b6066",
    "on_obstacle": "#ffffff",
    "helps": "#0072b2",
    "harms": "#c04f00",
    "neither": "#d9d6cc",
    "open": "#b9c4cc",
    "between": "#946200",
    "link": "#6a7680",
    "route": "#111111",
}

DARK: dict[str, Any] = {
    "agents": ("#b69be0", "#2fc79a", "#e88fc4", "#e6c34a", "#7fdcf0", "#c8c8c8", "#c99a76", "#a9d15a"),
    "paper": "#15181b",
    "floor": "#1e2327",
    "grid": "#2a3036",
    "ink": "#eceff1",
    "faint": "#98a2aa",
    "region": {"goal": "#1f4433", "avoid": "#4c3020", "start": "#1f3d52", "plain": "#37362f"},
    "outline": {"goal": "#4d9470", "avoid": "#a86b45", "start": "#4d86ad", "plain": "#7d7866"},
    "obstacle": "#8b949b",
    "on_obstacle": "#15181b",
    "helps": "#56b4e9",
    "harms": "#f08a3c",
    "neither": "#3a3d40",
    "open": "#4a545c",
    "between": "#e6b450",
    "link": "#8b98a3",
    "route": "#ffffff",
}

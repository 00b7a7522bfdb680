"""File names of agents: the bracket dropped, no two alike."""

from __future__ import annotations

from collections import Counter

from missionc.ir import Agent


def file_names(agents: tuple[Agent, ...]) -> dict[str, str]:
    """``drone[0]`` gives ``drone0``; names that only differ in case, or not at all, get the agent's number too."""
    plain = {agent.name: agent.name.replace("[", "").replace("]", "") for agent in agents}
    uses = Counter(name.casefold() for name in plain.values())
    # No identifier holds a hyphen, so that what is built here meets no other name.
    return {
        name: f"{file}-{agent.index}" if uses[file.casefold()] > 1 else file
        for agent in agents
        for name, file in [(agent.name, plain[agent.name])]
    }

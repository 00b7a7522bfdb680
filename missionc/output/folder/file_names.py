"""File names in the output folder, shared by its writer and its reader."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import PurePath

from missionc.ir import Agent

MISSION = "mission"
"""Name of the subfolder with the mission's own files, so that the folder can be verified from its contents."""
SIMULATION, SIMULATION_SCHEMA = "simulation.json", "missionc.simulation/4"
"""Name of the file in which ``simulate`` stores its flights, and its schema."""
SIMULATIONS_BEFORE = ("missionc.simulation/1", "missionc.simulation/2", "missionc.simulation/3")
"""Older schemas of that file, which do not record the disturbances of the flights."""
WHOLE_FLIGHT = "whole_flight.json"
"""Name of the file with the phases of a flight from takeoff to landing."""
SAFE_END = "safe_end.json"
"""Name of the file with the safe ends from many times of a flight."""
REPORT = "report.html"
"""Name of the report in a folder."""
MANIFEST, MANIFEST_SCHEMA = "manifest.json", "missionc.manifest/1"
"""Name of the file that lists all others in a folder, and its schema."""
ALTERNATIVES, ALTERNATIVES_FOLDER = "alternatives.json", "alternatives"
"""Name of the table of alternative plans, and of the folder for all plans except the best, in subfolders named
by rank.
"""
MOST_ALTERNATIVES = 20
"""Maximum number of plans in one folder."""
PAST = "past.json"
"""Name of the file with the flight before the plan of the folder begins."""
PLAN, NEAR_MISS, PROOF, EXPORT = "plan", "near_miss", "proof", "export"
"""Kinds of contents of a folder, as written in its manifest; the default is a plan."""


def input_name(source: str, folder: PurePath) -> str:
    """Path of a mission's file relative to the mission's folder, or its full name if it is elsewhere.

    The name may contain a backslash or bytes that are not text; both are replaced, so that names are readable
    everywhere.
    """
    path = PurePath(source)
    name = (path.relative_to(folder) if path.is_relative_to(folder) else path).as_posix()
    return name.encode("utf-8", "replace").decode("utf-8").replace("\\", "?")


def polynomials_file(file: str) -> str:
    """Path of the file with an agent's polynomials.

    Args:
        file: file name of the agent, from ``file_names``.
    """
    return f"crazyflie/{file}.csv"


def way_file(stage: str, file: str) -> str:
    """Path of the file with an agent's polynomials in a transfer.

    Args:
        stage: `out` or `home`.
        file: file name of the agent, from ``file_names``.
    """
    return f"crazyflie/{stage}/{file}.csv"


def stop_file(file: str) -> str:
    """Path of the file with the polynomials that an agent flies until its plan begins.

    Args:
        file: file name of the agent, from ``file_names``.
    """
    return f"stop/{file}.csv"


def file_names(agents: tuple[Agent, ...]) -> dict[str, str]:
    """File name of each agent, by the agent's name: ``drone0`` for ``drone[0]`` and ``t3_7`` for ``t[3][7]``.

    Equal names, or names that only differ in case, get the agent's number as well.
    """
    plain = {agent.name: _plain(agent.name) for agent in agents}
    uses = Counter(name.casefold() for name in plain.values())
    # No identifier contains a hyphen, so these names are unique.
    return {
        name: f"{file}-{agent.index}" if uses[file.casefold()] > 1 else file
        for agent in agents
        for name, file in [(agent.name, plain[agent.name])]
    }


def flights_in(agents: tuple[Agent, ...], files: Mapping[str, bytes]) -> dict[str, str]:
    """Text of each agent's polynomials among a folder's files, by the agent's name; empty if the file is missing."""
    return _texts_in(agents, files, polynomials_file)


def stops_in(agents: tuple[Agent, ...], files: Mapping[str, bytes]) -> dict[str, str]:
    """Text of the polynomials that each agent flies until its plan begins, by the agent's name.

    Empty if the file is missing.
    """
    return _texts_in(agents, files, stop_file)


def _texts_in(agents: tuple[Agent, ...], files: Mapping[str, bytes], place: Callable[[str], str]) -> dict[str, str]:
    names = file_names(agents)
    found = {agent.name: files.get(place(names[agent.name]), b"") for agent in agents}
    return {name: content.decode("utf-8", errors="replace") for name, content in found.items()}


def _plain(name: str) -> str:
    """The name without brackets around indices, with `_` between two of them, and `m` for a minus sign."""
    for sign, instead in (("][", "_"), (", ", "_"), ("[", ""), ("]", ""), ("-", "m")):
        name = name.replace(sign, instead)
    return name

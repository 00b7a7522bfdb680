"""File names in the output folder, shared by its writer and its reader."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import PurePath

from missionc.ir import Agent

MISSION = "mission"
"""Where the mission's own files lie, so that the folder can be judged from what is in it."""
SIMULATION, SIMULATION_SCHEMA = "simulation.json", "missionc.simulation/4"
"""Where ``simulate`` leaves what it flew, and what that says it is."""
SIMULATIONS_BEFORE = ("missionc.simulation/1", "missionc.simulation/2", "missionc.simulation/3")
"""What files of older versions say they are: they do not tell what their flights were flown through."""
WHOLE_FLIGHT = "whole_flight.json"
"""The phases of a flight from the floor to the floor."""
SAFE_END = "safe_end.json"
"""How everybody comes to rest, and down, from many moments of a flight."""
REPORT = "report.html"
"""The page that is drawn of a folder."""
MANIFEST, MANIFEST_SCHEMA = "manifest.json", "missionc.manifest/1"
"""The file that lists all others of a folder, and what that says it is."""
ALTERNATIVES, ALTERNATIVES_FOLDER = "alternatives.json", "alternatives"
"""The table of several plans in one folder, and where all but the best lie, each in a folder of its rank."""
MOST_ALTERNATIVES = 20
"""Plans that one folder may hold."""
PAST = "past.json"
"""What was flown before the plan of the folder begins."""
PLAN, NEAR_MISS, PROOF, EXPORT = "plan", "near_miss", "proof", "export"
"""What a folder may hold, as its manifest says; one that does not say so holds a plan."""


def input_name(source: str, folder: PurePath) -> str:
    """A mission's file relative to the mission's folder; its own name where it lies elsewhere.

    The name need be no text, and may hold a backslash; both are replaced, since names have to be read everywhere.
    """
    path = PurePath(source)
    name = (path.relative_to(folder) if path.is_relative_to(folder) else path).as_posix()
    return name.encode("utf-8", "replace").decode("utf-8").replace("\\", "?")


def polynomials_file(file: str) -> str:
    """Where an agent's polynomials lie, by the name that ``file_names`` gives it."""
    return f"crazyflie/{file}.csv"


def way_file(stage: str, file: str) -> str:
    """Likewise the polynomials of a way, `out` or `home`."""
    return f"crazyflie/{stage}/{file}.csv"


def stop_file(file: str) -> str:
    """Where the polynomials lie that an agent flies until its plan begins, by the name that ``file_names`` gives it."""
    return f"stop/{file}.csv"


def file_names(agents: tuple[Agent, ...]) -> dict[str, str]:
    """``drone[0]`` gives ``drone0`` and ``t[3][7]`` gives ``t3_7``.

    Names that only differ in case, or not at all, get the agent's number too.
    """
    plain = {agent.name: _plain(agent.name) for agent in agents}
    uses = Counter(name.casefold() for name in plain.values())
    # No identifier holds a hyphen, so that what is built here meets no other name.
    return {
        name: f"{file}-{agent.index}" if uses[file.casefold()] > 1 else file
        for agent in agents
        for name, file in [(agent.name, plain[agent.name])]
    }


def flights_in(agents: tuple[Agent, ...], files: Mapping[str, bytes]) -> dict[str, str]:
    """The text of each agent's polynomials, by the agent's name; empty where the file is missing."""
    return _texts_in(agents, files, polynomials_file)


def stops_in(agents: tuple[Agent, ...], files: Mapping[str, bytes]) -> dict[str, str]:
    """Likewise of what each agent flies until its plan begins."""
    return _texts_in(agents, files, stop_file)


def _texts_in(agents: tuple[Agent, ...], files: Mapping[str, bytes], place: Callable[[str], str]) -> dict[str, str]:
    names = file_names(agents)
    found = {agent.name: files.get(place(names[agent.name]), b"") for agent in agents}
    return {name: content.decode("utf-8", errors="replace") for name, content in found.items()}


def _plain(name: str) -> str:
    """Indices without brackets, `_` between two of them, `m` for the sign of one below 0."""
    for sign, instead in (("][", "_"), (", ", "_"), ("[", ""), ("]", ""), ("-", "m")):
        name = name.replace(sign, instead)
    return name

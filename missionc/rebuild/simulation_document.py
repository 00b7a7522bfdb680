"""``simulation.json`` checked for what can be known of it: its form, the plan's verdicts, and that it fits itself.

What was drawn for its flights is not in it, so nobody can fly them again from
the folder: how they went is what whoever ran the simulation says. Nothing that
is flown or verified rests on it.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from missionc.emit.simulation import EACH
from missionc.file_names import SIMULATION, SIMULATION_SCHEMA
from missionc.json_text import NotJsonError, parse_json
from missionc.monitoring import monitor
from missionc.rebuild.verdict import verdict
from missionc.reopen import Reopened
from missionc.report.simulated import FARTHEST
from missionc.simulation.course import SETPOINTS_PER_SECOND
from missionc.simulation.engines import ENGINES
from missionc.simulation.fly import sample_times
from missionc.simulation.fractions import fraction
from missionc.simulation.trials import TRACKING
from missionc.verify.agreement import close, difference, is_number
from missionc.verify.certificate import Check
from missionc.verify.columns import Pieces, curves_of, read

MOST_FLIGHTS = 100_000
LARGEST_SEED = 2**32 - 1
NEAR = 1e-3
"""Metres: places are kept to a tenth of a millimetre, and the flight is told in float32."""


def check_simulation(reopened: Reopened) -> Check:
    """The first entry that cannot be right, if there is one."""
    try:
        found = parse_json(reopened.text(SIMULATION))
        reason = next(_faults(reopened, found), None)
    except NotJsonError as error:
        reason = error.reason
    except (KeyError, TypeError, ValueError, AttributeError, IndexError):
        reason = "it is not what this version of the compiler writes"
    return verdict(SIMULATION, reason)


def _faults(reopened: Reopened, found: Any) -> Iterator[str]:
    mission, kernel = reopened.mission, reopened.kernel
    planned = [each.as_record() for each in monitor(mission, kernel, reopened.trace)[: len(kernel.requirements)]]
    names = [each["name"] for each in planned]
    yield from _differing(sorted(found), sorted(KEYS), "keys")
    yield from _differing(found["schema"], SIMULATION_SCHEMA, "schema")
    yield from _differing(found["planned"], planned, "planned")
    flights = found["flights"]
    if found["engine"] not in ENGINES:
        yield "its `engine` is none that this version knows"
    if not (_whole(flights, MOST_FLIGHTS) and flights and _whole(found["seed"], LARGEST_SEED)):
        yield "its `flights` or its `seed` cannot be"
    yield from _requirements(found, names, reopened)
    yield from _fractions(found, names, flights)
    yield from _tracking(found["tracking"], reopened)
    yield from _room(found["room"], reopened)
    yield from _path(found, reopened)


KEYS = (
    "schema",
    "passed",
    "engine",
    "seed",
    "flights",
    "planned",
    "requirements",
    "fractions",
    "tracking",
    "room",
    "robustness",
    "flight",
)


def _differing(read: object, computed: object, place: str) -> Iterator[str]:
    found = difference(read, computed, place)
    if found is not None:
        yield found


def _requirements(found: Any, names: list[object], reopened: Reopened) -> Iterator[str]:
    """The first flight's verdicts; and of each requirement its robustness in every flight, the first one's first."""
    agents = {agent.name for agent in reopened.mission.agents}
    yield from _differing([each["name"] for each in found["requirements"]], names, "requirements")
    yield from _differing(sorted(found["robustness"]), sorted(map(str, names)), "robustness")
    for each in found["requirements"]:
        every, step = found["robustness"][each["name"]], each["step"]
        fits = (
            set(each) == {"name", "satisfied", "robustness", "step", "agents"}
            and isinstance(each["satisfied"], bool)
            and (step is None or _whole(step, reopened.mission.steps))
            and agents.issuperset(each["agents"])
            and len(every) == found["flights"]
            and all(value is None or is_number(value) for value in every)
            and each["robustness"] == every[0]
            and (each["robustness"] is None or each["satisfied"] or each["robustness"] <= 0)
            and not (is_number(each["robustness"]) and each["robustness"] < 0 and each["satisfied"])
        )
        if not fits:
            yield f"what its `requirements` say of `{each['name']}` cannot be"


def _fractions(found: Any, names: list[object], flights: int) -> Iterator[str]:
    """How often each was kept, with Wilson's interval; passed is who always kept all."""
    wanted = {}
    for name in (*map(str, names), "tracking", "nothing touched"):
        held = found["fractions"][name]["held"]
        if not _whole(held, flights):
            yield f"its `fractions.{name}.held` cannot be"
            return
        share = fraction(held, flights)
        wanted[name] = {"held": held, "of": flights, "low": share.low, "high": share.high}
    yield from _differing(found["fractions"], wanted, "fractions")
    yield from _differing(found["passed"], all(each["held"] == flights for each in wanted.values()), "passed")
    for each in found["requirements"]:
        held = wanted[each["name"]]["held"]
        if held == (0 if each["satisfied"] else flights):
            yield f"its `fractions.{each['name']}` do not fit the first flight"


def _tracking(found: Any, reopened: Reopened) -> Iterator[str]:
    agents = reopened.mission.agents
    yield from _differing([each["agent"] for each in found], [agent.name for agent in agents], "tracking")
    for agent, each in zip(agents, found, strict=True):
        fits = (
            set(each) == {"agent", "allowed", "mean", "usual", "most", "at"}
            and all(is_number(each[key]) for key in ("allowed", "mean", "usual", "most", "at"))
            and close(each["allowed"], agent.vehicle.tracking or TRACKING)
            and 0 <= each["mean"] <= each["most"]
            and 0 <= each["usual"] <= each["most"]
            and 0 <= each["at"] <= reopened.mission.horizon + 1
        )
        if not fits:
            yield f"what its `tracking` says of `{agent.name}` cannot be"


def _room(found: Any, reopened: Reopened) -> Iterator[str]:
    mission = reopened.mission
    agents = {agent.name for agent in mission.agents}
    pairs = ["all pairs"] if len(mission.agents) > 1 else []
    subjects = [*pairs, *(obstacle.name for obstacle in mission.obstacles)]
    yield from _differing([each["subject"] for each in found], subjects, "room")
    for each in found:
        when = each["at"]
        fits = (
            set(each) == {"subject", "margin", "at", "agents"}
            and is_number(each["margin"])
            and (when is None or (is_number(when) and 0 <= when <= mission.horizon + 1))
            and agents.issuperset(each["agents"])
        )
        if not fits:
            yield f"what its `room` says of `{each['subject']}` cannot be"


def _path(found: Any, reopened: Reopened) -> Iterator[str]:
    """The first flight's path: as many places as it lasts, nobody further off than the most that is said."""
    flight, agents = found["flight"], reopened.mission.agents
    yield from _differing(sorted(flight), ["agents", "samples_per_second"], "flight")
    yield from _differing(flight["samples_per_second"], SETPOINTS_PER_SECOND // EACH, "flight.samples_per_second")
    yield from _differing(sorted(flight["agents"]), sorted(agent.name for agent in agents), "flight.agents")
    times = sample_times(reopened.mission.horizon)[::EACH]
    pieces = [own for agent in agents if isinstance(own := read(reopened.flights[agent.name]), Pieces)]
    planned = curves_of(pieces, slice(0, 3)).at(np.minimum(times, pieces[0].times[-1]))
    for agent, each in zip(agents, found["tracking"], strict=True):
        rows = flight["agents"][agent.name]
        if len(rows) != 3 or any(len(row) != times.size or not all(map(_near, row)) for row in rows):
            yield f"its path of `{agent.name}` has not three coordinates at {times.size} times"
            return
        error = np.linalg.norm(np.array(rows, dtype=np.float64).T - planned[agent.index], axis=-1).max()
        if error > each["most"] + NEAR:
            yield f"its path of `{agent.name}` is {error:.3f} m off, more than it says"


def _near(value: object) -> bool:
    return is_number(value) and abs(value) <= FARTHEST


def _whole(value: object, most: int) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value <= most

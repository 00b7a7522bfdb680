"""The forms of declarations and operators: an example of each, for messages."""

from __future__ import annotations


def _by_foreign(ours: dict[str, str]) -> dict[str, str]:
    """Map from words and signs of other languages to ours, the inverse of ``ours``."""
    return {foreign: own for own, written in ours.items() for foreign in written.split()}


DECLARED: dict[str, str] = {
    "mission": "mission wildfire",
    "param": "param T = 20 s",
    "include": 'include "site.mission"',
    "time": "time step 1 s, horizon 20 s",
    "world": "world (0, 0) to (10, 10)",
    "region": "region base = box (1, 1) to (3, 3)",
    "obstacle": "obstacle tower = disc at (5, 5) radius 1 m",
    "beacon": "beacon mast = (1.5, 1.5)",
    "team": "team drone[5] { radius 0.1 m  dynamics unicycle(speed 0..2 m/s)  start in base }",
    "agent": "agent truck { radius 0.1 m  dynamics single_integrator(speed <= 2 m/s)  start at (1, 1) }",
    "group": "group east = drone[0..2], truck",
    "graph": "graph radio = proximity 1 m",
    "formation": "formation wall = line of drone spacing 0.8 m tolerance 0.1 m",
    "separation": "separation 0.3 m",
    "clearance": "clearance 0.1 m",
    "resource": "resource battery of drone { start 100, drain 0.2 per s, refill 2 per s in dock }",
    "flag": "flag loaded of drone { set in depot, cleared in pack }",
    "let": "let safe = not fire",
    "require": "require home: every drone: eventually[0, end] base",
    "prefer": "prefer calm: every drone: always[0, end] speed <= 1 m/s weight 2",
    "minimize": "minimize distance",
    "maximize": "maximize robustness",
    "solve": "solve with smt { nodes = 110 }",
    "tolerate": "tolerate delay 2 s of drone",
    "obstacles": 'obstacles from "hall.yaml"',
    "regions": 'regions from "site.geojson" origin (8.54 deg, 47.38 deg)',
    "beacons": 'beacons from "masts.csv"',
}

PARTS: dict[str, str] = {
    "box": "box (1, 1) to (3, 3)",
    "disc": "disc at (5, 5) radius 1 m",
    "ball": "ball at (5, 5, 2) radius 1 m",
    "cylinder": "cylinder at (5, 5) radius 1 m height 0..2 m",
    "polygon": "polygon (1, 1), (3, 1), (2, 3)",
    "height": "height 0..2 m",
    "moving": "moving (1, 0) m/s",
    "along": "along (0 s: 0, 0), (4 s: 3, 0)",
    "uncertain": "uncertain 0.3 m/s",
    "origin": "origin (8.54 deg, 47.38 deg)",
    "layer": 'layer "WALLS"',
    "unknown": "unknown free",
    "named": "named hall",
    "dynamics": "dynamics single_integrator(speed <= 2 m/s)",
    "start": "start in base` or `start grid (1, 1) to (3, 3)",
    "vehicle": "vehicle crazyflie21` or `vehicle crazyflie21 { speed <= 0.8 m/s }",
    "flight": "flight` or `flight { pads at (1, 1, 0), (2, 1, 0)  hover 1 m  rise <= 0.3 m/s }",
    "pads": "pads at (1, 1, 0), (2, 1, 0)",
    "yaw": "yaw 90 deg` or `yaw along path",
    "finish": "finish in base` or `finish grid (1, 1) to (3, 3)",
}
"""Example of each part of a declaration, by the word that the part begins with."""

IN_FORMULA: dict[str, str] = {
    "every": "every drone: base",
    "some": "some drone: base",
    "least": "at least 2 drone: base",
    "without": "without any 1 drone: some drone: base",
    "any": "without any 1 drone: some drone: base",
    "count": "count[hops 1..1] base >= 2",
    "distance": "distance(base) <= 2 m",
    "heading": "heading within 10 deg of 90 deg",
}
"""Example for each word in formulas, with the text that must follow it."""

BOUNDS: dict[str, str] = {
    "TIME_PREFIX": "[0 s, 5 s]",
    "TIME_INFIX": "[0 s, 5 s]",
    "ROUTE_PREFIX": "[hops 1..2]",
    "ROUTE_INFIX": "[hops 0..2]",
    "count": "[hops 1..1]",
}
"""Example of the bounds for each class of operator."""

SIGNS: dict[str, str] = _by_foreign(
    {
        "and": "&& /\\ ∧",
        "or": "|| \\/ ∨",
        "not": "¬ ~",
        "every": "∀",
        "some": "∃",
        "implies": "=> ==> ⇒ →",
        "iff": "<=> ⇔ ↔",
        "always": "□",
        "eventually": "◇",
        "<=": "=< ≤",
        ">=": "≥",
        "-": "− –",
        "*": "× ·",
        "/": "÷",
        "=": ":=",
        "..": "... …",
        "#": "// /*",
        '"': "“ ” '",
        "": "; .",
    }
)
"""Our sign or word for each sign of other languages; empty if the language has none."""

WORDS: dict[str, str] = _by_foreign(
    {
        "always": "globally henceforth",
        "eventually": "finally sometime sometimes",
        "implies": "then",
        "some": "exists any",
        "every": "forall each all",
        "region": "zone area",
        "param": "const parameter",
        "agent": "robot",
        "team": "robots",
        "require": "property requirement assert",
        "minimize": "minimise",
        "maximize": "maximise",
        "disc": "circle",
        "ball": "sphere",
        "box": "rectangle",
    }
)
"""Our word for each word of other languages."""

INSTEAD: dict[str, str] = {
    "never": "always[0 s, 5 s] not f",
    "unless": "(f until[0 s, 5 s] g) or always[0 s, 5 s] f",
    "weakuntil": "(f until[0 s, 5 s] g) or always[0 s, 5 s] f",
    "xor": "not (f iff g)",
    "if": "f implies g",
    "no": "every drone: not f",
    "none": "every drone: not f",
    "for": "every drone: f",
    "exactly": "(at least 2 drone: f) and not at least 3 drone: f",
    "most": "not at least 3 drone: f",
}
"""Replacement for words of other languages that the language expresses with several words."""

UNITS_IN_FULL: dict[str, str] = _by_foreign(
    {
        "s": "sec secs second seconds",
        "min": "minute minutes",
        "ms": "millisecond milliseconds",
        "m": "meter meters metre metres",
        "deg": "degree degrees",
        "rad": "radian radians",
    }
)
"""Our spelling of each unit that is written in full."""

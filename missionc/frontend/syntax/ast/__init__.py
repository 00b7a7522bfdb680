"""The abstract syntax tree, as written: every node has its span, every name is still a word.

A mission is a list of declarations; a quantity keeps the unit it was written
with; an operator keeps its canonical word (``always`` for ``G``).
"""

from __future__ import annotations

from typing import TypeAlias

from missionc.base.source import Source
from missionc.frontend.syntax.ast.parts import *
from missionc.frontend.syntax.ast.parts import (
    File,
    Formula,
    Height,
    Member,
    Motion,
    Name,
    Node,
    Point,
    Quantity,
    Setting,
    Shape,
    TeamItem,
)


class MissionName(Node):
    name: Name


class Param(Node):
    name: Name
    value: Quantity


class Include(Node):
    """``include "site.mission"``; the parser replaces it by the file's declarations, so later passes never see one."""

    path: str


class Time(Node):
    step: Quantity
    horizon: Quantity


class World(Node):
    low: Point
    high: Point


class Region(Node):
    name: Name
    shape: Shape


class Obstacle(Node):
    """``obstacle NAME = SHAPE [MOTION] [uncertain growth]``"""

    name: Name
    shape: Shape
    motion: Motion | None = None
    growth: Quantity | None = None


class Beacon(Node):
    name: Name
    position: Point


class Team(Node):
    """``team drone[5] { … }``, or ``agent truck7 { … }`` where ``size`` is None."""

    name: Name
    size: Quantity | None
    items: tuple[TeamItem, ...]


class Group(Node):
    name: Name
    members: tuple[Name | Member, ...]


class OfPair(Node):
    """``tower to drone 8 m``: the range, or a weight, of links from the ones to the others."""

    senders: Name | Member
    receivers: Name | Member
    value: Quantity


class Weight(Node):
    """``weight cost 2 { drone to tower 3 }``: what links weigh, and those of some pairs."""

    name: Name
    value: Quantity
    pairs: tuple[OfPair, ...]


class Graph(Node):
    """``proximity 1 m``, ``sight 5 m`` or ``beacons 2.5 m``; ``over`` None means all agents.

    ``ranges`` are those of pairs; ``radius``, which may be left out beside them, that of all others.
    """

    name: Name
    kind: str
    radius: Quantity | None
    over: Name | Member | None
    ranges: tuple[OfPair, ...] = ()
    weights: tuple[Weight, ...] = ()


class Link(Node):
    """``0-1: 0.8`` in ``distances``: two members by their place in the group, and the distance."""

    first: Quantity
    second: Quantity
    distance: Quantity


class Formation(Node):
    """``kind`` is ``line chain circle grid star offsets distances``.

    ``settings``: ``spacing``, ``radius``, ``heading``, ``rows``, ``columns``,
    ``tolerance``; ``total`` says that the tolerance bounds the sum of the errors.
    """

    name: Name
    kind: Name
    agents: Name | Member
    settings: tuple[Setting, ...]
    offsets: tuple[Point, ...] | File = ()
    links: tuple[Link, ...] = ()
    total: bool = False


class Separation(Node):
    distance: Quantity


class Clearance(Node):
    distance: Quantity


class Rate(Node):
    """``start 100``, ``drain 0.2 per s``, ``refill 2 per s in dock``: what a resource begins with, or changes by."""

    name: Name
    value: Quantity
    unit: Name | None
    within: Name | None


class Resource(Node):
    """``resource battery of drone { start 100, drain 0.2 per s }``"""

    name: Name
    agents: Name | Member
    rates: tuple[Rate, ...]


class Mark(Node):
    """``set in depot``, ``cleared in pack``."""

    name: Name
    within: Name


class Flag(Node):
    """``flag loaded of drone { set in depot, cleared in pack }``"""

    name: Name
    agents: Name | Member
    marks: tuple[Mark, ...]


class Let(Node):
    name: Name
    body: Formula


class Require(Node):
    """``label`` is None where the author gave none."""

    label: Name | None
    body: Formula


class Prefer(Node):
    label: Name | None
    body: Formula
    weight: Quantity | None


class Minimize(Node):
    goal: Name


class Maximize(Minimize):
    """``maximize robustness``: an objective too, so that a mission has only one of the two."""

    goal: Name


class FileSetting(Node):
    """``roadmap = "lanes.graphml"``; ``source`` is the file, once it has been read."""

    name: Name
    path: str
    source: Source | None = None


class Solve(Node):
    """``solve with smt { nodes = 110, neighbors = 6 }``"""

    backend: Name
    settings: tuple[Setting, ...]
    files: tuple[FileSetting, ...] = ()


class Tolerate(Node):
    """``tolerate delay 2 s of drone``"""

    delay: Quantity
    agents: Name | Member


class FileOption(Node):
    """``at (2, 1)``, ``origin (8.54 deg, 47.38 deg)``, ``layer "WALLS"``, ``unknown free``, ``named hall``.

    ``value`` is a point after ``at`` and ``origin``, and words after the others.
    """

    word: str
    value: Point | tuple[str, ...]


class FromFile(Node):
    """``obstacles from "hall.yaml" resolution 5 cm unknown free``; ``kind`` is ``obstacles regions beacons``.

    ``settings``: ``resolution``, ``within``, ``unit``.
    """

    kind: str
    file: File
    settings: tuple[Setting, ...]
    options: tuple[FileOption, ...]
    heights: tuple[Height, ...]


Declaration: TypeAlias = (
    "MissionName | Param | Include | Time | World | Region | Obstacle | Beacon | Team | Group | Graph"
    " | Formation | Separation | Clearance | Resource | Flag | Let | Require | Prefer | Minimize | Solve"
    " | Tolerate | FromFile"
)


class Program(Node):
    """A whole mission: the main file's declarations with every include's spliced in at its place."""

    declarations: tuple[Declaration, ...]

"""The abstract syntax tree, as written: every node has its span, and names are not resolved.

A mission is a list of declarations; a quantity keeps the unit it was written with; an operator keeps its canonical word
(``always`` for ``G``).
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
    """Declaration ``include "site.mission"``.

    The parser replaces it by the file's declarations, so later passes never see one.
    """

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
    """Declaration ``obstacle NAME = SHAPE [MOTION] [uncertain growth]``."""

    name: Name
    shape: Shape
    motion: Motion | None = None
    growth: Quantity | None = None


class Beacon(Node):
    name: Name
    position: Point


class Team(Node):
    """Declaration ``team drone[5] { … }``, or ``agent truck7 { … }`` if ``size`` is None."""

    name: Name
    size: Quantity | None
    items: tuple[TeamItem, ...]


class Group(Node):
    name: Name
    members: tuple[Name | Member, ...]


class OfPair(Node):
    """Item ``tower to drone 8 m`` of a graph: range, or weight, of the links between two sets of agents."""

    senders: Name | Member
    receivers: Name | Member
    value: Quantity


class Weight(Node):
    """Item ``weight cost 2 { drone to tower 3 }`` of a graph: weight of links, with exceptions for pairs."""

    name: Name
    value: Quantity
    pairs: tuple[OfPair, ...]


class Graph(Node):
    """Declaration of a communication graph with ``proximity 1 m``, ``sight 5 m`` or ``beacons 2.5 m``.

    ``over`` None means all agents. ``ranges`` are those of pairs; ``radius`` is that of all others, and optional if
    there are ranges.
    """

    name: Name
    kind: str
    radius: Quantity | None
    over: Name | Member | None
    ranges: tuple[OfPair, ...] = ()
    weights: tuple[Weight, ...] = ()


class Link(Node):
    """Entry ``0-1: 0.8`` in a formation's ``distances``: two members by their index in the group, and the distance."""

    first: Quantity
    second: Quantity
    distance: Quantity


class Formation(Node):
    """Declaration of a formation; ``kind`` is one of ``line chain circle grid star offsets distances``.

    ``settings``: ``spacing``, ``radius``, ``heading``, ``rows``, ``columns``, ``tolerance``; ``total`` means that the
    tolerance bounds the sum of the errors.
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
    """Item ``start 100``, ``drain 0.2 per s`` or ``refill 2 per s in dock``: initial value or change of a resource."""

    name: Name
    value: Quantity
    unit: Name | None
    within: Name | None


class Resource(Node):
    """Declaration ``resource battery of drone { start 100, drain 0.2 per s }``."""

    name: Name
    agents: Name | Member
    rates: tuple[Rate, ...]


class Mark(Node):
    """Item ``set in depot`` or ``cleared in pack`` of a flag."""

    name: Name
    within: Name


class Flag(Node):
    """Declaration ``flag loaded of drone { set in depot, cleared in pack }``."""

    name: Name
    agents: Name | Member
    marks: tuple[Mark, ...]


class Let(Node):
    name: Name
    body: Formula


class Require(Node):
    """Declaration of a requirement; ``label`` is None if the author gave none."""

    label: Name | None
    body: Formula


class Prefer(Node):
    label: Name | None
    body: Formula
    weight: Quantity | None


class Minimize(Node):
    goal: Name


class Maximize(Minimize):
    """Declaration ``maximize robustness``; a subclass of ``Minimize``, so that a mission has at most one objective."""

    goal: Name


class FileSetting(Node):
    """Setting ``roadmap = "lanes.graphml"``; ``source`` is the file, once it has been read."""

    name: Name
    path: str
    source: Source | None = None


class Solve(Node):
    """Declaration ``solve with smt { nodes = 110, neighbors = 6 }``."""

    backend: Name
    settings: tuple[Setting, ...]
    files: tuple[FileSetting, ...] = ()


class Tolerate(Node):
    """Declaration ``tolerate delay 2 s of drone``."""

    delay: Quantity
    agents: Name | Member


class FileOption(Node):
    """Option of a file declaration, such as ``at (2, 1)``, ``origin (8.54 deg, 47.38 deg)``, ``layer "WALLS"``.

    ``value`` is a point after ``at`` and ``origin``, and words after the others.
    """

    word: str
    value: Point | tuple[str, ...]


class FromFile(Node):
    """Declaration ``obstacles from "hall.yaml" resolution 5 cm``.

    ``kind`` is ``obstacles``, ``regions`` or ``beacons``; ``settings`` are ``resolution``, ``within``, ``unit``.
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
    """Syntax tree of a mission: the main file's declarations, with those of each included file in place of the
    ``include``.
    """

    declarations: tuple[Declaration, ...]

"""Syntax tree of declarations, and of the mission they make up."""

from __future__ import annotations

from typing import TypeAlias

from missionc.base.late_dataclass import dataclass
from missionc.base.source import Source, Span
from missionc.frontend.syntax.ast.agents import Setting, TeamItem
from missionc.frontend.syntax.ast.formulas import Formula
from missionc.frontend.syntax.ast.quantities import File, Member, Name, Point, Quantity
from missionc.frontend.syntax.ast.shapes import Height, Motion, Shape


@dataclass(frozen=True, slots=True)
class MissionName:
    span: Span
    name: Name


@dataclass(frozen=True, slots=True)
class Param:
    span: Span
    name: Name
    value: Quantity


@dataclass(frozen=True, slots=True)
class Include:
    """``include "site.mission"``; the parser replaces it by the file's declarations, so later passes never see one."""

    span: Span
    path: str


@dataclass(frozen=True, slots=True)
class Time:
    span: Span
    step: Quantity
    horizon: Quantity


@dataclass(frozen=True, slots=True)
class World:
    span: Span
    low: Point
    high: Point


@dataclass(frozen=True, slots=True)
class Region:
    span: Span
    name: Name
    shape: Shape


@dataclass(frozen=True, slots=True)
class Obstacle:
    """``obstacle NAME = SHAPE [MOTION] [uncertain growth]``"""

    span: Span
    name: Name
    shape: Shape
    motion: Motion | None = None
    growth: Quantity | None = None


@dataclass(frozen=True, slots=True)
class Beacon:
    span: Span
    name: Name
    position: Point


@dataclass(frozen=True, slots=True)
class Team:
    """``team drone[5] { … }``, or ``agent truck7 { … }`` where ``size`` is None."""

    span: Span
    name: Name
    size: Quantity | None
    items: tuple[TeamItem, ...]


@dataclass(frozen=True, slots=True)
class Group:
    span: Span
    name: Name
    members: tuple[Name | Member, ...]


@dataclass(frozen=True, slots=True)
class OfPair:
    """``tower to drone 8 m``: the range, or a weight, of links from the ones to the others."""

    span: Span
    senders: Name | Member
    receivers: Name | Member
    value: Quantity


@dataclass(frozen=True, slots=True)
class Weight:
    """``weight cost 2 { drone to tower 3 }``: what links weigh, and those of some pairs."""

    span: Span
    name: Name
    value: Quantity
    pairs: tuple[OfPair, ...]


@dataclass(frozen=True, slots=True)
class Graph:
    """``proximity 1 m``, ``sight 5 m`` or ``beacons 2.5 m``; ``over`` None means all agents.

    ``ranges`` are those of pairs; ``radius``, which may be left out beside them, that of all others.
    """

    span: Span
    name: Name
    kind: str
    radius: Quantity | None
    over: Name | Member | None
    ranges: tuple[OfPair, ...] = ()
    weights: tuple[Weight, ...] = ()


@dataclass(frozen=True, slots=True)
class Link:
    """``0-1: 0.8`` in ``distances``: two members by their place in the group, and the distance."""

    span: Span
    first: Quantity
    second: Quantity
    distance: Quantity


@dataclass(frozen=True, slots=True)
class Formation:
    """``kind`` is ``line chain circle grid star offsets distances``.

    ``settings``: ``spacing``, ``radius``, ``heading``, ``rows``, ``columns``,
    ``tolerance``; ``total`` says that the tolerance bounds the sum of the errors.
    """

    span: Span
    name: Name
    kind: Name
    agents: Name | Member
    settings: tuple[Setting, ...]
    offsets: tuple[Point, ...] | File = ()
    links: tuple[Link, ...] = ()
    total: bool = False


@dataclass(frozen=True, slots=True)
class Separation:
    span: Span
    distance: Quantity


@dataclass(frozen=True, slots=True)
class Clearance:
    span: Span
    distance: Quantity


@dataclass(frozen=True, slots=True)
class Rate:
    """``start 100``, ``drain 0.2 per s``, ``refill 2 per s in dock``: what a resource begins with, or changes by."""

    span: Span
    name: Name
    value: Quantity
    unit: Name | None
    within: Name | None


@dataclass(frozen=True, slots=True)
class Resource:
    """``resource battery of drone { start 100, drain 0.2 per s }``"""

    span: Span
    name: Name
    agents: Name | Member
    rates: tuple[Rate, ...]


@dataclass(frozen=True, slots=True)
class Mark:
    """``set in depot``, ``cleared in pack``."""

    span: Span
    name: Name
    within: Name


@dataclass(frozen=True, slots=True)
class Flag:
    """``flag loaded of drone { set in depot, cleared in pack }``"""

    span: Span
    name: Name
    agents: Name | Member
    marks: tuple[Mark, ...]


@dataclass(frozen=True, slots=True)
class Let:
    span: Span
    name: Name
    body: Formula


@dataclass(frozen=True, slots=True)
class Require:
    """``label`` is None where the author gave none."""

    span: Span
    label: Name | None
    body: Formula


@dataclass(frozen=True, slots=True)
class Prefer:
    span: Span
    label: Name | None
    body: Formula
    weight: Quantity | None


@dataclass(frozen=True, slots=True)
class Minimize:
    span: Span
    goal: Name


@dataclass(frozen=True, slots=True)
class FileSetting:
    """``roadmap = "lanes.graphml"``; ``source`` is the file, once it has been read."""

    span: Span
    name: Name
    path: str
    source: Source | None = None


@dataclass(frozen=True, slots=True)
class Solve:
    """``solve with smt { nodes = 110, neighbors = 6 }``"""

    span: Span
    backend: Name
    settings: tuple[Setting, ...]
    files: tuple[FileSetting, ...] = ()


@dataclass(frozen=True, slots=True)
class Tolerate:
    """``tolerate delay 2 s of drone``"""

    span: Span
    delay: Quantity
    agents: Name | Member


@dataclass(frozen=True, slots=True)
class FileOption:
    """``at (2, 1)``, ``origin (8.54 deg, 47.38 deg)``, ``layer "WALLS"``, ``unknown free``, ``named hall``.

    ``value`` is a point after ``at`` and ``origin``, and words after the others.
    """

    span: Span
    word: str
    value: Point | tuple[str, ...]


@dataclass(frozen=True, slots=True)
class FromFile:
    """``obstacles from "hall.yaml" resolution 5 cm unknown free``; ``kind`` is ``obstacles regions beacons``.

    ``settings``: ``resolution``, ``within``, ``unit``.
    """

    span: Span
    kind: str
    file: File
    settings: tuple[Setting, ...]
    options: tuple[FileOption, ...]
    heights: tuple[Height, ...]


Declaration: TypeAlias = (
    MissionName
    | Param
    | Include
    | Time
    | World
    | Region
    | Obstacle
    | Beacon
    | Team
    | Group
    | Graph
    | Formation
    | Separation
    | Clearance
    | Resource
    | Flag
    | Let
    | Require
    | Prefer
    | Minimize
    | Solve
    | Tolerate
    | FromFile
)


@dataclass(frozen=True, slots=True)
class Program:
    """A whole mission: the main file's declarations with every include's spliced in at its place."""

    declarations: tuple[Declaration, ...]
    span: Span

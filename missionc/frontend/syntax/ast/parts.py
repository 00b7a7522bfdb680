"""The parts of declarations: names, quantities, shapes, agents and formulas."""

from __future__ import annotations

from typing import TypeAlias

from missionc.base.late_dataclass import Record
from missionc.base.source import Source, Span
from missionc.base.units import Metric


class Node(Record):
    """Node of the syntax tree, with its span in the text."""

    span: Span


# ------------------------------------------------- names, numbers and points


class Name(Node):
    text: str


class Index(Node):
    """Index ``i in 0..9`` with its range of integers, both ends included."""

    name: Name
    low: Quantity
    high: Quantity


class FamilyName(Name):
    """Name ``w[i in 0..9]`` in the declaration of a family.

    ``span`` and ``text`` are those of ``w``, ``whole_span`` is the full one.
    """

    indices: tuple[Index, ...]
    whole_span: Span


class Indexed(Name):
    """Member ``rack[i, j + 1]`` of a family.

    ``span`` and ``text`` are those of ``rack``, ``whole_span`` is the full one. A single index after the name of agents
    is always a ``Member``.
    """

    indices: tuple[Quantity, ...]
    whole_span: Span


class Number(Node):
    """Number with its unit, if it has one."""

    value: float
    unit: str | None = None
    unit_span: Span | None = None


class Negative(Node):
    body: Quantity


class Arithmetic(Node):
    """Arithmetic ``left op right`` with ``op`` one of ``+ - * /``."""

    operator: str
    left: Quantity
    right: Quantity


class Extreme(Node):
    """Minimum ``min(a, b)`` or maximum ``max(a, b)``, by its ``word``."""

    word: str
    parts: tuple[Quantity, ...]


class Member(Node):
    """Members ``drone[2]``, ``drone[0..2]`` or ``t[i][2]`` of a team by index.

    Until families are expanded, ``drone[2]`` may be a member of a family too.
    """

    team: Name
    low: Quantity
    high: Quantity | None = None


class Distance(Node):
    """Distance in a comparison, ``distance(base)`` or ``distance(drone[0], drone[1])``."""

    ends: tuple[Name | Member, ...]


Quantity: TypeAlias = "Name | Number | Negative | Arithmetic | Extreme | Distance"
"""Node of a quantity; ``Distance`` and the state words (``x``, ``speed``, as ``Name``) are for comparisons only."""


class Point(Node):
    coordinates: tuple[Quantity, ...]


class File(Node):
    """File name such as ``"hall.yaml"``; ``sources`` are the file and its companions, once they have been read."""

    path: str
    sources: tuple[Source, ...] = ()


# --------------------------------------------------- shapes and their motion


class Height(Node):
    """Altitude range ``height a..b``."""

    low: Quantity
    high: Quantity


class Box(Node):
    low: Point
    high: Point
    height: Height | None = None


class Disc(Node):
    centre: Point
    radius: Quantity
    height: Height | None = None


class Ball(Node):
    centre: Point
    radius: Quantity


class Cylinder(Node):
    centre: Point
    radius: Quantity
    height: Height


class Polygon(Node):
    corners: tuple[Point, ...]
    height: Height | None = None


class Combined(Node):
    """Shape ``left op right`` with ``op`` one of ``+`` (union), ``*`` (intersection), ``-`` (difference)."""

    operator: str
    left: Shape
    right: Shape


Shape: TypeAlias = "Name | Box | Disc | Ball | Cylinder | Polygon | Combined"


class Moving(Node):
    """Motion ``moving (2, 0) m/s``: constant velocity from time 0; ``unit`` is the unit after the bracket."""

    velocity: Point
    unit: str | None = None
    unit_span: Span | None = None


class Waypoint(Node):
    """Waypoint ``(4 s: 3, 0)``: the shape's offset at a time."""

    time: Quantity
    offset: tuple[Quantity, ...]


class Along(Node):
    """Motion ``along (0 s: 0, 0), (4 s: 3, 0)``: offsets over time, linear in between, static before and after."""

    waypoints: tuple[Waypoint, ...]


class AlongFile(Node):
    """Motion ``along from "route.csv"``, with the waypoints in a file."""

    file: File


Motion: TypeAlias = "Moving | Along | AlongFile"


# -------------------------------------------------------------------- agents


class Setting(Node):
    """Setting ``speed <= 2 m/s``, ``speed 1..2 m/s``, ``turn <= 90 deg/s``, ``nodes = 110`` or ``tolerance 0.1 m``.

    ``relation`` is ``<=``, ``=``, ``..`` or empty (a bare value after the word); ``low`` is given only for a range.
    """

    name: Name
    relation: str
    high: Quantity
    low: Quantity | None = None


class Dynamics(Node):
    name: Name
    settings: tuple[Setting, ...]


class InRegion(Node):
    region: Name


class AtPoints(Node):
    points: tuple[Point, ...]


class OnLine(Node):
    first: Point
    last: Point


class OnGrid(Node):
    low: Point
    high: Point


class AtListed(Node):
    """Positions ``from "starts.csv"``: a point for each agent, in the order of the file."""

    file: File


Places: TypeAlias = "InRegion | AtPoints | OnLine | OnGrid | AtListed"


class Start(Node):
    places: Places


class Finish(Node):
    places: Places


class Vehicle(Node):
    """Vehicle ``vehicle crazyflie21 { speed <= 0.8 m/s }``; the settings replace those of the profile."""

    name: Name
    settings: tuple[Setting, ...]


class Pads(Node):
    """Pads ``pads at (1, 1, 0), (2, 1, 0)``: positions of the agents of a team before takeoff and after landing."""

    places: Places


class Flight(Node):
    """Item ``flight { pads … hover 1 m rise <= 0.3 m/s }`` of a team; a bare ``flight`` has no items."""

    items: tuple[Pads | Setting, ...]


class Yaw(Node):
    """Item ``yaw 90 deg`` of a team, or ``yaw along path`` if ``angle`` is None."""

    angle: Quantity | None


TeamItem: TypeAlias = "Dynamics | Start | Finish | Vehicle | Flight | Yaw | Setting"
"""Node of an item inside a team's braces, in any order; ``radius`` and ``altitude`` are settings."""


# ------------------------------------------------------------------ formulas


class Truth(Node):
    value: bool


class Call(Node):
    """Predicate with arguments, such as ``inside(field)``, ``touches(field)`` or ``connected(radio, east)``.

    Arguments are never a ``Distance``.
    """

    name: Name
    arguments: tuple[Quantity | Member, ...]


class Compare(Node):
    """Comparison ``left op right`` with ``op`` one of ``<= < >= >``, over the agent's state and distances."""

    operator: str
    left: Quantity
    right: Quantity


class Facing(Node):
    """Heading predicate ``heading within 10 deg of 90 deg``; ``towards`` may be the ``Name`` of a beacon."""

    within: Quantity
    towards: Quantity


class Window(Node):
    """Time window ``[2 s, 12 s]``; ``high`` is None for ``end``."""

    low: Quantity
    high: Quantity | None


class Period(Node):
    """Period of a recurrence, the ``40 s`` in ``every 40 s: f``."""

    length: Quantity


class Length(Node):
    """Bounds of a route's length, such as ``[hops 0..2 on radio]``.

    ``low`` is None for ``<= 2``, ``high`` for ``2..``, ``graph`` if it is omitted. ``unit`` is the name of the weight
    that measures the length, if any.
    """

    metric: Metric
    low: Quantity | None
    high: Quantity | None
    graph: Name | None
    unit: Name | None = None

    @property
    def word(self) -> str:
        """Unit of the length: ``hops``, ``distance`` or the name of a weight."""
        return self.metric.value if self.unit is None else self.unit.text


class Apply(Node):
    """Operator with its operands, by its canonical word (``and``, ``always``, ``reach``, …).

    ``comparison`` and ``number`` are those of a count: ``>=`` and ``2`` in ``count[…] f >= 2``.
    """

    operator: str
    operator_span: Span
    operands: tuple[Formula, ...]
    bounds: Window | Length | Period | None = None
    comparison: str | None = None
    number: Quantity | None = None


class Quantified(Node):
    """Quantified formula ``every G: f``, ``some G: f``, ``at least 2 G: f``, ``without any 1 G: f``.

    ``kind`` is the quantifier.
    """

    kind: str
    number: Quantity | None
    agents: Name | Member
    body: Formula


class OneAgent(Node):
    """Formula about one agent, ``drone[0]: f`` (or ``truck7: f``, an agent by its own name)."""

    agent: Name | Member
    body: Formula


class ForEach(Node):
    """Formula ``for i in 0..9: f`` or ``for some i in 0..9: f``, which ``resolve`` expands to a conjunction or
    disjunction.

    ``kind`` is ``every`` or ``some``, ``word_span`` is the span of ``for``.
    """

    kind: str
    word_span: Span
    indices: tuple[Index, ...]
    body: Formula


Formula: TypeAlias = "Truth | Name | Member | Call | Compare | Facing | Apply | Quantified | OneAgent | ForEach"
"""Node of a formula; a ``Name`` may be a region, team, group, agent, formation or ``let``, as ``resolve``
determines.
"""

"""The parts of declarations: names, quantities, shapes, agents and formulas."""

from __future__ import annotations

from typing import TypeAlias

from missionc.base.late_dataclass import Record
from missionc.base.source import Source, Span
from missionc.base.units import Metric


class Node(Record):
    """A part of the tree, with its place in the text."""

    span: Span


# ------------------------------------------------- names, numbers and points


class Name(Node):
    text: str


class Index(Node):
    """``i in 0..9``: an index, and the whole numbers that it is, both ends among them."""

    name: Name
    low: Quantity
    high: Quantity


class FamilyName(Name):
    """``w[i in 0..9]`` where a family is declared: ``span`` and ``text`` are those of ``w``, ``whole_span`` of all."""

    indices: tuple[Index, ...]
    whole_span: Span


class Indexed(Name):
    """``rack[i, j + 1]``, a member of a family: ``span`` and ``text`` are those of ``rack``, ``whole_span`` of all.

    A single index after the name of agents is a ``Member``, whichever of the two is meant.
    """

    indices: tuple[Quantity, ...]
    whole_span: Span


class Number(Node):
    """A number and the unit written after it, if any."""

    value: float
    unit: str | None = None
    unit_span: Span | None = None


class Negative(Node):
    body: Quantity


class Arithmetic(Node):
    """``left op right`` with ``op`` one of ``+ - * /``."""

    operator: str
    left: Quantity
    right: Quantity


class Extreme(Node):
    """``min(a, b)`` or ``max(a, b)``, by its ``word``."""

    word: str
    parts: tuple[Quantity, ...]


class Member(Node):
    """``drone[2]``, ``drone[0..2]`` or ``t[i][2]``: members of a team by index.

    Until families are spelt out, ``drone[2]`` may be a member of a family too.
    """

    team: Name
    low: Quantity
    high: Quantity | None = None


class Distance(Node):
    """``distance(base)`` or ``distance(drone[0], drone[1])``."""

    ends: tuple[Name | Member, ...]


Quantity: TypeAlias = "Name | Number | Negative | Arithmetic | Extreme | Distance"
"""``Distance`` and the state words (``x``, ``speed``, as ``Name``) only fit inside a comparison; resolve says so."""


class Point(Node):
    coordinates: tuple[Quantity, ...]


class File(Node):
    """``"hall.yaml"``, the words; ``sources`` are the file and what it rests on, once they have been read."""

    path: str
    sources: tuple[Source, ...] = ()


# --------------------------------------------------- shapes and their motion


class Height(Node):
    """``height a..b``"""

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
    """``left op right`` with ``op`` one of ``+`` (union), ``*`` (intersection), ``-`` (difference)."""

    operator: str
    left: Shape
    right: Shape


Shape: TypeAlias = "Name | Box | Disc | Ball | Cylinder | Polygon | Combined"


class Moving(Node):
    """``moving (2, 0) m/s``: constant velocity from time 0. ``unit`` is the one after the bracket."""

    velocity: Point
    unit: str | None = None
    unit_span: Span | None = None


class Waypoint(Node):
    """``(4 s: 3, 0)``: the shape's offset at a time."""

    time: Quantity
    offset: tuple[Quantity, ...]


class Along(Node):
    """``along (0 s: 0, 0), (4 s: 3, 0)``: offsets over time, straight in between, at rest before and after."""

    waypoints: tuple[Waypoint, ...]


class AlongFile(Node):
    """``along from "route.csv"``: the waypoints are in the file."""

    file: File


Motion: TypeAlias = "Moving | Along | AlongFile"


# -------------------------------------------------------------------- agents


class Setting(Node):
    """``speed <= 2 m/s``, ``speed 1..2 m/s``, ``turn <= 90 deg/s``, ``nodes = 110``, ``tolerance 0.1 m``.

    ``relation`` is ``<=``, ``=``, ``..`` or empty (a bare value after the word);
    ``low`` is given only for a range.
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
    """``from "starts.csv"``: a point for each agent, in the order of the file."""

    file: File


Places: TypeAlias = "InRegion | AtPoints | OnLine | OnGrid | AtListed"


class Start(Node):
    places: Places


class Finish(Node):
    places: Places


class Vehicle(Node):
    """``vehicle crazyflie21 { speed <= 0.8 m/s }``; the settings take the place of the profile's own figures."""

    name: Name
    settings: tuple[Setting, ...]


class Pads(Node):
    """``pads at (1, 1, 0), (2, 1, 0)``: where the agents of a team stand before they rise, and land."""

    places: Places


class Flight(Node):
    """``flight { pads …  hover 1 m  rise <= 0.3 m/s }``; ``flight`` alone leaves all of it out."""

    items: tuple[Pads | Setting, ...]


class Yaw(Node):
    """``yaw 90 deg``, or ``yaw along path`` where ``angle`` is None."""

    angle: Quantity | None


TeamItem: TypeAlias = "Dynamics | Start | Finish | Vehicle | Flight | Yaw | Setting"
"""In any order inside the braces; ``radius`` and ``altitude`` are settings."""


# ------------------------------------------------------------------ formulas


class Truth(Node):
    value: bool


class Call(Node):
    """``inside(field)``, ``touches(field)``, ``connected(radio, east)``, ``connected(radio, 2)``.

    No argument is a ``Distance``.
    """

    name: Name
    arguments: tuple[Quantity | Member, ...]


class Compare(Node):
    """``left op right`` with ``op`` one of ``<= < >= >``, over the agent's state and distances."""

    operator: str
    left: Quantity
    right: Quantity


class Facing(Node):
    """``heading within 10 deg of 90 deg``; ``towards`` may be the ``Name`` of a beacon."""

    within: Quantity
    towards: Quantity


class Window(Node):
    """``[2 s, 12 s]``; ``high`` is None for ``end``."""

    low: Quantity
    high: Quantity | None


class Period(Node):
    """The ``40 s`` of ``every 40 s: f``."""

    length: Quantity


class Length(Node):
    """``[hops 0..2 on radio]``.

    ``low`` is None for ``<= 2``, ``high`` for ``2..``, ``graph`` where it is left out. ``unit`` names the weight that
    a length is measured in, if it is one.
    """

    metric: Metric
    low: Quantity | None
    high: Quantity | None
    graph: Name | None
    unit: Name | None = None

    @property
    def word(self) -> str:
        """``hops``, ``distance`` or the name of a weight."""
        return self.metric.value if self.unit is None else self.unit.text


class Apply(Node):
    """An operator on its operands, by its canonical word (``and``, ``always``, ``reach``, …).

    ``count`` keeps the comparison after it: ``>=`` and ``2`` in ``count[…] f >= 2``.
    """

    operator: str
    operator_span: Span
    operands: tuple[Formula, ...]
    bounds: Window | Length | Period | None = None
    comparison: str | None = None
    number: Quantity | None = None


class Quantified(Node):
    """``every G: f``, ``some G: f``, ``at least 2 G: f``, ``without any 1 G: f``; ``kind`` is the words before."""

    kind: str
    number: Quantity | None
    agents: Name | Member
    body: Formula


class OneAgent(Node):
    """``drone[0]: f`` (or ``truck7: f``, an agent by its own name)."""

    agent: Name | Member
    body: Formula


class ForEach(Node):
    """``for i in 0..9: f``, ``for some i in 0..9: f``: a conjunction, or a disjunction, once resolve has spelt it out.

    ``kind`` is ``every`` or ``some``, ``word_span`` that of ``for``.
    """

    kind: str
    word_span: Span
    indices: tuple[Index, ...]
    body: Formula


Formula: TypeAlias = "Truth | Name | Member | Call | Compare | Facing | Apply | Quantified | OneAgent | ForEach"
"""A ``Name`` may be a region, team, group, agent, formation or ``let``; resolve tells which."""

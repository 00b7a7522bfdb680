"""The mission as a Python object: its declarations, the named parts, and the printed text.

A declaration is a node of the syntax tree, built from Python values or parsed from text. The text of the mission has
the layout of ``missionc fmt``.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from os import PathLike, fspath
from pathlib import Path
from typing import Any, TypeAlias, TypeVar, Unpack, cast

from missionc.base.diagnostics.model import Diagnostic
from missionc.base.diagnostics.render import render_text
from missionc.base.limits import Limits
from missionc.base.source import Source, Span
from missionc.frontend.builder import parts
from missionc.frontend.builder.call_site import call_site
from missionc.frontend.builder.items import FlightLike, Places, TeamItems, VehicleLike, team_items
from missionc.frontend.builder.parts import (
    Agents,
    AgentsLike,
    Formula,
    NamedLike,
    Part,
    PointLike,
    Quantity,
    QuantityLike,
    Region,
    agents,
    declared_name,
    point,
    quantity,
    read_text,
)
from missionc.frontend.syntax import ast, show_tree
from missionc.frontend.syntax.format import format_mission
from missionc.frontend.syntax.read_file import read_source
from missionc.frontend.syntax.tokens import nameable

NAMES: dict[type, type[Part]] = {
    ast.Param: Quantity,
    ast.Region: Region,
    ast.Beacon: Part,
    ast.Team: Agents,
    ast.Group: Agents,
    ast.Graph: Part,
    ast.Formation: Formula,
    ast.Resource: Quantity,
    ast.Flag: Formula,
    ast.Let: Formula,
}
"""Python class of the named part for each kind of declaration."""

Named_ = TypeVar("Named_", bound=Part)
Pairs: TypeAlias = "Mapping[tuple[AgentsLike, AgentsLike], QuantityLike]"
"""Value for each pair of agents or teams, from the first to the second."""


class Mission:
    """A mission, built declaration by declaration.

    Each method adds the declaration that it is named after, and returns the part that it names. ``str(mission)`` is the
    text. Numbers are in SI units; a text such as ``"500 ms"`` has its own unit.

    Args:
        name: name of the mission.
        folder: folder of the files that the mission names.
    """

    def __init__(self, name: str, folder: str | PathLike[str] = "") -> None:
        self.folder = Path(folder)
        self._file = ""
        self._head = ""
        self._declarations: list[ast.Declaration] = []
        self._add(ast.MissionName(call_site(), declared_name(name)))

    @classmethod
    def read(cls, path: str | PathLike[str], limits: Limits | None = None) -> Mission:
        """Read a mission from a file; its text keeps its comments.

        Raises:
            ValueError: the file cannot be read, or has errors of syntax.
        """
        source = read_source(Path(path), fspath(path), limits or Limits())
        if isinstance(source, Diagnostic):
            raise ValueError(str(source))
        return cls._of(source, limits or Limits())

    @classmethod
    def from_text(cls, text: str, name: str = "text.mission", limits: Limits | None = None) -> Mission:
        """Read a mission from its text; ``name`` is its file name in messages and for relative paths.

        Raises:
            ValueError: the text has errors of syntax.
        """
        return cls._of(Source(name, text), limits or Limits())

    @classmethod
    def _of(cls, source: Source, limits: Limits) -> Mission:
        mission = cls.__new__(cls)
        mission.folder, mission._file = Path(source.name).parent, source.name
        mission._declarations = read_declarations(source, limits)
        mission._head = _formatted(source, limits)
        return mission

    @property
    def name(self) -> str:
        """Name of the mission; empty if its text declares none."""
        return next((each.name.text for each in self._declarations if isinstance(each, ast.MissionName)), "")

    @property
    def declarations(self) -> tuple[ast.Declaration, ...]:
        """Declarations in the order of addition.

        Each node has the span of the Python expression or text that built it.
        """
        return tuple(self._declarations)

    @property
    def source(self) -> Source:
        """Text of the mission as a source, with the name of a file in its folder."""
        return Source(self._file or str(self.folder / f"{self.name}.mission"), str(self))

    def __str__(self) -> str:
        """Text of the mission, as ``missionc fmt`` writes it."""
        head = len(read_declarations(Source("", self._head), Limits())) if self._head else 0
        rest = self._declarations[head:]
        shown = show_tree.show(ast.Program(call_site(), tuple(rest))) if rest else ""
        return _formatted(Source("", "\n".join(filter(None, (self._head, shown)))), Limits())

    def __repr__(self) -> str:
        return f"<Mission {self.name}: {len(self._declarations)} declarations>"

    def __getitem__(self, name: str) -> Any:
        """The declared part with a name: a region, a team, a parameter, ….

        Raises:
            KeyError: nothing of that name is declared here; included files are not searched.
        """
        for each in self._declarations:
            if type(each) in NAMES and cast(ast.Region, each).name.text == name:
                return NAMES[type(each)](ast.Name(call_site(), name))
        raise KeyError(name)

    def add(self, text: str) -> None:
        """Add declarations written in the mission language.

        Raises:
            ValueError: the text has errors of syntax.
        """
        span = call_site()
        self._declarations += [
            parts.with_span(each, span) for each in read_declarations(Source("text", text), Limits())
        ]

    # ------------------------------------------------------------ time and world

    def param(self, name: str, value: QuantityLike) -> Quantity:
        """Declare a parameter, whose value ``overrides`` can replace."""
        return self._named(Quantity, ast.Param(call_site(), declared_name(name), quantity(value).node))

    def include(self, path: str) -> None:
        """Include the declarations of another file, whose path is relative to the mission's folder."""
        self._add(ast.Include(call_site(), path))

    def time(self, step: QuantityLike, horizon: QuantityLike) -> None:
        """Set the duration of a step and the time of the last step, in seconds."""
        self._add(ast.Time(call_site(), quantity(step).node, quantity(horizon).node))

    def world(self, low: PointLike, high: PointLike) -> None:
        """Set two opposite corners of the world, metres: a plane with two coordinates, or a volume with three."""
        self._add(ast.World(call_site(), point(low), point(high)))

    def region(self, name: str, shape_: parts.ShapeLike) -> Region:
        """Declare a region with a shape."""
        return self._named(Region, ast.Region(call_site(), declared_name(name), parts.shape(shape_).node))

    def obstacle(
        self,
        name: str,
        shape_: parts.ShapeLike,
        *,
        moving: PointLike | None = None,
        along: str | Iterable[tuple[QuantityLike, ...]] | None = None,
        uncertain: QuantityLike | None = None,
    ) -> None:
        """Declare an obstacle.

        Args:
            moving: velocity, m/s.
            along: offsets over time, ``(time, x, y)`` each, in seconds and metres, or a CSV file of them.
            uncertain: speed of growth on all sides, m/s.
        """
        span = call_site()
        motion: ast.Motion | None = None
        if moving is not None:
            motion = ast.Moving(span, point(moving))
        elif isinstance(along, str):
            motion = ast.AlongFile(span, ast.File(span, along))
        elif along is not None:
            rows = [[quantity(each).node for each in row] for row in along]
            motion = ast.Along(span, tuple(ast.Waypoint(span, row[0], tuple(row[1:])) for row in rows))
        growth = None if uncertain is None else quantity(uncertain).node
        self._add(ast.Obstacle(span, declared_name(name), parts.shape(shape_).node, motion, growth))

    def beacon(self, name: str, position: PointLike) -> Part:
        """Declare a beacon: a vertex of a graph, or a point that distances are measured to."""
        return self._named(Part, ast.Beacon(call_site(), declared_name(name), point(position)))

    # -------------------------------------------------------------------- agents

    def team(
        self,
        name: str,
        size: QuantityLike,
        *,
        dynamics: str,
        start: Places,
        finish: Places | None = None,
        radius: QuantityLike | None = None,
        altitude: QuantityLike | None = None,
        vehicle: VehicleLike | None = None,
        flight: FlightLike = False,
        yaw: QuantityLike | None = None,
    ) -> Agents:
        """Declare a team of ``size`` agents.

        Args:
            dynamics: result of a function such as ``unicycle(speed=(0, 2))``, or a text.
            start: a region, a point for each agent, or a text such as ``"line (0, 0) to (8, 0)"``.
            finish: position at the horizon, in the same forms.
            radius: radius of each body, metres.
            altitude: flight altitude in a plane, metres.
            vehicle: the name of a profile; with changed parameters ``("crazyflie21", {"speed": 0.8})``.
            flight: True if the team takes off and lands, or ``{"pads": points, "hover": 1}``, or a text in braces.
            yaw: yaw angle, rad, or ``"along path"``.
        """
        items = {"dynamics": dynamics, "start": start, "finish": finish, "radius": radius, "altitude": altitude}
        made = team_items({**items, "vehicle": vehicle, "flight": flight, "yaw": yaw})
        return self._named(Agents, ast.Team(call_site(), declared_name(name), quantity(size).node, made))

    def agent(self, name: str, **items: Unpack[TeamItems]) -> Agents:
        """Declare a single agent with its own name; arguments as for ``team``."""
        return self._named(Agents, ast.Team(call_site(), declared_name(name), None, team_items(items)))

    def group(self, name: str, *members: AgentsLike) -> Agents:
        """Declare a group of agents, members of teams, and teams."""
        nodes = tuple(agents(each).node for each in members)
        return self._named(Agents, ast.Group(call_site(), declared_name(name), nodes))

    def resource(
        self,
        name: str,
        of: AgentsLike,
        *,
        start: float | str,
        capacity: float | str | None = None,
        drain: Mapping[str, QuantityLike] | None = None,
        refill: Mapping[NamedLike, QuantityLike] | None = None,
    ) -> Quantity:
        """Declare a resource of some agents.

        Args:
            start: value at 0 s.
            capacity: maximum value; ``start`` if omitted.
            drain: consumption per second and per metre: ``{"s": 0.2, "m": 0.5}``.
            refill: gain per second in each region: ``{dock: 2}``.
        """
        rates = [f"start {parts.tight(start)}", *([] if capacity is None else [f"capacity {parts.tight(capacity)}"])]
        rates += [f"drain {parts.tight(rate)} per {unit}" for unit, rate in (drain or {}).items()]
        rates += [f"refill {parts.tight(rate)} per s in {_name(region)}" for region, rate in (refill or {}).items()]
        return self._read(Quantity, f"resource {name} of {agents(of)} {{ {', '.join(rates)} }}")

    def flag(
        self,
        name: str,
        of: AgentsLike,
        *,
        set: NamedLike | list[NamedLike],
        cleared: NamedLike | list[NamedLike] | None = None,
    ) -> Formula:
        """Declare a flag, a stored truth value of each agent that is set and cleared by entering regions.

        Args:
            of: the agents that store the flag.
            set, cleared: regions in which the flag is set and cleared.
        """
        marks = [f"set in {_name(each)}" for each in _listed(set)]
        marks += [f"cleared in {_name(each)}" for each in _listed(cleared)]
        return self._read(Formula, f"flag {name} of {agents(of)} {{ {', '.join(marks)} }}")

    # --------------------------------------------------------- graphs, formations

    def graph(
        self,
        name: str,
        kind: str,
        radius: QuantityLike | None = None,
        *,
        over: AgentsLike | None = None,
        pairs: Mapping[tuple[AgentsLike, AgentsLike], QuantityLike] | None = None,
        weights: Mapping[str, QuantityLike | tuple[QuantityLike, Pairs]] | None = None,
    ) -> Part:
        """Declare a communication graph: the links between agents at every time.

        Args:
            kind: ``proximity``, ``beacons`` or ``sight``.
            radius: maximum length of a link, metres.
            over: the agents that have links; all if omitted.
            pairs: ranges between pairs of agents: ``{(tower, drone): 8}``.
            weights: weight of each link, by name; with weights of pairs ``{"delay": (2, {(drone, tower): 3})}``.
        """
        text = [f"graph {name} = {kind}", *([] if radius is None else [parts.tight(radius)])]
        text += [] if over is None else [f"over {agents(over)}"]
        text += [_pairs(pairs)] if pairs else []
        for weight, given in (weights or {}).items():
            value, own = given if isinstance(given, tuple) else (given, {})
            text.append(f"weight {weight} {parts.tight(value)} {_pairs(own) if own else ''}")
        return self._read(Part, " ".join(text))

    def formation(
        self,
        name: str,
        kind: str,
        of: AgentsLike,
        *,
        tolerance: QuantityLike,
        total: bool = False,
        offsets: str | Iterable[PointLike] | None = None,
        distances: Mapping[tuple[int, int], QuantityLike] | None = None,
        **settings: QuantityLike,
    ) -> Formula:
        """Declare a formation.

        Args:
            kind: ``line``, ``chain``, ``circle``, ``grid``, ``star``, ``offsets`` or ``distances``.
            of: agents in the order of the formation.
            tolerance: maximum error of each edge, metres; with ``total``, of the sum of all errors.
            offsets: offset of each agent from the first, metres, or a CSV file of them.
            distances: distances between pairs of members, by index, metres.
            settings: ``spacing``, ``radius``, ``heading``, ``rows``, ``columns``.
        """
        text = [f"formation {name} = {kind} of {agents(of)}"]
        if offsets is not None:
            text.append(f'from "{offsets}"' if isinstance(offsets, str) else show_tree.points(parts.points(offsets)))
        if distances:
            links = (f"{first} - {last}: {parts.tight(value)}" for (first, last), value in distances.items())
            text.append(f"({', '.join(links)})")
        text += [f"{word} {parts.tight(value)}" for word, value in settings.items()]
        return self._read(Formula, " ".join([*text, f"{'total ' * total}tolerance {parts.tight(tolerance)}"]))

    def separation(self, distance: QuantityLike) -> None:
        """Set the minimum gap between the surfaces of two agents, metres."""
        self._add(ast.Separation(call_site(), quantity(distance).node))

    def clearance(self, distance: QuantityLike) -> None:
        """Set the minimum gap between an agent and an obstacle, metres."""
        self._add(ast.Clearance(call_site(), quantity(distance).node))

    def tolerate_delay(self, delay: QuantityLike, of: AgentsLike) -> None:
        """Require a plan that stays valid if any single agent among ``of`` is late by up to ``delay`` seconds."""
        self._add(ast.Tolerate(call_site(), quantity(delay).node, agents(of).node))

    # ------------------------------------------------------------ requirements

    def let(self, name: str, body: parts.FormulaLike) -> Formula:
        """Declare a name for a formula."""
        return self._named(Formula, ast.Let(call_site(), declared_name(name), parts.formula(body).node))

    def require(self, body: parts.FormulaLike, label: str | None = None) -> None:
        """Add a requirement: a formula that must hold at step 0."""
        self._add(ast.Require(call_site(), _label(label), parts.formula(body).node))

    def prefer(self, body: parts.FormulaLike, label: str | None = None, *, weight: QuantityLike | None = None) -> None:
        """Add a preference (soft requirement) with its relative weight."""
        value = None if weight is None else quantity(weight).node
        self._add(ast.Prefer(call_site(), _label(label), parts.formula(body).node, value))

    def minimize(self, goal: str) -> None:
        """Set the objective to minimise: ``distance``, ``duration`` or ``energy``."""
        self._add(ast.Minimize(call_site(), declared_name(goal) if goal != "distance" else ast.Name(call_site(), goal)))

    def maximize(self, goal: str) -> None:
        """Set the objective to maximise: ``robustness``."""
        self._add(ast.Maximize(call_site(), declared_name(goal)))

    def solve(self, backend: str = "auto", **options: QuantityLike) -> None:
        """Choose a backend and its options, such as ``nodes=110``, ``connectivity="lambda2"``,
        ``roadmap="lanes.graphml"``.
        """
        written = [
            f'{word} = "{value}"'
            if isinstance(value, str) and not nameable(value) and "." in value
            else f"{word} = {parts.tight(value)}"
            for word, value in options.items()
        ]
        self._add(read_text("{}", f"solve with {backend}" + (f" {{ {', '.join(written)} }}" if written else "")))

    # ---------------------------------------------------------- places from files

    def obstacles_from(self, file: str, **options: Any) -> None:
        """Declare the obstacles of a map, a drawing, a table or a GeoJSON file.

        Args:
            options: keywords of the language with their values: ``resolution=0.05``, ``origin=("8.54 deg", "47.38
                deg")``, ``layer=["WALLS"]``, ``height=(0, 3)``, ``named="hall"``, ….
        """
        self._from("obstacles", file, options)

    def regions_from(self, file: str, **options: Any) -> None:
        """Declare the regions of a file; arguments as for ``obstacles_from``."""
        self._from("regions", file, options)

    def beacons_from(self, file: str, **options: Any) -> None:
        """Declare the beacons of a file; arguments as for ``obstacles_from``."""
        self._from("beacons", file, options)

    def _from(self, kind: str, file: str, options: Mapping[str, Any]) -> None:
        words = [f"{word} {_option(word, value)}" for word, value in options.items()]
        self._add(read_text("{}", " ".join([f'{kind} from "{file}"', *words])))

    # ------------------------------------------------------------- declarations

    def _add(self, declaration: ast.Declaration) -> None:
        self._declarations.append(declaration)

    def _named(self, kind: type[Named_], declaration: ast.Declaration) -> Named_:
        self._add(declaration)
        name = cast(ast.Region, declaration).name
        return kind(ast.Name(name.span, name.text))

    def _read(self, kind: type[Named_], text: str) -> Named_:
        return self._named(kind, read_text("{}", text))


def read_declarations(source: Source, limits: Limits | None = None) -> list[ast.Declaration]:
    """Declarations that a text contains, without those in included files.

    Raises:
        ValueError: the text has errors of syntax.
    """
    declarations, wrong = parts.read_alone(source, limits or Limits())
    if wrong:
        raise ValueError(render_text(wrong, False))
    return declarations


def _formatted(source: Source, limits: Limits) -> str:
    """A text without syntax errors in the layout of ``missionc fmt``."""
    program = ast.Program(Span(source, 0, len(source.text)), tuple(read_declarations(source, limits)))
    return format_mission(source, program, limits)


# ------------------------------------------------------------- texts of values


def _name(value: NamedLike) -> str:
    return show_tree.named(parts.name_of(value))


def _listed(value: NamedLike | list[NamedLike] | None) -> list[NamedLike]:
    return value if isinstance(value, list) else [] if value is None else [value]


def _label(label: str | None) -> ast.Name | None:
    return None if label is None else cast(ast.Require, read_text("require {}: true", label)).label


def _pairs(pairs: Pairs) -> str:
    written = (f"{agents(ends[0])} to {agents(ends[1])} {parts.tight(value)}" for ends, value in pairs.items())
    return f"{{ {', '.join(written)} }}"


def _option(word: str, value: Any) -> str:
    """Text for the value of a keyword that follows ``from "FILE"``."""
    match word, value:
        case "layer", str():
            return f'"{value}"'
        case "layer", _:
            return ", ".join(f'"{each}"' for each in value)
        case "height", (low, high):
            return f"{parts.tight(low)}..{parts.tight(high)}"
        case (("at" | "origin"), _):
            return show_tree.point_text(point(value))
        case (("named" | "unknown"), _):
            return str(value)
        case _:
            return parts.tight(value)

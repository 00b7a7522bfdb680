"""Random trees and texts of the mission language, shared by the property tests.

The trees are well-formed but meaningless: names are undeclared and units need not fit. ``show`` turns them into texts.
"""

from __future__ import annotations

import re
from dataclasses import fields, is_dataclass

import numpy as np
from hypothesis import strategies as st

from missionc.base.source import Source, Span
from missionc.base.units import Metric
from missionc.frontend.syntax import ast
from missionc.frontend.syntax.show_tree import show

NOWHERE = Span(Source("made", ""), 0, 0)

# Words with another meaning elsewhere in the language are valid names.
NAMES = ("a", "base", "drone", "east_2", "T", "N", "m", "s", "U", "R", "Rel", "line", "grid", "x", "speed", "radius")
SOFT = (
    "height",
    "start",
    "finish",
    "step",
    "horizon",
    "hops",
    "weight",
    "total",
    "moving",
    "along",
    "uncertain",
    "least",
    "delay",
)
SOFT += ("vehicle", "flight", "pads", "yaw", "path")
SOFT += ("obstacles", "regions", "beacons", "from", "origin", "layer", "unknown", "named")
UNITS = ("ms", "s", "min", "cm", "m", "km", "deg", "rad", "m/s", "m/s^2", "deg/s", "steps")


def without_spans(node: object) -> object:
    """Tree as plain tuples, equal for two trees that differ only in spans and in files that were read."""
    if isinstance(node, tuple):
        return tuple(without_spans(part) for part in node)
    if is_dataclass(node) and not isinstance(node, type):
        kept = [field.name for field in fields(node) if not field.name.endswith(("span", "source", "sources"))]
        return (type(node).__name__, *(without_spans(getattr(node, name)) for name in kept))
    return node


def mutated(text: str, generator: np.random.Generator) -> str:
    """Text with one to four characters or tokens deleted, inserted, doubled or swapped."""
    pieces = re.findall(r"\w+|\s+|.", text) if generator.random() < 0.7 else list(text)
    for _ in range(generator.integers(1, 5)):
        here, there = (int(place) for place in generator.integers(0, len(pieces), 2))
        match int(generator.integers(0, 5)):
            case 0:
                del pieces[here]
            case 1:
                pieces.insert(here, pieces[there])
            case 2:
                pieces[here], pieces[there] = pieces[there], pieces[here]
            case 3:
                pieces.insert(here, str(generator.choice(list("()[]{}:=<>!&|.,;#\"'\0\n-+*/^é∧9"))))
            case _:
                del pieces[here : here + int(generator.integers(1, 20))]
        if not pieces:
            return ""
    return "".join(pieces)


# ---------------------------------------------------------------- quantities

names = st.builds(ast.Name, st.just(NOWHERE), st.sampled_from(NAMES + SOFT))
_values = st.one_of(
    st.integers(0, 2000).map(float), st.integers(0, 10**6).map(lambda n: n / 1000), st.sampled_from([1e-3, 1e-7, 1e9])
)
_plain_numbers = st.builds(ast.Number, st.just(NOWHERE), _values)
_numbers = st.one_of(
    _plain_numbers, st.builds(ast.Number, st.just(NOWHERE), _values, st.sampled_from(UNITS), st.just(NOWHERE))
)
whole_numbers = st.builds(ast.Number, st.just(NOWHERE), st.integers(0, 20).map(float))


def _sums(leaves: st.SearchStrategy[ast.Quantity]) -> st.SearchStrategy[ast.Quantity]:
    return st.recursive(
        leaves,
        lambda part: st.one_of(
            st.builds(ast.Negative, st.just(NOWHERE), part),
            st.builds(ast.Arithmetic, st.just(NOWHERE), st.sampled_from("+-*/"), part, part),
            st.builds(
                ast.Extreme,
                st.just(NOWHERE),
                st.sampled_from(["min", "max"]),
                st.lists(part, min_size=1, max_size=3).map(tuple),
            ),
        ),
        max_leaves=4,
    )


_amounts = _sums(st.one_of(_numbers, names))


def _indexed(least: int) -> st.SearchStrategy[ast.Indexed]:
    """Members of families, with at least ``least`` indices."""
    indices = st.lists(_amounts, min_size=least, max_size=3).map(tuple)
    return st.builds(ast.Indexed, st.just(NOWHERE), st.sampled_from(NAMES + SOFT), indices, st.just(NOWHERE))


references = st.one_of(names, names, _indexed(1))
quantities = _sums(st.one_of(_numbers, references))
indices = st.lists(st.builds(ast.Index, st.just(NOWHERE), names, quantities, quantities), min_size=1, max_size=2).map(
    tuple
)
declared = st.one_of(
    names,
    names,
    st.builds(ast.FamilyName, st.just(NOWHERE), st.sampled_from(NAMES + SOFT), indices, st.just(NOWHERE)),
)
counts = st.one_of(whole_numbers, names)
members = st.builds(ast.Member, st.just(NOWHERE), references, counts, st.none() | counts)
agents = st.one_of(names, members, _indexed(2))
measures = _sums(
    st.one_of(
        _numbers,
        references,
        st.builds(ast.Distance, st.just(NOWHERE), st.lists(agents, min_size=1, max_size=2).map(tuple)),
    )
)
points = st.builds(ast.Point, st.just(NOWHERE), st.lists(quantities, min_size=2, max_size=3).map(tuple))
files = st.builds(ast.File, st.just(NOWHERE), st.sampled_from(["rows.csv", "maps/old hall.csv"]))
point_lists = st.lists(points, min_size=1, max_size=4).map(tuple)

# ------------------------------------------------------------------ formulas

windows = st.builds(ast.Window, st.just(NOWHERE), quantities, st.none() | quantities)
periods = st.builds(ast.Period, st.just(NOWHERE), quantities)
_metrics = st.sampled_from((Metric.HOPS, Metric.METRES))
_weights = st.just(Metric.WEIGHT)
_on = st.none() | references
_of_weights = names.filter(lambda name: name.text not in ("hops", "distance"))
lengths = st.one_of(
    st.builds(ast.Length, st.just(NOWHERE), _metrics, quantities, st.none() | quantities, _on),
    st.builds(ast.Length, st.just(NOWHERE), _metrics, st.none(), quantities, _on),
    st.builds(ast.Length, st.just(NOWHERE), _weights, quantities, st.none() | quantities, _on, _of_weights),
    st.builds(ast.Length, st.just(NOWHERE), _weights, st.none(), quantities, _on, _of_weights),
)


def _applied(
    words: str, operands: st.SearchStrategy[tuple[ast.Formula, ...]], bounds: st.SearchStrategy[object]
) -> st.SearchStrategy[ast.Apply]:
    return st.builds(ast.Apply, st.just(NOWHERE), st.sampled_from(words.split()), st.just(NOWHERE), operands, bounds)


def _larger(part: st.SearchStrategy[ast.Formula]) -> st.SearchStrategy[ast.Formula]:
    one = st.tuples(part)
    two = st.tuples(part, part)
    return st.one_of(
        _applied("not next arrives leaves", one, st.none()),
        _applied("always eventually once historically", one, windows),
        _applied("every", one, periods),
        _applied("escape somewhere everywhere", one, lengths),
        _applied("until release since", two, windows),
        _applied("reach surround", two, lengths),
        _applied("implies iff", two, st.none()),
        _applied("and or", st.lists(part, min_size=2, max_size=4).map(tuple), st.none()),
        st.builds(
            ast.Apply,
            st.just(NOWHERE),
            st.just("count"),
            st.just(NOWHERE),
            one,
            lengths,
            st.sampled_from(["<=", "<", ">", ">=", "="]),
            counts,
        ),
        st.builds(ast.Quantified, st.just(NOWHERE), st.sampled_from(["every", "some"]), st.none(), agents, part),
        st.builds(ast.Quantified, st.just(NOWHERE), st.sampled_from(["at least", "without any"]), counts, agents, part),
        st.builds(ast.OneAgent, st.just(NOWHERE), agents, part),
        st.builds(ast.ForEach, st.just(NOWHERE), st.sampled_from(["every", "some"]), st.just(NOWHERE), indices, part),
    )


_arguments = st.lists(
    st.one_of(agents, _numbers, st.builds(ast.Arithmetic, st.just(NOWHERE), st.sampled_from("+-*/"), names, _numbers)),
    min_size=1,
    max_size=3,
).map(tuple)
formulas = st.recursive(
    st.one_of(
        st.builds(ast.Truth, st.just(NOWHERE), st.booleans()),
        agents,
        st.builds(ast.Call, st.just(NOWHERE), names, _arguments),
        st.builds(ast.Compare, st.just(NOWHERE), st.sampled_from(["<=", "<", ">", ">="]), measures, measures),
        st.builds(ast.Facing, st.just(NOWHERE), quantities, quantities),
    ),
    _larger,
    max_leaves=10,
)

# -------------------------------------------------------------- declarations

_heights = st.none() | st.builds(ast.Height, st.just(NOWHERE), quantities, quantities)
shapes = st.recursive(
    st.one_of(
        references,
        st.builds(ast.Box, st.just(NOWHERE), points, points, _heights),
        st.builds(ast.Disc, st.just(NOWHERE), points, quantities, _heights),
        st.builds(ast.Ball, st.just(NOWHERE), points, quantities),
        st.builds(
            ast.Cylinder,
            st.just(NOWHERE),
            points,
            quantities,
            st.builds(ast.Height, st.just(NOWHERE), quantities, quantities),
        ),
        st.builds(ast.Polygon, st.just(NOWHERE), point_lists, _heights),
    ),
    lambda part: st.builds(ast.Combined, st.just(NOWHERE), st.sampled_from("+-*"), part, part),
    max_leaves=4,
)
_waypoints = st.builds(
    ast.Waypoint, st.just(NOWHERE), quantities, st.lists(quantities, min_size=2, max_size=3).map(tuple)
)
motions = st.one_of(
    st.builds(ast.Moving, st.just(NOWHERE), points, st.just("m/s"), st.just(NOWHERE)),
    st.builds(ast.Moving, st.just(NOWHERE), points),
    st.builds(ast.Along, st.just(NOWHERE), st.lists(_waypoints, min_size=1, max_size=3).map(tuple)),
    st.builds(ast.AlongFile, st.just(NOWHERE), files),
)


def _named(*texts: str) -> st.SearchStrategy[ast.Name]:
    return st.builds(ast.Name, st.just(NOWHERE), st.sampled_from(texts))


def _settings(relation: str, *texts: str) -> st.SearchStrategy[ast.Setting]:
    return st.builds(ast.Setting, st.just(NOWHERE), _named(*texts), st.just(relation), quantities)


_bounds = st.one_of(
    _settings("<=", "speed", "acceleration", "turn"),
    _settings("", "speed"),
    st.builds(ast.Setting, st.just(NOWHERE), _named("speed"), st.just(".."), quantities, quantities),
)
_dynamics = st.builds(
    ast.Dynamics,
    st.just(NOWHERE),
    _named("unicycle", "single_integrator", "double_integrator"),
    st.lists(_bounds, max_size=2).map(tuple),
)
_points = st.one_of(
    st.builds(ast.AtPoints, st.just(NOWHERE), point_lists),
    st.builds(ast.OnLine, st.just(NOWHERE), points, points),
    st.builds(ast.OnGrid, st.just(NOWHERE), points, points),
    st.builds(ast.AtListed, st.just(NOWHERE), files),
)
_places = st.one_of(st.builds(ast.InRegion, st.just(NOWHERE), references), _points)
_items = st.one_of(
    _dynamics,
    st.builds(ast.Start, st.just(NOWHERE), _places),
    st.builds(ast.Finish, st.just(NOWHERE), _places),
    _settings("", "radius", "altitude"),
    st.builds(
        ast.Vehicle,
        st.just(NOWHERE),
        _named("crazyflie21", "plain"),
        st.lists(st.one_of(_bounds, _settings("", "tracking", "memory")), max_size=3).map(tuple),
    ),
    st.builds(ast.Yaw, st.just(NOWHERE), st.none() | quantities),
    st.builds(
        ast.Flight,
        st.just(NOWHERE),
        st.lists(
            st.one_of(
                st.builds(ast.Pads, st.just(NOWHERE), _points),
                _settings("", "hover"),
                _settings("<=", "rise", "land"),
            ),
            max_size=3,
        ).map(tuple),
    ),
)
_links = st.builds(ast.Link, st.just(NOWHERE), counts, counts, quantities)


@st.composite
def formations(draw: st.DrawFn) -> ast.Formation:
    kind = draw(_named("line", "chain", "circle", "grid", "star", "offsets", "distances"))
    settings = draw(st.lists(_settings("", "spacing", "radius", "heading", "rows", "columns"), max_size=2))
    settings.append(draw(_settings("", "tolerance")))
    return ast.Formation(
        NOWHERE,
        draw(declared),
        kind,
        draw(agents),
        tuple(settings),
        draw(point_lists | files) if kind.text == "offsets" else (),
        draw(st.lists(_links, min_size=1, max_size=3).map(tuple)) if kind.text == "distances" else (),
        draw(st.booleans()),
    )


_some_pairs = st.lists(st.builds(ast.OfPair, st.just(NOWHERE), agents, agents, quantities), min_size=1, max_size=3).map(
    tuple
)

_rates = st.builds(ast.Rate, st.just(NOWHERE), names, quantities, st.none() | _named(*UNITS), st.none() | references)
_marks = st.builds(ast.Mark, st.just(NOWHERE), names, references)
labels = (
    st.none()
    | _named("relay", "reach", "always", "line", "G", "region", "end")
    | declared.filter(lambda name: isinstance(name, ast.FamilyName))
)
_file_options = st.one_of(
    st.builds(ast.FileOption, st.just(NOWHERE), st.sampled_from(["at", "origin"]), points),
    st.builds(ast.FileOption, st.just(NOWHERE), st.just("layer"), st.sampled_from([("A",), ("A B", "#1")])),
    st.builds(ast.FileOption, st.just(NOWHERE), st.sampled_from(["unknown", "named"]), names.map(lambda n: (n.text,))),
)
_heights = st.builds(ast.Height, st.just(NOWHERE), quantities, quantities)
FILES = st.sampled_from(["lanes.graphml", "site/all lanes.graphml"])
declarations = st.one_of(
    st.builds(ast.MissionName, st.just(NOWHERE), names),
    st.builds(ast.Param, st.just(NOWHERE), declared, quantities),
    st.builds(ast.Time, st.just(NOWHERE), quantities, quantities),
    st.builds(ast.World, st.just(NOWHERE), points, points),
    st.builds(ast.Region, st.just(NOWHERE), declared, shapes),
    st.builds(ast.Obstacle, st.just(NOWHERE), declared, shapes, st.none() | motions, st.none() | quantities),
    st.builds(ast.Beacon, st.just(NOWHERE), declared, points),
    st.builds(ast.Team, st.just(NOWHERE), declared, st.none() | counts, st.lists(_items, max_size=4).map(tuple)),
    st.builds(ast.Group, st.just(NOWHERE), declared, st.lists(agents, min_size=1, max_size=3).map(tuple)),
    st.builds(
        ast.Graph,
        st.just(NOWHERE),
        declared,
        st.sampled_from(["proximity", "beacons"]),
        quantities,
        st.none() | agents,
    ),
    st.builds(
        ast.Graph,
        st.just(NOWHERE),
        declared,
        st.sampled_from(["proximity", "sight"]),
        st.none() | quantities,
        st.none() | agents,
        _some_pairs,
        st.lists(st.builds(ast.Weight, st.just(NOWHERE), names, quantities, st.just(()) | _some_pairs), max_size=2).map(
            tuple
        ),
    ),
    formations(),
    st.builds(ast.Resource, st.just(NOWHERE), declared, agents, st.lists(_rates, min_size=1, max_size=4).map(tuple)),
    st.builds(ast.Flag, st.just(NOWHERE), declared, agents, st.lists(_marks, min_size=1, max_size=3).map(tuple)),
    st.builds(ast.Separation, st.just(NOWHERE), quantities),
    st.builds(ast.Clearance, st.just(NOWHERE), quantities),
    st.builds(ast.Let, st.just(NOWHERE), declared, formulas),
    st.builds(ast.Require, st.just(NOWHERE), labels, formulas),
    st.builds(ast.Prefer, st.just(NOWHERE), labels, formulas, st.none() | quantities),
    st.builds(ast.Tolerate, st.just(NOWHERE), quantities, agents),
    st.builds(
        ast.FromFile,
        st.just(NOWHERE),
        st.sampled_from(["obstacles", "regions", "beacons"]),
        files,
        st.lists(_settings("", "resolution", "within", "unit"), max_size=2).map(tuple),
        st.lists(_file_options, max_size=2).map(tuple),
        st.lists(_heights, max_size=1).map(tuple),
    ),
    st.builds(ast.Minimize, st.just(NOWHERE), _named("distance", "duration", "energy")),
    st.builds(ast.Maximize, st.just(NOWHERE), _named("robustness")),
    st.builds(
        ast.Solve,
        st.just(NOWHERE),
        _named("auto", "smt", "clot", "hybrid"),
        st.lists(_settings("=", "nodes", "neighbors"), max_size=2).map(tuple),
        st.lists(st.builds(ast.FileSetting, st.just(NOWHERE), _named("roadmap"), FILES), max_size=1).map(tuple),
    ),
)
programs = st.builds(ast.Program, st.just(NOWHERE), st.lists(declarations, min_size=1, max_size=6).map(tuple))
mission_texts = programs.map(show)

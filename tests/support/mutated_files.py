"""Input files with random changes: metadata, GeoJSON, tables, GraphML."""

from __future__ import annotations

import json
import random
import re
from collections.abc import Iterator

from missionc.base.diagnostics.render import render_json, render_text
from missionc.compiler.front_end import Checked
from tests.support.mapped_missions import YAML
from tests.support.mutated_texts import TOKEN, Mutation, double, drop, swap

RING = [[5, 10], [7, 10], [7, 12], [5, 12], [5, 10]]
SITE = {
    "type": "FeatureCollection",
    "features": [
        {
            "type": "Feature",
            "properties": {"name": name, "kind": kind, "radius": 1, "height": 2},
            "geometry": {"type": form, "coordinates": coordinates},
        }
        for name, kind, form, coordinates in (
            ("tank", "obstacle", "Polygon", [RING]),
            ("mast", None, "Point", [8, 2]),
            ("pair", "region", "MultiPolygon", [[RING]]),
            ("dots", None, "MultiPoint", [[16, 2], [18, 4]]),
        )
    ],
}
LANES = """<graphml xmlns="http://graphml.graphdrawing.org/xmlns">
<key id="x" for="node" attr.name="x" attr.type="double"/><key id="y" for="node" attr.name="y" attr.type="double"/>
<key id="v" for="edge" attr.name="speed" attr.type="double"><default>2</default></key>
<graph edgedefault="undirected">
<node id="a"><data key="x">1</data><data key="y">1</data></node>
<node id="b"><data key="x">1</data><data key="y">5</data></node>
<node id="c"><data key="x">1</data><data key="y">8</data></node>
<node id="d"><data key="x">2</data><data key="y">9</data></node>
<edge source="a" target="b"><data key="v">1</data></edge><edge source="b" target="c"/><edge source="c" target="d"/>
</graph></graphml>
"""
FILES: dict[str, str] = {
    "hall.pgm": "P2\n4 4\n255\n254 254 254 254\n254 0 0 254\n254 254 254 254\n205 254 254 254\n",
    "hall.yaml": YAML,
    "site.geojson": json.dumps(SITE, indent=1),
    "rows.csv": "name,kind,x,y,radius,width,depth,angle\npost,obstacle,9,9,0.5,,,\nrack,obstacle,12,9,,4,2,90\n"
    "mast,beacon,1,9,,,,\n",
    "starts.csv": "x,y\n1,8\n2,9\n",
    "lanes.graphml": LANES,
}
SAID = """obstacles from "hall.yaml"
obstacles from "site.geojson" unit 1 m named s
regions from "site.geojson" unit 1 m named r
beacons from "site.geojson" unit 1 m named b
obstacles from "rows.csv" named o
beacons from "rows.csv" named m
team pair[2] { radius 0.1 m  dynamics single_integrator(speed <= 2 m/s)  start from "starts.csv" }
solve with smt { roadmap = "lanes.graphml" }
"""
"""Mission that reads all of them."""

ODD = (
    *(
        "",
        "null",
        "true",
        "[]",
        "{}",
        "[null]",
        "{x: 1}",
        '{"x": 1}',
        '""',
        ",,,\n",
        ",",
        ";",
        "\t",
        "\n\n",
        "\0",
        "\ufeff",
    ),
    *("nan", "-nan", ".inf", "1e400", "-1", "0", "1_0", "0x10", "\u0661", "9" * 30, "1,5", "12 m", "[[[1]]]", "é", "𝄞"),
    *(
        "&a [*a]",
        "!!python/name:os.system",
        "<<: {a: 1}",
        "? [a]: b",
        "- 1",
        "|",
        "&lt;",
        "<node/>",
        "<!DOCTYPE a>",
        "]]>",
    ),
    *('"LineString"', '"GeometryCollection"', '"kind"', "'", '"', "\\", "\\ud800", "radius", "height"),
)


def replace(tokens: list[str], chance: random.Random) -> None:
    tokens[chance.randrange(len(tokens))] = chance.choice(ODD)


def insert(tokens: list[str], chance: random.Random) -> None:
    tokens.insert(chance.randrange(len(tokens) + 1), chance.choice(ODD))


def value(tokens: list[str], chance: random.Random) -> None:
    """Replace a word or a number by an odd value."""
    places = [place for place, token in enumerate(tokens) if token.isalnum()]
    if places:
        tokens[chance.choice(places)] = chance.choice(ODD)


def cut(tokens: list[str], chance: random.Random) -> None:
    del tokens[chance.randrange(len(tokens)) :]


MUTATIONS: tuple[Mutation, ...] = (drop, double, swap, replace, insert, value, value, value)


def mutated_files(seed: int) -> dict[str, str]:
    """Files with one change; the same seed gives the same texts."""
    chance = random.Random(seed)
    name = list(FILES)[seed % len(FILES)]
    tokens = TOKEN.findall(FILES[name])
    for _ in range(chance.choice((1, 1, 1, 2, 4))):
        chance.choice(MUTATIONS)(tokens, chance)
        tokens = tokens or [""]
    if chance.random() < 0.05:
        cut(tokens, chance)
    return {**FILES, name: "".join(tokens)}


OF_PYTHON = re.compile(r"Node\(|tag:yaml|object at 0x|NoneType|\b(None|True|False)\b|indices|Error\b|Traceback|<class")
"""Python values and errors, which a message must not contain outside of quotes from a file."""


def faults(checked: Checked) -> Iterator[str]:
    """Faults of findings themselves: unprintable, in Python's terms, or without a place."""
    findings = list(checked.findings)
    json.dumps(render_json(findings), allow_nan=False)
    if render_text(findings, colour=False).count("[MC") < len(findings):
        yield "a finding is not shown"
    for finding in findings:
        if OF_PYTHON.search(re.sub(r"`[^`]*`", "``", finding.words)) or not finding.message:
            yield f"in the words of Python: {finding.words}"
        for label in filter(None, (finding.primary, *finding.labels)):
            if not 0 <= label.span.start <= label.span.end <= len(label.span.source.text):
                yield f"nowhere in a text: {finding.words}"

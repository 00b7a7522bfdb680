"""A DXF drawing compared with its area in ezdxf; if corrupted, an answer or a coded message."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import numpy as np

from farm.trial import Broken, Case, Kind
from missionc.base.diagnostics.map_error import MapError

DRAWING = "floor.dxf"
HOSTILE = ("nan", "inf", "-1", "0", "1e300", "32767", "1000000", "-0.0", "1e-300")
"""Values that replace others."""

NUMBERS = {str(code) for code in (*range(10, 79), *range(210, 240))}
"""Group codes of coordinates, sizes, angles, counts and flags."""


def draw(generator: np.random.Generator) -> Case:
    if not find_spec("ezdxf"):
        return Case()
    from tests.support.random_drawings import random_drawing

    text = random_drawing(generator)
    if generator.random() < 0.6:
        return Case({DRAWING: text})
    lines = text.splitlines()
    numbers = [at for at in range(lines.index("BLOCKS"), len(lines), 2) if lines[at - 1].strip() in NUMBERS]
    for at in generator.choice(numbers, int(generator.integers(1, 6))):
        lines[at] = str(generator.choice(HOSTILE)) if generator.random() < 0.9 else lines[at - 2]
    return Case({DRAWING: "\n".join(lines)}, {"spoilt": True})


def carry_out(case: Case, folder: Path) -> str:
    if not case.files:
        return "skipped, ezdxf is not installed"
    import shapely

    from missionc.frontend.maps.drawing import drawing
    from missionc.frontend.maps.dxf.areas import SAGITTA
    from tests.support.random_drawings import FINE, asked, polygons_of, referee_area

    try:
        read = {kind: drawing(asked(case.files[DRAWING], kind)).features for kind in ("region", "obstacle", "beacon")}
    except MapError as error:
        if not case.settings:
            raise Broken("refusal", "A drawing of closed outlines can be read.", error) from None
        return f"refused {error.finding.code.name}"
    if case.settings:
        return "read"
    drawn = referee_area(case.files[DRAWING])
    area, grown = (
        shapely.union_all([polygons_of(each.shape) for each in read[kind]]) for kind in ("region", "obstacle")
    )
    chords = (SAGITTA + FINE) * drawn.length + 1e-6
    seen = f"{area.area} and {grown.area} are read of {drawn.area}"
    if shapely.symmetric_difference(area, drawn).area > chords:
        raise Broken("area of a region", "A region is the area that is drawn, but for chords of arcs.", seen)
    if shapely.difference(drawn, grown).area > 2 * FINE * drawn.length or grown.area > drawn.area + 2 * chords:
        raise Broken("area of an obstacle", "An obstacle covers the drawn area, and little more.", seen)
    return "the same area"


DRAWINGS = Kind(
    "drawings", "a DXF drawing, compared with its area according to ezdxf", draw, carry_out, 60.0, of_text=False
)

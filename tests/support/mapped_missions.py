"""Missions in a folder with the files of their worlds."""

from __future__ import annotations

from collections.abc import Mapping
from io import BytesIO
from pathlib import Path

import numpy as np
from PIL import Image

from missionc.base.diagnostics.model import Diagnostic
from missionc.base.limits import Limits
from missionc.compiler.driver import check
from missionc.ir import Mission

HEAD = """mission site
time  step 1 s, horizon 30 s
world (0, 0) to (20, 20)
region base = box (0.5, 0.5) to (3, 3)
region goal = box (0.5, 4) to (3, 6)
agent scout { radius 0.1 m  dynamics single_integrator(speed <= 2 m/s)  start in base }
require there: scout: eventually[0, 30 s] goal
"""

YAML = """image: hall.pgm
resolution: 0.5
origin: [4.0, 5.0, 0.0]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.196
"""


def picture(*rows: str, form: str = "PPM") -> bytes:
    """Image with one letter for each cell, from above: ``#`` is black, ``?`` unknown, anything else white."""
    shades = np.array([[{"#": 0, "?": 205}.get(cell, 254) for cell in row] for row in rows], dtype=np.uint8)
    stream = BytesIO()
    Image.fromarray(shades).save(stream, form)
    return stream.getvalue()


def written(folder: Path, mission: str, files: Mapping[str, str | bytes]) -> Path:
    """Write the mission to a folder, with its files."""
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    (folder / "site.mission").write_text(HEAD + mission, encoding="utf-8")
    return folder / "site.mission"


def meant(folder: Path, mission: str, files: Mapping[str, str | bytes]) -> Mission:
    """Resolved mission, which must have no error."""
    checked = check(written(folder, mission, files))
    assert checked.mission is not None, checked.findings
    assert checked.ok, checked.findings
    return checked.mission


def findings(
    folder: Path, mission: str, files: Mapping[str, str | bytes], limits: Limits | None = None
) -> list[Diagnostic]:
    return list(check(written(folder, mission, files), limits=limits).findings)


def only(folder: Path, mission: str, files: Mapping[str, str | bytes], limits: Limits | None = None) -> Diagnostic:
    """Single finding."""
    (finding,) = findings(folder, mission, files, limits)
    return finding

"""A small mission with takeoff and landing, and its compiled folder, made once."""

from __future__ import annotations

import tempfile
from functools import cache
from pathlib import Path

from missionc.base.source import Source
from missionc.cli.app import main
from missionc.compiler.driver import check
from missionc.ir import Mission
from tests.support.forged_folders import Files

HALL = """\
mission hall
time  step 1 s, horizon 8 s
world (0, 0, 0) to (6, 6, 2.5)
region goal = box (2.5, 0.5, 0.5) to (4, 3, 1.5)
team drone[2] {
  vehicle  crazyflie21
  dynamics single_integrator(speed <= 0.4 m/s)
  start    at (1, 1, 1), (1, 2, 1)
  finish   at (3, 1, 1), (3, 2, 1.2)
  flight   { pads at (1, 4, 0), (2, 4, 0)  hover 0.8 m  rise <= 0.3 m/s }
}
require reach: every drone: eventually[0, 8 s] goal
solve with smt { nodes = 60 }
"""


@cache
def compiled() -> Files:
    """Compiled folder with exports."""
    with tempfile.TemporaryDirectory() as name:
        (Path(name) / "hall.mission").write_text(HALL)
        words = ["compile", f"{name}/hall.mission", "-o", f"{name}/out", "--quiet", "--export", "cflib,px4,skybrush"]
        assert main(words) == 0
        out = Path(name) / "out"
        return {str(path.relative_to(out)): path.read_bytes() for path in out.rglob("*") if path.is_file()}


@cache
def mission() -> Mission:
    checked = check(Source("hall.mission", HALL))
    assert checked.mission is not None
    return checked.mission

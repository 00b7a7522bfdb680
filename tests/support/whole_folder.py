"""A compiled folder with all kinds of files, made once."""

from __future__ import annotations

import tempfile
from contextlib import redirect_stderr, redirect_stdout
from functools import cache
from io import StringIO
from pathlib import Path

from missionc.cli.app import main
from tests.support.forged_folders import Files
from tests.support.small_missions import SMALL

MISSION = (
    SMALL.replace("horizon 6 s", "horizon 4 s").replace("[0, 6 s]", "[0, 4 s]")
    + """\
graph radio = proximity 3 m
obstacle post = disc at (2, 0.5) radius 0.2 m
require near: always[0, 4 s] connected(radio)
prefer mild: drone[0]: eventually[0, 4 s] goal
"""
)


@cache
def files() -> Files:
    """Files of a folder with exports and a simulation."""
    with tempfile.TemporaryDirectory() as name:
        (Path(name) / "a.mission").write_text(MISSION)
        folder = Path(name) / "out"
        said = StringIO()
        with redirect_stdout(said), redirect_stderr(said):
            exports = "crazyswarm2,cflib,skybrush,ros2,px4"
            compiled = main(["compile", f"{name}/a.mission", "-o", str(folder), "--export", exports])
            assert compiled == 0, said.getvalue()
            assert main(["simulate", str(folder)]) in (0, 3), said.getvalue()
            assert main(["verify", str(folder)]) == 0, said.getvalue()
        return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
